//! When waypoints are passed, and how fast joints, fingertips and object go, as `docs/plan-format.md` (time) asks.
//!
//! - Time rises in a segment. The next one begins no earlier than it ends, and `shortest_pause` later where a contact force
//!   is by then another, beyond `force_tolerance`.
//! - In a step the mean velocity of every joint, coupled ones too, and those in the plan at its ends are at most the promised
//!   one and the robot's; the change of velocity is at most the promised acceleration times the time.
//! - Mean speeds in the world, of every tip's centre and of the object (way of its centre of mass, and turn times radius),
//!   are at most the promised one.
//! - The velocities in the plan belong to its motion: zero at both ends of a segment, elsewhere such that the cubic through
//!   positions and velocities never turns back within a step (Fritsch, Carlson 1980), within `velocity_tolerance`.
//! - Promised limits are above zero, and velocities no more than the robot's.
//!
//! Limits may be exceeded by the share 1e-6 for rounding, changes of velocity by `velocity_tolerance` as well. Tolerances
//! named here are fields of `CheckSettings`.

use crate::check::continuity::pose_difference;
use crate::check::model::Model;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactState, Plan, Segment, Waypoint};
use regrasp_geometry::{Pose, Vector};
use regrasp_scene::Object;

/// Speeds may be this much above their limits, relatively: rounding of times.
const ROUNDING: f64 = 1e-6;
/// The cubic between two waypoints with mean velocity `d` and velocities from 0 to this many times `d` at its ends never
/// turns back (Fritsch, Carlson, SIAM J. Numer. Anal. 17, 1980: the square inside their region).
const MONOTONE: f64 = 3.0;

/// Time from the first waypoint to the last, in seconds.
pub fn duration(plan: &Plan) -> f64 {
    let mut waypoints = plan.segments.iter().flat_map(|segment| &segment.waypoints);
    let first = waypoints.next().map_or(0.0, |waypoint| waypoint.time);
    waypoints.next_back().map_or(0.0, |last| last.time - first)
}

/// Judges times, speeds and velocities of the whole plan.
pub fn check_times(object: &Object, model: &Model, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    check_limits(model, plan, log);
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let at = Moment::at(s, w);
            let span = pair[1].time - pair[0].time;
            if span <= 0.0 {
                let message = format!("the next waypoint is passed {:.3e} s before this one", -span);
                log.push(Violation::new(Kind::TimeOrder, message).when(at).amount(span, 0.0));
                continue;
            }
            check_joint_speeds(model, plan, &pair[0], &pair[1], at, log);
            check_accelerations(plan, &pair[0], &pair[1], at, settings, log);
            check_speeds(object, model, plan, &pair[0], &pair[1], at, log);
        }
        check_velocities(plan, segment, s, settings, log);
    }
    for (s, pair) in plan.segments.windows(2).enumerate() {
        let (Some(end), Some(begin)) = (pair[0].waypoints.last(), pair[1].waypoints.first()) else { continue };
        check_pause(end, begin, s + 1, settings, log);
    }
}

/// The promised limits of joints against the robot's.
fn check_limits(model: &Model, plan: &Plan, log: &mut Log) {
    let motion = &plan.promises.motion;
    for drive in model.drives.iter().filter(|drive| !drive.follows) {
        let promised = motion.joint_velocities[drive.coordinate];
        if let Some(limit) = drive.velocity.filter(|limit| promised > limit * (1.0 + ROUNDING)) {
            let message =
                format!("joint \"{}\" is promised {promised} per second, the robot allows {limit}", drive.name);
            let violation = Violation::new(Kind::PromiseBroken, message);
            log.push(violation.subjects(["joint_velocities", drive.name.as_str()]).amount(promised, limit));
        }
    }
    let positive = |limits: &[f64]| limits.iter().all(|limit| *limit > 0.0);
    let names = ["largest_speed", "joint_velocities", "joint_accelerations"];
    let limits = [&[motion.largest_speed][..], &motion.joint_velocities, &motion.joint_accelerations];
    for (name, _) in names.iter().zip(limits).filter(|(_, limits)| !positive(limits)) {
        let message = format!("a limit in {name} is not above zero");
        log.push(Violation::new(Kind::PromiseBroken, message).subjects([*name]));
    }
}

fn check_joint_speeds(model: &Model, plan: &Plan, from: &Waypoint, to: &Waypoint, at: Moment, log: &mut Log) {
    let span = to.time - from.time;
    for drive in &model.drives {
        let k = drive.coordinate;
        let promised = plan.promises.motion.joint_velocities[k] * drive.multiplier.abs();
        let limit = drive.velocity.map_or(promised, |limit| limit.min(promised));
        let mean = (to.joints[k] - from.joints[k]) / span;
        let ends = from.joint_velocities[k].abs().max(to.joint_velocities[k].abs());
        let speed = mean.abs().max(ends) * drive.multiplier.abs();
        if speed > limit * (1.0 + ROUNDING) {
            let message = format!("joint \"{}\" goes {speed:.4} per second, {limit:.4} is allowed", drive.name);
            let violation = Violation::new(Kind::JointTooFast, message).when(at);
            log.push(violation.subjects([drive.name.as_str()]).amount(speed, limit));
        }
    }
}

fn check_accelerations(
    plan: &Plan,
    from: &Waypoint,
    to: &Waypoint,
    at: Moment,
    settings: &CheckSettings,
    log: &mut Log,
) {
    let span = to.time - from.time;
    for (k, name) in plan.joint_names.iter().enumerate() {
        let limit = plan.promises.motion.joint_accelerations[k];
        let change = (to.joint_velocities[k] - from.joint_velocities[k]).abs();
        if change > limit * span * (1.0 + ROUNDING) + settings.velocity_tolerance {
            let acceleration = change / span;
            let message = format!("joint \"{name}\" accelerates with {acceleration:.3}, {limit:.3} is allowed");
            let violation = Violation::new(Kind::JointAcceleration, message).when(at);
            log.push(violation.subjects([name.as_str()]).amount(acceleration, limit));
        }
    }
}

/// Mean speeds of fingertips and object in a step.
fn check_speeds(
    object: &Object,
    model: &Model,
    plan: &Plan,
    from: &Waypoint,
    to: &Waypoint,
    at: Moment,
    log: &mut Log,
) {
    let span = to.time - from.time;
    let limit = plan.promises.motion.largest_speed;
    let mut report = |name: &str, way: f64| {
        let speed = way / span;
        if speed > limit * (1.0 + ROUNDING) {
            let message = format!("\"{name}\" goes {speed:.4} m/s, {limit:.4} is promised");
            log.push(Violation::new(Kind::TooFast, message).when(at).subjects([name]).amount(speed, limit));
        }
    };
    for finger in &model.fingers {
        report(&finger.name, (finger.center_in_world(&to.joints) - finger.center_in_world(&from.joints)).norm());
    }
    let [before, after] = [from, to].map(|waypoint| Pose::from(&waypoint.world_from_object) * object.center_of_mass);
    let (_, turn) = pose_difference(&from.world_from_object, &to.world_from_object);
    report(&object.name, (after - before).norm() + turn * object.radius);
}

/// Velocities are zero at the ends of a segment and fit the steps before and after everywhere else.
fn check_velocities(plan: &Plan, segment: &Segment, s: usize, settings: &CheckSettings, log: &mut Log) {
    let waypoints = &segment.waypoints;
    for (w, waypoint) in waypoints.iter().enumerate() {
        let before = w.checked_sub(1).map(|before| &waypoints[before]);
        let after = waypoints.get(w + 1);
        for (k, name) in plan.joint_names.iter().enumerate() {
            let mean = |from: &Waypoint, to: &Waypoint| (to.joints[k] - from.joints[k]) / (to.time - from.time);
            let velocity = waypoint.joint_velocities[k];
            let (low, high) = match (before, after) {
                (Some(before), Some(after)) => allowed(mean(before, waypoint), mean(waypoint, after)),
                _ => (0.0, 0.0),
            };
            if velocity < low - settings.velocity_tolerance || velocity > high + settings.velocity_tolerance {
                let message = format!(
                    "joint \"{name}\" has velocity {velocity:.4e}, its positions and times allow [{low:.4e}, {high:.4e}]"
                );
                let violation = Violation::new(Kind::VelocityInconsistent, message).when(Moment::at(s, w));
                log.push(violation.subjects([name.as_str()]).amount(velocity, if velocity < low { low } else { high }));
            }
        }
    }
}

/// Velocities with which the cubics before and after, of these mean velocities, do not turn back.
fn allowed(before: f64, after: f64) -> (f64, f64) {
    if before > 0.0 && after > 0.0 {
        (0.0, MONOTONE * before.min(after))
    } else if before < 0.0 && after < 0.0 {
        (MONOTONE * before.max(after), 0.0)
    } else {
        (0.0, 0.0)
    }
}

/// A segment begins when the one before has ended, and later where forces are others by then.
fn check_pause(end: &Waypoint, begin: &Waypoint, s: usize, settings: &CheckSettings, log: &mut Log) {
    let span = begin.time - end.time;
    let force = |contact: &ContactState| contact.force_in_object.map_or(Vector::zeros(), Vector::from);
    let changes =
        end.contacts.iter().zip(&begin.contacts).map(|(a, b)| (force(a) - force(b)).norm()).fold(0.0, f64::max);
    let what = if span < 0.0 {
        format!("begins {:.3e} s before the segment before has ended", -span)
    } else if span < settings.shortest_pause && changes > settings.force_tolerance {
        format!("leaves {span:.3e} s in which forces change by {changes:.3e} N")
    } else {
        return;
    };
    log.push(Violation::new(Kind::TimeOrder, what).when(Moment::at(s, 0)).amount(span, settings.shortest_pause));
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn cubics_with_allowed_velocities_never_turn_back() {
        let mut rng = Rng::keyed(1, "monotone", 0);
        for _ in 0..500 {
            let (d, others) = (rng.uniform(0.1, 2.0), [rng.uniform(0.1, 2.0), rng.uniform(0.1, 2.0)]);
            let [start, end] = others.map(|other| rng.unit() * allowed(d, other).1);
            // Derivative of the cubic through 0 and d with these velocities at 0 and 1.
            let rate = |t: f64| {
                let bend = start + end - 2.0 * d;
                start + 2.0 * t * (3.0 * d - 2.0 * start - end) + 3.0 * t * t * bend
            };
            assert!((0..=100).all(|i| rate(f64::from(i) / 100.0) > -1e-12));
        }
        assert_eq!(allowed(1.0, -1.0), (0.0, 0.0));
        assert_eq!(allowed(-1.0, -0.5), (-1.5, 0.0));
    }
}
