//! One entry for every kind of task.

use crate::task_grasps::{make_list, read_grasps, refuse_too_heavy, settings_of_made_lists};
use crate::{AnyPlan, Failure, GraspList, PlannerSettings, RobotPlan};
use regrasp_base::Budget;
use regrasp_planners::{FailureKind, Progress};
use regrasp_scene::{PickAndPlaceQuery, Query, Scene, State};

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
        Query::PickAndPlace(query) => {
            let lists = task_lists(scene, query, settings, seed, budget)?;
            plan_task((scene, state), query, &lists, settings, seed, budget).map(|plan| AnyPlan::Robot(Box::new(plan)))
        }
        Query::InHand(_) | Query::Tracking(_) => {
            regrasp_planners::plan((scene, state), query, settings, seed, budget, progress)
                .map(|plan| AnyPlan::InHand(Box::new(plan)))
        }
    }
}

/// Plans a task of pick and place with these lists of grasps, by index of the hand in `Scene::hands`.
///
/// Errors: why there is no plan.
pub fn plan_task(
    around: (&Scene, &State),
    query: &PickAndPlaceQuery,
    lists: &[(usize, GraspList)],
    settings: &PlannerSettings,
    seed: u64,
    budget: &Budget,
) -> Result<RobotPlan, Failure> {
    regrasp_tasks::plan_pick_and_place(around, query, lists, &settings.task, seed, budget)
}

/// The lists that the scene names, and those that are made where it names none. Hands that have no grasp of the object are left out
/// where another hand has one.
///
/// Errors: a list that cannot be used; no hand has a grasp.
fn task_lists(
    scene: &Scene,
    query: &PickAndPlaceQuery,
    settings: &PlannerSettings,
    seed: u64,
    budget: &Budget,
) -> Result<Vec<(usize, GraspList)>, Failure> {
    let mut grasps = read_grasps(scene, query).map_err(|error| {
        let advice = "name the lists of these hands and this object in the scene";
        Failure::bare(FailureKind::SettingsInvalid, error.to_string(), advice)
    })?;
    if !grasps.missing.is_empty() {
        refuse_too_heavy(scene, query)?;
    }
    let mut none = None;
    for hand in grasps.missing.clone() {
        let made = settings_of_made_lists(&scene.hands[hand].hand, settings.in_hand.n_threads);
        match make_list(scene, query, hand, (&made, seed), budget) {
            Ok(list) => grasps.add(hand, list),
            Err(failure) if failure.kind == FailureKind::Interrupted => return Err(failure),
            Err(failure) => none = Some(failure),
        }
    }
    match none {
        Some(failure) if grasps.lists.is_empty() => Err(failure),
        _ => Ok(grasps.lists),
    }
}
