//! Contacts, friction cones, force closure with margin and certificate. Knows no planner.

/// Contact models.
pub mod contact;

pub use contact::Contact;
