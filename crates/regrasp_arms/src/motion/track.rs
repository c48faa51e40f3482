//! Motions: straight, or cubic.

use crate::lanes::{F8, LANES};

/// A motion of all coordinates along one parameter from 0 to 1: the cubic `c0 + c1 t + c2 t^2 + c3 t^3` of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// By coordinate.
    pub coefficients: Vec<[f64; 4]>,
}

impl Track {
    /// The straight motion.
    pub fn straight(from: &[f64], to: &[f64]) -> Self {
        Track { coefficients: from.iter().zip(to).map(|(a, b)| [*a, b - a, 0.0, 0.0]).collect() }
    }

    /// The cubic from `from` to `to` in `span` seconds, with these velocities at its ends (`docs/reference/plan-format.md`, Time).
    pub fn cubic(from: &[f64], to: &[f64], velocities: [&[f64]; 2], span: f64) -> Self {
        let of = |k: usize| {
            let change = to[k] - from[k];
            let (first, last) = (span * velocities[0][k], span * velocities[1][k]);
            [from[k], first, 3.0 * change - 2.0 * first - last, first + last - 2.0 * change]
        };
        Track { coefficients: (0..from.len()).map(of).collect() }
    }

    /// The configuration at `t`.
    pub fn at(&self, t: f64) -> Vec<f64> {
        self.coefficients.iter().map(|c| c[0] + t * (c[1] + t * (c[2] + t * c[3]))).collect()
    }

    /// Largest sizes of the first and second derivative of coordinate `k`.
    pub(crate) fn largest(&self, k: usize) -> [f32; 2] {
        let [_, c1, c2, c3] = self.coefficients[k];
        // The derivative is a parabola with these Bernstein coefficients.
        let first = [c1, c1 + c2, c1 + 2.0 * c2 + 3.0 * c3];
        let second = [2.0 * c2, 2.0 * c2 + 6.0 * c3];
        let most = |values: &[f64]| values.iter().fold(0.0f64, |most, value| most.max(value.abs())) as f32 * 1.000_001;
        [most(&first), most(&second)]
    }

    /// True where no coefficient is infinite or not a number.
    pub(crate) fn is_finite(&self) -> bool {
        self.coefficients.iter().flatten().all(|c| c.is_finite())
    }

    /// Values and derivatives of coordinate `k` at eight moments, each of its own track.
    #[inline(always)]
    pub(crate) fn lanes(tracks: [&Track; LANES], k: usize, t: F8) -> (F8, F8) {
        let mut c = [F8::ZERO; 4];
        for l in 0..LANES {
            for power in 0..4 {
                c[power].0[l] = tracks[l].coefficients[k][power] as f32;
            }
        }
        let value = ((t * c[3] + c[2]) * t + c[1]) * t + c[0];
        let rate = (t * (c[3] * 3.0) + c[2] * 2.0) * t + c[1];
        (value, rate)
    }
}
