//! Forward kinematics, Jacobians, inverse kinematics and motion bounds of serial chains.

/// Inverse kinematics of arms to a pose.
pub mod arm_ik;
/// Frames as rotation matrix and translation, for the hottest paths.
pub mod body_frame;
/// Serial chains, forward kinematics and Jacobians.
pub mod chain;
/// One moving joint of a chain.
pub mod chain_joint;
/// Finger inverse kinematics to a point.
pub mod finger_ik;
/// Bounds on the motion of shapes while coordinates move along a line.
pub mod motion_bound;
/// Chains for tests.
#[cfg(test)]
mod samples;
/// Sine and cosine together, the same bits on every machine.
mod trig;
/// The last body of a chain as a whole: twists, joints for a pose, torques for a force.
pub mod whole_pose;
