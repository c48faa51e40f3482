//! The margin of force closure: a certified lower bound of the Ferrari-Canny radius.
//!
//! Let `G f` be the wrench of contact forces `f` (torques about the centre of mass, divided by the torque scale), `P`
//! the pseudo-inverse of `G`, `s_i` the Frobenius norm of the rows of `P` of contact `i`. Let `f` be internal
//! (`G f = 0`), with normal forces that sum to one, and each `f_i` at depth at least `t s_i` inside its cone. Then any
//! wrench `w` with `|w| <= t` is resisted by `f - P w`: the wrench is right because `G` has full rank, each force moves
//! by at most `s_i |w| <= t s_i` and stays in its cone, and the normal forces sum to at most `1 + t sum s_i`. Scaled
//! back to one, the ball of radius `t / (1 + t sum s_i)` lies in the convex hull of the contact wrenches: its radius is
//! a lower bound of the one of Ferrari and Canny (ICRA 1992, with forces limited in sum). A grasp is force closed if
//! and only if some `t > 0` exists.
//!
//! The forces of a contact are vectors of its cone's space: one number without friction, three with it, and for a soft
//! finger a fourth, its moment over its torsion radius.

use crate::closure::GraspFrame;
use crate::contact::{Contact, ContactForce, Grip, friction_cone};
use nalgebra::Matrix3;
use regrasp_geometry::Vector;

/// The matrix `[v]` with `[v] x = v cross x`.
#[inline]
pub fn cross_matrix(v: &Vector) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Frobenius norms `s_i` of the blocks of the pseudo-inverse of the grasp map; None when its rank is below six.
///
/// About the contacts' centroid the grasp map's Gram matrix is block diagonal, so that only a 3 by 3 matrix is inverted.
#[inline]
pub fn response_norms<const N: usize>(contacts: &[Contact; N], frame: &GraspFrame) -> Option<[f64; N]> {
    let n = N as f64;
    let centroid = contacts.iter().map(|c| c.point_in_object.coords).sum::<Vector>() / n;
    let scale = 1.0 / frame.torque_scale;
    let arms: [Vector; N] = std::array::from_fn(|i| (contacts[i].point_in_object.coords - centroid) * scale);
    // sum of [r][r]^T = sum of |r|^2 I - r r^T
    let mut spread = Matrix3::zeros();
    for r in &arms {
        spread += Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose();
    }
    if !(spread.determinant() > 1e-12) {
        return None;
    }
    let inverse = spread.try_inverse()?;
    let shift = cross_matrix(&((centroid - frame.center_of_mass.coords) * scale));
    Some(std::array::from_fn(|i| {
        // f_i = w_force / n + [r_i]^T J^-1 (w_torque - [c] w_force)
        let turning = cross_matrix(&arms[i]).tr_mul(&inverse);
        let pushing = Matrix3::from_diagonal_element(1.0 / n) - turning * shift;
        (pushing.norm_squared() + turning.norm_squared()).sqrt()
    }))
}

/// The margin that internal forces `forces` prove, by substitution; zero when they prove nothing. `norms` are those of
/// [`response_norms`].
#[inline]
pub fn margin_of_forces<const N: usize>(
    contacts: &[Contact; N],
    forces: &[Vector; N],
    norms: &[f64; N],
    frame: &GraspFrame,
) -> f64 {
    let mut total = 0.0;
    let mut force_sum = Vector::zeros();
    let mut torque_sum = Vector::zeros();
    for (contact, force) in contacts.iter().zip(forces) {
        total += friction_cone::normal_force(force, &contact.normal_in_object);
        force_sum += force;
        torque_sum += (contact.point_in_object - frame.center_of_mass).cross(force) / frame.torque_scale;
    }
    if !(total > 0.0) {
        return 0.0;
    }
    let residual = (force_sum.norm_squared() + torque_sum.norm_squared()).sqrt() / total;
    let mut t = f64::INFINITY;
    for i in 0..N {
        let depth = friction_cone::depth(&forces[i], &contacts[i].normal_in_object, frame.friction) / total;
        t = t.min(depth / norms[i]);
    }
    // The forces balance but for rounding; what they miss is taken off the ball.
    ball_of_depth(t - residual, norms.iter().sum())
}

/// Radius of the ball that forces at depth `t s_i` prove, `norm_sum` being the sum of the `s_i`; zero when there is none.
#[inline]
pub fn ball_of_depth(t: f64, norm_sum: f64) -> f64 {
    if t > 0.0 { t / (1.0 + t * norm_sum) } else { 0.0 }
}

/// Length of the wrench that is left of `forces`, and the sum of their normal components.
pub fn imbalance(grips: &[Grip], forces: &[ContactForce], frame: &GraspFrame) -> (f64, f64) {
    let (mut force_sum, mut torque_sum, mut total) = (Vector::zeros(), Vector::zeros(), 0.0);
    for (grip, force) in grips.iter().zip(forces) {
        let components = grip.components(force, frame.friction);
        let exerted = grip.force(&components);
        let arm = grip.contact.point_in_object - frame.center_of_mass;
        total += components.normal;
        force_sum += exerted.force;
        torque_sum += arm.cross(&exerted.force) + grip.contact.normal_in_object.into_inner() * exerted.torsion;
    }
    ((force_sum.norm_squared() + (torque_sum / frame.torque_scale).norm_squared()).sqrt(), total)
}
