//! The baseline of Saut 2011, sec. 5.1, "classic method": a visibility PRM whose local method is one transfer-regrasp
//! or regrasp-transfer.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::searching::visibility::explore::{Spares, explore, roadmap_of};
use crate::in_hand::searching::visibility::link::LocalMethod;
use crate::in_hand::searching::visibility::{ends, note_nearest, solution};
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;

/// Looks for motions from `start` to the goal pose and `goal_grasp`; what is not given is drawn.
pub fn build(
    search: &mut Search,
    start: Option<GraspState>,
    goal_grasp: Option<&GraspState>,
) -> Result<Sequence, Stop> {
    let (start, goal) = ends(search, start, goal_grasp)?;
    let mut roadmap = roadmap_of(search, &start, &goal, LocalMethod::TransferRegrasp)?;
    // The baseline joins by new grasps alone.
    let mut spares = Spares::default();
    loop {
        if let Some(way) = solution(search, &mut roadmap)? {
            return Ok(way);
        }
        explore(search, &mut roadmap, LocalMethod::TransferRegrasp, &mut spares)?;
        note_nearest(search, &roadmap);
    }
}
