//! In-hand manipulation by grasp subspaces. Paper 000: Saut, Sahbani, Perdereau, Advanced Robotics 25 (2011).

/// Settings.
pub mod settings;

pub use settings::{InHandSettings, Method};

use crate::failure::Failure;
use regrasp_base::Budget;
use regrasp_plan::Plan;
use regrasp_scene::{InHandQuery, Scene};

/// What a running search tells its caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Nodes so far.
    pub nodes: u64,
    /// Configurations looked at so far.
    pub work: u64,
    /// Restarts so far.
    pub restarts: u64,
    /// Angle from the goal of the nearest pose reached, in radians.
    pub angle_left: f64,
}

/// Plans how the hand takes the object from start to goal.
///
/// `progress` is called now and then, from whichever thread is searching.
pub fn plan_in_hand(
    _scene: &Scene,
    _query: &InHandQuery,
    _settings: &InHandSettings,
    _seed: u64,
    _budget: &Budget,
    _progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    unreachable!("written next")
}
