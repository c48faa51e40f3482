//! Linear paths in GS_n: the object and all contacts move at once, the contacts along geodesics of the object's surface
//! (Saut 2011, sec. 4.1 and 4.2.2; Sahbani 2007, sec. IV.B).
//!
//! No hand can follow such a path as it stands; `decompose.rs` cuts it into transfers and regrasps.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::attempt::tally::Reason;
use arrayvec::ArrayVec;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::surface::Geodesic;
use regrasp_geometry::{Pose, UnitVector, frame, interpolate_pose};
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::{Contacts, GraspState, HandJoints, MAX_FINGERS};
use regrasp_manipulation::model::{Model, releasable};
use regrasp_manipulation::rolling::follow::{follow_contact, ik_settings};

/// Parameters at which a path is looked at first of all: most paths that fail do so there, for little.
const FIRST_LOOKS: [f64; 3] = [0.5, 0.25, 0.75];

/// A path in GS_n, found valid at every step. Its parameter is from 0 to 1.
#[derive(Debug, Clone)]
pub struct GraspPath {
    way: Way,
    /// Joints at the parameters `k / joints.len()`, k from 1.
    joints: Vec<HandJoints>,
    start_joints: HandJoints,
}

/// Object poses and contacts of a path.
#[derive(Debug, Clone)]
struct Way {
    from: Pose,
    to: Pose,
    contacts: ArrayVec<ContactWay, MAX_FINGERS>,
}

/// How one contact moves on the object.
#[derive(Debug, Clone)]
struct ContactWay {
    from: Contact,
    to: Contact,
    /// None when it stays.
    path: Option<Geodesic>,
}

impl GraspPath {
    /// The path from one state to another; None, with the reason in the tally, when one of its steps is not valid:
    /// reach, collision, edges, closure of every n-1 fingers.
    ///
    /// Its joints follow those of `from`; where a hand reaches a contact in several ways they may end in others than
    /// those of `to`.
    pub fn between(search: &mut Search, from: &GraspState, to: &GraspState) -> Option<GraspPath> {
        let model = search.model();
        match trace(search, model, from, to) {
            Ok(path) => Some(path),
            Err(reason) => {
                search.tally.add(reason);
                None
            }
        }
    }

    /// The state at parameter `t`, strictly between 0 and 1; None when no finger configuration near the path's own
    /// reaches it.
    pub fn at(&self, model: &Model, t: f64) -> Option<GraspState> {
        let contacts = self.way.contacts_at(model, t)?;
        let world_from_object = interpolate_pose(&self.way.from, &self.way.to, t);
        let placement = Placement::from(&world_from_object);
        let nearest = (t * self.joints.len() as f64).round() as usize;
        let seed = if nearest == 0 { &self.start_joints } else { &self.joints[nearest - 1] };
        let joints = (0..model.n_fingers())
            .map(|f| follow_contact(model, f, &contacts[f], &placement, &seed[f]))
            .collect::<Option<HandJoints>>()?;
        Some(GraspState::held_by_all(world_from_object, contacts, joints))
    }
}

fn trace(search: &mut Search, model: &Model, from: &GraspState, to: &GraspState) -> Result<GraspPath, Reason> {
    let way = Way::new(model, from, to).ok_or(Reason::Crease)?;
    let every_finger = (1u32 << model.n_fingers()) - 1;
    for t in FIRST_LOOKS {
        let contacts = way.contacts_at(model, t).ok_or(Reason::Crease)?;
        if releasable(model, &contacts, every_finger) != every_finger {
            return Err(Reason::NotClosed);
        }
        let placement = Placement::from(&interpolate_pose(&way.from, &way.to, t));
        search.workspace.work += 1;
        if !(0..model.n_fingers()).all(|f| in_reach(model, f, &contacts[f], &placement)) {
            return Err(Reason::OutOfReach);
        }
    }
    let n_steps = way.n_steps(model);
    let mut joints = Vec::with_capacity(n_steps);
    let mut current = from.joints.clone();
    search.workspace.set(&from.world_from_object, &from.joints, &from.contacts);
    for k in 1..=n_steps {
        let t = k as f64 / n_steps as f64;
        let contacts = way.contacts_at(model, t).ok_or(Reason::Crease)?;
        let pose = interpolate_pose(&way.from, &way.to, t);
        let placement = Placement::from(&pose);
        for finger in 0..model.n_fingers() {
            current[finger] = follow_contact(model, finger, &contacts[finger], &placement, &current[finger])
                .ok_or(Reason::OutOfReach)?;
        }
        if releasable(model, &contacts, every_finger) != every_finger {
            return Err(Reason::NotClosed);
        }
        if !search.workspace.slide(&pose, &current, &contacts) {
            return Err(search.workspace.blocking_pair.map_or(Reason::OutOfReach, Reason::TooNear));
        }
        joints.push(current.clone());
    }
    Ok(GraspPath { way, joints, start_joints: from.joints.clone() })
}

/// True unless the finger has a closed form that says the contact is out of its reach.
fn in_reach(model: &Model, finger: usize, contact: &Contact, world_from_object: &Placement) -> bool {
    let normal = UnitVector::new_unchecked(world_from_object.vector(&contact.normal_in_object));
    !model.fingers[finger].cannot_touch(world_from_object, contact, &ik_settings(model, finger, normal))
}

impl Way {
    /// None when a contact would have to cross a crease, or has no shortest way.
    fn new(model: &Model, from: &GraspState, to: &GraspState) -> Option<Self> {
        let surface = &model.view.object.surface;
        let contacts = from
            .contacts
            .iter()
            .zip(&to.contacts)
            .map(|(a, b)| {
                if a == b {
                    return Some(ContactWay { from: *a, to: *b, path: None });
                }
                let (start, end) = (surface.project(&a.point_in_object), surface.project(&b.point_in_object));
                if !surface.same_face(&start, &end) {
                    return None;
                }
                Some(ContactWay { from: *a, to: *b, path: Some(surface.geodesic(&start, &end)?) })
            })
            .collect::<Option<_>>()?;
        Some(Way { from: from.world_from_object, to: to.world_from_object, contacts })
    }

    /// Number of steps of which none moves a fingertip by more than the step length.
    fn n_steps(&self, model: &Model) -> usize {
        let object = frame::pose_distance(&self.from, &self.to, model.turn_length());
        let longest =
            self.contacts.iter().filter_map(|way| way.path.as_ref()).map(Geodesic::length).fold(0.0, f64::max);
        (((object + longest) / model.settings.step).ceil() as usize).max(1)
    }

    /// The contacts at `t`, as the fingertips really touch; None where one is too near an edge.
    fn contacts_at(&self, model: &Model, t: f64) -> Option<Contacts> {
        let object = &model.view.object;
        self.contacts
            .iter()
            .zip(&model.fingers)
            .map(|(way, finger)| match &way.path {
                None => Some(way.from),
                Some(_) if t <= 0.0 => Some(way.from),
                Some(_) if t >= 1.0 => Some(way.to),
                Some(path) => {
                    let settled = object.surface.settle(&path.at(t), finger.settle_radius)?;
                    object.keeps_off_edges(&settled).then_some(Contact {
                        point_in_object: settled.point_in_object,
                        normal_in_object: settled.normal_in_object,
                    })
                }
            })
            .collect()
    }
}
