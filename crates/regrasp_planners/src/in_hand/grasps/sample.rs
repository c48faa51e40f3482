//! Random grasps: the random loop generator (Saut 2011, sec. 4.2.2).

use crate::in_hand::attempt::search::Search;
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::grasps::closure_table::ClosureTable;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_manipulation::grasp::contact::{draw_contact_by_area, reach};
use regrasp_manipulation::grasp::state::{Contacts, GraspState, HandJoints};
use regrasp_manipulation::workspace::TipMode;

/// Contacts drawn per finger and pose. By measurement: with 1 most poses of a box find no closed grasp, 5 are too dear.
const CONTACTS: usize = 3;

/// A grasp with the object at a random pose.
pub fn draw_state(search: &mut Search) -> Option<GraspState> {
    let pose = if search.rng.chance(search.settings.baselines.guided_share) {
        search.draw_pose()
    } else {
        search.draw_pose_in_reach()
    };
    let state = draw_state_at(search, &pose)?;
    search.learn_reach(&pose);
    Some(state)
}

/// A grasp with the object at `world_from_object` in which every n-1 fingers are closed: the object is the active part
/// of the random loop generator, the fingers the passive one.
pub fn draw_state_at(search: &mut Search, world_from_object: &Pose) -> Option<GraspState> {
    let model = search.model();
    let n = model.n_fingers();
    let placement = Placement::from(world_from_object);
    search.n_samples += 1;
    let mut options: Vec<Vec<Candidate>> = Vec::with_capacity(n);
    for finger in 0..n {
        let found = draw_footholds(search, finger, world_from_object, &placement);
        if found.is_empty() {
            search.tally.add(Reason::NoContact(finger));
            return None;
        }
        options.push(found);
    }
    let mut table = ClosureTable::new(model, &options);
    let n_choices: usize = options.iter().map(Vec::len).product();
    let mut reason = Reason::NotClosed;
    for code in 0..n_choices {
        let mut rest = code;
        let mut choice = Choice::new();
        for of_finger in &options {
            choice.push(rest % of_finger.len());
            rest /= of_finger.len();
        }
        if table.n_releasable(&choice) < n {
            continue;
        }
        let chosen = |f: usize| &options[f][choice[f]];
        let Some(contacts) = (0..n).map(|f| chosen(f).contact).collect::<Option<Contacts>>() else { continue };
        let joints: HandJoints = (0..n).map(|f| chosen(f).joints.clone()).collect();
        search.workspace.set(world_from_object, &joints, &contacts);
        if search.workspace.is_clear(TipMode::AllHold) {
            return Some(GraspState::held_by_all(*world_from_object, contacts, joints));
        }
        reason = search.workspace.blocking_pair.map_or(reason, Reason::TooNear);
    }
    search.tally.add(reason);
    None
}

/// A few contacts that `finger` reaches.
fn draw_footholds(
    search: &mut Search,
    finger: usize,
    world_from_object: &Pose,
    placement: &Placement,
) -> Vec<Candidate> {
    let mut found = Vec::with_capacity(CONTACTS);
    search.workspace.place_object(world_from_object);
    for _ in 0..4 * CONTACTS {
        let Some(contact) = draw_contact_by_area(&mut search.workspace, finger, placement, &mut search.rng) else {
            continue;
        };
        if let Some(joints) = reach(&mut search.workspace, finger, &contact, placement, &mut search.rng) {
            found.push(Candidate { contact: Some(contact), joints, follow: 1.0 });
            if found.len() == CONTACTS {
                break;
            }
        }
    }
    found
}
