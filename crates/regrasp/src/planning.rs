//! One entry for every kind of task.

use crate::{AnyPlan, Failure, PlannerSettings};
use regrasp_base::Budget;
use regrasp_planners::Progress;
use regrasp_scene::{Query, Scene, State};

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
        Query::Motion(query) => regrasp_arms::plan_motion((scene, state), query, &settings.motion, seed, budget)
            .map(|plan| AnyPlan::Robot(Box::new(plan))),
        Query::PickAndPlace(_) => todo!("the planner of pick and place"),
        Query::InHand(_) | Query::Tracking(_) => {
            regrasp_planners::plan((scene, state), query, settings, seed, budget, progress)
                .map(|plan| AnyPlan::InHand(Box::new(plan)))
        }
    }
}
