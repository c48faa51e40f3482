//! In-hand manipulation by grasp subspaces. Paper 000: Saut, Sahbani, Perdereau, Advanced Robotics 25 (2011); paper 004:
//! Sahbani, Saut, Perdereau (2007).

/// Attempts, one after the other or several at once.
mod attempts;
/// Contacts that a finger could take, and how far it could follow with them.
pub(crate) mod candidates;
/// The baseline of paper 000.
mod classic;
/// Combinations of candidates: closure, release, worth.
pub(crate) mod combine;
/// Joining components of a roadmap.
mod connect;
/// What plans cost.
mod cost;
/// Paths in GS_n cut into transfers and regrasps.
mod decompose;
/// Start and goal as the query gives them.
pub(crate) mod endpoints;
/// Sampling GS_n.
mod explore;
/// A first try with more room.
mod first_try;
/// Contact forces of the fingers.
pub(crate) mod forces;
/// Forces and torques along a plan.
pub(crate) mod forces_along;
/// Postures of free fingers.
mod free;
/// Two gait trees that grow until they meet.
mod gait;
/// Given joints and contacts that nearly touch.
mod given;
/// Linear paths in GS_n.
mod grasp_path;
/// Grasps at a given object pose.
mod grasps;
/// Better plans after the first.
mod improve;
/// Hands that are inside something.
pub(crate) mod inside;
/// Legs of a query, from way pose to way pose.
mod legs;
/// Links between grasps.
mod link;
/// The scene prepared for planning.
pub(crate) mod model;
/// Narrow passages at the ends of a leg.
mod passage;
/// Candidates gathered at one pose.
mod pool;
/// The plan as it is written to a file.
pub(crate) mod record;
/// Sequences of relocations from one grasp to another.
mod regrasp;
/// The relocation of one finger.
pub(crate) mod relocate;
/// Many queries on one roadmap.
pub mod roadmap;
#[cfg(test)]
mod roadmap_tests;
/// Fingertips that roll.
pub(crate) mod roll;
/// What all methods share.
mod search;
#[cfg(test)]
mod sequence_tests;
/// Settings.
pub mod settings;
/// Random shortcuts.
mod shorten;
/// Motions in which soft fingertips do not turn about their normals.
mod spin;
/// Points of GS_n and the motions between them.
pub(crate) mod state;
/// Why attempts failed.
mod tally;
/// Times of waypoints.
pub(crate) mod timing;
/// Where fingertips touch, and joints with which they do.
mod tip;
/// Transfer paths.
mod transfer;
/// A tree of grasps that grows by gaits.
mod tree;
/// Moving fingers that are seldom free to move.
mod unlock;
/// Validating a plan once at the planner's resolution: the floor of planning time.
mod validate;
/// The method of paper 000.
mod visibility;
/// Configurations and continuous collision tests.
pub(crate) mod workspace;

pub use given::{MovedFinger, moved_fingers};
pub use settings::{
    Alpha, CostWeights, FirstTry, ForceSettings, InHandSettings, Method, ReleaseRule, SpeedSettings, TransferMode,
};
pub use validate::{NotProven, validate_once};

use crate::failure::{Failure, FailureKind};
use crate::in_world::{failure_in_world, plan_in_world};
use attempts::{Left, run_attempts};
use endpoints::{End, given_grasp, refuse_after_transfers, refuse_hopeless};
use legs::{Legs, Solution, plan_legs};
use model::Model;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_plan::Plan;
use regrasp_plan::plan::Statistics;
use regrasp_scene::{HandView, InHandQuery};
use search::{Search, Stop};
use std::sync::atomic::AtomicUsize;
use tally::Reason;

/// What a running search tells its caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Nodes so far, in this attempt.
    pub nodes: u64,
    /// Configurations looked at so far, in this attempt.
    pub work: u64,
    /// Index of the attempt.
    pub restarts: u64,
    /// Angle from the goal of the nearest pose reached, in radians.
    pub angle_left: f64,
}

/// Plans how the hand of `view` takes its object from start to goal. The search is in the hand's frame; query and plan are in the
/// world. The hand and the object that the query names must be those of the view.
///
/// The plan is the same for the same scene, query, settings and seed on any number of threads. `progress` is called now
/// and then, from whichever thread is searching. Panics if `settings.validate()` fails.
pub fn plan_in_hand(
    view: &HandView,
    query: &InHandQuery,
    settings: &InHandSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    settings.validate().expect("settings are validated where they are read");
    let seen = view.hand_from_world().map(|hand_from_world| query.seen_from(&hand_from_world));
    let found = plan_in_hand_frame(view, seen.as_ref().unwrap_or(query), settings, seed, budget, progress);
    found.map(|plan| plan_in_world(view, &query.name, plan)).map_err(|failure| failure_in_world(view, failure))
}

/// As [`plan_in_hand`], with the query and the answer in the hand's frame.
fn plan_in_hand_frame(
    view: &HandView,
    query: &InHandQuery,
    settings: &InHandSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    let mut spent = 0;
    for (first, work) in first_try::first_tries(view, settings, budget) {
        let left = Budget { max_work: budget.max_work.saturating_sub(spent), ..budget.clone() };
        match plan_with(view, query, &first, seed, (&left, work), progress) {
            Ok(mut plan) => {
                plan.statistics.work += spent;
                return Ok(Plan { settings: record::settings_of(settings), ..plan });
            }
            Err(failure) if failure.kind == FailureKind::Interrupted => return Err(failure),
            Err(failure) => spent += failure.statistics.work,
        }
    }
    let left = Budget { max_work: budget.max_work.saturating_sub(spent), ..budget.clone() };
    let mut found = plan_with(view, query, settings, seed, (&left, left.max_work), progress);
    let (Ok(Plan { statistics, .. }) | Err(Failure { statistics, .. })) = &mut found;
    statistics.work += spent;
    found
}

/// As [`plan_in_hand`], with the clearance and closure margin of the settings. The number beside the budget is the work of the
/// first plan; what improves it has the whole budget.
fn plan_with(
    view: &HandView,
    query: &InHandQuery,
    settings: &InHandSettings,
    seed: u64,
    (whole, first_work): (&Budget, u64),
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    let budget = &Budget { max_work: first_work.min(whole.max_work), ..whole.clone() };
    let model = Model::new(view, &effective(settings));
    refuse_hopeless(&model, query)?;
    let poses = query.poses();
    let (start_pose, goal_pose) = (query.world_from_object_start, query.world_from_object_goal);
    let mut rng = Rng::keyed(seed, "given_grasps", 0);
    let start_grasp = given_grasp(&model, End::Start, &start_pose, &query.start_grasp, &mut rng)?;
    let goal_grasp = given_grasp(&model, End::Goal, &goal_pose, &query.goal_grasp, &mut rng)?;

    let legs = Legs { poses: &poses, start_grasp: start_grasp.as_ref(), goal_grasp: goal_grasp.as_ref() };
    let (base_work, max_work) = work_limits(&model, &legs, budget);
    let found = run_attempts(settings.n_threads, base_work, max_work, |index, work, winner| {
        let mut search = Search::new(&model, (start_pose, goal_pose), (seed, index), (budget, work), winner, progress);
        let planned = plan_legs(&mut search, &legs).and_then(|solution| {
            let plan = record::record(&model, query, seed, &solution, Statistics::default()).map_err(|unbalanced| {
                search.tally.add(Reason::NoForces(unbalanced));
                Stop::Restart
            })?;
            Ok((solution, plan))
        });
        (planned, Left::of(&search))
    });
    match found {
        Ok(((solution, plan), left, n_restarts)) => {
            let statistics = left.statistics(n_restarts);
            let first = (solution, with_counts(plan, statistics));
            Ok(improved(&model, &legs, query, seed, whole, first, progress))
        }
        Err((interrupt, left, n_attempts)) => {
            let failure = left.failure(&model, &poses, interrupt, n_attempts);
            let has_tried_all = interrupt == Interrupt::WorkSpent && max_work < budget.max_work;
            Err(if has_tried_all { refuse_after_transfers(&model, failure) } else { failure })
        }
    }
}

/// Work of the first attempt, and of all together.
fn work_limits(model: &Model, legs: &Legs, budget: &Budget) -> (u64, u64) {
    let base_work = match model.settings.method {
        Method::Gait => model.settings.restart_work.saturating_mul(legs.n_legs() as u64),
        Method::Visibility | Method::Classic => budget.max_work,
    };
    // A hand that cannot change its grasp has transfers only: what there is to find is found soon.
    (base_work, if model.may_release { budget.max_work } else { budget.max_work.min(TRANSFERS_WORK) })
}

/// Work after which a hand that cannot change its grasp is refused: some thousand grasps and transfers. By hand.
const TRANSFERS_WORK: u64 = 40_000;

/// The plan of a solution after the improvement that the settings ask for; the same plan where what is better geometry
/// leaves no forces.
fn improved(
    model: &Model,
    legs: &Legs,
    query: &InHandQuery,
    seed: u64,
    budget: &Budget,
    (solution, mut plan): (Solution, Plan),
    progress: &(dyn Fn(Progress) + Sync),
) -> Plan {
    let work = model.settings.improve_work.min(budget.max_work.saturating_sub(plan.statistics.work));
    if model.settings.improve_work == 0 {
        return plan;
    }
    let budget = budget.of_improvement();
    let ends = (legs.poses[0], legs.poses[legs.n_legs()]);
    let winner = AtomicUsize::new(usize::MAX);
    let mut search = Search::new(model, ends, (seed, 0), (&budget, work), &winner, progress);
    search.rng = Rng::keyed(seed, "improvement", 0);
    let (solution, mut improvement) = improve::improve(&mut search, legs, solution);
    let mut counts = plan.statistics.clone();
    match record::record(model, query, seed, &solution, Statistics::default()) {
        Ok(better) => plan = better,
        Err(_) => improvement.improved = improvement.first,
    }
    counts.work += improvement.work;
    counts.samples += search.n_samples;
    counts.cut_by_time |= search.cut_by_time;
    counts.improvement = Some(Box::new(improvement));
    with_counts(plan, counts)
}

/// The plan with the counts of a search beside those of its own motions.
fn with_counts(mut plan: Plan, counts: Statistics) -> Plan {
    let own = plan.statistics;
    plan.statistics = Statistics {
        transfers: own.transfers,
        transfers_with_free_fingers: own.transfers_with_free_fingers,
        relocations: own.relocations,
        ..counts
    };
    plan
}

/// The settings that a method really plans with: those of paper 000 have the paper's release rule (section 4.2.2).
fn effective(settings: &InHandSettings) -> InHandSettings {
    let mut effective = settings.clone();
    if settings.method != Method::Gait {
        effective.release_rule = ReleaseRule::EverywhereEveryFinger;
    }
    effective
}
