//! Grasps that the query gives: a plan begins and ends with them. A tip or contact that is off the surface may be moved to
//! touch, by no more than `GRASP_TOLERANCE`; one that touches as it is stays.

use crate::check::model::{CheckedHand, FingerModel};
use crate::check::surface::SortedShape;
use crate::check::tip_surface::TipSurface;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{Plan, Waypoint};
use regrasp_geometry::{Pose, Vector};
use regrasp_scene::{GRASP_TOLERANCE, GRASP_TURN_TOLERANCE, GraspRequest, Query};

/// Compares the first and the last waypoint with the grasps that the query gives; one finger is reported for each.
pub fn check_given(
    shape: &SortedShape,
    query: Option<&Query>,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) {
    let (Some(query), Some(first), Some(last)) = (query, plan.segments.first(), plan.segments.last()) else { return };
    let n_last = last.waypoints.len().saturating_sub(1);
    let ends = [
        (Kind::StartMismatch, "start", query.start_grasp(), first.waypoints.first(), Moment::at(0, 0)),
        (
            Kind::GoalMismatch,
            "goal",
            query.goal_grasp(),
            last.waypoints.last(),
            Moment::at(plan.segments.len() - 1, n_last),
        ),
    ];
    for (kind, name, asked, waypoint, at) in ends {
        let Some(waypoint) = waypoint else { continue };
        let mut tell = |finger: &str, what: &str, amount: f64, limit: f64| {
            let message = format!(
                "in the {name} grasp the {what} of finger \"{finger}\" is {amount:.3e} (m or rad) from the one asked for, \
                 allowed are {limit:.1e}"
            );
            log.push(Violation::new(kind, message).when(at).subjects([finger]).amount(amount, limit));
        };
        match asked {
            GraspRequest::Automatic => {}
            GraspRequest::Joints(joints) | GraspRequest::Posture { joints, .. }
                if joints.len() != waypoint.joints.len() =>
            {
                tell("?", "number of joints", f64::INFINITY, 0.0);
            }
            GraspRequest::Posture { holds, .. } if holds.len() != waypoint.contacts.len() => {
                tell("?", "number of fingers", f64::INFINITY, 0.0);
            }
            GraspRequest::Contacts(points) if points.len() != waypoint.contacts.len() => {
                tell("?", "number of contacts", f64::INFINITY, 0.0);
            }
            GraspRequest::Joints(joints) | GraspRequest::Posture { joints, .. } => {
                for (f, finger) in model.fingers.iter().enumerate() {
                    // Of a grasp that names free fingers, those and no others are free, and stand as they were given.
                    let holds = match asked {
                        GraspRequest::Posture { holds, .. } => Some(holds[f]),
                        _ => None,
                    };
                    if holds.is_some_and(|holds| holds != waypoint.contacts[f].holds()) {
                        tell(&finger.name, "touch", f64::INFINITY, 0.0);
                        break;
                    }
                    let touches =
                        holds == Some(false) || gap(shape, finger, joints, waypoint).abs() <= settings.pose_tolerance;
                    let exactly = settings.pose_tolerance;
                    let [reach, turn] = if touches { [exactly; 2] } else { [GRASP_TOLERANCE, GRASP_TURN_TOLERANCE] };
                    let own = finger.coordinates.clone();
                    let turned = own.map(|k| (joints[k] - waypoint.joints[k]).abs()).fold(0.0, f64::max);
                    let moved = (finger.center_in_world(joints) - finger.center_in_world(&waypoint.joints)).norm();
                    if turned > turn + exactly {
                        tell(&finger.name, "largest joint", turned, turn);
                        break;
                    } else if moved > reach + exactly {
                        tell(&finger.name, "tip", moved, reach);
                        break;
                    }
                }
            }
            GraspRequest::Contacts(points) => {
                for ((finger, asked), contact) in model.fingers.iter().zip(points).zip(&waypoint.contacts) {
                    let moved = contact
                        .point_in_object
                        .map_or(f64::INFINITY, |point| (Vector::from(point) - asked.coords).norm());
                    if moved > GRASP_TOLERANCE + settings.pose_tolerance {
                        tell(&finger.name, "contact", moved, GRASP_TOLERANCE);
                        break;
                    }
                }
            }
        }
    }
}

/// Distance of a tip with these joints from the surface, of the object where the waypoint has it; of a tip that is no ball it is
/// not worked out and counts as large.
fn gap(shape: &SortedShape, finger: &FingerModel, joints: &[f64], waypoint: &Waypoint) -> f64 {
    match finger.surface {
        TipSurface::Ball => {
            let object = Pose::from(&waypoint.world_from_object);
            let center = object.inverse_transform_point(&finger.center_in_world(joints));
            shape.nearest(&center).distance - finger.radius
        }
        TipSurface::Ellipsoid { .. } | TipSurface::Smooth(_) => f64::INFINITY,
    }
}
