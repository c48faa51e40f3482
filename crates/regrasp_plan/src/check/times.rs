//! When waypoints are passed, and how fast joints, fingertips and object go, as `docs/reference/plan-format.md` (time) asks.
//!
//! - Time rises in a segment. The next one begins no earlier than it ends, and `shortest_pause` later where a contact force
//!   is by then another, beyond `force_tolerance`.
//! - At every moment between two waypoints the velocity and the acceleration of every joint, on the cubic of
//!   `Between`, are at most the promised ones, and the velocity of every joint, coupled ones too, at most the robot's.
//! - At every moment the speed in the world of every tip's centre and of the object (speed of its centre of mass, and angular
//!   speed times radius) is at most the promised one.
//! - Velocities are zero at both ends of a segment and where a joint rests before and after. The object's parameter, which they
//!   define, does not turn back.
//! - Promised limits are above zero, and velocities no more than the robot's.
//!
//! Limits may be exceeded by the share 1e-6 for rounding, accelerations by what a change of both velocities by
//! `velocity_tolerance` makes as well. Tolerances named here are fields of `CheckSettings`.

use crate::check::between::Between;
use crate::check::model::{CheckedHand, FingerModel};
use crate::check::pose::pose_difference;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactState, Plan, Segment, Waypoint};
use nalgebra::UnitQuaternion;
use regrasp_geometry::{Pose, Vector};
use regrasp_scene::Object;
use std::f64::consts::TAU;

/// Speeds may be this much above their limits, relatively: rounding of times.
const ROUNDING: f64 = 1e-6;
/// Share of the largest speed that may stay unknown of a fingertip between the moments at which it is measured. What is unknown
/// counts as speed.
const UNKNOWN_SPEED: f64 = 0.005;
/// Share of a step that is not divided further for that.
const SMALLEST_SPAN: f64 = 1.0 / 1024.0;

/// Time from the first waypoint to the last, in seconds.
pub fn duration(plan: &Plan) -> f64 {
    let mut waypoints = plan.segments.iter().flat_map(|segment| &segment.waypoints);
    let first = waypoints.next().map_or(0.0, |waypoint| waypoint.time);
    waypoints.next_back().map_or(0.0, |last| last.time - first)
}

/// Judges times, speeds and velocities of the whole plan.
pub fn check_times(object: &Object, model: &CheckedHand, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
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
            let motion = Between::new(&pair[0], &pair[1]);
            if motion.is_broken() {
                let message = "joint velocities lead back, or do not fit positions and times: the object's parameter has no \
                               slopes between 0 and 3";
                log.push(Violation::new(Kind::VelocityInconsistent, message).when(at));
                continue;
            }
            check_joint_speeds(model, plan, &motion, span, at, log);
            check_accelerations(plan, &motion, span, at, settings, log);
            check_speeds(object, model, plan, (&pair[0], &pair[1]), &motion, at, log);
        }
        check_velocities(plan, segment, s, settings, log);
    }
    for (s, pair) in plan.segments.windows(2).enumerate() {
        let (Some(end), Some(begin)) = (pair[0].waypoints.last(), pair[1].waypoints.first()) else { continue };
        check_pause(end, begin, s + 1, settings, log);
    }
}

/// The promised limits of joints against the robot's.
fn check_limits(model: &CheckedHand, plan: &Plan, log: &mut Log) {
    let motion = &plan.promises.motion;
    for drive in &model.drives {
        let Some(coordinate) = drive.own_coordinate() else { continue };
        let promised = motion.joint_velocities[coordinate];
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

fn check_joint_speeds(model: &CheckedHand, plan: &Plan, motion: &Between, span: f64, at: Moment, log: &mut Log) {
    for drive in &model.drives {
        let promises = &plan.promises.motion.joint_velocities;
        let promised: f64 = drive.drive.terms.iter().map(|&(k, multiplier)| promises[k] * multiplier.abs()).sum();
        let limit = drive.velocity.map_or(promised, |limit| limit.min(promised));
        let speed = drive.drive.motion(motion).largest_slope() / span;
        if speed > limit * (1.0 + ROUNDING) {
            let message = format!("joint \"{}\" goes {speed:.4} per second, {limit:.4} is allowed", drive.name);
            let violation = Violation::new(Kind::JointTooFast, message).when(at);
            log.push(violation.subjects([drive.name.as_str()]).amount(speed, limit));
        }
    }
}

fn check_accelerations(plan: &Plan, motion: &Between, span: f64, at: Moment, settings: &CheckSettings, log: &mut Log) {
    for (k, name) in plan.joint_names.iter().enumerate() {
        let limit = plan.promises.motion.joint_accelerations[k];
        let acceleration = motion.joint(k).largest_bend() / (span * span);
        // An end's acceleration changes with its velocity by four over the time, with the other's by two.
        if acceleration > limit * (1.0 + ROUNDING) + 6.0 * settings.velocity_tolerance / span {
            let message = format!("joint \"{name}\" accelerates with {acceleration:.3}, {limit:.3} is allowed");
            let violation = Violation::new(Kind::JointAcceleration, message).when(at);
            log.push(violation.subjects([name.as_str()]).amount(acceleration, limit));
        }
    }
}

/// Speeds of fingertips and object at every moment of a step.
fn check_speeds(
    object: &Object,
    model: &CheckedHand,
    plan: &Plan,
    (from, to): (&Waypoint, &Waypoint),
    motion: &Between,
    at: Moment,
    log: &mut Log,
) {
    let span = to.time - from.time;
    let limit = plan.promises.motion.largest_speed;
    let mut report = |name: &str, speed: f64| {
        if speed > limit * (1.0 + ROUNDING) {
            let message = format!("\"{name}\" goes {speed:.4} m/s, {limit:.4} is promised");
            log.push(Violation::new(Kind::TooFast, message).when(at).subjects([name]).amount(speed, limit));
        }
    };
    let bounds = motion.joint_bounds();
    for finger in model.fingers.iter().filter(|finger| finger.path.moves(&bounds)) {
        report(&finger.name, tip_way(finger, motion, limit * span) / span);
    }
    report(&object.name, object_way(object, from, to) * motion.sigma().largest_slope() / span);
}

/// Largest speed of a tip's centre, in metres per step, and what is unknown of it. Measured as often as it takes to tell whether
/// that is at most `limit`.
///
/// Between two moments `h` apart the velocity strays from the mean of those by at most (largest jerk) `h^2 / 8`.
fn tip_way(finger: &FingerModel, motion: &Between, limit: f64) -> f64 {
    let speed = |u: f64| {
        let rates: Vec<f64> = (0..motion.n_joints()).map(|k| motion.joint(k).slope(u)).collect();
        finger.path.velocity(&finger.center, &motion.joints_at(u), &rates).norm()
    };
    let unknown = finger.path.rates(&finger.center, 0.0, &motion.joint_bounds()).jerk / 8.0;
    let mut largest: f64 = 0.0;
    let mut pending = vec![[0.0, 1.0].map(|u| (u, speed(u)))];
    while let Some([first, last]) = pending.pop() {
        let span = last.0 - first.0;
        let most = first.1.max(last.1) + unknown * span * span;
        let is_known = unknown * span * span <= UNKNOWN_SPEED * limit || span <= SMALLEST_SPAN;
        if most <= limit || is_known || !most.is_finite() {
            largest = largest.max(most);
            continue;
        }
        let middle = 0.5 * (first.0 + last.0);
        let middle = (middle, speed(middle));
        pending.extend([[middle, last], [first, middle]]);
    }
    largest
}

/// Largest speed of the object's centre of mass and angular speed times radius, in metres per unit of the parameter.
fn object_way(object: &Object, from: &Waypoint, to: &Waypoint) -> f64 {
    let [first, last] = [from, to].map(|waypoint| Pose::from(&waypoint.world_from_object));
    let (_, turn) = pose_difference(&from.world_from_object, &to.world_from_object);
    fastest_center(&first, &last, &object.center_of_mass.coords) + turn * object.radius
}

/// Largest speed of a point of the object, at `arm` in its frame, in metres per unit of the parameter.
///
/// The point goes straight with the object's origin and on a circle about it: it is fastest at an end, or where both point the
/// same way.
fn fastest_center(first: &Pose, last: &Pose, arm: &Vector) -> f64 {
    let shift = last.translation.vector - first.translation.vector;
    let turn = (last.rotation * first.rotation.inverse()).scaled_axis();
    let arm = first.rotation * arm;
    let [begin, end] = [arm, UnitQuaternion::from_scaled_axis(turn) * arm].map(|arm| turn.cross(&arm));
    let mut fastest = (shift + begin).norm().max((shift + end).norm());
    if let Some(axis) = turn.try_normalize(0.0) {
        let aside = shift - axis * axis.dot(&shift);
        // From the beginning of the turn to where the circle leads along the shift.
        let angle = begin.cross(&aside).dot(&axis).atan2(begin.dot(&aside)).rem_euclid(TAU);
        if angle < turn.norm() {
            fastest = fastest.max((aside.norm() + begin.norm()).hypot(axis.dot(&shift)));
        }
    }
    fastest
}

/// Velocities are zero at the ends of a segment, and where a joint rests before and after.
fn check_velocities(plan: &Plan, segment: &Segment, s: usize, settings: &CheckSettings, log: &mut Log) {
    let waypoints = &segment.waypoints;
    for (w, waypoint) in waypoints.iter().enumerate() {
        let neighbours = w.checked_sub(1).and_then(|before| Some((&waypoints[before], waypoints.get(w + 1)?)));
        for (k, name) in plan.joint_names.iter().enumerate() {
            let velocity = waypoint.joint_velocities[k];
            let rests = neighbours.is_none_or(|(before, after)| {
                let moved = |other: &Waypoint| (other.joints[k] - waypoint.joints[k]).abs();
                moved(before).max(moved(after)) <= settings.meeting_tolerance
            });
            if rests && velocity.abs() > settings.velocity_tolerance {
                let message = format!("joint \"{name}\" has velocity {velocity:.4e} where it rests");
                let violation = Violation::new(Kind::VelocityInconsistent, message).when(Moment::at(s, w));
                log.push(violation.subjects([name.as_str()]).amount(velocity.abs(), 0.0));
            }
        }
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
    fn the_largest_speed_of_the_object_is_that_of_many_samples() {
        let mut rng = Rng::keyed(1, "object way", 0);
        let mut beyond_ends = 0;
        for _ in 0..500 {
            let mut random = |size: f64| Vector::from(rng.direction()) * size;
            let (shift, turn, arm) = (random(0.01), random(1.5), random(0.02));
            let first = Pose::new(random(0.1), random(1.0));
            let rotation = UnitQuaternion::from_scaled_axis(turn) * first.rotation;
            let last = Pose::from_parts((first.translation.vector + shift).into(), rotation);
            let speed = |t: f64| {
                let arm = UnitQuaternion::from_scaled_axis(turn * t) * first.rotation * arm;
                (shift + turn.cross(&arm)).norm()
            };
            let largest = (0..=1000).map(|i| speed(f64::from(i) / 1000.0)).fold(0.0, f64::max);
            let found = fastest_center(&first, &last, &arm);
            assert!(found >= largest - 1e-12 && found < largest + 1e-7, "{found} {largest}");
            beyond_ends += usize::from(found > speed(0.0).max(speed(1.0)) + 1e-9);
        }
        assert!(beyond_ends > 50);
    }
}
