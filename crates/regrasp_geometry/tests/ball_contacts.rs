//! Contacts of balls with meshes that fold: against the distance from every triangle.

#![allow(missing_docs)]

#[path = "../../../tests/support/places.rs"]
mod places;

use places::shared_models;
use regrasp_base::Rng;
use regrasp_geometry::import::read_mesh;
use regrasp_geometry::reference::Inside;
use regrasp_geometry::{ConvexHull, Point, Shape, Surface, TriangleMesh, Vector};
use std::sync::Arc;

/// Distance of `p` from a triangle, by projection on its plane and on its sides, and the point there.
fn nearest_of(corners: &[Point; 3], p: &Point) -> (f64, Point) {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let sides = [(a, b), (b, c), (c, a)];
    let on_plane = p - normal * ((p - a).dot(&normal) / normal.norm_squared());
    if sides.iter().all(|(from, to)| (*to - *from).cross(&(on_plane - *from)).dot(&normal) >= 0.0) {
        return ((p - on_plane).norm(), on_plane);
    }
    let on_side = |(from, to): (&Point, &Point)| {
        let along = to - from;
        let at = from + along * ((p - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        ((p - at).norm(), at)
    };
    sides.into_iter().map(on_side).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

/// Every ball that settles touches, and penetrates nothing; returns in how many draws it did and how many touch an edge or corner.
fn balls_touch(name: &str, mesh: &TriangleMesh, radius: f64, n_draws: usize) -> [usize; 2] {
    let surface = Surface::of(&Shape::Mesh(Arc::new(mesh.clone()))).unwrap();
    let inside = Inside::of(mesh);
    let mut rng = Rng::keyed(1, name, 0);
    let mut n = [0; 2];
    for _ in 0..n_draws {
        let Some(contact) = surface.settle(&surface.sample(&mut rng), radius) else { continue };
        let center = contact.point_in_object + contact.normal_in_object.as_ref() * radius;
        let all = (0..mesh.triangles().len()).map(|i| nearest_of(&mesh.corners(i), &center));
        let near: Vec<(f64, Point)> = all.filter(|(distance, _)| *distance < radius + 1e-7).collect();
        let least = near.iter().map(|(distance, _)| *distance).fold(f64::INFINITY, f64::min);
        assert!((least - radius).abs() < 1e-8, "{name}: {least} of {radius}");
        let foot = near.iter().map(|(_, foot)| (foot - contact.point_in_object).norm()).fold(f64::INFINITY, f64::min);
        assert!(foot < 1e-6, "{name}: the contact is {foot} m from where the ball touches");
        assert!(!inside.holds(&center), "{name}: the ball is inside at {center}");
        n[0] += 1;
        // Several triangles share what it touches.
        let shared = near.iter().filter(|(_, at)| (at - contact.point_in_object).norm() < 1e-7).count();
        n[1] += usize::from(shared > 1);
    }
    n
}

/// A ball of radius 30 mm whose vertices go in and out by 1 mm: it folds at most edges.
fn rough_ball() -> TriangleMesh {
    let mut rng = Rng::keyed(2, "rough", 0);
    let points: Vec<Point> = (0..1500).map(|_| Point::from(Vector::from(rng.direction()) * 0.03)).collect();
    let hull = ConvexHull::new(&points).unwrap();
    let vertices = hull.vertices().iter().map(|v| v + v.coords.normalize() * rng.uniform(-1e-3, 1e-3)).collect();
    TriangleMesh::new(vertices, hull.triangles().to_vec()).unwrap()
}

#[test]
fn balls_touch_a_rough_surface_on_its_ridges() {
    let mesh = rough_ball();
    let surface = Surface::of(&Shape::Mesh(Arc::new(mesh.clone()))).unwrap();
    let grain = surface.mesh().unwrap().crease_grain().unwrap();
    assert!((1e-3..0.01).contains(&grain), "{grain}");
    let [n_touching, n_edges] = balls_touch("rough", &mesh, 0.012, 600);
    assert!(n_touching > 300 && n_edges > n_touching / 2, "{n_touching} {n_edges}");
}

/// The rims of a cylinder of 96 sides: each run of creases goes all the way round.
#[test]
fn creases_of_a_fine_cylinder_are_as_long_as_its_rims() {
    let n = 96;
    let at = |k: usize, z: f64| {
        let (sin, cos) = (k as f64 / n as f64 * std::f64::consts::TAU).sin_cos();
        Point::new(0.02 * cos, 0.02 * sin, z)
    };
    let points: Vec<Point> = (0..n).flat_map(|k| [at(k, -0.03), at(k, 0.03)]).collect();
    let hull = Shape::Convex(Arc::new(ConvexHull::new(&points).unwrap()));
    let grain = Surface::of(&hull).unwrap().mesh().unwrap().crease_grain().unwrap();
    assert!((grain - 0.04 * std::f64::consts::PI).abs() < 1e-4, "{grain}");
}

#[test]
fn creases_of_a_box_are_as_long_as_its_sides() {
    let corner = |i: usize| Point::from(Vector::from_fn(|k, _| if i >> k & 1 == 1 { 0.05 } else { 0.0 }));
    let hull = ConvexHull::new(&(0..8).map(corner).collect::<Vec<_>>()).unwrap();
    let grain = |angle: f64| {
        let surface = Surface::with_crease_angle(&Shape::Convex(Arc::new(hull.clone())), angle).unwrap();
        surface.mesh().unwrap().crease_grain()
    };
    assert!((grain(0.5).unwrap() - 0.05).abs() < 1e-12);
    assert_eq!(grain(1.6), None);
}

#[test]
fn balls_touch_scanned_objects() {
    let Some(models) = shared_models() else { return };
    for (name, scale) in [
        ("gso_Breyer_Horse_Of_The_Year_2015", 0.39),
        ("gso_Schleich_Hereford_Bull", 0.73),
        ("ycb_025_mug", 0.64),
        ("ycb_035_power_drill", 0.33),
    ] {
        let path = models.join(format!("objects/{name}/mesh.obj"));
        let mesh = read_mesh(&path, &std::fs::read(&path).unwrap()).unwrap().scaled(Vector::repeat(scale)).unwrap();
        assert!(mesh.statistics().is_closed(), "{name}");
        let [n_touching, n_edges] = balls_touch(name, &mesh, 0.012, 150);
        assert!(n_touching > 30 && n_edges > n_touching / 3, "{name}: {n_touching} {n_edges}");
    }
}
