//! Fingertips on their contacts, at waypoints and between them, and contacts on the object. Tips that roll between two
//! waypoints are judged in `rolling`.

use crate::check::continuity::{contact_of, moving_finger, pose_between};
use crate::check::edges::Edges;
use crate::check::model::{FingerModel, Model};
use crate::check::rolling::bounds_in_object;
use crate::check::surface;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, Plan, Waypoint};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_scene::Object;
use std::collections::BTreeSet;

/// Most samples of one step; a step that needs more is one that no planner makes.
const MOST_SAMPLES: usize = 4096;

/// Largest distance of a fingertip from the fixed contact that it holds, over the plan; violations go to the log.
///
/// Between samples the bound is exact: the tip's centre in the object frame deviates from the chord between two
/// samples by at most (largest acceleration) (interval)^2 / 8.
pub fn check_tips(model: &Model, plan: &Plan, log: &mut Log) -> f64 {
    let tolerance = plan.promises.contact_tolerance;
    let mut largest: f64 = 0.0;
    for (s, segment) in plan.segments.iter().enumerate() {
        let moving = moving_finger(model, segment);
        for (f, finger) in model.fingers.iter().enumerate() {
            let mut report = |error: f64, at: Moment| {
                largest = largest.max(error);
                if error > tolerance {
                    let message = format!("the tip of finger \"{}\" is {error:.3e} m off its contact", finger.name);
                    let violation = Violation::new(Kind::ContactOffTip, message).when(at);
                    log.push(violation.subjects([finger.name.as_str()]).amount(error, tolerance));
                    return true;
                }
                false
            };
            for (w, waypoint) in segment.waypoints.iter().enumerate() {
                let Some(next) = segment.waypoints.get(w + 1).filter(|_| moving != Some(f)) else {
                    // The moving finger, and the last waypoint of any finger: only the moment itself counts.
                    if holds(waypoint, f) && report(error_at(finger, waypoint, f), Moment::at(s, w)) {
                        break;
                    }
                    continue;
                };
                if holds(waypoint, f) && holds(next, f) {
                    let (error, fraction) = error_between(finger, waypoint, next, f, tolerance);
                    if report(error, Moment { segment: s, waypoint: w, fraction }) {
                        break;
                    }
                }
            }
        }
    }
    largest
}

fn holds(waypoint: &Waypoint, finger: usize) -> bool {
    waypoint.contacts[finger].mode == ContactMode::Fixed
}

/// Where the tip's centre belongs, in the object frame.
fn center_in_object(finger: &FingerModel, waypoint: &Waypoint, f: usize) -> Option<Point> {
    let contact = contact_of(&waypoint.contacts[f])?;
    Some(contact.point_in_object + contact.normal_in_object.into_inner() * finger.radius)
}

/// Distance of the tip's centre from where it belongs, at a waypoint; infinite when the finger has no contact there.
pub fn error_at(finger: &FingerModel, waypoint: &Waypoint, f: usize) -> f64 {
    let Some(target) = center_in_object(finger, waypoint, f) else { return f64::INFINITY };
    let pose = Pose::from(&waypoint.world_from_object);
    (finger.center_in_world(&waypoint.joints) - pose * target).norm()
}

/// Upper bound of the error over the closed step, and where it is largest.
fn error_between(finger: &FingerModel, from: &Waypoint, to: &Waypoint, f: usize, tolerance: f64) -> (f64, f64) {
    let Some(target) = center_in_object(finger, from, f) else { return (f64::INFINITY, 0.0) };
    let (start, end) = (Pose::from(&from.world_from_object), Pose::from(&to.world_from_object));
    let (_, acceleration) = bounds_in_object(finger, from, to);
    // Between samples no more than a twentieth of the tolerance may be unknown.
    let allowed = (0.05 * tolerance).max(1e-9);
    let n_samples = ((acceleration / (8.0 * allowed)).sqrt().ceil() as usize).clamp(1, MOST_SAMPLES);
    let remainder = acceleration / (8.0 * (n_samples * n_samples) as f64);
    let mut worst = (0.0, 0.0);
    let mut joints = from.joints.clone();
    for sample in 0..=n_samples {
        let t = sample as f64 / n_samples as f64;
        for (k, joint) in joints.iter_mut().enumerate() {
            *joint = from.joints[k] + t * (to.joints[k] - from.joints[k]);
        }
        let error = (finger.center_in_world(&joints) - pose_between(&start, &end, t) * target).norm();
        if error > worst.0 {
            worst = (error, t);
        }
    }
    (worst.0 + remainder, worst.1)
}

/// Every contact of the plan lies on the object's surface, with the surface's normal, away from its edges.
pub fn check_contacts(object: &Object, model: &Model, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    let mut seen = BTreeSet::new();
    let edges = Edges::of(&object.shape, object.crease_angle);
    let least = object.edge_distance - settings.surface_tolerance;
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            for (f, state) in waypoint.contacts.iter().enumerate() {
                let (Some(point), Some(normal)) = (state.point_in_object, state.normal_in_object) else { continue };
                if !seen.insert((point.map(f64::to_bits), normal.map(f64::to_bits))) {
                    continue;
                }
                let name = model.fingers[f].name.as_str();
                let tell = |kind, message: String, amount, limit| {
                    Violation::new(kind, message).when(Moment::at(s, w)).subjects([name]).amount(amount, limit)
                };
                let nearest = surface::nearest(&object.shape, &Point::from(point));
                if nearest.distance > settings.surface_tolerance {
                    let message =
                        format!("the contact of finger \"{name}\" is {:.3e} m off the surface", nearest.distance);
                    log.push(tell(Kind::ContactOffSurface, message, nearest.distance, settings.surface_tolerance));
                    continue;
                }
                let angle = surface::angle_to_cone(&Vector::from(normal), &nearest.normals);
                if angle > settings.normal_tolerance {
                    let message = format!("the normal of finger \"{name}\" is {angle:.3e} rad off the surface's");
                    log.push(tell(Kind::ContactNormalWrong, message, angle, settings.normal_tolerance));
                }
                let edge = edges.distance(&Point::from(point), least);
                if edge < least {
                    let message = format!(
                        "the contact of finger \"{name}\" is {edge:.3e} m from an edge, the scene asks for {:.3e}",
                        object.edge_distance
                    );
                    log.push(tell(Kind::ContactTooNearEdge, message, edge, object.edge_distance));
                }
            }
        }
    }
}
