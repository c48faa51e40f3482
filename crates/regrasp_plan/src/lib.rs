//! The plan, its file format, and the checker that judges it. Knows no planner and no roadmap.

/// The plan and its parts.
pub mod plan;
/// Reading and writing `plan.json`, and its JSON Schema.
pub mod format;
/// The checker: starts from files, shares no decision with the planner.
pub mod check;

pub use plan::{ContactMode, ContactState, Plan, Segment, SegmentKind, Waypoint};
