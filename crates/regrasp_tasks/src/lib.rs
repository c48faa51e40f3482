//! Pick and place: an object stands somewhere, and shall stand somewhere else (Saut, Gharbi, Cortes, Sidobre, Simeon 2010, sec. V).
//!
//! [`plan_pick_and_place`] searches a graph of who holds the object by which grasp, and where it lies (`graph`). Edges are tested
//! when a cheap path uses them, the cheapest test first: grasps at places (`station`), exchanges (`exchange`), changes of grasp in one hand (`in_hand`), then motions
//! (`motions`), which become the segments of the plan (`record`).

/// What is refused before any search.
mod before;
/// A hand by itself among what rests.
mod clear;
/// Scene, robot and grasps, prepared once.
mod context;
/// Where one hand gives the object to another one.
mod exchange;
/// Why there is no plan.
mod failing;
/// Forces while the object moves.
mod forces;
/// Who holds the object, and where it lies.
mod graph;
/// A hand changes its grasp while it holds.
mod in_hand;
/// Straight ways of a hand.
mod line;
/// The nearest miss as a posture.
mod miss;
/// The motions of a plan.
mod motions;
/// Where the object may lie.
mod placements;
/// How natural postures are.
mod posture;
/// Segments and waypoints.
mod record;
/// What is made before any query.
pub mod roadmap;
/// A hand at an object that lies on a support.
mod station;
/// Times along smooth paths.
mod timing;

pub use regrasp_manipulation::failure::{Cause, Failure, FailureKind};
pub use regrasp_manipulation::task_settings::{PostureWeights, TaskCost, TaskSettings};

pub use roadmap::{RoadmapBuildSettings, TaskAnswer, TaskRoadmap, build_roadmap};

use context::{Context, Prepared};
use failing::Tally;
use regrasp_base::Budget;
use regrasp_grasp::list::GraspList;
use regrasp_plan::RobotPlan;
use regrasp_scene::{PickAndPlaceQuery, Scene, State};

/// Plans a task of pick and place. `lists` has grasps of the object, by index of the hand in `Scene::hands`. All that the query does
/// not name rests in `state`. The same plan for the same input and seed.
///
/// Errors: why there is no plan, with the stage at which it fails.
pub fn plan_pick_and_place(
    (scene, state): (&Scene, &State),
    query: &PickAndPlaceQuery,
    lists: &[(usize, GraspList)],
    settings: &TaskSettings,
    seed: u64,
    budget: &Budget,
) -> Result<RobotPlan, Failure> {
    plan_with_roadmap((scene, state), query, lists, settings, (seed, budget), None).map(|answer| answer.plan)
}

/// As [`plan_pick_and_place`], with what was made before for this robot, what rests around it, and these lists. What the answer has
/// and the roadmap has not can be made part of it ([`TaskRoadmap::grown_by`]).
///
/// Errors: as that, and a roadmap that was made for something else.
pub fn plan_with_roadmap(
    (scene, state): (&Scene, &State),
    query: &PickAndPlaceQuery,
    lists: &[(usize, GraspList)],
    settings: &TaskSettings,
    (seed, budget): (u64, &Budget),
    roadmap: Option<&TaskRoadmap>,
) -> Result<TaskAnswer, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    let prepared = Prepared::new(scene, query, lists, settings)?;
    let models = prepared.models();
    let context = Context::new((scene, state), query, (&prepared, &models), settings, (seed, budget))?;
    if let Some(roadmap) = roadmap
        && let Some(what) = roadmap.differs(&context)
    {
        let message = format!("the roadmap was made with other inputs: {what} differs");
        return Err(failing::refused(FailureKind::SettingsInvalid, message, "build the roadmap again"));
    }
    let mut tally = Tally::default();
    before::refuse(&context, &mut tally)?;
    graph::search(&context, roadmap, &mut tally)
}
