//! The terms of a grasp's score (Saut 2010, sec. IV-A.3), and their weighted mean.
//!
//! The paper gives the terms and their weights, but neither sign nor scale. Here every term is from 0 to 1, and larger is better:
//!
//! - **closure**: the margin over `GOOD_MARGIN`, at most 1;
//! - **centroid**: 1 less the distance of the contacts' centroid from the centre of mass over the torque scale, at least 0;
//! - **force axis**: the mean over the contacts of 1 less the angle between normal and major axis of the finger's force
//!   ellipsoid over a right angle. The major axis is the direction in which unit joint torques push hardest: the
//!   eigenvector of `J J^T` with the least eigenvalue, `J` being the Jacobian of the tip's centre;
//! - **flatness**: the mean over the contacts of the inverse curvature, normalised over the surface: 1 at the flattest sampled point and 0
//!   at the sharpest. The curvature is the larger principal curvature by size, times the fingertip's radius, plus 1.

use crate::contact::Contact;
use nalgebra::Matrix3;
use regrasp_geometry::{Point, Vector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A margin that counts in full. By measurement: good grasps of three or four fingertips with friction 0.5 have about as much.
pub const GOOD_MARGIN: f64 = 0.2;

/// The terms of a grasp's score, each from 0 to 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scores {
    /// How well the contacts close the object.
    pub closure: f64,
    /// How near the contacts' centroid is to the centre of mass.
    pub centroid: f64,
    /// How well the fingers push along their normals.
    pub force_axis: f64,
    /// How flat the surface is at the contacts.
    pub flatness: f64,
}

/// Weights of the terms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScoreWeights {
    /// Of closure. Saut 2010, sec. IV-A.3: 1.
    pub closure: f64,
    /// Of the centroid. Saut 2010, sec. IV-A.3: 1.
    pub centroid: f64,
    /// Of the force axes. Saut 2010, sec. IV-A.3: 1.
    pub force_axis: f64,
    /// Of the inverse curvature. Saut 2010, sec. IV-A.3: 6.
    pub flatness: f64,
}

impl Default for ScoreWeights {
    fn default() -> Self {
        ScoreWeights { closure: 1.0, centroid: 1.0, force_axis: 1.0, flatness: 6.0 }
    }
}

impl ScoreWeights {
    /// The weights in the order of [`Scores::numbers`].
    pub fn numbers(&self) -> [f64; 4] {
        [self.closure, self.centroid, self.force_axis, self.flatness]
    }

    /// What is wrong with them, if anything.
    pub fn validate(&self) -> Result<(), String> {
        let bad = self.numbers().into_iter().find(|weight| !(*weight >= 0.0 && *weight <= 1e6));
        match bad {
            Some(weight) => Err(format!("a weight of the score is {weight}; it must be between 0 and 1000000")),
            None if self.numbers().iter().sum::<f64>() > 0.0 => Ok(()),
            None => Err("all weights of the score are 0; one of them must be above 0".into()),
        }
    }
}

impl Scores {
    /// Every term.
    pub fn numbers(&self) -> [f64; 4] {
        [self.closure, self.centroid, self.force_axis, self.flatness]
    }

    /// The weighted mean, from 0 to 1.
    pub fn mean(&self, weights: &ScoreWeights) -> f64 {
        let weights = weights.numbers();
        let sum: f64 = self.numbers().iter().zip(weights).map(|(term, weight)| term * weight).sum();
        sum / weights.iter().sum::<f64>()
    }
}

/// The closure term of a margin.
pub fn closure_term(margin: f64) -> f64 {
    (margin / GOOD_MARGIN).clamp(0.0, 1.0)
}

/// The centroid term of contacts on an object.
pub fn centroid_term(contacts: &[Contact], center_of_mass: &Point, torque_scale: f64) -> f64 {
    let sum: Vector = contacts.iter().map(|contact| contact.point_in_object - center_of_mass).sum();
    (1.0 - sum.norm() / contacts.len().max(1) as f64 / torque_scale).max(0.0)
}

/// The share of one contact in the force axis term: `normal` and the columns of the Jacobian of the tip's centre are in one
/// frame. A finger that cannot move has no axis: 0.
pub fn force_axis_term(normal: &Vector, jacobian: impl IntoIterator<Item = Vector>) -> f64 {
    let square = jacobian.into_iter().fold(Matrix3::zeros(), |sum, column| sum + column * column.transpose());
    if !(square.trace() > 0.0) {
        return 0.0;
    }
    let eigen = square.symmetric_eigen();
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let cosine = (axis.dot(normal).abs() / (axis.norm() * normal.norm())).min(1.0);
    1.0 - cosine.acos() / std::f64::consts::FRAC_PI_2
}

/// Inverse curvature of a place of a surface with these principal curvatures, seen by a fingertip of this radius: 1 where it is flat.
pub fn inverse_curvature(principal: [f64; 2], tip_radius: f64) -> f64 {
    1.0 / (1.0 + principal[0].abs().max(principal[1].abs()) * tip_radius)
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_geometry::UnitVector;

    fn contact(x: f64, y: f64) -> Contact {
        Contact { point_in_object: Point::new(x, y, 0.0), normal_in_object: UnitVector::new_normalize(Vector::x()) }
    }

    #[test]
    fn terms_are_one_at_their_best_and_zero_at_their_worst() {
        assert_eq!(closure_term(0.0), 0.0);
        assert_eq!(closure_term(2.0 * GOOD_MARGIN), 1.0);
        let around = [contact(0.01, 0.0), contact(-0.01, 0.0)];
        assert_eq!(centroid_term(&around, &Point::origin(), 0.02), 1.0);
        let beside = [contact(0.03, 0.0), contact(0.03, 0.0)];
        assert_eq!(centroid_term(&beside, &Point::origin(), 0.02), 0.0);
        // A finger that moves its tip fast along y and slowly along x pushes hard along x.
        let jacobian = [Vector::x() * 0.01, Vector::y() * 0.05, Vector::z() * 0.05];
        assert!((force_axis_term(&Vector::x(), jacobian) - 1.0).abs() < 1e-9);
        assert!(force_axis_term(&Vector::y(), jacobian).abs() < 1e-9);
        assert_eq!(force_axis_term(&Vector::y(), []), 0.0);
        assert_eq!(inverse_curvature([0.0, 0.0], 0.01), 1.0);
        assert!(inverse_curvature([0.0, -100.0], 0.01) < inverse_curvature([10.0, -10.0], 0.01));
    }

    #[test]
    fn the_mean_is_weighted() {
        let scores = Scores { closure: 1.0, centroid: 1.0, force_axis: 1.0, flatness: 0.0 };
        assert!((scores.mean(&ScoreWeights::default()) - 3.0 / 9.0).abs() < 1e-15);
        assert!(ScoreWeights { closure: f64::NAN, ..ScoreWeights::default() }.validate().is_err());
        let none = ScoreWeights { closure: 0.0, centroid: 0.0, force_axis: 0.0, flatness: 0.0 };
        assert!(none.validate().is_err());
    }
}
