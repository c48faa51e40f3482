//! One entry for every kind of task.

use crate::{AnyPlan, Failure, PlannerSettings};
use regrasp_base::Budget;
use regrasp_planners::{FailureKind, Progress};
use regrasp_scene::{MotionQuery, Query, Scene, State};

/// Plans `query` with the planner of its task. All that the query does not name rests in `state`.
///
/// Errors: as that planner.
pub fn plan_any(
    (scene, state): (&Scene, &State),
    query: &Query,
    settings: &PlannerSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<AnyPlan, Failure> {
    match query {
        Query::Motion(query) => plan_motion((scene, state), query, seed),
        Query::InHand(_) | Query::Tracking(_) => {
            regrasp_planners::plan((scene, state), query, settings, seed, budget, progress).map(AnyPlan::InHand)
        }
    }
}

/// The place of the planner of whole robots.
fn plan_motion((scene, _): (&Scene, &State), query: &MotionQuery, _seed: u64) -> Result<AnyPlan, Failure> {
    let message = format!("this version plans no motion of the whole robot \"{}\"", scene.robots[query.robot].name);
    Err(Failure::bare(FailureKind::Impossible, message, "regrasp check judges motions that other planners made"))
}
