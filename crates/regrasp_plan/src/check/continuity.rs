//! What can be judged from the waypoints alone: names, numbers, start and goal, meeting of segments, limits, jumps, and
//! which finger may change what.

use crate::check::between::Between;
use crate::check::model::CheckedHand;
use crate::check::pose::pose_difference;
use crate::check::roles::{contacts_agree, moving_finger};
use crate::check::tracking;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, ContactState, FORMAT, FORMAT_VERSION, Plan, PoseData, Segment, SegmentKind, Waypoint};
use regrasp_geometry::Vector;
use regrasp_scene::Query;
use regrasp_scene::query::TRACKING;
use std::collections::BTreeMap;

/// Tasks that there are.
const TASKS: [&str; 2] = ["in_hand", "tracking"];

/// How far a joint that stands still may be from where the scene has it, in radians or metres: rounding.
const STANDS_STILL: f64 = 1e-12;

/// Names, vector lengths and numbers. When this finds something, nothing else can be judged.
pub fn check_form(model: &CheckedHand, plan: &Plan, log: &mut Log) {
    if plan.format != FORMAT || plan.format_version != FORMAT_VERSION || !TASKS.contains(&plan.task.as_str()) {
        let message = format!(
            "format \"{}\" version {} task \"{}\" is not \"{FORMAT}\" {FORMAT_VERSION} {TASKS:?}",
            plan.format, plan.format_version, plan.task
        );
        log.push(Violation::new(Kind::WrongScene, message));
    }
    let is_tracking = plan.promises.tracking.is_some();
    if is_tracking != (plan.task == TRACKING) {
        let message =
            format!("promises {} tracking in a task \"{}\"", if is_tracking { "of" } else { "without" }, plan.task);
        log.push(Violation::new(Kind::WrongScene, message));
    }
    if let Some(s) = plan.segments.iter().position(|segment| segment.kind == SegmentKind::Tracking && !is_tracking) {
        let message = format!("tracking in a task \"{}\"", plan.task);
        log.push(Violation::new(Kind::WrongScene, message).when(Moment::at(s, 0)));
    }
    let fingers: Vec<&str> = model.fingers.iter().map(|finger| finger.name.as_str()).collect();
    if plan.joint_names != model.joint_names {
        let message = format!("the plan's joints are {:?}, the scene's {:?}", plan.joint_names, model.joint_names);
        log.push(Violation::new(Kind::WrongScene, message));
    }
    if !same_positions(&plan.held_joints, &model.held_joints) {
        let message = format!(
            "the plan's joints that stand still are {:?}, the scene's {:?}",
            plan.held_joints, model.held_joints
        );
        log.push(Violation::new(Kind::WrongScene, message));
    }
    if plan.fingers != fingers {
        let message = format!("the plan's fingers are {:?}, the scene's {fingers:?}", plan.fingers);
        log.push(Violation::new(Kind::WrongScene, message));
    }
    if plan.segments.is_empty() {
        log.push(Violation::new(Kind::EmptySegment, "the plan has no segment"));
    }
    for (name, pose) in [("start", &plan.start), ("goal", &plan.goal)] {
        if !is_pose(pose) {
            log.push(Violation::new(Kind::NotANumber, format!("the {name} pose is not a pose")).subjects([name]));
        }
    }
    for (i, _) in plan.way_poses.iter().enumerate().filter(|(_, pose)| !is_pose(&pose.world_from_object)) {
        log.push(Violation::new(Kind::NotANumber, format!("way pose {i} is not a pose")));
    }
    if !plan.promises.numbers().all(f64::is_finite) {
        log.push(Violation::new(Kind::NotANumber, "a promise is not a number"));
    }
    let n_joints = plan.joint_names.len();
    let motion = &plan.promises.motion;
    let n_torques = plan.promises.forces.as_ref().map_or(n_joints, |forces| forces.joint_torques.len());
    if [motion.joint_velocities.len(), motion.joint_accelerations.len(), n_torques] != [n_joints; 3] {
        log.push(Violation::new(Kind::WrongScene, format!("promises for other than {n_joints} joints")));
    }
    for (s, segment) in plan.segments.iter().enumerate() {
        if segment.waypoints.len() < 2 {
            let message = format!("the segment has {} waypoints, at least 2 make a motion", segment.waypoints.len());
            log.push(Violation::new(Kind::EmptySegment, message).when(Moment::at(s, 0)));
        }
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            check_waypoint_form(plan, waypoint, Moment::at(s, w), log);
        }
    }
}

/// True if both have the same joints at the same positions.
pub fn same_positions(a: &BTreeMap<String, f64>, b: &BTreeMap<String, f64>) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() <= STANDS_STILL)
}

fn check_waypoint_form(plan: &Plan, waypoint: &Waypoint, at: Moment, log: &mut Log) {
    if waypoint.joints.len() != plan.joint_names.len() || waypoint.contacts.len() != plan.fingers.len() {
        let message = format!(
            "{} joints and {} contacts, but {} joint names and {} fingers",
            waypoint.joints.len(),
            waypoint.contacts.len(),
            plan.joint_names.len(),
            plan.fingers.len()
        );
        log.push(Violation::new(Kind::WrongScene, message).when(at));
    }
    let n_torques = waypoint.joint_torques.len();
    if waypoint.joint_velocities.len() != plan.joint_names.len()
        || (n_torques != 0 && n_torques != plan.joint_names.len())
    {
        let message = format!(
            "{} velocities and {n_torques} torques, but {} joint names",
            waypoint.joint_velocities.len(),
            plan.joint_names.len()
        );
        log.push(Violation::new(Kind::WrongScene, message).when(at));
    }
    if !waypoint.numbers().all(f64::is_finite) || !is_pose(&waypoint.world_from_object) {
        log.push(Violation::new(Kind::NotANumber, "what is not a number, or an object pose that is none").when(at));
    }
    for (finger, contact) in plan.fingers.iter().zip(&waypoint.contacts) {
        let complete = match contact.mode {
            ContactMode::Free => *contact == ContactState::FREE,
            _ => match (contact.point_in_object, contact.normal_in_object) {
                (Some(_), Some(normal)) => (Vector::from(normal).norm() - 1.0).abs() < 1e-9,
                _ => false,
            },
        };
        if !complete {
            let message = format!("the contact of finger \"{finger}\" is not one: {contact:?}");
            log.push(Violation::new(Kind::NotANumber, message).when(at).subjects([finger.as_str()]));
        }
    }
}

fn is_pose(pose: &PoseData) -> bool {
    let length = pose.quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
    pose.position.iter().all(|x| x.is_finite()) && (length - 1.0).abs() < 1e-9
}

fn poses_agree(a: &PoseData, b: &PoseData, tolerance: f64) -> bool {
    let (distance, angle) = pose_difference(a, b);
    distance <= tolerance && angle <= tolerance
}

/// Start and goal: the plan against the query, and the first and last waypoint against the plan's own header.
pub fn check_ends(query: Option<&Query>, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    let Some((first, last)) = ends(plan) else { return };
    if let Some(query) = query
        && plan.task != query.task()
    {
        let message = format!("the plan's task is \"{}\", the scene's \"{}\"", plan.task, query.task());
        log.push(Violation::new(Kind::WrongScene, message));
    }
    let last_moment = Moment::at(plan.segments.len() - 1, plan.segments.last().map_or(0, |s| s.waypoints.len() - 1));
    let goal_tolerance = plan.promises.tracking.as_ref().map(|tracking| tracking.goal_tolerance);
    let sides = [
        (Kind::StartMismatch, "start", &plan.start, first, Moment::at(0, 0)),
        (Kind::GoalMismatch, "goal", &plan.goal, last, last_moment),
    ];
    for (kind, name, asked, waypoint, at) in sides {
        // The goal of tracking is an orientation.
        let within = goal_tolerance.filter(|_| kind == Kind::GoalMismatch);
        let (distance, angle) = pose_difference(asked, &waypoint.world_from_object);
        if let Some(limit) = within {
            if angle > limit.min(settings.largest_goal_tolerance) {
                let message = format!("the object is {angle:.4} rad from the {name} asked for");
                let violation = Violation::new(kind, message).when(at).subjects(["object"]);
                log.push(violation.amount(angle, limit));
            }
        } else if distance > settings.pose_tolerance || angle > settings.pose_tolerance {
            let message = format!("the object is {distance:.3e} m and {angle:.3e} rad from the {name} asked for");
            let violation = Violation::new(kind, message).when(at).subjects(["object"]);
            log.push(violation.amount(distance.max(angle), settings.pose_tolerance));
        }
        let Some(query) = query else { continue };
        let pose = match kind {
            Kind::StartMismatch => query.start(),
            _ => query.goal(),
        };
        let (distance, angle) = pose_difference(&PoseData::from(pose), asked);
        let distance = if within.is_some() { 0.0 } else { distance };
        if distance > settings.pose_tolerance || angle > settings.pose_tolerance {
            let message = format!("the plan's {name} is {distance:.3e} m and {angle:.3e} rad from the scene's");
            let violation = Violation::new(kind, message).subjects(["object"]);
            log.push(violation.amount(distance.max(angle), settings.pose_tolerance));
        }
    }
}

fn ends(plan: &Plan) -> Option<(&Waypoint, &Waypoint)> {
    Some((plan.segments.first()?.waypoints.first()?, plan.segments.last()?.waypoints.last()?))
}

/// Every segment begins where the one before ends.
pub fn check_meeting(plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    for (s, pair) in plan.segments.windows(2).enumerate() {
        let (Some(end), Some(begin)) = (pair[0].waypoints.last(), pair[1].waypoints.first()) else { continue };
        let joints = end.joints.iter().zip(&begin.joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let (distance, angle) = pose_difference(&end.world_from_object, &begin.world_from_object);
        let gap = joints.max(distance).max(angle);
        let contacts_meet =
            end.contacts.iter().zip(&begin.contacts).all(|(a, b)| contacts_agree(a, b, settings.meeting_tolerance));
        if gap > settings.meeting_tolerance || !contacts_meet {
            let message = format!(
                "begins where segment {s} does not end: joints {joints:.3e}, object {distance:.3e} m and {angle:.3e} rad, contacts {}",
                if contacts_meet { "the same" } else { "others" }
            );
            let violation = Violation::new(Kind::SegmentsDoNotMeet, message).when(Moment::at(s + 1, 0));
            log.push(violation.amount(gap, settings.meeting_tolerance));
        }
    }
}

/// Limits at every waypoint and between, and steps that are jumps.
pub fn check_joints(model: &CheckedHand, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            for row in &model.limits {
                let position = row.drive.position(&waypoint.joints);
                let beyond = (row.lower - position).max(position - row.upper);
                if beyond > settings.limit_tolerance {
                    let message = format!(
                        "joint \"{}\" is at {position:.6}, {beyond:.3e} beyond [{:.6}, {:.6}]",
                        row.name, row.lower, row.upper
                    );
                    let violation = Violation::new(Kind::JointLimit, message).when(Moment::at(s, w));
                    log.push(violation.subjects([row.name.as_str()]).amount(beyond, settings.limit_tolerance));
                }
            }
        }
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let at = Moment::at(s, w);
            check_limits_between(model, &pair[0], &pair[1], at, settings, log);
            for (k, name) in model.joint_names.iter().enumerate() {
                let step = (pair[1].joints[k] - pair[0].joints[k]).abs();
                let limit = if model.slides[k] { settings.largest_slide } else { settings.largest_turn };
                if step > limit {
                    let message = format!("joint \"{name}\" moves {step:.4} in one step");
                    log.push(
                        Violation::new(Kind::JointJump, message).when(at).subjects([name.as_str()]).amount(step, limit),
                    );
                }
            }
            let (distance, angle) = pose_difference(&pair[0].world_from_object, &pair[1].world_from_object);
            if distance > settings.largest_slide || angle > settings.largest_turn {
                let message = format!("the object moves {distance:.4} m and {angle:.4} rad in one step");
                let violation = Violation::new(Kind::JointJump, message).when(at).subjects(["object"]);
                log.push(violation.amount(distance.max(angle), settings.largest_turn));
            }
        }
    }
}

/// Limits where the cubic of a joint goes beyond its two waypoints.
fn check_limits_between(
    model: &CheckedHand,
    from: &Waypoint,
    to: &Waypoint,
    at: Moment,
    settings: &CheckSettings,
    log: &mut Log,
) {
    let motion = Between::new(from, to);
    for row in &model.limits {
        let (start, way) = (row.drive.position(&from.joints), row.drive.motion(&motion));
        let ends = [start, start + way.change];
        let range = way.range().map(|way| start + way);
        let beyond = |[a, b]: [f64; 2]| (row.lower - a.min(b)).max(a.max(b) - row.upper);
        if beyond(range) > settings.limit_tolerance && beyond(ends) <= settings.limit_tolerance {
            let message = format!(
                "joint \"{}\" goes {:.3e} beyond [{:.6}, {:.6}] between two waypoints",
                row.name,
                beyond(range),
                row.lower,
                row.upper
            );
            let violation = Violation::new(Kind::JointLimit, message).when(at).subjects([row.name.as_str()]);
            log.push(violation.amount(beyond(range), settings.limit_tolerance));
        }
    }
}

/// Who may change what: in a transfer every finger keeps its contact, or rolls all along, or stays free; in a regrasp only
/// the moving finger changes, and none rolls.
pub fn check_roles(model: &CheckedHand, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    for (s, segment) in plan.segments.iter().enumerate() {
        match segment.kind {
            SegmentKind::Transfer => {
                check_tracking_names_absent(segment, s, log);
                if segment.moving_finger.is_some() {
                    let message = "a transfer names a moving finger";
                    log.push(Violation::new(Kind::WrongMovingFinger, message).when(Moment::at(s, 0)));
                }
                for finger in 0..model.fingers.len() {
                    check_constant(model, segment, s, finger, settings, log);
                    check_may_roll(model, segment, s, finger, log);
                }
            }
            SegmentKind::Regrasp => {
                check_tracking_names_absent(segment, s, log);
                check_regrasp_roles(model, segment, s, settings, log);
            }
            SegmentKind::Tracking => {
                tracking::check_tracking_roles(model, segment, s, settings, log);
                let others = (0..model.fingers.len()).filter(|&f| !tracking::may_move(model, segment, f));
                others.for_each(|f| check_rests(model, segment, s, f, settings, log));
            }
        }
        tracking::check_present(model, segment, s, log);
    }
}

fn check_tracking_names_absent(segment: &Segment, s: usize, log: &mut Log) {
    if !segment.also_moving.is_empty() {
        let message = "other moving fingers are named outside tracking";
        log.push(Violation::new(Kind::WrongMovingFinger, message).when(Moment::at(s, 0)));
    }
    if segment.rolling_finger.is_some() {
        let message = "a rolling finger is named outside tracking";
        log.push(Violation::new(Kind::WrongRollingFinger, message).when(Moment::at(s, 0)));
    }
}

/// The joints of finger `f` stay where they are all through the segment.
fn check_rests(model: &CheckedHand, segment: &Segment, s: usize, f: usize, settings: &CheckSettings, log: &mut Log) {
    let (finger, first) = (&model.fingers[f], &segment.waypoints[0]);
    for (w, waypoint) in segment.waypoints.iter().enumerate() {
        let moved = finger.coordinates.clone().map(|k| (waypoint.joints[k] - first.joints[k]).abs());
        let moved = moved.fold(0.0, f64::max);
        if moved > settings.meeting_tolerance {
            let message = format!("finger \"{}\" moves {moved:.3e}, but is no moving finger", finger.name);
            let violation = Violation::new(Kind::WrongMovingFinger, message).when(Moment::at(s, w));
            let violation = violation.subjects([finger.name.as_str()]);
            log.push(violation.amount(moved, settings.meeting_tolerance));
            break;
        }
    }
}

fn check_regrasp_roles(model: &CheckedHand, segment: &Segment, s: usize, settings: &CheckSettings, log: &mut Log) {
    let first = &segment.waypoints[0];
    let last_index = segment.waypoints.len() - 1;
    let moving = moving_finger(model, segment);
    if moving.is_none() {
        let message = format!("moving finger {:?} is none of the hand's", segment.moving_finger);
        log.push(Violation::new(Kind::WrongMovingFinger, message).when(Moment::at(s, 0)));
    }
    for (w, waypoint) in segment.waypoints.iter().enumerate() {
        if !poses_agree(&first.world_from_object, &waypoint.world_from_object, settings.meeting_tolerance) {
            let (distance, angle) = pose_difference(&first.world_from_object, &waypoint.world_from_object);
            let message = format!("the object has moved {distance:.3e} m and {angle:.3e} rad since the regrasp began");
            let violation = Violation::new(Kind::ObjectMovesInRegrasp, message).when(Moment::at(s, w));
            log.push(violation.subjects(["object"]).amount(distance.max(angle), settings.meeting_tolerance));
        }
    }
    for (f, finger) in model.fingers.iter().enumerate() {
        check_may_roll(model, segment, s, f, log);
        if Some(f) != moving {
            check_constant(model, segment, s, f, settings, log);
            check_rests(model, segment, s, f, settings, log);
            continue;
        }
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            // At its ends it holds or is free, as what comes before and after says.
            let is_end = w == 0 || w == last_index;
            if !is_end && !is_free(&waypoint.contacts[f]) {
                let message = format!("moving finger \"{}\" holds on its way, but must be free", finger.name);
                let violation = Violation::new(Kind::WrongContactMode, message).when(Moment::at(s, w));
                log.push(violation.subjects([finger.name.as_str()]));
            }
        }
    }
}

/// Only balls roll, and only while the object moves.
fn check_may_roll(model: &CheckedHand, segment: &Segment, s: usize, f: usize, log: &mut Log) {
    let finger = &model.fingers[f];
    let rolls = |waypoint: &Waypoint| waypoint.contacts[f].mode == ContactMode::Rolling;
    let Some(w) = segment.waypoints.iter().position(rolls) else { return };
    let why = match segment.kind {
        SegmentKind::Regrasp => "the object rests",
        _ if finger.radius > 0.0 => return,
        _ => "its tip is sharp",
    };
    let message = format!("finger \"{}\" rolls, but {why}", finger.name);
    let violation = Violation::new(Kind::WrongContactMode, message).when(Moment::at(s, w));
    log.push(violation.subjects([finger.name.as_str()]));
}

/// Finger `f` holds the same contact all through the segment, or rolls all through it, or is free all through it.
fn check_constant(model: &CheckedHand, segment: &Segment, s: usize, f: usize, settings: &CheckSettings, log: &mut Log) {
    let name = model.fingers[f].name.as_str();
    let first = &segment.waypoints[0].contacts[f];
    for (w, waypoint) in segment.waypoints.iter().enumerate() {
        let contact = &waypoint.contacts[f];
        if !matches!(contact.mode, ContactMode::Fixed | ContactMode::Rolling | ContactMode::Free) {
            let message = format!("finger \"{name}\" is {:?}, which is for tracking only", contact.mode);
            log.push(Violation::new(Kind::WrongContactMode, message).when(Moment::at(s, w)).subjects([name]));
        } else if contact.mode != first.mode {
            let (was, is) = (mode_in_words(first.mode), mode_in_words(contact.mode));
            let message = format!("finger \"{name}\" {was} when the segment begins, but {is} here");
            log.push(Violation::new(Kind::WrongContactMode, message).when(Moment::at(s, w)).subjects([name]));
        } else if first.mode == ContactMode::Rolling {
            // Where it rolls to is judged by how.
        } else if !contacts_agree(first, contact, settings.meeting_tolerance) {
            let message = format!("the contact of finger \"{name}\" is not the one with which the segment began");
            log.push(Violation::new(Kind::GraspChanges, message).when(Moment::at(s, w)).subjects([name]));
        }
    }
}

fn mode_in_words(mode: ContactMode) -> &'static str {
    match mode {
        ContactMode::Fixed => "holds",
        ContactMode::Rolling | ContactMode::PureRolling => "rolls",
        ContactMode::Twisting => "twists",
        ContactMode::PureSliding | ContactMode::Sliding => "slides",
        ContactMode::Free => "is free",
    }
}

fn is_free(contact: &ContactState) -> bool {
    contact.mode == ContactMode::Free
}
