//! Random poses of the object.

use crate::settings::SearchSettings;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector, interpolate_pose};
use regrasp_manipulation::model::Model;

/// A random pose near the way from `start` to `goal` (by measurement on a prototype: biased poses).
pub fn draw_pose(model: &Model, settings: &SearchSettings, start: &Pose, goal: &Pose, rng: &mut Rng) -> Pose {
    let is_far = rng.chance(settings.far_share);
    let (distance, angle) = (settings.wander_distance, settings.wander_angle);
    let distance = if is_far { distance.max(model.turn_length()) } else { distance };
    let along = interpolate_pose(start, goal, rng.unit());
    let shift = Vector::from(rng.direction()) * (distance * rng.unit().cbrt());
    let turn = Vector::new(rng.normal(), rng.normal(), rng.normal()) * angle;
    let center = along * model.view.object.center_of_mass;
    let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn) * along.rotation;
    // Turn about the centre of mass, then shift.
    let origin: Point = center + shift - rotation * model.view.object.center_of_mass.coords;
    Pose::from_parts(origin.coords.into(), rotation)
}
