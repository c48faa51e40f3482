//! Frames as rotation matrix and translation, for the hottest paths.
//!
//! Composing and applying them takes about half the work of quaternion poses, and a joint's whole motion is three
//! precomputed matrices (Rodrigues' formula): `R(q) = A + sin(q) B + cos(q) C`.

use super::chain_joint::{ChainJoint, JointMotion};
use super::trig::sin_cos;
use nalgebra::Matrix3;
use regrasp_geometry::Vector;
pub use regrasp_geometry::collision::Placement as BodyFrame;
use regrasp_geometry::collision::placement::{apply, product};

/// A chain joint with its constant parts multiplied out.
#[derive(Debug, Clone)]
pub(super) struct PreparedJoint {
    coordinate: usize,
    multiplier: f64,
    offset: f64,
    /// Coordinates besides that one, with their multipliers: none for nearly all joints.
    others: Box<[(usize, f64)]>,
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
            JointMotion::Turn if joint.axis.amax() == 1.0 => {
                let axis = joint.axis.iamax();
                let rotation = (rotation != Matrix3::identity()).then_some(rotation);
                PreparedMotion::TurnAligned { rotation, axis, sign: joint.axis[axis] }
            }
            JointMotion::Turn => {
                let cross = joint.axis.cross_matrix();
                let cross_squared = cross * cross;
                PreparedMotion::Turn {
                    constant: rotation * (Matrix3::identity() + cross_squared),
                    sine: rotation * cross,
                    cosine: -(rotation * cross_squared),
                }
            }
            JointMotion::Slide => {
                PreparedMotion::Slide { rotation, axis_in_parent: rotation * joint.axis.into_inner() }
            }
        };
        let (coordinate, multiplier) = joint.drive.terms[0];
        PreparedJoint {
            coordinate,
            multiplier,
            offset: joint.drive.offset,
            others: joint.drive.terms[1..].into(),
            translation: joint.parent_from_joint.translation.vector,
            motion,
        }
    }

    /// `base_from_child`, where `base_from_parent` is given.
    #[inline(always)]
    pub(super) fn child_frame(&self, base_from_parent: &BodyFrame, coordinates: &[f64]) -> BodyFrame {
        let mut sum = self.multiplier * coordinates[self.coordinate];
        for &(k, multiplier) in &self.others {
            sum += multiplier * coordinates[k];
        }
        let position = sum + self.offset;
        match &self.motion {
            PreparedMotion::TurnAligned { rotation, axis, sign } => {
                let (s, c) = sin_cos(position);
                let s = s * sign;
                let joint = match rotation {
                    Some(rotation) => product(&base_from_parent.rotation, rotation),
                    None => base_from_parent.rotation,
                };
                let (x, y, z) = (joint.column(0), joint.column(1), joint.column(2));
                let (x, y, z) = match axis {
                    0 => (x.into(), y * c + z * s, z * c - y * s),
                    1 => (x * c - z * s, y.into(), z * c + x * s),
                    _ => (x * c + y * s, y * c - x * s, z.into()),
                };
                BodyFrame {
                    rotation: Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z),
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
