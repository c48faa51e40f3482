//! One Newton step over forces that balance: a small system per contact, joined by six equations that are solved first, as
//! the Hessian is block-diagonal (Boyd, Vandenberghe, *Convex Optimization*, 2004, 10.4.2: elimination).

use super::{Forces, MAX_GRIPS};
use arrayvec::ArrayVec;

/// A factored Newton system `H step + map^T y = descent`, `map step = rest`.
#[derive(Debug, Clone, Default)]
pub struct NewtonStep<const D: usize> {
    /// Block by block.
    blocks: ArrayVec<Factored<D>, MAX_GRIPS>,
    /// Cholesky factor of `map H^-1 map^T`, with a reciprocal diagonal.
    schur: [[f64; 6]; 6],
}

/// A block of a system.
#[derive(Debug, Clone)]
struct Factored<const D: usize> {
    /// Cholesky factor `L` of the block of `H`, with a reciprocal diagonal.
    factor: [[f64; D]; D],
    /// `L^-1 map^T`.
    whitened: [[f64; 6]; D],
}

impl<const D: usize> NewtonStep<D> {
    /// Forgets all blocks.
    pub fn clear(&mut self) {
        self.blocks.clear();
    }

    /// Adds the block of a contact; of `hessian` the lower half.
    #[inline]
    pub fn push(&mut self, map: &[[f64; 6]; D], hessian: &[[f64; D]; D]) {
        let factor = cholesky(hessian);
        let mut whitened = *map;
        for i in 0..D {
            for j in 0..i {
                for k in 0..6 {
                    whitened[i][k] -= factor[i][j] * whitened[j][k];
                }
            }
            whitened[i].iter_mut().for_each(|x| *x *= factor[i][i]);
        }
        self.blocks.push(Factored { factor, whitened });
    }

    /// To be called after all blocks; of the map's rows the first `rank` are not zero.
    #[inline]
    pub fn factor(&mut self, rank: usize) {
        let mut schur = [[0.0; 6]; 6];
        for row in self.blocks.iter().flat_map(|block| &block.whitened) {
            for i in 0..6 {
                for j in 0..=i {
                    schur[i][j] += row[i] * row[j];
                }
            }
        }
        (rank..6).for_each(|i| schur[i][i] = 1.0);
        self.schur = cholesky(&schur);
    }

    /// The step, and the square of its length in the metric of `H`.
    #[inline]
    pub fn solve(&self, descent: &Forces<D>, rest: &[f64; 6]) -> (Forces<D>, f64) {
        let (step, square, _) = self.solve_both(descent, rest);
        (step, square)
    }

    /// The same, and the multipliers `y`.
    #[inline]
    pub fn solve_both(&self, descent: &Forces<D>, rest: &[f64; 6]) -> (Forces<D>, f64, [f64; 6]) {
        let mut step = descent.clone();
        let mut dual = rest.map(|x| -x);
        for (Factored { factor, whitened }, z) in self.blocks.iter().zip(&mut step) {
            for i in 0..D {
                for j in 0..i {
                    z[i] -= factor[i][j] * z[j];
                }
                z[i] *= factor[i][i];
                (0..6).for_each(|k| dual[k] += whitened[i][k] * z[i]);
            }
        }
        for i in 0..6 {
            for j in 0..i {
                dual[i] -= self.schur[i][j] * dual[j];
            }
            dual[i] *= self.schur[i][i];
        }
        for i in (0..6).rev() {
            for j in i + 1..6 {
                dual[i] -= self.schur[j][i] * dual[j];
            }
            dual[i] *= self.schur[i][i];
        }
        let mut square = 0.0;
        for (Factored { factor, whitened }, z) in self.blocks.iter().zip(&mut step) {
            for i in 0..D {
                (0..6).for_each(|k| z[i] -= whitened[i][k] * dual[k]);
                square += z[i] * z[i];
            }
            for i in (0..D).rev() {
                for j in i + 1..D {
                    z[i] -= factor[j][i] * z[j];
                }
                z[i] *= factor[i][i];
            }
        }
        (step, square, dual)
    }
}

/// Lower Cholesky factor with its diagonal inverted; of `a` the lower half.
#[inline]
fn cholesky<const N: usize>(a: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut l = *a;
    for i in 0..N {
        for j in 0..=i {
            let mut sum = a[i][j];
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            // What rounding leaves of a singular matrix is kept above zero.
            l[i][j] = if i == j { 1.0 / sum.max(f64::MIN_POSITIVE).sqrt() } else { sum * l[j][j] };
        }
    }
    l
}
