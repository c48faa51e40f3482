//! Times and velocities gone wrong.

use super::Breeder;
use super::choice::{any_drive, any_waypoint, pick, pick_waypoint, waypoints_mut};
use regrasp_base::Rng;
use regrasp_geometry::Vector;
use regrasp_plan::check::between::Between;
use regrasp_plan::check::model::{CheckedHand, FingerModel};
use regrasp_plan::check::violation::ViolationKind::{
    ContactOffTip, JointAcceleration, JointTooFast, NotANumber, PromiseBroken, TimeOrder, TooFast,
    VelocityInconsistent, WrongScene,
};
use regrasp_plan::plan::{ContactMode, Plan, Segment, SegmentKind, Waypoint};

/// A step between waypoints is looked at in so many parts.
const PARTS: u32 = 64;

impl Breeder<'_> {
    pub(super) fn break_times(&mut self) {
        self.break_time_order();
        self.break_speeds();
        self.break_velocities();
    }

    fn break_time_order(&mut self) {
        self.add("two times swapped", &[TimeOrder], |plan, rng| {
            let waypoints = &mut pick(&mut plan.segments, rng)?.waypoints;
            let w = rng.below(waypoints.len() - 1);
            (waypoints[w].time, waypoints[w + 1].time) = (waypoints[w + 1].time, waypoints[w].time);
            Some(())
        });
        self.add("time runs backward", &[TimeOrder], |plan, _| {
            let end = plan.segments.last()?.waypoints.last()?.time;
            waypoints_mut(plan).for_each(|waypoint| waypoint.time = end - waypoint.time);
            Some(())
        });
        self.add("time stands still", &[TimeOrder], |plan, rng| {
            let (s, w) = pick_step(plan, rng)?;
            let gone = plan.segments[s].waypoints[w + 1].time - plan.segments[s].waypoints[w].time;
            shift_after(plan, s, w, -gone);
            plan.segments[s].waypoints[w + 1].time = plan.segments[s].waypoints[w].time;
            Some(())
        });
        self.add("segment begins before the last has ended", &[TimeOrder], |plan, rng| {
            let (s, pause) = pick_pause(plan, rng)?;
            shift_from(plan, s, -pause - rng.uniform(1e-4, 1e-2));
            Some(())
        });
        self.add("no time for forces to change", &[TimeOrder], |plan, rng| {
            let (s, pause) = pick_pause(plan, rng)?;
            let force = |waypoint: &Waypoint| -> Vec<Vector> {
                let forces = waypoint.contacts.iter().map(|contact| contact.force_in_object);
                forces.map(|force| force.map_or(Vector::zeros(), Vector::from)).collect()
            };
            let (end, begin) = (force(plan.segments[s - 1].waypoints.last()?), force(&plan.segments[s].waypoints[0]));
            let changes = end.iter().zip(&begin).any(|(a, b)| (a - b).norm() > 1e-5);
            // Exactly none would be hard to hit.
            shift_from(plan, s, -pause + 1e-6);
            changes.then_some(())
        });
        self.add("time is not a number", &[NotANumber], |plan, rng| {
            any_waypoint(plan, rng)?.time = f64::NAN;
            Some(())
        });
    }

    fn break_speeds(&mut self) {
        let model = self.model;
        self.add("a step too fast", &[TooFast], |plan, rng| {
            let (s, w) = pick_step(plan, rng)?;
            let (from, to) = (&plan.segments[s].waypoints[w], &plan.segments[s].waypoints[w + 1]);
            let way = longest_way(model, &from.joints, &to.joints);
            let span = way / (plan.promises.motion.largest_speed * rng.uniform(1.01, 1.2));
            let gone = to.time - from.time - span;
            shift_after(plan, s, w, -gone);
            (way > 1e-4 && gone > 0.0).then_some(())
        });
        self.add("speed promised below the motion's", &[TooFast], |plan, rng| {
            let speed = |(from, to): (&Waypoint, &Waypoint)| {
                longest_way(model, &from.joints, &to.joints) / (to.time - from.time)
            };
            let fastest = steps(plan).map(speed).fold(0.0, f64::max);
            plan.promises.motion.largest_speed = fastest * rng.uniform(0.9, 0.999);
            (fastest > 1e-6).then_some(())
        });
        self.add("joint velocity promised above the robot's", &[PromiseBroken], |plan, rng| {
            let drive = any_drive(model, rng, |drive| drive.velocity.is_some())?;
            plan.promises.motion.joint_velocities[drive.own_coordinate()?] = drive.velocity? * rng.uniform(1.001, 1.1);
            Some(())
        });
        self.add("joint velocity promised below the motion's", &[JointTooFast], |plan, rng| {
            let k = rng.below(model.joint_names.len());
            let fastest = steps(plan).map(|(from, to)| mean(from, to, k).abs()).fold(0.0, f64::max);
            plan.promises.motion.joint_velocities[k] = fastest * rng.uniform(0.9, 0.999);
            (fastest > 1e-6).then_some(())
        });
        self.add("joint acceleration promised below the motion's", &[JointAcceleration], |plan, rng| {
            let k = rng.below(model.joint_names.len());
            let change = |(from, to): (&Waypoint, &Waypoint)| {
                (to.joint_velocities[k] - from.joint_velocities[k]).abs() / (to.time - from.time)
            };
            let largest = steps(plan).map(change).fold(0.0, f64::max);
            plan.promises.motion.joint_accelerations[k] = largest * rng.uniform(0.9, 0.99);
            (largest > 1e-2).then_some(())
        });
        self.add("no limits of motion for one joint", &[WrongScene], |plan, rng| {
            let motion = &mut plan.promises.motion;
            let limits = if rng.chance(0.5) { &mut motion.joint_velocities } else { &mut motion.joint_accelerations };
            limits.pop().map(|_| ())
        });
    }

    fn break_velocities(&mut self) {
        self.add("velocity at the end of a segment", &[VelocityInconsistent], |plan, rng| {
            let waypoints = &mut pick(&mut plan.segments, rng)?.waypoints;
            let end = if rng.chance(0.5) { waypoints.first_mut() } else { waypoints.last_mut() }?;
            *pick(&mut end.joint_velocities, rng)? += rng.uniform(1e-5, 1e-3);
            Some(())
        });
        self.add("velocity against the motion", &[VelocityInconsistent], |plan, rng| {
            change_velocities(plan, rng, |rng| -rng.uniform(0.05, 0.5))
        });
        self.add("velocity with which the motion turns back", &[VelocityInconsistent], |plan, rng| {
            change_velocities(plan, rng, |rng| rng.uniform(3.05, 4.0))
        });
        self.add("velocity where a joint rests", &[VelocityInconsistent], |plan, rng| {
            let (s, w) = pick_inner(plan, rng)?;
            let waypoints = &mut plan.segments[s].waypoints;
            let moved = |k: usize, other: usize| (waypoints[other].joints[k] - waypoints[w].joints[k]).abs();
            let resting: Vec<usize> =
                (0..waypoints[w].joints.len()).filter(|&k| moved(k, w - 1).max(moved(k, w + 1)) < 1e-9).collect();
            let k = *resting.get(rng.below(resting.len().max(1)))?;
            waypoints[w].joint_velocities[k] = rng.uniform(1e-5, 1e-3);
            Some(())
        });
        self.break_between();
        self.add("velocity is not a number", &[NotANumber], |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            *pick(&mut waypoint.joint_velocities, rng)? = f64::INFINITY;
            Some(())
        });
        self.add("velocities of one joint too few", &[WrongScene], |plan, rng| {
            any_waypoint(plan, rng)?.joint_velocities.pop().map(|_| ())
        });
    }
}

impl Breeder<'_> {
    /// All is well at the waypoints and on average, but not between.
    fn break_between(&mut self) {
        let model = self.model;
        self.add("joint accelerates too fast between waypoints only", &[JointAcceleration], |plan, rng| {
            let (s, w) = pick_inner(plan, rng)?;
            let limits = plan.promises.motion.joint_accelerations.clone();
            let waypoints = &mut plan.segments[s].waypoints;
            let span = waypoints[w + 1].time - waypoints[w].time;
            let first = rng.below(limits.len());
            for k in (0..limits.len()).map(|i| (first + i) % limits.len()) {
                let acceleration = limits[k] * rng.uniform(1.02, 1.3) * if rng.chance(0.5) { 1.0 } else { -1.0 };
                let (mean, after) = (mean(&waypoints[w], &waypoints[w + 1], k), waypoints[w + 1].joint_velocities[k]);
                // The acceleration when the cubic begins is (6 mean - 4 velocity - 2 velocity after) / span.
                let velocity = 0.25 * (6.0 * mean - 2.0 * after - acceleration * span);
                let before = std::mem::replace(&mut waypoints[w].joint_velocities[k], velocity);
                let is_whole = [w - 1, w].iter().all(|&w| !Between::new(&waypoints[w], &waypoints[w + 1]).is_broken());
                if mean.abs() > 1e-3 && is_whole && (after - velocity).abs() < limits[k] * span {
                    return Some(());
                }
                waypoints[w].joint_velocities[k] = before;
            }
            None
        });
        self.add("time squeezed until a joint accelerates too fast", &[JointAcceleration], |plan, rng| {
            let (s, w) = pick_step(plan, rng)?;
            let limits = plan.promises.motion.joint_accelerations.clone();
            let (from, mut to) = (plan.segments[s].waypoints[w].clone(), plan.segments[s].waypoints[w + 1].clone());
            let span = to.time - from.time;
            let squeezed = (1..40).map(|i| span * 0.93f64.powi(i)).find(|span| {
                to.time = from.time + span;
                let motion = Between::new(&from, &to);
                let too_fast = |(k, limit): (usize, &f64)| motion.joint(k).largest_bend() > 1.01 * limit * span * span;
                !motion.is_broken() && limits.iter().enumerate().any(too_fast)
            })?;
            shift_after(plan, s, w, squeezed - span);
            Some(())
        });
        self.add("joint too fast between waypoints only", &[JointTooFast], |plan, rng| {
            let k = rng.below(plan.joint_names.len());
            let (mut at_waypoints, mut between): (f64, f64) = (0.0, 0.0);
            for (from, to) in steps(plan) {
                let ends = from.joint_velocities[k].abs().max(to.joint_velocities[k].abs());
                at_waypoints = at_waypoints.max(ends).max(mean(from, to, k).abs());
                between = between.max(Between::new(from, to).joint(k).largest_slope() / (to.time - from.time));
            }
            plan.promises.motion.joint_velocities[k] = at_waypoints + (between - at_waypoints) * rng.uniform(0.1, 0.9);
            (at_waypoints > 1e-6 && between > 1.02 * at_waypoints).then_some(())
        });
        self.add("fingertip too fast between waypoints only", &[TooFast], |plan, rng| {
            let (mut mean, mut peak): (f64, f64) = (0.0, 0.0);
            for (from, to) in steps(plan) {
                let motion = Between::new(from, to);
                let moments: Vec<Vec<f64>> =
                    (0..=PARTS).map(|i| motion.joints_at(f64::from(i) / f64::from(PARTS))).collect();
                let span = to.time - from.time;
                mean = mean.max(longest_way(model, &from.joints, &to.joints) / span);
                let ways = moments.windows(2).map(|pair| longest_way(model, &pair[0], &pair[1]));
                peak = peak.max(ways.fold(0.0, f64::max) * f64::from(PARTS) / span);
            }
            plan.promises.motion.largest_speed = mean + (peak - mean) * rng.uniform(0.1, 0.9);
            (mean > 1e-6 && peak > 1.02 * mean).then_some(())
        });
        let expected = [ContactOffTip, JointAcceleration, VelocityInconsistent];
        self.add("velocity with which a fingertip leaves its contact", &expected, |plan, rng| {
            let tolerance = plan.promises.contact_tolerance;
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Transfer)?;
            let segment = &mut plan.segments[s];
            if w == 0 || w + 1 == segment.waypoints.len() {
                return None;
            }
            let f = rng.below(model.fingers.len());
            let span = segment.waypoints[w + 1].time - segment.waypoints[w].time;
            let waypoint = &mut segment.waypoints[w];
            let mut rates = vec![0.0; waypoint.joints.len()];
            let k = model.fingers[f].coordinates.clone().nth(rng.below(model.fingers[f].coordinates.len()))?;
            rates[k] = 1.0;
            let finger = &model.fingers[f];
            let lever = finger.path.velocity(&finger.center, &waypoint.joints, &rates).norm();
            // The cubic strays by 4/27 of the velocity that is aside, times the time.
            let aside = rng.uniform(3.0, 5.0) * tolerance / (lever * span * 4.0 / 27.0);
            waypoint.joint_velocities[k] += if rng.chance(0.5) { aside } else { -aside };
            (lever > 0.01 && waypoint.contacts[f].mode == ContactMode::Fixed).then_some(())
        });
    }
}

fn steps(plan: &Plan) -> impl Iterator<Item = (&Waypoint, &Waypoint)> {
    plan.segments.iter().flat_map(|segment| segment.waypoints.windows(2)).map(|pair| (&pair[0], &pair[1]))
}

/// A segment and a waypoint of it that has a next one.
fn pick_step(plan: &Plan, rng: &mut Rng) -> Option<(usize, usize)> {
    let s = rng.below(plan.segments.len().max(1));
    let n_steps = plan.segments.get(s)?.waypoints.len().checked_sub(1)?;
    (n_steps > 0).then(|| (s, rng.below(n_steps)))
}

/// A segment that is not the first, and the time between the one before and it.
fn pick_pause(plan: &Plan, rng: &mut Rng) -> Option<(usize, f64)> {
    let s = 1 + rng.below(plan.segments.len().checked_sub(1).filter(|&others| others > 0)?);
    Some((s, plan.segments[s].waypoints.first()?.time - plan.segments[s - 1].waypoints.last()?.time))
}

/// Adds to all times after waypoint `w` of segment `s`.
fn shift_after(plan: &mut Plan, s: usize, w: usize, by: f64) {
    plan.segments[s].waypoints[w + 1..].iter_mut().for_each(|waypoint| waypoint.time += by);
    shift_from(plan, s + 1, by);
}

fn shift_from(plan: &mut Plan, s: usize, by: f64) {
    let late = |segment: &mut Segment| segment.waypoints.iter_mut().for_each(|waypoint| waypoint.time += by);
    plan.segments[s..].iter_mut().for_each(late);
}

/// The longest way of a fingertip from one posture to another.
fn longest_way(model: &CheckedHand, from: &[f64], to: &[f64]) -> f64 {
    let way = |finger: &FingerModel| (finger.center_in_world(to) - finger.center_in_world(from)).norm();
    model.fingers.iter().map(way).fold(0.0, f64::max)
}

fn mean(from: &Waypoint, to: &Waypoint, k: usize) -> f64 {
    (to.joints[k] - from.joints[k]) / (to.time - from.time)
}

/// A segment and a waypoint of it that is not its first or last.
fn pick_inner(plan: &Plan, rng: &mut Rng) -> Option<(usize, usize)> {
    let s = rng.below(plan.segments.len().max(1));
    let n_inner = plan.segments.get(s)?.waypoints.len().checked_sub(2)?;
    (n_inner > 0).then(|| (s, 1 + rng.below(n_inner)))
}

/// Gives all joints at some inner waypoint this many times the mean velocities of the step that follows.
fn change_velocities(plan: &mut Plan, rng: &mut Rng, times: impl Fn(&mut Rng) -> f64) -> Option<()> {
    let (s, w) = pick_inner(plan, rng)?;
    let waypoints = &mut plan.segments[s].waypoints;
    let times = times(rng);
    let means: Vec<f64> = (0..plan.joint_names.len()).map(|k| mean(&waypoints[w], &waypoints[w + 1], k)).collect();
    waypoints[w].joint_velocities = means.iter().map(|mean| times * mean).collect();
    let way: f64 = means.iter().map(|mean| mean.abs()).sum::<f64>() * (waypoints[w + 1].time - waypoints[w].time);
    (way > 1e-6).then_some(())
}
