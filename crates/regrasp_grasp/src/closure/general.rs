//! Force closure of any number of contacts of any models: exact cones, by the analytic centre of the polar of the hull
//! of contact wrenches.
//!
//! Contact `i` exerts `f_i` in a cone `K_i` that is round about its axis `e_i`, the unit normal force; `G_i` maps `f_i` to
//! its wrench. The polar body `D = { w : e_i + G_i^T w in K_i* for all i }` contains the origin. It is bounded if and
//! only if the grasp is force closed, and every `w` of it proves that no ball larger than `1 / |w|` lies in the hull.
//! The margin's program (see [`crate::margin`]), in which contact `i` keeps the depth `t s_i` by a share
//! `t sigma_i e_i` along its axis, has the dual
//!
//!   1 / t = sum sigma_i + max { c . w : w in D },   c = sum sigma_i G_i e_i.
//!
//! Newton's method minimises `-weight log(sum sigma_i + c . w) - sum log gamma_i(w)`, `gamma_i` being the quadratic form
//! of `K_i*`, in six unknowns from `w = 0` (self-concordant barriers: Nesterov, Nemirovskii 1994, ch. 2.2). Where its
//! decrement is below one, the Newton step gives forces that balance and lie inside their cones; the weight grows until
//! their margin is near the bound of the dual. Both answers are substituted: the forces give the margin, `w` the support
//! in its direction.

use super::{Closure, GraspFrame, Separation, Verdict};
use crate::contact::{Components, ContactForce, ContactModel, Grip};
use crate::margin::{ball_of_depth, imbalance};
use nalgebra::{Matrix6, Vector6};
use regrasp_geometry::Vector;

/// Grasp maps whose Gram matrix has a smaller pivot count as of lower rank.
const SMALLEST_PIVOT: f64 = 1e-12;
/// Radii of the ball below this are not told from zero: rounding.
const SMALLEST_MARGIN: f64 = 1e-8;
/// First and later weight of the margin against the centre, per degree of the barrier.
const WEIGHTS: [f64; 2] = [2.0, 40.0];
/// Newton steps; closed grasps take 5 to 15, open ones about as many doublings as the margin asked for has bits.
const MAX_STEPS: usize = 80;
/// Share of the way to the boundary that a step may take.
const BOUNDARY_SHARE: f64 = 0.95;

/// A contact as the barrier sees it.
struct Part {
    /// Wrench of a unit normal force: `G e`.
    push: Vector6<f64>,
    /// `mu^2 G_t G_t^T - push push^T`, with `G_t` the columns across the axis.
    bowl: Matrix6<f64>,
    /// `G G^T`.
    gram: Matrix6<f64>,
    /// False for a ray.
    has_width: bool,
    /// Depth that a unit along the axis gives.
    depth_of_axis: f64,
    /// Frobenius norm of the contact's rows of the pseudo-inverse of the grasp map.
    norm: f64,
    /// `push - bowl w`: half the gradient of `gamma`.
    slope: Vector6<f64>,
    /// Axial component of `e + G^T w`.
    height: f64,
    /// Quadratic form of the dual cone at `e + G^T w`.
    gamma: f64,
    /// `bowl d` of the present step `d`.
    bowl_of_step: Vector6<f64>,
}

impl Part {
    fn new(grip: &Grip, frame: &GraspFrame) -> Self {
        let normal = grip.contact.normal_in_object.into_inner();
        let arm = (grip.contact.point_in_object - frame.center_of_mass) / frame.torque_scale;
        let push = joined(&-normal, &-arm.cross(&normal));
        let pushing = push * push.transpose();
        let (gram, bowl, depth_of_axis) = match grip.model_at(frame.friction) {
            ContactModel::Frictionless => (pushing, -pushing, 1.0),
            ContactModel::Point | ContactModel::SoftFinger { .. } => {
                let gram = frictional_gram(&arm, &(normal * (grip.torsion_radius() / frame.torque_scale)));
                let squared = frame.friction * frame.friction;
                let depth_of_axis = frame.friction / (1.0 + squared).sqrt();
                (gram, gram * squared - pushing * (1.0 + squared), depth_of_axis)
            }
        };
        Part {
            push,
            bowl,
            gram,
            has_width: grip.model_at(frame.friction) != ContactModel::Frictionless,
            depth_of_axis,
            norm: 0.0,
            slope: push,
            height: 1.0,
            gamma: 1.0,
            bowl_of_step: Vector6::zeros(),
        }
    }

    /// Smallest positive `length` at which `e + G^T (w + length step)` leaves the dual cone; keeps `bowl step`.
    fn reach(&mut self, step: &Vector6<f64>) -> f64 {
        self.bowl_of_step = self.bowl * step;
        let rise = self.push.dot(step);
        let foot = if rise < 0.0 { -self.height / rise } else { f64::INFINITY };
        if !self.has_width {
            return foot;
        }
        let (half_slope, curvature) = self.along(step);
        let discriminant = half_slope * half_slope - curvature * self.gamma;
        if curvature < 0.0 || (half_slope < 0.0 && discriminant >= 0.0) {
            foot.min(self.gamma / (discriminant.max(0.0).sqrt() - half_slope))
        } else {
            foot
        }
    }

    /// Half the slope of `gamma` along `step` and its curvature.
    fn along(&self, step: &Vector6<f64>) -> (f64, f64) {
        (self.slope.dot(step), -self.bowl_of_step.dot(step))
    }

    fn advance(&mut self, step: &Vector6<f64>, length: f64) {
        let (half_slope, curvature) = self.along(step);
        self.height += length * self.push.dot(step);
        self.slope -= self.bowl_of_step * length;
        self.gamma = match self.has_width {
            true => self.gamma + length * (2.0 * half_slope + length * curvature),
            false => self.height * self.height,
        };
    }
}

/// `G G^T` of a force at `arm` and a moment along `torsion`.
fn frictional_gram(arm: &Vector, torsion: &Vector) -> Matrix6<f64> {
    let cross = crate::margin::cross_matrix(arm);
    let mut gram = Matrix6::identity();
    gram.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross.transpose());
    gram.fixed_view_mut::<3, 3>(3, 0).copy_from(&cross);
    gram.fixed_view_mut::<3, 3>(3, 3).copy_from(&(cross * cross.transpose() + torsion * torsion.transpose()));
    gram
}

fn joined(linear: &Vector, angular: &Vector) -> Vector6<f64> {
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Answers as soon as a margin of `enough` is proved, or that there is none; see [`super::prove`].
pub fn prove(grips: &[Grip], frame: &GraspFrame, enough: f64) -> Verdict {
    let mut parts: Vec<Part> = grips.iter().map(|grip| Part::new(grip, frame)).collect();
    let gram: Matrix6<f64> = parts.iter().map(|part| part.gram).sum();
    let inverse = match gram.cholesky() {
        Some(factor) if (0..6).all(|k| factor.l_dirty()[(k, k)].powi(2) > SMALLEST_PIVOT) => factor.inverse(),
        _ => return Verdict::NotProved(separation(grips, frame, &least_direction(&gram))),
    };
    let squared = inverse * inverse;
    let (mut norm_sum, mut share_sum, mut shares) = (0.0, 0.0, Vector6::zeros());
    for part in &mut parts {
        part.norm = squared.dot(&part.gram).sqrt();
        let share = part.norm / part.depth_of_axis;
        norm_sum += part.norm;
        share_sum += share;
        shares += part.push * share;
    }
    let search = Search { grips, frame, shares, share_sum, norm_sum, enough: enough.max(SMALLEST_MARGIN) };
    search.run(&mut parts)
}

/// A step and the square of its length in the barrier's own metric.
struct Newton {
    step: Vector6<f64>,
    decrement: f64,
}

/// What stays the same during the search.
struct Search<'a> {
    grips: &'a [Grip],
    frame: &'a GraspFrame,
    /// `c` of the module's header.
    shares: Vector6<f64>,
    /// Sum of `sigma_i`.
    share_sum: f64,
    /// Sum of `s_i`.
    norm_sum: f64,
    enough: f64,
}

impl Search<'_> {
    fn run(&self, parts: &mut [Part]) -> Verdict {
        let degree = 2.0 * parts.len() as f64;
        // A search for the largest margin has no margin to fall short of.
        let least_radius = if self.enough.is_finite() { self.enough } else { SMALLEST_MARGIN };
        let mut w = Vector6::zeros();
        let mut best: Option<Closure> = None;
        let mut stage = 0;
        let mut weight = WEIGHTS[0] * degree;
        for _ in 0..MAX_STEPS {
            let reward = self.share_sum + self.shares.dot(&w);
            let Some(mut newton) = self.newton(parts, reward, weight) else { break };
            if newton.decrement < 0.9 {
                let along_axes = weight / reward * (1.0 - self.shares.dot(&newton.step) / reward);
                let forces = forces_of(self.grips, parts, self.frame, &w, &newton.step, along_axes);
                let margin = self.margin_of(parts, &forces);
                if margin > best.as_ref().map_or(0.0, |closure| closure.margin) {
                    best = Some(Closure { margin, contacts: (0..self.grips.len()).collect(), forces });
                }
                let found = best.as_ref().map_or(0.0, |closure| closure.margin);
                let limit = 1.0 / (reward + self.norm_sum);
                if found >= self.enough || stage + 1 == WEIGHTS.len() || limit < least_radius {
                    break;
                }
                stage += 1;
                weight = WEIGHTS[stage] * degree;
                let Some(heavier) = self.newton(parts, reward, weight) else { break };
                newton = heavier;
            }
            let Newton { step, decrement } = newton;
            let rate = self.shares.dot(&step) / reward;
            let length = step_length(parts, &step, weight, rate, decrement);
            if !length.is_finite() {
                // The polar body has no end this way.
                w = step;
                break;
            }
            w += step * length;
            parts.iter_mut().for_each(|part| part.advance(&step, length));
            if w.norm() * least_radius > 1.0 {
                break;
            }
        }
        match best {
            Some(closure) => Verdict::Closed(closure),
            None => Verdict::NotProved(separation(self.grips, self.frame, &-w)),
        }
    }

    /// The step to the minimum of the barrier's quadratic model. None when rounding has spoilt the model.
    fn newton(&self, parts: &[Part], reward: f64, weight: f64) -> Option<Newton> {
        let mut gradient = self.shares * (-weight / reward);
        let mut hessian = Matrix6::zeros();
        hessian.ger(weight / (reward * reward), &self.shares, &self.shares, 1.0);
        for part in parts {
            let inverse = 2.0 / part.gamma;
            gradient -= part.slope * inverse;
            hessian += part.bowl * inverse;
            hessian.ger(inverse * inverse, &part.slope, &part.slope, 1.0);
        }
        let step = -hessian.cholesky()?.solve(&gradient);
        Some(Newton { step, decrement: -gradient.dot(&step) })
    }

    /// The margin that `forces` prove.
    fn margin_of(&self, parts: &[Part], forces: &[ContactForce]) -> f64 {
        let friction = self.frame.friction;
        let (residual, total) = imbalance(self.grips, forces, self.frame);
        if !(total > 0.0) {
            return 0.0;
        }
        let depth =
            self.grips.iter().zip(parts).zip(forces).map(|((grip, part), force)| {
                grip.depth(&grip.components(force, friction), friction) / (total * part.norm)
            });
        ball_of_depth(depth.fold(f64::INFINITY, f64::min) - residual / total, self.norm_sum)
    }
}

/// How far to go along `step`, infinite where nothing ends it. The reward grows by `rate` of itself over the step.
///
/// A full step near the centre; else one that about minimises the barrier along the step.
fn step_length(parts: &mut [Part], step: &Vector6<f64>, weight: f64, rate: f64, decrement: f64) -> f64 {
    let reach = parts.iter_mut().map(|part| part.reach(step)).fold(f64::INFINITY, f64::min);
    if reach.is_infinite() {
        return reach;
    }
    let most = BOUNDARY_SHARE * reach;
    if decrement < 0.25 {
        return most.min(1.0);
    }
    let mut length = (1.0 / (1.0 + decrement.sqrt())).min(most);
    if decrement < 9.0 {
        // The least along the line may lie opposite, at the same height: only the damped step is sure to descend.
        return length;
    }
    for _ in 0..3 {
        let relative = rate / (1.0 + length * rate);
        let (mut slope, mut curvature) = (-weight * relative, weight * relative * relative);
        for part in parts.iter() {
            let (p, q) = part.along(step);
            let gamma = part.gamma + length * (2.0 * p + length * q);
            let rate = 2.0 * (p + length * q) / gamma;
            slope -= rate;
            curvature += rate * rate - 2.0 * q / gamma;
        }
        if !(curvature > 0.0) {
            break;
        }
        let next = length - slope / curvature;
        length = if next < most { next.max(0.1 * length) } else { 0.5 * (length + most) };
    }
    length
}

/// Forces of the Newton step: they balance but for rounding, and lie inside their cones when the decrement is below one.
fn forces_of(
    grips: &[Grip],
    parts: &[Part],
    frame: &GraspFrame,
    w: &Vector6<f64>,
    step: &Vector6<f64>,
    along_axes: f64,
) -> Vec<ContactForce> {
    let squared = frame.friction * frame.friction;
    grips
        .iter()
        .zip(parts)
        .map(|(grip, part)| {
            let keep = 1.0 - 2.0 * part.slope.dot(step) / part.gamma;
            let at = w * keep + step;
            let weight = 2.0 / part.gamma;
            let arm = (grip.contact.point_in_object - frame.center_of_mass) / frame.torque_scale;
            let (linear, angular): (Vector, Vector) = (at.fixed_rows::<3>(0).into(), at.fixed_rows::<3>(3).into());
            let normal = grip.contact.normal_in_object.into_inner();
            let pull = linear + angular.cross(&arm);
            let across = pull - normal * pull.dot(&normal);
            let torsion = angular.dot(&normal) * grip.torsion_radius() / frame.torque_scale;
            let frictional = grip.model_at(frame.friction) != ContactModel::Frictionless;
            let sideways = if frictional { -weight * squared } else { 0.0 };
            grip.force(&Components {
                normal: weight * (keep + part.push.dot(&at)) + along_axes * part.norm / part.depth_of_axis,
                tangential: across * sideways,
                torsion: torsion * sideways,
            })
        })
        .collect()
}

/// The direction of `wrench` with the largest work that contacts do along it.
fn separation(grips: &[Grip], frame: &GraspFrame, wrench: &Vector6<f64>) -> Separation {
    let direction = wrench / wrench.norm().max(f64::MIN_POSITIVE);
    let (linear, angular): (Vector, Vector) =
        (direction.fixed_rows::<3>(0).into(), direction.fixed_rows::<3>(3).into());
    let support = grips
        .iter()
        .map(|grip| {
            let arm = (grip.contact.point_in_object - frame.center_of_mass) / frame.torque_scale;
            let twist = angular.dot(&grip.contact.normal_in_object) / frame.torque_scale;
            grip.support(&(linear + angular.cross(&arm)), twist, frame.friction)
        })
        .fold(f64::NEG_INFINITY, f64::max);
    Separation { direction: direction.into(), support }
}

/// The eigenvector of the smallest eigenvalue.
fn least_direction(gram: &Matrix6<f64>) -> Vector6<f64> {
    let eigen = gram.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    eigen.eigenvectors.column(least).into_owned()
}
