//! When each waypoint is passed, and how fast.
//!
//! Between two waypoints every joint follows the cubic through its positions, velocities and times; the object follows the
//! joints' motion along their chord (`docs/reference/plan-format.md`, Time). Every segment goes from rest to rest.
//!
//! - Directions (`path`): at a waypoint the joints go along the parabola through it and its neighbours. Where that leads too
//!   far off the chords, which the search has tested, they go slower than the path, or stop.
//! - Speeds (`speeds`): a backward pass finds how fast each waypoint may be passed so that the rest can still be reached. A
//!   forward pass goes as fast as that allows. This is time-optimal up to the spacing of the waypoints (Pham and Pham 2018), for
//!   limits in closed form (`step`): velocities and accelerations of joints, speeds of fingertips and object.
//! - Last, each step is made as short as the velocities at its ends allow.

/// Closure where joints stray from their chords.
mod closure;
/// Directions at the waypoints.
mod path;
/// How fast each waypoint is passed.
mod speeds;
/// The limits of one step.
mod step;

use crate::model::Model;
use crate::tolerances::CONTACT_TOLERANCE;
use closure::is_closed_between;
use path::{Path, Stray};
use regrasp_plan::plan::{MotionLimits, Segment, SegmentKind, Waypoint};
use speeds::Speeds;

/// Least time from one waypoint to the next, in seconds.
pub const LEAST_SPAN: f64 = 1e-3;
/// Rounds in which directions are changed where the motion strays too far from the chords.
const ROUNDS: usize = 4;
/// Share of what the search leaves between it and the checker that the motion may stray from the chords.
const STRAY_SHARE: f64 = 0.75;
/// Shares of that for a segment in which a grasp does not close where the motion strays, tried one after the other.
const SMALLER_STRAYS: [f64; 2] = [0.1, 0.001];
/// How far links may turn aside of the chords in a segment of tracking, there and back, in radians: a quarter of what checkers
/// allow to contacts that do not turn.
const TRACKED_TURN: f64 = 5e-4;
/// More than rounding.
const ROUNDING: f64 = 1e-6;

/// Limits that plans promise.
pub fn limits(model: &Model) -> MotionLimits {
    let speed = &model.settings.speed;
    let robot = &model.view.hand.robot;
    let velocity = |name: &String| {
        let leader = robot.joint_named(name)?;
        let own = robot.joints[leader.0].limits.and_then(|limits| limits.velocity);
        let coupled = robot.joints.iter().filter_map(|joint| {
            let coupling = joint.coupling.as_ref().filter(|coupling| coupling.multiplier(leader) != 0.0)?;
            // All leaders may go at this speed at once.
            Some(joint.limits?.velocity? / coupling.gain())
        });
        own.into_iter().chain(coupled).reduce(f64::min)
    };
    let names = model.view.hand.joint_names();
    MotionLimits {
        largest_speed: speed.largest_speed,
        joint_velocities: names.iter().map(|name| velocity(name).unwrap_or(speed.joint_velocity)).collect(),
        joint_accelerations: vec![speed.joint_acceleration; names.len()],
    }
}

/// How far the motion may stray from the chords, in metres: the search keeps the least clearance, and leaves the contact tolerance
/// less the contact allowance.
fn largest_stray(model: &Model) -> f64 {
    let settings = &model.settings;
    STRAY_SHARE * model.least_clearance().min(CONTACT_TOLERANCE - settings.contact_allowance).max(0.0)
}

/// Gives every waypoint its time and its velocities. No step is passed faster than in `least_span` seconds.
/// `SpeedSettings::ramp` passes between segments where forces change.
pub fn assign_times(model: &Model, limits: &MotionLimits, segments: &mut [Segment], least_span: impl Fn(usize) -> f64) {
    let mut now = 0.0;
    let way = largest_stray(model);
    let mut timing = Timing { path: Path::new(model, limits), speeds: Speeds::default(), way };
    let mut before: Option<SegmentKind> = None;
    for (index, segment) in segments.iter_mut().enumerate() {
        let goes_on = (before, segment.kind) == (Some(SegmentKind::Transfer), SegmentKind::Transfer);
        if model.settings.forces.is_some() && before.is_some() && !goes_on {
            now += model.settings.speed.ramp;
        }
        before = Some(segment.kind);
        let stray = timing.stray(segment);
        timing.assign(&mut segment.waypoints, now, least_span(index), stray);
        for share in SMALLER_STRAYS {
            if is_closed_between(model, segment) {
                break;
            }
            let smaller = Stray { way: share * stray.way, ..stray };
            timing.assign(&mut segment.waypoints, now, least_span(index), smaller);
        }
        now = segment.waypoints.last().map_or(now, |last| last.time);
    }
}

/// Times of one segment after the other.
struct Timing<'m, 'a> {
    path: Path<'m, 'a>,
    speeds: Speeds,
    /// How far points of the hand may stray from the chords, in metres.
    way: f64,
}

impl Timing<'_, '_> {
    /// How far fingers may stray from the chords of a segment. In tracking, turns of its steps add up.
    fn stray(&self, segment: &Segment) -> Stray {
        let turn = match segment.kind {
            SegmentKind::Tracking => 0.5 * TRACKED_TURN / segment.waypoints.len() as f64,
            SegmentKind::Transfer | SegmentKind::Regrasp => f64::INFINITY,
        };
        Stray { way: self.way, turn }
    }

    fn assign(&mut self, waypoints: &mut [Waypoint], start: f64, least_span: f64, stray: Stray) {
        let Timing { path, speeds, .. } = self;
        path.begin(waypoints, stray);
        for round in 0.. {
            path.find_steps(waypoints, least_span);
            speeds.find(path);
            // After some rounds all that strays too far stops.
            let mut is_done = true;
            for k in 0..path.steps.len() {
                let strays = path.stray(k, speeds.speeds[k], speeds.speeds[k + 1], speeds.spans[k]);
                if strays > 1.0 + ROUNDING {
                    is_done = false;
                    path.slow_down(k, if round < ROUNDS { 1.0 / strays } else { 0.0 });
                }
            }
            if is_done {
                break;
            }
        }
        let slower = path.too_fast(waypoints, speeds);
        let n_joints = path.n_joints;
        let mut now = start;
        for (k, waypoint) in waypoints.iter_mut().enumerate() {
            now += k.checked_sub(1).map_or(0.0, |before| speeds.spans[before] * slower);
            waypoint.time = now;
            let speed = speeds.speeds[k] / slower;
            let directions = &path.directions[k * n_joints..(k + 1) * n_joints];
            waypoint.joint_velocities.clear();
            waypoint.joint_velocities.extend(directions.iter().map(|direction| direction * speed));
        }
    }
}
