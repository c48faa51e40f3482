//! The search in one frame: contacts finger by finger, the grasp that they make, and its way in.

/// Which contacts make the grasp.
mod combine;
/// Contacts that a finger reaches.
mod contacts;
/// One frame.
pub mod frame;
/// What a grasp is worth.
pub mod worth;
