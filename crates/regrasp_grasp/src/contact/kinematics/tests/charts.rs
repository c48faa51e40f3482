//! Forms against differences of the parametrisation, and against printed ones.

use super::super::chart::{ChartedSurface, Coordinates, NoChart};
use super::{any_coordinates, any_pose, surfaces};
use nalgebra::{Matrix2, RowVector2, Vector2};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Shape, Surface, Vector};

#[test]
fn forms_are_differences_of_the_parametrisation() {
    let mut rng = Rng::keyed(1, "charts", 0);
    for surface in surfaces(&mut rng) {
        for k in 0..300 {
            let mut at = any_coordinates(&surface, &mut rng);
            if at.axis != 2 || k % 2 == 0 {
                // Also far from the middle of the chart.
                at.v = rng.uniform(-1.2, 1.2);
            }
            let forms = surface.forms(&at);
            let step = 1e-5;
            let frame = surface.body_from_contact(&at);
            let along = |du: f64, dv: f64| surface.body_from_contact(&Coordinates { u: at.u + du, v: at.v + dv, ..at });
            let [x, y, z] = [Vector::x(), Vector::y(), Vector::z()].map(|axis| frame.rotation * axis);
            for (column, (before, after)) in
                [(0, (along(-step, 0.0), along(step, 0.0))), (1, (along(0.0, -step), along(0.0, step)))]
            {
                let way = (after.translation.vector - before.translation.vector) / (2.0 * step);
                let moved = Vector2::new(way.dot(&x), way.dot(&y));
                let metric: Vector2<f64> = forms.metric.column(column).into();
                assert!((moved - metric).norm() < 1e-8 && way.dot(&z).abs() < 1e-8, "{surface:?} {at:?}");
                let rate = |axis: Vector| (after.rotation * axis - before.rotation * axis) / (2.0 * step);
                let turned = rate(Vector::z());
                let expected = forms.curvature * metric;
                assert!((turned.dot(&x) - expected.x).abs() < 1e-6 * (1.0 + expected.norm()), "{surface:?} {at:?}");
                assert!((turned.dot(&y) - expected.y).abs() < 1e-6 * (1.0 + expected.norm()), "{surface:?} {at:?}");
                let spin = rate(Vector::x()).dot(&y);
                assert!((spin - (forms.torsion * metric).x).abs() < 1e-6, "{surface:?} {at:?}");
            }
            assert!((forms.curvature - forms.curvature.transpose()).norm() < 1e-9 * (1.0 + forms.curvature.norm()));
            assert!((frame.translation.vector - surface.point(&at).coords).norm() == 0.0);
        }
    }
}

/// Murray, Li, Sastry 1994, example 5.5, with the coordinates the other way round.
#[test]
fn spheres_and_planes_have_the_printed_forms() {
    let sphere = ChartedSurface::sphere(0.02, Pose::identity()).unwrap();
    let forms = sphere.forms(&Coordinates { axis: 2, u: 0.3, v: 0.7 });
    assert!((forms.metric - Matrix2::new(0.02 * 0.7f64.cos(), 0.0, 0.0, 0.02)).norm() < 1e-15);
    assert!((forms.curvature - Matrix2::identity() * 50.0).norm() < 1e-12);
    assert!((forms.torsion - RowVector2::new(0.7f64.tan() * 50.0, 0.0)).norm() < 1e-12);
    let plane = ChartedSurface::plane(Pose::identity()).forms(&Coordinates { axis: 2, u: 0.3, v: 0.7 });
    assert_eq!((plane.metric, plane.curvature), (Matrix2::identity(), Matrix2::zeros()));
    assert_eq!(plane.torsion, RowVector2::zeros());
}

#[test]
fn curvature_and_normals_are_those_of_surfaces() {
    let mut rng = Rng::keyed(2, "charts", 0);
    for shape in [
        Shape::Sphere { radius: 0.03 },
        Shape::Ellipsoid { radii: Vector::new(0.09, 0.07, 0.12) },
        Shape::Cylinder { half_length: 2.0, radius: 0.04 },
    ] {
        let (surface, place) = (Surface::of(&shape).unwrap(), any_pose(&mut rng));
        let charted = ChartedSurface::of(&shape, place).unwrap().unwrap();
        for _ in 0..200 {
            let at = any_coordinates(&charted, &mut rng);
            let forms = charted.forms(&at);
            let foot = surface.project(&place.inverse_transform_point(&charted.point(&at)));
            assert!((place * foot.point_in_object - charted.point(&at)).norm() < 1e-14);
            let normal = place * foot.normal_in_object.into_inner();
            assert!((charted.body_from_contact(&at).rotation * Vector::z() - normal).norm() < 1e-12);
            let eigen = forms.curvature.symmetric_eigenvalues();
            let [k1, k2] = surface.curvature(&foot);
            assert!((eigen.max() - k1).abs() < 1e-9 && (eigen.min() - k2).abs() < 1e-9);
        }
    }
    assert_eq!(ChartedSurface::of(&Shape::Cuboid { half_extents: Vector::repeat(1.0) }, Pose::identity()), Ok(None));
}

#[test]
fn superellipsoids_obey_their_equation_and_include_ellipsoids() {
    let mut rng = Rng::keyed(3, "charts", 0);
    let radii = Vector::new(0.09, 0.07, 0.12);
    let ellipsoid = ChartedSurface::ellipsoid(radii, Pose::identity()).unwrap();
    let same = ChartedSurface::superellipsoid(radii, 2.0, 2.0, Pose::identity()).unwrap();
    for _ in 0..200 {
        let (p, q) = (rng.uniform(2.0, 6.0), rng.uniform(2.1, 6.0));
        let surface = ChartedSurface::superellipsoid(radii, p, q, Pose::identity()).unwrap();
        let at = any_coordinates(&surface, &mut rng);
        let s = surface.point(&at).coords.component_div(&radii).abs();
        assert!(((s.x.powf(p) + s.y.powf(p)).powf(q / p) + s.z.powf(q) - 1.0).abs() < 1e-12);
        assert!(surface.forms(&at).curvature.symmetric_eigenvalues().min() > -1e-9, "it is convex");
        let (a, b) = (ellipsoid.forms(&at), same.forms(&at));
        assert!((a.curvature - b.curvature).norm() < 1e-9 && (a.torsion - b.torsion).norm() < 1e-9);
    }
    // On its axes and coordinate planes no power is lost.
    let surface = ChartedSurface::superellipsoid(radii, 4.0, 2.5, Pose::identity()).unwrap();
    for k in 0..3 {
        let point = Point::from(Vector::ith(k, radii[k]));
        let at = surface.coordinates(&point);
        let forms = surface.forms(&at);
        assert!((surface.point(&at) - point).norm() < 1e-15);
        assert!(forms.curvature.iter().all(|x| x.is_finite()));
    }
    for (p, q) in [(1.5, 3.0), (3.0, 1.5), (3.0, 2.0), (f64::NAN, 3.0), (3.0, f64::INFINITY)] {
        let refused = ChartedSurface::superellipsoid(radii, p, q, Pose::identity());
        assert!(matches!(refused, Err(NoChart::Exponents { .. })), "{p} {q}");
    }
    assert!(matches!(ChartedSurface::sphere(-1.0, Pose::identity()), Err(NoChart::Length { .. })));
}

#[test]
fn every_point_has_a_chart_whose_pole_is_far() {
    let mut rng = Rng::keyed(4, "charts", 0);
    for surface in surfaces(&mut rng) {
        for _ in 0..500 {
            let mut at = any_coordinates(&surface, &mut rng);
            if at.axis != 2 {
                at = Coordinates { axis: rng.below(3), u: rng.uniform(-9.0, 9.0), v: rng.uniform(-1.57, 1.57) };
            }
            let good = surface.in_good_chart(&at);
            assert!((surface.point(&good) - surface.point(&at)).norm() < 1e-14);
            let found = surface.coordinates(&surface.point(&at));
            assert!((surface.point(&found) - surface.point(&at)).norm() < 1e-14);
            assert!(good.v.abs() < 0.93 && (found.axis == 2 || found.v.abs() < 0.62), "{good:?} {found:?}");
        }
    }
}
