//! Contacts, friction cones, force closure with margin and certificate. Knows no planner.
//!
//! A contact model is a file in `contact/`: the point contact with friction is the first; frictionless and soft-finger
//! contacts join as files of their own.

/// Force closure with margin and certificate.
pub mod closure;
/// Contacts and contact models.
pub mod contact;
/// The margin: a certified lower bound of the Ferrari-Canny radius.
pub mod margin;

pub use closure::{Closure, GraspFrame, closure_margin};
pub use contact::Contact;
