//! Plans and grasp lists in the formats of other tools. Knows no planner; `docs/reference/export-formats.md` describes what is written.
//!
//! Everything written is a function of the plan alone: the same plan gives the same bytes.

/// A plan as arrays over all waypoints.
pub mod arrays;
/// Why a plan cannot be written in a format.
pub mod error;
/// Grasp lists in the formats of other tools.
pub mod grasps;
/// MuJoCo models of a plan's scene.
pub mod mjcf;
/// Arrays for numpy: `.npz` without pickle.
pub mod npz;
/// Plans of whole robots.
pub mod robots;
/// ROS 2 `trajectory_msgs/JointTrajectory` as YAML.
pub mod ros2;
/// Texts and numbers as YAML.
mod yaml;

pub use arrays::PlanArrays;
pub use error::ExportError;
pub use mjcf::{Mjcf, MjcfError, robot_to_mjcf, to_mjcf};
pub use npz::to_npz;
pub use robots::{ControllerGroup, controller_groups, robot_to_npz, robot_to_ros2};
pub use ros2::to_ros2;
