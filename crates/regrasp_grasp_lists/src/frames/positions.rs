//! A grid of positions in a box, in an order in which every beginning covers the box.

use regrasp_geometry::{Point, Vector};

/// About `n_wanted` positions: the centres of cubes of one size that fill the box.
pub(super) fn grid([low, high]: [&Point; 2], n_wanted: u64) -> Vec<Point> {
    let size = (high - low).map(|extent| extent.max(1e-6));
    let counts = counts(&size, n_wanted);
    let n_cells: usize = counts.iter().product();
    let at = |[i, j, k]: [usize; 3]| {
        let share = |cell: usize, axis: usize| (cell as f64 + 0.5) / counts[axis] as f64;
        low + size.component_mul(&Vector::new(share(i, 0), share(j, 1), share(k, 2)))
    };
    // Halton points visit the cells; what they leave out comes last.
    let mut seen = vec![false; n_cells];
    let mut order = Vec::with_capacity(n_cells);
    let mut visit = |cell: [usize; 3]| {
        let index = (cell[0] * counts[1] + cell[1]) * counts[2] + cell[2];
        if !std::mem::replace(&mut seen[index], true) {
            order.push(at(cell));
        }
    };
    for n in 0..8 * n_cells as u64 {
        let cell = [2, 3, 5].map(|base| radical_inverse(n + 1, base));
        visit(std::array::from_fn(|axis| ((cell[axis] * counts[axis] as f64) as usize).min(counts[axis] - 1)));
    }
    for index in 0..n_cells {
        visit([index / counts[2] / counts[1], index / counts[2] % counts[1], index % counts[2]]);
    }
    order
}

/// Cells along each axis with a step that fits the number wanted.
fn counts(size: &Vector, n_wanted: u64) -> [usize; 3] {
    let of_step = |step: f64| -> [usize; 3] { std::array::from_fn(|k| (size[k] / step).round().max(1.0) as usize) };
    let number = |step: f64| of_step(step).iter().map(|&n| n as f64).product::<f64>();
    // The number falls with the step.
    let (mut small, mut large) = (size.min() / (n_wanted as f64 + 1.0), size.max() * 2.0);
    for _ in 0..60 {
        let middle = (small * large).sqrt();
        if number(middle) > n_wanted as f64 { small = middle } else { large = middle }
    }
    of_step(large)
}

/// Element `n` of the van der Corput sequence in a prime base (Halton 1960).
pub(crate) fn radical_inverse(mut n: u64, base: u64) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while n > 0 {
        place /= base as f64;
        value += place * (n % base) as f64;
        n /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_about_as_many_positions_as_wanted_and_fills_the_box() {
        let (low, high) = (Point::new(-0.1, 0.0, 0.2), Point::new(0.1, 0.05, 0.5));
        for n_wanted in [1, 10, 600, 5000] {
            let grid = grid([&low, &high], n_wanted);
            let share = grid.len() as f64 / n_wanted as f64;
            assert!((0.3..=1.0).contains(&share), "{n_wanted}: {}", grid.len());
            let middle = grid.iter().map(|p| p.coords).sum::<Vector>() / grid.len() as f64;
            assert!((middle - Vector::new(0.0, 0.025, 0.35)).norm() < 1e-12);
        }
    }
}
