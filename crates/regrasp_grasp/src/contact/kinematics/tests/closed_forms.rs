//! Each mode against motions known in closed form.

use super::super::chart::{ChartedSurface, Coordinates};
use super::super::montana::{ContactPair, ContactState, RelativeControl};
use super::super::{ContactPose, RelativeVelocity};
use super::{any_pose, any_state, apart};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector};

const TOLERANCE: f64 = 1e-11;

/// Turns about an axis through a point.
fn turn_about(point: &Point, rotation_vector: Vector) -> Pose {
    let turn = Pose::rotation(rotation_vector);
    Pose::translation(point.x, point.y, point.z) * turn * Pose::translation(-point.x, -point.y, -point.z)
}

#[test]
fn a_ball_on_a_plane_rolls_slides_and_twists() {
    let mut rng = Rng::keyed(1, "closed forms", 0);
    let radius = 0.025;
    for _ in 0..20 {
        let pair = ContactPair {
            object: ChartedSurface::plane(any_pose(&mut rng)),
            tip: ChartedSurface::sphere(radius, any_pose(&mut rng)).unwrap(),
        };
        let state = any_state(&pair, &mut rng);
        let (start, contact) = (pair.object_from_tip(&state), pair.contact_pose(&state).object_from_contact);
        let (x, y, z) = (rng.normal(), rng.normal(), rng.normal());
        let time = rng.uniform(0.5, 4.0);
        let end = |velocity: &RelativeVelocity| {
            let end = pair.advance(&state, velocity, time, TOLERANCE).unwrap();
            (end, pair.object_from_tip(&end))
        };
        // Rolling, also with a turn about the normal: the tip turns at a constant rate, its centre goes straight.
        for angular in [Vector::new(x, y, 0.0), Vector::new(x, y, z)] {
            let (_, at) = end(&RelativeVelocity { linear: Vector::zeros(), angular });
            let over_object = contact * -angular;
            let way = over_object.cross(&(contact * Vector::new(0.0, 0.0, radius))) * time;
            let center = contact * Point::new(0.0, 0.0, radius);
            let expected = Pose::translation(way.x, way.y, way.z) * turn_about(&center, over_object * time) * start;
            assert!(apart(&at, &expected, 1.0) < 1e-9, "{}", apart(&at, &expected, 1.0));
        }
        let (slid, at) = end(&RelativeVelocity::sliding(0.01 * x, 0.01 * y));
        let way = contact * Vector::new(-0.01 * x, -0.01 * y, 0.0) * time;
        assert!(apart(&at, &(Pose::translation(way.x, way.y, way.z) * start), 1.0) < 1e-9);
        assert!((pair.tip.point(&slid.tip) - pair.tip.point(&state.tip)).norm() < 1e-9);
        let (twisted, at) = end(&RelativeVelocity::twisting(z));
        let touching = contact * Point::origin();
        assert!(apart(&at, &(turn_about(&touching, contact * Vector::new(0.0, 0.0, -z * time)) * start), 1.0) < 1e-9);
        assert!((twisted.psi - state.psi - z * time).abs() < 1e-9);
    }
}

/// A ball of radius r round one of radius R: by the angle t about the middle it turns by (R + r) / r t when it rolls, not at all
/// when it slides.
#[test]
fn a_ball_goes_round_a_ball() {
    let mut rng = Rng::keyed(2, "closed forms", 0);
    for (object_radius, radius) in [(0.05, 0.02), (0.01, 0.03)] {
        let pair = ContactPair {
            object: ChartedSurface::sphere(object_radius, Pose::identity()).unwrap(),
            tip: ChartedSurface::sphere(radius, any_pose(&mut rng)).unwrap(),
        };
        for _ in 0..20 {
            let state = any_state(&pair, &mut rng);
            let (start, contact) = (pair.object_from_tip(&state), pair.contact_pose(&state).object_from_contact);
            let normal = contact * Vector::z();
            let around = object_radius + radius;
            let center = contact * Point::new(0.0, 0.0, radius);
            let (x, y) = (rng.normal(), rng.normal());
            // More than once round, through many charts.
            let time = rng.uniform(1.0, 30.0);

            let rolled = pair.advance(&state, &RelativeVelocity::rolling(x, y), time, TOLERANCE).unwrap();
            let over_object = contact * Vector::new(-x, -y, 0.0);
            let swept = over_object * (time * radius / around);
            let to = Pose::rotation(swept) * center;
            let expected = Pose::translation(to.x, to.y, to.z)
                * Pose::rotation(over_object * time)
                * Pose::translation(-center.x, -center.y, -center.z)
                * start;
            assert!(apart(&pair.object_from_tip(&rolled), &expected, 1.0) < 1e-8);
            assert!(
                (pair.object.point(&rolled.object) - Pose::rotation(swept) * (contact * Point::origin())).norm() < 1e-9
            );

            let slid = pair.advance(&state, &RelativeVelocity::sliding(0.02 * x, 0.02 * y), time, TOLERANCE).unwrap();
            let swept = normal.cross(&(contact * Vector::new(-0.02 * x, -0.02 * y, 0.0))) * (time / around);
            let to = Pose::rotation(swept) * center - center;
            assert!(apart(&pair.object_from_tip(&slid), &(Pose::translation(to.x, to.y, to.z) * start), 1.0) < 1e-8);
        }
    }
}

/// A contact frame with y along the y axis of the body, at a point of its section by y = 0, z along `normal`.
fn frame_in_section(point: Vector, normal: Vector) -> Pose {
    let x = Vector::y().cross(&normal);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, Vector::y(), normal]));
    Pose::from_parts(point.into(), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The point of `|x/a|^q + |z/c|^q = 1` with the outward normal (sin u, 0, cos u).
fn section_point(a: f64, c: f64, q: f64, u: f64) -> Vector {
    let (nx, nz) = (a * u.sin(), c * u.cos());
    let power = 1.0 / (q - 1.0);
    let size = (nx.abs().powf(q * power) + nz.abs().powf(q * power)).powf(1.0 / q);
    Vector::new(a * nx.abs().powf(power).copysign(nx), 0.0, c * nz.abs().powf(power).copysign(nz)) / size
}

fn section_arc(a: f64, c: f64, q: f64, from: f64, to: f64) -> f64 {
    let n = 200_000;
    let at = |k: i32| section_point(a, c, q, from + (to - from) * f64::from(k) / f64::from(n));
    (0..n).map(|k| (at(k + 1) - at(k)).norm()).sum()
}

/// In a plane of symmetry ellipsoids and superellipsoids roll on a plane as far as the arc of their section.
#[test]
fn an_ellipsoid_rolls_on_a_plane_as_far_as_its_arc() {
    let radii = Vector::new(0.09, 0.07, 0.12);
    for (p, q, from, to) in
        [(2.0, 2.0, 0.0f64, 2.5f64), (2.0, 2.0, -0.4, 1.3), (2.0, 3.0, 0.2, 1.4), (2.0, 4.0, 0.3, 1.2)]
    {
        let pair = ContactPair {
            object: ChartedSurface::plane(Pose::identity()),
            tip: ChartedSurface::superellipsoid(radii, p, q, Pose::identity()).unwrap(),
        };
        // The tip touches with the normal at angle `from`; seen from the contact its outward normal is -z.
        let normal = Vector::new(from.sin(), 0.0, from.cos());
        let contact = ContactPose {
            object_from_contact: Pose::identity(),
            tip_from_contact: frame_in_section(section_point(radii.x, radii.z, q, from), -normal),
        };
        let state = pair.state_at(&contact, 1e-9, 1e-6).unwrap();
        let at = pair.contact_pose(&state);
        assert!(apart(&at.object_from_tip(), &contact.object_from_tip(), 0.1) < 1e-8);
        // x of the plane's chart is x of the contact: the object turns about y at one radian per second.
        let control = RelativeControl::InChart(RelativeVelocity::rolling(0.0, 1.0));
        let end = pair.advance_under(&state, control, to - from, 1e-11).unwrap().state;
        let touched = pair.tip.point(&end.tip).coords;
        let sign = (touched - section_point(radii.x, radii.z, q, to)).norm() < 1e-8;
        let back = (touched - section_point(radii.x, radii.z, q, 2.0 * from - to)).norm() < 1e-8;
        assert!(sign || back, "{touched}");
        let arc = if sign {
            section_arc(radii.x, radii.z, q, from, to)
        } else {
            section_arc(radii.x, radii.z, q, 2.0 * from - to, from)
        };
        assert!((end.object.u.abs() - arc).abs() < 1e-8 && end.object.v.abs() < 1e-10, "{} {arc}", end.object.u);
        // The fingertip turns by the negative of what the object does.
        let turned = pair.object_from_tip(&end).rotation * pair.object_from_tip(&state).rotation.inverse();
        assert!((turned.scaled_axis() - Vector::new(0.0, from - to, 0.0)).norm() < 1e-9);
    }
}

/// A ball in a plane of symmetry of an ellipsoid turns by the arc over its radius, and by what the normal turns.
#[test]
fn a_ball_rolls_round_an_ellipsoid() {
    let (radii, radius) = (Vector::new(0.09, 0.08, 0.12), 0.02);
    let pair = ContactPair {
        object: ChartedSurface::ellipsoid(radii, Pose::identity()).unwrap(),
        tip: ChartedSurface::sphere(radius, Pose::identity()).unwrap(),
    };
    let state = ContactState {
        object: pair.object.coordinates(&Point::new(0.0, 0.0, 0.12)),
        tip: Coordinates { axis: 2, u: 0.4, v: -0.3 },
        psi: 0.8,
    };
    let contact = pair.contact_pose(&state);
    let about = contact.object_from_contact.rotation.inverse() * Vector::y();
    for to in [0.5, 2.0, 3.5] {
        // The ball turns about y by the arc over its radius and by the turn of the normal.
        let time = section_arc(radii.x, radii.z, 2.0, 0.0, to) / radius + to;
        let velocity = RelativeVelocity { linear: Vector::zeros(), angular: -about };
        let end = pair.advance(&state, &velocity, time, TOLERANCE).unwrap();
        let off = pair.object.point(&end.object).coords - section_point(radii.x, radii.z, 2.0, to);
        assert!(off.norm() < 1e-8, "{off}");
        let turned = pair.object_from_tip(&end).rotation * pair.object_from_tip(&state).rotation.inverse();
        assert!(turned.angle_to(&UnitQuaternion::from_scaled_axis(Vector::y() * time)) < 1e-8);
    }
}
