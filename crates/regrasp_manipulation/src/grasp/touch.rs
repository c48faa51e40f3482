//! Where a fingertip touches, and how far it is from touching.

use crate::model::Model;
use nalgebra::{Matrix2, Vector2};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::surface::{Surface, SurfacePoint};
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use regrasp_robot::tip::CurvedTip;
use std::cell::Cell;

/// Gaps below this touch, in metres.
const TOUCHES: f64 = 1e-8;
/// Roots are found to this distance, in metres.
const AS_GOOD_AS_ZERO: f64 = 1e-11;
/// Most steps to a root.
const MOST_ROOT_STEPS: usize = 90;
/// Turns of the normal below this are none.
const SAME_NORMAL: f64 = 1e-11;
/// Most steps to the point of a fingertip that faces the surface. By hand: most take three, of long tips with flat sides six.
const MOST_STEPS: usize = 16;
/// Tips farther than this from the surface are not looked at closely, in metres.
const LOOK_CLOSELY: f64 = 0.004;
/// Turn of the normal by which slopes are measured, in radians.
const TURN: f64 = 1e-7;
/// Largest turn of a step, in radians.
const LARGEST_TURN: f64 = 0.5;
/// Shortest step, as a share of Newton's.
const LEAST_SHARE: f64 = 0.02;
/// Nearer to the surface than this, the direction from it is rounding, in metres.
const FLAT_BELOW: f64 = 1e-5;

/// The point of a fingertip that is nearest to the surface.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    /// Distance from the surface; negative inside.
    pub distance: f64,
    /// The nearest point of the surface.
    at: SurfacePoint,
    /// The surface's outward normal there: on an edge one of those between its faces.
    normal: Vector,
    /// True unless only a lower bound of the distance is known.
    is_exact: bool,
}

/// How far the tip of `finger` is from the object.
pub fn gap(model: &Model, finger: usize, hand_from_object: &Pose, joints: &[f64]) -> Gap {
    gap_from(model, finger, hand_from_object, joints, None)
}

/// The same, looked for around the normal of the object where the tip was nearest a little before: a long tip with flat sides is seldom
/// nearest where its centre is.
fn gap_from(
    model: &Model,
    finger: usize,
    hand_from_object: &Pose,
    joints: &[f64],
    normal_before: Option<Vector>,
) -> Gap {
    let surface = &model.view.object.surface;
    let of_hand = &model.fingers[finger];
    let center = hand_from_object.inverse_transform_point(&of_hand.ik.tip(joints));
    let (at, distance) = surface.project_signed(&center);
    let smooth = at.normal_in_object.into_inner();
    // On edges and corners, too, the normal of a ball points to its centre; that of the surface is smoothed over scans.
    let away = (center - at.point_in_object).try_normalize(FLAT_BELOW).map(|away| away * distance.signum());
    let normal = away.unwrap_or(smooth);
    let rough = Gap { distance: distance - of_hand.tip_radius, at, normal, is_exact: of_hand.curved.is_none() };
    match of_hand.curved {
        Some(tip) if rough.distance < LOOK_CLOSELY => {
            let arm = |normal: &Vector| {
                hand_from_object.inverse_transform_vector(&of_hand.arm_with(joints, &(hand_from_object * normal)))
            };
            let from = |normal: Vector| nearest(surface, &center, arm, least_radius(&tip), normal);
            normal_before.and_then(from).or_else(|| from(normal)).unwrap_or(rough)
        }
        _ => rough,
    }
}

/// A ball of this radius rolls on the inside of the whole tip.
fn least_radius(tip: &CurvedTip) -> f64 {
    match tip {
        CurvedTip::Ellipsoid(ellipsoid) => 0.9 * ellipsoid.radii.min().powi(2) / ellipsoid.radii.max(),
        CurvedTip::Smooth(surface) => 0.8 * surface.rounding(),
    }
}

/// The nearest points of a tip and the surface, by Newton's method on the normal: with a ball of radius `inner` rolled off the tip, the
/// direction from the surface to what is left of it is the surface's normal, on edges and corners too.
fn nearest(
    surface: &Surface,
    center: &Point,
    arm: impl Fn(&Vector) -> Vector,
    inner: f64,
    start: Vector,
) -> Option<Gap> {
    let look = |normal: &Vector| {
        let point = center + arm(normal) + normal * inner;
        let (at, distance) = surface.project_signed(&point);
        let away = (point - at.point_in_object).try_normalize(1e-12).map(|away| away * distance.signum());
        let seen = away.unwrap_or_else(|| at.normal_in_object.into_inner());
        (Gap { distance: distance - inner, at, normal: seen, is_exact: true }, seen - normal)
    };
    let mut normal = start;
    let (mut gap, mut error) = look(&normal);
    for _ in 0..MOST_STEPS {
        if error.norm() < SAME_NORMAL {
            return Some(gap);
        }
        let (x, y) = tangents(&UnitVector::new_unchecked(normal));
        let turned = |along: &Vector, by: f64| (normal + along * by).normalize();
        let slope = |along: &Vector| (look(&turned(along, TURN)).1 - error) / TURN;
        let (dx, dy) = (slope(&x), slope(&y));
        let across = |v: &Vector| Vector2::new(v.dot(&x), v.dot(&y));
        let newton = Matrix2::from_columns(&[across(&dx), across(&dy)])
            .try_inverse()
            .map(|inverse| -(inverse * across(&error)))
            .filter(|step| step.norm() < LARGEST_TURN);
        // Where Newton's method leads nowhere, the direction seen is a better normal often enough.
        let step = newton.unwrap_or_else(|| across(&error) * 0.5);
        let mut share = 1.0;
        let next = loop {
            let next = turned(&(x.into_inner() * step.x + y.into_inner() * step.y), share);
            let seen = look(&next);
            if seen.1.norm() < error.norm() || share < LEAST_SHARE {
                break (next, seen);
            }
            share *= 0.5;
        };
        (normal, (gap, error)) = next;
    }
    None
}

/// The contact of a tip that touches, if it may touch there: away from creases, with its pad, and nowhere else.
pub fn contact(model: &Model, finger: usize, hand_from_object: &Pose, joints: &[f64], gap: &Gap) -> Option<Contact> {
    let normal = UnitVector::new_normalize(gap.normal);
    let may = gap.is_exact
        && model.keeps_off_edges(&gap.at)
        && model.fingers[finger].pad_faces(joints, &(hand_from_object * normal.into_inner()));
    may.then_some(Contact { point_in_object: gap.at.point_in_object, normal_in_object: normal })
}

/// How far beyond the grasp a finger closes on its line, as a share of the line: fingers of other tools press in, or stop before.
const BEYOND: f64 = 0.3;
/// Largest way beyond the grasp, in radians or metres.
const FARTHEST_BEYOND: f64 = 0.15;
/// Shortest step of a fingertip that is still away, in metres.
const LEAST_STEP: f64 = 1e-4;
/// Most steps of a finger.
const MOST_STEPS_OF_FINGER: usize = 4_000;

/// The contact that a finger makes on the straight line in joint space from `open` to `closed` and a little beyond, with its joints there.
pub fn touch_on_way(
    model: &Model,
    finger: usize,
    hand_from_object: &Pose,
    open: &Coordinates,
    closed: &Coordinates,
) -> Option<(Contact, Coordinates)> {
    let of_hand = &model.fingers[finger];
    let chain = of_hand.ik.chain();
    let largest = open.iter().zip(closed).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    let end = 1.0 + BEYOND.min(FARTHEST_BEYOND / largest.max(1e-9));
    let change: Coordinates = open.iter().zip(closed).map(|(a, b)| b - a).collect();
    let turn: f64 = change.iter().map(|x| x.abs()).sum();
    let speed =
        of_hand.tip_bound.first_order(&change) + if of_hand.curved.is_some() { of_hand.tip_radius * turn } else { 0.0 };
    let at = |share: f64| -> Coordinates {
        let position = |k: usize| (open[k] + change[k] * share).clamp(chain.lower[k], chain.upper[k]);
        // At the grasp itself the joints are those that are given, to the last bit.
        if share == 1.0 { closed.clone() } else { (0..change.len()).map(position).collect() }
    };
    let normal_before = Cell::new(None);
    let gap_at = |share: f64| {
        let gap = gap_from(model, finger, hand_from_object, &at(share), normal_before.get());
        normal_before.set(gap.is_exact.then_some(gap.normal));
        gap
    };
    let touching = |share: f64, gap: &Gap| {
        let joints = at(share);
        contact(model, finger, hand_from_object, &joints, gap).map(|contact| (contact, joints))
    };
    let at_grasp = gap_at(1.0);
    if at_grasp.distance.abs() <= TOUCHES {
        return touching(1.0, &at_grasp);
    }
    let (mut before, mut share, mut known) = (0.0, 0.0, gap_at(0.0));
    for _ in 0..MOST_STEPS_OF_FINGER {
        if known.distance <= 0.0 || share >= end {
            break;
        }
        before = share;
        share = (share + known.distance.max(LEAST_STEP) / speed.max(1e-9)).min(end);
        known = gap_at(share);
    }
    if known.distance > 0.0 || share == 0.0 {
        return None;
    }
    let touch = first_touch([before, share], |share| gap_at(share).distance);
    let gap = gap_at(touch);
    if gap.distance.abs() <= TOUCHES { touching(touch, &gap) } else { None }
}

/// Where a distance that is positive at the first of two places and not at the second is as good as zero: by regula falsi, with the
/// end that stays weighted less every time (Illinois), and by halving where that gains little.
pub fn first_touch([mut outside, mut inside]: [f64; 2], distance: impl Fn(f64) -> f64) -> f64 {
    let (mut high, mut low) = (distance(outside), distance(inside));
    let mut last = 0;
    for step in 0..MOST_ROOT_STEPS {
        if high <= AS_GOOD_AS_ZERO {
            break;
        }
        let falsi = outside + (inside - outside) * high / (high - low);
        let next = if step % 3 == 2 || !falsi.is_finite() { 0.5 * (outside + inside) } else { falsi };
        let seen = distance(next);
        if seen > 0.0 {
            (outside, high) = (next, seen);
            low *= if last == 1 { 0.5 } else { 1.0 };
            last = 1;
        } else {
            if seen >= -AS_GOOD_AS_ZERO {
                return next;
            }
            (inside, low) = (next, seen);
            high *= if last == -1 { 0.5 } else { 1.0 };
            last = -1;
        }
    }
    outside
}

#[cfg(test)]
mod tests {
    use super::{first_touch, least_radius, nearest};
    use regrasp_base::Rng;
    use regrasp_geometry::hull::ConvexHull;
    use regrasp_geometry::{Point, Shape, Surface, Vector};
    use regrasp_robot::tip::CurvedTip;
    use regrasp_robot::tip::smooth_hull::SmoothHull;

    /// A long, flat tip goes past a ball and over its end: from where it was nearest before, its nearest point is found all along, on faces, edges
    /// and corners. The distance from a ball is the largest, over all directions, of that between planes across the direction.
    #[test]
    fn a_long_tip_is_followed_past_a_ball() {
        let half = Vector::new(0.08, 0.01, 0.006);
        let corner = |k: usize| half.map_with_location(|i, _, x| if k >> i & 1 == 1 { x } else { -x });
        let corners: Vec<Point> = (0..8).map(|k| Point::from(corner(k))).collect();
        let (hull, _) = SmoothHull::near(&ConvexHull::new(&corners).unwrap(), None).unwrap();
        let tip = CurvedTip::Smooth(&hull);
        let radius = 0.03;
        let ball = Surface::of(&Shape::Sphere { radius }).unwrap();
        let mut rng = Rng::keyed(1, "long_tip", 0);
        let directions: Vec<Vector> = (0..20_000).map(|_| Vector::from(rng.direction())).collect();
        let (mut before, mut n_known) = (None, 0);
        let n_places = 200;
        for k in 0..n_places {
            let share = f64::from(k) / f64::from(n_places - 1);
            let center = Point::new(-0.12 + 0.24 * share, 0.004 + 0.02 * share, 0.045 - 0.006 * share);
            let from = |normal| nearest(&ball, &center, |n| tip.arm(&-n), least_radius(&tip), normal);
            let straight = center.coords.normalize();
            let Some(gap) = before.and_then(from).or_else(|| from(straight)) else {
                before = None;
                continue;
            };
            before = Some(gap.normal);
            n_known += 1;
            let between = |n: &Vector| n.dot(&center.coords) - hull.support(&-n) - radius;
            let largest = directions.iter().map(&between).fold(f64::NEG_INFINITY, f64::max);
            assert!((between(&gap.normal) - gap.distance).abs() < 1e-9, "{k}");
            assert!(largest < gap.distance + 1e-9 && largest > gap.distance - 2e-3, "{k}: {largest} {}", gap.distance);
        }
        assert!(n_known >= n_places - 2, "{n_known}");
    }

    #[test]
    fn roots_are_found_whatever_the_shape() {
        let line = first_touch([0.0, 1.0], |x| 0.3 - x);
        assert!((line - 0.3).abs() < 1e-10, "{line}");
        let kink = first_touch([0.0, 1.0], |x| if x < 0.7 { 1e-3 * (0.7 - x) } else { 50.0 * (0.7 - x) });
        assert!((kink - 0.7).abs() < 1e-6, "{kink}");
        let curve = first_touch([0.0, 2.0], |x: f64| 2.0 - x * x);
        assert!((curve - 2f64.sqrt()).abs() < 1e-9, "{curve}");
    }
}
