//! The form without charts against that in charts, and meshes against smooth surfaces.

use super::super::chart::ChartedSurface;
use super::super::chart_free::SurfacePair;
use super::super::montana::ContactPair;
use super::super::{ContactPose, NoStep, RelativeVelocity};
use super::{any_pose, any_state, any_velocity, apart, differenced};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Shape, Surface, TriangleMesh, Vector};
use std::sync::Arc;

const RADII: [f64; 3] = [0.09, 0.07, 0.12];

fn ellipsoid() -> Shape {
    Shape::Ellipsoid { radii: Vector::from(RADII) }
}

/// An octahedron refined `levels` times, blown up into the ellipsoid.
fn faceted(levels: usize) -> Shape {
    let mut triangles: Vec<[Vector; 3]> = Vec::new();
    for k in 0..8 {
        let sign = |i: usize| if k >> i & 1 == 1 { 1.0 } else { -1.0 };
        let [x, y, z] = [0, 1, 2].map(|i| Vector::ith(i, sign(i)));
        triangles.push(if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [y, x, z] });
    }
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|[a, b, c]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(|v| v.normalize());
                [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
            })
            .collect();
    }
    let mut points: Vec<Vector> = Vec::new();
    let mut index = |v: &Vector| match points.iter().position(|p| (p - v).norm() < 1e-9) {
        Some(i) => i as u32,
        None => {
            points.push(*v);
            points.len() as u32 - 1
        }
    };
    let triangles = triangles.iter().map(|t| t.map(|v| index(&v))).collect();
    let vertices = points.iter().map(|v| Point::from(v.component_mul(&Vector::from(RADII)))).collect();
    Shape::Mesh(Arc::new(TriangleMesh::new(vertices, triangles).unwrap()))
}

#[test]
fn both_forms_agree() {
    let mut rng = Rng::keyed(1, "chart free", 0);
    let object = Surface::of(&ellipsoid()).unwrap();
    for shape in [Shape::Sphere { radius: 0.02 }, Shape::Ellipsoid { radii: Vector::new(0.02, 0.03, 0.015) }] {
        let (tip, tip_from_surface) = (Surface::of(&shape).unwrap(), any_pose(&mut rng));
        let free = SurfacePair { object: &object, tip: &tip, tip_from_surface };
        let charted = ContactPair {
            object: ChartedSurface::of(&ellipsoid(), Pose::identity()).unwrap().unwrap(),
            tip: ChartedSurface::of(&shape, tip_from_surface).unwrap().unwrap(),
        };
        for _ in 0..20 {
            let (state, velocity) = (any_state(&charted, &mut rng), any_velocity(&mut rng));
            let start = charted.contact_pose(&state);
            let by_charts = charted.object_from_tip(&charted.advance(&state, &velocity, 3.0, 1e-10).unwrap());
            let end = free.advance(&start, &velocity, 3.0, 1e-10).unwrap();
            assert!(apart(&end.object_from_tip(), &by_charts, 0.1) < 1e-8);
            assert!(charted.state_at(&end, 1e-12, 1e-7).is_ok());
        }
    }
}

/// A capsule has no chart here; poses move as asked on its side and on its ends.
#[test]
fn capsules_move_as_asked() {
    let mut rng = Rng::keyed(2, "chart free", 0);
    let (object, tip) = (ellipsoid(), Shape::Capsule { half_length: 0.02, radius: 0.01 });
    let [object, tip] = [object, tip].map(|shape| Surface::of(&shape).unwrap());
    let pair = SurfacePair { object: &object, tip: &tip, tip_from_surface: any_pose(&mut rng) };
    for _ in 0..50 {
        let (on_object, on_tip) = (object.sample(&mut rng), tip.sample(&mut rng));
        let frame = |point: &Point, normal: Vector| {
            let side = normal.cross(&Vector::new(0.3, 0.4, 0.5)).normalize();
            let axes = nalgebra::Matrix3::from_columns(&[side, normal.cross(&side), normal]);
            let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
            Pose::from_parts(point.coords.into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
        };
        let contact = ContactPose {
            object_from_contact: frame(&on_object.point_in_object, on_object.normal_in_object.into_inner()),
            tip_from_contact: pair.tip_from_surface
                * frame(&on_tip.point_in_object, -on_tip.normal_in_object.into_inner()),
        };
        if (on_tip.point_in_object.z.abs() - 0.02).abs() < 1e-3 {
            continue;
        }
        let velocity = any_velocity(&mut rng);
        let step = 1e-4;
        let [before, after] = [velocity.scaled(-1.0), velocity]
            .map(|v| pair.advance(&contact, &v, step, 1e-13).unwrap().object_from_tip());
        let measured = differenced(&before, &after, &contact, step);
        assert!((measured.linear - velocity.linear).norm() < 1e-7, "{measured:?} {velocity:?}");
        assert!((measured.angular - velocity.angular).norm() < 1e-5, "{measured:?} {velocity:?}");
    }
}

/// The finer the mesh, the nearer to the smooth surface a ball rolls; contact is kept on every mesh.
#[test]
fn meshes_approach_the_smooth_surface() {
    let tip = Surface::of(&Shape::Sphere { radius: 0.02 }).unwrap();
    let smooth = Surface::of(&ellipsoid()).unwrap();
    let off = |levels: usize| {
        let mut rng = Rng::keyed(3, "chart free", 0);
        let object = Surface::of(&faceted(levels)).unwrap();
        let charted = ContactPair {
            object: ChartedSurface::of(&ellipsoid(), Pose::identity()).unwrap().unwrap(),
            tip: ChartedSurface::sphere(0.02, Pose::identity()).unwrap(),
        };
        let mut sum = 0.0;
        for _ in 0..10 {
            let start = charted.contact_pose(&any_state(&charted, &mut rng));
            let velocity = RelativeVelocity::rolling(rng.uniform(0.2, 1.0), rng.uniform(0.2, 1.0));
            let [exact, found] = [&smooth, &object].map(|object| {
                let pair = SurfacePair { object, tip: &tip, tip_from_surface: Pose::identity() };
                let start = pair.put_back(&start);
                pair.advance(&start, &velocity, 2.0, if object.mesh().is_some() { 1e-4 } else { 1e-10 }).unwrap()
            });
            let on_mesh = Point::from(found.object_from_contact.translation.vector);
            assert!((object.project(&on_mesh).point_in_object - on_mesh).norm() < 1e-12);
            let center = found.object_from_tip() * Point::origin();
            // The ball stands on the interpolated normal, so it leans over the facet by their difference.
            assert!((object.signed_distance(&center) - 0.02).abs() < 0.02 * 0.04 / 4f64.powi(levels as i32 - 3));
            sum += apart(&exact.object_from_tip(), &found.object_from_tip(), 0.02);
        }
        sum / 10.0
    };
    let errors = [3, 4, 5].map(off);
    assert!(errors[1] < 0.5 * errors[0] && errors[2] < 0.5 * errors[1] && errors[2] < 2e-4, "{errors:?}");
}

#[test]
fn flat_on_flat_is_refused() {
    let cuboid = Surface::of(&Shape::Cuboid { half_extents: Vector::repeat(0.1) }).unwrap();
    let pair = SurfacePair { object: &cuboid, tip: &cuboid, tip_from_surface: Pose::identity() };
    let contact = ContactPose {
        object_from_contact: Pose::translation(0.0, 0.0, 0.1),
        tip_from_contact: Pose::translation(0.0, 0.0, -0.1),
    };
    let refused = pair.advance(&contact, &RelativeVelocity::rolling(0.1, 0.2), 1.0, 1e-6);
    assert!(matches!(refused, Err(NoStep::SingularCurvature { .. })));
}
