//! One moving joint of a chain.

use crate::coupling::Coupling;
use regrasp_geometry::{Pose, UnitVector};

/// How a chain joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMotion {
    /// Turns about the axis, in radians.
    Turn,
    /// Slides along the axis, in metres.
    Slide,
}

/// One moving joint of a chain. Fixed joints are folded into `parent_from_joint`.
#[derive(Debug, Clone)]
pub struct ChainJoint {
    /// Pose of the joint frame at position zero in the frame of the body before it (the hand base, for the first).
    pub parent_from_joint: Pose,
    /// Axis, in the joint frame.
    pub axis: UnitVector,
    /// How it moves.
    pub motion: JointMotion,
    /// Coordinates of the chain that drive it.
    pub drive: Coupling<usize>,
}

impl ChainJoint {
    /// Position of the joint at the chain's `coordinates`.
    pub fn position(&self, coordinates: &[f64]) -> f64 {
        self.drive.position(|k| coordinates[k])
    }

    /// Lowest and highest position of the joint while the chain's coordinates keep their own limits, `lower` and `upper`.
    pub fn range(&self, [lower, upper]: [&[f64]; 2]) -> [f64; 2] {
        self.drive.range(|k| [lower[k], upper[k]])
    }
}
