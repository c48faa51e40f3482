//! Times along smooth paths, from rest to rest.
//!
//! A straight line of the joints, or a smooth curve through states, is passed with the quintic time law `10 t^3 - 15 t^4 + 6 t^5`:
//! accelerations change without jumps, and so do the forces on what is carried.

use regrasp_arms::times::{Limits, TimedPath, TimedPoint, slow_down};

/// A smooth path of all coordinates.
#[derive(Debug, Clone)]
pub enum Smooth {
    /// Straight.
    Line([Vec<f64>; 2]),
    /// A natural cubic spline through states at even steps.
    Curve(Spline),
}

/// A cubic spline.
#[derive(Debug, Clone)]
pub struct Spline {
    nodes: Vec<Vec<f64>>,
    /// Second derivatives at the nodes.
    bends: Vec<Vec<f64>>,
}

impl Spline {
    /// Through at least two states.
    pub fn new(nodes: Vec<Vec<f64>>) -> Self {
        let n = nodes.len();
        let width = nodes[0].len();
        let mut bends = vec![vec![0.0; width]; n];
        if n > 2 {
            // Thomas's algorithm on `b[i-1] + 4 b[i] + b[i+1] = 6 (q[i-1] - 2 q[i] + q[i+1])`.
            let mut factors = vec![0.0; n];
            for i in 1..n - 1 {
                let pivot = 4.0 - factors[i - 1];
                factors[i] = 1.0 / pivot;
                for k in 0..width {
                    let right = 6.0 * (nodes[i - 1][k] - 2.0 * nodes[i][k] + nodes[i + 1][k]);
                    bends[i][k] = (right - bends[i - 1][k]) / pivot;
                }
            }
            for i in (1..n - 1).rev() {
                for k in 0..width {
                    bends[i][k] -= factors[i] * bends[i + 1][k];
                }
            }
            bends[0].fill(0.0);
            bends[n - 1].fill(0.0);
        }
        Spline { nodes, bends }
    }

    /// Values and derivatives at `u` from 0 to 1.
    fn at(&self, u: f64) -> (Vec<f64>, Vec<f64>) {
        let n = self.nodes.len() - 1;
        let place = u.clamp(0.0, 1.0) * n as f64;
        let i = (place as usize).min(n - 1);
        let t = place - i as f64;
        let s = 1.0 - t;
        let (a, b) = (&self.nodes[i], &self.nodes[i + 1]);
        let (p, q) = (&self.bends[i], &self.bends[i + 1]);
        let width = a.len();
        let value = |k: usize| s * a[k] + t * b[k] + ((s * s * s - s) * p[k] + (t * t * t - t) * q[k]) / 6.0;
        let slope =
            |k: usize| n as f64 * (b[k] - a[k] + ((1.0 - 3.0 * s * s) * p[k] + (3.0 * t * t - 1.0) * q[k]) / 6.0);
        ((0..width).map(value).collect(), (0..width).map(slope).collect())
    }
}

impl Smooth {
    /// Through states: a line where there are two.
    pub fn through(mut nodes: Vec<Vec<f64>>) -> Self {
        match nodes.len() {
            2 => {
                let last = nodes.swap_remove(1);
                Smooth::Line([nodes.swap_remove(0), last])
            }
            _ => Smooth::Curve(Spline::new(nodes)),
        }
    }

    /// The states that the path goes through.
    pub fn nodes(&self) -> Vec<Vec<f64>> {
        match self {
            Smooth::Line(ends) => ends.to_vec(),
            Smooth::Curve(spline) => spline.nodes.clone(),
        }
    }

    /// The same path the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        match self {
            Smooth::Line([a, b]) => Smooth::Line([b.clone(), a.clone()]),
            Smooth::Curve(spline) => Smooth::Curve(Spline {
                nodes: spline.nodes.iter().rev().cloned().collect(),
                bends: spline.bends.iter().rev().cloned().collect(),
            }),
        }
    }

    /// Keeps some coordinates at `values` all the way.
    pub fn fix(&mut self, range: std::ops::Range<usize>, values: &[f64]) {
        let nodes: &mut [Vec<f64>] = match self {
            Smooth::Line(ends) => ends,
            Smooth::Curve(spline) => {
                spline.bends.iter_mut().for_each(|bend| bend[range.clone()].fill(0.0));
                &mut spline.nodes
            }
        };
        nodes.iter_mut().for_each(|node| node[range.clone()].copy_from_slice(values));
    }

    fn at(&self, u: f64) -> (Vec<f64>, Vec<f64>) {
        match self {
            Smooth::Line([a, b]) => {
                // The ends are the states themselves.
                let value = |(a, b): (&f64, &f64)| if u >= 1.0 { *b } else { a + u * (b - a) };
                (a.iter().zip(b).map(value).collect(), a.iter().zip(b).map(|(a, b)| b - a).collect())
            }
            Smooth::Curve(spline) => spline.at(u),
        }
    }

    /// Its first and last state.
    pub fn ends(&self) -> [&Vec<f64>; 2] {
        match self {
            Smooth::Line([a, b]) => [a, b],
            Smooth::Curve(spline) => [&spline.nodes[0], &spline.nodes[spline.nodes.len() - 1]],
        }
    }

    /// The path with times from `start` on: as fast as the limits allow, slower by `slower`, in `n_steps` steps.
    pub fn timed(&self, limits: &Limits, slower: f64, n_steps: usize) -> TimedPath {
        let n = n_steps.max(2);
        let law = |t: f64| {
            let place = t * t * t * (10.0 + t * (6.0 * t - 15.0));
            let rate = 30.0 * t * t * (1.0 - t) * (1.0 - t);
            (place, rate)
        };
        let mut points: Vec<TimedPoint> = (0..=n)
            .map(|step| {
                let t = step as f64 / n as f64;
                let (u, rate) = law(t);
                let (joints, slopes) = self.at(if step == n { 1.0 } else { u });
                TimedPoint { time: t, joints, velocities: slopes.into_iter().map(|slope| slope * rate).collect() }
            })
            .collect();
        let [first, last] = self.ends();
        points[0].joints.clone_from(first);
        points[n].joints.clone_from(last);
        for end in [0, n] {
            points[end].velocities.fill(0.0);
        }
        // In so short a time that all is too fast: then it is slowed down to what is allowed.
        let factor = 1e-4;
        for point in &mut points {
            point.time *= factor;
            point.velocities.iter_mut().for_each(|velocity| *velocity /= factor);
        }
        let mut timed = TimedPath { points, corners: vec![None; n] };
        slow_down(&mut timed, limits);
        let least = LEAST_SECONDS / timed.duration();
        let slower = slower.max(least);
        for point in &mut timed.points {
            point.time *= slower;
            point.velocities.iter_mut().for_each(|velocity| *velocity /= slower);
        }
        timed
    }
}

/// No path takes less, in seconds.
const LEAST_SECONDS: f64 = 0.02;

/// Paths one after the other.
pub fn one_after_the_other(paths: impl IntoIterator<Item = TimedPath>) -> TimedPath {
    let mut all = TimedPath { points: Vec::new(), corners: Vec::new() };
    for path in paths {
        let now = all.points.last().map_or(0.0, |last: &TimedPoint| last.time);
        let skipped = usize::from(!all.points.is_empty());
        let begin = path.points[0].time;
        let later = |point: TimedPoint| TimedPoint { time: point.time - begin + now, ..point };
        all.points.extend(path.points.into_iter().skip(skipped).map(later));
        all.corners.extend(path.corners);
    }
    all
}

/// A moment of rest.
pub fn at_rest(state: &[f64], seconds: f64) -> TimedPath {
    let point = |time: f64| TimedPoint { time, joints: state.to_vec(), velocities: vec![0.0; state.len()] };
    TimedPath { points: vec![point(0.0), point(seconds)], corners: vec![None] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_pass_their_nodes_and_are_smooth() {
        let nodes: Vec<Vec<f64>> = (0..6).map(|i| vec![(0.4 * f64::from(i)).sin(), 0.1 * f64::from(i)]).collect();
        let spline = Spline::new(nodes.clone());
        for (i, node) in nodes.iter().enumerate() {
            let (value, _) = spline.at(i as f64 / 5.0);
            assert!(value.iter().zip(node).all(|(a, b)| (a - b).abs() < 1e-12), "{value:?} {node:?}");
        }
        let h = 1e-6;
        for i in 1..100 {
            let u = f64::from(i) / 100.0;
            let (_, slope) = spline.at(u);
            let (a, b) = (spline.at(u - h).0, spline.at(u + h).0);
            assert!((slope[0] - (b[0] - a[0]) / (2.0 * h)).abs() < 1e-6, "{u}");
        }
    }

    #[test]
    fn timed_paths_keep_limits_from_rest_to_rest() {
        let limits = Limits::of_joints(&[1.0, 2.0], &[3.0, 4.0]);
        let timed = Smooth::through(vec![vec![0.0, 1.0], vec![0.5, 0.2], vec![0.9, 0.1]]).timed(&limits, 1.0, 24);
        let mut n_fast = 0;
        for k in 0..24 {
            let track = timed.track(k);
            let span = timed.points[k + 1].time - timed.points[k].time;
            for (j, (velocity, acceleration)) in [(1.0, 3.0), (2.0, 4.0)].into_iter().enumerate() {
                let [_, c1, c2, c3] = track.coefficients[j];
                for i in 0..=10 {
                    let t = f64::from(i) / 10.0;
                    let rate = (c1 + 2.0 * c2 * t + 3.0 * c3 * t * t) / span;
                    let bend = (2.0 * c2 + 6.0 * c3 * t) / (span * span);
                    assert!(rate.abs() <= velocity * (1.0 + 1e-9) && bend.abs() <= acceleration * (1.0 + 1e-9));
                    n_fast += usize::from(bend.abs() > 0.99 * acceleration || rate.abs() > 0.99 * velocity);
                }
            }
        }
        assert!(n_fast > 0, "nothing is at its limit");
        assert!(timed.points[0].velocities.iter().chain(&timed.points[24].velocities).all(|v| *v == 0.0));
    }
}
