//! Pieces of geometry that planner and checker share, against a second way: a mistake in them would hide from both.

use regrasp_base::Rng;
use regrasp_geometry::{ConvexHull, Point, Shape, TriangleMesh, Vector};
use std::sync::Arc;

/// Points of a cloud with two clusters, a flat side and doubles.
fn cloud(rng: &mut Rng, n_points: usize) -> Vec<Point> {
    let mut points: Vec<Point> = (0..n_points)
        .map(|i| {
            let center = if i % 3 == 0 { Vector::new(0.05, 0.0, 0.01) } else { Vector::zeros() };
            Point::from(center + Vector::from(rng.direction()) * rng.uniform(0.0, 0.03))
        })
        .collect();
    points.extend((0..n_points / 4).map(|_| Point::new(rng.uniform(-0.02, 0.02), rng.uniform(-0.02, 0.02), -0.04)));
    let again = points[0];
    points.push(again);
    points
}

/// Points of the surface of a primitive or inside it, by rejection in its bounds with its own inequality.
fn inside(shape: &Shape, point: &Point) -> bool {
    match shape {
        Shape::Sphere { radius } => point.coords.norm() <= *radius,
        Shape::Capsule { half_length, radius } => {
            let on_axis = Point::new(0.0, 0.0, point.z.clamp(-half_length, *half_length));
            (point - on_axis).norm() <= *radius
        }
        Shape::Cuboid { half_extents } => (0..3).all(|k| point[k].abs() <= half_extents[k]),
        Shape::Cylinder { half_length, radius } => point.z.abs() <= *half_length && point.x.hypot(point.y) <= *radius,
        Shape::Ellipsoid { radii } => point.coords.component_div(radii).norm() <= 1.0,
        Shape::Convex(_) | Shape::Mesh(_) => unreachable!("polyhedra are asked for their corners"),
    }
}

#[test]
fn bounding_balls_hold_all_of_the_shape() {
    let mut rng = Rng::keyed(1, "bounding", 0);
    for _ in 0..200 {
        let mut size = || rng.uniform(0.002, 0.1);
        let primitives = [
            Shape::Sphere { radius: size() },
            Shape::Capsule { half_length: size(), radius: size() },
            Shape::Cuboid { half_extents: Vector::new(size(), size(), size()) },
            Shape::Cylinder { half_length: size(), radius: size() },
            Shape::Ellipsoid { radii: Vector::new(size(), size(), size()) },
        ];
        for shape in &primitives {
            let (center, radius) = shape.bounding_sphere();
            for _ in 0..100 {
                let point = Point::from(Vector::from_fn(|_, _| rng.uniform(-0.2, 0.2)));
                assert!(!inside(shape, &point) || (point - center).norm() <= radius * (1.0 + 1e-12), "{shape:?}");
            }
            // And not much more: some point of the shape is nearly as far.
            let farthest = (0..4000)
                .map(|_| Vector::from(rng.direction()) * radius)
                .map(|way| (0..=20).rev().map(|k| way * (f64::from(k) / 20.0)).find(|p| inside(shape, &(center + p))))
                .fold(0.0, |most: f64, p| most.max(p.map_or(0.0, |p| p.norm())));
            assert!(farthest > 0.8 * radius, "{shape:?}: {farthest} of {radius}");
        }
        let points = cloud(&mut rng, 60);
        let hull = Shape::Convex(Arc::new(ConvexHull::new(&points).unwrap()));
        let corners: Vec<Point> = points.iter().take(30).copied().collect();
        let triangles: Vec<[u32; 3]> = (0..10).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(corners.clone(), triangles).unwrap();
        for (shape, points) in [(hull, &points), (Shape::Mesh(Arc::new(mesh)), &corners)] {
            let (center, radius) = shape.bounding_sphere();
            assert!(points.iter().all(|p| (p - center).norm() <= radius * (1.0 + 1e-12)), "{}", shape.kind());
        }
    }
}

#[test]
fn hulls_hold_all_points_and_have_no_corner_of_their_own() {
    let mut rng = Rng::keyed(2, "hulls", 0);
    for n_points in [8, 40, 400] {
        for _ in 0..30 {
            let points = cloud(&mut rng, n_points);
            let hull = ConvexHull::new(&points).unwrap();
            for corner in hull.vertices() {
                assert!(points.iter().any(|p| (p - corner).norm() < 1e-12), "a corner that is no point");
            }
            // Every triangle has all points on one side, and the triangles close: each edge belongs to two.
            let mut edges = std::collections::BTreeMap::new();
            for triangle in hull.triangles() {
                let [a, b, c] = triangle.map(|i| hull.vertices()[i as usize]);
                let normal = (b - a).cross(&(c - a));
                if normal.norm() > 1e-12 {
                    let outside = points.iter().map(|p| normal.normalize().dot(&(p - a))).fold(f64::MIN, f64::max);
                    assert!(outside < 1e-9, "{outside} m outside");
                }
                for (i, k) in [(0, 1), (1, 2), (2, 0)] {
                    let (from, to) = (triangle[i], triangle[k]);
                    *edges.entry((from.min(to), from.max(to))).or_insert(0) += 1;
                }
            }
            assert!(edges.values().all(|count| *count == 2));
        }
    }
}
