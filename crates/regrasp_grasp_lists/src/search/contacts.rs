//! Contacts that a finger reaches in a frame (Saut 2010, sec. IV-A.2): from the largest sphere of its workspace on.

use crate::prepared::Prepared;
use crate::surface::Place;
use arrayvec::ArrayVec;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, UnitVector};
use regrasp_manipulation::relocation::{self, lift_is_within_reach};
use regrasp_manipulation::rolling::follow::ik_settings;
use regrasp_manipulation::workspace::{TipMode, Workspace};
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

/// Two normals with a larger cosine do not oppose each other. By hand.
const MOST_ALIKE: f64 = 0.0;

/// A frame: where the object is in the hand.
pub struct Site {
    /// The object's pose in the hand frame.
    pub hand_from_object: Pose,
    /// The same.
    pub placement: Placement,
    /// Its inverse.
    pub object_from_hand: Placement,
}

impl Site {
    /// The hand at `object_from_hand`.
    pub fn new(object_from_hand: &Pose) -> Self {
        let hand_from_object = object_from_hand.inverse();
        Site {
            placement: Placement::from(&hand_from_object),
            object_from_hand: Placement::from(object_from_hand),
            hand_from_object,
        }
    }
}

/// Places that a finger may touch in a frame, and what is known of each.
pub struct Candidates {
    /// Which finger.
    pub finger: usize,
    /// The places, the most promising first.
    pub places: Vec<Place>,
    /// Whether the finger reaches them, once it was asked.
    reached: Vec<Option<Option<Coordinates>>>,
    /// How often inverse kinematics may still be asked.
    n_left: usize,
}

impl Candidates {
    /// Places in the spheres of a finger's workspace, from the largest on; then others that it may reach.
    pub fn new(prepared: &Prepared, finger: usize, site: &Site, rng: &mut Rng) -> Self {
        let places = near_places(prepared, finger, site, rng);
        Candidates { finger, reached: vec![None; places.len()], places, n_left: prepared.settings.tries_per_finger }
    }

    /// Puts the places first that face the contact of another finger.
    pub fn oppose(&mut self, first: &Place) {
        let facing = |place: &Place| place.contact.normal_in_object.dot(&first.contact.normal_in_object);
        self.places.sort_by(|a, b| facing(a).total_cmp(&facing(b)));
    }

    /// Puts the places first that face those of two other fingers; drops places that no other finger's face.
    pub fn oppose_all(&mut self, others: &[Candidates]) {
        let facing = |place: &Place, candidates: &Candidates| {
            let normal = place.contact.normal_in_object;
            candidates.places.iter().map(|other| other.contact.normal_in_object.dot(&normal)).fold(1.0, f64::min)
        };
        let score = |place: &Place| {
            let (mut least, mut second) = (1.0f64, 1.0f64);
            for candidates in others {
                let value = facing(place, candidates);
                if value < least {
                    (least, second) = (value, least);
                } else {
                    second = second.min(value);
                }
            }
            (least < MOST_ALIKE).then_some(least + second)
        };
        let mut scored: Vec<(f64, Place)> =
            self.places.iter().filter_map(|place| Some((score(place)?, *place))).collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.places = scored.into_iter().map(|(_, place)| place).collect();
    }

    /// The contact at place `k`, if the finger reaches it. None too when it was asked often enough.
    pub fn foothold(
        &mut self,
        prepared: &Prepared,
        workspace: &mut Workspace,
        site: &Site,
        k: usize,
        rng: &mut Rng,
    ) -> Option<Foothold> {
        if self.reached[k].is_none() {
            if self.n_left == 0 {
                return None;
            }
            self.n_left -= 1;
            self.reached[k] = Some(reach(prepared, workspace, self.finger, &self.places[k], site, rng));
        }
        let joints = self.reached[k].clone().flatten()?;
        Some(Foothold { place: self.places[k], joints })
    }

    /// The first contacts that the finger reaches, as many as are kept.
    pub fn footholds(
        &mut self,
        prepared: &Prepared,
        workspace: &mut Workspace,
        site: &Site,
        rng: &mut Rng,
    ) -> ArrayVec<Foothold, MOST> {
        let n_wanted = prepared.settings.contacts_per_finger.min(MOST);
        let mut found = ArrayVec::new();
        for k in 0..self.places.len() {
            if found.len() == n_wanted || self.n_left == 0 && self.reached[k].is_none() {
                break;
            }
            found.extend(self.foothold(prepared, workspace, site, k, rng));
        }
        found
    }
}

/// Joints of `finger` at a place from which it can be lifted again, clear of everything but the other fingers. The workspace has the
/// object in place. The rough look comes first.
fn reach(
    prepared: &Prepared,
    workspace: &mut Workspace,
    finger: usize,
    place: &Place,
    site: &Site,
    rng: &mut Rng,
) -> Option<Coordinates> {
    let model = prepared.model;
    let contact = &place.contact;
    let normal = UnitVector::new_unchecked(site.placement.vector(&contact.normal_in_object));
    let settings = ik_settings(model, finger, normal);
    let joints = model.fingers[finger].touch_random(&site.placement, contact, &settings, rng)?;
    if prepared.rough.finger_hits(model, finger, &joints, &site.object_from_hand) {
        return None;
    }
    let foothold = relocation::Foothold { contact: Some(contact), joints: &joints };
    if !lift_is_within_reach(model, &site.placement, finger, &foothold) {
        return None;
    }
    workspace.set_finger(finger, &joints);
    let mode = TipMode::Near { finger, normal_in_world: normal.into_inner() };
    workspace.finger_alone_is_clear(finger, mode).then_some(joints)
}

/// Places in the spheres of a finger's workspace, from the largest on; then others that it may reach.
fn near_places(prepared: &Prepared, finger: usize, site: &Site, rng: &mut Rng) -> Vec<Place> {
    let n_wanted = WIDER * prepared.settings.tries_per_finger;
    let surface = prepared.surface(finger);
    let workspace = &prepared.workspaces[finger];
    let model = &prepared.model.fingers[finger];
    let (mut chosen, mut near) = (Vec::<u32>::new(), Vec::new());
    for sphere in &workspace.spheres {
        near.clear();
        surface.centers.within(&site.object_from_hand.point(&sphere.center), sphere.radius, &mut near);
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
        let center = site.object_from_hand.point(&workspace.bound.center);
        surface.centers.within(&center, workspace.bound.radius, &mut near);
        rng.shuffle(&mut near);
        let may = |index: &u32| {
            !chosen.contains(index) && model.may_reach(&site.placement, &surface.places[*index as usize].contact)
        };
        let others: Vec<u32> = near.iter().filter(|index| may(index)).take(n_wanted - chosen.len()).copied().collect();
        chosen.extend(others);
    }
    chosen.into_iter().map(|index| surface.places[index as usize]).collect()
}
