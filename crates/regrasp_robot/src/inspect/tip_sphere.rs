//! The tip at the distal end of a link, from its collision geometry: a ball where one fits, else the geometry itself.

use crate::hand::convex_of;
use crate::import::hull_tip::HullTips;
use crate::import::spec::{PadSpec, TipSpec};
use crate::tip::{LARGEST_MISFIT, Pad, TipShape, spiral};
use nalgebra::{Matrix4, Vector4};
use regrasp_geometry::collision::support::support_value;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Shape, UnitVector, Vector};

/// How far, relative to the radius, vertices may be from the fitted ball to count as on it.
const ON_BALL: f64 = 0.01;
/// Fewest vertices on a ball.
const MIN_ON_BALL: usize = 12;
/// Largest difference between a ball and the outside of the link, in metres.
const BALL_FITS: f64 = 0.15e-3;
/// Pads of a whole phalanx that are tried, in degrees from its axis.
const LONG_PADS: [f64; 5] = [100.0, 80.0, 60.0, 45.0, 30.0];
/// Slices of the distal end that are tried.
const SLICES: usize = 60;

/// The point of `shape` farthest from `from`, in the shape's frame; for round shapes along the ray through the centre.
pub(super) fn farthest_point(shape: &Shape, from: &Point) -> Point {
    let away = |center: Point, radius: f64| {
        let direction = (center - from).try_normalize(1e-12).unwrap_or_else(Vector::z);
        center + direction * radius
    };
    let farthest = |points: &[Point]| {
        points.iter().fold((-1.0, Point::origin()), |best, p| {
            let distance = (p - from).norm();
            if distance > best.0 { (distance, *p) } else { best }
        })
    };
    match shape {
        Shape::Sphere { radius } => away(Point::origin(), *radius),
        Shape::Capsule { half_length, radius } => {
            let ends =
                [away(Point::new(0.0, 0.0, *half_length), *radius), away(Point::new(0.0, 0.0, -half_length), *radius)];
            farthest(&ends).1
        }
        Shape::Convex(hull) => farthest(hull.vertices()).1,
        Shape::Mesh(mesh) => farthest(mesh.vertices()).1,
        Shape::Cuboid { .. } | Shape::Cylinder { .. } | Shape::Ellipsoid { .. } => {
            let (low, high) = shape.bounds();
            let corner = |k: usize| {
                Point::new(
                    if k & 1 == 0 { low.x } else { high.x },
                    if k & 2 == 0 { low.y } else { high.y },
                    if k & 4 == 0 { low.z } else { high.z },
                )
            };
            farthest(&(0..8).map(corner).collect::<Vec<_>>()).1
        }
    }
}

/// The tip of a link with collision geometry `shapes`, whose distal end `end` is a point of the one of index `element`, seen
/// from joint origin `joint` (all in the link frame): a sphere where one fits, else the hull of that one. The hull of a whole
/// phalanx gets a pad, and so does one that no smooth surface follows closely all around.
pub(super) fn fit_tip(
    shapes: &[PlacedShape],
    joint: &Point,
    element: usize,
    end: &Point,
) -> (TipSpec, Option<PadSpec>) {
    for placed in shapes {
        let center = |z: f64| placed.parent_from_shape * Point::new(0.0, 0.0, z);
        let centers: Vec<(Point, f64)> = match placed.shape {
            Shape::Sphere { radius } => vec![(center(0.0), radius)],
            Shape::Capsule { half_length, radius } => {
                vec![(center(half_length), radius), (center(-half_length), radius)]
            }
            _ => Vec::new(),
        };
        if let Some(&(center, radius)) = centers.iter().find(|(c, r)| ((end - c).norm() - r).abs() < 1e-6) {
            return (TipSpec::Sphere { radius, center }, None);
        }
    }
    let vertices: Vec<Point> = shapes
        .iter()
        .flat_map(|placed| {
            let vertices = match &placed.shape {
                Shape::Mesh(mesh) => mesh.vertices(),
                Shape::Convex(hull) => hull.vertices(),
                _ => &[],
            };
            vertices.iter().map(move |v| placed.parent_from_shape * v)
        })
        .collect();
    let axis = UnitVector::try_new(end - joint, 1e-9);
    let ball = fit_distal_ball(&vertices, joint, end).map(|(center, radius)| (center.map(round), round(radius)));
    let fits = |(center, radius): &(Point, f64)| {
        axis.is_some_and(|axis| ball_error(shapes, center, *radius, &axis) <= BALL_FITS)
    };
    if let Some((center, radius)) = ball.filter(fits) {
        return (TipSpec::Sphere { radius, center }, None);
    }
    let needs_pad = |axis: &UnitVector| is_long(&shapes[element], axis) || !is_followed(&shapes[element], end, None);
    let pad = axis.filter(needs_pad).map(|axis| pad_of(&shapes[element], end, axis));
    let elements = if shapes.len() > 1 { vec![element] } else { Vec::new() };
    (TipSpec::Hull { center: *end, elements }, pad)
}

/// The widest pad about `axis` over which a smooth surface follows the hull of a phalanx as closely as scenes ask.
fn pad_of(placed: &PlacedShape, end: &Point, axis: UnitVector) -> PadSpec {
    let axis = UnitVector::new_normalize(axis.map(|x| (x * 1e4).round()));
    let follows =
        |angle: &f64| is_followed(placed, end, Some(&Pad { axis_in_body: axis, cosine: angle.to_radians().cos() }));
    let angle = LONG_PADS.into_iter().find(follows).unwrap_or(LONG_PADS[LONG_PADS.len() - 1]);
    PadSpec { axis, angle: angle.to_radians() }
}

/// True where a smooth surface about `end` follows the hull of a shape, over a pad or all around, as closely as scenes ask.
fn is_followed(placed: &PlacedShape, end: &Point, pad: Option<&Pad>) -> bool {
    let convex = convex_of(&placed.shape).map(|shape| PlacedShape { shape, ..placed.clone() });
    let made = convex.ok().and_then(|convex| HullTips::default().make(&[&convex], end, pad, &[]).ok());
    made.is_some_and(|(_, tip)| matches!(tip, TipShape::Hull { misfit, .. } if misfit <= LARGEST_MISFIT))
}

/// Largest difference of a ball from the outside of `shapes`, whose directions are within 60 degrees of `axis`.
fn ball_error(shapes: &[PlacedShape], center: &Point, radius: f64, axis: &UnitVector) -> f64 {
    let reach = |n: &Vector| {
        let of = |placed: &PlacedShape| {
            let own = placed.parent_from_shape.rotation.inverse() * n;
            (placed.parent_from_shape.translation.vector - center.coords).dot(n)
                + support_value(&placed.shape, &own, &mut 0)
        };
        shapes.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
    };
    let front = spiral(1000).filter(|n| n.dot(axis) >= 0.5);
    front.map(|n| (reach(&n) - radius).abs()).fold(0.0, f64::max)
}

/// True for a shape that is more than twice as long along `axis` as it is wide.
fn is_long(placed: &PlacedShape, axis: &UnitVector) -> bool {
    let extent = |n: &Vector| {
        let own = placed.parent_from_shape.rotation.inverse() * n;
        support_value(&placed.shape, &own, &mut 0) + support_value(&placed.shape, &-own, &mut 0)
    };
    let (x, y) = regrasp_geometry::frame::tangents(axis);
    extent(axis) > 2.0 * extent(&x).max(extent(&y))
}

/// To a hundredth of a millimetre: facets are not better than that, and files stay readable.
fn round(value: f64) -> f64 {
    (value * 1e5).round() / 1e5 + 0.0
}

/// The ball that most vertices near the distal end lie on.
fn fit_distal_ball(vertices: &[Point], joint: &Point, end: &Point) -> Option<(Point, f64)> {
    let axis = (end - joint).try_normalize(1e-9)?;
    let along = |p: &Point| axis.dot(&(p - joint));
    let (low, high) =
        vertices.iter().map(along).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
    let mut best: Option<(usize, Point, f64)> = None;
    for slice in 1..=SLICES {
        let cut = high - (high - low) * slice as f64 / SLICES as f64;
        let near: Vec<Point> = vertices.iter().filter(|p| along(p) >= cut).copied().collect();
        let Some((center, radius)) = fit_ball(&near) else { continue };
        let off = |p: &Point| ((p - center).norm() - radius).abs();
        let fits = near.iter().all(|p| off(p) <= ON_BALL * radius);
        let reaches_end = (along(&center) + radius - high).abs() <= 5.0 * ON_BALL * radius;
        let on_ball = vertices.iter().filter(|p| off(p) <= ON_BALL * radius).count();
        if fits && reaches_end && on_ball >= MIN_ON_BALL && best.is_none_or(|(most, _, _)| on_ball >= most) {
            best = Some((on_ball, center, radius));
        }
    }
    best.map(|(_, center, radius)| (center, radius))
}

/// Algebraic least squares: `|p|^2 = 2 c.p + (r^2 - |c|^2)` is linear in `c` and the last term.
fn fit_ball(points: &[Point]) -> Option<(Point, f64)> {
    if points.len() < 4 {
        return None;
    }
    let mean = points.iter().map(|p| p.coords).sum::<Vector>() / points.len() as f64;
    let mut normal = Matrix4::zeros();
    let mut right = Vector4::zeros();
    for point in points {
        let p = point.coords - mean;
        let row = Vector4::new(2.0 * p.x, 2.0 * p.y, 2.0 * p.z, 1.0);
        normal += row * row.transpose();
        right += row * p.norm_squared();
    }
    let solution = normal.lu().solve(&right)?;
    let center = solution.xyz();
    let squared = solution.w + center.norm_squared();
    (squared.is_finite() && squared > 0.0).then(|| (Point::from(center + mean), squared.sqrt()))
}
