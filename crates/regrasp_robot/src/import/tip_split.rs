//! Which collision shapes of a tip link are the tip.
//!
//! Only the tip may touch the object. Where the tip link is a whole phalanx, what lies behind its ball is not the tip.

use crate::hand::FingerShape;
use crate::robot::LinkId;
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{ConvexHull, Point, Pose, Shape, UnitVector};
use std::sync::Arc;

/// A shape that reaches at most this many radii from the centre belongs to the tip as a whole.
const WHOLE_WITHIN: f64 = 2.0;
/// A phalanx is cut this many radii behind the centre: cutting at the centre would forbid contacts on the side of the ball.
const CUT_BEHIND: f64 = 0.5;
/// What lies ahead of the cut and stands out of the ball by no more than this is left to the ball, in metres: less than half
/// of the clearance that free tips keep, and than what they must keep.
const NEGLIGIBLE: f64 = 4e-5;

/// The shapes of a tip link whose tip is `own`, a ball or an ellipsoid, all in the frame of `body`, whose joint is the origin.
///
/// A phalanx is replaced by its part behind the tip's ball (the smallest that holds the ellipsoid), which is not tip, by the
/// part ahead where that stands out of the ball, which is tip, and by `own`.
pub(crate) fn split(placed: Vec<PlacedShape>, link: LinkId, body: usize, own: &PlacedShape) -> Vec<FingerShape> {
    let center = Point::from(own.parent_from_shape.translation.vector);
    let radius = own.shape.reach_from(&Point::origin());
    let whole = |placed: PlacedShape, is_tip: bool| FingerShape { body, link, placed, is_tip };
    let Some(axis) = UnitVector::try_new(center.coords, 1e-6) else {
        return placed.into_iter().map(|placed| whole(placed, true)).collect();
    };
    let (mut shapes, mut fronts) = (Vec::new(), Vec::new());
    for placed in placed {
        let center_in_shape = placed.parent_from_shape.inverse() * center;
        if placed.shape.reach_from(&center_in_shape) <= WHOLE_WITHIN * radius {
            shapes.push(whole(placed, true));
            continue;
        }
        match behind(&placed, &center, &axis, radius) {
            Behind::All => shapes.push(whole(placed, false)),
            Behind::Part(part, ahead) => {
                shapes.push(whole(part, false));
                let stands_out = |ahead: &PlacedShape| {
                    ahead.shape.reach_from(&(ahead.parent_from_shape.inverse() * center)) > radius + NEGLIGIBLE
                };
                fronts.extend(ahead.filter(stands_out).map(|ahead| whole(ahead, true)));
            }
            Behind::Unknown => shapes.push(whole(placed, true)),
        }
    }
    if shapes.iter().all(|shape| !shape.is_tip) {
        shapes.push(whole(own.clone(), true));
    }
    shapes.extend(fronts);
    shapes
}

/// What of a shape lies behind the cut.
enum Behind {
    All,
    /// It, and what lies ahead.
    Part(PlacedShape, Option<PlacedShape>),
    /// The shape cannot be cut.
    Unknown,
}

fn behind(placed: &PlacedShape, center: &Point, axis: &UnitVector, radius: f64) -> Behind {
    let cut = center - axis.into_inner() * (CUT_BEHIND * radius);
    match &placed.shape {
        Shape::Capsule { half_length, radius } => {
            let ends = [-half_length, *half_length].map(|z| placed.parent_from_shape * Point::new(0.0, 0.0, z));
            shorten_capsule(ends, &cut, axis, *radius)
        }
        Shape::Convex(hull) => {
            let points: Vec<Point> = hull.vertices().iter().map(|p| placed.parent_from_shape * p).collect();
            cut_polyhedron(&points, hull.triangles(), &cut, axis)
        }
        Shape::Cuboid { half_extents: h } => {
            let corner = |k: usize| {
                let sign = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
                placed.parent_from_shape * Point::new(sign(0) * h.x, sign(1) * h.y, sign(2) * h.z)
            };
            let points: Vec<Point> = (0..8).map(corner).collect();
            match ConvexHull::new(&points) {
                Ok(hull) => cut_polyhedron(hull.vertices(), hull.triangles(), &cut, axis),
                Err(_) => Behind::Unknown,
            }
        }
        _ => Behind::Unknown,
    }
}

/// The capsule whose core ends at the cut.
fn shorten_capsule(ends: [Point; 2], cut: &Point, axis: &UnitVector, radius: f64) -> Behind {
    let ahead = ends.map(|end| axis.dot(&(end - cut)));
    let (near, far) = if ahead[0] < ahead[1] { (0, 1) } else { (1, 0) };
    if ahead[far] <= 0.0 {
        return Behind::All;
    }
    if ahead[near] >= 0.0 {
        return Behind::Unknown;
    }
    let end = ends[near] + (ends[far] - ends[near]) * (ahead[near] / (ahead[near] - ahead[far]));
    // Both halves have the ball about the cut, so that together they are the whole.
    Behind::Part(capsule([ends[near], end], radius), Some(capsule([end, ends[far]], radius)))
}

/// The capsule between two centres.
fn capsule([from, to]: [Point; 2], radius: f64) -> PlacedShape {
    let along = to - from;
    let rotation = UnitQuaternion::rotation_between(&nalgebra::Vector3::z(), &along)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), std::f64::consts::PI));
    let middle = nalgebra::center(&from, &to);
    let shape = Shape::Capsule { half_length: 0.5 * along.norm(), radius };
    PlacedShape { parent_from_shape: Pose::from_parts(Translation3::from(middle.coords), rotation), shape }
}

/// The hulls of the points on either side of the cut, each with the edges' crossings.
fn cut_polyhedron(points: &[Point], triangles: &[[u32; 3]], cut: &Point, axis: &UnitVector) -> Behind {
    let ahead: Vec<f64> = points.iter().map(|p| axis.dot(&(p - cut))).collect();
    if ahead.iter().all(|&a| a <= 0.0) {
        return Behind::All;
    }
    let mut crossings = Vec::new();
    for corners in triangles {
        for k in 0..3 {
            let (i, j) = (corners[k] as usize, corners[(k + 1) % 3] as usize);
            if ahead[i] < 0.0 && ahead[j] > 0.0 {
                crossings.push(points[i] + (points[j] - points[i]) * (ahead[i] / (ahead[i] - ahead[j])));
            }
        }
    }
    let hull_of = |is_kept: &dyn Fn(f64) -> bool| {
        let kept = points.iter().zip(&ahead).filter(|(_, a)| is_kept(**a)).map(|(p, _)| *p);
        let hull = ConvexHull::new(&kept.chain(crossings.iter().copied()).collect::<Vec<_>>()).ok()?;
        Some(PlacedShape { parent_from_shape: Pose::identity(), shape: Shape::Convex(Arc::new(hull)) })
    };
    match hull_of(&|a| a <= 0.0) {
        Some(part) => Behind::Part(part, hull_of(&|a| a >= 0.0)),
        None => Behind::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const RADIUS: f64 = 0.01;

    fn ball(center: &Point) -> PlacedShape {
        let parent_from_shape = Pose::from_parts(Translation3::from(center.coords), UnitQuaternion::identity());
        PlacedShape { parent_from_shape, shape: Shape::Sphere { radius: RADIUS } }
    }

    /// Points on a capsule along x from 0.02 to `CENTER` with a ball of `RADIUS` at its end: a phalanx.
    fn phalanx_points() -> Vec<Point> {
        let mut points = Vec::new();
        for k in 0..24 {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 24.0).sin_cos();
            points.push(Point::new(0.02, RADIUS * cos, RADIUS * sin));
            for elevation in 0..6 {
                let (up, out) = (f64::from(elevation) * std::f64::consts::FRAC_PI_2 / 6.0).sin_cos();
                points.push(Point::new(0.07 + RADIUS * up, RADIUS * out * cos, RADIUS * out * sin));
            }
        }
        points.push(Point::new(0.08, 0.0, 0.0));
        points
    }

    #[test]
    fn a_phalanx_is_cut_behind_its_ball_and_nothing_else_is_lost() {
        let center = Point::new(0.07, 0.0, 0.0);
        let points = phalanx_points();
        let whole = Arc::new(ConvexHull::new(&points).unwrap());
        let placed = PlacedShape { parent_from_shape: Pose::identity(), shape: Shape::Convex(whole.clone()) };
        let shapes = split(vec![placed], LinkId(3), 1, &ball(&center));
        assert_eq!(shapes.iter().map(|s| s.is_tip).collect::<Vec<_>>(), [false, true, true]);
        let Shape::Convex(rest) = &shapes[0].placed.shape else { panic!("{:?}", shapes[0]) };
        assert_eq!(shapes[1].placed.shape, Shape::Sphere { radius: RADIUS });
        let Shape::Convex(front) = &shapes[2].placed.shape else { panic!("{:?}", shapes[2]) };
        let cut_at = 0.07 - CUT_BEHIND * RADIUS;
        assert!(rest.vertices().iter().all(|p| p.x <= cut_at + 1e-12));
        assert!(front.vertices().iter().all(|p| p.x >= cut_at - 1e-12));
        let mut rng = regrasp_base::Rng::keyed(1, "split", 0);
        let mut hints = [0, 0, 0];
        // By support in random directions both parts lie in the whole, and one of them reaches as far.
        for _ in 0..500 {
            let direction = Vector3::new(rng.normal(), rng.normal(), rng.normal()).normalize();
            let [in_rest, in_front, in_whole] = [(rest, 0), (front, 1), (&whole, 2)]
                .map(|(hull, k)| direction.dot(&hull.support(&direction, &mut hints[k]).coords));
            assert!((in_rest.max(in_front) - in_whole).abs() < 1e-12, "{in_rest} {in_front} {in_whole}");
        }
    }

    #[test]
    fn what_lies_within_the_ball_is_left_to_it() {
        let center = Point::new(0.07, 0.0, 0.0);
        // A phalanx that narrows to a point inside the ball.
        let points: Vec<Point> = [(0.0, 0.0), (0.01, 0.0), (-0.005, 0.008), (-0.005, -0.008)]
            .iter()
            .map(|&(y, z)| Point::new(0.02, y, z))
            .chain([Point::new(0.075, 0.0, 0.0)])
            .collect();
        let hull = Arc::new(ConvexHull::new(&points).unwrap());
        let placed = PlacedShape { parent_from_shape: Pose::identity(), shape: Shape::Convex(hull) };
        let shapes = split(vec![placed], LinkId(3), 1, &ball(&center));
        assert_eq!(shapes.iter().map(|s| s.is_tip).collect::<Vec<_>>(), [false, true]);
    }

    #[test]
    fn nothing_of_a_capsule_is_lost_that_is_wider_or_longer_than_the_ball() {
        let turned = UnitQuaternion::from_axis_angle(&nalgebra::Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let mut rng = regrasp_base::Rng::keyed(2, "split", 0);
        for (wider, end) in [(1.0, 0.07), (1.2, 0.068), (0.9, 0.075)] {
            let (middle, half_length, radius) = ((0.01 + end) / 2.0, (end - 0.01) / 2.0, wider * RADIUS);
            let at = Pose::from_parts(Translation3::new(middle, 0.0, 0.0), turned);
            let placed = PlacedShape { parent_from_shape: at, shape: Shape::Capsule { half_length, radius } };
            let center = Point::new(0.07, 0.0, 0.0);
            let shapes = split(vec![placed], LinkId(3), 1, &ball(&center));
            let holds = |shape: &PlacedShape, point: &Point| {
                let own = shape.parent_from_shape.inverse_transform_point(point);
                match shape.shape {
                    Shape::Sphere { radius } => own.coords.norm() <= radius + 1e-9,
                    Shape::Capsule { half_length, radius } => {
                        (own.coords - Vector3::z() * own.z.clamp(-half_length, half_length)).norm() <= radius + 1e-9
                    }
                    _ => panic!("{shape:?}"),
                }
            };
            for _ in 0..2000 {
                let across = Vector3::new(0.0, rng.normal(), rng.normal()).normalize() * radius;
                let on_side = Point::new(rng.uniform(0.01, end), across.y, across.z);
                assert!(shapes.iter().any(|shape| holds(&shape.placed, &on_side)), "{wider} {end} {on_side}");
            }
        }
    }

    #[test]
    fn a_capsule_is_shortened_to_the_cut_and_a_small_tip_is_left_whole() {
        let turned = UnitQuaternion::from_axis_angle(&nalgebra::Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let at = |x: f64| Pose::from_parts(Translation3::new(x, 0.0, 0.0), turned);
        let capsule =
            PlacedShape { parent_from_shape: at(0.04), shape: Shape::Capsule { half_length: 0.03, radius: RADIUS } };
        let small = PlacedShape { parent_from_shape: at(0.07), shape: Shape::Sphere { radius: RADIUS } };
        let shapes = split(vec![capsule, small.clone()], LinkId(3), 1, &ball(&Point::new(0.07, 0.0, 0.0)));
        assert_eq!(shapes.len(), 3);
        assert_eq!((shapes[1].is_tip, &shapes[1].placed), (true, &small));
        let Shape::Capsule { half_length, radius } = shapes[0].placed.shape else { panic!("{:?}", shapes[0]) };
        assert!(!shapes[0].is_tip && radius == RADIUS);
        let ends = [-half_length, half_length].map(|z| shapes[0].placed.parent_from_shape * Point::new(0.0, 0.0, z));
        let (low, high) = (ends[0].x.min(ends[1].x), ends[0].x.max(ends[1].x));
        assert!((low - 0.01).abs() < 1e-12 && (high - 0.065).abs() < 1e-12, "{low} {high}");
        let Shape::Capsule { half_length, radius } = shapes[2].placed.shape else { panic!("{:?}", shapes[2]) };
        assert!(shapes[2].is_tip && radius == RADIUS && (half_length - 0.0025).abs() < 1e-12);
    }
}
