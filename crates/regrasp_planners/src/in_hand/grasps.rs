//! Grasps at a given object pose: chosen by the planner, or as the query gives them.

use super::candidates::Candidate;
use super::combine::{ClosureTable, rank};
use super::search::Search;
use super::spin::Freedom;
use super::state::GraspState;
use super::tally::Reason;
use super::workspace::TipMode;
use regrasp_geometry::Pose;

/// The best grasp that `options` make, closed and clear.
pub fn choose_grasp(
    search: &mut Search,
    world_from_object: &Pose,
    options: &[Vec<Candidate>],
    freedom: Option<&Freedom>,
) -> Option<GraspState> {
    let model = search.model();
    let mut table = ClosureTable::new(model, options);
    let ranked = rank(&mut search.workspace, options, &mut table, freedom, None, GRASPS_TRIED);
    search.tally.note_releases(&table, world_from_object);
    for combination in ranked {
        let chosen = |f: usize| &options[f][combination.choice[f]];
        let fingers = (0..options.len()).map(|f| (chosen(f).contact, chosen(f).joints.clone()));
        let state = GraspState::of(*world_from_object, fingers);
        search.workspace.set_state(&state);
        if search.workspace.is_clear(TipMode::AllHold) {
            return Some(state);
        }
        if let Some(pair) = search.workspace.blocking_pair {
            search.tally.add(Reason::TooNear(pair));
        }
    }
    None
}

/// Closed grasps that are tested for collision.
const GRASPS_TRIED: usize = 4;
