//! Small steps of a finger towards what is asked at every configuration: a fingertip that follows a surface.
//!
//! Newton steps from the present coordinates. Limits are kept as in the parent module.

use super::super::{Asked, AskedTurn, Coordinates, IkSettings, MAX_COORDINATES};
use super::{CRAWL_STEPS, State, bounded_step, linear, state_of, tip_axis};
use crate::kinematics::body_frame::BodyFrame;
use crate::kinematics::chain::Chain;
use nalgebra::{Matrix3, Matrix4};
use regrasp_geometry::{Point, Vector};

/// Newton steps of [`follow`].
const MAX_FOLLOW_STEPS: usize = 8;

/// See `FingerIk::follow`.
pub(in super::super) fn follow(
    chain: &Chain,
    center_in_body: &Point,
    start: &[f64],
    settings: &IkSettings,
    asked: impl FnMut(&BodyFrame) -> Option<Asked>,
) -> Option<Coordinates> {
    match chain.n_coordinates() {
        ..=3 => follow_in::<3>(chain, center_in_body, start, settings, asked),
        4 => follow_in::<4>(chain, center_in_body, start, settings, asked),
        5 => follow_in::<5>(chain, center_in_body, start, settings, asked),
        _ => follow_in::<MAX_COORDINATES>(chain, center_in_body, start, settings, asked),
    }
}

fn follow_in<const N: usize>(
    chain: &Chain,
    center_in_body: &Point,
    start: &[f64],
    settings: &IkSettings,
    mut asked: impl FnMut(&BodyFrame) -> Option<Asked>,
) -> Option<Coordinates> {
    let n = chain.n_coordinates();
    let (mut limits, mut coordinates) = ([(0.0, 0.0); N], [0.0; N]);
    for k in 0..n {
        // Where it stands is allowed, even inside the margin.
        limits[k] = (
            (chain.lower[k] + settings.limit_margin).min(start[k]),
            (chain.upper[k] - settings.limit_margin).max(start[k]),
        );
        coordinates[k] = start[k];
    }
    let linear = linear::kept(chain, settings.limit_margin, Some(start));
    let axis = tip_axis(center_in_body);
    let mut first_determinant = 0.0;
    let mut error_before = f64::INFINITY;
    for i in 0..MAX_FOLLOW_STEPS {
        let (mut state, frame) = state_of::<N>(chain, center_in_body, &axis, &coordinates);
        let Asked { error, arm, travel, turn } = asked(&frame)?;
        for k in 0..n {
            let spin = state.spins[k];
            state.slides[k] += spin.cross(&arm);
            if let Some(travel) = &travel {
                state.slides[k] += travel.radii * spin.cross(&travel.normal);
            }
        }
        let determinant = if n == 3 { state.slides[0].cross(&state.slides[1]).dot(&state.slides[2]) } else { 1.0 };
        if i == 0 {
            first_determinant = determinant;
        }
        let wish = settings.preference.as_ref().filter(|_| n > 3 && i == 0 && turn.is_none());
        let error_now = error.norm().max(turn.map_or(0.0, |turn| TURN_LENGTH * turn.left.abs()));
        if wish.is_none() && error_now < FOLLOW_TOLERANCE {
            let is_near = (0..n).all(|k| (coordinates[k] - start[k]).abs() <= settings.max_step);
            // Without redundancy the branches are separated by the sign of the Jacobian's determinant.
            return (is_near && determinant * first_determinant > 0.0 && linear::keeps(&linear, &coordinates))
                .then(|| coordinates[..n].iter().copied().collect());
        }
        if i > CRAWL_STEPS && error_now > 0.5 * error_before {
            return None;
        }
        error_before = error_now;
        let step = match &turn {
            None if linear.is_empty() => bounded_step(&state, &error, wish, &coordinates, &limits)?,
            None => linear::limited_step(&state, &error, wish, &coordinates, (&limits, &linear))?,
            Some(turn) => turning_step(&state, &error, turn, &coordinates, &limits)?,
        };
        for k in 0..n {
            coordinates[k] = (coordinates[k] + step[k]).clamp(limits[k].0, limits[k].1);
        }
    }
    None
}

/// The least step that makes a motion of the tip and a turn of the last body, with coordinates that would leave their limits
/// set on them. None where no step makes both.
fn turning_step<const N: usize>(
    state: &State<N>,
    error: &Vector,
    turn: &AskedTurn,
    coordinates: &[f64; N],
    limits: &[(f64, f64); N],
) -> Option<[f64; N]> {
    let column = |k: usize| state.slides[k].push(TURN_LENGTH * turn.axis.dot(&state.spins[k]));
    let mut left = error.push(TURN_LENGTH * turn.left);
    let mut step = [0.0; N];
    let mut free = [true; N];
    loop {
        let square: Matrix4<f64> = (0..N).filter(|&k| free[k]).map(|k| column(k) * column(k).transpose()).sum();
        // Not positive definite near a singularity.
        let least = LEAST_PIVOT * square.trace();
        let pull = (square - Matrix4::identity() * least).cholesky()?.solve(&left);
        let mut worst = (0.0, None);
        for k in (0..N).filter(|&k| free[k]) {
            step[k] = column(k).dot(&pull);
            let goal = coordinates[k] + step[k];
            let excess = (limits[k].0 - goal).max(goal - limits[k].1);
            if excess > worst.0 {
                worst = (excess, Some(k));
            }
        }
        let Some(k) = worst.1 else { return Some(step) };
        free[k] = false;
        step[k] = (coordinates[k] + step[k]).clamp(limits[k].0, limits[k].1) - coordinates[k];
        left -= column(k) * step[k];
    }
}

/// Length at which a turn counts like a motion, in metres: about that of a fingertip.
const TURN_LENGTH: f64 = 0.01;
/// Least pivot of the equations of [`turning_step`], as a share of their sum.
const LEAST_PIVOT: f64 = 1e-9;

/// See `FingerIk::turn_per_motion`.
pub(in super::super) fn turn_per_motion(
    chain: &Chain,
    center_in_body: &Point,
    coordinates: &[f64],
    arm: &Vector,
    axis: &Vector,
) -> Option<Vector> {
    let state = state_of::<MAX_COORDINATES>(chain, center_in_body, &tip_axis(center_in_body), coordinates).0;
    let (mut square, mut along) = (Matrix3::zeros(), Vector::zeros());
    for (slide, spin) in state.slides.iter().zip(&state.spins) {
        let moved = slide + spin.cross(arm);
        square += moved * moved.transpose();
        along += moved * spin.dot(axis);
    }
    let least = LEAST_PIVOT * square.trace();
    Some((square - Matrix3::identity() * least).cholesky()?.solve(&along))
}

/// Error at which [`follow`] ends, in metres.
const FOLLOW_TOLERANCE: f64 = 1e-9;
