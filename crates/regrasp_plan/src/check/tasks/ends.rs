//! Start and end as the query asks for them, and promises against scene and robot.

use crate::check::robots::rules::difference;
use crate::check::tasks::task::Task;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::robot_plan::RobotPlan;
use regrasp_geometry::Pose;
use regrasp_scene::PickAndPlaceQuery;

/// Friction margin that is asked for where the scene states none, as for in-hand plans; see [`regrasp_scene::Limits::friction_margin`].
pub const FRICTION_MARGIN: f64 = 1.5;
/// Promises may be beyond a limit by this share: rounding.
const ROUNDING: f64 = 1e-9;

/// The robot starts and ends in the postures asked for, with the object where it was asked to stand.
pub fn check_ends(task: &Task, query: &PickAndPlaceQuery, plan: &RobotPlan, settings: &CheckSettings, log: &mut Log) {
    let (Some(first), Some(last)) = (plan.waypoints().next(), plan.waypoints().next_back()) else { return };
    let last_segment = plan.segments.len() - 1;
    let end = Moment::at(last_segment, plan.segments[last_segment].waypoints.len() - 1);
    let tolerance = settings.pose_tolerance;
    for (kind, waypoint, joints, pose, at) in [
        (Kind::StartMismatch, first, &query.start, &query.world_from_object_start, Moment::at(0, 0)),
        (Kind::GoalMismatch, last, &query.end, &query.world_from_object_goal, end),
    ] {
        for (k, name) in task.question.joint_names.iter().enumerate() {
            let off = (waypoint.joints[k] - joints[k]).abs();
            if !(off <= tolerance) {
                let message = format!("joint \"{name}\" is {off:.3e} away from where it was asked to be");
                log.push(Violation::new(kind, message).when(at).subjects([name.as_str()]).amount(off, tolerance));
            }
        }
        let (distance, angle) = difference(&Pose::from(&waypoint.world_from_objects[0]), pose);
        if !(distance <= tolerance && angle <= tolerance) {
            let name = plan.objects[0].as_str();
            let message =
                format!("object \"{name}\" is {distance:.3e} m and {angle:.3e} rad away from where it was asked to be");
            log.push(Violation::new(kind, message).when(at).subjects([name]).amount(distance.max(angle), tolerance));
        }
    }
}

/// What the plan promises of holding is no looser than scene and checker allow.
pub fn check_promises(task: &Task, settings: &CheckSettings, log: &mut Log) {
    let (promises, object) = (&task.promises, task.object);
    let mut broken = |kind: Kind, name: &str, (amount, limit): (f64, f64), message: String| {
        log.push(Violation::new(kind, message).subjects([name]).amount(amount, limit));
    };
    let largest = settings.largest_contact_tolerance;
    if !(promises.contact_tolerance > 0.0 && promises.contact_tolerance <= largest) {
        let message = format!("contact tolerance {:e} m, at most {largest:e} is accepted", promises.contact_tolerance);
        broken(Kind::PromiseBroken, "contact_tolerance", (promises.contact_tolerance, largest), message);
    }
    let asked = task.scene.limits.friction_margin.unwrap_or(FRICTION_MARGIN);
    if !(promises.friction_margin >= asked * (1.0 - ROUNDING)) {
        let message = format!(
            "the plan keeps a friction margin of {}, at least {asked} is asked for (key \"limits.friction_margin\")",
            promises.friction_margin
        );
        broken(Kind::FrictionMarginTooSmall, "friction_margin", (promises.friction_margin, asked), message);
    }
    if !(promises.required_margin >= 0.0) {
        let message = format!("a required margin of {}", promises.required_margin);
        broken(Kind::PromiseBroken, "required_margin", (promises.required_margin, 0.0), message);
    }
    if !((promises.torque_scale - object.radius).abs() <= ROUNDING * object.radius) {
        let message = format!("torque scale {}, the object's radius is {}", promises.torque_scale, object.radius);
        broken(Kind::PromiseBroken, "torque_scale", (promises.torque_scale, object.radius), message);
    }
    let [least, most] = promises.normal_force;
    if !(least >= 0.0 && least <= most) {
        broken(Kind::PromiseBroken, "normal_force", (least, most), format!("normal forces from {least} N to {most} N"));
    }
    let limit = task.scene.limits.normal_force;
    if !(most <= limit * (1.0 + ROUNDING)) {
        let message = format!("normal forces up to {most} N, the scene allows {limit} N");
        broken(Kind::LimitExceeded, "normal_force", (most, limit), message);
    }
}
