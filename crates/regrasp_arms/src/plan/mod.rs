//! Motions of whole robots: from a query to a plan.

/// Start and goal, and why they are refused.
mod ends;
/// The motion that is executed: rounded corners, times, proof.
mod execute;
/// Graphs of a query's robot.
mod graph;
/// Motions of a longer task.
pub mod leg;
/// A path.
mod path;
/// The robot and what stands around it.
pub mod problem;
/// The plan of a motion that was found.
mod record;
/// Goals that are poses of wrists.
mod wrists;

use crate::roadmap::Roads;
use crate::world::World;
pub use ends::meeting;
use execute::execute;
pub use execute::limits;
pub use graph::{build_graph, graph_differs, grow_graph};
use problem::Problem;
use regrasp_base::Budget;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::motion_settings::MotionSettings;
use regrasp_plan::RobotPlan;
use regrasp_scene::{MotionQuery, Scene, State};

/// What is done when a caller is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Robot, world, start and goals are prepared.
    Prepared,
    /// A path was searched for, in samples or with certified motions.
    Searched,
    /// The path was made shorter.
    Simplified,
    /// Its motions were certified.
    Certified,
    /// The motion that is executed has its times.
    Timed,
}

/// Plans a motion of a whole robot. All that the query does not name rests in `state`.
///
/// Errors: start or goal collide or leave their limits; the budget is used up before a path is found.
pub fn plan_motion(
    (scene, state): (&Scene, &State),
    query: &MotionQuery,
    settings: &MotionSettings,
    seed: u64,
    budget: &Budget,
) -> Result<RobotPlan, Failure> {
    plan_in_stages((scene, state), query, settings, seed, budget, &mut |_| {})
}

/// Most samples of a search among a part of the joints.
const FEW_SAMPLES: u64 = 20_000;

/// As [`plan_motion`]; `watch` is told after each stage.
///
/// Errors: as [`plan_motion`].
pub fn plan_in_stages(
    (scene, state): (&Scene, &State),
    query: &MotionQuery,
    settings: &MotionSettings,
    seed: u64,
    budget: &Budget,
    watch: &mut dyn FnMut(Stage),
) -> Result<RobotPlan, Failure> {
    plan_problem(Problem::new((scene, state), query), settings, (seed, budget), watch).map(|answer| answer.plan)
}

/// A plan, and what the graph that was asked did not have.
#[derive(Debug, Clone)]
pub struct GraphAnswer {
    /// The plan.
    pub plan: RobotPlan,
    /// States of the robot at the corners of its path, where the graph had no way between start and goal. Motions between corners are
    /// straight and free.
    pub new_way: Option<Vec<Vec<f64>>>,
}

/// As [`plan_motion`], with a graph of the robot among what rests (`build_graph`). What the answer has and the graph has not can be
/// made part of it ([`grow_graph`]).
///
/// Errors: as [`plan_motion`].
pub fn plan_with_graph(
    around: (&Scene, &State),
    query: &MotionQuery,
    settings: &MotionSettings,
    (seed, budget): (u64, &Budget),
    roads: &Roads,
) -> Result<GraphAnswer, Failure> {
    let mut problem = Problem::new(around, query);
    problem.use_graph(roads, World::default());
    plan_problem(problem, settings, (seed, budget), &mut |_| {})
}

fn plan_problem(
    problem: Problem,
    settings: &MotionSettings,
    (seed, budget): (u64, &Budget),
    watch: &mut dyn FnMut(Stage),
) -> Result<GraphAnswer, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    let query = problem.query;
    problem.refuse_start(settings)?;
    let goals = problem.goals(seed)?;
    let mut last = None;
    let groups = problem.groups(&goals);
    for (index, free) in groups.iter().enumerate() {
        let model = problem.model(free);
        // A few joints may not be able to do it at all: the search among all of them gets the samples.
        let few = if index + 1 < groups.len() { FEW_SAMPLES } else { u64::MAX };
        let settings = &MotionSettings { max_samples: settings.max_samples.min(few), ..settings.clone() };
        let ends = (query.start.as_slice(), goals.as_slice(), settings.max_samples);
        let found = path::find(&problem, &model, ends, settings, (seed, budget), watch).and_then(|found| {
            let new_way = found.is_new.then(|| found.path.iter().map(|corner| model.state_at(corner)).collect());
            execute(&problem, &model, found, settings).map(|executed| (executed, new_way))
        });
        match found {
            Ok((executed, new_way)) => {
                watch(Stage::Timed);
                return Ok(GraphAnswer { plan: problem.record(&model, executed, settings, seed), new_way });
            }
            // More joints do not make an end valid.
            Err(failure) if failure.kind != FailureKind::WorkSpent => return Err(failure),
            Err(failure) => last = Some(failure),
        }
    }
    let nothing = || Failure::bare(FailureKind::Impossible, "the robot has no joint that moves".into(), "");
    Err(last.unwrap_or_else(nothing))
}
