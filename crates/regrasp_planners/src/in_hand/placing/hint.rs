//! What would help where the start has no grasp: a pose nearby that has one.

use super::evidence::Evidence;
use crate::in_hand::advice::START_AT;
use crate::in_hand::attempt::search::{Context, Search};
use crate::in_hand::effective;
use crate::settings::InHandSettings;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::{Pose, Vector};
use regrasp_manipulation::ends::blocked::object_blocked_by;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::model::Model;
use regrasp_scene::{GraspRequest, HandView, InHandQuery};
use std::sync::atomic::AtomicUsize;

/// Poses that are tried, nearest first, and how far from the start they are, in metres.
const TRIED: usize = 32;
const DISTANCES: [f64; 2] = [0.003, 0.025];

/// The failure with the nearest pose that has a grasp in its advice, where none was found at the start and the planner chooses it.
/// The query is in the hand's frame.
pub fn with_hint(
    view: &HandView,
    query: &InHandQuery,
    settings: &InHandSettings,
    seed: u64,
    failure: Failure,
) -> Failure {
    let found_none = failure.kind == FailureKind::WorkSpent
        && failure.nearest_miss.is_none()
        && failure.leg.is_none_or(|leg| leg == 1);
    let is_about_start = failure.kind == FailureKind::StartInvalid || found_none;
    // A start from which a plan was found says more.
    let is_answered = failure.advice.starts_with(START_AT) && failure.kind != FailureKind::StartInvalid;
    if !is_about_start || is_answered || query.start_grasp != GraspRequest::Automatic {
        return failure;
    }
    let Some((pose, distance)) = nearest_with_grasp(view, query, settings, seed) else { return failure };
    let [x, y, z]: [f64; 3] = view.world_from(&pose).translation.vector.into();
    let advice = format!(
        "start at [{x:.4}, {y:.4}, {z:.4}] m, {:.0} mm away, where a grasp was found; `regrasp place` looks for poses from which \
         the turn is possible too. Or {}",
        1e3 * distance,
        failure.advice
    );
    Failure { advice, ..failure }
}

/// The nearest of some poses with the orientation of the start at which a grasp is found that lets a finger go, and how far it is.
fn nearest_with_grasp(
    view: &HandView,
    query: &InHandQuery,
    settings: &InHandSettings,
    seed: u64,
) -> Option<(Pose, f64)> {
    let settings = &effective(settings).within(&view.limits);
    let model = &Model::new(view, &settings.physics);
    let (winner, budget) = (AtomicUsize::new(usize::MAX), Budget::unlimited());
    let context = Context { model, settings, seed, budget: &budget, winner: &winner, progress: &|_| {} };
    let start = query.world_from_object_start;
    let mut search = Search::new(context, [start; 2], 0, u64::MAX);
    search.rng = Rng::keyed(seed, "start_hint", 0);
    if query.stays() {
        search.ask_only_to_hold();
    }
    (0..TRIED).find_map(|k| {
        let share = k as f64 / (TRIED - 1) as f64;
        let distance = DISTANCES[0] + share * (DISTANCES[1] - DISTANCES[0]);
        let mut pose = start;
        pose.translation.vector += Vector::from(search.rng.direction()) * distance;
        if object_blocked_by(model, &pose).is_some() {
            return None;
        }
        Evidence::gather(&mut search, &pose).grasp.map(|_| (pose, distance))
    })
}
