//! Times and velocities gone wrong.

use super::Breeder;
use super::choice::{any_drive, any_waypoint, pick, pick_waypoint, waypoints_mut};
use crate::check::model::Model;
use crate::check::violation::ViolationKind::{
    JointAcceleration, JointTooFast, NotANumber, PromiseBroken, TimeOrder, TooFast, VelocityInconsistent, WrongScene,
};
use crate::plan::{Plan, Segment, SegmentKind, Waypoint};
use regrasp_base::Rng;
use regrasp_geometry::Vector;

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
            let way = longest_way(model, from, to);
            let span = way / (plan.promises.motion.largest_speed * rng.uniform(1.01, 1.2));
            let gone = to.time - from.time - span;
            shift_after(plan, s, w, -gone);
            (way > 1e-4 && gone > 0.0).then_some(())
        });
        self.add("speed promised below the motion's", &[TooFast], |plan, rng| {
            let speed = |(from, to): (&Waypoint, &Waypoint)| longest_way(model, from, to) / (to.time - from.time);
            let fastest = steps(plan).map(speed).fold(0.0, f64::max);
            plan.promises.motion.largest_speed = fastest * rng.uniform(0.9, 0.999);
            (fastest > 1e-6).then_some(())
        });
        self.add("joint velocity promised above the robot's", &[PromiseBroken], |plan, rng| {
            let drive = any_drive(model, rng, |drive| drive.velocity.is_some())?;
            plan.promises.motion.joint_velocities[drive.coordinate] = drive.velocity? * rng.uniform(1.001, 1.1);
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
            change_velocity(plan, rng, |before, after, rng| {
                (before * after > 0.0 && before.abs() > 1e-4).then(|| -0.5 * before * rng.uniform(0.1, 1.0))
            })
        });
        self.add("velocity with which the motion turns back", &[VelocityInconsistent], |plan, rng| {
            change_velocity(plan, rng, |before, after, rng| {
                let slower = if before.abs() < after.abs() { before } else { after };
                (before * after > 0.0 && slower.abs() > 1e-4).then(|| slower * rng.uniform(3.1, 4.0))
            })
        });
        self.add("velocity where a joint turns round or rests", &[VelocityInconsistent], |plan, rng| {
            change_velocity(plan, rng, |before, after, rng| (before * after <= 0.0).then(|| rng.uniform(1e-5, 1e-3)))
        });
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

fn longest_way(model: &Model, from: &Waypoint, to: &Waypoint) -> f64 {
    let ways = model
        .fingers
        .iter()
        .map(|finger| (finger.center_in_world(&to.joints) - finger.center_in_world(&from.joints)).norm());
    ways.fold(0.0, f64::max)
}

fn mean(from: &Waypoint, to: &Waypoint, k: usize) -> f64 {
    (to.joints[k] - from.joints[k]) / (to.time - from.time)
}

/// Gives some joint at some inner waypoint another velocity, by the mean velocities before and after.
fn change_velocity(plan: &mut Plan, rng: &mut Rng, change: impl Fn(f64, f64, &mut Rng) -> Option<f64>) -> Option<()> {
    let kind = if rng.chance(0.5) { SegmentKind::Transfer } else { SegmentKind::Regrasp };
    let (s, w) = pick_waypoint(plan, rng, kind)?;
    let waypoints = &mut plan.segments[s].waypoints;
    let first = rng.below(plan.joint_names.len());
    for i in 0..plan.joint_names.len() {
        let k = (first + i) % plan.joint_names.len();
        let (before, after) = (mean(&waypoints[w - 1], &waypoints[w], k), mean(&waypoints[w], &waypoints[w + 1], k));
        if let Some(velocity) = change(before, after, rng) {
            waypoints[w].joint_velocities[k] = velocity;
            return Some(());
        }
    }
    None
}
