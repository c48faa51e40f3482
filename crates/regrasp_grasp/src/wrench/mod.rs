//! Wrenches on the object, and the contact forces that balance them.

/// Room for a weight whose direction is not known.
pub mod any_direction;
/// The minimum of a quadratic, with a logarithmic barrier before every limit.
mod barrier;
/// Contact forces that balance a load.
pub mod force_distribution;
/// Small dense linear programs.
pub mod linear_program;
/// Newton steps, contact by contact.
pub use force_distribution::{
    BalancedForces, ForceLimits, ForceProblem, JointRow, JointRows, NoForces, Reserve, Rubbing, Wrench, any_inside,
    can_balance, distribute, distribute_if_any, held_at_most,
};
