//! An even grid of orientations: the Hopf grid of Yershova, Jain, LaValle, Mitchell, *Generating uniform incremental grids on SO(3)
//! using the Hopf fibration*, IJRR 29 (2010): 72 * 8^level orientations, HEALPix on the sphere times a circle.

use nalgebra::{Quaternion, UnitQuaternion};
use std::f64::consts::PI;

/// Largest level: 294,912 orientations.
const LARGEST_LEVEL: u32 = 4;

/// The finest level that leaves `least_positions` positions of `n_frames` frames.
pub(super) fn level_for(n_frames: u64, least_positions: u64) -> u32 {
    let fits = |level: &u32| 72 * 8u64.pow(*level) * least_positions <= n_frames;
    (1..=LARGEST_LEVEL).take_while(fits).last().unwrap_or(0)
}

/// All orientations of a level, in an order in which each is far from those before it.
pub(super) fn grid(level: u32) -> Vec<UnitQuaternion<f64>> {
    let n_side = 1u32 << level;
    let (n_turns, n_pixels) = (6 * n_side, 12 * n_side * n_side);
    let mut grid = Vec::with_capacity((n_turns * n_pixels) as usize);
    for pixel in 0..n_pixels {
        let (theta, phi) = pixel_center(n_side, pixel);
        for turn in 0..n_turns {
            let psi = (f64::from(turn) + 0.5) * 2.0 * PI / f64::from(n_turns);
            let (half_theta, half_psi) = (0.5 * theta, 0.5 * psi);
            let (sine, cosine) = half_theta.sin_cos();
            grid.push(UnitQuaternion::new_normalize(Quaternion::new(
                cosine * half_psi.cos(),
                sine * (phi + half_psi).cos(),
                sine * (phi + half_psi).sin(),
                cosine * half_psi.sin(),
            )));
        }
    }
    spread(grid)
}

/// Polar angle and azimuth of a pixel in the ring order of HEALPix (Gorski et al., ApJ 622 (2005), equations 2 to 9).
fn pixel_center(n_side: u32, pixel: u32) -> (f64, f64) {
    let n = f64::from(n_side);
    let n_polar = 2 * n_side * (n_side - 1);
    let n_pixels = 12 * n_side * n_side;
    let polar = |p: u32| {
        let half = f64::from(p + 1) / 2.0;
        let ring = (half - half.floor().sqrt()).sqrt().floor() + 1.0;
        let place = f64::from(p + 1) - 2.0 * ring * (ring - 1.0);
        (1.0 - ring * ring / (3.0 * n * n), (place - 0.5) * PI / (2.0 * ring))
    };
    let (z, phi) = if pixel < n_polar {
        polar(pixel)
    } else if pixel < n_pixels - n_polar {
        let p = pixel - n_polar;
        let (ring, place) = (p / (4 * n_side) + n_side, p % (4 * n_side) + 1);
        let shift = f64::from((ring - n_side + 1) % 2);
        (4.0 / 3.0 - 2.0 * f64::from(ring) / (3.0 * n), (f64::from(place) - 0.5 * shift) * PI / (2.0 * n))
    } else {
        let (z, phi) = polar(n_pixels - 1 - pixel);
        (-z, 2.0 * PI - phi)
    };
    (z.clamp(-1.0, 1.0).acos(), phi)
}

/// Orders orientations so that each is as far as can be from those before it; of large grids, by halving strides.
fn spread(grid: Vec<UnitQuaternion<f64>>) -> Vec<UnitQuaternion<f64>> {
    const MOST: usize = 5_000;
    if grid.len() > MOST {
        // Golden section strides: cheap, and nearly as even.
        let stride = coprime_near(grid.len(), 0.618_033_988_749_895);
        return (0..grid.len()).map(|k| grid[k * stride % grid.len()]).collect();
    }
    let mut nearness = vec![-1.0f64; grid.len()];
    let mut order = Vec::with_capacity(grid.len());
    let mut next = 0;
    for _ in 0..grid.len() {
        let chosen = grid[next];
        order.push(chosen);
        nearness[next] = f64::INFINITY;
        let (mut best, mut least) = (0, f64::INFINITY);
        for (k, near) in nearness.iter_mut().enumerate() {
            *near = near.max(grid[k].coords.dot(&chosen.coords).abs());
            if *near < least {
                (best, least) = (k, *near);
            }
        }
        next = best;
    }
    order
}

/// A number near `share * n` without a common divisor with `n`.
fn coprime_near(n: usize, share: f64) -> usize {
    let divisor = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let from = (n as f64 * share) as usize;
    (from..n).find(|k| divisor(n, *k) == 1).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_even() {
        for (level, n_expected, most) in [(0, 72, 1.05), (1, 576, 0.53)] {
            let grid = grid(level);
            assert_eq!(grid.len(), n_expected);
            let mut farthest = 0.0f64;
            for k in 0..500 {
                let asked = UnitQuaternion::from_euler_angles(0.37 * k as f64, 1.1 * k as f64, 2.3 * k as f64);
                let nearest = grid.iter().map(|one| one.angle_to(&asked)).fold(f64::INFINITY, f64::min);
                farthest = farthest.max(nearest);
            }
            assert!(farthest < most, "level {level}: {farthest}");
            // Balls of orientations: the mean rotation matrix of an even grid is zero.
            let sum: nalgebra::Matrix3<f64> = grid.iter().map(|one| *one.to_rotation_matrix().matrix()).sum();
            assert!((sum / n_expected as f64).norm() < 1e-9, "level {level}");
        }
    }

    #[test]
    fn levels_leave_positions() {
        assert_eq!(level_for(600 * 576, 100), 1);
        assert_eq!(level_for(1000, 100), 0);
        assert_eq!(level_for(10_000_000, 100), 3);
    }
}
