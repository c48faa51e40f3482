//! Points of GS_n and GS_k: an object pose, the contacts of the fingers that hold, the joints of all.

use arrayvec::ArrayVec;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Most fingers that planners have room for: grasps are kept in arrays of this size. The checker has no such limit.
pub const MAX_FINGERS: usize = 6;
const _: () = assert!(MAX_FINGERS <= regrasp_grasp::wrench::force_distribution::MAX_GRIPS);

/// Joint positions of all fingers.
pub type HandJoints = ArrayVec<Coordinates, MAX_FINGERS>;
/// One contact per finger.
pub type Contacts = ArrayVec<Contact, MAX_FINGERS>;

/// Some fingers hold the object, the others are free, each with a posture of its own: a configuration in GS_k with its
/// independent fingers; in GS_n where all hold (Saut 2011, sec. 3.1 and 4.1).
#[derive(Debug, Clone, PartialEq)]
pub struct GraspState {
    /// Object pose.
    pub world_from_object: Pose,
    /// Fingers that hold, as bits.
    pub holding: u32,
    /// Contacts, in the object frame; [`no_contact`] for a finger that is free.
    pub contacts: Contacts,
    /// Joints: those that reach the contact, or the posture of a free finger.
    pub joints: HandJoints,
}

/// What stands in place of the contact of a free finger: always the same, so that states can be compared.
pub fn no_contact() -> Contact {
    Contact { point_in_object: Point::origin(), normal_in_object: Vector::z_axis() }
}

impl GraspState {
    /// The state in which all fingers hold.
    pub fn held_by_all(world_from_object: Pose, contacts: Contacts, joints: HandJoints) -> Self {
        GraspState { world_from_object, holding: (1 << contacts.len()) - 1, contacts, joints }
    }

    /// The state in which the fingers with a contact hold.
    pub fn of(world_from_object: Pose, fingers: impl Iterator<Item = (Option<Contact>, Coordinates)>) -> Self {
        let (contacts, joints) = (Contacts::new(), HandJoints::new());
        let mut state = GraspState { world_from_object, holding: 0, contacts, joints };
        for (finger, (contact, own)) in fingers.enumerate() {
            state.contacts.push(no_contact());
            state.joints.push(own);
            state.set_contact(finger, contact);
        }
        state
    }

    /// True when `finger` holds.
    pub fn holds(&self, finger: usize) -> bool {
        self.holding & (1 << finger) != 0
    }

    /// Contact of `finger`; None when it is free.
    pub fn contact(&self, finger: usize) -> Option<Contact> {
        self.holds(finger).then(|| self.contacts[finger])
    }

    /// Puts `finger` on a contact, or sets it free.
    pub fn set_contact(&mut self, finger: usize, contact: Option<Contact>) {
        match contact {
            Some(_) => self.holding |= 1 << finger,
            None => self.holding &= !(1 << finger),
        }
        self.contacts[finger] = contact.unwrap_or_else(no_contact);
    }

    /// True when all fingers hold.
    pub fn is_held_by_all(&self) -> bool {
        self.holding.count_ones() as usize == self.contacts.len()
    }
}

/// A moment of a transfer.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Object pose.
    pub world_from_object: Pose,
    /// Joints.
    pub joints: HandJoints,
    /// Contacts, which travel where fingertips roll.
    pub contacts: Contacts,
}

impl GraspState {
    /// The state at a moment of a transfer with this grasp.
    pub fn at(&self, moment: &Moment) -> Self {
        let Moment { world_from_object, joints, contacts } = moment.clone();
        GraspState { world_from_object, joints, contacts, holding: self.holding }
    }

    /// This state as a moment of a transfer.
    pub fn moment(&self) -> Moment {
        Moment {
            world_from_object: self.world_from_object,
            joints: self.joints.clone(),
            contacts: self.contacts.clone(),
        }
    }
}
