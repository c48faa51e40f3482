//! What the friction that a contact needs counts: `u / friction * -log(1 - |v|^2 / u^2)`, with `u` the friction that its normal force gives
//! and `v` the force across the normal.
//!
//! It is the perspective of a convex function, so it is convex itself (Boyd, Vandenberghe, *Convex Optimization*, 2004, 3.2.6). A contact
//! without a force across counts nothing, however lightly it presses: a barrier before the cone would have it press harder for nothing. And of
//! two contacts that need the same share of their friction the one that presses harder counts more.

use super::{Block, Coordinates};

/// The value, and its derivatives by `u` and `v`.
pub(super) struct NeededFriction {
    /// In newtons.
    pub(super) value: f64,
    by_along: f64,
    by_along_twice: f64,
    /// Over a coordinate of `v`.
    by_across: f64,
    /// Over a coordinate of `v`.
    mixed: f64,
    /// Over the identity, and over `v v^T`.
    by_across_twice: (f64, f64),
}

impl NeededFriction {
    /// Of a contact with friction, strictly inside its cone.
    #[inline]
    pub(super) fn of<const D: usize>(block: &Block<D>, f: &Coordinates<D>) -> Self {
        let across: f64 = f[1..].iter().map(|x| x * x).sum();
        let along = block.friction * f[0] - block.shift;
        let depth = 1.0 / (along * along - across);
        let log = (along * along * depth).ln();
        let sum = (along * along + across) * depth * depth;
        let scale = 1.0 / block.friction;
        NeededFriction {
            value: scale * along * log,
            by_along: scale * (log - 2.0 * across * depth),
            by_along_twice: scale * 2.0 * across * sum / along,
            by_across: scale * 2.0 * along * depth,
            mixed: scale * -2.0 * sum,
            by_across_twice: (scale * 2.0 * along * depth, scale * 4.0 * along * depth * depth),
        }
    }

    /// Adds so much of it to minus the gradient, and to the lower half of the second derivatives.
    #[inline]
    pub(super) fn add<const D: usize>(
        &self,
        weight: f64,
        block: &Block<D>,
        f: &Coordinates<D>,
        descent: &mut [f64; D],
        hessian: &mut [[f64; D]; D],
    ) {
        descent[0] -= weight * block.friction * self.by_along;
        hessian[0][0] += weight * block.friction * block.friction * self.by_along_twice;
        for i in 1..D {
            descent[i] -= weight * self.by_across * f[i];
            hessian[i][0] += weight * block.friction * self.mixed * f[i];
            for j in 1..=i {
                hessian[i][j] += weight * self.by_across_twice.1 * f[i] * f[j];
            }
            hessian[i][i] += weight * self.by_across_twice.0;
        }
    }
}
