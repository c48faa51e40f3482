//! The planners: each a folder, each one entry function. Knows no face.
//!
//! A planner is a free function of scene, query, settings, seed and budget that returns a plan or says why not.

/// In-hand manipulation by grasp subspaces (Saut 2011 and Sahbani 2007).
pub mod in_hand;
/// Settings of the in-hand planner, which tracking has too.
pub mod settings;
/// Finger tracking (Cherif 1999).
pub mod tracking;

pub use in_hand::plan_in_hand;
pub use regrasp_manipulation::failure::{Cause, Failure, FailureKind, NearestMiss};
pub use regrasp_manipulation::motion_settings::{MotionMethod, MotionSettings, Validation};
pub use regrasp_manipulation::outline::{Outline, OutlineEdge, OutlineNode};
pub use regrasp_manipulation::progress::Progress;
pub use regrasp_manipulation::task_settings::{TaskCost, TaskSettings};
pub use regrasp_manipulation::{failure, outline, robot_miss};
pub use settings::{InHandSettings, Method};
pub use tracking::{TrackingMethod, TrackingSettings, plan_tracking};

use regrasp_base::Budget;
use regrasp_plan::Plan;
use regrasp_scene::{HandView, Manipulation, Query, Scene, State};

/// Settings for every kind of task.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlannerSettings {
    /// For in-hand tasks.
    pub in_hand: InHandSettings,
    /// For tracking tasks.
    pub tracking: TrackingSettings,
    /// For motions of whole robots, of which `regrasp_arms` is the planner.
    pub motion: MotionSettings,
    /// For tasks of pick and place, of which `regrasp_tasks` is the planner.
    pub task: TaskSettings,
}

/// Plans `query` with the planner of its task: [`plan_in_hand`] or [`plan_tracking`]. All that the query does not name rests in
/// `state`.
///
/// Errors: as that planner.
pub fn plan(
    (scene, state): (&Scene, &State),
    query: &Query,
    settings: &PlannerSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    if query.is_of_robot() {
        return Err(motion_elsewhere());
    }
    let view = HandView::of(&Manipulation::of(scene, state, query));
    match query {
        Query::InHand(query) => plan_in_hand(&view, query, &settings.in_hand, seed, budget, progress),
        Query::Tracking(query) => plan_tracking(&view, query, &settings.tracking, seed, budget, progress),
        Query::Motion(_) | Query::PickAndPlace(_) => Err(motion_elsewhere()),
    }
}

/// Motions of whole robots have a planner of their own.
fn motion_elsewhere() -> Failure {
    let message = "the task is of kind \"motion\", in which no hand moves an object with its fingers".to_owned();
    Failure::bare(FailureKind::Impossible, message, "plan it as a motion of the whole robot")
}
