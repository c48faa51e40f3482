//! Motions of the tip of fingers that cannot go in every direction: those of one or two independent joints, and those of which all joints
//! turn about parallel axes.

use super::{Coordinates, MAX_COORDINATES};
use crate::kinematics::chain::Chain;
use arrayvec::ArrayVec;
use nalgebra::Matrix3;
use regrasp_geometry::{Point, Vector};

/// Postures at which the directions of the tip are counted.
const POSTURES: usize = 24;
/// The third direction counts from this share of the first on.
const LEAST_DIRECTION: f64 = 1e-4;
/// Directions in which the tip moves less than this share of what it does along the first are none: near a singularity joints would have to
/// move far for them.
const NO_DIRECTION: f64 = 0.03;

/// See `FingerIk::reaches_points`.
pub(super) fn reaches_points(chain: &Chain, center_in_body: &Point) -> bool {
    let n = chain.n_coordinates();
    if n < 3 {
        return false;
    }
    let mut poses = Vec::new();
    (1..=POSTURES).any(|index| {
        let at = |k: usize| {
            let (lower, upper) = (chain.lower[k].max(-3.0), chain.upper[k].min(3.0));
            lower + (upper - lower) * super::reach_map::halton(index, k)
        };
        let posture: Vec<f64> = (0..n).map(at).collect();
        chain.forward(&posture, &mut poses);
        let jacobian = chain.jacobian(&poses, &chain.tip(&posture, center_in_body));
        let square = &jacobian * jacobian.transpose();
        let square = Matrix3::from_fn(|row, column| square[(row, column)]);
        let values = square.symmetric_eigenvalues();
        values.min() > LEAST_DIRECTION * LEAST_DIRECTION * values.max()
    })
}

/// See `FingerIk::push`: the least change of the coordinates that moves the tip as nearly along `direction` as can be, scaled so that it
/// moves by `length` along it.
pub(super) fn step(
    columns: &ArrayVec<Vector, MAX_COORDINATES>,
    coordinates: &[f64],
    direction: &Vector,
    (length, largest_slope): (f64, f64),
) -> Option<Coordinates> {
    let square: Matrix3<f64> = columns.iter().map(|column| column * column.transpose()).sum();
    let eigen = square.symmetric_eigen();
    let most = eigen.eigenvalues.max();
    if !(most > 0.0) {
        return None;
    }
    let mut pull = Vector::zeros();
    for k in 0..3 {
        if eigen.eigenvalues[k] > NO_DIRECTION * NO_DIRECTION * most {
            let axis: Vector = eigen.eigenvectors.column(k).into();
            pull += axis * (axis.dot(direction) / eigen.eigenvalues[k]);
        }
    }
    let moved = square * pull;
    let along = moved.dot(direction);
    let beside = (moved - direction * along).norm();
    if !(along > 0.0) || beside > largest_slope * along {
        return None;
    }
    Some(columns.iter().zip(coordinates).map(|(column, q)| q + column.dot(&pull) * length / along).collect())
}

#[cfg(test)]
mod tests {
    use super::super::FingerIk;
    use super::*;
    use crate::kinematics::samples::{random_coordinates, random_turning};
    use regrasp_base::Rng;

    /// Chains of fewer than three joints, and flat ones of any number, do not; chains of three joints about any axes do.
    #[test]
    fn fingers_that_reach_points_have_three_directions() {
        let mut rng = Rng::keyed(7, "directions", 0);
        for n in 1..=5 {
            for _ in 0..20 {
                let (chain, center) = random_turning(n, 2.5, &mut rng);
                assert_eq!(FingerIk::new(&chain, &center).reaches_points(), n >= 3, "{n} joints");
                // The same chain with all axes along z: the tip stays in a plane.
                let mut joints = chain.joints.clone();
                for joint in &mut joints {
                    joint.parent_from_joint.rotation = nalgebra::UnitQuaternion::identity();
                    joint.axis = Vector::z_axis();
                }
                let flat = Chain::new(joints, chain.names.clone(), chain.lower.clone(), chain.upper.clone());
                assert!(!FingerIk::new(&flat, &center).reaches_points(), "{n} parallel joints");
            }
        }
    }

    /// Against differences: the tip moves along the direction by the length, and beside it less than any other change of the joints
    /// that moves it as far along would.
    #[test]
    fn a_push_moves_the_tip_along_and_little_beside() {
        let mut rng = Rng::keyed(8, "push", 0);
        let (mut n_pushed, length) = (0, 1e-6);
        for _ in 0..200 {
            let (chain, center) = random_turning(2, 2.5, &mut rng);
            let ik = FingerIk::new(&chain, &center);
            let q = random_coordinates(&chain, &mut rng);
            let direction = Vector::from(rng.direction());
            let columns = ik.tip_jacobian(&q);
            if columns[0].cross(&columns[1]).norm() < 0.1 * (columns[0].norm_squared() + columns[1].norm_squared()) {
                continue;
            }
            let Some(there) = ik.push(&q, &direction, length, (0.0, 2.0)) else { continue };
            let moved = |to: &[f64]| ik.tip(to) - ik.tip(&q);
            let slope = |way: &Vector| {
                let along = way.dot(&direction);
                (way - direction * along).norm() / along
            };
            let way = moved(&there);
            assert!((way.dot(&direction) - length).abs() < 1e-3 * length, "{way:?}");
            assert!(slope(&way) < 2.0 + 1e-3);
            for _ in 0..50 {
                let other: Vec<f64> = q.iter().map(|q| q + 1e-6 * rng.uniform(-1.0, 1.0)).collect();
                let other = moved(&other);
                assert!(other.dot(&direction) <= 0.0 || slope(&other) > slope(&way) - 1e-3);
            }
            n_pushed += 1;
        }
        assert!(n_pushed > 50, "{n_pushed}");
    }
}
