//! Fingertips on the object: where they touch, how they keep a contact, and how they roll.

/// Joints with which a finger keeps a contact.
pub mod follow;
/// Steps of fingertips that roll.
pub mod step;
/// Where fingertips touch, and joints with which they do.
pub mod tip;
