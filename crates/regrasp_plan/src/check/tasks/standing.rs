//! Objects that stand on supports: where they touch, and whether their centre of mass is over that.
//!
//! A support is stood on with its flat top: the face of a box or cylinder that looks up, or the highest triangles of a polyhedron or
//! mesh. Of the object all that is a vertex, an edge or a triangle within `NEAR` above the top touches, where it is over the top. Cylinders
//! stand on their ends. Balls, capsules and ellipsoids roll and stand nowhere.

use crate::check::polygon::distance_inside;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_scene::Support;

/// An object this far above a support still touches it, in metres.
pub const NEAR: f64 = 0.5e-3;
/// An object may be this far inside the support, in metres.
pub const INSIDE: f64 = 0.1e-3;
/// What touches is no more than this above the lowest point that does, in metres: `docs/reference/grasp-list-format.md`.
const ON_PLANE: f64 = 0.2e-3;
/// The centre of mass is at least this far inside what touches, in metres.
pub const LEAST_INSIDE: f64 = 2e-3;
/// Tops may be inclined by this much, in radians.
const FLAT: f64 = 1e-4;
/// Vertices of a mesh this much below the highest one belong to the top, in metres.
const LEVEL: f64 = 1e-5;
/// Cosine of the largest angle between an upright cylinder and the vertical: its rim is then well apart from its side.
const UPRIGHT: f64 = 0.99;
/// Corners of the polygon that stands for a rim.
const RIM: usize = 720;

/// Axes of a horizontal plane.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// Against gravity.
    pub up: Vector,
    x: Vector,
    y: Vector,
}

impl Plane {
    /// Across `up`, a unit vector.
    pub fn across(up: Vector) -> Self {
        let (x, y) = regrasp_geometry::frame::tangents(&regrasp_geometry::UnitVector::new_unchecked(up));
        Plane { up, x: x.into_inner(), y: y.into_inner() }
    }

    fn flat(&self, point: &Point) -> [f64; 2] {
        [point.coords.dot(&self.x), point.coords.dot(&self.y)]
    }

    fn point(&self, flat: [f64; 2], height: f64) -> Point {
        Point::from(self.x * flat[0] + self.y * flat[1] + self.up * height)
    }
}

/// The flat top of a support.
#[derive(Debug, Clone)]
pub struct Top {
    /// How high it is.
    height: f64,
    /// Convex polygons, counter-clockwise.
    pieces: Vec<Vec<[f64; 2]>>,
}

impl Top {
    /// Err with a reason where the support has none.
    pub fn of(support: &Support, plane: &Plane) -> Result<Self, String> {
        let (pose, name) = (&support.body.placed.parent_from_shape, &support.body.name);
        let none = |why: &str| Err(format!("support \"{name}\" {why}: whether an object stands on it is not judged"));
        let tilted = "is inclined, so that it has no level top";
        match &support.body.placed.shape {
            Shape::Cuboid { half_extents } => {
                let ends = (0..3).flat_map(|k| [1.0, -1.0].map(|sign| (k, Vector::ith(k, sign))));
                let top = ends.into_iter().find(|(_, axis)| (pose * axis).angle(&plane.up) <= FLAT);
                let Some((k, axis)) = top else { return none(tilted) };
                let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                let corner = |i: f64, j: f64| {
                    pose * Point::from(
                        axis.component_mul(half_extents)
                            + Vector::ith(a, i * half_extents[a])
                            + Vector::ith(b, j * half_extents[b]),
                    )
                };
                let corners = [corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
                Ok(Top::around(&corners, plane))
            }
            Shape::Cylinder { half_length, radius } => {
                let side = [1.0, -1.0].into_iter().find(|s| (pose * (Vector::z() * *s)).angle(&plane.up) <= FLAT);
                let Some(side) = side else { return none(tilted) };
                let rim: Vec<Point> = (0..RIM)
                    .map(|k| {
                        let (sine, cosine) = (std::f64::consts::TAU * k as f64 / RIM as f64).sin_cos();
                        pose * Point::new(radius * cosine, radius * sine, side * half_length)
                    })
                    .collect();
                Ok(Top::around(&rim, plane))
            }
            Shape::Convex(hull) => Top::highest(hull.vertices(), hull.triangles(), pose, plane)
                .map_or_else(|| none("has no level top"), Ok),
            Shape::Mesh(mesh) => Top::highest(mesh.vertices(), mesh.triangles(), pose, plane)
                .map_or_else(|| none("has no level top"), Ok),
            Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => none("is round"),
        }
    }

    fn around(corners: &[Point], plane: &Plane) -> Self {
        let height = corners.iter().map(|p| p.coords.dot(&plane.up)).fold(f64::NEG_INFINITY, f64::max);
        Top { height, pieces: vec![counter_clockwise(corners.iter().map(|p| plane.flat(p)).collect())] }
    }

    fn highest(vertices: &[Point], triangles: &[[u32; 3]], pose: &Pose, plane: &Plane) -> Option<Self> {
        let placed: Vec<Point> = vertices.iter().map(|p| pose * p).collect();
        let above = |p: &Point| p.coords.dot(&plane.up);
        let height = placed.iter().map(above).fold(f64::NEG_INFINITY, f64::max);
        let is_high = |triangle: &&[u32; 3]| triangle.iter().all(|&i| above(&placed[i as usize]) >= height - LEVEL);
        let piece = |triangle: &[u32; 3]| {
            counter_clockwise(triangle.iter().map(|&i| plane.flat(&placed[i as usize])).collect())
        };
        let pieces: Vec<_> = triangles.iter().filter(is_high).map(piece).filter(|p| area(p) > 1e-12).collect();
        (!pieces.is_empty()).then_some(Top { height, pieces })
    }
}

fn area(polygon: &[[f64; 2]]) -> f64 {
    let n = polygon.len();
    0.5 * (0..n).map(|i| (polygon[i], polygon[(i + 1) % n])).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

fn counter_clockwise(mut polygon: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    if area(&polygon) < 0.0 {
        polygon.reverse();
    }
    polygon
}

/// The part of a convex polygon, edge or point inside a convex polygon (Sutherland and Hodgman 1974).
fn clip(mut subject: Vec<[f64; 2]>, piece: &[[f64; 2]]) -> Vec<[f64; 2]> {
    for i in 0..piece.len() {
        let (from, to) = (piece[i], piece[(i + 1) % piece.len()]);
        let side = |p: &[f64; 2]| (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0]);
        let mut kept = Vec::new();
        for (k, p) in subject.iter().enumerate() {
            let q = &subject[(k + 1) % subject.len()];
            let (at_p, at_q) = (side(p), side(q));
            if at_p >= 0.0 {
                kept.push(*p);
            }
            if (at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0) {
                let t = at_p / (at_p - at_q);
                kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
        subject = kept;
    }
    subject
}

/// What of an object can touch a plane: vertices, and what lies between them.
#[derive(Debug, Clone, Default)]
pub struct Feet {
    points: Vec<Point>,
    /// Two or three vertices each.
    parts: Vec<Vec<u32>>,
    /// The axis of a cylinder, which stands on its ends and rolls on its side.
    axis: Option<Vector>,
}

impl Feet {
    /// Of an object; empty for what rolls.
    pub fn of(shape: &Shape) -> Self {
        let of_triangles = |points: &[Point], triangles: &[[u32; 3]]| Feet {
            points: points.to_vec(),
            parts: triangles
                .iter()
                .flat_map(|&[a, b, c]| [vec![a, b, c], vec![a, b], vec![b, c], vec![c, a]])
                .collect(),
            axis: None,
        };
        match shape {
            Shape::Cuboid { half_extents: h } => {
                let side = |k: u32, bit: usize| if k >> bit & 1 == 1 { h[bit] } else { -h[bit] };
                let points = (0..8).map(|k| Point::new(side(k, 0), side(k, 1), side(k, 2))).collect::<Vec<_>>();
                let face = |axis: u32, end: u32| {
                    let (a, b) = (1u32 << ((axis + 1) % 3), 1u32 << ((axis + 2) % 3));
                    let first = end << axis;
                    [[first, first | a, first | a | b], [first, first | a | b, first | b]]
                };
                let triangles: Vec<[u32; 3]> = (0..3).flat_map(|k| [face(k, 0), face(k, 1)]).flatten().collect();
                of_triangles(&points, &triangles)
            }
            Shape::Cylinder { half_length, radius } => {
                let n = RIM as u32;
                let points: Vec<Point> = (0..2 * n)
                    .map(|k| {
                        let (sine, cosine) = (std::f64::consts::TAU * f64::from(k % n) / f64::from(n)).sin_cos();
                        let z = if k < n { *half_length } else { -half_length };
                        Point::new(radius * cosine, radius * sine, z)
                    })
                    .collect();
                let caps =
                    [0, n].into_iter().flat_map(|first| (1..n - 1).map(move |k| [first, first + k, first + k + 1]));
                let feet = of_triangles(&points, &caps.collect::<Vec<_>>());
                Feet { axis: Some(Vector::z()), ..feet }
            }
            Shape::Convex(hull) => of_triangles(hull.vertices(), hull.triangles()),
            Shape::Mesh(mesh) => of_triangles(mesh.vertices(), mesh.triangles()),
            Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Ellipsoid { .. } => Feet::default(),
        }
    }

    /// Where the object touches a top, at the height of the top; none where it does not.
    pub fn touching(&self, world_from_object: &Pose, top: &Top, plane: &Plane) -> Vec<Point> {
        if self.axis.is_some_and(|axis| (world_from_object * axis).dot(&plane.up).abs() < UPRIGHT) {
            return Vec::new();
        }
        let placed: Vec<Point> = self.points.iter().map(|p| world_from_object * p).collect();
        let above: Vec<f64> = placed.iter().map(|p| p.coords.dot(&plane.up) - top.height).collect();
        let flat: Vec<[f64; 2]> = placed.iter().map(|p| plane.flat(p)).collect();
        let is_near = |i: usize| above[i] >= -NEAR && above[i] <= NEAR;
        let near: Vec<usize> = (0..placed.len()).filter(|i| is_near(*i)).collect();
        let over = |corners: Vec<[f64; 2]>| -> Vec<[f64; 2]> {
            top.pieces.iter().flat_map(|piece| clip(corners.clone(), piece)).collect()
        };
        let over_top: Vec<usize> = near.iter().copied().filter(|i| !over(vec![flat[*i]]).is_empty()).collect();
        // Where no vertex is over the top, a face that is wider than the top may still be.
        let counted = if over_top.is_empty() { &near } else { &over_top };
        let lowest = counted.iter().map(|i| above[*i]).fold(f64::INFINITY, f64::min);
        let touches = |i: usize| is_near(i) && above[i] <= lowest + ON_PLANE;
        let mut found: Vec<[f64; 2]> = over_top.iter().filter(|i| touches(**i)).map(|i| flat[*i]).collect();
        for part in &self.parts {
            if part.iter().all(|i| touches(*i as usize)) {
                found.extend(over(part.iter().map(|i| flat[*i as usize]).collect()));
            }
        }
        found.into_iter().map(|p| plane.point(p, top.height)).collect()
    }
}

/// How far a point is inside the polygon of what touches, seen along gravity; negative outside.
pub fn inside(points: &[Point], foot: &Point, plane: &Plane) -> f64 {
    let around: Vec<Vector> = points.iter().map(|p| p - foot).collect();
    distance_inside(&around, &-plane.up)
}

/// The point at the height of the touching points below (or above) a point.
pub fn foot_of(point: &Point, touching: &[Point], plane: &Plane) -> Point {
    let height = touching.first().map_or(0.0, |p| (p - point).dot(&plane.up));
    point + plane.up * height
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_geometry::shape::PlacedShape;
    use regrasp_scene::Obstacle;

    fn table(shape: Shape, pose: Pose) -> Support {
        let placed = PlacedShape { parent_from_shape: pose, shape };
        Support { body: Obstacle { name: "table".into(), placed, mesh_body: None } }
    }

    #[test]
    fn a_box_over_the_edge_of_a_table_stands_on_the_part_that_is_over_it() {
        let plane = Plane::across(Vector::z());
        let board =
            table(Shape::Cuboid { half_extents: Vector::new(0.2, 0.3, 0.01) }, Pose::translation(0.0, 0.0, 0.3));
        let top = Top::of(&board, &plane).unwrap();
        let feet = Feet::of(&Shape::Cuboid { half_extents: Vector::new(0.02, 0.03, 0.04) });
        for (x, expected) in [(0.0, 0.02), (0.19, 0.01), (0.2, 0.0), (0.205, -0.005)] {
            let pose = Pose::translation(x, 0.0, 0.35);
            let touching = feet.touching(&pose, &top, &plane);
            let foot = foot_of(&Point::new(x, 0.0, 0.35), &touching, &plane);
            assert!((inside(&touching, &foot, &plane) - expected).abs() < 1e-6, "{x}");
        }
        // Half a millimetre above it touches, more it does not; beside the table it never does.
        assert!(!feet.touching(&Pose::translation(0.0, 0.0, 0.3504), &top, &plane).is_empty());
        assert!(feet.touching(&Pose::translation(0.0, 0.0, 0.3506), &top, &plane).is_empty());
        assert!(feet.touching(&Pose::translation(0.3, 0.0, 0.35), &top, &plane).is_empty());
        // A box on its edge touches along a line, which carries nothing.
        let tipped = Pose::rotation(Vector::new(0.0, 0.3, 0.0));
        let lowest = 0.02 * 0.3f64.sin() + 0.04 * 0.3f64.cos();
        let pose = Pose::translation(0.0, 0.0, 0.31 + lowest) * tipped;
        let touching = feet.touching(&pose, &top, &plane);
        assert!(!touching.is_empty() && inside(&touching, &touching[0], &plane) <= 0.0);
    }

    #[test]
    fn a_wide_box_stands_on_a_narrow_post_and_a_cylinder_on_its_end() {
        let plane = Plane::across(Vector::z());
        let post = table(Shape::Cylinder { half_length: 0.1, radius: 0.03 }, Pose::translation(0.0, 0.0, 0.1));
        let top = Top::of(&post, &plane).unwrap();
        let wide = Feet::of(&Shape::Cuboid { half_extents: Vector::new(0.1, 0.1, 0.02) });
        let touching = wide.touching(&Pose::translation(0.0, 0.0, 0.22), &top, &plane);
        assert!((inside(&touching, &Point::new(0.0, 0.0, 0.2), &plane) - 0.03).abs() < 1e-5);
        let cup = Feet::of(&Shape::Cylinder { half_length: 0.05, radius: 0.02 });
        let touching = cup.touching(&Pose::translation(0.005, 0.0, 0.25), &top, &plane);
        assert!((inside(&touching, &Point::new(0.005, 0.0, 0.2), &plane) - 0.02).abs() < 1e-5);
        // Lying it rolls.
        let lying =
            Pose::translation(0.0, 0.0, 0.22) * Pose::rotation(Vector::new(std::f64::consts::FRAC_PI_2, 0.0, 0.0));
        let touching = cup.touching(&lying, &top, &plane);
        assert!(touching.is_empty());
        let ball = Feet::of(&Shape::Sphere { radius: 0.02 });
        assert!(ball.touching(&Pose::translation(0.0, 0.0, 0.22), &top, &plane).is_empty());
        let round = table(Shape::Sphere { radius: 0.1 }, Pose::identity());
        assert!(Top::of(&round, &plane).unwrap_err().contains("round"));
        let slope = table(
            Shape::Cuboid { half_extents: Vector::new(0.2, 0.2, 0.01) },
            Pose::rotation(Vector::new(0.01, 0.0, 0.0)),
        );
        assert!(Top::of(&slope, &plane).unwrap_err().contains("inclined"));
    }
}
