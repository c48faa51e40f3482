//! What a plan allows itself, against what scene, hand file and checker allow: the measure is never the plan's.
//!
//! A plan may promise to keep to tighter limits than the scene's ([`regrasp_scene::Limits`]), never to looser ones:
//!
//! - speed of fingertips and object, joint velocities (the robot's where it states one), joint accelerations, normal forces;
//! - friction: closure and forces count on the scene's over the friction margin, or on less;
//! - contact forces are there: in tracking always, because what slides is held by forces alone; elsewhere from level `forces` on.

use crate::check::Log;
use crate::check::level::Level;
use crate::check::model::CheckedHand;
use crate::check::violation::{Violation, ViolationKind as Kind};
use crate::plan::Plan;
use regrasp_scene::Manipulation;

/// Limits may be exceeded by this share: rounding.
const ROUNDING: f64 = 1e-9;
/// Friction margin that in-hand plans keep where the scene states none; see [`regrasp_scene::Limits::friction_margin`].
const IN_HAND_FRICTION_MARGIN: f64 = 1.5;
/// The same for tracking.
const TRACKING_FRICTION_MARGIN: f64 = 1.0;

/// Judges what the plan allows itself.
pub fn check_allowance(task: &Manipulation, model: &CheckedHand, plan: &Plan, log: &mut Log) {
    check_motion(task, model, plan, log);
    check_friction_margin(task, plan, log);
    let is_tracking = plan.promises.tracking.is_some();
    match &plan.promises.forces {
        None => {
            let (level, why) = match is_tracking {
                true => (Level::Geometry, "what slides is held by forces alone"),
                false => (Level::Forces, "nothing says what holds the object"),
            };
            let message = format!("the plan has no contact forces: {why}");
            log.push(Violation::new(Kind::ForcesAbsent, message).from_level(level));
        }
        Some(forces) => {
            let (asked, limit) = (forces.normal_force[1], task.scene.limits.normal_force);
            exceeded(log, "normal_force", None, (asked, limit), "N", Level::Forces);
        }
    }
}

fn check_motion(task: &Manipulation, model: &CheckedHand, plan: &Plan, log: &mut Log) {
    let (motion, limits) = (&plan.promises.motion, &task.scene.limits);
    exceeded(log, "largest_speed", None, (motion.largest_speed, limits.largest_speed), "m/s", Level::Motion);
    for (k, name) in model.joint_names.iter().enumerate() {
        let is_limited = model.drives.iter().any(|row| row.drive.is_driven_by(k) && row.velocity.is_some());
        if !is_limited {
            let pair = (motion.joint_velocities[k], limits.joint_velocity);
            exceeded(log, "joint_velocities", Some(name), pair, "per second", Level::Motion);
        }
        let pair = (motion.joint_accelerations[k], limits.joint_acceleration);
        exceeded(log, "joint_accelerations", Some(name), pair, "per second squared", Level::Motion);
    }
}

fn exceeded(log: &mut Log, key: &str, joint: Option<&str>, (asked, limit): (f64, f64), unit: &str, level: Level) {
    if asked <= limit * (1.0 + ROUNDING) {
        return;
    }
    let of = joint.map_or(String::new(), |joint| format!(" of joint \"{joint}\""));
    let message = format!(
        "the plan allows itself {key}{of} of {asked} {unit}, the scene's limits (key \"limits\") are {limit} {unit}"
    );
    let subjects = std::iter::once(key).chain(joint);
    log.push(Violation::new(Kind::LimitExceeded, message).subjects(subjects).amount(asked, limit).from_level(level));
}

/// The friction margin that is asked for: the scene's, else that of the plan's task.
pub fn friction_margin(task: &Manipulation, plan: &Plan) -> f64 {
    task.scene.limits.friction_margin.unwrap_or(match plan.promises.tracking.is_some() {
        true => TRACKING_FRICTION_MARGIN,
        false => IN_HAND_FRICTION_MARGIN,
    })
}

/// The friction counted on is at most the scene's over the friction margin that is asked for.
fn check_friction_margin(task: &Manipulation, plan: &Plan, log: &mut Log) {
    let asked = friction_margin(task, plan);
    let (counted_on, limit) = (plan.promises.friction, task.object().friction / asked);
    if counted_on > limit * (1.0 + ROUNDING) {
        let message = format!(
            "the plan counts on friction {counted_on}, at most {limit} is accepted: {} of the scene over a margin of {asked} (key \"limits.friction_margin\")",
            task.object().friction
        );
        let violation = Violation::new(Kind::FrictionMarginTooSmall, message).subjects(["friction"]);
        log.push(violation.amount(counted_on, limit).from_level(Level::Forces));
    }
}
