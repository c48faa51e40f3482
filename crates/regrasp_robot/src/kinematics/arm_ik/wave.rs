//! Functions `constant + cosine cos(x) + sine sin(x)`, in which all conditions of the closed form are written.

use crate::kinematics::trig::sin_cos;
use arrayvec::ArrayVec;
use nalgebra::Matrix3;
use regrasp_geometry::Vector;
use std::f64::consts::{PI, TAU};

/// Smaller parts of a wave are rounding.
const FLAT: f64 = 1e-12;

/// `constant + cosine cos(x) + sine sin(x)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wave {
    pub constant: f64,
    pub cosine: f64,
    pub sine: f64,
}

impl Wave {
    pub fn at(&self, x: f64) -> f64 {
        let (s, c) = sin_cos(x);
        self.constant + self.cosine * c + self.sine * s
    }

    /// Half the distance between the highest and the lowest value.
    pub fn amplitude(&self) -> f64 {
        self.cosine.hypot(self.sine)
    }

    /// Where the wave is highest.
    pub fn crest(&self) -> f64 {
        self.sine.atan2(self.cosine)
    }

    /// Distance on both sides of the crest at which the wave has `value`. None where it has not, by more than rounding of size
    /// `rounding`.
    pub fn half_width(&self, value: f64, rounding: f64) -> Option<f64> {
        let (amplitude, above) = (self.amplitude(), value - self.constant);
        if amplitude < FLAT || above.abs() > amplitude + rounding {
            return None;
        }
        Some((above / amplitude).clamp(-1.0, 1.0).acos())
    }

    /// Angles at which the wave has `value`, in `-pi..pi`, appended to `roots`.
    pub fn roots<const N: usize>(&self, value: f64, roots: &mut ArrayVec<f64, N>) {
        if let Some(half) = self.half_width(value, 0.0) {
            roots.extend([wrapped(self.crest() - half), wrapped(self.crest() + half)]);
        }
    }
}

/// The angle in `-pi..pi` that differs by whole turns.
pub(super) fn wrapped(angle: f64) -> f64 {
    let turned = angle - TAU * ((angle + PI) / TAU).floor();
    if turned >= PI { turned - TAU } else { turned }
}

/// Rotation matrix about a unit vector.
pub(super) fn turn(axis: &Vector, angle: f64) -> Matrix3<f64> {
    let (s, c) = sin_cos(angle);
    let cross = axis.cross_matrix();
    Matrix3::identity() + cross * s + cross * cross * (1.0 - c)
}

/// A rotation with one free angle: `constant + cosine cos(x) + sine sin(x)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct FreeRotation {
    pub constant: Matrix3<f64>,
    pub cosine: Matrix3<f64>,
    pub sine: Matrix3<f64>,
}

impl FreeRotation {
    /// All rotations that turn the direction of `from` to that of `to`; the free angle turns about `to`.
    pub fn between(from: &Vector, to: &Vector) -> Self {
        let (from, to) = (from.normalize(), to.normalize());
        let (cross, dot) = (from.cross(&to), from.dot(&to));
        let reference = if dot < -0.999_999 {
            // Half a turn about any axis across, then the little that is left.
            let across = from.cross(&Vector::ith(from.iamin(), 1.0)).normalize();
            let half = turn(&across, PI);
            let left = (-from).cross(&to).cross_matrix();
            half_left(&left, (-from).dot(&to)) * half
        } else {
            half_left(&cross.cross_matrix(), dot)
        };
        let about = to.cross_matrix();
        let squared = about * about;
        FreeRotation {
            constant: reference + squared * reference,
            cosine: -(squared * reference),
            sine: about * reference,
        }
    }

    pub fn at(&self, x: f64) -> Matrix3<f64> {
        let (s, c) = sin_cos(x);
        self.constant + self.cosine * c + self.sine * s
    }

    /// The free angle at which the rotation comes nearest to `rotation`.
    pub fn angle_of(&self, rotation: &Matrix3<f64>) -> f64 {
        self.sine.dot(rotation).atan2(self.cosine.dot(rotation))
    }

    /// `left . rotation right` over the free angle.
    pub fn wave(&self, left: &Vector, right: &Vector) -> Wave {
        Wave {
            constant: left.dot(&(self.constant * right)),
            cosine: left.dot(&(self.cosine * right)),
            sine: left.dot(&(self.sine * right)),
        }
    }

    /// `(before * rotation)^T * after`, over the same angle.
    pub fn rest_of(&self, before: &Matrix3<f64>, after: &Matrix3<f64>) -> FreeRotation {
        let part = |m: &Matrix3<f64>| (m * before).transpose() * after;
        FreeRotation { constant: part(&self.constant), cosine: part(&self.cosine), sine: part(&self.sine) }
    }
}

/// The smallest rotation with this cross matrix and dot product of two directions.
fn half_left(cross: &Matrix3<f64>, dot: f64) -> Matrix3<f64> {
    Matrix3::identity() + cross + cross * cross / (1.0 + dot)
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn roots_have_the_value_and_no_other_angle_has() {
        let mut rng = Rng::keyed(1, "waves", 0);
        for _ in 0..2000 {
            let wave =
                Wave { constant: rng.uniform(-1.0, 1.0), cosine: rng.uniform(-1.0, 1.0), sine: rng.uniform(-1.0, 1.0) };
            let value = rng.uniform(-2.0, 2.0);
            let mut roots = ArrayVec::<f64, 2>::new();
            wave.roots(value, &mut roots);
            assert!(roots.iter().all(|&x| (wave.at(x) - value).abs() < 1e-14 && (-PI..PI).contains(&x)));
            // By changes of sign over a fine grid.
            let signs: Vec<bool> = (0..=2000).map(|k| wave.at(TAU * f64::from(k) / 2000.0) > value).collect();
            let crossings = signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(crossings == roots.len() || (crossings == 0 && (roots[0] - roots[1]).abs() < 4e-3));
        }
    }

    #[test]
    fn free_rotations_turn_one_direction_to_the_other() {
        let mut rng = Rng::keyed(1, "free rotations", 0);
        for case in 0..2000 {
            let from = Vector::from(rng.direction());
            let to = match case % 4 {
                0 => -from,
                1 => (Vector::from(rng.direction()) * 10f64.powi(-(case % 11)) - from).normalize(),
                _ => Vector::from(rng.direction()),
            };
            let free = FreeRotation::between(&from, &to);
            let angle = rng.uniform(-PI, PI);
            let rotation = free.at(angle);
            assert!((rotation * from - to).norm() < 1e-9, "{}", (rotation * from - to).norm());
            assert!((rotation.transpose() * rotation - Matrix3::identity()).amax() < 1e-9);
            assert!((rotation.determinant() - 1.0).abs() < 1e-9);
            assert!(wrapped(free.angle_of(&rotation) - angle).abs() < 1e-9);
        }
    }
}
