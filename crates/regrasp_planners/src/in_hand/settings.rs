//! Settings of the in-hand planner. Every default says where it comes from.

mod physics;

pub use physics::{FirstTry, ForceSettings, SpeedSettings};

use serde::{Deserialize, Serialize};

/// Which algorithm plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Gait trees from start and goal that meet: relocate with look-ahead, transfer as far as possible. The default, by
    /// measurement.
    Gait,
    /// Paper 000: visibility PRM in GS_n, components joined by transfer-regrasp paths, dichotomic decomposition.
    Visibility,
    /// Paper 000's baseline: visibility PRM whose local method is one transfer-regrasp or regrasp-transfer.
    Classic,
}

/// How often `connect_components` is tried instead of `explore` (paper 000, section 5.2): alpha is the share of
/// `explore`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Alpha {
    /// The same all along.
    Constant {
        /// Value, in `[0, 1]`.
        value: f64,
    },
    /// From `start`, less by `step` at each attempt to merge components, down to `end` (paper 000, box: 0.5, 0.005, 0.3).
    Decreasing {
        /// First value.
        start: f64,
        /// Decrement per attempt.
        step: f64,
        /// Last value.
        end: f64,
    },
    /// Inverse to the size of the graph: `max(end, start / (1 + nodes / scale))` (paper 000, section 5.2, last remark).
    Adaptive {
        /// Value of the empty graph.
        start: f64,
        /// Lowest value.
        end: f64,
        /// Number of nodes at which the value is halved.
        scale: f64,
    },
    /// Biased by growth (paper 004, section IV-A, which gives no formula): merging has the probability `first` in the empty
    /// graph and comes nearer to `last` as the graph grows, half of the way at `scale` nodes.
    Growing {
        /// Probability of a merge in the empty graph.
        first: f64,
        /// Probability that it tends to.
        last: f64,
        /// Number of nodes at which half of the way is gone.
        scale: f64,
    },
}

impl Alpha {
    /// The share of exploration after `n_merges` attempts to merge components, with `n_nodes` in the graph.
    pub fn value(&self, n_merges: u32, n_nodes: usize) -> f64 {
        match *self {
            Alpha::Constant { value } => value,
            Alpha::Decreasing { start, step, end } => (start - step * f64::from(n_merges)).max(end),
            Alpha::Adaptive { start, end, scale } => (start / (1.0 + n_nodes as f64 / scale)).max(end),
            Alpha::Growing { first, last, scale } => {
                let grown = n_nodes as f64 / (n_nodes as f64 + scale);
                1.0 - (first + (last - first) * grown)
            }
        }
    }

    /// What is wrong with it, if anything.
    fn validate(&self) -> Result<(), String> {
        let (shares, above_zero) = match *self {
            Alpha::Constant { value } => ([value, value], 1.0),
            Alpha::Decreasing { start, step, end } => ([start, end], if step >= 0.0 { 1.0 } else { step }),
            Alpha::Adaptive { start, end, scale } => ([start, end], scale),
            Alpha::Growing { first, last, scale } => ([first, last], scale),
        };
        if shares.iter().all(|share| (0.0..=1.0).contains(share)) && above_zero > 0.0 && above_zero.is_finite() {
            return Ok(());
        }
        Err(format!("alpha is {self:?}; shares must be between 0 and 1, a step at least 0, a scale above 0"))
    }
}

/// What contacts do while the object moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TransferMode {
    /// Round fingertips roll without slipping, and contacts travel on both surfaces (paper 004, section IV-C). Sharp tips keep
    /// their contacts. The default: real tips roll, and in a simulation plans that ignore it end 12 to 29 degrees off
    /// (physics-notes, 3).
    Rolling,
    /// Contacts stay where they are on the object (paper 000, section 3.2), as if tips were points.
    Fixed,
}

/// When a finger may let go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReleaseRule {
    /// Where the other fingers are closed; grasps in between need closure of all only. The default: on real hands the
    /// paper's rule leaves too little (real-hands-notes, 2e).
    WhereOthersHold,
    /// Every set of n-1 fingers is closed in every grasp (paper 000, section 4.2.2).
    EverywhereEveryFinger,
}

/// What a plan costs: a weighted sum, of which improvement looks for less. Weights are at least 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CostWeights {
    /// Of one relocation.
    pub relocation: f64,
    /// Of a metre that the object goes; angles count with the object's radius.
    pub object_path: f64,
    /// Of a radian, or metre, that a joint goes, all joints together.
    pub joint_path: f64,
    /// Of a closure margin as small as the one asked for; one of twice that costs half.
    pub margin: f64,
}

impl Default for CostWeights {
    /// Relocations first: by hand, so that in the plans of the bundled scenes all the rest together costs about as much as
    /// one of them.
    fn default() -> Self {
        CostWeights { relocation: 1.0, object_path: 1.0, joint_path: 0.01, margin: 0.2 }
    }
}

impl CostWeights {
    fn validate(&self) -> Result<(), String> {
        let CostWeights { relocation, object_path, joint_path, margin } = *self;
        let weights =
            [("relocation", relocation), ("object_path", object_path), ("joint_path", joint_path), ("margin", margin)];
        match weights.iter().find(|(_, weight)| !(*weight >= 0.0 && *weight <= MAX_WEIGHT)) {
            Some((name, weight)) => Err(format!("cost.{name} is {weight}; it must be between 0 and {MAX_WEIGHT}")),
            None => Ok(()),
        }
    }
}

/// Largest weight of a cost: sums stay exact enough.
const MAX_WEIGHT: f64 = 1e6;

/// Settings of [`super::plan_in_hand`]. Lengths in metres, angles in radians.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InHandSettings {
    /// Algorithm.
    pub method: Method,
    /// Threads that may search at once; the plan does not depend on it. At least 1.
    #[serde(skip)]
    pub n_threads: usize,
    /// When a finger may let go; the methods of paper 000 always use the paper's rule.
    pub release_rule: ReleaseRule,
    /// What contacts do while the object moves.
    pub transfer: TransferMode,
    /// What the scene's friction coefficient is divided by: closure and forces count on that much only. At least 1. The default
    /// kept 20 of 20 plans in simulation where 1 kept 2 of 8 (physics-notes, 3).
    pub friction_margin: f64,
    /// Closure margin asked of every holding set; dimensionless, in `[0, 1)`. See `regrasp_grasp::margin`. By hand:
    /// 0.005 is about a tenth of what a good grasp of three has.
    pub closure_margin: f64,
    /// Longest step of the object or a fingertip between waypoints (in-hand-notes, 4.10: 2 to 3 mm).
    pub step: f64,
    /// Distance that bodies keep which do not touch. By hand.
    pub clearance: f64,
    /// A first try with more room; none goes without.
    pub first_try: Option<FirstTry>,
    /// How far the tip link of a holding finger may press into the object in the model. By hand: well below the
    /// contact tolerance of 0.5 mm.
    pub contact_allowance: f64,
    /// Distance kept from joint limits (in-hand-notes, 4.4).
    pub limit_margin: f64,
    /// Largest change of a joint in one step that counts as continuous (real-hands-notes, 5.3).
    pub joint_step: f64,
    /// Heights to lift a finger to, tried in this order (in-hand-notes, 4.4, and real-hands-notes, 2).
    pub lift_heights: Vec<f64>,
    /// Attempts of RRT-Connect for a moving finger (in-hand-notes, 4.8).
    pub rrt_iterations: usize,
    /// How far the object may wander from the straight way from start to goal. By measurement on allegro/box_y: 20 mm solves
    /// more within a work limit than 12 (in-hand-notes, 1) or 30.
    pub wander_distance: f64,
    /// How far it may turn away from it, standard deviation (in-hand-notes, 3: 0.4 rad).
    pub wander_angle: f64,
    /// Share of poses drawn as far off the straight way as the object is large: long objects must travel to turn (paper 000,
    /// section 5.1, example 3). By measurement: with 0.2 the pencil takes a fifth of the work of 0; against 0.1
    /// it saves 20 % on allegro/cube57_x and 32 % on box_y, and costs 50 % on cylinder20_y and 24 % on cube57_y.
    pub far_share: f64,
    /// Share of poses drawn straight out of a passage, where an end of the way lies in one (paper 000, example 4).
    pub passage_share: f64,
    /// Share of extensions towards the goal, the others towards a pose nearby (real-hands-notes, 2: 0.75).
    pub goal_share: f64,
    /// What a try at a pose costs when the next pose is chosen, as a share of the object's radius.
    pub try_fee: f64,
    /// Share of extensions whose relocations need not bring the object on: they turn the grasp over in dead ends.
    pub aimless_share: f64,
    /// New contacts looked at per finger and extension. By measurement, see docs/benchmarks.md.
    pub candidates: usize,
    /// Of these, how many are kept for combining.
    pub candidates_kept: usize,
    /// Least number of fingers that hold while the object moves, where they are closed; the others may be free meanwhile (paths
    /// through GS_k, paper 000, section 3.2). With the number of fingers, or more, all hold.
    pub least_holding: usize,
    /// True when a hand of three or more fingers that can never change its grasp, such as three hard fingers, is to try with
    /// transfers alone; it is refused at once otherwise. Two fingers always try.
    pub transfers_alone: bool,
    /// Extensions tried at a pose before one of them may leave fingers free that hold.
    pub free_after: u32,
    /// Share of the extensions after that which may.
    pub free_share: f64,
    /// Work after which a search starts again from nothing; grows by as much with every fourth restart. Trees take new start
    /// grasps by themselves, so that restarts are rare. By measurement, 20 seeds: against 300,000 a million saves 30 % on
    /// allegro/box_x and about a tenth on cube45_x and cube57_x, and costs a quarter on cylinder20_x.
    pub restart_work: u64,
    /// Random shortcuts tried on the plan found (in-hand-notes, 3).
    pub shortcuts: usize,
    /// Work spent on a better plan after the first one: units of the work budget; 0 for none.
    pub improve_work: u64,
    /// What makes a plan better.
    pub cost: CostWeights,
    /// Contact forces; none for plans that say nothing about them.
    pub forces: Option<ForceSettings>,
    /// How fast plans are carried out.
    pub speed: SpeedSettings,
    /// Schedule of alpha, for the methods of paper 000.
    pub alpha: Alpha,
    /// Share of the poses that the methods of paper 000 draw around the way from start to goal. The others are turned
    /// anyhow, as the paper has all (section 4.2.2): with 0 both methods take several times as long, `Classic` most.
    pub guided_share: f64,
}

impl Default for InHandSettings {
    fn default() -> Self {
        InHandSettings {
            method: Method::Gait,
            n_threads: 1,
            release_rule: ReleaseRule::WhereOthersHold,
            transfer: TransferMode::Rolling,
            friction_margin: 1.5,
            closure_margin: 0.005,
            step: 0.003,
            clearance: 0.0002,
            first_try: Some(FirstTry::default()),
            contact_allowance: 0.0003,
            limit_margin: 0.01,
            joint_step: 0.4,
            lift_heights: vec![0.006, 0.0024, 0.001, 0.0004],
            rrt_iterations: 100,
            wander_distance: 0.02,
            wander_angle: 0.4,
            far_share: 0.2,
            passage_share: 0.5,
            goal_share: 0.7,
            try_fee: 0.6,
            aimless_share: 0.6,
            candidates: 6,
            candidates_kept: 3,
            least_holding: 2,
            transfers_alone: false,
            free_after: 3,
            free_share: 0.5,
            restart_work: 1_000_000,
            shortcuts: 8,
            improve_work: 0,
            cost: CostWeights::default(),
            forces: Some(ForceSettings::default()),
            speed: SpeedSettings::default(),
            alpha: Alpha::Constant { value: 0.9 },
            guided_share: 0.9,
        }
    }
}

impl InHandSettings {
    /// The settings of geometry alone, as in paper 000: contacts stay where they are while the object moves, all of the
    /// friction is counted on, links keep away no farther than they must, and nobody asks about forces.
    pub fn plain() -> Self {
        InHandSettings {
            transfer: TransferMode::Fixed,
            friction_margin: 1.0,
            first_try: None,
            forces: None,
            ..InHandSettings::default()
        }
    }

    /// What is wrong with the settings, if anything: one sentence per field.
    pub fn validate(&self) -> Result<(), String> {
        let positive = [
            ("step", self.step),
            ("clearance", self.clearance),
            ("joint_step", self.joint_step),
            ("wander_distance", self.wander_distance),
            ("wander_angle", self.wander_angle),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("{name} is {value}; it must be positive and finite"));
            }
        }
        if let Some(FirstTry { clearance, .. }) = self.first_try
            && !(clearance > 0.0 && clearance < 0.1)
        {
            return Err(format!("first_try.clearance is {clearance}; it must be above 0 and below 0.1 m"));
        }
        for (name, value) in [
            ("closure_margin", self.closure_margin),
            ("first_try.closure_margin", self.first_try.map_or(0.0, |first| first.closure_margin)),
            ("contact_allowance", self.contact_allowance),
            ("limit_margin", self.limit_margin),
            ("far_share", self.far_share),
            ("passage_share", self.passage_share),
            ("goal_share", self.goal_share),
            ("guided_share", self.guided_share),
            ("free_share", self.free_share),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("{name} is {value}; it must be between 0 and 1"));
            }
        }
        if !(self.friction_margin >= 1.0 && self.friction_margin <= 100.0) {
            return Err(format!("friction_margin is {}; it must be between 1 and 100", self.friction_margin));
        }
        if self.n_threads == 0 || self.candidates == 0 || self.candidates_kept == 0 || self.restart_work == 0 {
            return Err("n_threads, candidates, candidates_kept and restart_work must be at least 1".into());
        }
        if self.lift_heights.is_empty() || self.lift_heights.iter().any(|h| !(*h > 0.0 && *h < 0.2)) {
            return Err("lift_heights must be a list of heights between 0 and 0.2 m".into());
        }
        self.cost.validate()?;
        if let Some(forces) = &self.forces {
            forces.validate()?;
        }
        self.speed.validate()?;
        self.alpha.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_follows_its_schedule() {
        let decreasing = Alpha::Decreasing { start: 0.5, step: 0.005, end: 0.3 };
        assert_eq!([0, 20, 40, 1000].map(|merges| decreasing.value(merges, 7)), [0.5, 0.4, 0.3, 0.3]);
        let adaptive = Alpha::Adaptive { start: 0.9, end: 0.1, scale: 50.0 };
        assert_eq!([0, 50, 1_000_000].map(|nodes| adaptive.value(3, nodes)), [0.9, 0.45, 0.1]);
        // Explores first, merges more and more.
        let growing = Alpha::Growing { first: 0.1, last: 0.7, scale: 100.0 };
        assert_eq!([0, 100].map(|nodes| growing.value(3, nodes)), [0.9, 0.6]);
        assert!((growing.value(0, usize::MAX) - 0.3).abs() < 1e-9);
        for alpha in [decreasing, adaptive, growing, Alpha::Constant { value: 1.0 }] {
            assert_eq!(alpha.validate(), Ok(()));
            let text = serde_json::to_string(&alpha).unwrap();
            assert_eq!(serde_json::from_str::<Alpha>(&text).unwrap(), alpha, "{text}");
        }
        assert!(Alpha::Constant { value: 1.5 }.validate().is_err());
        assert!(Alpha::Decreasing { start: 0.5, step: -0.1, end: 0.3 }.validate().is_err());
        assert!(Alpha::Growing { first: 0.1, last: f64::NAN, scale: 1.0 }.validate().is_err());
        assert!(Alpha::Adaptive { start: 0.9, end: 0.1, scale: 0.0 }.validate().is_err());
    }
}
