//! Rotation matrix and translation of a shape: the form that support queries want.

use crate::frame::{Point, Pose, Vector};
use nalgebra::Matrix3;

/// A rigid transform as matrix and translation, `parent_from_child`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Rotation matrix.
    pub rotation: Matrix3<f64>,
    /// Position of the child's origin in the parent.
    pub translation: Vector,
}

impl Placement {
    /// No motion.
    pub fn identity() -> Self {
        Placement { rotation: Matrix3::identity(), translation: Vector::zeros() }
    }

    /// The child's point `point` in the parent.
    #[inline]
    pub fn point(&self, point: &Point) -> Point {
        Point::from(self.rotation * point.coords + self.translation)
    }

    /// The child's vector in the parent.
    #[inline]
    pub fn vector(&self, vector: &Vector) -> Vector {
        self.rotation * vector
    }

    /// The parent's vector in the child.
    #[inline]
    pub fn vector_to_child(&self, vector: &Vector) -> Vector {
        self.rotation.tr_mul(vector)
    }

    /// The parent's point in the child.
    #[inline]
    pub fn point_to_child(&self, point: &Point) -> Point {
        Point::from(self.rotation.tr_mul(&(point.coords - self.translation)))
    }

    /// `self * child`.
    #[inline]
    pub fn then(&self, child: &Placement) -> Placement {
        Placement {
            rotation: self.rotation * child.rotation,
            translation: self.rotation * child.translation + self.translation,
        }
    }

    /// Pose of `other` in the frame of `self`, both given in the same parent.
    #[inline]
    pub fn inverse_then(&self, other: &Placement) -> Placement {
        Placement {
            rotation: self.rotation.tr_mul(&other.rotation),
            translation: self.rotation.tr_mul(&(other.translation - self.translation)),
        }
    }

    /// Largest distance between the two positions of any point of a ball about `center` (child frame) when the child
    /// goes from `self` to `to`, at the two ends.
    #[inline]
    pub fn displacement(&self, to: &Placement, center: &Point, radius: f64) -> f64 {
        let moved = (to.rotation - self.rotation) * center.coords + (to.translation - self.translation);
        // The largest stretch of R1 - R0 is 2 sin(angle / 2), its Frobenius norm divided by sqrt 2.
        moved.norm() + radius * std::f64::consts::FRAC_1_SQRT_2 * (to.rotation - self.rotation).norm()
    }
}

impl From<&Pose> for Placement {
    fn from(pose: &Pose) -> Self {
        Placement { rotation: pose.rotation.to_rotation_matrix().into_inner(), translation: pose.translation.vector }
    }
}
