//! Distance from the object's surface and the normals there, by closed forms and by looking at every triangle.

use crate::check::pieces::Pieces;
use regrasp_geometry::{Point, Shape, Vector};

/// The surface near a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Nearest {
    /// Distance of the point from the surface, never negative, in metres. First order for ellipsoids.
    pub distance: f64,
    /// Outward unit normals of the faces that come that near, within a tenth of a micrometre (primitives: a micrometre).
    pub normals: Vec<Vector>,
}

/// The part of `shape`'s surface that is nearest to `point`, which is in the shape's frame.
pub fn nearest(shape: &Shape, point: &Point) -> Nearest {
    match shape {
        Shape::Sphere { radius } => radial(point.coords, *radius),
        Shape::Capsule { half_length, radius } => {
            radial(point.coords - Vector::z() * point.z.clamp(-half_length, *half_length), *radius)
        }
        Shape::Cuboid { half_extents } => cuboid(point, half_extents),
        Shape::Cylinder { half_length, radius } => cylinder(point, *half_length, *radius),
        Shape::Ellipsoid { radii } => {
            let gradient = point.coords.component_div(radii).component_div(radii) * 2.0;
            let value = point.coords.component_div(radii).norm_squared() - 1.0;
            Nearest { distance: value.abs() / gradient.norm().max(1e-9), normals: vec![gradient.normalize()] }
        }
        Shape::Convex(_) | Shape::Mesh(_) => nearest_of(&Pieces::of(shape).expect("a polyhedron has triangles"), point),
    }
}

fn radial(from_axis: Vector, radius: f64) -> Nearest {
    let length = from_axis.norm();
    Nearest { distance: (length - radius).abs(), normals: vec![from_axis / length.max(1e-300)] }
}

fn cuboid(point: &Point, half_extents: &Vector) -> Nearest {
    let beyond = point.coords.abs() - half_extents;
    let outside = beyond.map(|x| x.max(0.0)).norm();
    let distance = if beyond.max() <= 0.0 { -beyond.max() } else { outside };
    let normals =
        (0..3).filter(|&k| beyond[k] >= beyond.max() - 1e-6).map(|k| Vector::ith(k, point[k].signum())).collect();
    Nearest { distance, normals }
}

fn cylinder(point: &Point, half_length: f64, radius: f64) -> Nearest {
    let across = Vector::new(point.x, point.y, 0.0);
    let beyond = [across.norm() - radius, point.z.abs() - half_length];
    let largest = beyond[0].max(beyond[1]);
    let distance = if largest <= 0.0 { -largest } else { beyond[0].max(0.0).hypot(beyond[1].max(0.0)) };
    let mut normals = Vec::new();
    if beyond[0] >= largest - 1e-6 {
        normals.push(across / across.norm().max(1e-300));
    }
    if beyond[1] >= largest - 1e-6 {
        normals.push(Vector::z() * point.z.signum());
    }
    Nearest { distance, normals }
}

/// Two faces whose distances differ by less than this, in metres, both count as nearest.
const SAME_DISTANCE: f64 = 1e-7;

/// The part of a polyhedron that is nearest to a point.
fn nearest_of(pieces: &Pieces, point: &Point) -> Nearest {
    let (distance, near) = pieces.nearest(point, SAME_DISTANCE, |corners| distance_to_triangle(point, corners));
    Nearest { distance, normals: near.into_iter().map(|triangle| pieces.normal(triangle)).collect() }
}

/// A shape of whose surface many points are asked: the triangles of polyhedra are sorted once.
#[derive(Debug, Clone)]
pub enum SortedShape {
    /// Closed forms need no preparation.
    Primitive(Shape),
    /// Triangles in pieces.
    Polyhedron(Pieces),
}

impl SortedShape {
    /// Prepares `shape`.
    pub fn of(shape: &Shape) -> Self {
        Pieces::of(shape).map_or_else(|| SortedShape::Primitive(shape.clone()), SortedShape::Polyhedron)
    }

    /// As [`nearest`].
    pub fn nearest(&self, point: &Point) -> Nearest {
        match self {
            SortedShape::Primitive(shape) => nearest(shape, point),
            SortedShape::Polyhedron(pieces) => nearest_of(pieces, point),
        }
    }
}

/// Angle between `direction` and the cone that `normals` span: where a ball touches an edge or a corner, its normal is
/// anywhere in between.
pub fn angle_to_cone(direction: &Vector, normals: &[Vector]) -> f64 {
    let mut best = normals.iter().map(|normal| normal.angle(direction)).fold(f64::INFINITY, f64::min);
    for (i, a) in normals.iter().enumerate() {
        for (j, b) in normals.iter().enumerate().take(i) {
            // Foot of the direction on the plane of the two, if it falls between them.
            let pole = a.cross(b);
            if pole.norm() > 1e-9 {
                let foot = direction - pole * (pole.dot(direction) / pole.norm_squared());
                if a.cross(&foot).dot(&pole) >= 0.0 && foot.cross(b).dot(&pole) >= 0.0 {
                    best = best.min(foot.angle(direction));
                }
            }
            for c in normals.iter().take(j) {
                let corners = nalgebra::Matrix3::from_columns(&[*a, *b, *c]);
                if let Some(shares) = corners.try_inverse().map(|inverse| inverse * direction)
                    && shares.min() >= 0.0
                {
                    return 0.0;
                }
            }
        }
    }
    best
}

/// Distance from a point to a triangle: the plane's when the foot is inside, else the nearest edge's.
pub fn distance_to_triangle(point: &Point, corners: &[Point; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let inside =
        [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).cross(&(point - *from)).dot(&normal) >= 0.0);
    if inside {
        return ((point - a).dot(&normal) / normal.norm()).abs();
    }
    [(a, b), (b, c), (c, a)].iter().map(|(from, to)| distance_to_edge(point, from, to)).fold(f64::INFINITY, f64::min)
}

/// Distance from a point to the segment between two others.
pub fn distance_to_edge(point: &Point, from: &Point, to: &Point) -> f64 {
    (point - nearest_on_edge(point, from, to)).norm()
}

/// The point of the segment between two others that is nearest to a point.
pub fn nearest_on_edge(point: &Point, from: &Point, to: &Point) -> Point {
    let along = to - from;
    let t = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    from + along * t
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_geometry::TriangleMesh;

    #[test]
    fn a_box_and_its_triangles_agree() {
        let half = Vector::new(0.02, 0.03, 0.04);
        let corner = |i: u32| {
            let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Point::new(sign(0) * half.x, sign(1) * half.y, sign(2) * half.z)
        };
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let split = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let mesh = TriangleMesh::new((0..8).map(corner).collect(), split).unwrap();
        assert!(mesh.signed_volume() > 0.0);
        let mesh = Shape::Mesh(std::sync::Arc::new(mesh));
        let cuboid = Shape::Cuboid { half_extents: half };
        let mut rng = Rng::keyed(1, "surface", 0);
        for _ in 0..2000 {
            let point = Point::from(Vector::from_fn(|_, _| rng.uniform(-0.06, 0.06)));
            let (a, b) = (nearest(&cuboid, &point), nearest(&mesh, &point));
            assert!((a.distance - b.distance).abs() < 1e-12, "{point} {} {}", a.distance, b.distance);
            assert!(a.normals.iter().all(|n| b.normals.iter().any(|m| (n - m).norm() < 1e-9)) || a.normals.len() > 1);
        }
    }

    #[test]
    fn pieces_tell_what_all_triangles_tell() {
        let mut rng = Rng::keyed(4, "surface", 0);
        // Triangles of all sizes, some as large as the whole, some of them many times.
        let mut vertices = Vec::new();
        for i in 0..3000 {
            let middle = Vector::from(rng.direction()) * 0.05;
            let size = if i % 300 == 0 { 0.1 } else { 0.002 };
            vertices.extend((0..3).map(|_| Point::from(middle + Vector::from(rng.direction()) * size)));
        }
        let mut triangles: Vec<[u32; 3]> = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        triangles.extend(triangles.clone().into_iter().take(50));
        let mesh = TriangleMesh::new(vertices, triangles).unwrap();
        let shape = Shape::Mesh(std::sync::Arc::new(mesh.clone()));
        let sorted = SortedShape::of(&shape);
        let SortedShape::Polyhedron(pieces) = &sorted else { panic!("a mesh has triangles") };
        for _ in 0..500 {
            let point = Point::from(Vector::from(rng.direction()) * rng.uniform(0.0, 0.12));
            let distances: Vec<f64> =
                (0..mesh.triangles().len()).map(|i| distance_to_triangle(&point, &mesh.corners(i))).collect();
            let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
            let near = (0..distances.len()).filter(|&i| distances[i] <= least + SAME_DISTANCE);
            let expected = Nearest { distance: least, normals: near.map(|i| pieces.normal(i)).collect() };
            assert_eq!(sorted.nearest(&point), expected);
            assert_eq!(nearest(&shape, &point), expected);
            // What some reach brings near is found, and not everything.
            let reach = rng.uniform(0.0, 0.02);
            let found = pieces.near(&point, reach);
            assert!(found.is_sorted() && found.len() < mesh.triangles().len());
            let missed = (0..distances.len()).find(|i| distances[*i] <= reach && found.binary_search(i).is_err());
            assert_eq!(missed, None, "{point} {reach}");
        }
    }

    #[test]
    fn an_edge_and_a_corner_have_cones_of_normals() {
        let normals = [Vector::x(), Vector::y(), Vector::z()];
        let mut rng = Rng::keyed(3, "surface", 0);
        for _ in 0..500 {
            let direction = Vector::from(rng.direction());
            // The nearest point of the positive octant, by clamping.
            let clamped = direction.map(|x| x.max(0.0));
            let expected = if clamped.norm() > 0.0 {
                clamped.angle(&direction)
            } else {
                normals.map(|n| n.angle(&direction)).into_iter().fold(f64::INFINITY, f64::min)
            };
            assert!((angle_to_cone(&direction, &normals) - expected).abs() < 1e-9);
        }
        assert!(angle_to_cone(&Vector::new(1.0, 1.0, 0.1).normalize(), &normals[..2]) > 0.05);
    }

    #[test]
    fn points_moved_off_a_curved_surface_are_that_far_away() {
        let mut rng = Rng::keyed(2, "surface", 0);
        for _ in 0..500 {
            let direction = Vector::from(rng.direction());
            let off = rng.uniform(-1e-3, 1e-3);
            let sphere = nearest(&Shape::Sphere { radius: 0.03 }, &Point::from(direction * (0.03 + off)));
            assert!((sphere.distance - off.abs()).abs() < 1e-12);
            let angle = rng.uniform(0.0, 6.0);
            let radial = Vector::new(angle.cos(), angle.sin(), 0.0);
            let on_side = Point::from(radial * (0.02 + off) + Vector::z() * rng.uniform(-0.03, 0.03));
            let cylinder = nearest(&Shape::Cylinder { half_length: 0.05, radius: 0.02 }, &on_side);
            assert!((cylinder.distance - off.abs()).abs() < 1e-12);
            assert!((cylinder.normals[0] - radial).norm() < 1e-9);
            let radii = Vector::new(0.02, 0.03, 0.04);
            let on = direction.component_mul(&radii);
            let normal = on.component_div(&radii).component_div(&radii).normalize();
            let ellipsoid = nearest(&Shape::Ellipsoid { radii }, &Point::from(on + normal * 1e-5));
            assert!((ellipsoid.distance - 1e-5).abs() < 1e-7);
            assert!((ellipsoid.normals[0] - normal).norm() < 1e-3);
        }
    }
}
