//! Finger tracking: re-orienting an object by fingertips that roll and slide and never leave it. Cherif 1999: Cherif, Gupta,
//! *Global Planning for Dexterous Re-orientation of Rigid Objects: Finger Tracking with Rolling and Sliding*, INRIA RR-3770,
//! 1999.
//!
//! At every instant some fingertips rest and the others move. Of three or four fingertips two rest, of more three; the settings can ask
//! for three of four, as in Cherif 1999, sec. 3.1. On one of those that rest the object rolls without sliding; over the others it rolls and slides. Where that
//! gets no farther a finger may be relocated through the air: `gaiting`.

/// Start and hand as the query gives them.
mod endpoints;
/// Contact forces at one moment.
pub mod forces;
/// Relocations through the air.
mod gaiting;
/// Where object and fingertips are.
mod grasp;
/// From a grasp towards a sub-goal.
mod local;
/// How the object moves on fingertips that rest.
mod object_motion;
/// Ranges of orientations that three resting fingertips allow.
mod range;
/// The plan as it is written to a file.
mod record;
/// A* over orientations.
mod search;
/// Settings.
pub mod settings;
/// A start grasp of the planner's own choice.
mod start_grasp;
/// One step of time.
mod step;

pub use settings::{Cones, RoleChoice, RollingFinger, TrackingMethod, TrackingSettings};

use gaiting::Move;
use grasp::TrackingGrasp;
use regrasp_base::{Budget, Rng};
use regrasp_manipulation::failure::{Cause, Failure, FailureKind, NearestMiss};
use regrasp_manipulation::following::refuse_fingers_that_cannot_follow;
use regrasp_manipulation::in_world::{failure_in_world, plan_in_world};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::progress::Progress;
use regrasp_plan::Plan;
use regrasp_plan::plan::{PoseData, Statistics};
use regrasp_scene::{GraspRequest, HandView, TrackingQuery};
use search::{Counts, Ended, search};
use start_grasp::choose_start;
use step::Stepper;

/// Searches that are begun before none is begun any more. By hand.
const MOST_RESTARTS: u64 = 200;
/// Fingers that rest where fewer may.
const FEWEST_RESTING: usize = 2;
/// Of so many searches in a row the last rests as many fingers as the settings say, where fewer may rest. By hand.
const SEARCHES_IN_A_ROUND: u64 = 4;

/// Plans how the fingertips turn the object to the goal's orientation.
///
/// The plan is the same for the same scene, query, settings and seed. `progress` is called after every sub-goal.
///
/// Errors: the settings do not validate, the start is none, or the search ends without a plan.
pub fn plan_tracking(
    view: &HandView,
    query: &TrackingQuery,
    settings: &TrackingSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    Failure::refuse_many_fingers(view)?;
    Failure::refuse_tied_fingers(view)?;
    let seen = view.hand_from_world().map(|hand_from_world| query.seen_from(&hand_from_world));
    let found = plan_in_hand_frame(view, seen.as_ref().unwrap_or(query), settings, seed, budget, progress);
    found.map(|plan| plan_in_world(view, &query.name, plan)).map_err(|failure| failure_in_world(view, failure))
}

/// As [`plan_tracking`], with the query and the answer in the hand's frame.
fn plan_in_hand_frame(
    view: &HandView,
    query: &TrackingQuery,
    settings: &TrackingSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    let model = Model::new(view, &settings.in_hand.physics);
    refuse_fingers_that_cannot_follow(&model)?;
    endpoints::refuse(&model, &view.gravity)?;
    endpoints::refuse_ranges_of_few(&model, settings)?;
    let mut stepper = Stepper::new(&model, settings);
    let mut starts = vec![endpoints::start(&stepper, query, seed)?];
    let goal = query.world_from_object_goal.rotation;
    let is_start_chosen = query.start_grasp == GraspRequest::Automatic;
    let may_rest_fewer = settings.fewer_rest && settings.resting_fingers > FEWEST_RESTING && model.n_fingers() == 4;
    let mut counts = Counts::default();
    let mut nearest: Option<(f64, TrackingGrasp)> = None;
    loop {
        let mut rng = Rng::keyed(seed, "tracking", counts.restarts);
        let is_last_of_round = (counts.restarts + 1) % SEARCHES_IN_A_ROUND == 0;
        let with_fewer = may_rest_fewer && !is_last_of_round;
        stepper.resting = if with_fewer { FEWEST_RESTING } else { settings.resting_fingers };
        if is_start_chosen && counts.restarts > 0 && starts.len() < settings.start_grasps {
            starts.extend(choose_start(&stepper, &query.world_from_object_start, seed, counts.restarts));
        }
        let first = &starts[counts.restarts as usize % starts.len()];
        let found = search(&mut stepper, &first.0, &goal, &mut rng, budget, &mut counts, progress);
        let (index, angle_left) = found.nearest;
        let before = nearest.as_ref().map_or(f64::INFINITY, |(angle_left, _)| *angle_left);
        if angle_left < before {
            nearest = Some((angle_left, found.nodes[index].grasp.clone()));
        }
        match found.last {
            Ok(last) => {
                let path = found.path_to(last);
                counts.on_path = path.len() as u64 - 1;
                let moves: Vec<&Move> = path.iter().flat_map(|&node| &found.nodes[node].moves).collect();
                return Ok(record::record(&stepper, query, seed, first, &moves, statistics(&counts)));
            }
            Err(Ended::Exhausted) if counts.restarts < MOST_RESTARTS => counts.restarts += 1,
            Err(ended) => return Err(failure(&ended, &counts, nearest)),
        }
    }
}

/// Counts for the plan file.
fn statistics(counts: &Counts) -> Statistics {
    let names = FAILURES.iter().zip(counts.failures).filter(|(_, count)| *count > 0);
    Statistics {
        nodes: counts.nodes,
        samples: counts.explored,
        work: counts.work,
        restarts: counts.restarts,
        transfers: counts.on_path,
        failures: names.map(|(name, count)| ((*name).to_owned(), count)).collect(),
        ..Statistics::default()
    }
}

/// Failures 1 to 7 of Cherif 1999, sec. 6.2.4, between what it does not list.
const FAILURES: [&str; 9] = [
    "moving finger may not change its face",
    "1: moving finger collides",
    "2: moving finger out of reach",
    "3: moving fingertip touches outside its pad",
    "4: contact of a resting finger broken at an edge",
    "5: resting fingertip touches outside its pad",
    "6: weight not balanced",
    "7: resting fingers tell no motion towards the goal",
    "sub-goal outside the ranges of all resting fingers",
];

fn failure(ended: &Ended, counts: &Counts, nearest: Option<(f64, TrackingGrasp)>) -> Failure {
    let (kind, why) = match ended {
        Ended::Exhausted => (FailureKind::WorkSpent, "no orientation is left to be tried".to_owned()),
        Ended::Interrupted(interrupt) => (FailureKind::from(*interrupt), "the budget is used up".to_owned()),
    };
    let nearest = nearest.filter(|(angle_left, _)| angle_left.is_finite());
    let left = nearest.as_ref().map_or(String::new(), |(angle_left, _)| {
        format!("; {:.1} degrees are left to the goal", angle_left.to_degrees())
    });
    let total: u64 = counts.failures.iter().sum();
    let mut causes: Vec<Cause> = FAILURES
        .iter()
        .zip(counts.failures)
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| Cause { reason: (*name).into(), count, share: count as f64 / total as f64 })
        .collect();
    causes.sort_by(|a, b| b.count.cmp(&a.count).then_with(|| a.reason.cmp(&b.reason)));
    Failure {
        kind,
        message: format!("{why}{left}"),
        advice: "try another seed, another start grasp, or an in_hand task".into(),
        causes,
        leg: None,
        nearest_miss: nearest.map(|(angle_left, grasp)| {
            Box::new(NearestMiss {
                world_from_object: PoseData::from(&grasp.world_from_object.to_pose()),
                angle_left,
                distance_left: 0.0,
                joints: grasp.joints.iter().flatten().copied().collect(),
            })
        }),
        robot_miss: None,
        reached: None,
        statistics: statistics(counts),
    }
}
