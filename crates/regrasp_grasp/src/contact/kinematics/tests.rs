//! Contact kinematics against second ways of knowing.

mod chart_free;
mod charts;
mod closed_forms;
mod integration;
mod polyhedra;

use super::chart::{ChartedSurface, Coordinates};
use super::montana::{ContactPair, ContactState};
use super::{ContactPose, RelativeVelocity};
use regrasp_base::Rng;
use regrasp_geometry::{Pose, Vector};

pub(super) fn any_pose(rng: &mut Rng) -> Pose {
    Pose::new(Vector::from(rng.direction()) * 0.05, Vector::from(rng.direction()) * rng.uniform(0.0, 3.0))
}

/// One of each kind, somewhere in its body.
pub(super) fn surfaces(rng: &mut Rng) -> Vec<ChartedSurface> {
    let radii = Vector::new(0.09, 0.07, 0.12);
    vec![
        ChartedSurface::plane(any_pose(rng)),
        ChartedSurface::cylinder(0.04, any_pose(rng)).unwrap(),
        ChartedSurface::sphere(0.03, any_pose(rng)).unwrap(),
        ChartedSurface::ellipsoid(radii, any_pose(rng)).unwrap(),
        ChartedSurface::superellipsoid(radii, 2.5, 3.0, any_pose(rng)).unwrap(),
        ChartedSurface::superellipsoid(radii, 2.0, 4.0, any_pose(rng)).unwrap(),
    ]
}

pub(super) fn any_coordinates(surface: &ChartedSurface, rng: &mut Rng) -> Coordinates {
    let seen = surface.coordinates(&regrasp_geometry::Point::from(Vector::from(rng.direction())));
    if seen.axis == 2 {
        return Coordinates { axis: 2, u: rng.uniform(-1.0, 1.0), v: rng.uniform(-0.8, 0.8) };
    }
    seen
}

pub(super) fn any_state(pair: &ContactPair, rng: &mut Rng) -> ContactState {
    let (object, tip) = (any_coordinates(&pair.object, rng), any_coordinates(&pair.tip, rng));
    ContactState { object, tip, psi: rng.uniform(-3.0, 3.0) }
}

/// Slides at a few centimetres per second and turns at a few radians.
pub(super) fn any_velocity(rng: &mut Rng) -> RelativeVelocity {
    RelativeVelocity {
        linear: Vector::new(rng.normal() * 0.02, rng.normal() * 0.02, 0.0),
        angular: Vector::from(rng.direction()) * rng.uniform(0.1, 1.0),
    }
}

/// Translation and angle between two poses, the angle times `length`.
pub(super) fn apart(a: &Pose, b: &Pose, length: f64) -> f64 {
    (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation) * length
}

/// Relative velocity in the frame of `middle`, from poses of the fingertip over the object at times `2 * step` apart.
pub(super) fn differenced(before: &Pose, after: &Pose, middle: &ContactPose, step: f64) -> RelativeVelocity {
    let point = middle.tip_from_contact * regrasp_geometry::Point::origin();
    let way = (after * point - before * point) / (2.0 * step);
    let turn = (after.rotation * before.rotation.inverse()).scaled_axis() / (2.0 * step);
    let into = middle.object_from_contact.rotation.inverse();
    RelativeVelocity { linear: -(into * way), angular: -(into * turn) }
}
