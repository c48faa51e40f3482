//! Fingertips on their contacts, at waypoints and between them, and contacts on the object. Tips that roll between two
//! waypoints are judged in `rolling`.

use crate::check::between::Between;
use crate::check::edges::Edges;
use crate::check::model::{CheckedHand, FingerModel};
use crate::check::roles::{contact_of, moving_finger};
use crate::check::surface;
use crate::check::tip_rates::{bounds_in_object, speed_in_object};
use crate::check::tip_surface::TipSurface;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, Plan, SegmentKind, Waypoint};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::Contact;
use regrasp_scene::{GraspRequest, Object, Query};
use std::collections::BTreeSet;

/// Most samples of one step; a step that needs more is one that no planner makes.
const MOST_SAMPLES: usize = 4096;

/// Largest distance of a fingertip from the fixed contact that it holds, over the plan; violations go to the log.
///
/// Between samples the bound is exact: the centre of a ball in the object frame deviates from the chord between two samples
/// by at most (largest acceleration) (interval)^2 / 8; what touches of another tip moves by at most (largest speed)
/// (interval) / 2.
pub fn check_tips(model: &CheckedHand, plan: &Plan, log: &mut Log) -> f64 {
    let tolerance = plan.promises.contact_tolerance;
    let mut largest: f64 = 0.0;
    // Tips in tracking are judged in `tracking`.
    for (s, segment) in plan.segments.iter().enumerate().filter(|(_, one)| one.kind != SegmentKind::Tracking) {
        let moving = moving_finger(model, segment);
        for (f, finger) in model.fingers.iter().enumerate() {
            let mut samples = 0;
            let mut report = |error: f64, at: Moment| {
                largest = largest.max(error);
                if error > tolerance {
                    log.push(off_contact(finger, error, tolerance).when(at));
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
                    let (error, fraction, looked) = error_between(finger, waypoint, next, f, tolerance);
                    samples += looked as u64;
                    if report(error, Moment { segment: s, waypoint: w, fraction }) {
                        break;
                    }
                }
            }
            if !log.work.spend(samples, "fingertips on their contacts") {
                return largest;
            }
        }
    }
    largest
}

fn holds(waypoint: &Waypoint, finger: usize) -> bool {
    waypoint.contacts[finger].mode == ContactMode::Fixed
}

/// Distance of the tip from the contact when joints and object are given: for balls, of the centre from where it belongs; for
/// others, of the point that faces the contact's normal from the contact, and what the hull is off the ellipsoid there.
pub fn tip_error(finger: &FingerModel, joints: &[f64], world_from_object: &Pose, contact: &Contact) -> f64 {
    let normal = contact.normal_in_object.into_inner();
    match finger.surface {
        TipSurface::Ball => {
            let target = contact.point_in_object + normal * finger.radius;
            (finger.center_in_world(joints) - world_from_object * target).norm()
        }
        TipSurface::Ellipsoid { .. } | TipSurface::Smooth(_) => {
            let normal = world_from_object * normal;
            let touching = finger.touching_in_world(joints, &normal);
            (touching - world_from_object * contact.point_in_object).norm() + finger.misfit(joints, &normal)
        }
    }
}

/// Distance of the tip from its contact at a waypoint; infinite when the finger has no contact there.
pub fn error_at(finger: &FingerModel, waypoint: &Waypoint, f: usize) -> f64 {
    let Some(contact) = contact_of(&waypoint.contacts[f]) else { return f64::INFINITY };
    tip_error(finger, &waypoint.joints, &Pose::from(&waypoint.world_from_object), &contact)
}

/// Upper bound of the error over the closed step, where it is largest, and the number of samples taken.
fn error_between(finger: &FingerModel, from: &Waypoint, to: &Waypoint, f: usize, tolerance: f64) -> (f64, f64, usize) {
    let Some(contact) = contact_of(&from.contacts[f]) else { return (f64::INFINITY, 0.0, 0) };
    let motion = Between::new(from, to);
    // Between samples no more than a twentieth of the tolerance may be unknown.
    let allowed = (0.05 * tolerance).max(1e-9);
    let (n_samples, remainder) = match finger.surface {
        TipSurface::Ball => {
            let (_, acceleration) = bounds_in_object(finger, &motion, from, to);
            let n_samples = ((acceleration / (8.0 * allowed)).sqrt().ceil() as usize).clamp(1, MOST_SAMPLES);
            (n_samples, acceleration / (8.0 * (n_samples * n_samples) as f64))
        }
        // The error changes no faster than the point that touches moves, and that wanders over the tip.
        TipSurface::Ellipsoid { .. } | TipSurface::Smooth(_) => {
            let speed = speed_in_object(finger, &motion, from, to);
            let n_samples = ((speed / (2.0 * allowed)).ceil() as usize).clamp(1, MOST_SAMPLES);
            (n_samples, speed / (2.0 * n_samples as f64))
        }
    };
    let mut worst = (0.0, 0.0);
    for sample in 0..=n_samples {
        let t = sample as f64 / n_samples as f64;
        let error = tip_error(finger, &motion.joints_at(t), &motion.object_at(t), &contact);
        if error > worst.0 {
            worst = (error, t);
        }
    }
    (worst.0 + remainder, worst.1, n_samples)
}

/// Every fingertip that holds touches with its pad, at waypoints.
pub fn check_pads(model: &CheckedHand, plan: &Plan, log: &mut Log) {
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            for (finger, state) in model.fingers.iter().zip(&waypoint.contacts) {
                let Some(contact) = contact_of(state).filter(|_| state.holds()) else { continue };
                let normal = Pose::from(&waypoint.world_from_object) * contact.normal_in_object.into_inner();
                if let Some((angle, allowed)) = finger.off_pad(&waypoint.joints, &normal) {
                    let degrees = [angle, allowed].map(f64::to_degrees);
                    let message = format!(
                        "finger \"{}\" touches {:.2} degrees from the axis of its pad, which ends at {:.2}",
                        finger.name, degrees[0], degrees[1]
                    );
                    let violation = Violation::new(Kind::ContactOffPad, message).when(Moment::at(s, w));
                    log.push(violation.subjects([finger.name.as_str()]).amount(angle, allowed));
                }
            }
        }
    }
}

/// Every contact of the plan lies on the object's surface, with the surface's normal, away from its edges: on an edge any
/// normal between those of its faces is one. Tracking crosses edges, so contacts there may be near. Where the query says how the hand
/// was observed, a fingertip that was near an edge then may be there until it lifts, and only go away from edges.
pub fn check_contacts(
    object: &Object,
    query: Option<&Query>,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) {
    let mut seen = BTreeSet::new();
    let edges = Edges::of(&object.shape, object.crease_angle);
    let least = object.edge_distance - settings.surface_tolerance;
    let mut observed = observed_near_edges(object, query, model, plan, &edges, settings.surface_tolerance);
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            for (f, state) in waypoint.contacts.iter().enumerate() {
                if !state.holds() {
                    observed[f] = None;
                }
                let (Some(point), Some(normal)) = (state.point_in_object, state.normal_in_object) else { continue };
                let may_cross = segment.kind == SegmentKind::Tracking;
                let nearest_allowed = observed[f].unwrap_or(least);
                let place = (point.map(f64::to_bits), normal.map(f64::to_bits));
                if !seen.insert((may_cross, nearest_allowed.to_bits(), place)) {
                    continue;
                }
                let name = model.fingers[f].name.as_str();
                let tell = |kind, message: String, amount, limit| {
                    Violation::new(kind, message).when(Moment::at(s, w)).subjects([name]).amount(amount, limit)
                };
                let nearest = model.shape.nearest(&Point::from(point));
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
                if may_cross {
                    continue;
                }
                let edge = edges.distance(&Point::from(point), least);
                if edge < nearest_allowed {
                    let (limit, who) = match observed[f] {
                        Some(_) => (nearest_allowed, "it was observed near one and may only go away, here to"),
                        None => (object.edge_distance, "the scene asks for"),
                    };
                    let message =
                        format!("the contact of finger \"{name}\" is {edge:.3e} m from an edge, {who} {limit:.3e}");
                    log.push(tell(Kind::ContactTooNearEdge, message, edge, limit));
                }
                // Whoever has gone away does not come back.
                if let Some(allowed) = observed[f] {
                    let gone_to = edge - settings.surface_tolerance;
                    observed[f] = (gone_to < least).then_some(gone_to.max(allowed));
                }
            }
        }
    }
}

/// For every finger that was observed nearer to an edge than the scene allows, but no nearer than may be: how near it was, less the
/// tolerance. Only plans that say what they were asked begin so; that they begin as the query has it is judged elsewhere.
fn observed_near_edges(
    object: &Object,
    query: Option<&Query>,
    model: &CheckedHand,
    plan: &Plan,
    edges: &Edges,
    tolerance: f64,
) -> Vec<Option<f64>> {
    let mut observed = vec![None; plan.fingers.len()];
    let Some(GraspRequest::Posture { holds, .. }) = query.filter(|_| plan.asked.is_some()).map(Query::start_grasp)
    else {
        return observed;
    };
    let Some(first) = plan.segments.first().and_then(|segment| segment.waypoints.first()) else { return observed };
    let world_from_object = Pose::from(&first.world_from_object);
    let least = object.edge_distance - tolerance;
    for (f, finger) in model.fingers.iter().enumerate().filter(|(f, _)| holds.get(*f) == Some(&true)) {
        let Some(contact) = contact_of(&first.contacts[f]) else { continue };
        let distance = edges.distance(&contact.point_in_object, least);
        // The tip itself may be elsewhere than the plan says, within the tolerance of contacts.
        let normal = world_from_object * contact.normal_in_object.into_inner();
        let off = error_at(finger, first, f) - finger.misfit(&first.joints, &normal);
        let is_far_enough = distance - off.max(0.0) >= object.least_observed_edge_distance() - tolerance;
        observed[f] = (distance < least && is_far_enough).then_some(distance - tolerance);
    }
    observed
}

pub(super) fn off_contact(finger: &FingerModel, error: f64, tolerance: f64) -> Violation {
    let name = &finger.name;
    let message = if error.is_finite() {
        format!("the tip of finger \"{name}\" is {error:.3e} m off its contact")
    } else {
        format!(
            "the tip of finger \"{name}\" has no contact that is defined: no nearest point of the surface was found"
        )
    };
    Violation::new(Kind::ContactOffTip, message).subjects([finger.name.as_str()]).amount(error, tolerance)
}
