//! Settings of pick and place.

use crate::motion_settings::{MotionMethod, PartsMove};
use crate::settings::ForceSettings;
use serde::{Deserialize, Serialize};

/// What a good plan of pick and place is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TaskCost {
    /// A short time, by estimates of how long each step takes.
    #[default]
    Time,
    /// As few changes of the holder as possible.
    Changes,
}

/// What is natural in a posture, and how much it counts against the rest (Saut 2010, sec. V-C). Of several postures of an arm for one pose of
/// its hand, that with the least weighted sum is tried first. Zeros leave the order of inverse kinematics: the smallest change of a joint
/// first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PostureWeights {
    /// For each radian of the Euclidean distance between the arm's joints and its home posture; the same for common joints.
    pub joints: f64,
    /// For each metre that the elbow is higher or lower than in the home posture.
    pub height: f64,
    /// For each metre between the wrist and the plane of torso and shoulders. It tells postures of the common joints apart.
    pub plane: f64,
}

impl PostureWeights {
    /// Nothing counts.
    pub const NONE: PostureWeights = PostureWeights { joints: 0.0, height: 0.0, plane: 0.0 };
}

impl Default for PostureWeights {
    /// By measurement (`docs/benchmarks/tasks.md`): no weight makes plans of all scenes shorter, or planning faster.
    fn default() -> Self {
        PostureWeights::NONE
    }
}

/// Settings of tasks of pick and place. Lengths in metres, times in seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TaskSettings {
    /// What the planner makes small.
    pub cost: TaskCost,
    /// How motions are searched for.
    pub method: MotionMethod,
    /// Which parts may move at the same time: at once, the receiver comes while the giver carries.
    pub parts: PartsMove,
    /// Distance that bodies keep. By hand: half of what grasp lists keep between hand and object.
    pub clearance: f64,
    /// Distance that searches for motions keep besides.
    pub search_margin: f64,
    /// Shortcuts that are tried in each motion.
    pub shortcuts: usize,
    /// Most samples of one motion's search.
    pub max_samples: u64,
    /// Longest step of the hand on a straight line.
    pub line_step: f64,
    /// Height to which a hand lifts an object straight off its support; a third of it where that does not fit.
    pub lift: f64,
    /// Largest inertia of a carried object, as a share of its weight on Earth: of its mass times the acceleration of its centre of mass, and of the
    /// torque that turns it, over the length that makes torques forces. Origin of the default: replays in MuJoCo, where a drill of 0.9 kg
    /// turns in the fingers of an arm that swings it at full speed, and stays where it is at half of it.
    pub carried_inertia: f64,
    /// How long everything rests while a holder joins or leaves.
    pub rest: f64,
    /// Postures of the common joints that are drawn for one grasp, besides that of the start.
    pub common_draws: usize,
    /// Which postures of an arm are tried first.
    pub posture: PostureWeights,
    /// Places of the exchange that are tried for one pair of grasps, the best of the grid first.
    pub exchange_places: usize,
    /// Orientations of the object that are tried at one place.
    pub exchange_turns: usize,
    /// Poses about the best place that are drawn after those.
    pub exchange_draws: usize,
    /// Standard deviation of their positions.
    pub exchange_spread: f64,
    /// Distance of the grid's nodes.
    pub exchange_grid: f64,
    /// May one hand give the object to another one?
    pub hand_over: bool,
    /// May a hand change its grasp while it holds the object?
    pub in_hand: bool,
    /// Configurations that the search for one such change may look at.
    pub in_hand_work: u64,
    /// Most searches for such changes.
    pub in_hand_searches: usize,
    /// Grasps to which a hand may change from one grasp: the nearest ones.
    pub in_hand_neighbours: usize,
    /// May the object be put down on the way?
    pub put_down: bool,
    /// Poses on supports at which it may be put down.
    pub placements: usize,
    /// How often so many are drawn, each time where those before did not do. Then grasps are changed in the hand.
    pub placement_rounds: usize,
    /// Edges of the task graph that are tested, at most.
    pub max_edges: usize,
    /// Contact forces. The normal forces are those of the lists where those are narrower. Origin of the least one and of the squeeze:
    /// replays in MuJoCo, where fingers that press with less than 2 N lose a light object.
    pub forces: ForceSettings,
}

impl Default for TaskSettings {
    fn default() -> Self {
        TaskSettings {
            cost: TaskCost::default(),
            method: MotionMethod::default(),
            parts: PartsMove::default(),
            clearance: 1e-4,
            search_margin: 2e-3,
            shortcuts: 60,
            max_samples: 6_000,
            line_step: 0.01,
            lift: 0.03,
            carried_inertia: 0.25,
            rest: 0.2,
            common_draws: 24,
            posture: PostureWeights::default(),
            exchange_places: 40,
            exchange_turns: 4,
            exchange_draws: 100,
            exchange_spread: 0.1,
            exchange_grid: 0.1,
            hand_over: true,
            in_hand: true,
            in_hand_work: 40_000,
            in_hand_searches: 24,
            in_hand_neighbours: 8,
            put_down: true,
            placements: 24,
            placement_rounds: 4,
            max_edges: 2000,
            forces: ForceSettings {
                normal_force: [2.0, 40.0],
                squeeze_weight: 1.0,
                cone_weight: 0.0,
                ..ForceSettings::default()
            },
        }
    }
}

impl TaskSettings {
    /// Err with what is wrong.
    pub fn validate(&self) -> Result<(), String> {
        let between = |name: &str, value: f64, low: f64, high: f64| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(format!("{name} is {value}; it must be from {low} to {high}")),
        };
        if self.parts == PartsMove::InTurn && self.method == MotionMethod::SingleQuery {
            return Err("parts is in_turn; the method single_query moves all of them at once".into());
        }
        between("clearance", self.clearance, 0.0, 0.1)?;
        between("search_margin", self.search_margin, 0.0, 0.1)?;
        between("line_step", self.line_step, 1e-3, 0.1)?;
        between("lift", self.lift, 1e-3, 1.0)?;
        between("carried_inertia", self.carried_inertia, 0.01, 100.0)?;
        between("rest", self.rest, 1e-3, 100.0)?;
        between("posture.joints", self.posture.joints, 0.0, 1e3)?;
        between("posture.height", self.posture.height, 0.0, 1e3)?;
        between("posture.plane", self.posture.plane, 0.0, 1e3)?;
        between("exchange_spread", self.exchange_spread, 0.0, 10.0)?;
        between("exchange_grid", self.exchange_grid, 0.01, 10.0)?;
        let at_most = |name: &str, value: usize, most: usize| match value <= most {
            true => Ok(()),
            false => Err(format!("{name} is {value}; at most {most}")),
        };
        at_most("shortcuts", self.shortcuts, 100_000)?;
        at_most("common_draws", self.common_draws, 100_000)?;
        at_most("exchange_places", self.exchange_places, 100_000)?;
        at_most("exchange_turns", self.exchange_turns, 24)?;
        at_most("exchange_draws", self.exchange_draws, 1_000_000)?;
        at_most("in_hand_searches", self.in_hand_searches, 100_000)?;
        at_most("in_hand_neighbours", self.in_hand_neighbours, 1_000)?;
        at_most("placements", self.placements, 1_000)?;
        at_most("placement_rounds", self.placement_rounds, 100)?;
        at_most("max_edges", self.max_edges, 1_000_000)?;
        self.forces.validate()
    }
}
