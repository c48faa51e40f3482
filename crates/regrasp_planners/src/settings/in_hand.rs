//! Settings of the in-hand planner, in groups.

use super::flat::FlatSettings;
use super::{BaselineSettings, FirstTry, ImprovementSettings, Method, SearchSettings};
use regrasp_manipulation::settings::{PhysicsSettings, TransferMode};
use regrasp_scene::Limits;
use serde::{Deserialize, Serialize};

/// Least `step`, in metres: finer steps take longer than any budget of time looks.
const LEAST_STEP: f64 = 1e-5;
/// Least `joint_step`, in radians or metres.
const LEAST_JOINT_STEP: f64 = 1e-4;
/// Most `candidates` and `candidates_kept`.
const MOST_CANDIDATES: usize = 10_000;
/// Largest `wander_distance`, in metres: farther than any hand reaches, and steps are tried all along it.
const MOST_WANDERING: f64 = 1.0;

/// Settings of [`crate::plan_in_hand`]. In files they have no groups: every key stands by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "FlatSettings", into = "FlatSettings")]
pub struct InHandSettings {
    /// Algorithm.
    pub method: Method,
    /// Threads that may search at once; the plan does not depend on it, and no file has it. At least 1.
    pub n_threads: usize,
    /// Whether a search that failed also tries which change of the scene would have helped, by short searches of its own. No part of plan
    /// files: it changes no plan.
    pub advise: bool,
    /// What motions keep, and how they are carried out.
    pub physics: PhysicsSettings,
    /// How grasps and motions are looked for.
    pub search: SearchSettings,
    /// What the methods of Saut 2011 are asked beside.
    pub baselines: BaselineSettings,
    /// What is done about a plan after the first.
    pub improvement: ImprovementSettings,
}

impl Default for InHandSettings {
    fn default() -> Self {
        InHandSettings {
            method: Method::Gait,
            n_threads: 1,
            advise: true,
            physics: PhysicsSettings::default(),
            search: SearchSettings::default(),
            baselines: BaselineSettings::default(),
            improvement: ImprovementSettings::default(),
        }
    }
}

impl InHandSettings {
    /// The settings of geometry alone, as in Saut 2011: contacts stay where they are while the object moves, all of the
    /// friction is counted on, links keep away no farther than they must, and nobody asks about forces.
    pub fn plain() -> Self {
        InHandSettings {
            physics: PhysicsSettings {
                transfer: TransferMode::Fixed,
                friction_margin: 1.0,
                forces: None,
                ..PhysicsSettings::default()
            },
            search: SearchSettings { first_try: None, ..SearchSettings::default() },
            ..InHandSettings::default()
        }
    }

    /// The same within the limits of a scene, which no plan may exceed.
    #[must_use]
    pub fn within(&self, limits: &Limits) -> Self {
        InHandSettings { physics: self.physics.within(limits), ..self.clone() }
    }

    /// What is wrong with the settings, if anything: one sentence per field.
    pub fn validate(&self) -> Result<(), String> {
        let positive = [
            ("step", self.physics.step),
            ("clearance", self.physics.clearance),
            ("joint_step", self.physics.joint_step),
            ("wander_distance", self.search.wander_distance),
            ("wander_angle", self.search.wander_angle),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("{name} is {value}; it must be positive and finite"));
            }
        }
        for (name, value, least) in
            [("step", self.physics.step, LEAST_STEP), ("joint_step", self.physics.joint_step, LEAST_JOINT_STEP)]
        {
            if value < least {
                return Err(format!("{name} is {value}; it must be at least {least}"));
            }
        }
        for (name, value) in [("candidates", self.search.candidates), ("candidates_kept", self.search.candidates_kept)]
        {
            if value > MOST_CANDIDATES {
                return Err(format!("{name} is {value}; it must be at most {MOST_CANDIDATES}"));
            }
        }
        if self.search.wander_distance > MOST_WANDERING {
            let value = self.search.wander_distance;
            return Err(format!("wander_distance is {value}; it must be at most {MOST_WANDERING} m"));
        }
        if let Some(FirstTry { clearance, .. }) = self.search.first_try
            && !(clearance > 0.0 && clearance < 0.1)
        {
            return Err(format!("first_try.clearance is {clearance}; it must be above 0 and below 0.1 m"));
        }
        for (name, value) in [
            ("closure_margin", self.physics.closure_margin),
            ("first_try.closure_margin", self.search.first_try.map_or(0.0, |first| first.closure_margin)),
            ("edge_margin", self.physics.edge_margin),
            ("contact_allowance", self.physics.contact_allowance),
            ("limit_margin", self.physics.limit_margin),
            ("far_share", self.search.far_share),
            ("passage_share", self.search.passage_share),
            ("goal_share", self.search.goal_share),
            ("guided_share", self.baselines.guided_share),
            ("free_share", self.search.free_share),
            ("shorten_share", self.improvement.shorten_share),
            ("end_margin", self.improvement.end_margin),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("{name} is {value}; it must be between 0 and 1"));
            }
        }
        if !(self.physics.friction_margin >= 1.0 && self.physics.friction_margin <= 100.0) {
            return Err(format!("friction_margin is {}; it must be between 1 and 100", self.physics.friction_margin));
        }
        if self.search.search_work == Some(0) {
            return Err("search_work is 0; it must be at least 1, or null".into());
        }
        if self.n_threads == 0
            || self.search.candidates == 0
            || self.search.candidates_kept == 0
            || self.search.restart_work == 0
        {
            return Err("n_threads, candidates, candidates_kept and restart_work must be at least 1".into());
        }
        if self.physics.lift_heights.is_empty() || self.physics.lift_heights.iter().any(|h| !(*h > 0.0 && *h < 0.2)) {
            return Err("lift_heights must be a list of heights between 0 and 0.2 m".into());
        }
        self.improvement.cost.validate()?;
        if let Some(forces) = &self.physics.forces {
            forces.validate()?;
        }
        self.physics.speed.validate()?;
        self.baselines.alpha.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::InHandSettings;
    use regrasp_scene::Limits;

    #[test]
    fn bad_settings_are_told() {
        assert_eq!(InHandSettings::default().validate(), Ok(()));
        let read = |text: &str| serde_json::from_str::<InHandSettings>(text);
        for (text, message) in [
            (
                r#"{"forces": {"normal_force": [5, 2]}}"#,
                "forces.normal_force is [5, 2]; it must be the least and a larger largest force, between 0 and 10000 N",
            ),
            (
                r#"{"forces": {"squeeze": 1}}"#,
                "forces.squeeze is 1; it must be above 0 and between the normal forces 2 and 15 N",
            ),
            (r#"{"forces": {"torque_share": 1.5}}"#, "forces.torque_share is 1.5; it must be above 0 and at most 1"),
            (r#"{"forces": {"cone_weight": -1}}"#, "forces.cone_weight is -1; it must be between 0 and 1000"),
            (r#"{"forces": {"squeeze_weight": 0}}"#, "forces.squeeze_weight is 0; it must be above 0 and at most 1000"),
            (r#"{"speed": {"largest_speed": 0}}"#, "speed.largest_speed is 0; it must be between 0.000001 and 1000000"),
            (r#"{"step": 3e-9}"#, "step is 0.000000003; it must be at least 0.00001"),
            (r#"{"wander_distance": 1e10}"#, "wander_distance is 10000000000; it must be at most 1 m"),
            (r#"{"candidates": 2147483647}"#, "candidates is 2147483647; it must be at most 10000"),
            (r#"{"speed": {"ramp": -1}}"#, "speed.ramp is -1; it must be between 0 and 60 seconds"),
        ] {
            assert_eq!(read(text).unwrap().validate(), Err(message.into()), "{text}");
        }
        // Gravity belongs to the scene: what is judged by the scene's must not be planned under another.
        for text in [r#"{"gravity": "any"}"#, r#"{"forces": {"fmax": 3}}"#] {
            assert!(read(text).is_err(), "{text}");
        }
        assert_eq!(read(r#"{"forces": null}"#).unwrap().physics.forces, None);
    }

    #[test]
    fn settings_are_bounded_by_the_limits_of_the_scene() {
        let settings = InHandSettings::default();
        assert_eq!(settings.within(&Limits::default()), settings);
        let tight = Limits {
            largest_speed: 0.01,
            joint_velocity: 0.5,
            joint_acceleration: 3.0,
            normal_force: 3.0,
            friction_margin: Some(2.0),
        };
        let within = settings.within(&tight);
        let (speed, forces) = (within.physics.speed, within.physics.forces.unwrap());
        assert_eq!((speed.largest_speed, speed.joint_velocity, speed.joint_acceleration), (0.01, 0.5, 3.0));
        assert_eq!((forces.normal_force, forces.squeeze, within.physics.friction_margin), ([2.0, 3.0], 3.0, 2.0));
    }
}
