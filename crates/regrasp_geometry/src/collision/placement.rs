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
    pub const IDENTITY: Placement = Placement {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        translation: Vector::new(0.0, 0.0, 0.0),
    };

    /// The same pose with a quaternion.
    pub fn to_pose(&self) -> Pose {
        let rotation = nalgebra::Rotation3::from_matrix_unchecked(self.rotation);
        Pose::from_parts(self.translation.into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
    }

    /// The child's point `point` in the parent.
    #[inline]
    pub fn point(&self, point: &Point) -> Point {
        Point::from(apply(&self.rotation, &point.coords) + self.translation)
    }

    /// The child's vector in the parent.
    #[inline]
    pub fn vector(&self, vector: &Vector) -> Vector {
        apply(&self.rotation, vector)
    }

    /// The parent's vector in the child.
    #[inline]
    pub fn vector_to_child(&self, vector: &Vector) -> Vector {
        apply_transposed(&self.rotation, vector)
    }

    /// The parent's point in the child.
    #[inline]
    pub fn point_to_child(&self, point: &Point) -> Point {
        Point::from(apply_transposed(&self.rotation, &(point.coords - self.translation)))
    }

    /// `self * child`.
    #[inline]
    pub fn then(&self, child: &Placement) -> Placement {
        Placement {
            rotation: product(&self.rotation, &child.rotation),
            translation: apply(&self.rotation, &child.translation) + self.translation,
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
        let turned = to.rotation - self.rotation;
        let moved = apply(&turned, &center.coords) + (to.translation - self.translation);
        // The largest stretch of R1 - R0 is 2 sin(angle / 2), its Frobenius norm divided by sqrt 2.
        moved.norm() + radius * std::f64::consts::FRAC_1_SQRT_2 * turned.norm()
    }
}

impl From<&Pose> for Placement {
    fn from(pose: &Pose) -> Self {
        Placement { rotation: pose.rotation.to_rotation_matrix().into_inner(), translation: pose.translation.vector }
    }
}

/// Matrix times vector, written out: the general product of the library is not unrolled.
#[inline(always)]
pub fn apply(a: &Matrix3<f64>, v: &Vector) -> Vector {
    Vector::new(
        a.m11 * v.x + a.m12 * v.y + a.m13 * v.z,
        a.m21 * v.x + a.m22 * v.y + a.m23 * v.z,
        a.m31 * v.x + a.m32 * v.y + a.m33 * v.z,
    )
}

/// Transposed matrix times vector, written out.
#[inline(always)]
pub fn apply_transposed(a: &Matrix3<f64>, v: &Vector) -> Vector {
    Vector::new(
        a.m11 * v.x + a.m21 * v.y + a.m31 * v.z,
        a.m12 * v.x + a.m22 * v.y + a.m32 * v.z,
        a.m13 * v.x + a.m23 * v.y + a.m33 * v.z,
    )
}

/// Matrix times matrix, written out.
#[inline(always)]
pub fn product(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    let column = |x: f64, y: f64, z: f64| {
        [a.m11 * x + a.m12 * y + a.m13 * z, a.m21 * x + a.m22 * y + a.m23 * z, a.m31 * x + a.m32 * y + a.m33 * z]
    };
    Matrix3::from([column(b.m11, b.m21, b.m31), column(b.m12, b.m22, b.m32), column(b.m13, b.m23, b.m33)])
}
