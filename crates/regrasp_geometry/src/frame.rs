//! Poses, and motion between two poses.

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

/// A rigid transform, named `parent_from_child` where it is used.
pub type Pose = Isometry3<f64>;
/// A point, named after its frame where it is used (`point_in_object`).
pub type Point = Point3<f64>;
/// A free vector.
pub type Vector = Vector3<f64>;
/// A vector of length one.
pub type UnitVector = Unit<Vector3<f64>>;

/// The pose with origin at `position` and orientation `quat_xyzw`, which must be of length one within 1e-9.
pub fn pose_from(position: [f64; 3], quat_xyzw: [f64; 4]) -> Pose {
    let [x, y, z, w] = quat_xyzw;
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    Pose::from_parts(Translation3::from(Vector::from(position)), rotation)
}

/// Position and orientation of `pose` as `(position, quat_xyzw)` with `w >= 0`.
pub fn parts_of(pose: &Pose) -> ([f64; 3], [f64; 4]) {
    let q = pose.rotation.coords;
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    (pose.translation.vector.into(), [sign * q.x, sign * q.y, sign * q.z, sign * q.w])
}

/// The motion between waypoints: position linear, orientation by the shortest great circle, at `t` in `[0, 1]`.
///
/// At a turn of exactly pi the two shortest ways are equally long; the one that the quaternions' signs give is taken.
pub fn interpolate_pose(from: &Pose, to: &Pose, t: f64) -> Pose {
    PoseLine::between(from, to).at(t)
}

/// All poses of [`interpolate_pose`] from one pose to another: the same values, for asking more than once.
#[derive(Debug, Clone)]
pub struct PoseLine {
    from: Pose,
    to: Vector,
    rotation_vector: Vector,
}

impl PoseLine {
    /// The motion from one pose to another.
    pub fn between(from: &Pose, to: &Pose) -> Self {
        PoseLine { from: *from, to: to.translation.vector, rotation_vector: rotation_between(from, to) }
    }

    /// The pose at `t` in `[0, 1]`.
    pub fn at(&self, t: f64) -> Pose {
        let translation = self.from.translation.vector.lerp(&self.to, t);
        Pose::from_parts(
            Translation3::from(translation),
            UnitQuaternion::from_scaled_axis(self.rotation_vector * t) * self.from.rotation,
        )
    }
}

/// Rotation vector, in the parent frame, that turns `from` into `to`; its length is at most pi.
pub fn rotation_between(from: &Pose, to: &Pose) -> Vector {
    let mut delta = (to.rotation * from.rotation.inverse()).into_inner();
    if delta.w < 0.0 {
        delta = -delta;
    }
    let half_sine = delta.imag().norm();
    if half_sine < 1e-12 {
        return 2.0 * delta.imag();
    }
    delta.imag() * (2.0 * half_sine.atan2(delta.w) / half_sine)
}

/// Rotation vector that turns one rotation matrix into the other, by less than pi: `to = exp(vector) from`.
#[inline]
pub fn turn_between(from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector {
    // The entries of to * from^T that are not needed are not made.
    let row = |m: &Matrix3<f64>, i: usize| Vector::new(m[(i, 0)], m[(i, 1)], m[(i, 2)]);
    let (to, from) = ([row(to, 0), row(to, 1), row(to, 2)], [row(from, 0), row(from, 1), row(from, 2)]);
    let twice = Vector::new(
        to[2].dot(&from[1]) - to[1].dot(&from[2]),
        to[0].dot(&from[2]) - to[2].dot(&from[0]),
        to[1].dot(&from[0]) - to[0].dot(&from[1]),
    );
    let sine = 0.5 * twice.norm();
    let cosine = 0.5 * (to[0].dot(&from[0]) + to[1].dot(&from[1]) + to[2].dot(&from[2]) - 1.0);
    if sine < 1e-12 { twice * 0.5 } else { twice * (0.5 * sine.atan2(cosine) / sine) }
}

/// Distance between poses: translation plus `length` times the angle between them.
pub fn pose_distance(a: &Pose, b: &Pose, length: f64) -> f64 {
    (a.translation.vector - b.translation.vector).norm() + length * rotation_between(a, b).norm()
}

/// The direction of `vector`, however long or short: its square may overflow or underflow. None for the zero vector and for
/// numbers that are not finite.
pub fn direction(vector: &Vector) -> Option<UnitVector> {
    let largest = vector.amax();
    if largest == 0.0 || !vector.iter().all(|x| x.is_finite()) {
        return None;
    }
    // Divided, not multiplied by the inverse, which overflows for the smallest numbers.
    Some(UnitVector::new_normalize(vector / largest))
}

/// The length of `vector`, infinite only where it is no number.
pub fn length(vector: &Vector) -> f64 {
    vector.x.hypot(vector.y).hypot(vector.z)
}

/// Any two unit vectors that make a right-handed frame `(x, y, normal)` with `normal`.
pub fn tangents(normal: &UnitVector) -> (UnitVector, UnitVector) {
    // Duff et al. 2017, "Building an orthonormal basis, revisited".
    let n = normal.as_ref();
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        Unit::new_unchecked(Vector::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x)),
        Unit::new_unchecked(Vector::new(b, sign + n.y * n.y * a, -n.y)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_meets_both_ends_and_turns_at_constant_rate() {
        let from = pose_from([0.1, 0.0, 0.2], [0.0, 0.0, 0.0, 1.0]);
        let to = Pose::new(Vector::new(0.0, 0.3, 0.1), Vector::new(0.4, -1.2, 0.7));
        assert!(pose_distance(&interpolate_pose(&from, &to, 0.0), &from, 1.0) < 1e-12);
        assert!(pose_distance(&interpolate_pose(&from, &to, 1.0), &to, 1.0) < 1e-12);
        let half = interpolate_pose(&from, &to, 0.5);
        let whole = rotation_between(&from, &to).norm();
        assert!((rotation_between(&from, &half).norm() - 0.5 * whole).abs() < 1e-12);
    }

    #[test]
    fn directions_do_not_depend_on_lengths() {
        let asked = Vector::new(3.0, 0.0, -4.0);
        let expected = Vector::new(0.6, 0.0, -0.8);
        for factor in [1.0, 1e200, 3e307, 1e-9, 1e-200, 1e-300] {
            assert!((direction(&(asked * factor)).unwrap().into_inner() - expected).norm() < 1e-15, "{factor}");
            assert!((length(&(asked * factor)) / factor / 5.0 - 1.0).abs() < 1e-12, "{factor}");
        }
        assert_eq!(direction(&Vector::new(0.0, 1e-320, 0.0)).unwrap(), Vector::y_axis());
        assert_eq!(direction(&Vector::zeros()), None);
        assert_eq!(direction(&Vector::new(f64::INFINITY, 0.0, 0.0)), None);
        assert_eq!(direction(&Vector::new(1.0, f64::NAN, 0.0)), None);
    }

    #[test]
    fn tangents_make_a_right_handed_frame() {
        for direction in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.3, -0.5, 0.2], [1.0, 0.0, 0.0]] {
            let normal = Unit::new_normalize(Vector::from(direction));
            let (x, y) = tangents(&normal);
            assert!((x.cross(&y) - normal.as_ref()).norm() < 1e-12);
        }
    }
}
