//! Force closure with margin, by exact second-order cones and a certificate that is substituted back.
//!
//! Contact `i` with normal `n_i` can push with a force in the round cone about `-n_i` of slope `mu`. `G` maps stacked
//! contact forces to the wrench (force; torque about the centre of mass divided by the torque scale). `P` is a right
//! inverse of `G`, `sigma_i` the Frobenius norm of the three rows of `P` that belong to contact `i`. The cone program
//!
//!   rho = max t   with   G f = 0,   sum_i normal(f_i) = 1,   distance of f_i to its cone's boundary >= t sigma_i
//!
//! gives the margin `rho / (1 + rho sum_i sigma_i)`. It is a lower bound of the Ferrari-Canny radius (Ferrari, Canny
//! 1992, with the sum of normal forces bounded by one). Proof: let `w` be a wrench with `|w| <= rho` and
//! `f' = f + P w`. Then `G f' = w`; contact `i` changes by at most `sigma_i |w| <= rho sigma_i`, so it stays in its cone;
//! the normal forces sum to at most `1 + rho sum sigma_i`. Divide by that sum.
//!
//! The solver's status is never looked at. Its `f` is projected onto `G f = 0`, scaled to the sum of one, and the slacks
//! are evaluated anew, with the residuals of `G f` and of `G P - I` taken off. What a useless answer gives is no margin.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SupportedConeT};
use nalgebra::{DMatrix, DVector, Matrix6};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::Contact;

/// Grasp maps with a smaller singular value than this count as not closed: two contacts, or contacts on one line.
const SMALLEST_SINGULAR_VALUE: f64 = 1e-6;

/// What the contacts act on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Centre of mass, in the object frame.
    pub center_of_mass: Point,
    /// Length by which torques are divided, in metres.
    pub torque_scale: f64,
    /// Friction coefficient.
    pub friction: f64,
}

/// Margin of the best subset of at least three of `contacts`: zero when no closure could be proved.
///
/// Closure can only grow with contacts, so the margin of a subset is one of the whole set.
pub fn margin(contacts: &[Contact], body: &Body) -> f64 {
    let n_contacts = contacts.len();
    assert!(n_contacts <= 16, "the subsets of {n_contacts} contacts are too many");
    let mut best: f64 = 0.0;
    for subset in 0u32..1 << n_contacts {
        if subset.count_ones() >= 3 {
            let chosen: Vec<Contact> = (0..n_contacts).filter(|i| subset >> i & 1 == 1).map(|i| contacts[i]).collect();
            best = best.max(margin_of_all(&chosen, body));
        }
    }
    best
}

/// Margin in which every one of `contacts` takes part; zero when no closure could be proved.
pub fn margin_of_all(contacts: &[Contact], body: &Body) -> f64 {
    let grasp_map = grasp_map(contacts, body);
    let Some(right_inverse) = right_inverse(&grasp_map) else { return 0.0 };
    let shares: Vec<f64> = (0..contacts.len()).map(|i| right_inverse.view((3 * i, 0), (3, 6)).norm()).collect();
    let Some(forces) = internal_forces(&grasp_map, &shares, body.friction) else { return 0.0 };
    substituted_margin(&grasp_map, &right_inverse, &shares, forces, body.friction)
}

/// The 6 x 3k grasp map; the columns of a contact are its pushing direction `-n` and two tangents.
fn grasp_map(contacts: &[Contact], body: &Body) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(6, 3 * contacts.len());
    for (i, contact) in contacts.iter().enumerate() {
        let (x, y) = tangents(&contact.normal_in_object);
        let arm = (contact.point_in_object - body.center_of_mass) / body.torque_scale;
        for (j, direction) in
            [-contact.normal_in_object.into_inner(), x.into_inner(), y.into_inner()].iter().enumerate()
        {
            map.view_mut((0, 3 * i + j), (3, 1)).copy_from(direction);
            map.view_mut((3, 3 * i + j), (3, 1)).copy_from(&arm.cross(direction));
        }
    }
    map
}

/// The pseudo-inverse of a grasp map of full rank.
fn right_inverse(grasp_map: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let gram = Matrix6::from_iterator((grasp_map * grasp_map.transpose()).iter().copied());
    let eigen = gram.symmetric_eigen();
    let floor = SMALLEST_SINGULAR_VALUE * SMALLEST_SINGULAR_VALUE;
    if !eigen.eigenvalues.iter().all(|&value| value > floor) {
        return None;
    }
    let inverse = eigen.eigenvectors
        * Matrix6::from_diagonal(&eigen.eigenvalues.map(f64::recip))
        * eigen.eigenvectors.transpose();
    Some(grasp_map.transpose() * DMatrix::from_column_slice(6, 6, inverse.as_slice()))
}

/// Forces that solve the cone program of the module's header, as the solver says, unverified.
fn internal_forces(grasp_map: &DMatrix<f64>, shares: &[f64], friction: f64) -> Option<DVector<f64>> {
    let n_contacts = shares.len();
    let n_forces = 3 * n_contacts;
    let mut constraints = DMatrix::zeros(7 + n_forces, n_forces + 1);
    constraints.view_mut((0, 0), (6, n_forces)).copy_from(grasp_map);
    for i in 0..n_contacts {
        let row = 7 + 3 * i;
        constraints[(6, 3 * i)] = 1.0;
        constraints[(row, 3 * i)] = -friction;
        constraints[(row, n_forces)] = shares[i] * (1.0 + friction * friction).sqrt();
        constraints[(row + 1, 3 * i + 1)] = -1.0;
        constraints[(row + 2, 3 * i + 2)] = -1.0;
    }
    let mut right_side = vec![0.0; 7 + n_forces];
    right_side[6] = 1.0;
    let mut cost = vec![0.0; n_forces + 1];
    cost[n_forces] = -1.0;
    let mut cones = vec![SupportedConeT::ZeroConeT(7)];
    cones.extend((0..n_contacts).map(|_| SupportedConeT::SecondOrderConeT(3)));
    let solution = solve(&cost, &constraints, &right_side, &cones)?;
    Some(DVector::from_column_slice(&solution[..n_forces]))
}

/// Runs the solver on `min cost x, constraints x + s = right_side, s in cones`; None when it gives no finite numbers.
fn solve(
    cost: &[f64],
    constraints: &DMatrix<f64>,
    right_side: &[f64],
    cones: &[SupportedConeT<f64>],
) -> Option<Vec<f64>> {
    let n_variables = cost.len();
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-11,
        tol_gap_rel: 1e-11,
        tol_feas: 1e-11,
        max_threads: 1,
        ..DefaultSettings::default()
    };
    let quadratic = CscMatrix::zeros((n_variables, n_variables));
    let mut solver = DefaultSolver::new(&quadratic, cost, &sparse(constraints), right_side, cones, settings).ok()?;
    solver.solve();
    let solution = solver.solution.x;
    (solution.len() == n_variables && solution.iter().all(|x| x.is_finite())).then_some(solution)
}

fn sparse(dense: &DMatrix<f64>) -> CscMatrix<f64> {
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    for column in dense.column_iter() {
        for (row, &value) in column.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            rows.push(row);
            values.push(value);
        }
        starts.push(rows.len());
    }
    CscMatrix::new(dense.nrows(), dense.ncols(), starts, rows, values)
}

/// The margin that `forces` prove, whatever they come from.
fn substituted_margin(
    grasp_map: &DMatrix<f64>,
    right_inverse: &DMatrix<f64>,
    shares: &[f64],
    forces: DVector<f64>,
    friction: f64,
) -> f64 {
    let mut forces = &forces - right_inverse * (grasp_map * &forces);
    let total: f64 = (0..shares.len()).map(|i| forces[3 * i]).sum();
    if total.is_nan() || total <= 1e-3 {
        return 0.0;
    }
    forces /= total;
    let cone_scale = (1.0 + friction * friction).sqrt();
    let slack = |i: usize| (friction * forces[3 * i] - forces[3 * i + 1].hypot(forces[3 * i + 2])) / cone_scale;
    let rho = (0..shares.len()).map(|i| slack(i) / shares[i]).fold(f64::INFINITY, f64::min);
    let imbalance = (grasp_map * &forces).norm();
    let inverse_error = (grasp_map * right_inverse - DMatrix::identity(6, 6)).norm();
    let rho = rho * (1.0 - inverse_error) - 2.0 * imbalance;
    if rho > 0.0 { rho / (1.0 + rho * shares.iter().sum::<f64>()) } else { 0.0 }
}

/// Upper bound of the Ferrari-Canny radius: the smallest support value of the contact wrenches over directions, drawn
/// at random and then improved by pattern search. Shares nothing with [`margin`]. For tests and reports.
pub fn ferrari_canny_upper(contacts: &[Contact], body: &Body, n_directions: usize, rng: &mut regrasp_base::Rng) -> f64 {
    let arms: Vec<Vector> =
        contacts.iter().map(|c| (c.point_in_object - body.center_of_mass) / body.torque_scale).collect();
    // Largest work of a force of unit normal component along the wrench direction (force part, torque part).
    let support = |direction: &[f64; 6]| {
        let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        let linear = Vector::new(direction[0], direction[1], direction[2]) / norm;
        let angular = Vector::new(direction[3], direction[4], direction[5]) / norm;
        contacts
            .iter()
            .zip(&arms)
            .map(|(contact, arm)| {
                let pull = linear + angular.cross(arm);
                let along = -pull.dot(&contact.normal_in_object);
                along + body.friction * (pull + along * contact.normal_in_object.into_inner()).norm()
            })
            .fold(0.0, f64::max)
    };
    let mut best = (f64::INFINITY, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for _ in 0..n_directions {
        let direction = std::array::from_fn(|_| rng.normal());
        let value = support(&direction);
        if value < best.0 {
            let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            best = (value, direction.map(|x| x / norm));
        }
    }
    let mut step = 0.3;
    while step > 1e-6 {
        let mut improved = false;
        for _ in 0..40 {
            let mut direction = best.1;
            direction.iter_mut().for_each(|x| *x += step * rng.normal());
            let value = support(&direction);
            if value < best.0 {
                best = (value, direction);
                improved = true;
            }
        }
        if !improved {
            step *= 0.5;
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_geometry::UnitVector;

    fn sphere_contact(direction: [f64; 3], radius: f64) -> Contact {
        let normal = UnitVector::new_normalize(Vector::from(direction));
        Contact { point_in_object: Point::from(normal.into_inner() * radius), normal_in_object: normal }
    }

    fn body(friction: f64) -> Body {
        Body { center_of_mass: Point::origin(), torque_scale: 0.03, friction }
    }

    fn random_contacts(n_contacts: usize, rng: &mut Rng) -> Vec<Contact> {
        (0..n_contacts).map(|_| sphere_contact(rng.direction(), 0.03)).collect()
    }

    /// Smallest sum of normal forces with which `contacts` resist `wrench`, by another cone program.
    fn effort_against(contacts: &[Contact], body: &Body, wrench: &[f64; 6]) -> Option<f64> {
        let map = grasp_map(contacts, body);
        let n_forces = 3 * contacts.len();
        let mut constraints = DMatrix::zeros(6 + n_forces, n_forces);
        constraints.view_mut((0, 0), (6, n_forces)).copy_from(&map);
        let mut cost = vec![0.0; n_forces];
        let mut cones = vec![SupportedConeT::ZeroConeT(6)];
        for i in 0..contacts.len() {
            cost[3 * i] = 1.0;
            constraints[(6 + 3 * i, 3 * i)] = -body.friction;
            constraints[(7 + 3 * i, 3 * i + 1)] = -1.0;
            constraints[(8 + 3 * i, 3 * i + 2)] = -1.0;
            cones.push(SupportedConeT::SecondOrderConeT(3));
        }
        let mut right_side = vec![0.0; 6 + n_forces];
        right_side[..6].copy_from_slice(wrench);
        let forces = DVector::from_vec(solve(&cost, &constraints, &right_side, &cones)?);
        let error = (&map * &forces - DVector::from_column_slice(wrench)).norm();
        (error < 1e-6).then(|| (0..contacts.len()).map(|i| forces[3 * i]).sum())
    }

    #[test]
    fn every_wrench_within_the_margin_is_resisted_with_unit_effort() {
        let mut rng = Rng::keyed(1, "closure", 0);
        let mut closed = 0;
        for trial in 0..60 {
            let contacts = random_contacts(3 + trial % 3, &mut rng);
            let margin = margin(&contacts, &body(0.8));
            if margin == 0.0 {
                continue;
            }
            closed += 1;
            for _ in 0..40 {
                let direction: [f64; 6] = std::array::from_fn(|_| rng.normal());
                let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
                let effort = effort_against(&contacts, &body(0.8), &direction.map(|x| x * margin / norm)).unwrap();
                assert!(effort <= 1.0 + 1e-6, "effort {effort} at margin {margin}");
            }
        }
        assert!(closed > 15, "{closed}");
    }

    #[test]
    fn the_margin_is_below_the_upper_bound_and_both_vanish_together() {
        let mut rng = Rng::keyed(2, "closure", 0);
        let (mut closed, mut open) = (0, 0);
        let mut smallest_ratio = f64::INFINITY;
        for trial in 0..300 {
            let contacts = random_contacts(3 + trial % 2, &mut rng);
            let lower = margin(&contacts, &body(0.5));
            let upper = ferrari_canny_upper(&contacts, &body(0.5), 2000, &mut rng);
            assert!(lower <= upper + 1e-9, "{lower} > {upper}");
            if lower > 0.0 {
                closed += 1;
                smallest_ratio = smallest_ratio.min(lower / upper);
            } else {
                open += 1;
                // Not proved closed, so a direction that (almost) no contact can push along must exist.
                assert!(upper < 1e-3, "trial {trial}: not closed, but every direction has support {upper}");
            }
        }
        assert!(closed > 40 && open > 40, "{closed} closed, {open} open");
        assert!(smallest_ratio > 0.05, "{smallest_ratio}");
    }

    #[test]
    fn three_contacts_on_an_equator_close_and_two_or_a_half_sphere_do_not() {
        let third = std::f64::consts::TAU / 3.0;
        let equator: Vec<Contact> =
            (0..3).map(|i| sphere_contact([(third * i as f64).cos(), (third * i as f64).sin(), 0.0], 0.03)).collect();
        assert!(margin(&equator, &body(0.8)) > 0.05);
        assert_eq!(margin(&equator[..2], &body(0.8)), 0.0);
        assert_eq!(margin(&equator, &body(0.0)), 0.0);
        let half: Vec<Contact> =
            [[1.0, 0.0, 0.5], [-1.0, 0.3, 0.6], [0.0, 1.0, 0.7]].map(|d| sphere_contact(d, 0.03)).to_vec();
        assert_eq!(margin(&half, &body(0.2)), 0.0);
    }

    #[test]
    fn the_margin_does_not_depend_on_the_frame_or_the_unit_of_length() {
        let mut rng = Rng::keyed(3, "closure", 0);
        let mut compared = 0;
        for _ in 0..60 {
            let contacts = random_contacts(4, &mut rng);
            let before = margin(&contacts, &body(0.7));
            let motion = regrasp_geometry::pose_from([0.0; 3], rng.quat_xyzw());
            let moved: Vec<Contact> = contacts
                .iter()
                .map(|c| Contact {
                    point_in_object: Point::from((motion * c.point_in_object).coords * 10.0),
                    normal_in_object: UnitVector::new_normalize(motion * c.normal_in_object.into_inner()),
                })
                .collect();
            let scaled = Body { torque_scale: 0.3, ..body(0.7) };
            let after = margin(&moved, &scaled);
            assert!((before - after).abs() < 1e-7, "{before} {after}");
            compared += usize::from(before > 0.0);
        }
        assert!(compared > 20, "{compared}");
    }
}
