//! Transfers and regrasps within a plan of pick and place. The wrist of the hand rests meanwhile, so such segments are a plan of a motion in
//! a hand that an arm carries. They are judged as one, by the same rules and the same code: contacts, slip, closure, forces and torques,
//! collision of hand and object with everything that rests, at and between waypoints.
//!
//! Beside these rules: the contacts with which the motion begins and ends are those of the carries before and after.

use crate::check::tasks::contacts::are_same;
use crate::check::tasks::holders::Phase;
use crate::check::tasks::task::Task;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log, Report, check};
use crate::plan::{ContactState, Plan, Promises, Segment, SegmentKind, Statistics, Waypoint};
use crate::robot_plan::{InHandPart, RobotContact, RobotPlan, RobotSegment, RobotSegmentKind, RobotWaypoint};
use regrasp_scene::State;
use regrasp_scene::query::IN_HAND;
use std::collections::BTreeMap;
use std::ops::Range;

/// Judges all motions in hands of a plan.
pub fn check_in_hand(
    (task, state): (&Task, &State),
    phases: &[Phase],
    plan: &RobotPlan,
    settings: &CheckSettings,
    (log, report): (&mut Log, &mut Report),
) {
    let mut s = 0;
    while s < phases.len() {
        let Some(hand) = phases[s].moves_in() else {
            s += 1;
            continue;
        };
        let end = (s..phases.len()).find(|k| phases[*k].moves_in() != Some(hand)).unwrap_or(phases.len());
        check_run((task, state), hand, s..end, plan, settings, (log, report));
        s = end;
    }
}

fn check_run(
    (task, state): (&Task, &State),
    hand: usize,
    run: Range<usize>,
    plan: &RobotPlan,
    settings: &CheckSettings,
    (log, report): (&mut Log, &mut Report),
) {
    let name = task.hands[hand].name.as_str();
    let Some(promises) = plan.promises.in_hand.get(name) else {
        let message = format!("the plan promises nothing of motions in the hand \"{name}\"");
        let violation = Violation::new(Kind::PromiseBroken, message).when(Moment::at(run.start, 0));
        log.push(violation.subjects(["in_hand"]));
        return;
    };
    check_ends(task, hand, &run, plan, settings, log);
    let own = state_at(task, state, plan, run.start);
    let part = in_hand_plan(task, hand, &plan.segments[run.clone()], plan, promises);
    let found = check((task.scene, &own), None, &part, settings);
    for mut violation in found.violations {
        if let Some(at) = &mut violation.at {
            at.segment += run.start;
        }
        log.push(violation);
    }
    report.left_out.extend(found.left_out);
    let least = |known: Option<f64>, new: Option<f64>| match (known, new) {
        (Some(known), Some(new)) => Some(known.min(new)),
        (known, new) => known.or(new),
    };
    let most = |known: Option<f64>, new: Option<f64>| match (known, new) {
        (Some(known), Some(new)) => Some(known.max(new)),
        (known, new) => known.or(new),
    };
    report.min_margin = least(report.min_margin, found.min_margin);
    report.max_contact_error = report.max_contact_error.max(found.max_contact_error);
    report.max_slip = most(report.max_slip, found.max_slip);
    report.max_force_residual = most(report.max_force_residual, found.max_force_residual);
    report.max_moment_residual = most(report.max_moment_residual, found.max_moment_residual);
    report.max_half_way_imbalance = most(report.max_half_way_imbalance, found.max_half_way_imbalance);
    report.n_distances += found.n_distances;
    let slips = [report.max_hold_slip.take(), found.max_hold_slip];
    report.max_hold_slip = slips.into_iter().flatten().max_by(|a, b| a.slip.total_cmp(&b.slip));
}

/// The hand holds with the same contacts before and after as in the motion: fingers cannot change at once.
///
/// Joints and object are where they were (`robots::rules::check_meeting`), so what may differ is how a contact is described.
fn check_ends(task: &Task, hand: usize, run: &Range<usize>, plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let name = task.hands[hand].name.as_str();
    let of_hand = |waypoint: Option<&RobotWaypoint>| -> Vec<RobotContact> {
        let contacts = waypoint.iter().flat_map(|waypoint| &waypoint.contacts);
        contacts.filter(|contact| contact.hand == name).cloned().collect()
    };
    let before = run.start.checked_sub(1).and_then(|s| plan.segments[s].waypoints.last());
    let after = plan.segments.get(run.end).map(|segment| &segment.waypoints[0]);
    let first = plan.segments[run.start].waypoints.first();
    let last = plan.segments[run.end - 1].waypoints.last();
    for (beside, inside, s) in [(before, first, run.start), (after, last, run.end)] {
        if !are_same(&of_hand(beside), &of_hand(inside), settings.surface_tolerance) {
            let message = format!("hand \"{name}\" holds with other contacts than in the motion in the hand beside");
            log.push(Violation::new(Kind::GraspChanges, message).when(Moment::at(s, 0)).subjects([name]));
        }
    }
}

/// Where everything rests at the begin of a segment.
fn state_at(task: &Task, state: &State, plan: &RobotPlan, s: usize) -> State {
    let first = &plan.segments[s].waypoints[0];
    let mut own = state.clone();
    own.robot_joints[task.question.index].clone_from(&first.joints);
    for hand in &task.hands {
        if let Some(index) = task.scene.hand_named(&hand.name) {
            own.hand_joints[index] = first.joints[hand.joints.clone()].to_vec();
        }
    }
    own.world_from_objects[task.object_index] = (&first.world_from_objects[0]).into();
    own
}

/// The segments as a plan of a motion in the hand.
fn in_hand_plan(task: &Task, hand: usize, segments: &[RobotSegment], plan: &RobotPlan, promises: &Promises) -> Plan {
    let own = &task.hands[hand];
    let joint_names = task.scene.hand_named(&own.name).map(|index| task.scene.hands[index].hand.joint_names());
    let fingers: Vec<String> = own.fingers.iter().map(|finger| finger.name.clone()).collect();
    let (first, last) = (&segments[0], &segments[segments.len() - 1]);
    let ends = [&first.waypoints[0], &last.waypoints[last.waypoints.len() - 1]];
    let one = |segment: &RobotSegment| {
        let part = segment.in_hand.as_deref().cloned().unwrap_or_default();
        let waypoint = |(w, waypoint): (usize, &RobotWaypoint)| in_hand_waypoint(task, hand, (&part, w), waypoint);
        Segment {
            kind: match segment.kind {
                RobotSegmentKind::Regrasp => SegmentKind::Regrasp,
                _ => SegmentKind::Transfer,
            },
            moving_finger: part.moving_finger.clone(),
            also_moving: Vec::new(),
            held_by: vec![own.name.clone()],
            rolling_finger: None,
            waypoints: segment.waypoints.iter().enumerate().map(waypoint).collect(),
        }
    };
    Plan {
        format: plan.format.clone(),
        format_version: plan.format_version,
        tool: plan.tool.clone(),
        task: IN_HAND.into(),
        query: String::new(),
        hand: own.name.clone(),
        object: plan.objects[0].clone(),
        method: plan.method.clone(),
        seed: plan.seed,
        settings: plan.settings.clone(),
        inputs: plan.inputs.clone(),
        promises: promises.clone(),
        joint_names: joint_names.unwrap_or_default(),
        held_joints: BTreeMap::new(),
        fingers,
        start: ends[0].world_from_objects[0],
        asked: None,
        way_poses: Vec::new(),
        goal: ends[1].world_from_objects[0],
        segments: segments.iter().map(one).collect(),
        statistics: Statistics::default(),
    }
}

fn in_hand_waypoint(task: &Task, hand: usize, (part, w): (&InHandPart, usize), waypoint: &RobotWaypoint) -> Waypoint {
    let own = &task.hands[hand];
    let of_finger = |finger: &crate::check::model::FingerModel| {
        let mut contacts = waypoint.contacts.iter();
        let contact = contacts.find(|contact| contact.hand == own.name && contact.finger == finger.name);
        contact.map_or(ContactState::FREE, |contact| ContactState {
            force_in_object: contact.force_in_object,
            torsion: contact.torsion,
            ..ContactState::at(contact.mode, contact.point_in_object, contact.normal_in_object)
        })
    };
    Waypoint {
        time: waypoint.time,
        joints: waypoint.joints[own.joints.clone()].to_vec(),
        joint_velocities: waypoint.joint_velocities[own.joints.clone()].to_vec(),
        joint_torques: part.joint_torques.get(w).cloned().unwrap_or_default(),
        world_from_object: waypoint.world_from_objects[0],
        contacts: own.fingers.iter().map(of_finger).collect(),
    }
}
