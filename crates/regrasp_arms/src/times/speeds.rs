//! The largest speeds along a path: a backward pass over what can still stop in time, then a forward pass as fast as that allows
//! (TOPP-RA: Pham, Pham 2018, algorithm 1).

use super::rounded::GridPoint;

/// A limit of a sum of joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Joints and their multipliers.
    pub terms: Vec<(usize, f64)>,
    /// Largest velocity.
    pub velocity: f64,
    /// Largest acceleration; infinite without a limit.
    pub acceleration: f64,
}

/// What limits speeds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Limits {
    /// One row for each joint, then sums.
    pub rows: Vec<Row>,
}

impl Limits {
    /// Limits of single joints.
    pub fn of_joints(velocities: &[f64], accelerations: &[f64]) -> Self {
        let row = |(k, (&velocity, &acceleration)): (usize, (&f64, &f64))| Row {
            terms: vec![(k, 1.0)],
            velocity,
            acceleration,
        };
        Limits { rows: velocities.iter().zip(accelerations).enumerate().map(row).collect() }
    }
}

/// `rate * u + square * x <= most`, for the second derivative `u` of the parameter and the square `x` of its first one.
#[derive(Debug, Clone, Copy)]
struct HalfPlane {
    rate: f64,
    square: f64,
    most: f64,
}

/// Share of accelerations that is aimed at: cubics over parabolas need a little more than the path.
const AIMED_AT: f64 = 0.995;

/// Squares of the largest speeds at the grid's points.
pub(super) fn squared_speeds(grid: &[GridPoint], limits: &Limits) -> Vec<f64> {
    let n = grid.len();
    let steps: Vec<Vec<HalfPlane>> = grid.windows(2).map(|pair| half_planes(pair, limits)).collect();
    let cap = |point: &GridPoint| {
        if point.stops {
            return 0.0;
        }
        let own = limits.rows.iter().map(|row| {
            let rate = value(row, &point.direction).abs();
            if rate > 0.0 { (row.velocity / rate).powi(2) } else { f64::INFINITY }
        });
        own.fold(f64::INFINITY, f64::min).min(1e12)
    };
    let mut most: Vec<f64> = grid.iter().map(cap).collect();
    for k in (0..n - 1).rev() {
        let twice = 2.0 * (grid[k + 1].at - grid[k].at);
        most[k] = largest_square(&steps[k], twice, most[k], most[k + 1]);
    }
    let mut squares = vec![0.0; n];
    for k in 0..n - 1 {
        let twice = 2.0 * (grid[k + 1].at - grid[k].at);
        let [_, high] = rates(&steps[k], squares[k]);
        squares[k + 1] = (squares[k] + twice * high).clamp(0.0, most[k + 1]);
    }
    squares
}

fn value(row: &Row, values: &[f64]) -> f64 {
    row.terms.iter().map(|&(j, multiplier)| multiplier * values[j]).sum()
}

/// Limits of accelerations at both ends of a step.
fn half_planes(pair: &[GridPoint], limits: &Limits) -> Vec<HalfPlane> {
    let twice = 2.0 * (pair[1].at - pair[0].at);
    let mut planes = Vec::new();
    for row in limits.rows.iter().filter(|row| row.acceleration.is_finite()) {
        let most = AIMED_AT * row.acceleration;
        let bend = pair[1].bend.as_ref().map_or(0.0, |bend| value(row, bend));
        let directions = [value(row, &pair[0].direction), value(row, &pair[1].direction)];
        // At the end of the step the square is `x + twice u`.
        let ends = [(directions[0], bend), (directions[1] + twice * bend, bend)];
        for (rate, square) in ends {
            if rate != 0.0 || square != 0.0 {
                planes.push(HalfPlane { rate, square, most });
                planes.push(HalfPlane { rate: -rate, square: -square, most });
            }
        }
    }
    planes
}

/// Lowest and highest `u` for a square `x`.
fn rates(planes: &[HalfPlane], x: f64) -> [f64; 2] {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for plane in planes {
        let room = plane.most - plane.square * x;
        if plane.rate > 0.0 {
            high = high.min(room / plane.rate);
        } else if plane.rate < 0.0 {
            low = low.max(room / plane.rate);
        }
    }
    [low, high]
}

/// The largest square up to `cap` from which a square between zero and `next` can be reached.
///
/// The squares that can form an interval from zero, as all limits are linear: halving finds its end.
fn largest_square(planes: &[HalfPlane], twice: f64, cap: f64, next: f64) -> f64 {
    let is_possible = |x: f64| {
        let [low, high] = rates(planes, x);
        let is_allowed = planes.iter().all(|plane| plane.rate != 0.0 || plane.square * x <= plane.most);
        let (low, high) = (low.max(-x / twice), high.min((next - x) / twice));
        is_allowed && low <= high
    };
    if is_possible(cap) {
        return cap;
    }
    let (mut low, mut high) = (0.0, cap);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if is_possible(middle) { low = middle } else { high = middle }
    }
    low
}
