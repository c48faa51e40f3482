//! Contacts of hands that hold: on the object's surface, at the fingertips, the same from grasp to release, and closed hand by hand.

use crate::check::closure::{HeldBody, certified_margin};
use crate::check::contact::tip_error;
use crate::check::edges::Edges;
use crate::check::promises::MARGIN_TOLERANCE;
use crate::check::surface::{SortedShape, angle_to_cone};
use crate::check::tasks::holders::Phase;
use crate::check::tasks::rest::Hold;
use crate::check::tasks::task::{Task, TaskHand};
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log, Report};
use crate::plan::ContactMode;
use crate::robot_plan::{RobotContact, RobotPlan, RobotWaypoint};
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_grasp::{Contact, Grip};

/// The contact as the closure test takes it.
pub fn contact_of(contact: &RobotContact) -> Contact {
    Contact {
        point_in_object: Point::from(contact.point_in_object),
        normal_in_object: UnitVector::new_normalize(Vector::from(contact.normal_in_object)),
    }
}

/// Index of the finger in its hand.
pub fn finger_of(hand: &TaskHand, contact: &RobotContact) -> Option<usize> {
    hand.fingers.iter().position(|finger| finger.name == contact.finger)
}

/// The object as closure and forces count on it: the friction promised, and no more than the object has.
pub fn held_body(task: &Task) -> HeldBody {
    let friction = task.object.friction / task.promises.friction_margin.max(1.0);
    HeldBody { center_of_mass: task.object.center_of_mass, torque_scale: task.object.radius, friction }
}

/// Entries that are nobody's: of unknown fingers, of hands that do not hold, twice, or of another mode than fixed. False where there are
/// some that have no finger.
pub fn check_entries(task: &Task, phases: &[Phase], plan: &RobotPlan, log: &mut Log) -> bool {
    let mut is_sound = true;
    for (s, (phase, segment)) in phases.iter().zip(&plan.segments).enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            for (i, contact) in waypoint.contacts.iter().enumerate() {
                let hand = task.hand_named(&contact.hand);
                let is_known = hand.is_some_and(|hand| finger_of(&task.hands[hand], contact).is_some());
                let is_twice = waypoint.contacts[..i]
                    .iter()
                    .any(|other| (&other.hand, &other.finger) == (&contact.hand, &contact.finger));
                let length = Vector::from(contact.normal_in_object).norm();
                let fault = if !is_known || contact.object != plan.objects[0] {
                    is_sound = false;
                    "has no such finger or object"
                } else if !((length - 1.0).abs() <= 1e-9) {
                    is_sound = false;
                    "has a normal that is not of length one"
                } else if hand.is_none_or(|hand| !phase.has_hand(hand)) {
                    "is of a hand that does not hold in this segment"
                } else if is_twice {
                    "is there twice"
                } else if contact.mode != ContactMode::Fixed && !phase.kind.is_in_hand() {
                    "is not fixed"
                } else {
                    continue;
                };
                let message = format!("the contact of \"{}/{}\" {fault}", contact.hand, contact.finger);
                let violation = Violation::new(Kind::WrongContactMode, message).when(Moment::at(s, w));
                log.push(violation.subjects([contact.hand.as_str(), contact.finger.as_str()]));
            }
        }
    }
    is_sound
}

/// Judges the contacts of every hold.
pub fn check_contacts(
    task: &Task,
    holds: &[Hold],
    plan: &RobotPlan,
    settings: &CheckSettings,
    (log, report): (&mut Log, &mut Report),
) {
    let judge = Judge {
        task,
        settings,
        shape: SortedShape::of(&task.object.shape),
        edges: Edges::of(&task.object.shape, task.object.crease_angle),
    };
    for hold in holds {
        judge.check_hold(hold, plan, log, report);
    }
}

struct Judge<'a> {
    task: &'a Task<'a>,
    settings: &'a CheckSettings,
    shape: SortedShape,
    edges: Edges<'a>,
}

impl Judge<'_> {
    fn check_hold(&self, hold: &Hold, plan: &RobotPlan, log: &mut Log, report: &mut Report) {
        let hand = &self.task.hands[hold.hand];
        let of_hand = |waypoint: &RobotWaypoint| -> Vec<RobotContact> {
            waypoint.contacts.iter().filter(|contact| contact.hand == hand.name).cloned().collect()
        };
        let start = *hold.segments.start();
        let first = of_hand(&plan.segments[start].waypoints[0]);
        for contact in &first {
            self.check_place(contact, Moment::at(start, 0), log);
        }
        self.check_closure(hand, &first, Moment::at(start, 0), log, report);
        let tolerance = self.task.contact_tolerance(self.settings.largest_contact_tolerance);
        for s in hold.segments.clone() {
            for (w, waypoint) in plan.segments[s].waypoints.iter().enumerate() {
                let at = Moment::at(s, w);
                let present = of_hand(waypoint);
                if !are_same(&present, &first, self.settings.meeting_tolerance) {
                    let message =
                        format!("hand \"{}\" holds with other contacts than where its hold begins", hand.name);
                    log.push(Violation::new(Kind::GraspChanges, message).when(at).subjects([hand.name.as_str()]));
                }
                let world_from_object = Pose::from(&waypoint.world_from_objects[0]);
                for contact in &present {
                    let Some(f) = finger_of(hand, contact) else { continue };
                    let finger = &hand.fingers[f];
                    let subjects = [hand.name.as_str(), finger.name.as_str()];
                    let contact = contact_of(contact);
                    let error = tip_error(finger, &waypoint.joints, &world_from_object, &contact);
                    report.max_contact_error = report.max_contact_error.max(error);
                    if !(error <= tolerance) {
                        let message = format!(
                            "the tip of finger \"{}/{}\" is {error:.3e} m off its contact",
                            hand.name, finger.name
                        );
                        let violation = Violation::new(Kind::ContactOffTip, message).when(at);
                        log.push(violation.subjects(subjects).amount(error, tolerance));
                    }
                    let normal = world_from_object * contact.normal_in_object.into_inner();
                    if let Some((angle, allowed)) = finger.off_pad(&waypoint.joints, &normal) {
                        let degrees = [angle, allowed].map(f64::to_degrees);
                        let message = format!(
                            "finger \"{}/{}\" touches {:.2} degrees from the axis of its pad, which ends at {:.2}",
                            hand.name, finger.name, degrees[0], degrees[1]
                        );
                        let violation = Violation::new(Kind::ContactOffPad, message).when(at);
                        log.push(violation.subjects(subjects).amount(angle, allowed));
                    }
                }
            }
        }
    }

    /// The contact lies on the object's surface, with the surface's normal, away from its edges.
    fn check_place(&self, contact: &RobotContact, at: Moment, log: &mut Log) {
        let name = format!("{}/{}", contact.hand, contact.finger);
        let tell = |kind, message: String, amount, limit| {
            Violation::new(kind, message).when(at).subjects([name.as_str()]).amount(amount, limit)
        };
        let point = Point::from(contact.point_in_object);
        let (settings, object) = (self.settings, self.task.object);
        let nearest = self.shape.nearest(&point);
        if !(nearest.distance <= settings.surface_tolerance) {
            let message = format!("the contact of finger \"{name}\" is {:.3e} m off the surface", nearest.distance);
            log.push(tell(Kind::ContactOffSurface, message, nearest.distance, settings.surface_tolerance));
            return;
        }
        let angle = angle_to_cone(&Vector::from(contact.normal_in_object), &nearest.normals);
        if !(angle <= settings.normal_tolerance) {
            let message = format!("the normal of finger \"{name}\" is {angle:.3e} rad off the surface's");
            log.push(tell(Kind::ContactNormalWrong, message, angle, settings.normal_tolerance));
        }
        let least = object.edge_distance - settings.surface_tolerance;
        let edge = self.edges.distance(&point, least);
        if edge < least {
            let message = format!(
                "the contact of finger \"{name}\" is {edge:.3e} m from an edge, the scene asks for {:.3e}",
                object.edge_distance
            );
            log.push(tell(Kind::ContactTooNearEdge, message, edge, object.edge_distance));
        }
    }

    /// The hand closes the object by itself.
    fn check_closure(
        &self,
        hand: &TaskHand,
        contacts: &[RobotContact],
        at: Moment,
        log: &mut Log,
        report: &mut Report,
    ) {
        let grip = |contact: &RobotContact| {
            let model = hand.fingers[finger_of(hand, contact)?].contact;
            Some(Grip { contact: contact_of(contact), model })
        };
        let grips: Vec<Grip> = contacts.iter().filter_map(grip).collect();
        let found = certified_margin(&grips, &held_body(self.task)).map_or(0.0, |(margin, _)| margin);
        report.min_margin = Some(report.min_margin.map_or(found, |least| least.min(found)));
        let required = self.task.promises.required_margin.max(self.settings.smallest_margin);
        if !(found > 0.0 && found >= required - MARGIN_TOLERANCE) {
            let message =
                format!("hand \"{}\" holds by itself with margin {found:.6}, {required:.6} is required", hand.name);
            let violation = Violation::new(Kind::ClosureLost, message).when(at);
            log.push(violation.subjects([hand.name.as_str()]).amount(found, required));
        }
    }
}

/// True when two lists have the same fingers at the same contacts.
pub fn are_same(a: &[RobotContact], b: &[RobotContact], tolerance: f64) -> bool {
    let near = |p: &[f64; 3], q: &[f64; 3]| (Vector::from(*p) - Vector::from(*q)).norm() <= tolerance;
    let is_in = |one: &RobotContact| {
        b.iter().any(|other| {
            one.finger == other.finger
                && near(&one.point_in_object, &other.point_in_object)
                && near(&one.normal_in_object, &other.normal_in_object)
        })
    };
    a.len() == b.len() && a.iter().all(is_in)
}
