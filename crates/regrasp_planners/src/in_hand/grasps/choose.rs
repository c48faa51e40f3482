//! Grasps at a given object pose: chosen by the planner, or as the query gives them.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::grasps::candidate::Candidate;
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::combine::rank;
use crate::in_hand::grasps::freedom::Freedom;
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::workspace::TipMode;

/// The best grasp that `options` make, closed and clear.
pub fn choose_grasp(
    search: &mut Search,
    world_from_object: &Pose,
    options: &[Vec<Candidate>],
    freedom: Option<&Freedom>,
) -> Option<GraspState> {
    let model = search.model();
    let mut table = match search.holds_only {
        true => ClosureTable::of_all_sets(model, options),
        false => ClosureTable::new(model, options),
    };
    let ranked = rank(search, options, &mut table, freedom, None, GRASPS_TRIED);
    search.tally.note_releases(table.releases(), world_from_object);
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
