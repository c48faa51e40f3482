//! Three joints whose axes meet: angles for a rotation, and where limits of joints end what a free angle may be.

use super::wave::{FreeRotation, Wave, turn};
use arrayvec::ArrayVec;
use nalgebra::Matrix3;
use regrasp_geometry::Vector;
use std::f64::consts::TAU;

/// Axes count as parallel where the sine between them is below.
const PARALLEL: f64 = 1e-6;
/// Sine between the first and the third axis below which only the sum of their angles counts.
const SINGULAR: f64 = 1e-9;
/// Rounding in products of rotations.
const ROUNDING: f64 = 1e-13;
/// Borders of one triple, at most: two of the middle joint's reach with two angles each, and two limits of three joints.
pub(super) const MAX_BORDERS: usize = 16;

/// Limits of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    pub lower: f64,
    pub upper: f64,
}

impl Range {
    /// True where the joint may stand at every angle.
    fn is_whole_turn(&self) -> bool {
        self.upper - self.lower >= TAU
    }

    /// The value within the limits that differs from `angle` by whole turns, the nearest to `near` where there are several; values
    /// outside by less than `tolerance` are brought inside. Err with the distance to the limits where there is none.
    pub fn place(&self, angle: f64, near: f64, tolerance: f64) -> Result<f64, f64> {
        let turned = |k: f64| angle + TAU * k;
        let near = near.clamp(self.lower, self.upper);
        let nearest = ((near - angle) / TAU).round();
        let outside = |q: f64| (self.lower - q).max(q - self.upper);
        let best = [nearest, nearest - 1.0, nearest + 1.0]
            .map(turned)
            .into_iter()
            .min_by(|a, b| outside(*a).max(0.0).total_cmp(&outside(*b).max(0.0)));
        let q = best.unwrap_or(angle);
        if outside(q) > tolerance { Err(outside(q)) } else { Ok(q.clamp(self.lower, self.upper)) }
    }
}

/// Where a free angle's feasible part may begin or end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Border {
    pub angle: f64,
    /// True where the middle joint's two branches meet: angles of the other joints jump there.
    pub is_singular: bool,
}

/// Three axes that meet, at the joints' zero positions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triple {
    axes: [Vector; 3],
    ranges: [Range; 3],
    /// `axes[0] . turn(axes[1], q) axes[2]`.
    middle: Wave,
    /// Angles between neighbouring axes.
    between: [f64; 2],
}

impl Triple {
    /// None where neighbouring axes are parallel.
    pub fn new(axes: [Vector; 3], ranges: [Range; 3]) -> Option<Self> {
        let [first, second, third] = axes;
        if first.cross(&second).norm() < PARALLEL || second.cross(&third).norm() < PARALLEL {
            return None;
        }
        let along = second * second.dot(&third);
        let across = third - along;
        let middle =
            Wave { constant: first.dot(&along), cosine: first.dot(&across), sine: first.dot(&second.cross(&across)) };
        Some(Triple { axes, ranges, middle, between: [angle_between(&first, &second), angle_between(&second, &third)] })
    }

    /// Angles, without whole turns, whose product of rotations is `rotation`, with the middle joint on one side of its crest.
    pub fn angles(&self, rotation: &Matrix3<f64>, is_upper: bool) -> Option<[f64; 3]> {
        let [first, second, third] = self.axes;
        let turned = rotation * third;
        let half = self.half_angle(angle_between(&first, &turned))?;
        let q1 = self.middle.crest() + if is_upper { half } else { -half };
        let middle = turn(&second, q1);
        let before = middle * third;
        let q0 = angle_about(&first, &before, &turned);
        // What is left for the last joint, seen across its axis.
        let across = third.cross(&Vector::ith(third.iamin(), 1.0));
        let left = (turn(&first, q0) * middle).transpose() * (rotation * across);
        Some([q0, q1, angle_about(&third, &across, &left)])
    }

    /// Angle of the middle joint from its crest at which the outer axes are at angle `apart`: the cosine rule of spherical triangles in its
    /// form with half angles, which is exact where the outer axes are nearly parallel.
    fn half_angle(&self, apart: f64) -> Option<f64> {
        let [first, second] = self.between;
        let product = |a: f64, b: f64| (0.5 * a).sin() * (0.5 * b).sin();
        let sine = product(apart + first - second, apart - first + second);
        let cosine = product(first + second + apart, first + second - apart);
        if sine.min(cosine) < -ROUNDING {
            return None;
        }
        Some(2.0 * sine.max(0.0).sqrt().atan2(cosine.max(0.0).sqrt()))
    }

    /// The rotation at these angles.
    pub fn rotation(&self, angles: &[f64]) -> Matrix3<f64> {
        (0..3).map(|k| turn(&self.axes[k], angles[k])).fold(Matrix3::identity(), |product, next| product * next)
    }

    /// The same angles within the limits, near `near`. Err with the joint that is farthest outside, and by how much.
    pub fn place(&self, angles: &[f64; 3], near: &[f64], tolerance: f64) -> Result<[f64; 3], (usize, f64)> {
        let mut placed = *angles;
        let mut worst: Option<(usize, f64)> = None;
        for k in 0..3 {
            match self.ranges[k].place(angles[k], near[k], tolerance) {
                Ok(q) => placed[k] = q,
                Err(by) if worst.is_none_or(|(_, most)| by > most) => worst = Some((k, by)),
                Err(_) => {}
            }
        }
        worst.map_or(Ok(placed), Err)
    }

    /// Angles of the free rotation at which a joint of the triple passes a limit or its branches meet.
    pub fn borders(&self, free: &FreeRotation, borders: &mut ArrayVec<Border, { 2 * MAX_BORDERS }>) {
        let [first, second, third] = self.axes;
        let mut roots = ArrayVec::<f64, 12>::new();
        let product = free.wave(&first, &third);
        for end in [-1.0, 1.0] {
            let mut singular = ArrayVec::<f64, 2>::new();
            product.roots(self.middle.constant + end * self.middle.amplitude(), &mut singular);
            borders.extend(singular.into_iter().map(|angle| Border { angle, is_singular: true }));
        }
        for (k, range) in self.ranges.iter().enumerate().filter(|(_, range)| !range.is_whole_turn()) {
            for limit in [range.lower, range.upper] {
                match k {
                    0 => free.wave(&(turn(&first, limit) * second), &third).roots(second.dot(&third), &mut roots),
                    1 => product.roots(self.middle.at(limit), &mut roots),
                    _ => free.wave(&first, &(turn(&third, -limit) * second)).roots(first.dot(&second), &mut roots),
                }
            }
        }
        borders.extend(roots.into_iter().map(|angle| Border { angle, is_singular: false }));
    }
}

fn angle_between(a: &Vector, b: &Vector) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// The angle about `axis` that turns `from` to `to`; 0 where they are along the axis.
fn angle_about(axis: &Vector, from: &Vector, to: &Vector) -> f64 {
    let (cosine, sine) = (from.dot(to) - axis.dot(from) * axis.dot(to), axis.dot(&from.cross(to)));
    if cosine.hypot(sine) < SINGULAR * SINGULAR { 0.0 } else { sine.atan2(cosine) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use std::f64::consts::PI;

    #[test]
    fn one_of_two_branches_gives_back_the_angles() {
        let mut rng = Rng::keyed(1, "triples", 0);
        let range = Range { lower: -PI, upper: PI };
        for case in 0..5000 {
            let axes = std::array::from_fn(|k| match case % 3 {
                0 => Vector::ith([2, 1, 2][k], 1.0),
                _ => Vector::from(rng.direction()),
            });
            let Some(triple) = Triple::new(axes, [range; 3]) else { continue };
            let angles: [f64; 3] = std::array::from_fn(|_| rng.uniform(-3.1, 3.1));
            let rotation = triple.rotation(&angles);
            let found = [false, true].map(|side| triple.angles(&rotation, side).unwrap());
            for branch in &found {
                let error = (triple.rotation(branch) - rotation).amax();
                assert!(error < 1e-12, "{case}: {error:e}");
            }
            let near =
                |branch: &[f64; 3]| (0..3).all(|k| super::super::wave::wrapped(branch[k] - angles[k]).abs() < 1e-5);
            assert!(found.iter().any(near), "{case}: {found:?} {angles:?}");
        }
    }

    #[test]
    fn places_within_limits_are_found_over_whole_turns() {
        let range = Range { lower: -2.0, upper: 3.5 };
        assert_eq!(range.place(3.0, 0.0, 0.0), Ok(3.0));
        assert!((range.place(-2.9, 0.0, 0.0).unwrap() - (TAU - 2.9)).abs() < 1e-15);
        assert_eq!(range.place(-2.0 - 1e-12, 0.0, 1e-9), Ok(-2.0));
        assert!((range.place(-2.5, 0.0, 1e-9).unwrap_err() - (TAU - 2.5 - 3.5)).abs() < 1e-12);
        let wide = Range { lower: -10.0, upper: 10.0 };
        assert!((wide.place(1.0, 7.0, 0.0).unwrap() - (1.0 + TAU)).abs() < 1e-15);
        let free = Range { lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        assert!((free.place(1.0, 100.0, 0.0).unwrap() - (1.0 + 16.0 * TAU)).abs() < 1e-12);
    }
}
