//! The plan of a solution, and its validation.

/// The plan as it is written to a file.
pub mod record;
/// Validating a plan once at the planner's resolution: the floor of planning time.
pub mod validate;
