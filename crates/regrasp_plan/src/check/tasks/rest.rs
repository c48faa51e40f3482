//! What may not move. An object at rest stays where it is. A held object goes with every hand that holds it, and no joint of such a hand
//! moves. While an object rests, nothing moves that holds it. In a `grasp` or `release` nothing moves but the fingers of one hand, in a
//! `transfer` or `regrasp` nothing but the object and the fingers of the hand that holds it.

use crate::check::robots::rules::difference;
use crate::check::robots::tree::Frame;
use crate::check::tasks::holders::{Holder, Phase};
use crate::check::tasks::task::Task;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::robot_plan::{RobotPlan, RobotSegmentKind};
use regrasp_geometry::Pose;
use std::ops::RangeInclusive;

/// Segments through which a hand holds the object in one grasp.
pub struct Hold {
    /// Index in [`Task::hands`].
    pub hand: usize,
    /// The segments.
    pub segments: RangeInclusive<usize>,
    /// Where the object is in the frame of the hand's body.
    pub body_from_object: Frame,
}

/// Runs of segments in which `is_in` is true.
fn runs(n_segments: usize, is_in: impl Fn(usize) -> bool) -> Vec<RangeInclusive<usize>> {
    let mut found: Vec<RangeInclusive<usize>> = Vec::new();
    for s in (0..n_segments).filter(|s| is_in(*s)) {
        match found.last_mut().filter(|run| *run.end() + 1 == s) {
            Some(run) => *run = *run.start()..=s,
            None => found.push(s..=s),
        }
    }
    found
}

/// All times at which hands hold.
pub fn holds_of(task: &Task, phases: &[Phase], plan: &RobotPlan) -> Vec<Hold> {
    let mut holds = Vec::new();
    let (mut frames, mut axes) = (Vec::new(), Vec::new());
    for hand in 0..task.hands.len() {
        for segments in runs(phases.len(), |s| phases[s].has_hand(hand) && !phases[s].kind.is_in_hand()) {
            let first = &plan.segments[*segments.start()].waypoints[0];
            task.question.tree.frames(&first.joints, &mut frames, &mut axes);
            let object = Pose::from(&first.world_from_objects[0]);
            let body_from_object = Frame::of(&(frames[task.hands[hand].body].pose().inverse() * object));
            holds.push(Hold { hand, segments, body_from_object });
        }
    }
    holds
}

/// The hold of a hand in a segment.
pub fn hold_at(holds: &[Hold], hand: usize, s: usize) -> Option<&Hold> {
    holds.iter().find(|hold| hold.hand == hand && hold.segments.contains(&s))
}

/// Judges everything that has to rest, and held objects.
pub fn check_rest(
    task: &Task,
    phases: &[Phase],
    holds: &[Hold],
    plan: &RobotPlan,
    settings: &CheckSettings,
    log: &mut Log,
) {
    check_held(task, holds, plan, settings, log);
    check_object_at_rest(phases, plan, settings, log);
    check_joints_at_rest(task, phases, plan, settings, log);
}

fn check_held(task: &Task, holds: &[Hold], plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let tolerance = settings.meeting_tolerance;
    let object = plan.objects[0].as_str();
    let (mut frames, mut axes) = (Vec::new(), Vec::new());
    for hold in holds {
        let hand = &task.hands[hold.hand];
        let start = &plan.segments[*hold.segments.start()].waypoints[0];
        for s in hold.segments.clone() {
            for (w, waypoint) in plan.segments[s].waypoints.iter().enumerate() {
                let at = Moment::at(s, w);
                task.question.tree.frames(&waypoint.joints, &mut frames, &mut axes);
                let expected = frames[hand.body].then(&hold.body_from_object).pose();
                let (distance, angle) = difference(&Pose::from(&waypoint.world_from_objects[0]), &expected);
                if !(distance <= tolerance && angle <= tolerance) {
                    let message = format!(
                        "object \"{object}\" is {distance:.3e} m and {angle:.3e} rad away from where \"{}\" holds it",
                        hand.name
                    );
                    let violation = Violation::new(Kind::GraspChanges, message).when(at);
                    log.push(violation.subjects([object]).amount(distance.max(angle), tolerance));
                }
                for k in hand.joints.clone() {
                    let off = (waypoint.joints[k] - start.joints[k]).abs().max(waypoint.joint_velocities[k].abs());
                    if !(off <= tolerance) {
                        let name = task.question.joint_names[k].as_str();
                        let message = format!("joint \"{name}\" moves while \"{}\" holds the object", hand.name);
                        let violation = Violation::new(Kind::GraspChanges, message).when(at);
                        log.push(violation.subjects([name, hand.name.as_str()]).amount(off, tolerance));
                    }
                }
            }
        }
    }
}

fn check_object_at_rest(phases: &[Phase], plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let tolerance = settings.meeting_tolerance;
    let object = plan.objects[0].as_str();
    for run in runs(phases.len(), |s| phases[s].carrier().is_none() && !phases[s].kind.is_in_hand()) {
        let first = Pose::from(&plan.segments[*run.start()].waypoints[0].world_from_objects[0]);
        for s in run {
            for (w, waypoint) in plan.segments[s].waypoints.iter().enumerate() {
                let (distance, angle) = difference(&Pose::from(&waypoint.world_from_objects[0]), &first);
                if !(distance <= tolerance && angle <= tolerance) {
                    let message =
                        format!("object \"{object}\" rests, and is moved by {distance:.3e} m and {angle:.3e} rad");
                    let violation = Violation::new(Kind::ObjectMovesAtRest, message).when(Moment::at(s, w));
                    log.push(violation.subjects([object]).amount(distance.max(angle), tolerance));
                }
            }
        }
    }
}

fn check_joints_at_rest(task: &Task, phases: &[Phase], plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let tolerance = settings.meeting_tolerance;
    let n_joints = task.question.joint_names.len();
    for (s, (phase, segment)) in phases.iter().zip(&plan.segments).enumerate() {
        let mut rests = vec![false; n_joints];
        if phase.carrier().is_none() {
            for holder in &phase.holders {
                if let Holder::Hand(hand) = holder {
                    task.hands[*hand].above.iter().for_each(|&k| rests[k] = true);
                }
            }
        }
        if matches!(phase.kind, RobotSegmentKind::Grasp | RobotSegmentKind::Release) {
            rests.fill(true);
            if let Some(hand) = phase.closing {
                task.hands[hand].joints.clone().for_each(|k| rests[k] = false);
            }
        }
        if phase.kind.is_in_hand() {
            rests.fill(true);
            for hand in phase.hands() {
                task.hands[hand].joints.clone().for_each(|k| rests[k] = false);
            }
        }
        let first = &segment.waypoints[0];
        for k in (0..n_joints).filter(|k| rests[*k]) {
            let off = |waypoint: &crate::robot_plan::RobotWaypoint| {
                (waypoint.joints[k] - first.joints[k]).abs().max(waypoint.joint_velocities[k].abs())
            };
            let moved = segment.waypoints.iter().position(|waypoint| !(off(waypoint) <= tolerance));
            if let Some(w) = moved {
                let name = task.question.joint_names[k].as_str();
                let message = format!("joint \"{name}\" moves where it has to rest");
                let violation = Violation::new(Kind::JointMovesAtRest, message).when(Moment::at(s, w));
                log.push(violation.subjects([name]).amount(off(&segment.waypoints[w]), tolerance));
            }
        }
    }
}
