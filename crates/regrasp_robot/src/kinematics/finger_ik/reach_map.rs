//! Where a tip can be at all: cells of space, so that targets out of reach cost a look and not a search.

use super::MAX_COORDINATES;
use crate::kinematics::chain::Chain;
use regrasp_geometry::{Point, Vector};

/// Configurations sampled for the map.
const N_SAMPLES: usize = 60_000;
/// Cells along the longest side of the reached box.
const N_CELLS: f64 = 64.0;

/// Cells that some sampled configuration reaches, grown by one cell all round.
#[derive(Debug, Clone)]
pub(super) struct ReachMap {
    low: Vector,
    cell: f64,
    n_cells: [usize; 3],
    reached: Vec<bool>,
}

impl ReachMap {
    /// Samples the chain's limits evenly (Halton points). `range` bounds the coordinates that have no limits.
    pub(super) fn new(chain: &Chain, center_in_body: &Point, range: impl Fn(f64, f64) -> (f64, f64)) -> Self {
        let mut coordinates = vec![0.0; chain.n_coordinates()];
        let tips: Vec<Vector> = (0..N_SAMPLES)
            .map(|i| {
                for (k, coordinate) in coordinates.iter_mut().enumerate() {
                    let (lower, upper) = range(chain.lower[k], chain.upper[k]);
                    *coordinate = lower + (upper - lower) * halton(i + 1, k);
                }
                chain.last_frame(&coordinates).point(center_in_body).coords
            })
            .collect();
        let (low, high) = tips.iter().fold((tips[0], tips[0]), |(low, high), tip| (low.inf(tip), high.sup(tip)));
        let cell = ((high - low).max() / N_CELLS).max(1e-6);
        let low = low - Vector::repeat(1.5 * cell);
        let n_cells = std::array::from_fn(|k| ((high[k] - low[k]) / cell) as usize + 3);
        let mut map = ReachMap { low, cell, n_cells, reached: vec![false; n_cells.iter().product()] };
        for tip in &tips {
            let Some([i, j, k]) = map.cell_of(tip) else { continue };
            for (di, dj, dk) in (0..27).map(|n| (n / 9, n / 3 % 3, n % 3)) {
                let at = [i + di - 1, j + dj - 1, k + dk - 1];
                if let Some(index) = map.index_of(at) {
                    map.reached[index] = true;
                }
            }
        }
        map
    }

    /// False when no sampled configuration comes near `target`.
    #[inline]
    pub(super) fn may_reach(&self, target: &Point) -> bool {
        self.cell_of(&target.coords).and_then(|cell| self.index_of(cell)).is_some_and(|index| self.reached[index])
    }

    fn cell_of(&self, point: &Vector) -> Option<[usize; 3]> {
        let scaled = (point - self.low) / self.cell;
        let inside = (0..3).all(|k| scaled[k] >= 1.0 && scaled[k] < (self.n_cells[k] - 1) as f64);
        inside.then(|| [scaled.x as usize, scaled.y as usize, scaled.z as usize])
    }

    fn index_of(&self, [i, j, k]: [usize; 3]) -> Option<usize> {
        let inside = i < self.n_cells[0] && j < self.n_cells[1] && k < self.n_cells[2];
        inside.then(|| (i * self.n_cells[1] + j) * self.n_cells[2] + k)
    }
}

/// Element `i` of the van der Corput sequence in the `k`-th prime base (Halton 1960).
pub(super) fn halton(i: usize, k: usize) -> f64 {
    const PRIMES: [usize; MAX_COORDINATES] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    let base = PRIMES[k];
    let (mut rest, mut value, mut place) = (i, 0.0, 1.0);
    while rest > 0 {
        place /= base as f64;
        value += place * (rest % base) as f64;
        rest /= base;
    }
    value
}
