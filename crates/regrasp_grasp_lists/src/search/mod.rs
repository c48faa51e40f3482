//! The search in one frame: contacts finger by finger, the grasp that they make, and its way in.

/// Which places close the object.
mod closing;
/// Which contacts make the grasp.
mod combine;
/// Contacts that a finger reaches.
mod contacts;
/// One frame.
pub mod frame;
/// What a grasp is worth.
pub mod worth;
