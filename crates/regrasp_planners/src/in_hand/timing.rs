//! When each waypoint is passed, and how fast.
//!
//! Every segment goes from rest to rest. Between two waypoints it takes at least as long as the speed limits ask; the
//! pace rises from nothing and falls to nothing evenly, within [`EASE`]. Velocities are those of the monotone cubic
//! through the waypoints (Fritsch, Butland, *A method for constructing local monotone piecewise cubic interpolants*,
//! 1984), so that cubic Hermite interpolation overshoots nowhere; where they change from one waypoint to the next faster, on
//! average, than the acceleration limits allow, time is stretched. Peaks of the acceleration in between are not limited.

use super::model::Model;
use regrasp_geometry::{Point, Pose, frame};
use regrasp_plan::plan::{MotionLimits, Segment, SegmentKind, Waypoint};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Time in which the pace of a segment rises and falls, in seconds: a fraction of what a transfer takes.
const EASE: f64 = 0.1;
/// Least time from one waypoint to the next, in seconds.
pub const LEAST_SPAN: f64 = 1e-3;
/// Peak of the velocity of a cubic from rest to rest over its mean.
const PEAK: f64 = 1.5;
/// Rounds in which single spans are stretched before whole segments are.
const ROUNDS: usize = 12;
/// Largest stretch of a span in a round.
const MOST_STRETCH: f64 = 2.0;

/// Limits that plans promise.
pub fn limits(model: &Model) -> MotionLimits {
    let speed = &model.settings.speed;
    let robot = &model.scene.hand.robot;
    let velocity = |name: &String| {
        let leader = robot.joint_named(name)?;
        let own = robot.joints[leader.0].limits.and_then(|limits| limits.velocity);
        let coupled = robot.joints.iter().filter_map(|joint| {
            let mimic = joint.mimic.filter(|mimic| mimic.joint == leader && mimic.multiplier != 0.0)?;
            Some(joint.limits?.velocity? / mimic.multiplier.abs())
        });
        own.into_iter().chain(coupled).reduce(f64::min)
    };
    let names = model.scene.hand.joint_names();
    MotionLimits {
        largest_speed: speed.largest_speed,
        joint_velocities: names.iter().map(|name| velocity(name).unwrap_or(speed.joint_velocity)).collect(),
        joint_accelerations: vec![speed.joint_acceleration; names.len()],
    }
}

/// Gives every waypoint its time and its velocities, `least_span` seconds or more apart; `SpeedSettings::ramp` passes between segments where forces change.
pub fn assign_times(model: &Model, limits: &MotionLimits, segments: &mut [Segment], least_span: impl Fn(usize) -> f64) {
    let mut now = 0.0;
    let mut timing = Timing::new(model, limits);
    let mut before: Option<SegmentKind> = None;
    for (index, segment) in segments.iter_mut().enumerate() {
        let goes_on = (before, segment.kind) == (Some(SegmentKind::Transfer), SegmentKind::Transfer);
        if model.settings.forces.is_some() && before.is_some() && !goes_on {
            now += model.settings.speed.ramp;
        }
        before = Some(segment.kind);
        timing.least_span = least_span(index);
        timing.assign(&mut segment.waypoints, now);
        now = segment.waypoints.last().map_or(now, |last| last.time);
    }
}

/// Times of one segment after the other.
struct Timing<'m, 'a> {
    model: &'m Model<'a>,
    limits: &'m MotionLimits,
    least_span: f64,
    /// Least time from each waypoint to the next.
    spans: Vec<f64>,
    /// Time of each waypoint after the first.
    times: Vec<f64>,
    /// Velocities, waypoint by waypoint.
    velocities: Vec<f64>,
}

impl<'m, 'a> Timing<'m, 'a> {
    fn new(model: &'m Model<'a>, limits: &'m MotionLimits) -> Self {
        Timing { model, limits, least_span: LEAST_SPAN, spans: Vec::new(), times: Vec::new(), velocities: Vec::new() }
    }

    fn assign(&mut self, waypoints: &mut [Waypoint], start: f64) {
        self.spans.clear();
        for pair in waypoints.windows(2) {
            self.spans.push(self.least_span(&pair[0], &pair[1]));
        }
        for round in 0.. {
            self.ease();
            self.find_velocities(waypoints);
            let most = self.stretch(waypoints.len(), MOST_STRETCH);
            if most <= 1.0 {
                break;
            }
            if round == ROUNDS {
                // Slower by so much everywhere, accelerations fall with the square.
                let slower = most.sqrt() * (1.0 + 1e-9);
                self.times.iter_mut().for_each(|time| *time *= slower);
                self.velocities.iter_mut().for_each(|velocity| *velocity /= slower);
                break;
            }
        }
        let n_joints = self.limits.joint_velocities.len();
        for (k, waypoint) in waypoints.iter_mut().enumerate() {
            waypoint.time = start + self.times[k];
            waypoint.joint_velocities.clear();
            waypoint.joint_velocities.extend_from_slice(&self.velocities[k * n_joints..(k + 1) * n_joints]);
        }
    }

    /// Time that the limits of speed and of joint velocities ask for between two waypoints.
    fn least_span(&self, from: &Waypoint, to: &Waypoint) -> f64 {
        let mut way = self.object_way(from, to);
        let mut span = self.least_span;
        let mut first = 0;
        for (finger, of_model) in self.model.fingers.iter().enumerate() {
            let range = first..first + of_model.ik.chain().n_coordinates();
            first = range.end;
            let (a, b) = (&from.joints[range.clone()], &to.joints[range.clone()]);
            if a == b {
                continue;
            }
            way = way.max(self.tip_way(finger, a, b));
            for ((a, b), velocity) in a.iter().zip(b).zip(&self.limits.joint_velocities[range]) {
                span = span.max(PEAK * (b - a).abs() / velocity);
            }
        }
        span.max(way / self.limits.largest_speed)
    }

    /// How far a point of the object can go, no farther from the centre of mass than its radius.
    fn object_way(&self, from: &Waypoint, to: &Waypoint) -> f64 {
        if from.world_from_object == to.world_from_object {
            return 0.0;
        }
        let (from, to) = (Pose::from(&from.world_from_object), Pose::from(&to.world_from_object));
        let center: &Point = &self.model.frame.center_of_mass;
        let angle = frame::rotation_between(&from, &to).norm();
        (from * center - to * center).norm() + angle * self.model.frame.torque_scale
    }

    /// How far a fingertip's centre goes, by way of the middle of the step.
    fn tip_way(&self, finger: usize, from: &[f64], to: &[f64]) -> f64 {
        let ik = self.model.fingers[finger].ik;
        let middle: Coordinates = from.iter().zip(to).map(|(a, b)| 0.5 * (a + b)).collect();
        let [from, middle, to] = [from, &middle, to].map(|joints| ik.tip(joints));
        (middle - from).norm() + (to - middle).norm()
    }

    /// Times at which the spans are over, at a pace that rises and falls evenly and is at most one.
    fn ease(&mut self) {
        self.times.clear();
        let total: f64 = self.spans.iter().sum();
        let eased = |done: f64| (2.0 * EASE * done).sqrt();
        let (half, end) =
            if total > EASE { (0.5 * EASE, total + EASE) } else { (0.5 * total, 2.0 * eased(0.5 * total)) };
        let mut done = 0.0;
        self.times.push(0.0);
        for (k, span) in self.spans.iter().enumerate() {
            done += span;
            self.times.push(if k + 1 == self.spans.len() {
                end
            } else if done <= half {
                eased(done)
            } else if done >= total - half {
                end - eased((total - done).max(0.0))
            } else {
                done + 0.5 * EASE
            });
        }
    }

    /// Velocities at the waypoints: zero at both ends and where a joint turns back, else the weighted harmonic mean of the
    /// mean velocities before and after.
    fn find_velocities(&mut self, waypoints: &[Waypoint]) {
        let n_joints = self.limits.joint_velocities.len();
        self.velocities.clear();
        self.velocities.resize(waypoints.len() * n_joints, 0.0);
        for k in 1..waypoints.len().saturating_sub(1) {
            let (before, after) = (self.times[k] - self.times[k - 1], self.times[k + 1] - self.times[k]);
            let (weight_before, weight_after) = (before + 2.0 * after, 2.0 * before + after);
            for j in 0..n_joints {
                let [a, b, c] = [k - 1, k, k + 1].map(|k| waypoints[k].joints[j]);
                let (slope_before, slope_after) = ((b - a) / before, (c - b) / after);
                if slope_before * slope_after > 0.0 {
                    // The longer span counts less: Fritsch and Butland, 1984, eq. 2 with Brodlie's weights.
                    let sum = weight_before / slope_before + weight_after / slope_after;
                    self.velocities[k * n_joints + j] = (weight_before + weight_after) / sum;
                }
            }
        }
    }

    /// Stretches the spans in which accelerations are above their limits; the largest acceleration over its limit.
    fn stretch(&mut self, n_waypoints: usize, most_stretch: f64) -> f64 {
        let n_joints = self.limits.joint_velocities.len();
        let mut most: f64 = 0.0;
        for k in 0..n_waypoints.saturating_sub(1) {
            let span = self.times[k + 1] - self.times[k];
            let (from, to) = self.velocities[k * n_joints..(k + 2) * n_joints].split_at(n_joints);
            let accelerations = from.iter().zip(to).zip(&self.limits.joint_accelerations);
            let over = accelerations.map(|((a, b), limit)| (b - a).abs() / (span * limit)).fold(0.0, f64::max);
            if over > 1.0 {
                self.spans[k] *= (1.05 * over.sqrt()).min(most_stretch);
            }
            most = most.max(over);
        }
        most
    }
}
