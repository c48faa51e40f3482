//! A direction in which the contacts together can only exert more than what balances shows that no forces do (Farkas; Boyd,
//! Vandenberghe, *Convex Optimization*, 2004, 5.8). Phase I has one at hand in every step: the multipliers of the balance.

use super::{Block, Program};

/// What the least wrench along the direction must be more than the balance asks for, in shares of the squeeze: rounding.
const CLEARLY: f64 = 1e-9;

impl<const D: usize> Program<D> {
    /// True where along `direction`, of any length, all forces within the cones and limits of normal forces exert more than the balance
    /// asks for. Limits of joints do not count: they only leave fewer forces.
    pub(super) fn is_refused_by(&self, direction: &[f64; 6]) -> bool {
        let along = |vector: &[f64; 6]| -> f64 { vector.iter().zip(direction).map(|(a, b)| a * b).sum() };
        let length = along(direction).sqrt();
        let least: f64 =
            self.blocks.iter().map(|block| block.least_along(&block.map.map(|column| along(&column)))).sum();
        least - along(&self.balance) > CLEARLY * self.squeeze * length
    }
}

impl<const D: usize> Block<D> {
    /// The least of `slopes . f` over forces within the cone and the limits of the normal force.
    fn least_along(&self, slopes: &[f64; D]) -> f64 {
        let across = slopes[1..].iter().map(|slope| slope * slope).sum::<f64>().sqrt();
        if self.friction == 0.0 {
            // Without a cone what the contact transmits across the normal has no limit.
            return if across == 0.0 { self.least_of(slopes[0], self.least) } else { f64::NEG_INFINITY };
        }
        let per_normal = slopes[0] - across * self.friction;
        self.least_of(per_normal, self.least.max(self.shift / self.friction)) + across * self.shift
    }

    fn least_of(&self, slope: f64, least: f64) -> f64 {
        slope * if slope > 0.0 { least } else { self.largest }
    }
}
