//! Closed form for chains of three turning joints, general geometry.
//!
//! Pieper 1968 (Craig, Introduction to Robotics, section 4.6): height along axis 1 and distance from it don't depend
//! on joint 1. Written about axis 2 they are two equations, linear in the rotated arm, whose right sides are linear in
//! the sine and cosine of joint 3. When axes 1 and 2 meet, or are parallel, one of them is free of joint 2 and gives
//! joint 3 at once (the usual finger); else squaring gives a quartic.

use super::quartic::roots_in_unit;
use super::{Coordinates, IkSettings, POSITION_TOLERANCE};
use crate::kinematics::body_frame::BodyFrame;
use crate::kinematics::chain::{Chain, ChainJoint, JointLine, JointMotion};
use arrayvec::ArrayVec;
use nalgebra::Matrix3;
use regrasp_geometry::{Point, Vector};
use std::f64::consts::{PI, TAU};

/// Axes closer to meeting (share of the arm's length) or to parallel (sine) than this are treated as such; the
/// substitution at the end repairs the difference.
const DEGENERATE: f64 = 1e-7;
/// Solutions closer than this in every coordinate are one, in radians.
const SAME: f64 = 1e-6;
/// Rounding must not lose a solution that sits on its limit; in radians.
const LIMIT_ROUNDING: f64 = 1e-9;
/// Residual below which no Newton step is taken, in metres.
const POLISHED: f64 = 1e-12;

/// All branches: a 3R chain reaches a point in at most four ways.
pub type Branches = ArrayVec<Coordinates, 8>;
type Candidates = ArrayVec<[f64; 3], 8>;

/// `constant + cosine * cos(q3) + sine * sin(q3)`.
#[derive(Debug, Clone, Copy)]
struct Wave {
    constant: f64,
    cosine: f64,
    sine: f64,
}

impl Wave {
    fn at(&self, c: f64, s: f64) -> f64 {
        self.constant + self.cosine * c + self.sine * s
    }

    /// Derivative by the angle.
    fn slope(&self, c: f64, s: f64) -> f64 {
        self.sine * c - self.cosine * s
    }
}

/// The angles that a joint can have, as an arc: angles outside are seen by two products, without an arc tangent.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// Cosine and sine of the arc's middle.
    middle: (f64, f64),
    /// Cosine of half its length; below -1 when it is the full circle.
    cosine: f64,
}

impl Window {
    fn new(joint: &ChainJoint, chain: &Chain) -> Self {
        let [a, b] = joint.range([&chain.lower, &chain.upper]);
        let half = 0.5 * (b - a).abs() + 1e-6;
        if half < PI {
            let (sine, cosine) = (0.5 * (a + b)).sin_cos();
            Window { middle: (cosine, sine), cosine: half.cos() }
        } else {
            Window { middle: (1.0, 0.0), cosine: -2.0 }
        }
    }

    /// False when the angle whose cosine and sine are `c / length` and `s / length` is outside.
    fn may_hold(&self, c: f64, s: f64, length: f64) -> bool {
        c * self.middle.0 + s * self.middle.1 >= self.cosine * length - 1e-12 * length
    }
}

/// How axes 1 and 2 lie to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Axes {
    Meeting,
    Parallel,
    Skew,
}

/// What is asked of a solution.
struct Goal<'a> {
    chain: &'a Chain,
    /// The target, from the foot of the common normal on axis 1.
    from_axis: Vector,
    limit_margin: f64,
}

/// The component of the rotated arm that the equations give at once.
#[derive(Clone, Copy)]
enum Known {
    X(f64),
    Y(f64),
}

/// The closed form of one chain, prepared. Everything is in the base frame with all joint angles zero.
#[derive(Debug, Clone)]
pub struct ThreeR {
    axes: Axes,
    /// Axis of joint 1 and the foot on it of the common normal of axes 1 and 2.
    axis_1: Vector,
    origin_1: Vector,
    /// Orthonormal basis: `e1` along the common normal, `e2`, and axis 2.
    e1: Vector,
    e2: Vector,
    axis_2: Vector,
    /// Length of the common normal, and `axis_1 . e2` (sine of the twist).
    offset: f64,
    twist_sine: f64,
    /// Components of the arm (tip from the foot of the common normal on axis 2) along `e1`, `e2`, `axis_2`.
    x: Wave,
    y: Wave,
    height: Wave,
    /// `|offset|^2 + |arm|^2`, halved.
    half_square: Wave,
    /// `axis_1 . arm` as far as it doesn't turn with joint 2.
    twist_height: Wave,
    /// Per joint: coordinate, multiplier, offset.
    drives: [(usize, f64, f64); 3],
    /// Per joint: the angles within its limits.
    windows: [Window; 3],
    center_in_body: Point,
}

impl ThreeR {
    /// None unless the chain has three turning joints with a coordinate each and can move its tip in three directions.
    pub fn new(chain: &Chain, center_in_body: &Point) -> Option<Self> {
        let joints: &[_; 3] = chain.joints.as_slice().try_into().ok()?;
        if !chain.linear_limits.is_empty() {
            return None;
        }
        let mut driven = [false; 3];
        let mut drives = [(0, 1.0, 0.0); 3];
        for (joint, drive) in joints.iter().zip(&mut drives) {
            let (coordinate, multiplier) = joint.drive.single()?;
            if joint.motion != JointMotion::Turn || multiplier == 0.0 || chain.n_coordinates() != 3 {
                return None;
            }
            driven[coordinate] = true;
            *drive = (coordinate, multiplier, joint.drive.offset);
        }
        if driven.contains(&false) {
            return None;
        }
        let mut frame = BodyFrame::IDENTITY;
        let mut axes = [Vector::zeros(); 3];
        let mut origins = [Vector::zeros(); 3];
        for (i, joint) in joints.iter().enumerate() {
            frame = frame.then(&BodyFrame::from(&joint.parent_from_joint));
            axes[i] = frame.vector(&joint.axis);
            origins[i] = frame.translation;
        }
        let tip = frame.point(center_in_body).coords;
        let scale = (tip - origins[2]).norm() + (origins[2] - origins[1]).norm() + (origins[1] - origins[0]).norm();
        let [axis_1, axis_2, axis_3] = axes;
        let cross = axis_1.cross(&axis_2);
        let twist = cross.norm();
        let (origin_1, origin_2) = feet_of_common_normal(&origins[0], &axis_1, &origins[1], &axis_2);
        let normal = origin_2 - origin_1;
        let offset = normal.norm();
        let kind = match (twist < DEGENERATE, offset < DEGENERATE * scale) {
            (true, true) => return None,
            (true, false) => Axes::Parallel,
            (false, true) => Axes::Meeting,
            (false, false) => Axes::Skew,
        };
        let e1 = if kind == Axes::Meeting { cross / twist } else { normal / offset };
        let e1 = (e1 - axis_2 * axis_2.dot(&e1)).normalize();
        let e2 = axis_2.cross(&e1);
        let lever = tip - origins[2];
        let along = axis_3 * axis_3.dot(&lever);
        let shoulder = origins[2] - origin_2;
        let wave = |direction: &Vector| Wave {
            constant: direction.dot(&(shoulder + along)),
            cosine: direction.dot(&(lever - along)),
            sine: direction.dot(&axis_3.cross(&lever)),
        };
        let (x, y, height) = (wave(&e1), wave(&e2), wave(&axis_2));
        let reach = wave(&shoulder);
        let half_square = Wave {
            constant: 0.5 * (offset * offset + shoulder.norm_squared() + lever.norm_squared()) + shoulder.dot(&along),
            cosine: reach.cosine,
            sine: reach.sine,
        };
        let cosine = axis_1.dot(&axis_2);
        let twist_height =
            Wave { constant: cosine * height.constant, cosine: cosine * height.cosine, sine: cosine * height.sine };
        let first = match kind {
            Axes::Meeting => half_square,
            Axes::Parallel => twist_height,
            Axes::Skew => x,
        };
        let amplitude = first.cosine.hypot(first.sine);
        let needed = if kind == Axes::Meeting { scale * scale } else { scale };
        if kind != Axes::Skew && amplitude < 1e-9 * needed {
            return None;
        }
        Some(ThreeR {
            axes: kind,
            axis_1,
            origin_1,
            e1,
            e2,
            axis_2,
            offset,
            twist_sine: axis_1.dot(&e2),
            x,
            y,
            height,
            half_square,
            twist_height,
            drives,
            windows: joints.each_ref().map(|joint| Window::new(joint, chain)),
            center_in_body: *center_in_body,
        })
    }

    /// Every branch within the limits.
    pub fn solve_all(&self, chain: &Chain, target: &Point, limit_margin: f64) -> Branches {
        let mut branches = Branches::new();
        for mut candidate in self.candidates(chain, target, limit_margin) {
            let error = self.tip_error(chain, target, &candidate);
            if self.polish(chain, target, error, &mut candidate) && bring_inside(chain, limit_margin, &mut candidate) {
                let is_same = |other: &Coordinates| other.iter().zip(&candidate).all(|(a, b)| (a - b).abs() < SAME);
                if !branches.iter().any(is_same) {
                    branches.push(candidate.into_iter().collect());
                }
            }
        }
        branches
    }

    /// Every branch within the limits as the formulas give it; coinciding ones twice.
    fn candidates(&self, chain: &Chain, target: &Point, limit_margin: f64) -> Candidates {
        let mut candidates = Candidates::new();
        let from_axis = target.coords - self.origin_1;
        let goal = Goal { chain, from_axis, limit_margin };
        // Distance and height equations: rho . e1 * offset = distance(q3), rho . e2 * twist_sine = rise(q3).
        let distance = Wave {
            constant: 0.5 * from_axis.norm_squared() - self.half_square.constant,
            cosine: -self.half_square.cosine,
            sine: -self.half_square.sine,
        };
        let rise = Wave {
            constant: self.axis_1.dot(&from_axis) - self.twist_height.constant,
            cosine: -self.twist_height.cosine,
            sine: -self.twist_height.sine,
        };
        match self.axes {
            Axes::Meeting => {
                for (c, s) in zeros_of(&distance) {
                    let rho_y = rise.at(c, s) / self.twist_sine;
                    self.both_signs(&goal, (c, s), Known::Y(rho_y), &mut candidates);
                }
            }
            Axes::Parallel => {
                for (c, s) in zeros_of(&rise) {
                    let rho_x = distance.at(c, s) / self.offset;
                    self.both_signs(&goal, (c, s), Known::X(rho_x), &mut candidates);
                }
            }
            Axes::Skew => {
                let rho_x = scaled(&distance, 1.0 / self.offset);
                let rho_y = scaled(&rise, 1.0 / self.twist_sine);
                for (c, s) in circle_zeros(&rho_x, &rho_y, &self.x, &self.y) {
                    let rho = (rho_x.at(c, s), rho_y.at(c, s));
                    self.finish(&goal, (c, s), rho, &mut candidates);
                }
            }
        }
        candidates
    }

    /// The branch continuous with `seed`.
    pub fn solve_near(
        &self,
        chain: &Chain,
        target: &Point,
        seed: &[f64],
        settings: &IkSettings,
    ) -> Option<Coordinates> {
        let mut near = [0.0; 3];
        let mut n_near = 0;
        for mut candidate in self.candidates(chain, target, settings.limit_margin) {
            let mut largest: f64 = 0.0;
            for &(k, multiplier, _) in &self.drives {
                let turn = TAU / multiplier.abs();
                // Joints with more than a full turn of room go on from where they are.
                if (candidate[k] - seed[k]).abs() > 0.5 * turn {
                    let unwound = candidate[k] + ((seed[k] - candidate[k]) / turn).round() * turn;
                    if unwound >= chain.lower[k] + settings.limit_margin
                        && unwound <= chain.upper[k] - settings.limit_margin
                    {
                        candidate[k] = unwound;
                    }
                }
                largest = largest.max((candidate[k] - seed[k]).abs());
            }
            if largest <= settings.max_step {
                n_near += 1;
                near = candidate;
            }
        }
        // Two branches within reach of one step meet in a singularity nearby: which one is continuous is not known.
        if n_near != 1 {
            return None;
        }
        let error = self.tip_error(chain, target, &near);
        if error.norm_squared() >= POLISHED * POLISHED && !self.polish(chain, target, error, &mut near) {
            return None;
        }
        let same_side = self.side(seed) * self.side(&near) > 0.0;
        (same_side && bring_inside(chain, settings.limit_margin, &mut near)).then(|| near.into_iter().collect())
    }

    /// One component of the rotated arm is known; the other follows from its length, up to the sign.
    fn both_signs(&self, goal: &Goal, joint_3: (f64, f64), known: Known, candidates: &mut Candidates) {
        if !self.windows[2].may_hold(joint_3.0, joint_3.1, 1.0) {
            return;
        }
        let (x, y) = (self.x.at(joint_3.0, joint_3.1), self.y.at(joint_3.0, joint_3.1));
        let length_squared = x * x + y * y;
        let (Known::X(value) | Known::Y(value)) = known;
        let rest = length_squared - value * value;
        if rest < -1e-9 * length_squared {
            return;
        }
        let other = rest.max(0.0).sqrt();
        for other in [other, -other] {
            let rho = match known {
                Known::X(x) => (x, other),
                Known::Y(y) => (other, y),
            };
            self.finish(goal, joint_3, rho, candidates);
            if other == 0.0 {
                break;
            }
        }
    }

    /// Joint 2 turns the arm's `(x, y)` to `rho`, joint 1 brings it to the target; keeps what is within the limits.
    fn finish(&self, goal: &Goal, (c, s): (f64, f64), rho: (f64, f64), candidates: &mut Candidates) {
        let &Goal { chain, from_axis, limit_margin } = goal;
        let within = |joint: usize, s: f64, c: f64, length: f64| {
            if !self.windows[joint].may_hold(c, s, length) {
                return None;
            }
            let angle = s.atan2(c);
            let (k, multiplier, offset) = self.drives[joint];
            in_limits(angle, multiplier, offset, chain.lower[k] + limit_margin, chain.upper[k] - limit_margin)
        };
        // Length of an unnormalised cosine and sine; rounding apart, of the turned arm it is the square of its length.
        let Some(q3) = within(2, s, c, 1.0) else { return };
        let (x, y, height) = (self.x.at(c, s), self.y.at(c, s), self.height.at(c, s));
        let Some(q2) = within(1, x * rho.1 - y * rho.0, x * rho.0 + y * rho.1, x * x + y * y) else { return };
        let before = self.e1 * (self.offset + rho.0) + self.e2 * rho.1 + self.axis_2 * height;
        let turned = self.axis_1.dot(&before.cross(&from_axis));
        let straight = before.dot(&from_axis) - self.axis_1.dot(&before) * self.axis_1.dot(&from_axis);
        let Some(q1) = within(0, turned, straight, (turned * turned + straight * straight).sqrt()) else { return };
        let mut coordinates = [0.0; 3];
        for (q, drive) in [q1, q2, q3].into_iter().zip(&self.drives) {
            coordinates[drive.0] = q;
        }
        if !candidates.is_full() {
            candidates.push(coordinates);
        }
    }

    /// Newton steps until the tip is on the target; false when it is not reached.
    fn polish(&self, chain: &Chain, target: &Point, error: Vector, coordinates: &mut [f64; 3]) -> bool {
        let mut error = error;
        for _ in 0..4 {
            if error.norm_squared() < POLISHED * POLISHED {
                return true;
            }
            let jacobian = self.jacobian(chain, coordinates);
            let Some(step) = jacobian.try_inverse().map(|inverse| inverse * error) else {
                break;
            };
            if !step.iter().all(|change| change.abs() < 0.1) {
                break;
            }
            let moved = [coordinates[0] + step.x, coordinates[1] + step.y, coordinates[2] + step.z];
            let moved_error = self.tip_error(chain, target, &moved);
            if moved_error.norm_squared() >= error.norm_squared() {
                break;
            }
            (*coordinates, error) = (moved, moved_error);
        }
        error.norm_squared() < POSITION_TOLERANCE * POSITION_TOLERANCE
    }

    /// The determinant of the tip's Jacobian but for a constant factor. Joint 1 changes neither the tip's distance from the
    /// axis's origin nor its height along the axis: what counts is how joints 2 and 3 change the two.
    fn side(&self, coordinates: &[f64]) -> f64 {
        let turn = |joint: usize| {
            let (k, multiplier, offset) = self.drives[joint];
            (multiplier * coordinates[k] + offset).sin_cos()
        };
        let ((s2, c2), (s3, c3)) = (turn(1), turn(2));
        let (x, y) = (self.x.at(c3, s3), self.y.at(c3, s3));
        let (dx, dy) = (self.x.slope(c3, s3), self.y.slope(c3, s3));
        let by_2 = (-self.offset * (s2 * x + c2 * y), self.twist_sine * (c2 * x - s2 * y));
        let by_3 = (
            self.half_square.slope(c3, s3) + self.offset * (c2 * dx - s2 * dy),
            self.twist_height.slope(c3, s3) + self.twist_sine * (s2 * dx + c2 * dy),
        );
        by_2.0 * by_3.1 - by_3.0 * by_2.1
    }

    /// From the tip to the target.
    fn tip_error(&self, chain: &Chain, target: &Point, coordinates: &[f64; 3]) -> Vector {
        target - chain.last_frame(coordinates).point(&self.center_in_body)
    }

    /// The tip's Jacobian, one column per coordinate.
    fn jacobian(&self, chain: &Chain, coordinates: &[f64]) -> Matrix3<f64> {
        let mut lines: ArrayVec<JointLine, 3> = ArrayVec::new();
        let tip = chain.joint_lines(coordinates, &mut lines).point(&self.center_in_body).coords;
        let mut jacobian = Matrix3::zeros();
        for (drive, line) in self.drives.iter().zip(&lines) {
            jacobian.set_column(drive.0, &(line.axis.cross(&(tip - line.origin)) * drive.1));
        }
        jacobian
    }
}

/// Removes rounding beyond the limits; false when it is more than rounding.
fn bring_inside(chain: &Chain, limit_margin: f64, coordinates: &mut [f64; 3]) -> bool {
    coordinates.iter_mut().enumerate().all(|(k, q)| {
        let inside = q.max(chain.lower[k] + limit_margin).min(chain.upper[k] - limit_margin);
        let excess = (inside - *q).abs();
        *q = inside;
        excess <= LIMIT_ROUNDING
    })
}

/// Points of two lines that are nearest to each other; for parallel lines the second line's own point and its foot.
fn feet_of_common_normal(p1: &Vector, a1: &Vector, p2: &Vector, a2: &Vector) -> (Vector, Vector) {
    let between = p2 - p1;
    let cosine = a1.dot(a2);
    let sine_squared = a1.cross(a2).norm_squared();
    if sine_squared < DEGENERATE * DEGENERATE {
        return (p1 + a1 * a1.dot(&between), *p2);
    }
    let (along_1, along_2) = (a1.dot(&between), a2.dot(&between));
    let t1 = (along_1 - cosine * along_2) / sine_squared;
    let t2 = (cosine * along_1 - along_2) / sine_squared;
    (p1 + a1 * t1, p2 + a2 * t2)
}

fn scaled(wave: &Wave, factor: f64) -> Wave {
    Wave { constant: wave.constant * factor, cosine: wave.cosine * factor, sine: wave.sine * factor }
}

/// The at most two `(cos, sin)` where a wave vanishes.
fn zeros_of(wave: &Wave) -> ArrayVec<(f64, f64), 2> {
    let mut zeros = ArrayVec::new();
    let square = wave.cosine * wave.cosine + wave.sine * wave.sine;
    let rest = square - wave.constant * wave.constant;
    if rest < -1e-9 * square {
        return zeros;
    }
    let root = rest.max(0.0).sqrt();
    for root in [root, -root] {
        let c = (-wave.constant * wave.cosine - wave.sine * root) / square;
        let s = (-wave.constant * wave.sine + wave.cosine * root) / square;
        zeros.push((c, s));
        if root == 0.0 {
            break;
        }
    }
    zeros
}

/// The `(cos, sin)` where `a^2 + b^2 = x^2 + y^2`.
fn circle_zeros(a: &Wave, b: &Wave, x: &Wave, y: &Wave) -> ArrayVec<(f64, f64), 16> {
    let (mut constant, mut cosine, mut sine, mut cc, mut cs, mut ss) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (sign, w) in [(1.0, a), (1.0, b), (-1.0, x), (-1.0, y)] {
        constant += sign * w.constant * w.constant;
        cosine += sign * 2.0 * w.constant * w.cosine;
        sine += sign * 2.0 * w.constant * w.sine;
        cc += sign * w.cosine * w.cosine;
        cs += sign * 2.0 * w.cosine * w.sine;
        ss += sign * w.sine * w.sine;
    }
    let mut zeros = ArrayVec::new();
    // Half-angle substitution on the right half circle, and on the left one turned by pi.
    for side in [1.0, -1.0] {
        let (cosine, sine) = (side * cosine, side * sine);
        let quartic = [
            constant + cosine + cc,
            2.0 * (sine + cs),
            2.0 * (constant - cc) + 4.0 * ss,
            2.0 * (sine - cs),
            constant - cosine + cc,
        ];
        for t in roots_in_unit(&quartic) {
            let scale = side / (1.0 + t * t);
            zeros.push(((1.0 - t * t) * scale, 2.0 * t * scale));
        }
    }
    zeros
}

/// The coordinate in `lower..=upper` whose joint angle equals `angle` up to whole turns; the one nearest to the
/// principal value when there are several.
fn in_limits(angle: f64, multiplier: f64, offset: f64, lower: f64, upper: f64) -> Option<f64> {
    let turn = TAU / multiplier.abs();
    let coordinate = (angle - offset) / multiplier;
    for n_turns in [0.0, -1.0, 1.0, -2.0, 2.0] {
        let turned = coordinate + n_turns * turn;
        if turned >= lower - LIMIT_ROUNDING && turned <= upper + LIMIT_ROUNDING {
            return Some(turned.max(lower).min(upper));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::samples::{random_coordinates, random_turning};
    use regrasp_base::Rng;

    #[test]
    fn side_is_the_determinant_but_for_a_constant() {
        let mut n_compared = 0;
        for case in 0..60 {
            let mut rng = Rng::keyed(11, "side", case);
            let (chain, center) = random_turning(3, 3.0, &mut rng);
            let Some(ik) = ThreeR::new(&chain, &center) else { continue };
            let mut ratio = None;
            for _ in 0..20 {
                let q = random_coordinates(&chain, &mut rng);
                let determinant = ik.jacobian(&chain, q.as_slice()).determinant();
                if determinant.abs() < 1e-6 {
                    continue;
                }
                let now = ik.side(q.as_slice()) / determinant;
                let first = *ratio.get_or_insert(now);
                assert!((now - first).abs() < 1e-6 * first.abs(), "case {case}: {now} against {first}");
                n_compared += 1;
            }
        }
        assert!(n_compared > 500);
    }
}
