//! When a path is passed, and how fast.
//!
//! Corners of the path are rounded by parabolas (`rounded`). Along the rounded path the speed is the largest that the joints'
//! velocities and accelerations allow (`speeds`: Pham, Pham 2018). Between two waypoints every joint follows the cubic through
//! positions, velocities and times (`docs/reference/plan-format.md`, Time). On straight pieces that is even acceleration along
//! the line. Jerk has no limit.

/// Paths with rounded corners.
mod rounded;
/// The largest speeds along a path.
mod speeds;

pub use rounded::RoundedPath;
pub use speeds::{Limits, Row};

use crate::motion::Track;

/// A configuration with its time and its velocities.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedPoint {
    /// Seconds from the start.
    pub time: f64,
    /// Joint values.
    pub joints: Vec<f64>,
    /// Joint velocities.
    pub velocities: Vec<f64>,
}

/// A path with its times.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedPath {
    /// From rest to rest.
    pub points: Vec<TimedPoint>,
    /// By step between two points: the corner that it rounds; none for straight pieces.
    pub corners: Vec<Option<usize>>,
}

impl TimedPath {
    /// The motion from point `k` to the next.
    pub fn track(&self, k: usize) -> Track {
        let (a, b) = (&self.points[k], &self.points[k + 1]);
        Track::cubic(&a.joints, &b.joints, [&a.velocities, &b.velocities], b.time - a.time)
    }

    /// Seconds from the first point to the last.
    pub fn duration(&self) -> f64 {
        self.points.last().map_or(0.0, |last| last.time - self.points[0].time)
    }
}

/// No velocity times the time of its step is above this, in radians or metres.
const MOST_TANGENT: f64 = 1.4;
/// Room for rounding.
const KEPT: f64 = 1.0 - 1e-9;

/// Times along `path`: from rest to rest, as fast as `limits` allow at every moment.
pub fn times(path: &RoundedPath, limits: &Limits) -> TimedPath {
    let grid = path.grid();
    let squares = speeds::squared_speeds(&grid, limits);
    let mut timed = TimedPath { points: Vec::new(), corners: Vec::new() };
    let mut now = 0.0;
    let mut first = 0;
    timed.points.push(point(&grid[0], 0.0, 0.0));
    while first + 1 < grid.len() {
        // Steps of even acceleration along one line are one step.
        let mut last = first + 1;
        let pace = |k: usize| squares[k].max(0.0).sqrt();
        let rate = |k: usize| 0.5 * (squares[k + 1] - squares[k]) / (grid[k + 1].at - grid[k].at);
        let is_line = |k: usize| grid[k + 1].corner.is_none();
        while last + 1 < grid.len() && is_line(first) && is_line(last) && grid[last].line == grid[last + 1].line {
            let alike = (rate(last) - rate(first)).abs() <= 1e-6 * (1.0 + rate(first).abs());
            let span = 2.0 * (grid[last + 1].at - grid[first].at) / (pace(first) + pace(last + 1));
            let tangent = span * pace(first).max(pace(last + 1));
            if !alike || tangent > MOST_TANGENT {
                break;
            }
            last += 1;
        }
        now += 2.0 * (grid[last].at - grid[first].at) / (pace(first) + pace(last)).max(1e-12);
        timed.points.push(point(&grid[last], pace(last), now));
        timed.corners.push(grid[last].corner);
        first = last;
    }
    slow_down(&mut timed, limits);
    timed
}

fn point(of_path: &rounded::GridPoint, pace: f64, time: f64) -> TimedPoint {
    TimedPoint {
        time,
        joints: of_path.joints.clone(),
        velocities: of_path.direction.iter().map(|direction| direction * pace).collect(),
    }
}

/// Makes all slower by the factor with which the cubics keep the limits: on parabolas they are no more than near the path.
pub fn slow_down(timed: &mut TimedPath, limits: &Limits) {
    let mut most: f64 = 1.0;
    for k in 0..timed.corners.len() {
        let (a, b) = (&timed.points[k], &timed.points[k + 1]);
        let span = b.time - a.time;
        for row in &limits.rows {
            let value = |values: &[f64]| row.terms.iter().map(|&(j, m)| m * values[j]).sum::<f64>();
            let change = value(&b.joints) - value(&a.joints);
            let (first, last) = (value(&a.velocities) * span, value(&b.velocities) * span);
            let [slope, bend] = steepest(change, first, last);
            let velocity = slope / (span * row.velocity * KEPT);
            let acceleration = bend / (span * span * row.acceleration * KEPT);
            most = most.max(velocity).max(acceleration.sqrt());
        }
    }
    for point in &mut timed.points {
        point.time *= most;
        point.velocities.iter_mut().for_each(|velocity| *velocity /= most);
    }
}

/// Largest sizes of the slope and of the second derivative of the cubic with this change and these slopes at both ends.
fn steepest(change: f64, first: f64, last: f64) -> [f64; 2] {
    let bends = [6.0 * change - 4.0 * first - 2.0 * last, 2.0 * first + 4.0 * last - 6.0 * change];
    let mut slope = first.abs().max(last.abs());
    if bends[0] * bends[1] < 0.0 {
        let u = bends[0] / (bends[0] - bends[1]);
        slope = slope.max((first + u * bends[0] + 0.5 * u * u * (bends[1] - bends[0])).abs());
    }
    [slope, bends[0].abs().max(bends[1].abs())]
}

#[cfg(test)]
mod tests;
