//! A piece of the object's surface, and the point of it that is nearest to a fingertip's centre beside it.
//!
//! Closed forms for primitives (Eberly, "Distance from a Point to an Ellipse, an Ellipsoid", 2013, for the ellipsoid);
//! polyhedra keep the triangles that come near.

use crate::check::surface::{SortedShape, nearest_on_edge};
use regrasp_geometry::{Point, Shape, Vector};

/// Most steps of Newton's method for an ellipsoid; it converges from one side, and quadratically at the end.
const MOST_NEWTON_STEPS: usize = 60;

/// The surface near some place.
#[derive(Debug, Clone)]
pub enum Patch<'a> {
    /// All of a primitive.
    Primitive(&'a Shape),
    /// Triangles of a polyhedron; possibly none.
    Triangles(Vec<Facet>),
}

/// A triangle, and how far from its first corner it reaches.
#[derive(Debug, Clone, Copy)]
pub struct Facet {
    /// Its corners.
    pub corners: [Point; 3],
    /// No point of it is farther from the first corner, in metres.
    pub reach: f64,
}

impl<'a> Patch<'a> {
    /// All of the surface of `shape` within `reach` of `center`, and perhaps more; in the frame of the shape.
    pub fn near(shape: &'a SortedShape, center: &Point, reach: f64) -> Self {
        let pieces = match shape {
            SortedShape::Polyhedron(pieces) => pieces,
            SortedShape::Primitive(primitive) => return Patch::Primitive(primitive),
        };
        let facets = pieces.near(center, reach).into_iter().map(|triangle| {
            let corners = pieces.corners(triangle);
            let [a, b, c] = &corners;
            Facet { reach: (b - a).norm_squared().max((c - a).norm_squared()).sqrt(), corners }
        });
        Patch::Triangles(facets.filter(|facet| (facet.corners[0] - center).norm() <= reach + facet.reach).collect())
    }

    /// The patch without the triangles that `keep` does not keep.
    pub fn only(self, mut keep: impl FnMut(&Facet) -> bool) -> Self {
        match self {
            Patch::Primitive(_) => self,
            Patch::Triangles(facets) => Patch::Triangles(facets.into_iter().filter(|facet| keep(facet)).collect()),
        }
    }

    /// True when nothing of the surface is in the patch.
    pub fn is_empty(&self) -> bool {
        matches!(self, Patch::Triangles(facets) if facets.is_empty())
    }

    /// The point of the patch that is nearest to `point`; none when the patch is empty.
    ///
    /// For primitives `point` must be outside or near the surface: deep inside, some nearest point is one of many.
    pub fn foot(&self, point: &Point) -> Option<Point> {
        match self {
            Patch::Primitive(shape) => Some(foot_on(shape, point)),
            Patch::Triangles(facets) => {
                let mut nearest: Option<(f64, Point)> = None;
                for Facet { corners, reach } in facets {
                    let best = nearest.map_or(f64::INFINITY, |(distance, _)| distance);
                    // No point of the triangle is nearer than the first corner less the reach.
                    if (corners[0] - point).norm_squared() > (best + reach) * (best + reach) {
                        continue;
                    }
                    let foot = nearest_on_triangle(point, corners);
                    let distance = (foot - point).norm();
                    if distance < best {
                        nearest = Some((distance, foot));
                    }
                }
                nearest.map(|(_, foot)| foot)
            }
        }
    }
}

fn foot_on(shape: &Shape, point: &Point) -> Point {
    match shape {
        Shape::Sphere { radius } => Point::from(along(&point.coords, &Vector::z()) * *radius),
        Shape::Capsule { half_length, radius } => {
            let on_axis = Vector::z() * point.z.clamp(-half_length, *half_length);
            Point::from(on_axis + along(&(point.coords - on_axis), &Vector::x()) * *radius)
        }
        Shape::Cuboid { half_extents } => foot_on_cuboid(point, half_extents),
        Shape::Cylinder { half_length, radius } => foot_on_cylinder(point, *half_length, *radius),
        Shape::Ellipsoid { radii } => foot_on_ellipsoid(point, radii),
        Shape::Convex(_) | Shape::Mesh(_) => unreachable!("polyhedra are kept as triangles"),
    }
}

fn along(way: &Vector, otherwise: &Vector) -> Vector {
    way.try_normalize(1e-300).unwrap_or(*otherwise)
}

fn foot_on_cuboid(point: &Point, half_extents: &Vector) -> Point {
    let mut foot = point.coords.zip_map(half_extents, |x, half| x.clamp(-half, half));
    if foot == point.coords {
        let depth = half_extents - point.coords.abs();
        let nearest = depth.imin();
        foot[nearest] = half_extents[nearest].copysign(point[nearest]);
    }
    Point::from(foot)
}

fn foot_on_cylinder(point: &Point, half_length: f64, radius: f64) -> Point {
    let across = Vector::new(point.x, point.y, 0.0);
    let (mut distance, mut height) = (across.norm().min(radius), point.z.clamp(-half_length, half_length));
    if across.norm() < radius && point.z.abs() < half_length {
        if radius - across.norm() < half_length - point.z.abs() {
            distance = radius;
        } else {
            height = half_length.copysign(point.z);
        }
    }
    Point::from(along(&across, &Vector::x()) * distance + Vector::z() * height)
}

/// The foot is `radii^2 point / (t + radii^2)`, component by component, with the largest `t` at which it is on the
/// surface. What vanishes there is convex and falls in `t`, and is not negative where the search begins.
fn foot_on_ellipsoid(point: &Point, radii: &Vector) -> Point {
    let squares = radii.component_mul(radii);
    let mut t = (0..3).map(|k| radii[k] * (point[k].abs() - radii[k])).fold(f64::NEG_INFINITY, f64::max);
    for _ in 0..MOST_NEWTON_STEPS {
        let (mut value, mut slope) = (-1.0, 0.0);
        for k in 0..3 {
            let share = (radii[k] * point[k] / (t + squares[k])).powi(2);
            value += share;
            slope -= 2.0 * share / (t + squares[k]);
        }
        let step = -value / slope;
        if !(step.is_finite() && step > 1e-16 * squares.max()) {
            break;
        }
        t += step;
    }
    Point::from(squares.component_mul(&point.coords).zip_map(&squares, |x, square| x / (t + square)))
}

/// The point of a triangle that is nearest to `point`.
fn nearest_on_triangle(point: &Point, corners: &[Point; 3]) -> Point {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let inside =
        [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).cross(&(point - *from)).dot(&normal) >= 0.0);
    if inside && normal.norm_squared() > 0.0 {
        return point - normal * ((point - a).dot(&normal) / normal.norm_squared());
    }
    [(a, b), (b, c), (c, a)]
        .map(|(from, to)| nearest_on_edge(point, from, to))
        .into_iter()
        .min_by(|p, q| (p - point).norm_squared().total_cmp(&(q - point).norm_squared()))
        .expect("a triangle has three edges")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::surface::nearest;
    use regrasp_base::Rng;
    use regrasp_geometry::Pose;
    use regrasp_geometry::reference::{ReferenceShape, point_distance};
    use std::sync::Arc;

    fn shapes(rng: &mut Rng) -> Vec<Shape> {
        let points: Vec<Point> = (0..40).map(|_| Point::from(Vector::from(rng.direction()) * 0.03)).collect();
        let (vertices, triangles) = regrasp_geometry::hull::convex_hull(&points).unwrap();
        let mesh = regrasp_geometry::TriangleMesh::new(vertices, triangles).unwrap();
        vec![
            Shape::Sphere { radius: 0.03 },
            Shape::Capsule { half_length: 0.02, radius: 0.015 },
            Shape::Cuboid { half_extents: Vector::new(0.02, 0.03, 0.04) },
            Shape::Cylinder { half_length: 0.03, radius: 0.02 },
            Shape::Ellipsoid { radii: Vector::new(0.02, 0.03, 0.045) },
            Shape::Mesh(Arc::new(mesh)),
        ]
    }

    #[test]
    fn feet_lie_on_the_surface_as_far_away_as_parry_says() {
        let mut rng = Rng::keyed(1, "feet", 0);
        for shape in shapes(&mut rng) {
            let reference = ReferenceShape::new(&shape).unwrap();
            for _ in 0..400 {
                let point = Point::from(Vector::from(rng.direction()) * rng.uniform(0.03, 0.07));
                let theirs = point_distance(&reference, &Pose::identity(), &point);
                if theirs < 1e-4 {
                    continue;
                }
                let foot = Patch::near(&SortedShape::of(&shape), &point, theirs + 1e-3).foot(&point).unwrap();
                assert!(nearest(&shape, &foot).distance < 1e-9, "{shape:?} {point}");
                let tolerance = if matches!(shape, Shape::Ellipsoid { .. }) { 1e-6 } else { 1e-9 };
                assert!(((point - foot).norm() - theirs).abs() < tolerance, "{shape:?} {point} {foot} {theirs}");
            }
        }
    }

    #[test]
    fn the_way_from_a_foot_is_the_normal_there() {
        let mut rng = Rng::keyed(2, "feet", 0);
        let shape = Shape::Ellipsoid { radii: Vector::new(0.02, 0.03, 0.045) };
        for _ in 0..400 {
            let on = Point::from(Vector::from(rng.direction()).component_mul(&Vector::new(0.02, 0.03, 0.045)));
            let normal = nearest(&shape, &on).normals[0];
            let away = rng.uniform(-2e-3, 0.02);
            let foot = Patch::near(&SortedShape::of(&shape), &on, 1.0).foot(&(on + normal * away)).unwrap();
            assert!((foot - on).norm() < 1e-9, "{on} {foot}");
        }
    }
}
