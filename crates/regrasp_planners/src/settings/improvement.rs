//! Settings of the improvement of plans.

use serde::{Deserialize, Serialize};

/// What a plan costs: a weighted sum, of which improvement looks for less. Weights are at least 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CostWeights {
    /// Cost of one relocation.
    pub relocation: f64,
    /// Cost of one metre of object path; angles count with the object's radius.
    pub object_path: f64,
    /// Cost of one radian or metre of joint path, summed over all joints.
    pub joint_path: f64,
    /// Cost of a force-closure margin equal to the required one; twice the margin costs half.
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
    pub(super) fn validate(&self) -> Result<(), String> {
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

impl ImprovementSettings {
    /// The first plan is left as it is.
    pub fn none() -> Self {
        ImprovementSettings {
            improve_work: 0,
            shorten_share: 0.0,
            shorten_relocation: 0,
            straighten: false,
            ..ImprovementSettings::default()
        }
    }
}

/// What is done about a plan after the first.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprovementSettings {
    /// Work spent on a better plan after the first one; 0 for none.
    pub improve_work: u64,
    /// Relocations from which on a plan is long: it is shortened although nobody asked for it, where fingertips roll. A plan
    /// that begins with a given grasp is long from 2 on.
    pub long_plan: u64,
    /// Work spent on shortening a long plan, as a share of the work that found it, at least 20,000; 0 for none. By measurement:
    /// with 0.25 allegro/cube57_x falls from 38 to 8 relocations for a twentieth more time.
    pub shorten_share: f64,
    /// Work spent at least on shortening a long plan that begins with a given grasp, for each of its relocations, unless `shorten_share`
    /// is 0. By measurement, 36 queries of a chain with the cube in the Allegro hand: the median motion per 90 degrees falls from 25.9 s to
    /// 11.8 s, for 0.45 s more on the mean; twice as much saves nothing more. Hands in which a configuration takes longer get less, about as
    /// much time: an eighth where fingertips are meshes.
    pub shorten_relocation: u64,
    /// Whether fingers that relocate go straight in their joints where that is clear and takes less time.
    pub straighten: bool,
    /// Least closure margin of the grasp that a plan ends with, for plans that another one goes on from; 0 for none. Where the
    /// grasp at the goal is the planner's choice and holds less, fingers are relocated there until it holds so much, if that is found.
    pub end_margin: f64,
    /// Weights of the cost that improvement reduces.
    pub cost: CostWeights,
}

impl Default for ImprovementSettings {
    fn default() -> Self {
        ImprovementSettings {
            improve_work: 0,
            long_plan: 12,
            shorten_share: 0.5,
            shorten_relocation: 20_000,
            straighten: true,
            end_margin: 0.0,
            cost: CostWeights::default(),
        }
    }
}
