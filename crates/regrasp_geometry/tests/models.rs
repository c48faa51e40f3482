//! The shared models: every mesh loads or fails cleanly, and surfaces of scanned objects hold together.

#![allow(missing_docs)]

#[path = "../../../tests/support/places.rs"]
mod places;

use places::shared_models;
use regrasp_base::Rng;
use regrasp_geometry::import::read_mesh;
use regrasp_geometry::{Point, Shape, Surface, TriangleMesh, Vector};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn load(path: &Path) -> Shape {
    Shape::Mesh(Arc::new(read_mesh(path, &std::fs::read(path).unwrap()).unwrap()))
}

fn mesh_files(directory: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(directory).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            mesh_files(&path, found);
        } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj") || e.eq_ignore_ascii_case("stl")) {
            found.push(path);
        }
    }
}

#[test]
fn every_model_loads_or_fails_cleanly() {
    let Some(models) = shared_models() else { return };
    let mut files = Vec::new();
    mesh_files(&models, &mut files);
    assert!(files.len() > 300, "{}", files.len());
    let (mut bad, mut flat) = (Vec::new(), Vec::new());
    for path in &files {
        match read_mesh(path, &std::fs::read(path).unwrap()) {
            Ok(mesh) => {
                let shape = Shape::Mesh(Arc::new(mesh));
                match Surface::of(&shape) {
                    Ok(surface) => {
                        assert!(surface.area() > 0.0);
                        let mut rng = Rng::keyed(1, "models", 0);
                        for _ in 0..20 {
                            let p = surface.sample(&mut rng);
                            assert!(
                                (surface.project(&p.point_in_object).point_in_object - p.point_in_object).norm() < 1e-9
                            );
                        }
                    }
                    Err(error) => flat.push(format!("{}: {error}", path.display())),
                }
            }
            Err(error) => bad.push(error.to_string()),
        }
    }
    assert!(bad.is_empty(), "{} of {} meshes refused: {bad:?}", bad.len(), files.len());
    assert!(flat.is_empty(), "{} of {} meshes have no surface: {flat:?}", flat.len(), files.len());
}

const OBJECTS: [&str; 4] = [
    "objects/ycb_013_apple/mesh.obj",
    "objects/ycb_077_rubiks_cube/mesh.obj",
    "objects/robosuite_small/can.stl",
    "objects/ycb_025_mug/mesh.obj",
];

#[test]
fn scanned_objects_can_be_sampled_projected_and_walked() {
    let Some(models) = shared_models() else { return };
    for name in OBJECTS {
        let shape = load(&models.join(name));
        let Shape::Mesh(mesh) = &shape else { unreachable!() };
        let surface = Surface::of(&shape).unwrap();
        let (low, high) = shape.bounds();
        let size = (high - low).norm();
        let center = nalgebra::center(&low, &high);
        let mut rng = Rng::keyed(2, name, 0);
        let (mut n_settled, mut n_tried) = (0, 0);
        for _ in 0..200 {
            let p = surface.sample(&mut rng);
            assert!(surface.signed_distance(&p.point_in_object).abs() < 1e-9 * size);
            assert!((p.normal_in_object.norm() - 1.0).abs() < 1e-9);
            let q = center + Vector::from(rng.direction()) * rng.uniform(0.0, size);
            // Against all triangles.
            let nearest =
                (0..mesh.triangles().len()).map(|i| brute_distance(mesh, i, &q)).fold(f64::INFINITY, f64::min);
            assert!((surface.signed_distance(&q).abs() - nearest).abs() < 1e-9, "{name}");
            let radius = 0.012;
            n_tried += 1;
            if let Some(contact) = surface.settle(&p, radius) {
                n_settled += 1;
                let ball = contact.point_in_object + contact.normal_in_object.as_ref() * radius;
                assert!((surface.signed_distance(&ball) - radius).abs() < 1e-8, "{name}");
            }
            assert!(surface.crease_distance(&p) >= 0.0);
            let [k1, k2] = surface.curvature(&p);
            assert!(k1.is_finite() && k2.is_finite() && k1 >= k2);
            let other = surface.sample(&mut rng);
            let Some(path) = surface.geodesic(&p, &other) else { continue };
            let chord = (p.point_in_object - other.point_in_object).norm();
            assert!(path.length() >= chord - 1e-12 && path.length() < 6.0 * size, "{name} {} {chord}", path.length());
        }
        assert!(n_settled * 2 > n_tried, "{name}: {n_settled} of {n_tried} settled");
    }
}

/// Distance of a point from a triangle by ternary search over it.
fn brute_distance(mesh: &TriangleMesh, i: usize, p: &Point) -> f64 {
    let [a, b, c] = mesh.corners(i);
    let normal = (b - a).cross(&(c - a));
    let (n, to) = (normal.normalize(), p - a);
    let foot = p - n * n.dot(&to);
    let inside = |u: &Point, v: &Point| (v - u).cross(&(foot - u)).dot(&normal) >= 0.0;
    if inside(&a, &b) && inside(&b, &c) && inside(&c, &a) {
        return n.dot(&to).abs();
    }
    let edge = |u: &Point, v: &Point| {
        let along = v - u;
        let t = ((p - u).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (p - (u + along * t)).norm()
    };
    edge(&a, &b).min(edge(&b, &c)).min(edge(&c, &a))
}
