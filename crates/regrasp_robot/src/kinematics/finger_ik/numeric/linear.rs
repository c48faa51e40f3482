//! Steps of chains whose limits bind several coordinates at once.
//!
//! Limits that a step would break become equations, the worst one first. The step is then what meets the equations, plus the
//! damped least-squares step across their normals.

use super::{Coordinates, Preference, State, free_step};
use crate::coupling::LinearLimit;
use crate::kinematics::chain::{Chain, ChainJoint, JointMotion};
use arrayvec::ArrayVec;
use regrasp_geometry::Vector;

/// How far inside its limits a sum is aimed at: more than rounding.
const INSIDE: f64 = 1e-12;
/// Excess over a limit that is rounding.
const ROUNDING: f64 = 1e-15;
/// Length of a normal, of unit length before, across the others below which it adds no equation.
const DEPENDENT: f64 = 1e-9;

/// The limits of sums of `chain`'s coordinates that a search keeps: `margin` inside, or where `start` is if that is nearer.
pub(super) fn kept(chain: &Chain, margin: f64, start: Option<&[f64]>) -> Vec<LinearLimit> {
    let tightened = |limit: &LinearLimit| {
        let gain: f64 = limit.terms.iter().map(|(_, multiplier)| multiplier.abs()).sum();
        let mut limit = limit.clone();
        (limit.lower, limit.upper) = (limit.lower + margin * gain, limit.upper - margin * gain);
        if let Some(start) = start {
            let sum = limit.sum(start);
            (limit.lower, limit.upper) = (limit.lower.min(sum), limit.upper.max(sum));
        }
        limit
    };
    chain.linear_limits.iter().map(tightened).collect()
}

/// True when `coordinates` keep all limits.
pub(super) fn keeps(limits: &[LinearLimit], coordinates: &[f64]) -> bool {
    limits.iter().all(|limit| limit.room(coordinates) >= 0.0)
}

/// A limit as an inequality: the product of the normal with the step is at most `most`.
struct Row<const N: usize> {
    normal: [f64; N],
    most: f64,
}

/// The step to the target that keeps the limits of coordinates and of their sums. None where they leave no step.
pub(super) fn limited_step<const N: usize>(
    state: &State<N>,
    error: &Vector,
    preference: Option<&Preference>,
    coordinates: &[f64; N],
    (limits, linear): (&[(f64, f64); N], &[LinearLimit]),
) -> Option<[f64; N]> {
    let rows = rows(coordinates, limits, linear);
    let mut active: ArrayVec<usize, N> = ArrayVec::new();
    // Orthonormal basis of the active normals, and the part of the step that they fix.
    let mut basis: ArrayVec<[f64; N], N> = ArrayVec::new();
    let mut fixed = [0.0; N];
    loop {
        let (mut slides, mut spins, mut left) = (state.slides, state.spins, *error);
        for k in 0..N {
            left -= state.slides[k] * fixed[k];
        }
        for unit in &basis {
            let along = |columns: &[Vector; N]| columns.iter().zip(unit).map(|(column, u)| column * *u).sum::<Vector>();
            let (slide, spin) = (along(&slides), along(&spins));
            for k in 0..N {
                slides[k] -= slide * unit[k];
                spins[k] -= spin * unit[k];
            }
        }
        let moved = free_step(&slides, &spins, &state.tip_axis, &left, preference)?;
        let step: [f64; N] = std::array::from_fn(|k| fixed[k] + moved[k]);
        let mut worst = (ROUNDING, None);
        for (index, row) in rows.iter().enumerate().filter(|(index, _)| !active.contains(index)) {
            let excess = product(&row.normal, &step) - row.most;
            if excess > worst.0 {
                worst = (excess, Some(index));
            }
        }
        let Some(index) = worst.1 else { return Some(step) };
        let row = &rows[index];
        let mut across = row.normal;
        for unit in &basis {
            let along = product(&across, unit);
            (0..N).for_each(|k| across[k] -= along * unit[k]);
        }
        let length = product(&across, &across).sqrt();
        if length < DEPENDENT || basis.is_full() {
            return None;
        }
        let unit: [f64; N] = across.map(|value| value / length);
        let missing = (row.most - product(&row.normal, &fixed)) / length;
        (0..N).for_each(|k| fixed[k] += missing * unit[k]);
        basis.push(unit);
        active.push(index);
    }
}

fn product<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// All limits, with normals of unit length.
fn rows<const N: usize>(coordinates: &[f64; N], limits: &[(f64, f64); N], linear: &[LinearLimit]) -> Vec<Row<N>> {
    let mut rows = Vec::with_capacity(2 * (N + linear.len()));
    let mut add = |normal: [f64; N], lower: f64, upper: f64, at: f64| {
        rows.push(Row { normal, most: upper - at });
        rows.push(Row { normal: normal.map(|value| -value), most: at - lower });
    };
    for k in 0..N {
        let unit = std::array::from_fn(|j| if j == k { 1.0 } else { 0.0 });
        add(unit, limits[k].0, limits[k].1, coordinates[k]);
    }
    for limit in linear {
        let mut normal = [0.0; N];
        limit.terms.iter().for_each(|&(k, multiplier)| normal[k] = multiplier);
        let length = product(&normal, &normal).sqrt();
        let normal = normal.map(|value| value / length);
        let (lower, upper) = (limit.lower / length + INSIDE, limit.upper / length - INSIDE);
        add(normal, lower, upper, limit.sum(coordinates) / length);
    }
    rows
}

/// Turns of all joints per unit of each coordinate, where some joint follows several leaders or turns against one: the last body
/// then turns less than those before it.
pub(super) fn opposed_turns(chain: &Chain) -> Option<Coordinates> {
    let is_plain = |joint: &ChainJoint| joint.drive.single().is_some_and(|(_, multiplier)| multiplier >= 0.0);
    if chain.joints.iter().all(is_plain) {
        return None;
    }
    let turns = chain.joints.iter().filter(|joint| joint.motion == JointMotion::Turn);
    let terms: Vec<(usize, f64)> = turns.flat_map(|joint| joint.drive.terms.iter().copied()).collect();
    let sum = |k: usize| terms.iter().filter(|term| term.0 == k).map(|term| term.1.abs()).sum();
    Some((0..chain.n_coordinates()).map(sum).collect())
}
