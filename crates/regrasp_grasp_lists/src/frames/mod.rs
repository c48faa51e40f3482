//! Grasp frames: positions in the object's box times orientations, in an order in which every beginning covers all (Saut
//! 2010, sec. IV-A.1).

/// An even grid of orientations.
mod orientations;
/// A grid of positions in a box.
mod positions;

pub(crate) use positions::radical_inverse;

use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose};

/// The grid, in its order.
#[derive(Debug, Clone)]
pub struct Frames {
    positions: Vec<Point>,
    orientations: Vec<UnitQuaternion<f64>>,
}

impl Frames {
    /// About `n_frames` frames in the box between `low` and `high`; at least `least_positions` positions.
    pub fn new([low, high]: [&Point; 2], n_frames: u64, least_positions: u64) -> Self {
        let level = orientations::level_for(n_frames, least_positions);
        let orientations = orientations::grid(level);
        let n_positions = (n_frames / orientations.len() as u64).max(1);
        Frames { positions: positions::grid([low, high], n_positions), orientations }
    }

    /// Number of frames.
    pub fn len(&self) -> u64 {
        self.positions.len() as u64 * self.orientations.len() as u64
    }

    /// Frame `index` in the object frame: neighbours in the order differ in position and in orientation, and each pair of
    /// the two comes once.
    pub fn object_from_grasp(&self, index: u64) -> Pose {
        let (n_positions, n_orientations) = (self.positions.len() as u64, self.orientations.len() as u64);
        // After each round of both the orientations are shifted by one: all pairs come once.
        let round = index / least_common_multiple(n_positions, n_orientations);
        let position = self.positions[(index % n_positions) as usize];
        let orientation = self.orientations[((index + round) % n_orientations) as usize];
        Pose::from_parts(Translation3::from(position.coords), orientation)
    }
}

fn least_common_multiple(a: u64, b: u64) -> u64 {
    let (mut x, mut y) = (a, b);
    while y > 0 {
        (x, y) = (y, x % y);
    }
    a / x * b
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_pair_of_position_and_orientation_comes_once() {
        let low = Point::new(-0.02, -0.03, 0.0);
        let frames = Frames::new([&low, &Point::new(0.04, 0.05, 0.2)], 72 * 30, 10);
        let key = |pose: &Pose| {
            let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).copied();
            numbers.map(f64::to_bits).collect::<Vec<_>>()
        };
        let seen: BTreeSet<_> = (0..frames.len()).map(|i| key(&frames.object_from_grasp(i))).collect();
        assert_eq!(seen.len() as u64, frames.len());
        assert!((72 * 20..=72 * 45).contains(&frames.len()), "{}", frames.len());
    }

    /// A tenth of the frames lies nearly as evenly as all of them: no orientation is far from one of them.
    #[test]
    fn the_beginning_covers_all() {
        let frames = Frames::new([&Point::new(-0.1, -0.1, -0.1), &Point::new(0.1, 0.1, 0.1)], 600 * 576, 100);
        let first: Vec<Pose> = (0..frames.len() / 100).map(|i| frames.object_from_grasp(i)).collect();
        let mut farthest = 0.0f64;
        for k in 0..200 {
            let asked = UnitQuaternion::from_euler_angles(0.1 * k as f64, 0.7 * k as f64, 1.3 * k as f64);
            let nearest = first.iter().map(|pose| pose.rotation.angle_to(&asked)).fold(f64::INFINITY, f64::min);
            farthest = farthest.max(nearest);
        }
        assert!(farthest < 0.65, "{farthest}");
    }
}
