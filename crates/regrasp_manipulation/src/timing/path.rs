//! Where the joints go at the waypoints of a segment, and what limits the steps between.

/// By how much a segment must be slower.
mod slower;

use crate::model::Model;
use crate::timing::step::{Row, StepLimits, TipRow};
use regrasp_geometry::{Pose, Vector, frame};
use regrasp_plan::plan::{MotionLimits, Waypoint};
use regrasp_robot::kinematics::chain::JointMotion;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::ops::Range;

/// Share of the largest speed of fingertips and object that is aimed at. It is exact at waypoints, and the checker counts what it
/// does not know.
const AIMED_AT: f64 = 0.985;
/// Moments of a step, beside waypoints, at which fingertips aim at it.
const MOMENTS: [f64; 3] = [0.25, 0.5, 0.75];
/// Share of the largest speed that fingertips keep in the end.
const KEPT: f64 = 0.993;
/// Looks at the fingertips in a step for that, of any length, and of one longer than this, in radians or metres of all joints.
const LOOKS: [usize; 2] = [8, 16];
const LONG_STEP: f64 = 0.12;
/// Joints nearer to their limits than this do not go beyond where the waypoints are, in radians or metres.
const NEAR_LIMIT: f64 = 0.02;
/// Links are about this thick, in metres.
const LINK_RADIUS: f64 = 0.01;
/// Rounding of shares of what fingers may stray.
const SHARE_ROUNDING: f64 = 1e-9;
/// With velocities up to this many times the mean ones on both sides cubics never turn back (Fritsch and Carlson 1980).
const MONOTONE: f64 = 1.5;
/// A waypoint at which joints would go slower than this share of the path's speed is one at which they stop.
const LEAST_SHARE: f64 = 0.05;

/// How far fingers may stray from the chords.
#[derive(Debug, Clone, Copy)]
pub struct Stray {
    /// Any point of them, in metres.
    pub way: f64,
    /// Any link of them, in radians.
    pub turn: f64,
}

/// A finger with what the timing asks of it.
struct Finger {
    coordinates: Range<usize>,
    /// By coordinate: how far any link of the finger turns at most per unit of it, in radians.
    turns: Vec<f64>,
}

/// The path of a segment.
pub struct Path<'m, 'a> {
    model: &'m Model<'a>,
    limits: &'m MotionLimits,
    fingers: Vec<Finger>,
    /// Number of joints.
    pub n_joints: usize,
    /// Steps between waypoints.
    pub steps: Vec<StepLimits>,
    /// Waypoint by waypoint and joint by joint, the velocity at path speed one.
    pub directions: Vec<f64>,
    /// Waypoints at which the joints stop.
    pub stops: Vec<bool>,
    /// Largest path speed of each waypoint.
    pub caps: Vec<f64>,
    /// Step by step and joint by joint, the chord's direction.
    chords: Vec<f64>,
    lengths: Vec<f64>,
    /// How far fingers stray from the chord of a step per path speed at its ends and second, as shares of what they may.
    strays: Vec<Vec<[f64; 2]>>,
    allowed: Stray,
}

impl<'m, 'a> Path<'m, 'a> {
    /// For the segments of one plan.
    pub fn new(model: &'m Model<'a>, limits: &'m MotionLimits) -> Self {
        let mut first = 0;
        let finger = |of_model: &crate::model::FingerModel| {
            let chain = of_model.ik.chain();
            let coordinates = first..first + chain.n_coordinates();
            first = coordinates.end;
            let mut turns = vec![0.0; chain.n_coordinates()];
            for joint in chain.joints.iter().filter(|joint| joint.motion == JointMotion::Turn) {
                joint.drive.terms.iter().for_each(|&(k, multiplier)| turns[k] += multiplier.abs());
            }
            Finger { coordinates, turns }
        };
        let fingers: Vec<Finger> = model.fingers.iter().map(finger).collect();
        Path {
            model,
            limits,
            fingers,
            n_joints: limits.joint_velocities.len(),
            steps: Vec::new(),
            directions: Vec::new(),
            stops: Vec::new(),
            caps: Vec::new(),
            chords: Vec::new(),
            lengths: Vec::new(),
            strays: Vec::new(),
            allowed: Stray { way: 0.0, turn: 0.0 },
        }
    }

    /// The chords of a segment, and directions at its waypoints that stray no farther than allowed.
    pub fn begin(&mut self, waypoints: &[Waypoint], allowed: Stray) {
        let n = self.n_joints;
        self.allowed = allowed;
        self.chords.clear();
        self.lengths.clear();
        for pair in waypoints.windows(2) {
            let changes = pair[0].joints.iter().zip(&pair[1].joints).map(|(a, b)| b - a);
            let length = changes.clone().map(|change| change * change).sum::<f64>().sqrt();
            // Shorter ones are rounding.
            let length = if length > 1e-8 { length } else { 0.0 };
            self.lengths.push(length);
            self.chords.extend(changes.map(|change| if length > 0.0 { change / length } else { 0.0 }));
        }
        self.directions.clear();
        self.directions.resize(waypoints.len() * n, 0.0);
        self.stops.clear();
        self.stops.resize(waypoints.len(), true);
        for k in 1..waypoints.len().saturating_sub(1) {
            self.find_direction(k, &waypoints[k]);
        }
    }

    /// The direction of the parabola through waypoint `k` and its neighbours, by length of the chords. Where that strays too far,
    /// the direction from the one neighbour to the other: it strays less from the longer chord.
    fn find_direction(&mut self, k: usize, waypoint: &Waypoint) {
        let n = self.n_joints;
        let [before, after] = [self.lengths[k - 1], self.lengths[k]];
        if before == 0.0 || after == 0.0 {
            return;
        }
        let chords = [&self.chords[(k - 1) * n..k * n], &self.chords[k * n..(k + 1) * n]];
        let blend = |weights: [f64; 2]| {
            let blended = chords[0].iter().zip(chords[1]);
            let blended = blended.map(|(a, b)| (weights[0] * a + weights[1] * b) / (before + after)).collect();
            let direction = self.within_limits(blended, chords, &waypoint.joints);
            let turns_back = chords.iter().any(|chord| dot(chord, &direction) <= 0.0);
            // Two such ends stray by a quarter of this.
            let off = chords
                .iter()
                .zip([before, after])
                .map(|(chord, length)| 0.25 * length * self.off_chord(&waypoint.joints, chord, &direction));
            (if turns_back { f64::INFINITY } else { off.fold(0.0, f64::max) }, direction)
        };
        let mut best = blend([after, before]);
        if best.0 > 1.0 {
            let other = blend([before, after]);
            best = if other.0 < best.0 { other } else { best };
        }
        let share = if best.0 > 1.0 { 1.0 / best.0 } else { 1.0 };
        if share >= LEAST_SHARE {
            self.stops[k] = false;
            let own = &mut self.directions[k * n..(k + 1) * n];
            own.iter_mut().zip(&best.1).for_each(|(own, direction)| *own = share * direction);
        }
    }

    /// A direction with which joints that are near their limits do not go beyond where the waypoints are.
    fn within_limits(&self, mut direction: Vec<f64>, chords: [&[f64]; 2], joints: &[f64]) -> Vec<f64> {
        for (finger, of_model) in self.fingers.iter().zip(&self.model.fingers) {
            let chain = of_model.ik.chain();
            // A sum near its limit goes nowhere but along the chords: its coordinates stop.
            let own = &joints[finger.coordinates.clone()];
            for limit in chain.linear_limits.iter().filter(|limit| limit.room(own) < NEAR_LIMIT) {
                limit.terms.iter().for_each(|(j, _)| direction[finger.coordinates.start + j] = 0.0);
            }
            for (j, k) in finger.coordinates.clone().enumerate() {
                if (joints[k] - chain.lower[j]).min(chain.upper[j] - joints[k]) < NEAR_LIMIT {
                    let (a, b) = (chords[0][k], chords[1][k]);
                    let most = if a * b > 0.0 { MONOTONE * a.abs().min(b.abs()) } else { 0.0 };
                    direction[k] = direction[k].clamp(-most, most);
                }
            }
        }
        direction
    }

    /// How far any finger goes at most aside of the chord per unit of the path, as a share of what it may.
    fn off_chord(&self, joints: &[f64], chord: &[f64], direction: &[f64]) -> f64 {
        let of_finger = |f: usize| self.finger_off_chord(f, joints, chord, direction);
        (0..self.fingers.len()).map(of_finger).fold(0.0, f64::max)
    }

    fn finger_off_chord(&self, f: usize, joints: &[f64], chord: &[f64], direction: &[f64]) -> f64 {
        let (finger, ik) = (&self.fingers[f], self.model.fingers[f].ik);
        let along = dot(chord, direction);
        let off: Coordinates = finger.coordinates.clone().map(|k| direction[k] - along * chord[k]).collect();
        if off.iter().all(|off| *off == 0.0) {
            return 0.0;
        }
        let way = ik.displacement(&joints[finger.coordinates.clone()], &off, LINK_RADIUS);
        let turn: f64 = off.iter().zip(&finger.turns).map(|(off, per_unit)| off.abs() * per_unit).sum();
        (way / self.allowed.way).max(turn / self.allowed.turn)
    }

    /// What limits the steps and the waypoints.
    pub fn find_steps(&mut self, waypoints: &[Waypoint], least_span: f64) {
        let n = self.n_joints;
        self.steps.clear();
        self.strays.clear();
        self.caps.clear();
        self.caps.resize(waypoints.len(), f64::INFINITY);
        for k in 0..waypoints.len() {
            let direction = &self.directions[k * n..(k + 1) * n];
            if self.stops[k] {
                continue;
            }
            let of_joint = |(velocity, direction): (&f64, &f64)| velocity / direction.abs();
            let mut cap =
                self.limits.joint_velocities.iter().zip(direction).map(of_joint).fold(f64::INFINITY, f64::min);
            for (finger, of_model) in self.fingers.iter().zip(&self.model.fingers) {
                let own = &direction[finger.coordinates.clone()];
                if own.iter().all(|direction| *direction == 0.0) {
                    continue;
                }
                let jacobian = of_model.ik.tip_jacobian(&waypoints[k].joints[finger.coordinates.clone()]);
                cap = cap.min(AIMED_AT * self.limits.largest_speed / speed(&jacobian, own).norm());
            }
            self.caps[k] = cap;
        }
        for k in 0..self.lengths.len() {
            let step = self.step(k, &waypoints[k], &waypoints[k + 1], least_span);
            self.steps.push(step);
        }
    }

    fn step(&mut self, k: usize, from: &Waypoint, to: &Waypoint, least_span: f64) -> StepLimits {
        let n = self.n_joints;
        let (length, tip_speed) = (self.lengths[k], AIMED_AT * self.limits.largest_speed);
        let object = self.object_way(from, to) / tip_speed;
        // The object's parameter is nowhere faster than the least time and its largest speed allow.
        let least = least_span.max(object);
        if length == 0.0 {
            self.strays.push(vec![[0.0; 2]; self.fingers.len()]);
            return StepLimits { least_span: least, ..StepLimits::default() };
        }
        let (from_joints, to_joints) = (&from.joints, &to.joints);
        let chord = &self.chords[k * n..(k + 1) * n];
        let ends = [k, k + 1].map(|k| &self.directions[k * n..(k + 1) * n]);
        let mut rows: Vec<Row> = (0..n)
            .map(|j| Row {
                chord: chord[j],
                ends: [ends[0][j], ends[1][j]],
                velocity: self.limits.joint_velocities[j],
                acceleration: self.limits.joint_accelerations[j],
            })
            .filter(|row| row.chord != 0.0 || row.ends != [0.0; 2])
            .collect();
        let along = ends.map(|end| dot(chord, end));
        rows.push(Row { chord: 1.0, ends: along, velocity: length / least, acceleration: f64::INFINITY });
        let mut tips = Vec::new();
        for (finger, of_model) in self.fingers.iter().zip(&self.model.fingers) {
            let range = finger.coordinates.clone();
            let own = [chord, ends[0], ends[1]].map(|direction| &direction[range.clone()]);
            if own.iter().all(|direction| direction.iter().all(|value| *value == 0.0)) {
                continue;
            }
            let (from, to) = (&from.joints[range.clone()], &to.joints[range]);
            for moment in MOMENTS {
                let there: Coordinates = from.iter().zip(to).map(|(a, b)| a + moment * (b - a)).collect();
                let jacobian = of_model.ik.tip_jacobian(&there);
                let [chord, first, last] = own.map(|direction| speed(&jacobian, direction));
                tips.push(TipRow { moment, chord, ends: [first, last] });
            }
        }
        let off = |f| {
            [(from_joints, ends[0]), (to_joints, ends[1])]
                .map(|(joints, end)| self.finger_off_chord(f, joints, chord, end))
        };
        let strays = (0..self.fingers.len()).map(off).collect();
        self.strays.push(strays);
        StepLimits { length, rows, tips, tip_speed, least_span }
    }

    /// How fast a point of the object goes at most, no farther from the centre of mass than its radius, in metres per unit of the
    /// object's parameter.
    fn object_way(&self, from: &Waypoint, to: &Waypoint) -> f64 {
        if from.world_from_object == to.world_from_object {
            return 0.0;
        }
        let [from, to] = [from, to].map(|waypoint| Pose::from(&waypoint.world_from_object));
        let turn = frame::rotation_between(&from, &to);
        let shift = to.translation.vector - from.translation.vector;
        let center = &self.model.frame.center_of_mass;
        // The arm turns by a small angle: its middle is along the sum of its ends.
        let arms = [from, to].map(|pose| pose.rotation * center.coords);
        let middle = (arms[0] + arms[1]) * 0.5;
        let fastest = [arms[0], middle, arms[1]].map(|arm| (shift + turn.cross(&arm)).norm()).into_iter();
        fastest.fold(0.0, f64::max) + turn.norm() * self.model.frame.torque_scale
    }

    /// How far the fingers stray at most from where they would be on the chord of step `k`, with these path speeds at its ends, as
    /// a share of what they may.
    ///
    /// Across the chord the cubic has no change, only its two ends' velocities: `T u (1 - u)^2` times one and `T u^2 (1 - u)` times
    /// the other. A single one strays by 4/27 of that, two equal ones by 1/4.
    pub fn stray(&self, k: usize, first: f64, last: f64, span: f64) -> f64 {
        let most = |[a, b]: &[f64; 2]| {
            let (a, b) = (a * first * span, b * last * span);
            (0.25 * a.max(b)).min(4.0 / 27.0 * (a + b))
        };
        self.strays[k].iter().map(most).fold(0.0, f64::max)
    }

    /// True where the fingers stray no farther than they may when the first path speed is this share of both, and the step lasts
    /// twice its length over their sum.
    pub fn allows(&self, k: usize, share: f64) -> bool {
        self.stray(k, share, 1.0 - share, 2.0 * self.lengths[k]) <= 1.0 + SHARE_ROUNDING
    }

    /// Makes the directions at both ends of step `k` this much shorter; where little is left, the joints stop.
    pub fn slow_down(&mut self, k: usize, share: f64) {
        let n = self.n_joints;
        for k in [k, k + 1] {
            let direction = &mut self.directions[k * n..(k + 1) * n];
            let length = |direction: &[f64]| direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            let left = share * length(direction);
            if left < LEAST_SHARE {
                self.stops[k] = true;
            }
            let share = if left < LEAST_SHARE { 0.0 } else { share };
            direction.iter_mut().for_each(|value| *value *= share);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn speed(jacobian: &[Vector], rates: &[f64]) -> Vector {
    jacobian.iter().zip(rates).map(|(column, rate)| column * *rate).sum()
}
