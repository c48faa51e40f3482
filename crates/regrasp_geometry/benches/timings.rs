//! Times of surfaces and of the reference distance, on a scanned apple.
#![allow(clippy::print_stdout)]

#[path = "../../../tests/support/places.rs"]
mod places;

use places::shared_models;
use regrasp_base::Rng;
use regrasp_geometry::import::read_mesh;
use regrasp_geometry::reference::{Clearance, ReferenceShape, distance};
use regrasp_geometry::{Point, Pose, Shape, Surface, UnitVector, Vector};
use std::sync::Arc;
use std::time::Instant;

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

fn main() {
    let Some(models) = shared_models() else { return };
    let name = "objects/ycb_013_apple/mesh.obj";
    let path = models.join(name);
    let shape = Shape::Mesh(Arc::new(read_mesh(&path, &std::fs::read(&path).unwrap()).unwrap()));
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
            n_apart += usize::from(matches!(answer, Clearance::SeparatedBy(_)));
        });
        println!("reference {label:35} {ns:8.0} ns, apart {} %", 100 * n_apart / (31 * 200));
    }
}
