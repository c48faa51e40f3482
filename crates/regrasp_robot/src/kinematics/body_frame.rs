//! Frames as rotation matrix and translation, for the hottest paths.
//!
//! Composing and applying them takes about half the work of quaternion poses, and a joint's whole motion is three
//! precomputed matrices (Rodrigues' formula): `R(q) = A + sin(q) B + cos(q) C`.

use super::chain::{ChainJoint, Motion};
use super::trig::sin_cos;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Vector};

/// Pose of a body in the base frame: `base_from_body` as rotation matrix and translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyFrame {
    /// Columns are the body's axes in the base frame.
    pub rotation: Matrix3<f64>,
    /// The body's origin in the base frame.
    pub translation: Vector,
}

impl BodyFrame {
    /// The base frame itself.
    pub const IDENTITY: BodyFrame = BodyFrame {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        translation: Vector::new(0.0, 0.0, 0.0),
    };

    /// The same pose as a matrix.
    pub fn from_pose(pose: &Pose) -> Self {
        BodyFrame { rotation: *pose.rotation.to_rotation_matrix().matrix(), translation: pose.translation.vector }
    }

    /// The same pose with a quaternion.
    pub fn to_pose(&self) -> Pose {
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(self.rotation));
        Pose::from_parts(Translation3::from(self.translation), rotation)
    }

    /// `point_in_base` of a point given in the body.
    #[inline]
    pub fn transform_point(&self, point_in_body: &Point) -> Point {
        Point::from(self.rotation * point_in_body.coords + self.translation)
    }

    /// `vector_in_base` of a vector given in the body.
    #[inline]
    pub fn transform_vector(&self, vector_in_body: &Vector) -> Vector {
        self.rotation * vector_in_body
    }

    /// `point_in_body` of a point given in the base frame.
    #[inline]
    pub fn inverse_transform_point(&self, point_in_base: &Point) -> Point {
        Point::from(self.rotation.tr_mul(&(point_in_base.coords - self.translation)))
    }

    /// `vector_in_body` of a vector given in the base frame.
    #[inline]
    pub fn inverse_transform_vector(&self, vector_in_base: &Vector) -> Vector {
        self.rotation.tr_mul(vector_in_base)
    }

    /// `base_from_child`, where `self` is `base_from_body` and `body_from_child` is given.
    #[inline]
    #[must_use]
    pub fn compose(&self, body_from_child: &BodyFrame) -> BodyFrame {
        BodyFrame {
            rotation: self.rotation * body_from_child.rotation,
            translation: self.rotation * body_from_child.translation + self.translation,
        }
    }
}

/// A chain joint with its constant parts multiplied out.
#[derive(Debug, Clone)]
pub(super) struct PreparedJoint {
    coordinate: usize,
    multiplier: f64,
    offset: f64,
    /// Origin of the joint frame in the parent body.
    translation: Vector,
    motion: PreparedMotion,
}

#[derive(Debug, Clone)]
enum PreparedMotion {
    /// `parent_from_child` rotation is `constant + sin(q) * sine + cos(q) * cosine`.
    Turn { constant: Matrix3<f64>, sine: Matrix3<f64>, cosine: Matrix3<f64> },
    /// Constant rotation; the translation grows by `q * axis_in_parent`.
    Slide { rotation: Matrix3<f64>, axis_in_parent: Vector },
}

impl PreparedJoint {
    pub(super) fn new(joint: &ChainJoint) -> Self {
        let rotation = *joint.parent_from_joint.rotation.to_rotation_matrix().matrix();
        let motion = match joint.motion {
            Motion::Turn => {
                let cross = joint.axis.cross_matrix();
                let cross_squared = cross * cross;
                PreparedMotion::Turn {
                    constant: rotation * (Matrix3::identity() + cross_squared),
                    sine: rotation * cross,
                    cosine: -(rotation * cross_squared),
                }
            }
            Motion::Slide => PreparedMotion::Slide { rotation, axis_in_parent: rotation * joint.axis.into_inner() },
        };
        PreparedJoint {
            coordinate: joint.coordinate,
            multiplier: joint.multiplier,
            offset: joint.offset,
            translation: joint.parent_from_joint.translation.vector,
            motion,
        }
    }

    /// `base_from_child`, where `base_from_parent` is given.
    #[inline]
    pub(super) fn child_frame(&self, base_from_parent: &BodyFrame, coordinates: &[f64]) -> BodyFrame {
        let position = self.multiplier * coordinates[self.coordinate] + self.offset;
        match &self.motion {
            PreparedMotion::Turn { constant, sine, cosine } => {
                let (s, c) = sin_cos(position);
                let parent_from_child = constant + sine * s + cosine * c;
                BodyFrame {
                    rotation: base_from_parent.rotation * parent_from_child,
                    translation: base_from_parent.rotation * self.translation + base_from_parent.translation,
                }
            }
            PreparedMotion::Slide { rotation, axis_in_parent } => BodyFrame {
                rotation: base_from_parent.rotation * rotation,
                translation: base_from_parent.rotation * (self.translation + axis_in_parent * position)
                    + base_from_parent.translation,
            },
        }
    }
}
