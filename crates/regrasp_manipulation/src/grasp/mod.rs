//! Grasps, the contacts that they are made of, and the motions between them.

/// Contacts that a finger finds by closing until its tip touches.
pub mod closing;
/// Contacts that a finger can reach, drawn at random.
pub mod contact;
/// Motions from grasp to grasp.
pub mod sequence;
/// Points of GS_n and GS_k.
pub mod state;
/// Where a fingertip touches, and how far it is from touching.
pub mod touch;
/// Whether a finger can make use of a contact.
mod usable;
