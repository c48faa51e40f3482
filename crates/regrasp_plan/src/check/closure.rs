//! Force closure with margin, by exact second-order cones and a certificate that is substituted back.
//!
//! Contact `i` with normal `n_i` exerts `f_i` in a round cone about `-n_i` of slope `mu`: a ray without friction, a cone in
//! three dimensions with it, and in four for a soft finger, whose moment about the normal is measured over its torsion
//! radius. `G` maps stacked contact forces to the wrench (force; torque about the centre of mass divided by the torque
//! scale). `P` is a right inverse of `G`, `sigma_i` the Frobenius norm of the rows of `P` that belong to contact `i`. The
//! cone program
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

use crate::plan::Plan;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SupportedConeT};
use nalgebra::{DMatrix, DVector, Matrix6};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::{ContactModel, Grip};
use regrasp_scene::Object;
use std::ops::Range;

/// Grasp maps with a smaller singular value than this count as not closed: two points, or contacts on one line.
const SMALLEST_SINGULAR_VALUE: f64 = 1e-6;

/// What the contacts act on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldBody {
    /// Centre of mass, in the object frame.
    pub center_of_mass: Point,
    /// Length by which torques are divided, in metres.
    pub torque_scale: f64,
    /// Friction coefficient.
    pub friction: f64,
}

impl HeldBody {
    /// The object as the plan may count on it: the promised friction, but no more than the object has.
    pub fn of(object: &Object, plan: &Plan) -> Self {
        HeldBody {
            center_of_mass: object.center_of_mass,
            torque_scale: object.radius,
            friction: plan.promises.friction.min(object.friction),
        }
    }
}

/// Forces that prove a closure, to be tried on contacts nearby.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// The contacts that take part, one bit each.
    subset: u64,
    /// True when soft fingers are taken as points.
    hardened: bool,
    /// Force of each contact that takes part, in the object frame, and its moment about the normal over its torsion radius.
    forces: Vec<(Vector, f64)>,
}

/// Margin of the best subset of `grips`, soft fingers taken as such or as points: zero when no closure could be proved.
///
/// Closure can only grow with contacts and with torsion, so the margin of a subset is one of the whole set.
pub fn margin(grips: &[Grip], body: &HeldBody) -> f64 {
    certified_margin(grips, body).map_or(0.0, |(margin, _)| margin)
}

/// As [`margin`], with what proves it; none when no closure could be proved.
pub fn certified_margin(grips: &[Grip], body: &HeldBody) -> Option<(f64, Certificate)> {
    certified_margin_up_to(f64::INFINITY, None, grips, body)
}

/// As [`certified_margin`], but any margin of at least `enough` will do: the search then ends. It begins with the contacts of `near`,
/// which proves a closure of the same fingers nearby.
pub fn certified_margin_up_to(
    enough: f64,
    near: Option<&Certificate>,
    grips: &[Grip],
    body: &HeldBody,
) -> Option<(f64, Certificate)> {
    let mut search = SubsetSearch { grips, body, best: None };
    if grips.len() > MOST_FOR_ALL_SUBSETS {
        search.descend();
        return search.best;
    }
    let all = 1u64 << grips.len();
    let first = near.map(|certificate| certificate.subset).filter(|subset| *subset < all);
    // More contacts mostly hold with more margin.
    for subset in first.into_iter().chain((0..all).rev().filter(|subset| Some(*subset) != first)) {
        search.look(subset);
        if search.best.as_ref().is_some_and(|(margin, _)| *margin >= enough) {
            break;
        }
    }
    search.best
}

/// With more contacts than this not all subsets are tried: there are 2^n.
const MOST_FOR_ALL_SUBSETS: usize = 6;

/// Looks for the subset of contacts with the largest margin.
struct SubsetSearch<'a> {
    grips: &'a [Grip],
    body: &'a HeldBody,
    best: Option<(f64, Certificate)>,
}

impl SubsetSearch<'_> {
    /// Tries the contacts whose bit is set: soft fingers taken as such, then as points. Returns their margin.
    fn look(&mut self, subset: u64) -> f64 {
        let in_it = (0..self.grips.len()).filter(|i| subset >> i & 1 == 1);
        let n_soft = in_it.filter(|i| torsion_radius(&self.grips[*i]).is_some()).count();
        let mut found = 0.0f64;
        if subset.count_ones() >= 3 || (subset.count_ones() == 2 && n_soft > 0) {
            found = self.solve(subset, false);
        }
        if subset.count_ones() >= 3 && n_soft > 0 {
            found = found.max(self.solve(subset, true));
        }
        found
    }

    fn solve(&mut self, subset: u64, hardened: bool) -> f64 {
        let chosen = chosen(self.grips, subset, hardened);
        let Some((margin, forces)) = solved_margin(&chosen, self.body) else { return 0.0 };
        if margin > self.best.as_ref().map_or(0.0, |(best, _)| *best) {
            let forces = forces_in_object(&chosen, &forces, self.body);
            self.best = Some((margin, Certificate { subset, hardened, forces }));
        }
        margin
    }

    /// From all contacts leaves out one at a time, the one without which the margin is largest. What is not tried can only make
    /// the answer too small: it stays a lower bound.
    fn descend(&mut self) {
        let n_contacts = self.grips.len().min(u64::BITS as usize);
        let mut subset = u64::MAX >> (u64::BITS as usize - n_contacts);
        self.look(subset);
        while subset.count_ones() > 3 {
            let bits = (0..n_contacts).filter(|i| subset >> i & 1 == 1);
            let without: Vec<(f64, u64)> = bits.map(|i| subset & !(1 << i)).map(|one| (self.look(one), one)).collect();
            let Some(&(_, best)) = without.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { return };
            subset = best;
        }
    }
}

/// The margin that forces found for other contacts of the same fingers prove for these; mostly a little smaller than
/// [`margin`], at a hundredth of its cost.
pub fn margin_by(certificate: &Certificate, grips: &[Grip], body: &HeldBody) -> f64 {
    let chosen = chosen(grips, certificate.subset, certificate.hardened);
    if chosen.len() != certificate.forces.len() {
        return 0.0;
    }
    let (grasp_map, cones) = grasp_map(&chosen, body);
    let Some(right_inverse) = right_inverse(&grasp_map) else { return 0.0 };
    let shares = shares_of(&right_inverse, &cones);
    let mut forces = DVector::zeros(grasp_map.ncols());
    for ((cone, grip), (force, torsion)) in cones.iter().zip(&chosen).zip(&certificate.forces) {
        let (x, y) = tangents(&grip.contact.normal_in_object);
        let parts = [-grip.contact.normal_in_object.dot(force), x.dot(force), y.dot(force), *torsion];
        forces.rows_mut(cone.start, cone.len()).copy_from_slice(&parts[..cone.len()]);
    }
    substituted_margin(&grasp_map, &right_inverse, &cones, &shares, forces, body.friction)
}

fn chosen(grips: &[Grip], subset: u64, hardened: bool) -> Vec<Grip> {
    let chosen: Vec<Grip> = (0..grips.len()).filter(|i| subset >> i & 1 == 1).map(|i| grips[i]).collect();
    if hardened { hardened_grips(&chosen) } else { chosen }
}

/// Solver's forces as forces in the object frame and torsions.
fn forces_in_object(grips: &[Grip], forces: &DVector<f64>, body: &HeldBody) -> Vec<(Vector, f64)> {
    let (_, cones) = grasp_map(grips, body);
    let in_object = |(grip, cone): (&Grip, &Range<usize>)| {
        let (x, y) = tangents(&grip.contact.normal_in_object);
        let part = |k: usize| if k < cone.len() { forces[cone.start + k] } else { 0.0 };
        let force = -grip.contact.normal_in_object.into_inner() * part(0) + x.into_inner() * part(1);
        (force + y.into_inner() * part(2), part(3))
    };
    grips.iter().zip(&cones).map(in_object).collect()
}

/// The same contacts without torsion.
fn hardened_grips(grips: &[Grip]) -> Vec<Grip> {
    let hard = |grip: &Grip| match grip.model {
        ContactModel::SoftFinger { .. } => Grip { model: ContactModel::Point, ..*grip },
        ContactModel::Point | ContactModel::Frictionless => *grip,
    };
    grips.iter().map(hard).collect()
}

fn torsion_radius(grip: &Grip) -> Option<f64> {
    match grip.model {
        ContactModel::SoftFinger { torsion_radius } => Some(torsion_radius),
        ContactModel::Point | ContactModel::Frictionless => None,
    }
}

/// Margin in which every one of `grips` takes part, with forces that prove it; none when no closure could be proved.
fn solved_margin(grips: &[Grip], body: &HeldBody) -> Option<(f64, DVector<f64>)> {
    let (grasp_map, cones) = grasp_map(grips, body);
    let right_inverse = right_inverse(&grasp_map)?;
    let shares = shares_of(&right_inverse, &cones);
    let forces = internal_forces(&grasp_map, &cones, &shares, body.friction)?;
    let margin = substituted_margin(&grasp_map, &right_inverse, &cones, &shares, forces.clone(), body.friction);
    (margin > 0.0).then_some((margin, forces))
}

/// `sigma_i` of every contact.
fn shares_of(right_inverse: &DMatrix<f64>, cones: &[Range<usize>]) -> Vec<f64> {
    cones.iter().map(|cone| right_inverse.rows(cone.start, cone.len()).norm()).collect()
}

/// The grasp map and the columns of each contact in it: its pushing direction `-n`; with friction two tangents; for a
/// soft finger the moment of its torsion radius about the normal.
pub fn grasp_map(grips: &[Grip], body: &HeldBody) -> (DMatrix<f64>, Vec<Range<usize>>) {
    let mut columns: Vec<[Vector; 2]> = Vec::new();
    let mut cones = Vec::new();
    for grip in grips {
        let first = columns.len();
        let normal = grip.contact.normal_in_object;
        let (x, y) = tangents(&normal);
        let arm = (grip.contact.point_in_object - body.center_of_mass) / body.torque_scale;
        let mut add = |force: Vector| columns.push([force, arm.cross(&force)]);
        add(-normal.into_inner());
        if body.friction > 0.0 && grip.model != ContactModel::Frictionless {
            add(x.into_inner());
            add(y.into_inner());
            if let Some(radius) = torsion_radius(grip) {
                columns.push([Vector::zeros(), normal.into_inner() * (radius / body.torque_scale)]);
            }
        }
        cones.push(first..columns.len());
    }
    (DMatrix::from_fn(6, columns.len(), |row, column| columns[column][row / 3][row % 3]), cones)
}

/// The pseudo-inverse of a grasp map of full rank: the right inverse of least norm.
pub fn right_inverse(grasp_map: &DMatrix<f64>) -> Option<DMatrix<f64>> {
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

/// Slope of a cone of `width` dimensions, and the factor between the slack of its inequality and the distance.
fn slope_and_scale(width: usize, friction: f64) -> (f64, f64) {
    if width == 1 { (1.0, 1.0) } else { (friction, (1.0 + friction * friction).sqrt()) }
}

/// Forces that solve the cone program of the module's header, as the solver says, unverified.
fn internal_forces(
    grasp_map: &DMatrix<f64>,
    cones: &[Range<usize>],
    shares: &[f64],
    friction: f64,
) -> Option<DVector<f64>> {
    let n_forces = grasp_map.ncols();
    let mut constraints = DMatrix::zeros(7 + n_forces, n_forces + 1);
    constraints.view_mut((0, 0), (6, n_forces)).copy_from(grasp_map);
    let mut kinds = vec![SupportedConeT::ZeroConeT(7)];
    for (cone, share) in cones.iter().zip(shares) {
        let (slope, scale) = slope_and_scale(cone.len(), friction);
        constraints[(6, cone.start)] = 1.0;
        constraints[(7 + cone.start, cone.start)] = -slope;
        constraints[(7 + cone.start, n_forces)] = share * scale;
        for k in cone.clone().skip(1) {
            constraints[(7 + k, k)] = -1.0;
        }
        kinds.push(match cone.len() {
            1 => SupportedConeT::NonnegativeConeT(1),
            width => SupportedConeT::SecondOrderConeT(width),
        });
    }
    let mut right_side = vec![0.0; 7 + n_forces];
    right_side[6] = 1.0;
    let mut cost = vec![0.0; n_forces + 1];
    cost[n_forces] = -1.0;
    let solution = solve(&cost, &constraints, &right_side, &kinds)?;
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
    cones: &[Range<usize>],
    shares: &[f64],
    forces: DVector<f64>,
    friction: f64,
) -> f64 {
    let mut forces = &forces - right_inverse * (grasp_map * &forces);
    let total: f64 = cones.iter().map(|cone| forces[cone.start]).sum();
    if total.is_nan() || total <= 1e-3 {
        return 0.0;
    }
    forces /= total;
    let slack = |cone: &Range<usize>| {
        let (slope, scale) = slope_and_scale(cone.len(), friction);
        (slope * forces[cone.start] - forces.rows(cone.start + 1, cone.len() - 1).norm()) / scale
    };
    let rho = cones.iter().zip(shares).map(|(cone, share)| slack(cone) / share).fold(f64::INFINITY, f64::min);
    let imbalance = (grasp_map * &forces).norm();
    let inverse_error = (grasp_map * right_inverse - DMatrix::identity(6, 6)).norm();
    let rho = rho * (1.0 - inverse_error) - 2.0 * imbalance;
    if rho > 0.0 { rho / (1.0 + rho * shares.iter().sum::<f64>()) } else { 0.0 }
}

/// Upper bound of the Ferrari-Canny radius: the smallest support value of the contact wrenches over directions, drawn
/// at random and then improved by pattern search. Shares nothing with [`margin`]. For tests and reports.
pub fn ferrari_canny_upper(grips: &[Grip], body: &HeldBody, n_directions: usize, rng: &mut regrasp_base::Rng) -> f64 {
    let arms: Vec<Vector> =
        grips.iter().map(|grip| (grip.contact.point_in_object - body.center_of_mass) / body.torque_scale).collect();
    // Largest work of a force of unit normal component along the wrench direction (force part, torque part).
    let support = |direction: &[f64; 6]| {
        let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        let linear = Vector::new(direction[0], direction[1], direction[2]) / norm;
        let angular = Vector::new(direction[3], direction[4], direction[5]) / norm;
        grips
            .iter()
            .zip(&arms)
            .map(|(grip, arm)| {
                let normal = grip.contact.normal_in_object;
                let pull = linear + angular.cross(arm);
                let along = -pull.dot(&normal);
                let across = (pull + along * normal.into_inner()).norm();
                let twist = torsion_radius(grip).unwrap_or(0.0) / body.torque_scale * angular.dot(&normal);
                let slope = if grip.model == ContactModel::Frictionless { 0.0 } else { body.friction };
                along + slope * across.hypot(twist)
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
mod tests;
