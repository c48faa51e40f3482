//! Where an object has to go, as a scene file says it.

use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::{Pose, UnitVector, Vector};
use std::f64::consts::PI;

/// Angles that differ by less are the same, in radians.
const SAME_ANGLE: f64 = 1e-9;

/// Where the object has to go: the goal, or a pose on the way.
#[derive(Debug, Clone, PartialEq)]
pub enum Goal {
    /// To an orientation in the world, where the start is.
    Orientation(UnitQuaternion<f64>),
    /// To a pose of the world.
    Pose(Pose),
    /// Turned about its own origin, by world axes, and moved: both as seen from the start.
    Turn {
        /// Axis, in the world frame; the turn is applied after the start orientation.
        axis: UnitVector,
        /// Angle, in radians; may exceed half a turn.
        angle: f64,
        /// Displacement of the object's origin, in the world frame.
        shift: Vector,
    },
}

impl Goal {
    /// The pose, seen from the start as drawn.
    pub fn pose(&self, start: &Pose) -> Pose {
        self.pose_at(start, 1.0)
    }

    /// The pose at a share of the turn and the displacement; that of a goal in the world does not depend on it.
    pub fn pose_at(&self, start: &Pose, share: f64) -> Pose {
        match self {
            Goal::Pose(pose) => *pose,
            Goal::Orientation(rotation) => Pose::from_parts(start.translation, *rotation),
            Goal::Turn { axis, angle, shift } => {
                let position = start.translation.vector + shift * share;
                let rotation = UnitQuaternion::from_axis_angle(axis, angle * share);
                Pose::from_parts(Translation3::from(position), rotation * start.rotation)
            }
        }
    }

    /// Legs that a turn is broken into, so that each is below half a turn; half a turn itself is one leg.
    pub fn n_legs(&self) -> usize {
        match self {
            Goal::Turn { angle, .. } if angle.abs() > PI + SAME_ANGLE => {
                (angle.abs() / PI + SAME_ANGLE).floor() as usize + 1
            }
            _ => 1,
        }
    }
}

/// Way poses and goal pose for an object that starts at `start`: those of `way`, then those that break up a goal beyond half a turn.
pub fn poses_from(start: &Pose, way: &[Goal], goal: &Goal) -> (Vec<Pose>, Pose) {
    let mut poses: Vec<Pose> = way.iter().map(|pose| pose.pose(start)).collect();
    let n_legs = goal.n_legs();
    poses.extend((1..n_legs).map(|leg| goal.pose_at(start, leg as f64 / n_legs as f64)));
    (poses, goal.pose(start))
}
