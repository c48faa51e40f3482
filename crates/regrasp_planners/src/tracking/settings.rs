//! Settings of finger tracking. Lengths in metres, angles in radians, velocities per second.

use crate::settings::InHandSettings;
use regrasp_manipulation::settings::ForceSettings;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

/// What fingers may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum TrackingMethod {
    /// They never leave the object (Cherif 1999).
    #[default]
    #[serde(rename = "tracking")]
    Tracking,
    /// Where tracking gets no farther, one is relocated through the air while the others hold.
    #[serde(rename = "tracking+gaiting")]
    TrackingAndGaiting,
}

impl TrackingMethod {
    /// All of them.
    pub const ALL: [TrackingMethod; 2] = [TrackingMethod::Tracking, TrackingMethod::TrackingAndGaiting];

    /// As settings, plans and command lines spell it.
    pub fn name(self) -> &'static str {
        match self {
            TrackingMethod::Tracking => "tracking",
            TrackingMethod::TrackingAndGaiting => "tracking+gaiting",
        }
    }
}

/// Which resting finger the object rolls on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RollingFinger {
    /// Any, chosen at each moment (Cherif 1999, scenarios D-1, D-2 and F-1).
    #[default]
    Any,
    /// One, chosen once in the beginning (scenarios D-3, D-4 and F-2).
    Once,
}

/// How the local planner chooses which fingers move and on which one the object rolls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RoleChoice {
    /// Those that lead best towards the sub-goal and whose moving fingers have reach left, with some chance.
    #[default]
    Aligned,
    /// Any that lead towards it, drawn at random (Cherif 1999, sec. 6.2.4).
    Random,
}

/// Where contact forces of fingertips that do not slide are (Cherif 1999, sec. 6.2.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cones {
    /// In pyramids of four sides inscribed in the friction cones; of least power, as in Cherif 1999.
    Pyramid,
    /// In the cones; well inside them, near the normal force that the settings wish for.
    #[default]
    Exact,
}

/// Settings of [`crate::tracking::plan_tracking`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackingSettings {
    /// What fingers may do.
    pub method: TrackingMethod,
    /// Time of the shortest step (Cherif 1999, table 2: 0.1 s, of every step).
    pub time_step: f64,
    /// Time of a step where the contacts allow it. It is halved, down to `time_step`, where a resting fingertip slides down from an edge or
    /// changes its direction by too much, where a moving one would twist by too much on the way, and, without `face_changes`, where it would
    /// leave its face. By measurement: with 0.4 plans take a third of the time that they take with 0.1.
    pub longest_step: f64,
    /// Time of a step in which the object rests while a fingertip rolls back on one face.
    pub rest_step: f64,
    /// Time from a node to its sub-goals (table 2: 2 s).
    pub sub_goal_time: f64,
    /// Edge of the cells of the orientation space (table 2: 2.406 degrees).
    pub cell: f64,
    /// Largest angle left to the goal's orientation; half a cell.
    pub goal_tolerance: f64,
    /// Extreme angular velocity of the object about each axis (table 3: 1.43 degrees per second).
    pub object_velocity: f64,
    /// Extreme rolling velocity of the moving finger about each tangent (table 3: 2.86 degrees per second).
    pub rolling_velocity: f64,
    /// True where the moving finger may go from face to face of the object (scenarios D-1 and D-3).
    pub face_changes: bool,
    /// Fingers that rest while the object moves, 3 as in Cherif 1999, or 2; the others move. Hands of three fingers rest two.
    pub resting_fingers: usize,
    /// Whether with four fingers two may rest in place of three: in three of four searches, also in the first. Cherif 1999 always rests
    /// three. By measurement, random turns by 60 degrees from start grasps of the planner's choice, football: 25 of 25 with two, 3 of 15
    /// with three. In simulation plans with two end nearer to the goal (docs/benchmarks/tracking.md).
    pub fewer_rest: bool,
    /// Start grasps of the planner's choice: a search that is begun anew begins from another one, until there are so many. With 1 the
    /// first is kept.
    pub start_grasps: usize,
    /// Which finger the object rolls on.
    pub rolling_finger: RollingFinger,
    /// How the roles of fingers are chosen.
    pub roles: RoleChoice,
    /// Longest time of a local plan, in units of `sub_goal_time` (Cherif 1999, sec. 6.2.4, `bound_1`: 2).
    pub local_time: f64,
    /// Whether the local planner asks for the ranges of orientations R_j (Cherif 1999, sec. 4). Roles are then taken only where the
    /// range of the fingers that rest has the sub-goal. Where no range has it, all fingertips first go back to their first contacts,
    /// which makes a new range about the object's orientation. Sub-goals that no range has even then are not tried.
    /// Needs `resting_fingers = 3` and `fewer_rest = false`.
    pub range_coverage: bool,
    /// Where forces are.
    pub cones: Cones,
    /// Choices tried in a row before a sub-goal is given up (Cherif 1999, sec. 6.2.4, `bound_2`: 50).
    pub trials: usize,
    /// What the distance left to the goal counts in the order in which sub-goals are tried, beside the way to them: 1 is the
    /// Cherif 1999's A*. By measurement: with 1 neither diamond nor football is solved within 40,000 steps, with 1.2 both in 1,500, with
    /// 1.5 in 1,700.
    pub goal_weight: f64,
    /// Nodes of the search over orientations; then it begins anew with other random numbers. By hand.
    pub nodes: usize,
    /// Sub-goals tried in a row that lead no nearer to the goal, before the search begins anew. By measurement: of 40 turns of the diamond
    /// from start grasps of the planner's choice 39 are solved with 3, 35 with 8 and 30 with 20, within the same work.
    pub patience: usize,
    /// What in-hand planning is asked: clearance, speed, forces, friction margin. The friction of fingertips that slide is that of the
    /// scene, without the margin. Keys that a file does not give, also of `forces`, are tracking's, not in-hand planning's.
    #[serde(deserialize_with = "over_defaults")]
    pub in_hand: InHandSettings,
}

/// In-hand settings of which a file gives some.
fn over_defaults<'de, D: Deserializer<'de>>(deserializer: D) -> Result<InHandSettings, D::Error> {
    let mut whole = serde_json::to_value(TrackingSettings::default().in_hand).map_err(D::Error::custom)?;
    let given = Value::deserialize(deserializer)?;
    let (Value::Object(whole_keys), Value::Object(given)) = (&mut whole, given) else {
        return Err(D::Error::custom("in_hand is an object"));
    };
    for (key, value) in given {
        match (whole_keys.get_mut(&key), value) {
            (Some(Value::Object(forces)), Value::Object(some)) if key == "forces" => forces.extend(some),
            (_, value) => {
                whole_keys.insert(key, value);
            }
        }
    }
    serde_json::from_value(whole).map_err(D::Error::custom)
}

impl Default for TrackingSettings {
    fn default() -> Self {
        TrackingSettings {
            method: TrackingMethod::Tracking,
            time_step: 0.1,
            longest_step: 0.4,
            rest_step: 0.5,
            sub_goal_time: 2.0,
            cell: 2.406f64.to_radians(),
            goal_tolerance: 1.203f64.to_radians(),
            object_velocity: 1.43f64.to_radians(),
            rolling_velocity: 2.86f64.to_radians(),
            face_changes: true,
            resting_fingers: 3,
            fewer_rest: true,
            start_grasps: 10,
            rolling_finger: RollingFinger::Any,
            roles: RoleChoice::Aligned,
            local_time: 5.0,
            range_coverage: false,
            cones: Cones::Exact,
            trials: 50,
            goal_weight: 1.2,
            nodes: 2000,
            patience: 3,
            in_hand: with_forces(InHandSettings::default(), 1.3, [0.5, 20.0]),
        }
    }
}

/// `settings` with another friction margin and other limits of the normal forces, whatever friction they need: forces of fingertips that
/// roll and slide are chosen by their power.
fn with_forces(mut settings: InHandSettings, friction_margin: f64, normal_force: [f64; 2]) -> InHandSettings {
    let forces = settings.physics.forces.unwrap_or_default();
    settings.physics.friction_margin = friction_margin;
    settings.physics.forces = Some(ForceSettings { normal_force, cone_weight: 0.0, ..forces });
    settings
}

impl TrackingSettings {
    /// These settings with the forces of Cherif 1999, sec. 6.2.3: in pyramids, of least power, without a margin, of fingertips that may
    /// touch without pressing. The largest normal force is ours; Cherif 1999 has none.
    pub fn with_forces_of_cherif_1999(self) -> Self {
        TrackingSettings { cones: Cones::Pyramid, in_hand: with_forces(self.in_hand, 1.0, [0.0, 80.0]), ..self }
    }

    /// The choices of Cherif 1999, as far as they are settings: its forces, three fingers that rest, roles at random, local plans of at most
    /// twice the time to a sub-goal, A* with weight 1 that is never begun anew for want of progress.
    pub fn of_cherif_1999() -> Self {
        let choices = TrackingSettings {
            longest_step: 0.1,
            fewer_rest: false,
            start_grasps: 1,
            roles: RoleChoice::Random,
            local_time: 2.0,
            goal_weight: 1.0,
            patience: 1_000_000,
            ..TrackingSettings::default()
        };
        choices.with_forces_of_cherif_1999()
    }

    /// Errors: the first value that makes no sense.
    pub fn validate(&self) -> Result<(), String> {
        let positive = [
            ("time_step", self.time_step),
            ("longest_step", self.longest_step),
            ("rest_step", self.rest_step),
            ("sub_goal_time", self.sub_goal_time),
            ("cell", self.cell),
            ("goal_tolerance", self.goal_tolerance),
            ("object_velocity", self.object_velocity),
            ("rolling_velocity", self.rolling_velocity),
            ("goal_weight", self.goal_weight),
            ("local_time", self.local_time),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("{name} is {value}; it must be positive and finite"));
            }
        }
        if self.longest_step < self.time_step {
            return Err(format!("longest_step is {}, less than time_step {}", self.longest_step, self.time_step));
        }
        if self.sub_goal_time < self.longest_step {
            return Err(format!(
                "sub_goal_time is {}, less than longest_step {}",
                self.sub_goal_time, self.longest_step
            ));
        }
        if self.goal_tolerance > self.cell {
            return Err(format!("goal_tolerance is {}, more than a cell of {}", self.goal_tolerance, self.cell));
        }
        if self.in_hand.physics.forces.is_none() {
            return Err("in_hand.forces is none; tracking needs forces".into());
        }
        if !(2..=3).contains(&self.resting_fingers) {
            return Err(format!("resting_fingers is {}; it must be 2 or 3", self.resting_fingers));
        }
        if self.range_coverage && (self.resting_fingers != 3 || self.fewer_rest) {
            return Err("range_coverage needs three fingers that rest: resting_fingers = 3, fewer_rest = false".into());
        }
        if self.trials == 0 || self.nodes == 0 || self.start_grasps == 0 {
            return Err("trials, nodes and start_grasps are at least 1".into());
        }
        self.in_hand.validate().map_err(|message| format!("in_hand: {message}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_manipulation::settings::PhysicsSettings;

    fn read(text: &str) -> Result<TrackingSettings, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn keys_that_are_not_given_are_those_of_tracking() {
        let whole = TrackingSettings::default();
        assert_eq!(read("{}").unwrap(), whole);
        assert_eq!(read(r#"{"in_hand": {}}"#).unwrap(), whole);
        assert_eq!(read(&serde_json::to_string(&whole).unwrap()).unwrap(), whole);
        let some = read(r#"{"in_hand": {"clearance": 0.001, "forces": {"torque_share": 0.5}}}"#).unwrap();
        let forces = ForceSettings { torque_share: 0.5, ..whole.in_hand.physics.forces.unwrap() };
        let physics = PhysicsSettings { clearance: 0.001, forces: Some(forces), ..whole.in_hand.physics.clone() };
        let in_hand = InHandSettings { physics, ..whole.in_hand.clone() };
        assert_eq!(some, TrackingSettings { in_hand, ..whole });
        assert_eq!(read(r#"{"in_hand": {"forces": null}}"#).unwrap().in_hand.physics.forces, None);
    }

    #[test]
    fn the_file_of_the_papers_choices_has_them() {
        let file = include_str!("../../../../docs/benchmarks/tracking_paper.json");
        assert_eq!(read(file).unwrap(), TrackingSettings::of_cherif_1999());
    }

    #[test]
    fn keys_that_are_none_are_refused() {
        for text in [r#"{"in_hand": {"clearence": 1}}"#, r#"{"in_hand": {"forces": {"pull": 1}}}"#, r#"{"in_hand": 3}"#]
        {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
