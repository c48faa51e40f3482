//! Paths with rounded corners.

use crate::motion::Track;
use crate::search::distance;

/// Straight pieces with parabolas about their corners.
///
/// About a corner the path leaves the line `length` before it and reaches the next line as far behind it. The parabola between
/// has the direction of both lines at its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundedPath {
    /// The corners, and both ends.
    corners: Vec<Vec<f64>>,
    /// By corner: how long before and behind it the parabola begins and ends. Zero: the joints stop there.
    roundings: Vec<f64>,
    /// By line: its length and its direction.
    lines: Vec<(f64, Vec<f64>)>,
}

/// A place on the path.
#[derive(Debug, Clone, PartialEq)]
pub struct GridPoint {
    /// The path's parameter.
    pub at: f64,
    /// Joint values.
    pub joints: Vec<f64>,
    /// Derivative with respect to the parameter.
    pub direction: Vec<f64>,
    /// Second derivative in the step that ends here.
    pub bend: Option<Vec<f64>>,
    /// The corner that the step that ends here rounds.
    pub corner: Option<usize>,
    /// The line that the step that ends here is on.
    pub line: usize,
    /// True where the joints stop.
    pub stops: bool,
}

/// Steps of a straight piece.
const LINE_STEPS: usize = 24;
/// Steps of a parabola.
const CORNER_STEPS: usize = 6;
/// Steps of a straight piece are no shorter than this where it is short, in the path's parameter: rounding of joints is no acceleration.
const LEAST_STEP: f64 = 1e-4;
/// Corners nearer to the one before are left out, in the path's parameter.
const LEAST_LINE: f64 = 1e-6;
/// Share of a line that a parabola takes at most: something is left of each line.
const ROUNDED_SHARE: f64 = 0.45;

impl RoundedPath {
    /// The path through `corners`, rounded as much as the lines allow, and at most by `longest` on each side. Corners that are
    /// the one before are left out. None of fewer than two corners.
    pub fn new(corners: &[Vec<f64>], longest: f64) -> Option<Self> {
        let mut kept: Vec<Vec<f64>> = Vec::new();
        for (index, corner) in corners.iter().enumerate() {
            if kept.last().is_none_or(|last| distance(last, corner) > LEAST_LINE) {
                kept.push(corner.clone());
            } else if index + 1 == corners.len() && kept.len() > 1 {
                // The last one is where the path has to end.
                kept.pop();
                kept.push(corner.clone());
            }
        }
        let line = |pair: &[Vec<f64>]| {
            let length = distance(&pair[0], &pair[1]);
            (length, pair[0].iter().zip(&pair[1]).map(|(a, b)| (b - a) / length).collect())
        };
        let lines: Vec<(f64, Vec<f64>)> = kept.windows(2).map(line).collect();
        if lines.is_empty() {
            return None;
        }
        let mut roundings = vec![0.0; kept.len()];
        for k in 1..lines.len() {
            roundings[k] = (ROUNDED_SHARE * lines[k - 1].0.min(lines[k].0)).min(longest);
        }
        Some(RoundedPath { corners: kept, roundings, lines })
    }

    /// Corners between the ends.
    pub fn inner_corners(&self) -> std::ops::Range<usize> {
        1..self.corners.len() - 1
    }

    /// The corners with both ends.
    pub fn corners(&self) -> &[Vec<f64>] {
        &self.corners
    }

    /// Rounds corner `k` less: half as long before and behind it; not at all where little is left.
    pub fn sharpen(&mut self, k: usize) {
        /// In the path's parameter.
        const LEAST: f64 = 1e-3;
        let half = 0.5 * self.roundings[k];
        self.roundings[k] = if half < LEAST { 0.0 } else { half };
    }

    /// Makes the joints stop at corner `k`.
    pub fn stop(&mut self, k: usize) {
        self.roundings[k] = 0.0;
    }

    /// True where the joints stop at corner `k`.
    pub fn is_sharp(&self, k: usize) -> bool {
        self.roundings[k] == 0.0
    }

    /// The parabola about corner `k`.
    pub fn parabola(&self, k: usize) -> Track {
        let length = self.roundings[k];
        let (before, behind) = (&self.lines[k - 1].1, &self.lines[k].1);
        let of = |j: usize| {
            let first = self.corners[k][j] - length * before[j];
            [first, 2.0 * length * before[j], length * (behind[j] - before[j]), 0.0]
        };
        Track { coefficients: (0..before.len()).map(of).collect() }
    }

    /// Places along the path, close enough for the speeds between them.
    pub(super) fn grid(&self) -> Vec<GridPoint> {
        let mut grid: Vec<GridPoint> = Vec::new();
        let mut at = 0.0;
        for (k, (length, direction)) in self.lines.iter().enumerate() {
            let (from, to) = (self.roundings[k], length - self.roundings[k + 1]);
            let on_line = |way: f64| -> Vec<f64> {
                self.corners[k].iter().zip(direction).map(|(corner, d)| corner + way * d).collect()
            };
            if grid.is_empty() {
                let (joints, direction) = (self.corners[0].clone(), direction.clone());
                grid.push(GridPoint { at, joints, direction, bend: None, corner: None, line: 0, stops: true });
            }
            let n_steps = LINE_STEPS.min(((to - from) / LEAST_STEP) as usize).max(2);
            for step in 1..=n_steps {
                let way = from + (to - from) * step as f64 / n_steps as f64;
                let is_end = step == n_steps;
                // Ends are the corners themselves where nothing is rounded.
                let joints = match is_end && self.roundings[k + 1] == 0.0 {
                    true => self.corners[k + 1].clone(),
                    false => on_line(way),
                };
                grid.push(GridPoint {
                    at: at + way - from,
                    joints,
                    direction: direction.clone(),
                    bend: None,
                    corner: None,
                    line: k,
                    stops: is_end && self.roundings[k + 1] == 0.0,
                });
            }
            at += (to - from).max(0.0);
            let rounding = self.roundings[k + 1];
            if rounding > 0.0 {
                let (parabola, next) = (self.parabola(k + 1), &self.lines[k + 1].1);
                let bend: Vec<f64> = direction.iter().zip(next).map(|(a, b)| (b - a) / (2.0 * rounding)).collect();
                for step in 1..=CORNER_STEPS {
                    let share = step as f64 / CORNER_STEPS as f64;
                    grid.push(GridPoint {
                        at: at + 2.0 * rounding * share,
                        joints: parabola.at(share),
                        direction: direction.iter().zip(next).map(|(a, b)| a + share * (b - a)).collect(),
                        bend: Some(bend.clone()),
                        corner: Some(k + 1),
                        line: k,
                        stops: false,
                    });
                }
                at += 2.0 * rounding;
            }
        }
        grid
    }
}
