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
        most[k] = match grid[k + 1].bend {
            Some(_) => largest_square(&steps[k], twice, most[k], most[k + 1]),
            // On a line the squares do not matter: as much as can be braked.
            None => most[k].min(most[k + 1] - twice * rates(&steps[k], 0.0)[0]),
        };
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
/// All limits are linear, and zero is possible: where the lowest rate is above the highest one, the two limits that say so meet at a
/// smaller square, which is tried next.
fn largest_square(planes: &[HalfPlane], twice: f64, cap: f64, next: f64) -> f64 {
    let mut x = cap;
    for plane in planes.iter().filter(|plane| plane.rate == 0.0 && plane.square > 0.0) {
        x = x.min(plane.most / plane.square);
    }
    // Rates at the end: from minus x over twice to (next - x) over twice.
    for _ in 0..=planes.len() {
        // As lines over x: value at zero, and slope.
        let mut low = (-x / twice, [0.0, -1.0 / twice]);
        let mut high = ((next - x) / twice, [next / twice, -1.0 / twice]);
        for plane in planes.iter().filter(|plane| plane.rate != 0.0) {
            let line = [plane.most / plane.rate, -plane.square / plane.rate];
            let rate = line[0] + line[1] * x;
            if plane.rate > 0.0 && rate < high.0 {
                high = (rate, line);
            } else if plane.rate < 0.0 && rate > low.0 {
                low = (rate, line);
            }
        }
        if low.0 <= high.0 {
            return x;
        }
        let slope = low.1[1] - high.1[1];
        if slope <= 0.0 {
            return 0.0;
        }
        // A little less, for rounding.
        x = (x * (1.0 - 1e-12)).min((high.1[0] - low.1[0]) / slope).max(0.0);
    }
    0.0
}
