use crate::places::repository;
use regrasp_base::{Rng, files};
use regrasp_geometry::{ConvexHull, Point, Shape, Surface, TriangleMesh, Vector};
use regrasp_viewer::story::pack::{pack, unpack};
use regrasp_viewer::story::tessellate::{DEVIATION, Triangles, tessellate};
use std::f64::consts::PI;
use std::sync::Arc;

fn round_shapes() -> Vec<(Shape, f64, f64)> {
    let (h, r) = (0.03, 0.012);
    let radii = Vector::new(0.05, 0.02, 0.01);
    vec![
        (Shape::Sphere { radius: r }, r, 4.0 / 3.0 * PI * r.powi(3)),
        (Shape::Capsule { half_length: h, radius: r }, r, PI * r * r * (4.0 / 3.0 * r + 2.0 * h)),
        (Shape::Cylinder { half_length: h, radius: r }, r, PI * r * r * 2.0 * h),
        (Shape::Ellipsoid { radii }, 0.05, 4.0 / 3.0 * PI * radii.product()),
    ]
}

fn hull() -> Shape {
    let mut rng = Rng::keyed(5, "tessellation", 0);
    let points: Vec<Point> = (0..300).map(|_| Point::from(0.03 * Vector::from(rng.direction()))).collect();
    Shape::Convex(Arc::new(ConvexHull::new(&points).unwrap()))
}

fn bundled_mesh() -> Shape {
    let path = repository().join("assets/objects/bulb.obj");
    Shape::Mesh(Arc::new(regrasp_geometry::import::read_mesh(&path, &files::read(&path).unwrap()).unwrap()))
}

/// Volume by the divergence theorem.
fn volume(drawn: &Triangles) -> f64 {
    let corner = |i: u32| drawn.vertices[i as usize].coords;
    drawn.triangles.iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))) / 6.0).sum()
}

fn assert_closed(name: &str, triangles: &[[u32; 3]]) {
    // Every edge is gone once in each direction.
    let mut edges: Vec<(u32, u32)> = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    edges.sort_unstable();
    assert!(edges.windows(2).all(|pair| pair[0] != pair[1]), "{name}: an edge twice in the same direction");
    assert!(edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok()), "{name}: an edge without its other side");
}

#[test]
fn tessellations_are_closed_and_turned_outwards() {
    let cuboid = Shape::Cuboid { half_extents: Vector::new(0.01, 0.02, 0.03) };
    let others = [(cuboid, 0.0, 8.0 * 0.01 * 0.02 * 0.03), (hull(), 0.0, f64::NAN), (bundled_mesh(), 0.0, f64::NAN)];
    for (shape, _, exact) in round_shapes().into_iter().chain(others) {
        let drawn = tessellate(&shape);
        let mesh = TriangleMesh::new(drawn.vertices.clone(), drawn.triangles.clone()).unwrap();
        assert!(mesh.statistics().is_watertight(), "{}: {:?}", shape.kind(), mesh.statistics());
        assert_eq!(mesh.statistics().zero_area_dropped, 0, "{}", shape.kind());
        assert_closed(shape.kind(), &drawn.triangles);
        assert_eq!(drawn.smooth_below > 0.0, shape.kind() != "box", "{}", shape.kind());
        let found = volume(&drawn);
        assert!(found > 0.0, "{} is inside out", shape.kind());
        // Inscribed: a little less than the solid.
        if exact.is_finite() {
            assert!(found <= exact * (1.0 + 1e-12) && found > 0.98 * exact, "{}: {found} of {exact}", shape.kind());
        }
    }
}

#[test]
fn no_point_of_a_triangle_is_far_from_the_surface() {
    let mut rng = Rng::keyed(2, "tessellation", 0);
    for (shape, radius, _) in round_shapes() {
        let surface = Surface::of(&shape).unwrap();
        let drawn = tessellate(&shape);
        let mut farthest = 0.0f64;
        for corners in &drawn.triangles {
            let [a, b, c] = corners.map(|i| drawn.vertices[i as usize]);
            for corner in [a, b, c] {
                assert!(surface.signed_distance(&corner).abs() < 1e-9, "{}: a vertex is off", shape.kind());
            }
            let (s, t) = (rng.unit(), rng.unit());
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            for point in [nalgebra::center(&nalgebra::center(&a, &b), &c), a + s * (b - a) + t * (c - a)] {
                farthest = farthest.max(surface.signed_distance(&point).abs());
            }
        }
        assert!(farthest <= DEVIATION * radius, "{}: {farthest:e} of {:e}", shape.kind(), DEVIATION * radius);
        assert!(farthest > 0.1 * DEVIATION * radius, "{}: the bound {farthest:e} is idle", shape.kind());
    }
}

#[test]
fn packing_keeps_a_tessellation_closed() {
    for shape in [hull(), bundled_mesh(), Shape::Sphere { radius: 0.01 }] {
        let drawn = tessellate(&shape);
        let (vertices, triangles) = unpack(&pack(&drawn.vertices, &drawn.triangles, drawn.smooth_below)).unwrap();
        assert_closed(shape.kind(), &triangles);
        for (exact, found) in drawn.vertices.iter().zip(&vertices) {
            assert!((exact - found).amax() <= 0.1 / 65535.0);
        }
    }
}
