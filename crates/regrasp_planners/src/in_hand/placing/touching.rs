//! Poses at which fingers that close come to hold an object. Such a finger reaches few of the contacts that are spread over the object, so the
//! estimate says little of it. Here fingers close on the object at many poses, and what they touch is asked whether it holds.

use super::estimating::Turns;
use super::proposals::Proposals;
use super::{Tried, at_once};
use crate::in_hand::attempt::search::{Context, Search};
use crate::in_hand::grasps::candidate::{Candidate, Way};
use crate::in_hand::grasps::choose::choose_grasp;
use crate::in_hand::grasps::free::free_posture_at;
use regrasp_base::{Interrupt, Rng};
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::{ContactModel, closure};
use regrasp_manipulation::grasp::contact::draw_footholds;

/// Poses drawn at most, and how many at a time.
const POSES: usize = 32_768;
const BATCH: usize = 256;
/// Poses with a grasp after which no more are drawn.
const ENOUGH: usize = 8;
/// Contacts drawn per finger and pose.
const TOUCHES: usize = 2;

/// What a batch of poses comes to.
struct Batch {
    held: Vec<Pose>,
    work: u64,
}

/// Poses of the object in the hand's frame at which the hand was seen to hold it; and why no more were drawn, if the caller's limits ended it. The
/// answer does not depend on the number of threads.
pub fn touched(
    context: Context,
    asked: &Turns,
    proposals: &Proposals,
    tried: &mut Tried,
    told: &(dyn Fn(&Tried) + Sync),
) -> (Vec<(f64, Pose)>, Option<Interrupt>) {
    let mut held: Vec<(f64, Pose)> = Vec::new();
    let batches: Vec<u64> = (0..(POSES / BATCH) as u64).collect();
    for together in batches.chunks(context.settings.n_threads.max(1)) {
        let seen = at_once(together, |&index| batch(context, asked, proposals, index));
        for batch in seen {
            if let Err(cut) = context.budget.check(tried.work) {
                return (held, Some(cut));
            }
            tried.poses += BATCH as u64;
            tried.work += batch.work;
            held.extend(batch.held.into_iter().map(|pose| (0.0, pose)));
            if held.len() >= ENOUGH {
                return (held, None);
            }
        }
        told(tried);
    }
    (held, None)
}

fn batch(context: Context, asked: &Turns, proposals: &Proposals, index: u64) -> Batch {
    let mut search = Search::new(context, [Pose::identity(); 2], 0, u64::MAX);
    search.rng = Rng::keyed(context.seed, "place_touching", index);
    search.ask_only_to_hold();
    let mut held = Vec::new();
    for _ in 0..BATCH {
        let pose = proposals.draw(&mut search.rng);
        if asked.is_clear(context.model, &pose) && is_held(&mut search, &pose) {
            held.push(pose);
        }
    }
    Batch { held, work: search.workspace.work + BATCH as u64 }
}

/// True when contacts that the fingers find hold the object at `hand_from_object`.
fn is_held(search: &mut Search, hand_from_object: &Pose) -> bool {
    let model = search.model();
    let placement = Placement::from(hand_from_object);
    let n = model.n_fingers();
    let mut options: Vec<Vec<Candidate>> = Vec::with_capacity(n);
    for finger in 0..n {
        search.workspace.place_object(hand_from_object);
        let mut found = Vec::with_capacity(TOUCHES);
        draw_footholds(&mut search.workspace, finger, &placement, TOUCHES, &mut search.rng, |contact, joints| {
            found.push(Candidate { contact: Some(contact), joints, follow: 1.0 });
        });
        options.push(found);
        let may_hold = |f: &usize| options.get(*f).is_none_or(|found| !found.is_empty());
        let left: Vec<ContactModel> = (0..n).filter(may_hold).map(|f| model.fingers[f].contact).collect();
        if !closure::may_close(&left, model.frame.friction) {
            return false;
        }
    }
    for (finger, found) in options.iter_mut().enumerate().filter(|(_, found)| found.is_empty()) {
        let stays = Way::new(hand_from_object, hand_from_object);
        match free_posture_at(search, finger, hand_from_object, &stays) {
            Some(free) => found.push(free),
            None => return false,
        }
    }
    search.workspace.place_object(hand_from_object);
    choose_grasp(search, hand_from_object, &options, None).is_some()
}
