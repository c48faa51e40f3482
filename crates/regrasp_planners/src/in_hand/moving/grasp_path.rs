//! Linear paths in GS_n: the object and all contacts move at once, the contacts over the object's surface
//! (Saut 2011, sec. 4.1 and 4.2.2; Sahbani 2007, sec. IV-B).
//!
//! No hand can follow such a path as it stands; `decompose.rs` cuts it into transfers and regrasps.
//!
//! Where a contact crosses an edge of the object it would come too near to it. That part of its way is jumped over: the finger
//! changes its contact, while the others hold. So every n-1 fingers are closed on both sides of a jump.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::moving::contact_path::ContactPath;
use arrayvec::ArrayVec;
use regrasp_geometry::collision::Placement;
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
    path: Option<ContactPath>,
    /// True when it leads over an edge.
    crosses: bool,
    /// Parts of the path, by its parameter, that lie too near an edge.
    jumps: Vec<Jump>,
}

/// A part of a contact's path that it jumps over, half-way: where it still holds and where it holds again.
#[derive(Debug, Clone, Copy)]
struct Jump {
    last: f64,
    next: f64,
}

impl ContactWay {
    /// Where on its path the contact is at `t`, and how many jumps it has made.
    fn place(&self, t: f64) -> (f64, usize) {
        let n_made = self.jumps.iter().take_while(|jump| t > 0.5 * (jump.last + jump.next)).count();
        let t = match (n_made.checked_sub(1).map(|made| self.jumps[made]), self.jumps.get(n_made)) {
            (Some(made), _) if t < made.next => made.next,
            (_, Some(ahead)) if t > ahead.last => ahead.last,
            _ => t,
        };
        (t, n_made)
    }
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
        let (n_steps, at) = (self.joints.len(), t * self.joints.len() as f64);
        let joints = (0..model.n_fingers())
            .map(|finger| {
                let n_jumps = |t: f64| self.way.contacts[finger].place(t).1;
                // The step nearest to `t` on the same side of every jump.
                let is_alike = |k: &usize| n_jumps(*k as f64 / n_steps as f64) == n_jumps(t);
                let around = [at.round() as usize, at.floor() as usize, at.ceil() as usize];
                let k = around.into_iter().find(is_alike)?;
                let seed = if k == 0 { &self.start_joints } else { &self.joints[k - 1] };
                follow_contact(model, finger, &contacts[finger], &placement, &seed[finger])
            })
            .collect::<Option<HandJoints>>()?;
        Some(GraspState::held_by_all(world_from_object, contacts, joints))
    }
}

fn trace(search: &mut Search, model: &Model, from: &GraspState, to: &GraspState) -> Result<GraspPath, Reason> {
    let mut way = Way::new(search, model, from, to).ok_or(Reason::Crease)?;
    let every_finger = (1u32 << model.n_fingers()) - 1;
    for t in FIRST_LOOKS {
        // What is too near an edge there will jump, nobody has asked where from yet.
        let Some(contacts) = way.contacts_at(model, t) else { continue };
        if releasable(model, &contacts, every_finger) != every_finger {
            return Err(Reason::NotClosed);
        }
        let placement = Placement::from(&interpolate_pose(&way.from, &way.to, t));
        search.workspace.work += 1;
        if !(0..model.n_fingers()).all(|f| in_reach(model, f, &contacts[f], &placement)) {
            return Err(Reason::OutOfReach);
        }
    }
    way.find_jumps(model);
    let n_steps = way.n_steps(model);
    let mut joints = Vec::with_capacity(n_steps);
    let mut current = from.joints.clone();
    search.workspace.set(&from.world_from_object, &from.joints, &from.contacts);
    for k in 1..=n_steps {
        let t = k as f64 / n_steps as f64;
        let contacts = way.contacts_at(model, t).ok_or(Reason::Crease)?;
        let pose = interpolate_pose(&way.from, &way.to, t);
        let placement = Placement::from(&pose);
        let before = (k - 1) as f64 / n_steps as f64;
        for (finger, contact) in contacts.iter().enumerate() {
            let contact_way = &way.contacts[finger];
            let joints = if contact_way.place(before).1 == contact_way.place(t).1 {
                follow_contact(model, finger, contact, &placement, &current[finger])
            } else {
                let normal = UnitVector::new_unchecked(placement.vector(&contact.normal_in_object));
                let settings = ik_settings(model, finger, normal);
                model.fingers[finger].touch_random(&placement, contact, &settings, &mut search.rng)
            };
            current[finger] = joints.ok_or(Reason::OutOfReach)?;
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
    /// None when a contact has no shortest way, or would have to cross an edge and may not.
    fn new(search: &Search, model: &Model, from: &GraspState, to: &GraspState) -> Option<Self> {
        let surface = &model.view.object.surface;
        let may_cross = search.settings.baselines.edge_crossings;
        let mut contacts = ArrayVec::new();
        for (a, b) in from.contacts.iter().zip(&to.contacts) {
            if a == b {
                contacts.push(ContactWay { from: *a, to: *b, path: None, crosses: false, jumps: Vec::new() });
                continue;
            }
            let (start, end) = (surface.project(&a.point_in_object), surface.project(&b.point_in_object));
            let is_flat = surface.same_face(&start, &end);
            if !is_flat && !may_cross {
                return None;
            }
            let path = ContactPath::between(surface, &model.view.object.center_of_mass, &start, &end)?;
            contacts.push(ContactWay { from: *a, to: *b, path: Some(path), crosses: !is_flat, jumps: Vec::new() });
        }
        Some(Way { from: from.world_from_object, to: to.world_from_object, contacts })
    }

    /// Finds the parts of the contacts' paths that are jumped over.
    fn find_jumps(&mut self, model: &Model) {
        for (finger, way) in self.contacts.iter_mut().enumerate().filter(|(_, way)| way.crosses) {
            if let Some(path) = &way.path {
                way.jumps = jumps_of(model, finger, path);
            }
        }
    }

    /// Number of steps of which none moves a fingertip by more than the step length.
    fn n_steps(&self, model: &Model) -> usize {
        let object = frame::pose_distance(&self.from, &self.to, model.turn_length());
        let longest =
            self.contacts.iter().filter_map(|way| way.path.as_ref()).map(ContactPath::length).fold(0.0, f64::max);
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
                    let (t, _) = way.place(t);
                    let settled = object.surface.settle(&path.at(&object.surface, t)?, finger.settle_radius)?;
                    model.keeps_off_edges(&settled).then_some(Contact {
                        point_in_object: settled.point_in_object,
                        normal_in_object: settled.normal_in_object,
                    })
                }
            })
            .collect()
    }
}

/// Distance between the points of a path at which it is asked whether the path is too near an edge, in metres.
const JUMP_STEP: f64 = 0.001;

/// The parts of a path that lie too near an edge, or where the tip of `finger` does not fit; both ends of the path do not.
fn jumps_of(model: &Model, finger: usize, path: &ContactPath) -> Vec<Jump> {
    let object = &model.view.object;
    let n = (path.length() / JUMP_STEP).ceil().max(1.0);
    let holds = |t: f64| {
        let at = path.at(&object.surface, t);
        let settled = at.and_then(|at| object.surface.settle(&at, model.fingers[finger].settle_radius));
        settled.is_some_and(|settled| model.keeps_off_edges(&settled))
    };
    let mut jumps: Vec<Jump> = Vec::new();
    let (mut last, mut is_jumping) = (0.0, false);
    for k in 1..=n as usize {
        let t = k as f64 / n;
        if t < 1.0 && !holds(t) {
            is_jumping = true;
            continue;
        }
        if is_jumping {
            jumps.push(Jump { last, next: t });
        }
        (last, is_jumping) = (t, false);
    }
    jumps
}
