//! Contacts, friction cones, force closure with margin and certificate. Knows no planner.
//!
//! A contact model is a file in `contact/`; what is asked of contacts of any models is in `closure/`.

/// Force closure with margin and certificate.
pub mod closure;
/// Contacts and contact models.
pub mod contact;
/// Lists of grasps of one hand and one object, and their file.
pub mod list;
/// The margin: a certified lower bound of the Ferrari-Canny radius.
pub mod margin;
/// What plan files and grasp lists share.
pub mod record;
/// `schema/record.d.ts`.
#[cfg(test)]
mod typescript;
/// Wrenches, and contact forces that balance them.
pub mod wrench;

pub use closure::{Closure, GraspFrame, Separation, Verdict, closure_margin};
pub use contact::{Contact, ContactForce, ContactModel, Grip};
pub use list::{GraspList, ListedGrasp};
pub use wrench::{ForceLimits, ForceProblem, NoForces, Wrench, held_at_most};
