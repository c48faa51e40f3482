//! One transfer that arrives exactly where it should, for hands that can never change their grasp.
//!
//! Soft fingertips that do not turn about their normals leave the object fewer than six directions, but which ones changes on the
//! way: the way there decides where it ends (a nonholonomic system, as a ball that rolls on a plate). The object follows a target
//! that goes to the goal with offsets that vanish at both ends; Newton's method finds the offsets with which it ends there.

use super::{Conditions, Twist, moved, step, step_to, twist_between};
use crate::in_hand::model::Model;
use crate::in_hand::state::{GraspState, Moment};
use nalgebra::{DMatrix, DVector};
use regrasp_geometry::Pose;
use regrasp_geometry::frame::PoseLine;

/// Waves of the offset, each of six numbers.
const WAVES: usize = 2;
/// Numbers sought.
const N: usize = 6 * WAVES;
/// Newton steps.
const MAX_ITERATIONS: usize = 10;
/// Distance from the goal from which on the last step is made to it, in metres.
const NEAR: f64 = 1e-6;
/// Change of a number for derivatives, in metres.
const PROBE: f64 = 1e-5;
/// Largest change of the offsets in one iteration, and largest offset, in metres. By hand.
const LARGEST_CHANGE: f64 = 0.01;
const LARGEST_OFFSET: f64 = 0.04;

/// Moments of a transfer from `start` that ends at exactly `goal`. Collisions and forces are not looked at.
pub fn arrive(model: &Model, start: &GraspState, goal: &Pose) -> Option<Vec<Moment>> {
    let mut offsets = DVector::zeros(N);
    let mut before = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        let moments = go(model, start, goal, &offsets)?;
        let error = left(model, &moments, goal);
        if error.norm() < NEAR {
            return end_at(model, start, moments, goal);
        }
        // Newton steps that lead nowhere: the goal is out of reach.
        if error.norm() > 0.9 * before {
            return None;
        }
        before = error.norm();
        let mut slopes = DMatrix::zeros(6, N);
        for k in 0..N {
            let mut probe = offsets.clone();
            probe[k] += PROBE;
            let change = left(model, &go(model, start, goal, &probe)?, goal) - error;
            slopes.set_column(k, &(change / PROBE));
        }
        let square = &slopes * slopes.transpose();
        let damping = 1e-8 * square.trace();
        let pull =
            (square + DMatrix::identity(6, 6) * damping).cholesky()?.solve(&DVector::from(error.as_slice().to_vec()));
        let change = slopes.transpose() * pull;
        offsets -= &change * (LARGEST_CHANGE / change.norm()).min(1.0);
        if offsets.norm() > LARGEST_OFFSET {
            return None;
        }
    }
    None
}

fn left(model: &Model, moments: &[Moment], goal: &Pose) -> Twist {
    moments.last().map_or_else(Twist::zeros, |last| twist_between(model, &last.world_from_object, goal))
}

/// The moments with these offsets.
fn go(model: &Model, start: &GraspState, goal: &Pose, offsets: &DVector<f64>) -> Option<Vec<Moment>> {
    let line = PoseLine::between(&start.world_from_object, goal);
    let whole = twist_between(model, &start.world_from_object, goal).norm();
    let n_steps = (1.5 * whole / model.settings.step).ceil() as usize + 1;
    let mut moments: Vec<Moment> = Vec::with_capacity(n_steps);
    let mut here = start.moment();
    for k in 1..=n_steps {
        let t = k as f64 / n_steps as f64;
        let mut offset = Twist::zeros();
        for wave in 0..WAVES {
            let height = ((wave + 1) as f64 * std::f64::consts::PI * t).sin();
            offset += Twist::from_fn(|i, _| height * offsets[6 * wave + i]);
        }
        let target = moved(model, &line.at(t), &offset);
        let conditions = Conditions::of(model, start.holding, &here)?;
        let way = conditions.project(&twist_between(model, &here.world_from_object, &target))?;
        here = step(model, start.holding, &here, &way, &conditions).ok()?;
        moments.push(here.clone());
    }
    Some(moments)
}

/// The same moments with the last one at exactly `goal`.
fn end_at(model: &Model, start: &GraspState, mut moments: Vec<Moment>, goal: &Pose) -> Option<Vec<Moment>> {
    moments.pop();
    let before = moments.last().cloned().unwrap_or_else(|| start.moment());
    moments.push(step_to(model, start.holding, &before, goal)?);
    Some(moments)
}
