//! The shared models: every mesh loads or fails cleanly, and surfaces of scanned objects hold together.

#![allow(clippy::print_stdout, missing_docs)]

use regrasp_base::Rng;
use regrasp_geometry::import::read_mesh;
use regrasp_geometry::reference::{Answer, ReferenceShape, distance};
use regrasp_geometry::{Point, Pose, Shape, Surface, TriangleMesh, UnitVector, Vector};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// `REGRASP_MODELS`, else `../shared/models` beside the repository; None, and a note, when there are none.
fn models() -> Option<PathBuf> {
    let found = match std::env::var_os("REGRASP_MODELS") {
        Some(path) => Some(PathBuf::from(path)),
        None => {
            Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|up| up.join("shared/models")).find(|p| p.is_dir())
        }
    };
    if found.is_none() {
        // Past the capture of test output, so that the log says it.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no shared models");
    }
    found
}

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
    let Some(models) = models() else { return };
    let mut files = Vec::new();
    mesh_files(&models, &mut files);
    assert!(files.len() > 300, "{}", files.len());
    let mut n_bad = 0;
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
                    Err(error) => println!("{}: no surface: {error}", path.display()),
                }
            }
            Err(error) => {
                n_bad += 1;
                println!("{error}");
            }
        }
    }
    println!("{} meshes, {n_bad} refused", files.len());
    assert_eq!(n_bad, 0);
}

const OBJECTS: [&str; 4] = [
    "objects/ycb_013_apple/mesh.obj",
    "objects/ycb_077_rubiks_cube/mesh.obj",
    "objects/robosuite_small/can.stl",
    "objects/ycb_025_mug/mesh.obj",
];

#[test]
fn scanned_objects_can_be_sampled_projected_and_walked() {
    let Some(models) = models() else { return };
    for name in OBJECTS {
        let shape = load(&models.join(name));
        let Shape::Mesh(mesh) = &shape else { unreachable!() };
        let surface = Surface::of(&shape).unwrap();
        let (low, high) = shape.bounds();
        let size = (high - low).norm();
        let center = nalgebra::center(&low, &high);
        let mut rng = Rng::keyed(2, name, 0);
        let (mut n_settled, mut n_tried, mut n_smooth) = (0, 0, 0);
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
            n_smooth += usize::from(surface.crease_distance(&p) > 0.002);
            let [k1, k2] = surface.curvature(&p);
            assert!(k1.is_finite() && k2.is_finite() && k1 >= k2);
            let other = surface.sample(&mut rng);
            let Some(path) = surface.geodesic(&p, &other) else { continue };
            let chord = (p.point_in_object - other.point_in_object).norm();
            assert!(path.length() >= chord - 1e-12 && path.length() < 6.0 * size, "{name} {} {chord}", path.length());
        }
        println!(
            "{name}: {n_settled} of {n_tried} settled, {n_smooth} farther than 2 mm from creases, {:?}",
            surface.mesh().unwrap().repairs()
        );
        assert!(n_settled * 2 > n_tried, "{name}");
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

/// Median time of one call in ns, over batches.
fn time<R>(mut call: impl FnMut(usize) -> R) -> f64 {
    let batch = 200;
    let mut times: Vec<f64> = (0..31)
        .map(|round| {
            let start = Instant::now();
            (0..batch).for_each(|i| drop(std::hint::black_box(call(round * batch + i))));
            start.elapsed().as_secs_f64() * 1e9 / batch as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

#[test]
#[ignore = "prints timings: cargo test --release -- --ignored --nocapture timings"]
fn timings() {
    let Some(models) = models() else { return };
    let name = OBJECTS[0];
    let shape = load(&models.join(name));
    let start = Instant::now();
    let surface = Surface::of(&shape).unwrap();
    println!("surface of {name}: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    let mut rng = Rng::keyed(3, "timings", 0);
    let points: Vec<_> = (0..4096).map(|_| surface.sample(&mut rng)).collect();
    let near: Vec<Point> = points.iter().map(|p| p.point_in_object + p.normal_in_object.as_ref() * 0.012).collect();
    let center = surface.mesh().unwrap().corners(0)[0] - points[0].normal_in_object.as_ref() * 0.03;
    let rays: Vec<UnitVector> = (0..4096).map(|_| UnitVector::new_normalize(Vector::from(rng.direction()))).collect();
    println!("sample          {:8.0} ns", time(|_| surface.sample(&mut rng)));
    println!("cast_ray        {:8.0} ns", time(|i| surface.cast_ray(&center, &rays[i % 4096])));
    println!("project 12 mm   {:8.0} ns", time(|i| surface.project(&near[i % 4096])));
    println!(
        "project 1 mm    {:8.0} ns",
        time(|i| surface
            .project(&(points[i % 4096].point_in_object + points[i % 4096].normal_in_object.as_ref() * 0.001)))
    );
    println!("signed_distance {:8.0} ns", time(|i| surface.signed_distance(&near[i % 4096])));
    println!("settle 12 mm    {:8.0} ns", time(|i| surface.settle(&points[i % 4096], 0.012)));
    println!("crease_distance {:8.0} ns", time(|i| surface.crease_distance(&points[i % 4096])));
    println!("curvature       {:8.0} ns", time(|i| surface.curvature(&points[i % 4096])));
    println!("geodesic far    {:8.0} ns", time(|i| surface.geodesic(&points[i % 4096], &points[(i + 7) % 4096])));
    let steps: Vec<_> =
        points.iter().map(|p| surface.project(&(p.point_in_object + Vector::new(0.01, 0.005, 0.0)))).collect();
    println!("geodesic 1 cm   {:8.0} ns", time(|i| surface.geodesic(&points[i % 4096], &steps[i % 4096])));
    let ellipsoid = Surface::of(&Shape::Ellipsoid { radii: Vector::new(0.02, 0.03, 0.05) }).unwrap();
    println!("ellipsoid project  {:8.0} ns", time(|i| ellipsoid.project(&near[i % 4096])));
    for shape in [
        Shape::Ellipsoid { radii: Vector::new(0.02, 0.03, 0.05) },
        Shape::Capsule { half_length: 0.03, radius: 0.02 },
        Shape::Cylinder { half_length: 0.03, radius: 0.02 },
        Shape::Cuboid { half_extents: Vector::new(0.02, 0.03, 0.05) },
    ] {
        let surface = Surface::of(&shape).unwrap();
        let on: Vec<_> = near.iter().map(|p| surface.project(p)).collect();
        println!(
            "{} geodesic  {:8.0} ns",
            shape.kind(),
            time(|i| surface.geodesic(&on[i % 4096], &on[(i + 7) % 4096]))
        );
    }
    let directions: Vec<Point> = (0..240).map(|_| Point::from(Vector::from(rng.direction()) * 0.02)).collect();
    let hull = Shape::Convex(Arc::new(regrasp_geometry::ConvexHull::new(&directions[..200]).unwrap()));
    let capsule = Shape::Capsule { half_length: 0.02, radius: 0.01 };
    let cuboid = Shape::Cuboid { half_extents: Vector::new(0.01, 0.015, 0.02) };
    let ball = Shape::Sphere { radius: 0.012 };
    let poses: Vec<Pose> = (0..4096).map(|_| regrasp_geometry::pose_from([0.0; 3], rng.quat_xyzw())).collect();
    for (label, a, b, away, max) in [
        ("capsule-capsule", &capsule, &capsule, 0.05, 1.0),
        ("box-box", &cuboid, &cuboid, 0.05, 1.0),
        ("box-box overlapping", &cuboid, &cuboid, 0.015, 1.0),
        ("box-sphere", &cuboid, &ball, 0.04, 1.0),
        ("hull(200)-box", &hull, &cuboid, 0.045, 1.0),
        ("box-box culled", &cuboid, &cuboid, 0.5, 0.01),
        ("mesh(16k)-box 1 m, cap 10 mm", &shape, &cuboid, 1.0, 0.01),
        ("mesh(16k)-box 80 mm, cap 10 mm", &shape, &cuboid, 0.08, 0.01),
        ("mesh(16k)-box 60 mm, cap 10 mm", &shape, &cuboid, 0.06, 0.01),
        ("mesh(16k)-box 60 mm, no cap", &shape, &cuboid, 0.06, 1.0),
        ("mesh(16k)-sphere 52 mm, cap 10 mm", &shape, &ball, 0.052, 0.01),
    ] {
        let (pa, pb) = (ReferenceShape::new(a).unwrap(), ReferenceShape::new(b).unwrap());
        let middle = {
            let (low, high) = a.bounds();
            nalgebra::center(&low, &high).coords
        };
        let mut n_apart = 0;
        let ns = time(|i| {
            let turned = poses[i % 4096];
            let place = middle + poses[(i + 99) % 4096] * Vector::x() * away;
            let world_from_b = Pose::from_parts(place.into(), turned.rotation);
            let answer = std::hint::black_box(distance(&pa, &Pose::identity(), &pb, &world_from_b, max));
            n_apart += usize::from(matches!(answer, Answer::SeparatedBy(_)));
        });
        println!("reference {label:35} {ns:8.0} ns, apart {} %", 100 * n_apart / (31 * 200));
    }
}
