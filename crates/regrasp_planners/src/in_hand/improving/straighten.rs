//! Straight ways for the fingers that relocate in a plan.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::settings::Method;
use regrasp_base::Interrupt;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::relocation::{Foothold, straightened};

/// Makes the relocations of `way` straight where that is clear and takes less time, if the settings ask for that; true when any changed. Which
/// finger moves when and where it lands stays.
///
/// A plan that is already there is never given up: the caller's limits only end the straightening.
pub fn straighten_relocations(search: &mut Search, way: &mut Sequence) -> bool {
    let mut any = false;
    if !search.settings.improvement.straighten || search.settings.method != Method::Gait {
        return any;
    }
    for index in 0..way.steps().len() {
        let before = way.state_before(index);
        let (end, Motion::Regrasp { finger, path }) = (way.steps()[index].end(), way.steps()[index].motion()) else {
            continue;
        };
        if let Err(Stop::Budget(interrupt)) = search.check() {
            search.cut_by_time |= interrupt != Interrupt::WorkSpent;
            return any;
        }
        let finger = *finger;
        let [left, reached] = [before, end].map(|state| state.contact(finger));
        let from = Foothold { contact: left.as_ref(), joints: &before.joints[finger] };
        let to = Foothold { contact: reached.as_ref(), joints: &end.joints[finger] };
        search.workspace.set_state(before);
        let straight = straightened(&mut search.workspace, &before.world_from_object, finger, (from, to), path);
        if straight != *path {
            let mut detour = Sequence::at(before.clone());
            detour.push_regrasp(finger, reached, straight);
            let fits = way.replace(index..=index, detour);
            debug_assert!(fits, "the same ends");
            any = true;
        }
    }
    any
}
