//! Points of GS_n: an object pose and n contacts, with the joints that reach them; and the motions between them.

use super::workspace::{Contacts, HandJoints};
use regrasp_geometry::Pose;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// All fingers hold the object (a configuration in GS_n; paper 000, section 4.1).
#[derive(Debug, Clone)]
pub struct GraspState {
    /// Object pose.
    pub world_from_object: Pose,
    /// Contacts, in the object frame.
    pub contacts: Contacts,
    /// Joints that reach the contacts.
    pub joints: HandJoints,
}

/// A moment of a transfer.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Object pose.
    pub world_from_object: Pose,
    /// Joints.
    pub joints: HandJoints,
}

/// A feasible elementary motion (paper 000, section 3.2).
#[derive(Debug, Clone)]
pub enum Motion {
    /// The object moves, the grasp stays. Moments after the start, the last one being the end.
    Transfer(Vec<Moment>),
    /// One finger moves to another contact. Its joints after the start, the last ones being at the contact.
    Regrasp {
        /// Which finger.
        finger: usize,
        /// Its joints.
        path: Vec<Coordinates>,
    },
}

/// A motion and the state it ends in.
#[derive(Debug, Clone)]
pub struct Step {
    /// The motion.
    pub motion: Motion,
    /// Where it ends.
    pub end: GraspState,
}

impl GraspState {
    /// The state with one finger at another contact.
    pub fn with_finger(&self, finger: usize, contact: regrasp_grasp::Contact, joints: Coordinates) -> Self {
        let mut state = self.clone();
        state.contacts[finger] = contact;
        state.joints[finger] = joints;
        state
    }
}
