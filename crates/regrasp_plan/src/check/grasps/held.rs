//! A grasp as it is held: joint limits, fingertips on the surface, margin, forces.

use super::{Judged, Measured};
use crate::check::Log;
use crate::check::closure::{HeldBody, certified_margin};
use crate::check::contact::{self, check_pads, error_at};
use crate::check::forces::Judge;
use crate::check::promises::{MARGIN_TOLERANCE, grips_of, holders};
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};

/// How far a margin may be above the one found here: two solvers, one number.
const CLAIMED_MARGIN_TOLERANCE: f64 = 1e-6;

/// How far a joint may be from where the joints that it follows put it: rounding.
const TIE_TOLERANCE: f64 = 1e-9;

/// Contacts of all grasps on the surface, away from edges; fingertips that touch with their pads.
pub(super) fn check_contacts(judged: &Judged, log: &mut Log) {
    let object = judged.scene.manipulation().object();
    contact::check_contacts(object, None, judged.model, judged.plan, judged.settings, log);
    check_pads(judged.model, judged.plan, log);
}

/// All that can be told from the grasp alone.
pub(super) fn check_grasp(judged: &Judged, index: usize, log: &mut Log, measured: &mut Measured) {
    let at = Moment::at(0, index);
    check_limits(judged, index, at, log);
    check_ties(judged, index, at, log);
    check_tips(judged, index, at, log, measured);
    check_margin(judged, index, at, log, measured);
    check_forces(judged, index, at, log);
}

fn check_limits(judged: &Judged, index: usize, at: Moment, log: &mut Log) {
    let grasp = &judged.list.grasps[index];
    let tolerance = judged.settings.limit_tolerance;
    for (what, joints) in [("in the grasp", &grasp.joints), ("in the open hand", &grasp.open_joints)] {
        for row in &judged.model.limits {
            let position = row.drive.position(joints);
            let beyond = (row.lower - position).max(position - row.upper);
            if beyond > tolerance {
                let message = format!("joint \"{}\" {what} is {beyond:.3e} beyond its limits", row.name);
                let violation = Violation::new(Kind::JointLimit, message).when(at);
                log.push(violation.subjects([row.name.as_str()]).amount(beyond, tolerance));
            }
        }
    }
}

/// Joints that follow those of other fingers stand where their couplings say, and so they do on every straight line in between.
fn check_ties(judged: &Judged, index: usize, at: Moment, log: &mut Log) {
    let grasp = &judged.list.grasps[index];
    let task = judged.scene.manipulation();
    let hand = task.hand();
    let name = |joint: regrasp_robot::JointId| hand.robot.joints[joint.0].name.as_str();
    for (what, joints) in [("in the grasp", &grasp.joints), ("in the open hand", &grasp.open_joints)] {
        let position = |joint| {
            let place = judged.model.joint_names.iter().position(|known| known == name(joint));
            place.map_or(f64::NAN, |place| joints[place])
        };
        for tie in &hand.ties {
            let mut wanted = tie.coupling.offset;
            for (leader, factor) in &tie.coupling.terms {
                wanted += factor * position(*leader);
            }
            let off = (position(tie.follower) - wanted).abs();
            if !(off <= TIE_TOLERANCE) {
                let follower = name(tie.follower);
                let message = format!("joint \"{follower}\" {what} is {off:.3e} off the joints that it follows");
                let violation = Violation::new(Kind::JointLimit, message).when(at).subjects([follower]);
                log.push(violation.amount(off, TIE_TOLERANCE));
            }
        }
    }
}

fn check_tips(judged: &Judged, index: usize, at: Moment, log: &mut Log, measured: &mut Measured) {
    let (grasp, waypoint) = (&judged.list.grasps[index], &judged.plan.segments[0].waypoints[index]);
    let tolerance = judged.plan.promises.contact_tolerance.min(judged.settings.largest_contact_tolerance);
    for (f, finger) in judged.model.fingers.iter().enumerate() {
        let Some(contact) = grasp.contacts.iter().find(|contact| contact.finger == finger.name) else { continue };
        let error = error_at(finger, waypoint, f);
        measured.contact_error = measured.contact_error.max(error);
        if !(error <= tolerance) {
            let message = format!("the tip of finger \"{}\" is {error:.3e} m off its contact", finger.name);
            let violation = Violation::new(Kind::ContactOffTip, message).when(at);
            log.push(violation.subjects([finger.name.as_str()]).amount(error, tolerance));
        }
        let hand = judged.scene.manipulation().hand();
        let link = &hand.robot.links[finger.tip_link.0].name;
        if contact.link != *link {
            let message =
                format!("finger \"{}\" touches with \"{}\"; only \"{link}\" may touch", finger.name, contact.link);
            log.push(Violation::new(Kind::WrongContactMode, message).when(at).subjects([finger.name.as_str()]));
        }
    }
}

fn check_margin(judged: &Judged, index: usize, at: Moment, log: &mut Log, measured: &mut Measured) {
    let waypoint = &judged.plan.segments[0].waypoints[index];
    let grips = grips_of(judged.model, &holders(judged.model, None, waypoint));
    let body = HeldBody::of(judged.scene.manipulation().object(), judged.plan);
    let found = certified_margin(&grips, &body).map_or(0.0, |(margin, _)| margin);
    measured.margin = Some(measured.margin.map_or(found, |least| least.min(found)));
    let required = judged.plan.promises.required_margin.max(judged.settings.smallest_margin);
    if !(found > 0.0 && found >= required - MARGIN_TOLERANCE) {
        let message = format!("the contacts close the object with margin {found:.6}, {required:.6} is required");
        log.push(Violation::new(Kind::ClosureLost, message).when(at).amount(found, required));
    }
    let claimed = judged.list.grasps[index].margin;
    if claimed > found + CLAIMED_MARGIN_TOLERANCE {
        let message = format!("the list says margin {claimed}, found is {found}");
        log.push(Violation::new(Kind::PromiseBroken, message).when(at).subjects(["margin"]).amount(claimed, found));
    }
}

fn check_forces(judged: &Judged, index: usize, at: Moment, log: &mut Log) {
    let Some(promises) = &judged.plan.promises.forces else { return };
    let task = judged.scene.manipulation();
    let judge = Judge {
        object: task.object(),
        body: HeldBody::of(task.object(), judged.plan),
        model: judged.model,
        plan: judged.plan,
        promises,
        settings: judged.settings,
    };
    let waypoint = &judged.plan.segments[0].waypoints[index];
    let Some(exerted) = judge.exerted(waypoint, at, log) else { return };
    judge.check_balance(waypoint, &exerted, at, log);
    for one in &exerted {
        judge.check_contact(one, None, at, log);
    }
    judge.check_torques(waypoint, &exerted, at, log);
    judge.check_room(waypoint, &exerted, at, log);
}
