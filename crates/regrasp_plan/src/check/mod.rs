//! The checker: a second way of knowing whether a plan may be carried out. Shares no decision with the planner.

/// Force closure with margin, by exact second-order cones.
pub mod closure;
