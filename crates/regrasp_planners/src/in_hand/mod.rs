//! In-hand manipulation by grasp subspaces. Saut 2011: Saut, Sahbani, Perdereau, Advanced Robotics 25; Sahbani 2007:
//! Sahbani, Saut, Perdereau (2007).

/// What would have helped.
mod advice;
/// One attempt at a query.
mod attempt;
/// Whether friction is what is missing.
mod friction;
/// Contacts, and the grasps that they make.
mod grasps;
/// Better plans after the first, and a first look for one.
mod improving;
/// Motions of the object.
mod moving;
/// Where to hold an object.
pub mod placing;
/// The plan of a solution.
mod recording;
/// Queries that no search can answer.
mod refusals;
/// Changing one grasp into another.
mod regrasping;
/// Many queries on one roadmap.
pub mod roadmap;
#[cfg(test)]
mod roadmap_tests;
/// The methods.
mod searching;
#[cfg(test)]
mod sequence_tests;
/// Starts from what was observed.
pub mod starting;

pub use crate::settings::{
    Alpha, BaselineSettings, CostWeights, FingerWays, FirstTry, ImprovementSettings, InHandSettings, Method,
    ReleaseRule, SearchSettings,
};
pub use recording::validate::{NotProven, validate_once};
pub use regrasp_manipulation::ends::given::{MovedFinger, moved_fingers};
pub use regrasp_manipulation::progress::Progress;
pub use regrasp_manipulation::settings::{ForceSettings, PhysicsSettings, SpeedSettings, TransferMode};

use attempt::search::{Context, Search, Stop};
use attempt::tally::Reason;
use improving::first_look::first_look;
use improving::straighten::straighten_relocations;
use recording::record;
use refusals::{given_grasp, refuse_after_transfers, refuse_hopeless};
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_manipulation::ends::end::End;
use regrasp_manipulation::ends::given_grasp::posture_at;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::in_world::{failure_in_world, plan_in_world};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::workspace::start::distances_to_keep;
use regrasp_plan::Plan;
use regrasp_plan::plan::Statistics;
use regrasp_scene::{GraspRequest, HandView, InHandQuery};
use searching::attempts::{ALLOW_MORE_SEARCH, Left, allow_more, run_attempts};
use searching::duration::times_longer;
use searching::first_try;
use searching::legs::{Legs, Solution, plan_legs};
use std::sync::atomic::AtomicUsize;
use std::time::Instant;

/// What is asked: a query and the seed of all random numbers.
#[derive(Clone, Copy)]
struct Asked<'a> {
    view: &'a HandView<'a>,
    query: &'a InHandQuery,
    seed: u64,
    progress: &'a (dyn Fn(Progress) + Sync),
}

/// Plans how the hand of `view` takes its object from start to goal. The search is in the hand's frame; query and plan are in the
/// world. The hand and the object that the query names must be those of the view.
///
/// Where the query leaves the start pose open it is chosen first ([`placing`]), and the plan says which it is.
///
/// The plan is the same for the same scene, query, settings and seed on any number of threads. `progress` is called now
/// and then, from whichever thread is searching.
///
/// Errors: why there is no plan; settings that do not validate among the reasons.
pub fn plan_in_hand(
    view: &HandView,
    query: &InHandQuery,
    settings: &InHandSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    Failure::refuse_many_fingers(view)?;
    Failure::refuse_tied_fingers(view)?;
    if query.open_start.is_some() {
        return placing::plan_placed(view, query, settings, seed, budget, progress);
    }
    let seen = view.hand_from_world().map(|hand_from_world| query.seen_from(&hand_from_world));
    let asked = Asked { view, query: seen.as_ref().unwrap_or(query), seed, progress };
    let found = plan_in_hand_frame(&asked, settings, budget);
    let found = found.map_err(|failure| placing::with_hint(view, asked.query, settings, seed, failure));
    found.map(|plan| plan_in_world(view, &query.name, plan)).map_err(|failure| failure_in_world(view, failure))
}

/// As [`plan_in_hand`], with the query and the answer in the hand's frame.
fn plan_in_hand_frame(asked: &Asked, settings: &InHandSettings, budget: &Budget) -> Result<Plan, Failure> {
    let started = Instant::now();
    let mut spent = 0;
    let mut missed = Vec::new();
    let gives_start = asked.query.start_grasp != GraspRequest::Automatic;
    let search_work = settings.search.search_work.map_or(budget.max_work, |most| most.min(budget.max_work));
    for (first, work) in first_try::first_tries(asked.view, settings, search_work, gives_start) {
        let left = Budget { max_work: budget.max_work.saturating_sub(spent), ..budget.clone() };
        match plan_with(asked, &first, &left, work, true) {
            Ok(mut plan) => {
                plan.statistics.work += spent;
                return Ok(Plan { settings: record::settings_of(settings), ..plan });
            }
            Err(failure) if failure.kind == FailureKind::Interrupted => return Err(failure),
            Err(failure) => {
                spent += failure.statistics.work;
                missed.push(failure);
            }
        }
    }
    let left = Budget { max_work: budget.max_work.saturating_sub(spent), ..budget.clone() };
    let mut found = plan_with(asked, settings, &left, search_work.saturating_sub(spent), false);
    let (Ok(Plan { statistics, .. }) | Err(Failure { statistics, .. })) = &mut found;
    statistics.work += spent;
    if let Err(failure) = &mut found {
        first_try::tell(failure, missed);
        if failure.kind == FailureKind::WorkSpent && search_work < budget.max_work {
            failure.advice = failure.advice.replacen(allow_more(failure.kind), ALLOW_MORE_SEARCH, 1);
        }
        let model = Model::new(asked.view, &effective(settings).within(&asked.view.limits).physics);
        let ends = [&asked.query.world_from_object_start, &asked.query.world_from_object_goal];
        friction::advise(&model, ends, asked.seed, failure);
        advice::advise(asked, settings, (budget, started.elapsed()), failure);
    }
    found
}

/// As [`plan_in_hand`], with the clearance and closure margin of the settings. `first_work` is the work of the first plan; what
/// improves it has the `whole` budget. Bodies that are nearer to each other at a given start than the clearance may stay so near, but
/// for first tries, which are made to keep farther away.
fn plan_with(
    asked: &Asked,
    settings: &InHandSettings,
    whole: &Budget,
    first_work: u64,
    is_first_try: bool,
) -> Result<Plan, Failure> {
    let Asked { view, query, seed, progress } = *asked;
    let budget = &Budget { max_work: first_work.min(whole.max_work), ..whole.clone() };
    let settings = &effective(settings).within(&view.limits);
    let mut model = Model::new(view, &settings.physics);
    refuse_hopeless(&model, settings, query)?;
    let poses = query.poses();
    let (start_pose, goal_pose) = (query.world_from_object_start, query.world_from_object_goal);
    if !is_first_try && let Some(start) = posture_at(&model, End::Start, &start_pose, &query.start_grasp)? {
        model.kept = distances_to_keep(&model, &start);
    }
    let mut rng = Rng::keyed(seed, "given_grasps", 0);
    let start_grasp = given_grasp(&model, End::Start, &start_pose, &query.start_grasp, &mut rng)?;
    let goal_grasp = given_grasp(&model, End::Goal, &goal_pose, &query.goal_grasp, &mut rng)?;

    let legs = Legs { poses: &poses, start_grasp: start_grasp.as_ref(), goal_grasp: goal_grasp.as_ref() };
    let (base_work, max_work) = work_limits(&model, settings, (&legs, query.stays()), budget);
    let found = run_attempts(settings.n_threads, base_work, max_work, |index, work, winner| {
        let context = Context { model: &model, settings, seed, budget, winner, progress };
        let mut search = Search::new(context, [start_pose, goal_pose], index, work);
        if query.stays() {
            search.ask_only_to_hold();
        }
        let at_first = if index == 0 { first_look(&mut search, &legs) } else { None };
        let planned = at_first.map_or_else(|| plan_legs(&mut search, &legs), Ok).and_then(|mut solution| {
            if query.stays() {
                // Any moment of it holds the object where it is asked for: the first does.
                solution.way = Sequence::at(solution.way.start().clone());
                solution.steps_to_way.fill(0);
            }
            straighten_relocations(&mut search, &mut solution.way);
            let plan = record::record(&model, settings, query, seed, &solution, Statistics::default());
            let plan = plan.map_err(|unbalanced| {
                search.tally.add(Reason::NoForces(unbalanced));
                Stop::Restart
            })?;
            Ok((solution, plan))
        });
        (planned, Left::of(&search))
    });
    match found {
        Ok(((solution, plan), left, n_restarts)) => {
            let first = with_counts(plan, left.statistics(n_restarts));
            let winner = AtomicUsize::new(usize::MAX);
            let context = Context { model: &model, settings, seed, budget: whole, winner: &winner, progress };
            let (solution, plan) = improved(context, &legs, query, solution, first);
            Ok(with_better_end(context, &legs, query, &solution, plan))
        }
        Err((interrupt, left, n_attempts)) => {
            let failure = left.failure(&model, &poses, interrupt, n_attempts);
            let has_tried_all = interrupt == Interrupt::WorkSpent && max_work < budget.max_work;
            Err(if has_tried_all { refuse_after_transfers(&model, failure) } else { failure })
        }
    }
}

/// Work of the first attempt, and of all together; a query that `stays` is one for a grasp.
fn work_limits(model: &Model, settings: &InHandSettings, (legs, stays): (&Legs, bool), budget: &Budget) -> (u64, u64) {
    let base_work = match settings.method {
        Method::Gait => settings.search.restart_work.saturating_mul(legs.n_legs() as u64),
        Method::Visibility | Method::Classic => budget.max_work,
    };
    // A hand that cannot change its grasp has transfers only: what there is to find is found soon. It may hold as long as it likes.
    (base_work, if model.may_release || stays { budget.max_work } else { budget.max_work.min(TRANSFERS_WORK) })
}

/// Work after which a hand that cannot change its grasp is refused: some thousand grasps and transfers. By hand.
const TRANSFERS_WORK: u64 = 40_000;

/// A solution and its plan after the improvement that the settings ask for; the same where what is better geometry leaves no forces.
fn improved(
    context: Context,
    legs: &Legs,
    query: &InHandQuery,
    solution: Solution,
    mut plan: Plan,
) -> (Solution, Plan) {
    let Context { model, settings, seed, budget, .. } = context;
    let is_stuck = legs.goal_grasp.is_none() && refusals::is_stuck(model, solution.way.end());
    let asked = settings.improvement.improve_work.max(shortening_work(model, settings, (legs, is_stuck), &plan));
    let work = asked.min(budget.max_work.saturating_sub(plan.statistics.work));
    if asked == 0 {
        return (solution, plan);
    }
    let budget = if settings.improvement.improve_work == 0 { budget.clone() } else { budget.of_improvement() };
    let ends = [legs.poses[0], legs.poses[legs.n_legs()]];
    let mut search = Search::new(Context { budget: &budget, ..context }, ends, 0, work);
    search.rng = Rng::keyed(seed, "improvement", 0);
    let (better, mut improvement) = improving::improve(&mut search, legs, solution.clone());
    let mut counts = plan.statistics.clone();
    let solution = match record::record(model, settings, query, seed, &better, Statistics::default()) {
        Ok(plan_of_better) => {
            plan = plan_of_better;
            better
        }
        Err(_) => {
            improvement.improved = improvement.first;
            solution
        }
    };
    counts.work += improvement.work;
    counts.samples += search.n_samples;
    counts.cut_by_time |= search.cut_by_time;
    counts.improvement = Some(Box::new(improvement));
    (solution, with_counts(plan, counts))
}

/// The plan of `solution`, with relocations at its end where the settings ask for more closure margin there; the same plan where
/// none are found, where they leave no forces, and where the query gives the goal grasp.
fn with_better_end(context: Context, legs: &Legs, query: &InHandQuery, solution: &Solution, plan: Plan) -> Plan {
    let Context { model, settings, seed, budget, .. } = context;
    let (margin, work) = (settings.improvement.end_margin, budget.max_work.saturating_sub(plan.statistics.work));
    if margin == 0.0 || legs.goal_grasp.is_some() || query.stays() || work == 0 {
        return plan;
    }
    let ends = [legs.poses[0], legs.poses[legs.n_legs()]];
    let mut search = Search::new(context, ends, 0, work);
    search.rng = Rng::keyed(seed, "ending", 0);
    let end = solution.way.end();
    let more = improving::ending::better_end(&mut search, end, margin);
    let mut counts = plan.statistics.clone();
    let longer = more.and_then(|mut more| {
        straighten_relocations(&mut search, &mut more);
        let way = solution.way.clone().then(more)?;
        let longer = Solution { way, steps_to_way: solution.steps_to_way.clone() };
        record::record(model, settings, query, seed, &longer, Statistics::default()).ok()
    });
    counts.work += search.workspace.work;
    counts.samples += search.n_samples;
    with_counts(longer.unwrap_or(plan), counts)
}

/// Work after which a long plan is left as it is where nobody asks for a better one; 0 for plans that are not long. A plan that ends
/// stuck, in a grasp in which no finger may lift, counts as long.
fn shortening_work(model: &Model, settings: &InHandSettings, (legs, is_stuck): (&Legs, bool), plan: &Plan) -> u64 {
    let ImprovementSettings { long_plan, shorten_share, shorten_relocation, .. } = settings.improvement;
    let restricts = (0..model.n_fingers()).any(|finger| model.restricts_motion(finger));
    // A plan that begins with a given grasp pays for it: it seldom is one with which the object can be turned far.
    let long_plan = if legs.start_grasp.is_some() { LONG_FROM_GIVEN.min(long_plan) } else { long_plan };
    let is_long = plan.n_relocations() >= long_plan || is_stuck;
    if settings.method != Method::Gait || !model.any_rolls() || restricts || !is_long {
        return 0;
    }
    if shorten_share == 0.0 {
        return 0;
    }
    let share = (plan.statistics.work as f64 * shorten_share) as u64;
    let per_relocation = if legs.start_grasp.is_some() { shorten_relocation / times_longer(model.view) } else { 0 };
    share.max(LEAST_SHORTENING).max(per_relocation.saturating_mul(plan.n_relocations()))
}

/// Relocations from which on a plan that begins with a given grasp is long.
const LONG_FROM_GIVEN: u64 = 2;

/// Least work spent on a shorter plan, in configurations.
const LEAST_SHORTENING: u64 = 20_000;

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

/// The settings that a method really plans with: those of Saut 2011 have its release rule (section 4.2.2).
fn effective(settings: &InHandSettings) -> InHandSettings {
    let mut effective = settings.clone();
    if settings.method != Method::Gait {
        effective.search.release_rule = ReleaseRule::EverywhereEveryFinger;
    }
    effective
}
