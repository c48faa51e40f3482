//! Postures of any arm by damped least squares with joint limits, from many starts.

use crate::kinematics::body_frame::BodyFrame;
use crate::kinematics::chain::{Chain, JointLine, JointMotion};
use crate::kinematics::finger_ik::{Coordinates, MAX_COORDINATES};
use arrayvec::ArrayVec;
use nalgebra::{Matrix6, Vector6};
use regrasp_base::Rng;
use regrasp_geometry::Vector;
use regrasp_geometry::frame::turn_between;
use std::f64::consts::PI;

/// Joints of a chain, at most.
const MAX_JOINTS: usize = 2 * MAX_COORDINATES;
/// Metres that count as much as a radian.
const RADIAN: f64 = 0.3;
/// Most steps from one start.
const MOST_STEPS: usize = 80;
/// Largest change of a coordinate in one step.
const LONGEST_STEP: f64 = 0.7;
/// First damping, and between which bounds it stays.
const DAMPING: [f64; 3] = [1e-2, 1e-12, 1e3];
/// Steps in which the error has to halve, else the start is given up.
const PATIENCE: usize = 8;

/// Jacobian of the last body, a column per coordinate: velocity of its origin, then its angular velocity in metres.
type Jacobian = ArrayVec<Vector6<f64>, MAX_COORDINATES>;

/// How far a posture is from a pose: metres and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Miss {
    pub distance: f64,
    pub angle: f64,
}

impl Miss {
    pub fn largest(&self) -> f64 {
        self.distance.max(self.angle)
    }
}

/// The pose of the last body in a posture, and the Jacobian there.
fn linearize(chain: &Chain, joints: &[f64]) -> (BodyFrame, Jacobian) {
    let mut lines = ArrayVec::<JointLine, MAX_JOINTS>::new();
    let frame = chain.joint_lines(joints, &mut lines);
    let mut columns: Jacobian = joints.iter().map(|_| Vector6::zeros()).collect();
    for (joint, line) in chain.joints.iter().zip(&lines) {
        let (linear, angular) = match joint.motion {
            JointMotion::Turn => (line.axis.cross(&(frame.translation - line.origin)), line.axis * RADIAN),
            JointMotion::Slide => (line.axis, Vector::zeros()),
        };
        let column = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z);
        for &(k, multiplier) in &joint.drive.terms {
            columns[k] += column * multiplier;
        }
    }
    (frame, columns)
}

/// What is left to the pose, weighted, and in metres and radians.
fn error_of(frame: &BodyFrame, target: &BodyFrame) -> (Vector6<f64>, Miss) {
    let (way, turn) = (target.translation - frame.translation, turn_between(&frame.rotation, &target.rotation));
    let weighted = turn * RADIAN;
    let error = Vector6::new(way.x, way.y, way.z, weighted.x, weighted.y, weighted.z);
    (error, Miss { distance: way.norm(), angle: turn.norm() })
}

/// Distance and angle from the pose in a posture.
pub(super) fn miss(chain: &Chain, joints: &[f64], target: &BodyFrame) -> Miss {
    error_of(&chain.last_frame(joints), target).1
}

/// Steps down from `joints`, within the limits, until `tolerance` is reached or no step helps.
pub(super) fn descend(chain: &Chain, target: &BodyFrame, joints: &mut Coordinates, tolerance: f64) -> Miss {
    let [mut damping, least, most] = DAMPING;
    let (mut frame, mut columns) = linearize(chain, joints);
    let (mut error, mut miss) = error_of(&frame, target);
    let (mut halved_at, mut half) = (0, 0.5 * error.norm_squared());
    for step in 0..MOST_STEPS {
        if miss.largest() < tolerance || step - halved_at > PATIENCE {
            break;
        }
        let change = bounded_step(chain, joints, &columns, &error, damping);
        let mut tried = joints.clone();
        for (k, change) in change.iter().enumerate() {
            tried[k] = (tried[k] + change).clamp(chain.lower[k], chain.upper[k]);
        }
        let ahead = linearize(chain, &tried);
        let (error_ahead, miss_ahead) = error_of(&ahead.0, target);
        if error_ahead.norm_squared() < error.norm_squared() {
            (frame, columns) = ahead;
            (error, miss, *joints) = (error_ahead, miss_ahead, tried);
            damping = (damping * 0.2).max(least);
            if error.norm_squared() < half {
                (halved_at, half) = (step, 0.5 * error.norm_squared());
            }
        } else {
            damping *= 6.0;
            if damping > most {
                break;
            }
        }
    }
    let _ = frame;
    miss
}

/// The damped step, without joints that it would press against their limits.
fn bounded_step(chain: &Chain, joints: &[f64], columns: &Jacobian, error: &Vector6<f64>, damping: f64) -> Coordinates {
    let mut is_held: ArrayVec<bool, MAX_COORDINATES> = joints.iter().map(|_| false).collect();
    // The damping fades with the error, so that the end is quadratic.
    let damping = damping * error.norm().min(1.0);
    loop {
        let mut matrix = Matrix6::from_diagonal_element(damping + 1e-15);
        for (column, _) in columns.iter().zip(&is_held).filter(|(_, held)| !**held) {
            matrix += column * column.transpose();
        }
        let Some(solved) = matrix.cholesky().map(|cholesky| cholesky.solve(error)) else {
            return joints.iter().map(|_| 0.0).collect();
        };
        let mut step: Coordinates =
            columns.iter().zip(&is_held).map(|(column, held)| if *held { 0.0 } else { column.dot(&solved) }).collect();
        let largest = step.iter().fold(0.0, |largest: f64, change| largest.max(change.abs()));
        if largest > LONGEST_STEP {
            step.iter_mut().for_each(|change| *change *= LONGEST_STEP / largest);
        }
        let mut is_changed = false;
        for k in 0..step.len() {
            let at_limit =
                (joints[k] <= chain.lower[k] && step[k] < 0.0) || (joints[k] >= chain.upper[k] && step[k] > 0.0);
            if at_limit && !is_held[k] {
                (is_held[k], is_changed) = (true, true);
            }
        }
        if !is_changed {
            return step;
        }
    }
}

/// A posture between the limits; coordinates without limits within half a turn of zero.
pub(super) fn random_posture(chain: &Chain, rng: &mut Rng) -> Coordinates {
    let finite = |end: f64| if end.is_finite() { end } else { PI.copysign(end) };
    let drawn: Coordinates =
        chain.lower.iter().zip(&chain.upper).map(|(&low, &high)| rng.uniform(finite(low), finite(high))).collect();
    match chain.bring_within_limits(&drawn) {
        Some(brought) => brought.into_iter().collect(),
        None => drawn,
    }
}
