//! Plans whose start pose the planner chooses: from the best places in turn, with a slice of the work each, then from the best one with
//! all that is left.

use super::{Tried, place};
use crate::in_hand::plan_in_hand;
use crate::settings::InHandSettings;
use regrasp_base::Budget;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::progress::Progress;
use regrasp_plan::Plan;
use regrasp_scene::{HandView, InHandQuery};

/// Places that are tried.
const TRIED: usize = 4;
/// Work with which each is tried at first, and its least share of all work.
const SLICE: (u64, u64) = (600_000, 8);

/// As [`plan_in_hand`], for a query that leaves the start pose open.
pub fn plan_placed(
    view: &HandView,
    query: &InHandQuery,
    settings: &InHandSettings,
    seed: u64,
    budget: &Budget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Plan, Failure> {
    let half = Budget { max_work: budget.max_work / 2, ..budget.clone() };
    let angle_left = query.poses().windows(2).map(|leg| leg[0].rotation.angle_to(&leg[1].rotation)).sum();
    let told = |tried: &Tried| progress(Progress { nodes: 0, work: tried.work, restarts: 0, angle_left });
    let found = place(view, std::slice::from_ref(query), settings, (seed, TRIED), &half, &told)?;
    let mut spent = found.tried.work;
    let (most, share) = SLICE;
    let slice = most.min(budget.max_work / share);
    let in_turn = found.places.iter().map(|place| (place, slice));
    let at_last = found.places.first().map(|place| (place, u64::MAX));
    let mut last = None;
    for (place, work) in in_turn.chain(at_last) {
        let left = budget.max_work.saturating_sub(spent);
        let limits = Budget { max_work: work.min(left), ..budget.clone() };
        let query = query.started_at(&place.world_from_object);
        match plan_in_hand(view, &query, settings, seed, &limits, progress) {
            Ok(mut plan) => {
                plan.statistics.work += spent;
                return Ok(plan);
            }
            Err(mut failure) => {
                spent += failure.statistics.work;
                failure.statistics.work = spent;
                let [x, y, z]: [f64; 3] = place.world_from_object.translation.vector.into();
                failure.message = format!("with the object placed at [{x:.3}, {y:.3}, {z:.3}] m: {}", failure.message);
                if matches!(failure.kind, FailureKind::Interrupted | FailureKind::TimeLimit) {
                    return Err(failure);
                }
                last = Some(failure);
            }
        }
    }
    Err(last.unwrap_or_else(|| Failure::bare(FailureKind::WorkSpent, "no place was tried".into(), "")))
}
