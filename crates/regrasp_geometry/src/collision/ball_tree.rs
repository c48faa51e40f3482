//! Which of many balls are near a point: the first look at obstacles, of which most are far from everything that moves.

use crate::frame::{Point, Vector};
use crate::surface::bvh::{Aabb, Bvh};

/// A ball of a [`BallTree`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre.
    pub center: Point,
    /// Radius, in metres.
    pub radius: f64,
    /// Its place in the order in which the tree was given them.
    pub index: u32,
}

/// Balls at rest, and a tree of boxes over them.
#[derive(Debug, Clone)]
pub struct BallTree {
    tree: Bvh,
    /// In the order of the leaves.
    balls: Vec<Ball>,
}

impl BallTree {
    /// The tree over balls with these centres and radii, all finite.
    pub fn new(balls: &[(Point, f64)]) -> Self {
        let boxes: Vec<Aabb> = balls
            .iter()
            .map(|(center, radius)| {
                let half = Vector::repeat(*radius);
                Aabb { low: center.coords - half, high: center.coords + half }
            })
            .collect();
        let tree = Bvh::new(&boxes);
        let of = |&index: &u32| {
            let (center, radius) = balls[index as usize];
            Ball { center, radius, index }
        };
        BallTree { balls: tree.order().iter().map(of).collect(), tree }
    }

    /// True without any ball.
    pub fn is_empty(&self) -> bool {
        self.balls.is_empty()
    }

    /// Appends to `found`, in no particular order, at least all balls of which a point is nearer to `point` than `reach`, in
    /// metres. Returns a lower bound of the distance of all points of the other balls, up to rounding; at least `reach`.
    pub fn near(&self, point: &Point, reach: f64, found: &mut Vec<Ball>) -> f64 {
        self.tree.within(point, reach * reach, |rank| found.push(self.balls[rank])).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    fn random_point(rng: &mut Rng, spread: f64) -> Point {
        Point::from(Vector::from(rng.direction()) * rng.uniform(0.0, spread))
    }

    #[test]
    fn finds_all_near_balls_and_bounds_the_distance_of_the_others() {
        let mut rng = Rng::keyed(5, "ball_tree", 0);
        let (mut n_found, mut n_others) = (0, 0);
        for n in [0, 1, 2, 4, 5, 30, 300] {
            // From specks to balls that hold everything.
            let balls: Vec<(Point, f64)> =
                (0..n).map(|_| (random_point(&mut rng, 1.0), 10f64.powf(rng.uniform(-5.0, 0.5)))).collect();
            let tree = BallTree::new(&balls);
            assert_eq!(tree.is_empty(), n == 0);
            for _ in 0..200 {
                let point = random_point(&mut rng, 1.5);
                let reach = rng.uniform(0.0, 0.3);
                let mut found = Vec::new();
                let bound = tree.near(&point, reach, &mut found);
                assert!(bound >= reach);
                let mut is_found = vec![false; n];
                for ball in &found {
                    assert_eq!((ball.center, ball.radius), balls[ball.index as usize]);
                    assert!(!std::mem::replace(&mut is_found[ball.index as usize], true), "found twice");
                }
                for ((center, radius), is_found) in balls.iter().zip(is_found) {
                    let distance = (center - point).norm() - radius;
                    assert!(is_found || distance >= bound - 1e-12, "{distance} of one that is not found, {bound}");
                    n_found += usize::from(is_found);
                    n_others += usize::from(!is_found);
                }
            }
        }
        assert!(n_found > 5000 && n_others > 5000, "{n_found} {n_others}");
    }

    #[test]
    fn balls_in_one_place_and_touching_ones_are_found() {
        let here = vec![(Point::new(0.1, 0.0, 0.0), 0.01); 100];
        let tree = BallTree::new(&here);
        let mut found = Vec::new();
        assert_eq!(tree.near(&Point::origin(), 0.091, &mut found), f64::INFINITY);
        assert_eq!(found.len(), 100);
        found.clear();
        let others = tree.near(&Point::origin(), 0.08, &mut found);
        assert!(found.is_empty() && (0.08..=0.09).contains(&others), "{others}");
    }
}
