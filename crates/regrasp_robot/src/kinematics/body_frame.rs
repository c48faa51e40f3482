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
        Point::from(apply(&self.rotation, &point_in_body.coords) + self.translation)
    }

    /// `vector_in_base` of a vector given in the body.
    #[inline]
    pub fn transform_vector(&self, vector_in_body: &Vector) -> Vector {
        apply(&self.rotation, vector_in_body)
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
            rotation: product(&self.rotation, &body_from_child.rotation),
            translation: apply(&self.rotation, &body_from_child.translation) + self.translation,
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
    /// The axis is the joint frame's own x, y or z (0, 1, 2), or its opposite: only two columns mix.
    TurnAligned {
        /// Rotation of the joint frame in the parent body, unless it is the identity.
        rotation: Option<Matrix3<f64>>,
        axis: usize,
        sign: f64,
    },
    /// `parent_from_child` rotation is `constant + sin(q) * sine + cos(q) * cosine`.
    Turn { constant: Matrix3<f64>, sine: Matrix3<f64>, cosine: Matrix3<f64> },
    /// Constant rotation; the translation grows by `q * axis_in_parent`.
    Slide { rotation: Matrix3<f64>, axis_in_parent: Vector },
}

impl PreparedJoint {
    pub(super) fn new(joint: &ChainJoint) -> Self {
        let rotation = *joint.parent_from_joint.rotation.to_rotation_matrix().matrix();
        let motion = match joint.motion {
            Motion::Turn if joint.axis.amax() == 1.0 => {
                let axis = joint.axis.iamax();
                let rotation = (rotation != Matrix3::identity()).then_some(rotation);
                PreparedMotion::TurnAligned { rotation, axis, sign: joint.axis[axis] }
            }
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
            PreparedMotion::TurnAligned { rotation, axis, sign } => {
                let (s, c) = sin_cos(position);
                let s = s * sign;
                let joint = match rotation {
                    Some(rotation) => product(&base_from_parent.rotation, rotation),
                    None => base_from_parent.rotation,
                };
                let column = |k: usize| [joint[(0, k)], joint[(1, k)], joint[(2, k)]];
                let mix = |first: [f64; 3], second: [f64; 3]| {
                    let turned: [f64; 3] = std::array::from_fn(|i| c * first[i] + s * second[i]);
                    let next: [f64; 3] = std::array::from_fn(|i| c * second[i] - s * first[i]);
                    (turned, next)
                };
                let [x, y, z] = [column(0), column(1), column(2)];
                let columns = match axis {
                    0 => {
                        let (y, z) = mix(y, z);
                        [x, y, z]
                    }
                    1 => {
                        let (z, x) = mix(z, x);
                        [x, y, z]
                    }
                    _ => {
                        let (x, y) = mix(x, y);
                        [x, y, z]
                    }
                };
                BodyFrame {
                    rotation: Matrix3::from(columns),
                    translation: apply(&base_from_parent.rotation, &self.translation) + base_from_parent.translation,
                }
            }
            PreparedMotion::Turn { constant, sine, cosine } => {
                let (s, c) = sin_cos(position);
                let parent_from_child = constant + sine * s + cosine * c;
                BodyFrame {
                    rotation: product(&base_from_parent.rotation, &parent_from_child),
                    translation: apply(&base_from_parent.rotation, &self.translation) + base_from_parent.translation,
                }
            }
            PreparedMotion::Slide { rotation, axis_in_parent } => BodyFrame {
                rotation: product(&base_from_parent.rotation, rotation),
                translation: apply(&base_from_parent.rotation, &(self.translation + axis_in_parent * position))
                    + base_from_parent.translation,
            },
        }
    }
}

/// Matrix times vector, written out: the general product of the library is not unrolled.
#[inline(always)]
fn apply(a: &Matrix3<f64>, v: &Vector) -> Vector {
    Vector::new(
        a.m11 * v.x + a.m12 * v.y + a.m13 * v.z,
        a.m21 * v.x + a.m22 * v.y + a.m23 * v.z,
        a.m31 * v.x + a.m32 * v.y + a.m33 * v.z,
    )
}

/// Matrix times matrix, written out.
#[inline(always)]
fn product(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    let column = |x: f64, y: f64, z: f64| {
        [a.m11 * x + a.m12 * y + a.m13 * z, a.m21 * x + a.m22 * y + a.m23 * z, a.m31 * x + a.m32 * y + a.m33 * z]
    };
    Matrix3::from([column(b.m11, b.m21, b.m31), column(b.m12, b.m22, b.m32), column(b.m13, b.m23, b.m33)])
}
