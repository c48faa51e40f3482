//! Robots as read, hands as planned with, and their kinematics. Knows no object and no force.
//!
//! Models never change after loading; poses and joint values live with the caller.

/// What a fingertip can transmit where it touches.
pub mod contact_model;
/// Joints that follow others.
pub mod coupling;
/// A hand: a palm and serial fingers.
pub mod hand;
/// Ids of links and joints.
pub mod ids;
/// Readers: URDF, SRDF, `package://` paths, hand files.
pub mod import;
/// What a robot and a hand are like: joints, meshes, units, fingers guessed, links that always or never touch.
pub mod inspect;
/// Forward kinematics, Jacobians, inverse kinematics and motion bounds of serial chains.
pub mod kinematics;
/// Robots with arms and hands: one tree, one layout of joints.
pub mod manipulator;
/// Links and joints of a robot, as read.
pub mod robot;
/// Fingertips: what of the last link touches.
pub mod tip;

pub use contact_model::ContactModel;
pub use coupling::{Coupling, LinearLimit};
pub use hand::{Finger, FingerId, FingerShape, Hand, Tie};
pub use import::{LoadOptions, LoadedHand, LoadedInput, LoadedManipulator, LoadedRobot, ResolveOptions};
pub use import::{load_hand, load_manipulator, load_robot};
pub use kinematics::chain::{Chain, ChainJoint, JointMotion};
pub use manipulator::layout::{JointLayout, Part};
pub use manipulator::{Arm, LinkShape, Manipulator, MountedHand};
pub use robot::{Joint, JointId, JointKind, Limits, Link, LinkId, Robot, Visual, VisualGeometry, VisualMesh};
pub use tip::{Tip, TipShape};

#[cfg(test)]
#[path = "../../../tests/support/places.rs"]
mod places;
