//! Forward kinematics, Jacobians, inverse kinematics and motion bounds of serial chains.

/// Serial chains, forward kinematics and Jacobians.
pub mod chain;
