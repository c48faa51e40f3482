//! The plan, its file format, and the checker that judges it. Knows no planner and no roadmap.

/// The checker: starts from files, shares no decision with the planner.
pub mod check;
/// Objects of plan files in which every key stands once.
mod each_once;
/// Reading and writing `plan.json`, and its JSON Schema.
pub mod format;
/// The plan and its parts.
pub mod plan;
/// Plans of whole robots.
pub mod robot_plan;

/// Grasp lists: their type and file.
pub use regrasp_grasp::list as grasps;

pub use format::{AnyPlan, read_any};
pub use plan::{ContactMode, ContactState, Plan, Segment, SegmentKind, Waypoint};
pub use robot_plan::{
    HoldingPromises, RobotPlan, RobotPromises, RobotSegment, RobotSegmentKind, RobotStatistics, RobotWaypoint,
};
