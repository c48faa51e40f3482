//! How fast a fingertip moves at most in a step, seen from the object.

use crate::check::between::Between;
use crate::check::model::FingerModel;
use crate::check::motion::ObjectRates;
use crate::plan::Waypoint;
use regrasp_geometry::{Point, Pose};

/// Speed and acceleration bounds of the tip's centre seen from the object, per step and per step squared.
pub fn bounds_in_object(finger: &FingerModel, motion: &Between, from: &Waypoint, to: &Waypoint) -> (f64, f64) {
    let object = ObjectRates::new(motion, from, to);
    let rates = finger.path.rates(&finger.center, 0.0, &motion.joint_bounds());
    let origin = Pose::from(&from.world_from_object) * Point::origin();
    let arm = (finger.center_in_world(&from.joints) - origin).norm();
    (object.speed_seen(&rates, arm), object.acceleration_seen(&rates, arm))
}

/// Bound of the speed, per step, of whatever of a tip touches, seen from the object: of the points of the tip, and of the place
/// on it that faces a direction ([`TipSurface::wander`](crate::check::tip_surface::TipSurface::wander)).
pub fn speed_in_object(finger: &FingerModel, motion: &Between, from: &Waypoint, to: &Waypoint) -> f64 {
    let reach = finger.radius + finger.surface.wander();
    let rates = finger.path.rates(&finger.center, reach, &motion.joint_bounds());
    let origin = Pose::from(&from.world_from_object) * Point::origin();
    let arm = (finger.center_in_world(&from.joints) - origin).norm() + reach;
    ObjectRates::new(motion, from, to).speed_seen(&rates, arm)
}
