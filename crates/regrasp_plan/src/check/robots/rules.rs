//! What can be judged of a plan of a whole robot without distances.
//!
//! - Form: every vector has the length of its names, every number is finite, `held_by` names what the query says, and says it for every
//!   object in every segment.
//! - The plan starts and ends where it was asked to. Segments meet.
//! - Times rise. Velocities are zero at both ends of every segment.
//! - At every moment every joint, those that follow others too, is within its limits, and no faster than promised and allowed. Every
//!   independent joint accelerates no more than promised.
//! - Promises are no looser than robot and scene.
//! - A carried object goes with its hand. No joint of that hand moves while it holds.

use crate::check::robots::motion::RobotStep;
use crate::check::robots::question::Question;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Level, Log};
use crate::robot_plan::{RobotPlan, RobotSegmentKind, RobotWaypoint};
use regrasp_geometry::Pose;
use regrasp_scene::{MotionGoal, MotionQuery, Scene};

/// Speeds and accelerations may be this much above their limits, relatively: rounding of times.
pub const ROUNDING: f64 = 1e-6;

/// Distance and angle between two poses.
pub fn difference(a: &Pose, b: &Pose) -> (f64, f64) {
    let (p, q) = (a.rotation.coords, b.rotation.coords);
    let q = if p.dot(&q) < 0.0 { -q } else { q };
    ((a.translation.vector - b.translation.vector).norm(), 4.0 * (p - q).norm().atan2((p + q).norm()))
}

/// Lengths of vectors, finite numbers, kinds of segments. False where nothing else can be judged.
pub fn check_form(question: &Question, plan: &RobotPlan, log: &mut Log) -> bool {
    let n_joints = question.joint_names.len();
    let promises = &plan.promises;
    let mut faults: Vec<(Kind, String, Option<Moment>)> = Vec::new();
    if promises.joint_velocities.len() != n_joints || promises.joint_accelerations.len() != n_joints {
        faults.push((Kind::WrongScene, "promises have not one limit for every joint".into(), None));
    }
    if !plan.numbers().all(f64::is_finite) {
        faults.push((Kind::NotANumber, "the plan holds a number that is not finite".into(), None));
    }
    if plan.segments.is_empty() {
        faults.push((Kind::EmptySegment, "the plan has no segment".into(), None));
    }
    for (s, segment) in plan.segments.iter().enumerate() {
        if segment.waypoints.len() < 2 {
            let at = Some(Moment::at(s, 0));
            faults.push((Kind::EmptySegment, "the segment has fewer than two waypoints".into(), at));
        }
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let lengths = [waypoint.joints.len(), waypoint.joint_velocities.len(), waypoint.world_from_objects.len()];
            let at = Some(Moment::at(s, w));
            if lengths != [n_joints, n_joints, plan.objects.len()] {
                faults.push((Kind::WrongScene, "vectors do not fit the names of joints and objects".into(), at));
            }
            let is_unit = |pose: &crate::plan::PoseData| {
                (pose.quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() <= 1e-9
            };
            if !waypoint.world_from_objects.iter().all(is_unit) {
                faults.push((Kind::NotANumber, "the rotation of an object is not of length one".into(), at));
            }
        }
    }
    let is_sound = faults.is_empty();
    for (kind, message, at) in faults {
        let violation = Violation::new(kind, message);
        log.push(at.into_iter().fold(violation, Violation::when));
    }
    is_sound
}

/// Who holds what, and what kind of segment that makes.
pub fn check_holders(question: &Question, plan: &RobotPlan, scene: &Scene, log: &mut Log) {
    for (s, segment) in plan.segments.iter().enumerate() {
        let at = Moment::at(s, 0);
        let expected_kind =
            if question.carried.is_empty() { RobotSegmentKind::Transit } else { RobotSegmentKind::Carry };
        if segment.kind != expected_kind {
            let message = "the segment's kind does not say whether the robot holds something";
            log.push(Violation::new(Kind::WrongHolder, message).when(at));
        }
        let named = segment.held_by.keys().filter(|name| !plan.objects.contains(name));
        for name in named {
            let message = format!("somebody holds \"{name}\", which the plan does not move");
            log.push(Violation::new(Kind::WrongHolder, message).when(at).subjects([name.as_str()]));
        }
        for carried in &question.carried {
            let name = &plan.objects[carried.in_plan];
            let holders = segment.held_by.get(name).map_or(&[][..], Vec::as_slice);
            if holders != [carried.holder.clone()] {
                let message = format!(
                    "the plan says that \"{name}\" is held by [{}]; \"{}\" carries it",
                    holders.join(", "),
                    carried.holder
                );
                log.push(Violation::new(Kind::WrongHolder, message).when(at).subjects([name.as_str()]));
            }
        }
        let touching = segment.waypoints.iter().position(|waypoint| !waypoint.contacts.is_empty());
        if let Some(w) = touching {
            let message = "contacts are not judged in a motion; a plan of this task has none";
            log.push(Violation::new(Kind::WrongContactMode, message).when(Moment::at(s, w)));
        }
    }
    for hand in &plan.hands {
        let fingers = scene.hand_named(&hand.name).map(|index| {
            scene.hands[index].hand.fingers.iter().map(|finger| finger.name.clone()).collect::<Vec<String>>()
        });
        let is_holder = question.carried.iter().any(|carried| carried.holder == hand.name);
        if !is_holder || fingers.unwrap_or_default() != hand.fingers {
            let message = format!("the plan names hand \"{}\", which holds nothing or has other fingers", hand.name);
            log.push(Violation::new(Kind::WrongScene, message).subjects([hand.name.as_str()]));
        }
    }
    if let Some(carried) = question.carried.iter().find(|c| plan.hands.iter().all(|hand| hand.name != c.holder)) {
        let message = format!("\"hands\" lacks \"{}\", which holds an object", carried.holder);
        log.push(Violation::new(Kind::WrongScene, message).subjects([carried.holder.as_str()]));
    }
}

/// Start and goal, as the query asks for them.
pub fn check_ends(question: &Question, query: &MotionQuery, plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let (Some(first), Some(last)) = (plan.waypoints().next(), plan.waypoints().next_back()) else { return };
    let last_segment = plan.segments.len() - 1;
    let end = Moment::at(last_segment, plan.segments[last_segment].waypoints.len() - 1);
    let tolerance = settings.pose_tolerance;
    let mut joints = |kind: Kind, waypoint: &RobotWaypoint, asked: &[f64], is_open: &[bool], at: Moment| {
        for (k, name) in question.joint_names.iter().enumerate().filter(|(k, _)| !is_open[*k]) {
            let off = (waypoint.joints[k] - asked[k]).abs();
            if !(off <= tolerance) {
                let message = format!("joint \"{name}\" is {off:.3e} away from where it was asked to be");
                log.push(Violation::new(kind, message).when(at).subjects([name.as_str()]).amount(off, tolerance));
            }
        }
    };
    let none_open = vec![false; question.joint_names.len()];
    joints(Kind::StartMismatch, first, &query.start, &none_open, Moment::at(0, 0));
    match &query.goal {
        MotionGoal::Joints(asked) => joints(Kind::GoalMismatch, last, asked, &none_open, end),
        MotionGoal::Wrists(wrists) => {
            // Joints that move none of the wrists end where the robot started.
            let mut is_open = none_open.clone();
            for wrist in wrists {
                let (body, _) = *question.tree.link(question.robot.arms[wrist.arm].mount);
                let drives = question.tree.chain(body).into_iter().filter_map(|body| question.tree.body(body));
                drives.flat_map(|body| &body.drive.terms).for_each(|&(k, _)| is_open[k] = true);
            }
            joints(Kind::GoalMismatch, last, &query.start, &is_open, end);
            for wrist in wrists {
                let arm = &question.robot.arms[wrist.arm];
                let reached = question.tree.world_from_link(arm.mount, &last.joints);
                let (distance, angle) = difference(&reached, &wrist.world_from_mount);
                if !(distance <= tolerance && angle <= tolerance) {
                    let message = format!(
                        "the wrist of arm \"{}\" is {distance:.3e} m and {angle:.3e} rad away from its goal",
                        arm.name
                    );
                    let violation = Violation::new(Kind::GoalMismatch, message).when(end);
                    log.push(violation.subjects([arm.name.as_str()]).amount(distance.max(angle), tolerance));
                }
            }
        }
    }
    for asked in &query.carried {
        let Some(carried) = question.carried.iter().find(|carried| carried.object == asked.object) else { continue };
        let (distance, angle) =
            difference(&Pose::from(&first.world_from_objects[carried.in_plan]), &asked.world_from_object);
        if !(distance <= tolerance && angle <= tolerance) {
            let name = &plan.objects[carried.in_plan];
            let message =
                format!("object \"{name}\" starts {distance:.3e} m and {angle:.3e} rad away from where it is");
            let violation = Violation::new(Kind::StartMismatch, message).when(Moment::at(0, 0));
            log.push(violation.subjects([name.as_str()]).amount(distance.max(angle), tolerance));
        }
    }
}

/// Segments begin where the ones before end; velocities are zero there; times rise.
pub fn check_meeting(question: &Question, plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    for (s, pair) in plan.segments.windows(2).enumerate() {
        let (Some(end), Some(begin)) = (pair[0].waypoints.last(), pair[1].waypoints.first()) else { continue };
        let at = Moment::at(s + 1, 0);
        let joints = end.joints.iter().zip(&begin.joints).map(|(a, b)| (a - b).abs());
        let objects = end.world_from_objects.iter().zip(&begin.world_from_objects).map(|(a, b)| {
            let (distance, angle) = difference(&Pose::from(a), &Pose::from(b));
            distance.max(angle)
        });
        let off = joints.chain(objects).fold(0.0, f64::max);
        if !(off <= settings.meeting_tolerance) {
            let message = format!("the segment begins {off:.3e} away from where the one before ends");
            let violation = Violation::new(Kind::SegmentsDoNotMeet, message).when(at);
            log.push(violation.amount(off, settings.meeting_tolerance));
        }
        if !(begin.time >= end.time) {
            let message = format!("the segment begins {:.3e} s before the one before ends", end.time - begin.time);
            log.push(Violation::new(Kind::TimeOrder, message).when(at));
        }
    }
    for (s, segment) in plan.segments.iter().enumerate() {
        let ends = [0, segment.waypoints.len() - 1];
        for w in ends {
            for (k, name) in question.joint_names.iter().enumerate() {
                let velocity = segment.waypoints[w].joint_velocities[k].abs();
                if !(velocity <= settings.velocity_tolerance) {
                    let message = format!("joint \"{name}\" moves with {velocity:.3e} at the end of a segment");
                    let violation = Violation::new(Kind::VelocityInconsistent, message).when(Moment::at(s, w));
                    log.push(violation.subjects([name.as_str()]).amount(velocity, settings.velocity_tolerance));
                }
            }
        }
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let span = pair[1].time - pair[0].time;
            if !(span > 0.0) {
                let message = format!("the next waypoint is passed {:.3e} s before this one", -span);
                log.push(Violation::new(Kind::TimeOrder, message).when(Moment::at(s, w)).amount(span, 0.0));
            }
        }
    }
}

/// The first step or position beyond all sense, in words: motion between waypoints is then not judged.
pub fn leap(question: &Question, plan: &RobotPlan, settings: &CheckSettings) -> Option<String> {
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let step = RobotStep::new(&pair[0], &pair[1]);
            for row in &question.tree.rows {
                let followed = if row.slides { settings.followed_slide } else { settings.followed_turn };
                let cubic = step.of_drive(&row.drive);
                let largest = cubic.change.abs().max(cubic.first.abs()).max(cubic.last.abs());
                let [low, high] = cubic.range().map(|change| step.start_of(&row.drive) + change);
                let beyond = row.limits.map_or(0.0, |[lower, upper]| (lower - low).max(high - upper));
                if !(largest <= followed && beyond <= followed) {
                    return Some(format!(
                        "segment {s}, waypoint {w}: joint \"{}\" moves {largest:.1e} in one step, or is far beyond its limits",
                        row.name
                    ));
                }
            }
        }
    }
    None
}

/// Limits, speeds and accelerations of all joints at every moment.
pub fn check_joints(question: &Question, plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let promises = &plan.promises;
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let at = Moment::at(s, w);
            let step = RobotStep::new(&pair[0], &pair[1]);
            for row in &question.tree.rows {
                let cubic = step.of_drive(&row.drive);
                let start = step.start_of(&row.drive);
                let [low, high] = cubic.range().map(|change| start + change);
                let [lower, upper] = row.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                let beyond = (lower - low).max(high - upper);
                if !(beyond <= settings.limit_tolerance) {
                    let message = format!("joint \"{}\" goes {beyond:.3e} beyond its limits", row.name);
                    let violation = Violation::new(Kind::JointLimit, message).when(at);
                    log.push(violation.subjects([row.name.as_str()]).amount(beyond, settings.limit_tolerance));
                }
                if !(step.span > 0.0) {
                    continue;
                }
                let terms = row.drive.terms.iter();
                let promised: f64 = terms.map(|&(k, factor)| promises.joint_velocities[k] * factor.abs()).sum();
                let limit = row.velocity.map_or(promised, |limit| limit.min(promised));
                let speed = cubic.largest_slope() / step.span;
                if !(speed <= limit * (1.0 + ROUNDING)) {
                    let message = format!("joint \"{}\" goes {speed:.4} per second, {limit:.4} is allowed", row.name);
                    let violation = Violation::new(Kind::JointTooFast, message).when(at);
                    log.push(violation.subjects([row.name.as_str()]).amount(speed, limit));
                }
            }
            for (k, name) in question.joint_names.iter().enumerate().filter(|_| step.span > 0.0) {
                let limit = promises.joint_accelerations[k];
                let acceleration = step.cubic(k).largest_bend() / (step.span * step.span);
                // An end's acceleration changes with its velocity by four over the time, with the other's by two.
                if !(acceleration <= limit * (1.0 + ROUNDING) + 6.0 * settings.velocity_tolerance / step.span) {
                    let message = format!("joint \"{name}\" accelerates with {acceleration:.3}, {limit:.3} is allowed");
                    let violation = Violation::new(Kind::JointAcceleration, message).when(at);
                    log.push(violation.subjects([name.as_str()]).amount(acceleration, limit));
                }
            }
        }
    }
}

/// Promises against robot and scene.
pub fn check_promises(question: &Question, scene: &Scene, plan: &RobotPlan, log: &mut Log) {
    let promises = &plan.promises;
    for (k, name) in question.joint_names.iter().enumerate() {
        let row = question.tree.rows.iter().find(|row| !row.follows && row.drive.single() == Some(k));
        let of_robot = row.and_then(|row| row.velocity);
        let velocity = of_robot.unwrap_or(scene.limits.joint_velocity);
        let of_file = question.robot.layout.coordinates.get(k).and_then(|coordinate| coordinate.acceleration);
        let acceleration = of_file.unwrap_or(scene.limits.joint_acceleration);
        let limits = [
            ("joint_velocities", promises.joint_velocities[k], velocity),
            ("joint_accelerations", promises.joint_accelerations[k], acceleration),
        ];
        for (which, promised, limit) in limits {
            if !(promised > 0.0) {
                let message = format!("the limit of joint \"{name}\" in {which} is not above zero");
                log.push(Violation::new(Kind::PromiseBroken, message).subjects([which, name.as_str()]));
            }
            if !(promised <= limit * (1.0 + ROUNDING)) {
                let message = format!("joint \"{name}\" is promised {promised} in {which}, {limit} is allowed");
                let violation = Violation::new(Kind::LimitExceeded, message).from_level(Level::Motion);
                log.push(violation.subjects([which, name.as_str()]).amount(promised, limit));
            }
        }
    }
    if !(promises.clearance >= 0.0) {
        log.push(Violation::new(Kind::PromiseBroken, "the clearance promised is below zero").subjects(["clearance"]));
    }
}

/// Carried objects go with their hands; joints of what holds rest.
pub fn check_carried(question: &Question, plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let tolerance = settings.meeting_tolerance;
    let mut holding: Vec<(usize, &str)> = Vec::new();
    for carried in &question.carried {
        let own = question.tree.chain(question.tree.link(carried.link).0);
        let above: Vec<usize> = own.iter().filter_map(|body| question.tree.body(*body)).flat_map(terms_of).collect();
        for link in (0..question.robot.robot.links.len()).map(regrasp_robot::LinkId) {
            if carried.is_held_by(question.robot, link) {
                let (body, _) = *question.tree.link(link);
                let chain = question.tree.chain(body).into_iter().filter(|body| !own.contains(body));
                let moved = chain.filter_map(|body| question.tree.body(body)).flat_map(terms_of);
                holding.extend(moved.filter(|k| !above.contains(k)).map(|k| (k, carried.holder.as_str())));
            }
        }
    }
    holding.sort_unstable();
    holding.dedup();
    let (mut frames, mut axes) = (Vec::new(), Vec::new());
    let Some(start) = plan.waypoints().next() else { return };
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let at = Moment::at(s, w);
            question.tree.frames(&waypoint.joints, &mut frames, &mut axes);
            for carried in &question.carried {
                let expected = frames[carried.body].then(&carried.body_from_object).pose();
                let stated = Pose::from(&waypoint.world_from_objects[carried.in_plan]);
                let (distance, angle) = difference(&stated, &expected);
                if !(distance <= tolerance && angle <= tolerance) {
                    let name = &plan.objects[carried.in_plan];
                    let message = format!(
                        "object \"{name}\" is {distance:.3e} m and {angle:.3e} rad away from where \"{}\" carries it",
                        carried.holder
                    );
                    let violation = Violation::new(Kind::GraspChanges, message).when(at);
                    log.push(violation.subjects([name.as_str()]).amount(distance.max(angle), tolerance));
                }
            }
            for &(k, holder) in &holding {
                let off = (waypoint.joints[k] - start.joints[k]).abs().max(waypoint.joint_velocities[k].abs());
                if !(off <= tolerance) {
                    let name = &question.joint_names[k];
                    let message = format!("joint \"{name}\" moves while \"{holder}\" holds an object");
                    let violation = Violation::new(Kind::GraspChanges, message).when(at);
                    log.push(violation.subjects([name.as_str(), holder]).amount(off, tolerance));
                }
            }
        }
    }
}

/// Coordinates that drive a body's joint.
pub fn terms_of(body: &crate::check::robots::tree::Body) -> impl Iterator<Item = usize> + '_ {
    body.drive.terms.iter().map(|(k, _)| *k)
}
