//! Grasp lists in the formats of other tools: Isaac grasp files, `moveit_msgs/Grasp`, arrays for numpy.

/// Isaac grasp files.
mod isaac;
/// `moveit_msgs/Grasp` messages.
mod moveit;
/// Arrays for numpy.
mod npz;

pub use crate::mjcf::grasps::to_mjcf;
pub use isaac::to_isaac;
pub use moveit::to_moveit;
pub use npz::to_npz;
