//! How far a shape of a chain can move, and leave the straight chord, while the coordinates move along a line.
//!
//! Let joint `j` move by `d_j` over the unit of time, all at constant speed, and let `p` be a point carried by body
//! `b`. With `a_j` the axis of joint `j` and `r_j` the vector from a point of that axis to `p`,
//!
//! * `p' = sum_j d_j (a_j x r_j)`, so that `|p'| <= sum_j |d_j| reach_j` (1 instead of a reach for sliding joints);
//! * `p'' = sum_j sum_k d_j d_k a_i x (a_l x r_l)`, where of the two joints `l` is the more distal and `i` the more
//!   proximal one: the proximal one turns everything behind it. With joints in order from the base,
//!   `|p''| <= sum_l |d_l| reach_l (|d_l| + 2 sum_{i < l} |d_i|)`.
//!   For a sliding `l` with its axis `a_l`, the term is `a_i x a_l`: the reach is 1, and nothing for `i = l`. A sliding
//!   `i` adds nothing: it turns nothing.
//!
//! A path with `|p''| <= m` over the unit of time stays within `m / 8` of the chord between its ends, point by point
//! in time. First-order bounds of this kind are those of Schwarzer, Saha, Latombe 2005.

use super::chain::{Chain, JointMotion};
use arrayvec::ArrayVec;
use regrasp_geometry::Point;

/// Most joints of a chain that bounds are made for; a joint with several leaders counts once for each.
pub const MAX_JOINTS: usize = 24;

/// How one joint moves the shape.
#[derive(Debug, Clone, Copy)]
struct Lever {
    coordinate: usize,
    /// Size of the joint's movement per movement of its coordinate.
    ratio: f64,
    /// Largest distance, over all configurations, of the shape's points from the axis; 1 for sliding joints.
    reach: f64,
    turns: bool,
}

/// Bounds on the motion of one shape, prepared.
#[derive(Debug, Clone)]
pub struct MotionBound {
    levers: ArrayVec<Lever, MAX_JOINTS>,
}

impl MotionBound {
    /// Bounds for all points within `shape_radius` of `shape_center_in_body`, which body `body` carries.
    ///
    /// Reaches hold for all configurations within the chain's limits. Panics if the chain has no such body, or more
    /// than [`MAX_JOINTS`] joints, those with several leaders counted once for each.
    pub fn new(chain: &Chain, body: usize, shape_center_in_body: &Point, shape_radius: f64) -> Self {
        assert!(body < chain.joints.len(), "no body {body} in a chain of {} joints", chain.joints.len());
        let mut levers = ArrayVec::new();
        // Distance of the shape's centre from the joint's axis; from the next joint on, from its origin.
        let mut from_origin = 0.0;
        for (i, joint) in chain.joints[..=body].iter().enumerate().rev() {
            let (from_axis, origin_distance) = if i == body {
                let along = joint.axis.dot(&shape_center_in_body.coords);
                let square = shape_center_in_body.coords.norm_squared();
                ((square - along * along).max(0.0).sqrt(), square.sqrt())
            } else {
                // The next joint's origin is fixed in this body: only what lies across this axis counts of it.
                let next = chain.joints[i + 1].parent_from_joint.translation.vector;
                let along = joint.axis.dot(&next);
                ((next.norm_squared() - along * along).max(0.0).sqrt() + from_origin, next.norm() + from_origin)
            };
            let turns = joint.motion == JointMotion::Turn;
            // A joint with several leaders moves as several joints about one axis would.
            levers.extend(joint.drive.terms.iter().map(|&(coordinate, multiplier)| Lever {
                coordinate,
                ratio: multiplier.abs(),
                reach: if turns { from_axis + shape_radius } else { 1.0 },
                turns,
            }));
            from_origin = origin_distance + if turns { 0.0 } else { longest_slide(chain, i) };
        }
        levers.reverse();
        MotionBound { levers }
    }

    /// Largest distance, in metres, that a point of the shape travels when the coordinates change by `change`.
    #[inline]
    pub fn first_order(&self, change: &[f64]) -> f64 {
        self.levers.iter().map(|lever| change[lever.coordinate].abs() * lever.ratio * lever.reach).sum()
    }

    /// Largest distance, in metres, of a point of the shape from the chord between its end positions, at the same
    /// share of the motion, when the coordinates change along a line by `change`.
    #[inline]
    pub fn chord_deviation(&self, change: &[f64]) -> f64 {
        let mut turned_before = 0.0;
        let mut acceleration = 0.0;
        for lever in &self.levers {
            let moved = change[lever.coordinate].abs() * lever.ratio;
            if lever.turns {
                acceleration += moved * lever.reach * (moved + 2.0 * turned_before);
                turned_before += moved;
            } else {
                acceleration += moved * 2.0 * turned_before;
            }
        }
        acceleration / 8.0
    }
}

/// Largest absolute position of sliding joint `i` within the limits of its coordinate.
fn longest_slide(chain: &Chain, i: usize) -> f64 {
    let [lower, upper] = chain.joints[i].range([&chain.lower, &chain.upper]);
    lower.abs().max(upper.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::Coupling;
    use crate::kinematics::body_frame::BodyFrame;
    use crate::kinematics::samples::{random_coordinates, random_turning, wide_finger};
    use regrasp_base::Rng;
    use regrasp_geometry::Vector;

    /// Largest shares of the bounds that random motions of the chain use up: travel of a point, chord deviation.
    fn tightness(chain: &Chain, n_motions: usize, rng: &mut Rng) -> (f64, f64) {
        let (mut first, mut second): (f64, f64) = (0.0, 0.0);
        let mut frames = vec![BodyFrame::IDENTITY; chain.joints.len()];
        for _ in 0..n_motions {
            let body = rng.below(chain.joints.len());
            let center = Point::from(Vector::from(rng.direction()) * rng.uniform(0.0, 0.05));
            let radius = rng.uniform(0.0, 0.02);
            let bound = MotionBound::new(chain, body, &center, radius);
            let point = center + Vector::from(rng.direction()) * radius;
            let from = random_coordinates(chain, rng);
            let to = random_coordinates(chain, rng);
            let length = if rng.chance(0.5) { 1.0 } else { rng.uniform(0.0, 0.3) };
            let change: Vec<f64> = from.iter().zip(&to).map(|(a, b)| (b - a) * length).collect();
            let mut at = |share: f64| {
                let q: Vec<f64> = from.iter().zip(&change).map(|(a, d)| a + share * d).collect();
                chain.forward_frames(&q, &mut frames);
                frames[body].point(&point)
            };
            let (start, end) = (at(0.0), at(1.0));
            let (mut travel, mut deviation): (f64, f64) = (0.0, 0.0);
            for i in 1..=64 {
                let share = f64::from(i) / 64.0;
                let here = at(share);
                travel = travel.max((here - start).norm());
                deviation = deviation.max((here - (start + (end - start) * share)).norm());
            }
            first = first.max(travel / bound.first_order(&change));
            second = second.max(deviation / (bound.chord_deviation(&change) + 1e-15));
        }
        (first, second)
    }

    #[test]
    fn bounds_hold_and_are_not_idle() {
        let mut rng = Rng::keyed(1, "motion_bound", 0);
        let (mut first, mut second): (f64, f64) = (0.0, 0.0);
        for i in 0..60 {
            let (chain, _) = if i == 0 { wide_finger() } else { random_turning(1 + i % 5, 1.5, &mut rng) };
            let (a, b) = tightness(&chain, 200, &mut rng);
            assert!(a <= 1.0 + 1e-9 && b <= 1.0 + 1e-9, "bound broken: {a} {b}");
            (first, second) = (first.max(a), second.max(b));
        }
        assert!(first > 0.9 && second > 0.8, "best share of the bound used: {first:.3} (travel), {second:.3} (chord)");
    }

    #[test]
    fn bounds_hold_with_sliding_and_coupled_joints() {
        let mut rng = Rng::keyed(2, "motion_bound_slide", 0);
        for i in 0..60 {
            let (turning, _) = random_turning(4, 1.5, &mut rng);
            let mut joints = turning.joints.clone();
            let (mut lower, mut upper) = (turning.lower.clone(), turning.upper.clone());
            joints[i % 4].motion = JointMotion::Slide;
            (lower[i % 4], upper[i % 4]) = (-0.02, 0.05);
            let follower = (i + 1) % 4;
            joints[follower].drive = Coupling::one((i + 2) % 4, -0.7, 0.1);
            if i % 2 == 1 {
                joints[follower].drive.terms.push(((i + 3) % 4, 0.4));
            }
            let chain = Chain::new(joints, turning.names.clone(), lower, upper);
            let (a, b) = tightness(&chain, 200, &mut rng);
            assert!(a <= 1.0 + 1e-9 && b <= 1.0 + 1e-9, "bound broken: {a} {b}");
        }
    }

    #[test]
    fn typical_tightness_of_the_wide_finger() {
        let mut rng = Rng::keyed(3, "motion_bound_typical", 0);
        let (chain, center) = wide_finger();
        let bound = MotionBound::new(&chain, 2, &center, 0.005);
        let (mut travel, mut deviation) = (0.0, 0.0);
        for _ in 0..1000 {
            let from = random_coordinates(&chain, &mut rng);
            let change: Vec<f64> = (0..3).map(|_| rng.uniform(-0.1, 0.1)).collect();
            let at = |share: f64| {
                let q: Vec<f64> = from.iter().zip(&change).map(|(a, d)| a + share * d).collect();
                chain.last_frame(&q).point(&center)
            };
            let middle = at(0.0) + (at(1.0) - at(0.0)) * 0.5;
            travel += (at(1.0) - at(0.0)).norm() / bound.first_order(&change);
            deviation += (at(0.5) - middle).norm() / bound.chord_deviation(&change);
        }
        let (travel, deviation) = (travel / 1e3, deviation / 1e3);
        assert!(
            travel > 0.2 && deviation > 0.1,
            "mean share of the bound used: {travel:.2} (travel), {deviation:.2} (chord)"
        );
    }
}
