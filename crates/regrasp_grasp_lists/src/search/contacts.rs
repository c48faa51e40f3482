//! Contacts that a finger reaches in a frame (Saut 2010, sec. IV-A.2): from the largest sphere of its workspace on.

use crate::prepared::Prepared;
use crate::surface::Place;
use arrayvec::ArrayVec;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_manipulation::grasp::contact::reach;
use regrasp_manipulation::workspace::Workspace;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Most contacts of a finger that are kept in a frame.
pub const MOST: usize = 16;

/// A contact with joints that reach it, clear of all but the other fingers.
#[derive(Debug, Clone)]
pub struct Foothold {
    /// Where.
    pub place: Place,
    /// Joints of the finger.
    pub joints: Coordinates,
}

/// Places that are asked for each one that inverse kinematics is asked about.
const WIDER: usize = 3;
/// Places of one sphere that are looked at: nearby places are alike.
const PER_SPHERE: usize = 8;

/// Contacts of `finger`; `opposed` is the contact of the first finger, where there is one. The workspace has the object in place.
pub fn footholds(
    prepared: &Prepared,
    workspace: &mut Workspace,
    finger: usize,
    hand_from_object: &Pose,
    opposed: Option<&Place>,
    rng: &mut Rng,
) -> ArrayVec<Foothold, MOST> {
    let settings = prepared.settings;
    let mut places = near_places(prepared, finger, hand_from_object, rng);
    if let Some(first) = opposed {
        let facing = |place: &Place| place.contact.normal_in_object.dot(&first.contact.normal_in_object);
        places.sort_by(|a, b| facing(a).total_cmp(&facing(b)));
    }
    let placement = Placement::from(hand_from_object);
    let mut found = ArrayVec::new();
    for place in places.into_iter().take(settings.tries_per_finger) {
        if let Some(joints) = reach(workspace, finger, &place.contact, &placement, rng) {
            found.push(Foothold { place, joints });
            if found.len() >= settings.contacts_per_finger.min(MOST) {
                break;
            }
        }
    }
    found
}

/// Places in the spheres of a finger's workspace, from the largest on; then others that it may reach.
fn near_places(prepared: &Prepared, finger: usize, hand_from_object: &Pose, rng: &mut Rng) -> Vec<Place> {
    let n_wanted = WIDER * prepared.settings.tries_per_finger;
    let surface = prepared.surface(finger);
    let workspace = &prepared.workspaces[finger];
    let object_from_hand = hand_from_object.inverse();
    let (mut chosen, mut near) = (Vec::<u32>::new(), Vec::new());
    for sphere in &workspace.spheres {
        near.clear();
        surface.centers.within(&(object_from_hand * sphere.center), sphere.radius, &mut near);
        rng.shuffle(&mut near);
        let fresh = near.iter().filter(|index| !chosen.contains(index)).take(PER_SPHERE);
        let fresh: Vec<u32> = fresh.copied().collect();
        chosen.extend(fresh);
        if chosen.len() >= n_wanted {
            break;
        }
    }
    if chosen.len() < n_wanted {
        near.clear();
        surface.centers.within(&(object_from_hand * workspace.bound.center), workspace.bound.radius, &mut near);
        rng.shuffle(&mut near);
        let model = &prepared.model.fingers[finger];
        let placement = Placement::from(hand_from_object);
        let may = |index: &u32| {
            !chosen.contains(index) && model.may_reach(&placement, &surface.places[*index as usize].contact)
        };
        let others: Vec<u32> = near.iter().filter(|index| may(index)).take(n_wanted - chosen.len()).copied().collect();
        chosen.extend(others);
    }
    chosen.into_iter().map(|index| surface.places[index as usize]).collect()
}
