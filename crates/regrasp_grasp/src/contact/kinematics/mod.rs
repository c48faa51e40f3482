//! How a contact of a fingertip with the object moves (Cherif 1999, sec. 6.1.2 and 6.2.2, appendix A).
//!
//! A relative velocity in (`mode::RelativeVelocity`), a contact moved on both surfaces out, in three forms with the same
//! result: `montana` in charts, `chart_free` on any surface, meshes too, and `ball_on_polyhedron` over faces, edges and
//! vertices. The contact stays by construction: a `ContactPose` is one frame seen from both bodies.

/// Balls on convex polyhedra, over edges and vertices.
pub mod ball_on_polyhedron;
/// Charts of surfaces, and their metric, curvature and torsion.
pub mod chart;
/// Montana's equations without charts, on any surface.
pub mod chart_free;
mod dormand_prince;
/// Contact modes and their forces.
pub mod mode;
/// Montana's equations in charts.
pub mod montana;
/// Convex polyhedra with their faces, edges and vertices.
pub mod polyhedron;

#[cfg(test)]
mod tests;

pub use ball_on_polyhedron::{Ball, BallContact, BallWay, Stretch, Transition, advance_with_jumps, relocate};
pub use chart::{ChartedSurface, Coordinates, Forms};
pub use chart_free::SurfacePair;
pub use mode::{BodyVelocity, ContactMotion, ForceLaw, Mode, ModeTolerances, RelativeVelocity, motion_of};
pub use montana::{Advanced, ContactPair, ContactState, RelativeControl};
pub use polyhedron::{Edge, Face, Feature, NotPolyhedron, Polyhedron};

use nalgebra::{Matrix2, UnitQuaternion, Vector2};
use regrasp_geometry::{Pose, Vector};

/// A contact frame seen from both bodies: origin where they touch, z along the outward normal of the object, x and y any
/// right-handed completion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPose {
    /// In the object frame.
    pub object_from_contact: Pose,
    /// In the frame of the fingertip.
    pub tip_from_contact: Pose,
}

impl ContactPose {
    /// Pose of the fingertip relative to the object.
    pub fn object_from_tip(&self) -> Pose {
        self.object_from_contact * self.tip_from_contact.inverse()
    }

    /// The contact of a fingertip at `object_from_tip`, with its frame given in the object.
    pub fn of(object_from_contact: &Pose, object_from_tip: &Pose) -> Self {
        let tip_from_contact = object_from_tip.inverse() * object_from_contact;
        ContactPose { object_from_contact: *object_from_contact, tip_from_contact }
    }

    /// The same contact in a frame turned by `angle` about the normal.
    pub fn turned_by(&self, angle: f64) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector::z_axis(), angle);
        ContactPose {
            object_from_contact: self.object_from_contact * turn,
            tip_from_contact: self.tip_from_contact * turn,
        }
    }
}

/// Why a contact cannot be moved as asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoStep {
    /// Equation 12 has no solution: the surfaces fit each other in some direction, as planes, or a plane and a cylinder do.
    #[error("the relative curvature is singular: {least:.3e} 1/m in one direction, {largest:.3e} 1/m in the other")]
    SingularCurvature {
        /// Smaller eigenvalue, in 1/m.
        least: f64,
        /// Larger eigenvalue, in 1/m.
        largest: f64,
    },
    /// The relative velocity has a part along the normal: the contact opens where it is negative.
    #[error("the contact does not last: the object moves at {speed:.3e} m/s along its normal")]
    NotKept {
        /// Along the outward normal, object relative to fingertip, in m/s.
        speed: f64,
    },
    /// A duration, tolerance, velocity or radius that is not a number or has the wrong sign.
    #[error("{what} is {value}; it has to be {expected}")]
    Request {
        /// Which.
        what: &'static str,
        /// As asked for.
        value: f64,
        /// What it has to be.
        expected: &'static str,
    },
    /// The error stays above the tolerance however short the step is.
    #[error("the tolerance is not reached after {reached:.6} s: the error stays at {error:.3e} per second")]
    Tolerance {
        /// Time reached, in seconds.
        reached: f64,
        /// Error per second of the last step tried.
        error: f64,
    },
    /// Poses at which the two surfaces do not touch in the frame given.
    #[error("the surfaces do not touch there: {distance:.3e} m apart, normals {angle:.3e} rad from opposed")]
    NotTouching {
        /// Between the contact point and the surface farther from it, in metres.
        distance: f64,
        /// Between the contact normal and the worse of the two surfaces' normals, in radians.
        angle: f64,
    },
    /// The ball crosses edges without end, or stands on an edge or vertex with a normal that is none of theirs.
    #[error("the ball on the polyhedron finds no way on after {crossings} crossings")]
    Stuck {
        /// Edges and vertices crossed until then.
        crossings: usize,
    },
}

/// Smallest eigenvalue of the relative curvature, over its largest, that counts as invertible.
const LEAST_RELATIVE_CURVATURE: f64 = 1e-9;

/// Speed along the normal that a contact is said to keep, over the tangential speeds, and in m/s.
const KEPT: f64 = 1e-9;

/// How the contact point moves on both bodies at one instant, in the contact frame: equation 12 without charts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PointRates {
    /// Over the object, in m/s.
    on_object: Vector2<f64>,
    /// Over the fingertip, in m/s.
    on_tip: Vector2<f64>,
}

/// Solves for the rates. Curvatures are in the contact frame, positive where their body is convex.
fn point_rates(
    on_object: &Matrix2<f64>,
    on_tip: &Matrix2<f64>,
    velocity: &RelativeVelocity,
) -> Result<PointRates, NoStep> {
    let speed = velocity.linear.z;
    if !(speed.abs() <= KEPT * velocity.sliding_speed().max(1.0)) {
        return Err(NoStep::NotKept { speed });
    }
    let relative = on_object + on_tip;
    let (mean, half) = (0.5 * relative.trace(), 0.5 * (relative[(0, 0)] - relative[(1, 1)]));
    let spread = half.hypot(0.5 * (relative[(0, 1)] + relative[(1, 0)]));
    let (least, largest) = (mean - spread, mean + spread);
    if !(least.abs() > LEAST_RELATIVE_CURVATURE * largest.abs())
        || !(largest.abs() > LEAST_RELATIVE_CURVATURE * least.abs())
    {
        return Err(NoStep::SingularCurvature { least, largest });
    }
    let Some(inverse) = relative.try_inverse() else { return Err(NoStep::SingularCurvature { least, largest }) };
    let turn = Vector2::new(-velocity.angular.y, velocity.angular.x);
    let slide = velocity.linear.xy();
    Ok(PointRates { on_object: inverse * (turn - on_tip * slide), on_tip: inverse * (turn + on_object * slide) })
}

fn checked_request(duration: f64, tolerance: f64, velocity: &RelativeVelocity) -> Result<(), NoStep> {
    if !(duration.is_finite() && duration >= 0.0) {
        return Err(NoStep::Request { what: "the duration", value: duration, expected: "finite and at least 0 s" });
    }
    if !(tolerance.is_finite() && tolerance > 0.0) {
        return Err(NoStep::Request { what: "the tolerance", value: tolerance, expected: "finite and above 0" });
    }
    let broken = velocity.linear.iter().chain(velocity.angular.iter()).find(|x| !x.is_finite());
    match broken {
        Some(&value) => Err(NoStep::Request { what: "a relative velocity", value, expected: "finite" }),
        None => Ok(()),
    }
}
