use super::*;
use crate::tip::TipEllipsoid;
use nalgebra::UnitQuaternion;
use regrasp_base::Rng;

/// A box of these half extents.
fn cuboid(half: Vector) -> ConvexHull {
    let sign = |k: usize, bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
    let corner = |k: usize| Point::new(sign(k, 0) * half.x, sign(k, 1) * half.y, sign(k, 2) * half.z);
    ConvexHull::new(&(0..8).map(corner).collect::<Vec<_>>()).unwrap()
}

fn egg() -> (TipEllipsoid, ConvexHull) {
    let egg = TipEllipsoid::new(Vector::new(0.011, 0.008, 0.007), UnitQuaternion::from_euler_angles(0.3, -0.8, 1.1));
    let points: Vec<Point> = spiral(3000).map(|n| Point::from(egg.arm(&n))).collect();
    (egg, ConvexHull::new(&points).unwrap())
}

/// The fingertip of the LEAP hand about the middle of its box; none where the models are absent.
fn leap() -> Option<ConvexHull> {
    let path = crate::places::shared_models()?.join("hands/leap/meshes/collision/white_tip.obj");
    let bytes = std::fs::read(&path).unwrap();
    let mesh = regrasp_geometry::import::read_mesh(&path, &bytes).unwrap();
    let (low, high) = mesh
        .vertices()
        .iter()
        .fold((mesh.vertices()[0], mesh.vertices()[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let middle = nalgebra::center(&low, &high);
    let points: Vec<Point> = mesh.vertices().iter().map(|p| Point::from(p - middle)).collect();
    Some(ConvexHull::new(&points).unwrap())
}

fn tips() -> Vec<(&'static str, ConvexHull, f64)> {
    let mut tips = vec![
        ("egg", egg().1, 0.05e-3),
        ("box", cuboid(Vector::new(0.010, 0.008, 0.012)), 0.2e-3),
        ("small box", cuboid(Vector::new(0.003, 0.004, 0.003)), 0.1e-3),
    ];
    tips.extend(leap().map(|hull| ("leap", hull, 0.15e-3)));
    tips
}

/// The polyhedron itself, by looking at all corners.
fn farthest(hull: &ConvexHull, n: &Vector) -> f64 {
    hull.vertices().iter().map(|p| p.coords.dot(n)).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn the_surface_lies_near_the_polyhedron() {
    let mut rng = Rng::keyed(1, "near", 0);
    for (name, hull, allowed) in tips() {
        let (surface, misfit) = SmoothHull::near(&hull, None).unwrap();
        let (mut least, mut most, mut largest) = (0.0f64, 0.0f64, 0.0f64);
        let (mut sharpest, mut flattest) = (f64::INFINITY, 0.0f64);
        for _ in 0..4000 {
            let n = Vector::from(rng.direction());
            let off = surface.support(&n) - farthest(&hull, &n);
            (least, most) = (least.min(off), most.max(off));
            largest = largest.max(surface.point(&n).norm());
            let radii = surface.bend(&n).radii.symmetric_eigenvalues();
            let mut radii: Vec<f64> = radii.iter().copied().collect();
            radii.sort_by(f64::total_cmp);
            (sharpest, flattest) = (sharpest.min(radii[1]), flattest.max(radii[2]));
        }
        assert!(misfit <= allowed, "{name}: {misfit}");
        assert!(most <= 1.1 * misfit && -least <= 1.1 * misfit, "{name}: {least} {most} {misfit}");
        assert!(largest <= 1.001 * surface.reach());
        assert!(sharpest >= 0.999 * surface.rounding() && flattest < 4.0, "{name}: {sharpest} {flattest}");
    }
}

/// Every supporting plane is one: the surface is convex, and its points have the normals that they are asked for.
#[test]
fn points_have_the_normals_asked_for() {
    let mut rng = Rng::keyed(2, "normals", 0);
    for (name, hull, _) in tips() {
        let (surface, _) = SmoothHull::near(&hull, None).unwrap();
        let sample: Vec<Vector> = (0..300).map(|_| Vector::from(rng.direction())).collect();
        for n in &sample {
            assert!((surface.point(n).dot(n) - surface.support(n)).abs() < 1e-12, "{name}");
            assert!((surface.bend(n).point - surface.point(n)).norm() < 1e-12, "{name}");
            let beyond = sample.iter().map(|m| surface.point(m).dot(n)).fold(f64::NEG_INFINITY, f64::max);
            assert!(beyond <= surface.support(n) + 1e-12, "{name}");
        }
    }
}

/// The slope of the support function is the point, the slope of the point the curvature: by differences.
#[test]
fn slopes_are_what_differences_say() {
    let mut rng = Rng::keyed(3, "slopes", 0);
    for (name, hull, _) in tips() {
        let (surface, _) = SmoothHull::near(&hull, None).unwrap();
        for _ in 0..300 {
            let n = Vector::from(rng.direction());
            let across = n.cross(&Vector::from(rng.direction())).normalize();
            let turned = |angle: f64| n * angle.cos() + across * angle.sin();
            let step = 1e-6;
            let slope = (surface.support(&turned(step)) - surface.support(&turned(-step))) / (2.0 * step);
            assert!((slope - surface.point(&n).dot(&across)).abs() < 1e-6, "{name}");
            let moved = (surface.point(&turned(step)) - surface.point(&turned(-step))) / (2.0 * step);
            let known = surface.bend(&n).radii * across;
            assert!((moved - known).norm() < 1e-3 * known.norm() + 1e-6, "{name}: {moved} {known}");
        }
    }
}

#[test]
fn an_ellipsoid_is_met_within_what_is_said() {
    let (egg, hull) = egg();
    let (surface, misfit) = SmoothHull::near(&hull, None).unwrap();
    for n in spiral(500) {
        assert!((surface.support(&n) - egg.arm(&n).dot(&n)).abs() < misfit + 1e-5);
    }
}

#[test]
fn a_polyhedron_beside_its_origin_has_no_surface() {
    let points: Vec<Point> = cuboid(Vector::repeat(0.01)).vertices().iter().map(|p| p + Vector::x() * 0.02).collect();
    assert!(SmoothHull::near(&ConvexHull::new(&points).unwrap(), None).is_none());
}

/// Lists leave nothing out that counts: sums over all points are the same, on a tip as flat as a nail, too.
#[test]
fn nothing_that_counts_is_left_out() {
    let mut rng = Rng::keyed(4, "lists", 0);
    let nail = TipEllipsoid::new(Vector::new(0.015, 0.010, 0.0015), UnitQuaternion::from_euler_angles(0.3, 0.2, 0.1));
    let nail = ConvexHull::new(&spiral(3000).map(|n| Point::from(nail.arm(&n))).collect::<Vec<_>>()).unwrap();
    for (name, hull) in tips().into_iter().map(|(name, hull, _)| (name, hull)).chain([("nail", nail)]) {
        let (surface, _) = SmoothHull::near(&hull, None).unwrap();
        for _ in 0..4000 {
            let n = Vector::from(rng.direction());
            let reaches = || surface.points().iter().map(|point| point.dot(&n).max(0.0));
            let largest = reaches().fold(0.0, f64::max);
            let sum: f64 = reaches().map(|s| (s / largest).powi(EXPONENT)).sum();
            let weighted: Vector = surface
                .points()
                .iter()
                .map(|point| point * (point.dot(&n).max(0.0) / largest).powi(EXPONENT - 1))
                .sum();
            let root = sum.powf(1.0 / f64::from(EXPONENT));
            let off = surface.support(&n) - (largest * root + surface.rounding());
            assert!(off.abs() < 1e-13, "{name}: {off}");
            let off = surface.point(&n) - (weighted * (root / sum) + n * surface.rounding());
            assert!(off.norm() < 1e-11, "{name}: {off}");
        }
    }
}
