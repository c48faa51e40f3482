//! What would have helped a search that failed: single changes of the scene, each tried by a short search of its own.

use crate::in_hand::attempt::tally::OFTEN;
use crate::in_hand::{Asked, plan_with};
use crate::settings::{ImprovementSettings, InHandSettings, Method, SearchSettings};
use regrasp_base::Budget;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::ContactModel;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_robot::Hand;
use regrasp_scene::{GraspRequest, HandView, InHandQuery, Object};
use std::time::{Duration, Instant};

/// Share of the work of the search that failed which each trial may take, and the least and the most, in configurations.
const SHARE: u64 = 20;
const WORK: [u64; 2] = [10_000, 60_000];
/// How far the object is moved towards the palm, and away from it, in metres.
const SHIFT: f64 = 0.008;
/// Friction coefficients that are tried: rubber on most things, soft rubber.
const FRICTIONS: [f64; 2] = [1.0, 1.5];
/// Torsion radius of the soft fingertips that are tried, in metres.
const SOFT: f64 = 0.005;

/// How advice begins that names a start.
pub const START_AT: &str = "start at ";

/// Share of the time of a search with a time limit that all trials together may take beyond it.
const TIME_SHARE: f64 = 0.1;

/// Puts first in the advice of `failure` what was tried and led to a plan, if anything did. The query is in the hand's frame; the search
/// took the time `searched`.
pub fn advise(
    asked: &Asked,
    settings: &InHandSettings,
    (budget, searched): (&Budget, Duration),
    failure: &mut Failure,
) {
    let is_open = matches!(failure.kind, FailureKind::WorkSpent | FailureKind::TimeLimit);
    // A search that was hardly begun says nothing of the scene.
    if !settings.advise
        || !is_open
        || settings.method != Method::Gait
        || failure.statistics.work < WORK[0]
        || asked.query.stays()
    {
        return;
    }
    let work = (failure.statistics.work / SHARE).clamp(WORK[0], WORK[1]);
    let search = SearchSettings { first_try: None, shortcuts: 0, ..settings.search.clone() };
    let mut short = InHandSettings { search, n_threads: 1, ..settings.clone() };
    short.improvement = ImprovementSettings::none();
    // Who gave a time limit does not wait much longer; configurations alone cost 10,000 times 0.35 ms in the LEAP hand with a scan.
    let deadline = budget.deadline.map(|_| Instant::now() + searched.mul_f64(TIME_SHARE));
    let limits = Budget { max_work: work, deadline, ..budget.clone() };
    let mut solves = |view: &HandView, query: &InHandQuery| {
        let changed = Asked { view, query, progress: &|_| {}, ..*asked };
        plan_with(&changed, &short, &limits, work, false).is_ok()
    };
    if let Some(told) = first_that_helps(asked, failure, &mut solves) {
        failure.advice =
            format!("{told}: with that a search of {work} configurations found a plan. Or {}", failure.advice);
    }
}

/// The share of all failures of a search that are for want of contact forces.
fn no_forces_share(failure: &Failure) -> f64 {
    let counts = &failure.statistics.failures;
    let total: u64 = counts.values().sum();
    counts.get("no_forces").map_or(0.0, |&count| count as f64 / total.max(1) as f64)
}

/// The first change with which `solves` finds a plan, in words.
fn first_that_helps(
    asked: &Asked,
    failure: &Failure,
    solves: &mut dyn FnMut(&HandView, &InHandQuery) -> bool,
) -> Option<String> {
    let Asked { view, query, .. } = *asked;
    if query.start_grasp == GraspRequest::Automatic && query.goal_grasp == GraspRequest::Automatic {
        let towards = towards_palm(view.hand, &(query.world_from_object_start * view.object.center_of_mass).coords);
        for (shift, word) in [(SHIFT, "nearer to"), (-SHIFT, "farther from")] {
            let shifted = shifted(query, &(towards * shift));
            if solves(view, &shifted) {
                let [x, y, z]: [f64; 3] = view.world_from(&shifted.world_from_object_start).translation.vector.into();
                return Some(format!(
                    "{START_AT}[{x:.4}, {y:.4}, {z:.4}] m, {:.0} mm {word} the palm, with the goal moved alike",
                    1e3 * SHIFT
                ));
            }
        }
    }
    for friction in FRICTIONS.into_iter().filter(|friction| *friction > 1.05 * view.object.friction) {
        let object = Object { friction, ..view.object.clone() };
        if solves(&HandView { object: &object, ..view.clone() }, query) {
            return Some(format!("friction = {friction} instead of {} (fingertips of rubber)", view.object.friction));
        }
    }
    if no_forces_share(failure) >= OFTEN {
        let lighter = Object { mass: 0.5 * view.object.mass, ..view.object.clone() };
        if solves(&HandView { object: &lighter, ..view.clone() }, query) {
            return Some(format!("mass = {} instead of {}", lighter.mass, view.object.mass));
        }
    }
    let mut hand = view.hand.clone();
    let is_point = |contact: &ContactModel| *contact == ContactModel::Point;
    if !hand.fingers.iter().all(|finger| is_point(&finger.tip.contact)) {
        return None;
    }
    hand.fingers.iter_mut().for_each(|finger| finger.tip.contact = ContactModel::SoftFinger { torsion_radius: SOFT });
    solves(&HandView { hand: &hand, ..view.clone() }, query)
        .then(|| format!("soft fingertips (contact = \"soft_finger\", torsion_radius = {SOFT})"))
}

/// The direction from the object to the middle of where the fingers stand on the palm, in the hand's frame.
fn towards_palm(hand: &Hand, object: &Vector) -> Vector {
    let mut sum = Vector::zeros();
    for finger in &hand.fingers {
        let mut frames = vec![Placement::IDENTITY; finger.chain.joints.len()];
        let rest: Vec<f64> = finger.rest.clone();
        finger.chain.forward_frames(&rest, &mut frames);
        sum += frames.first().map_or(Vector::zeros(), |first| first.translation);
    }
    let palm = sum / hand.fingers.len().max(1) as f64;
    (palm - object).try_normalize(1e-6).unwrap_or_else(Vector::z)
}

/// The query with all poses moved.
fn shifted(query: &InHandQuery, by: &Vector) -> InHandQuery {
    let moved = |pose: &Pose| Pose::from_parts((pose.translation.vector + by).into(), pose.rotation);
    InHandQuery {
        world_from_object_start: moved(&query.world_from_object_start),
        world_from_object_way: query.world_from_object_way.iter().map(moved).collect(),
        world_from_object_goal: moved(&query.world_from_object_goal),
        ..query.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_robot::LoadOptions;

    /// What is tried after a search that ended by its time limit takes a share of the time that it took, and no more.
    #[test]
    fn trials_after_a_time_limit_have_a_share_of_the_time() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
        let loaded = regrasp_scene::load_scene(&path, &LoadOptions::default()).unwrap();
        let (view, query) = (loaded.view(), loaded.task().query(0).as_in_hand().unwrap().clone());
        let asked = Asked { view: &view, query: &query, seed: 0, progress: &|_| {} };
        let advice = |searched: Duration| {
            let mut failure = Failure::bare(FailureKind::TimeLimit, "no plan".into(), "allow more time");
            failure.statistics.work = 1_000_000;
            let budget = Budget::work(1_000_000).with_deadline(Instant::now());
            advise(&asked, &InHandSettings::default(), (&budget, searched), &mut failure);
            failure.advice
        };
        assert_eq!(advice(Duration::ZERO), "allow more time");
        assert!(advice(Duration::from_secs(10_000)).starts_with(START_AT));
    }
}
