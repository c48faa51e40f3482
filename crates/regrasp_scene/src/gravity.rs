//! Which way things fall.

use regrasp_geometry::frame::direction;
use regrasp_geometry::{Pose, UnitVector, Vector};

/// Standard gravity, in metres per second squared (ISO 80000-3).
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// Direction of gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gravity {
    /// Downwards, in the world frame.
    Direction(UnitVector),
    /// Whichever: the hand may be carried about.
    Any,
}

impl Gravity {
    /// Along `down`, of any length, in a frame that is turned by `world_from_frame`. None for the zero vector and numbers that are
    /// not finite.
    pub fn along(world_from_frame: &Pose, down: &Vector) -> Option<Self> {
        let down = direction(down)?;
        Some(Gravity::Direction(world_from_frame.rotation * down))
    }

    /// Acceleration in the world; None where the direction is not known.
    pub fn in_world(&self) -> Option<Vector> {
        match self {
            Gravity::Direction(down) => Some(down.into_inner() * STANDARD_GRAVITY),
            Gravity::Any => None,
        }
    }
}

impl Default for Gravity {
    /// Along the world's -Z.
    fn default() -> Self {
        Gravity::Direction(UnitVector::new_unchecked(Vector::new(0.0, 0.0, -1.0)))
    }
}
