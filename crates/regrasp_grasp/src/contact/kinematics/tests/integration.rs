//! Rates against differences of poses, error order, refusals, and the midpoint rules.

use super::super::chart::{ChartedSurface, Coordinates};
use super::super::dormand_prince;
use super::super::montana::{ContactPair, ContactState, RelativeControl, pack, unpack};
use super::super::{ContactPose, NoStep, RelativeVelocity};
use super::{any_coordinates, any_pose, any_state, any_velocity, apart, differenced, surfaces};
use crate::contact::{rolling, rolling_ellipsoid};
use nalgebra::UnitQuaternion;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Shape, Surface, Vector};
use regrasp_robot::tip::TipEllipsoid;

/// Pairs of all kinds that touch in points.
fn pairs(rng: &mut Rng) -> Vec<ContactPair> {
    let (objects, tips) = (surfaces(rng), surfaces(rng));
    let mut pairs = Vec::new();
    for (i, object) in objects.iter().enumerate() {
        for (j, tip) in tips.iter().enumerate() {
            // Plane on plane or cylinder, and cylinder on plane, touch in lines.
            if i + j >= 2 && (i, j) != (1, 1) {
                pairs.push(ContactPair { object: *object, tip: *tip });
            }
        }
    }
    pairs
}

/// The relative velocity of poses a moment apart is what was asked for, whatever is held constant.
#[test]
fn poses_move_as_asked() {
    let mut rng = Rng::keyed(1, "integration", 0);
    let (mut totals, mut n_measured) = ([0.0; 2], 0);
    for pair in pairs(&mut rng) {
        for _ in 0..20 {
            let (state, velocity) = (any_state(&pair, &mut rng), any_velocity(&mut rng));
            let contact = pair.contact_pose(&state);
            let Ok(rates) = pair.rates(&state, &velocity) else { continue };
            let speed = rates.object.norm().max(rates.tip.norm()).max(rates.psi.abs());
            if speed > 5.0 {
                // Nearly flat on flat: differences say nothing there.
                continue;
            }
            for (k, step) in [4e-4, 2e-4].into_iter().enumerate() {
                let under =
                    |control: RelativeControl<'_>| pair.advance_under(&state, control, step, 1e-13).unwrap().state;
                let both = [velocity.scaled(-1.0), velocity];
                let in_chart = both.map(|v| under(RelativeControl::InChart(v)));
                for ends in [
                    in_chart,
                    both.map(|v| under(RelativeControl::Transported(v))),
                    both.map(|v| under(RelativeControl::Varying(&|_, _| v))),
                ] {
                    let [before, after] = ends.map(|end| pair.object_from_tip(&end));
                    let measured = differenced(&before, &after, &contact, step);
                    let off = (measured.linear - velocity.linear).norm() * 10.0
                        + (measured.angular - velocity.angular).norm();
                    totals[k] += off;
                    assert!(off < 1e-4, "{off}");
                    n_measured += 1;
                }
                // Equation 12's rates are the differences of the coordinates.
                let [before, after] = in_chart;
                if [before, after]
                    .iter()
                    .all(|end| end.object.axis == state.object.axis && end.tip.axis == state.tip.axis)
                {
                    let [before, after] = [before, after].map(|end| pack(&end, 0.0));
                    let expected = [rates.object.x, rates.object.y, rates.tip.x, rates.tip.y, rates.psi];
                    for (k, expected) in expected.into_iter().enumerate() {
                        let rate = (after[k] - before[k]) / (2.0 * step);
                        assert!((rate - expected).abs() < 1e-3 * (1.0 + speed), "{rate} {expected}");
                    }
                }
            }
        }
    }
    // Central differences: four times nearer at half the step.
    assert!((3.5..4.5).contains(&(totals[0] / totals[1])) && n_measured > 3000, "{totals:?} {n_measured}");
}

#[test]
fn the_error_falls_with_the_fifth_power_of_the_step() {
    let mut rng = Rng::keyed(2, "integration", 0);
    let pair = ContactPair {
        object: ChartedSurface::ellipsoid(Vector::new(0.09, 0.07, 0.12), Pose::identity()).unwrap(),
        tip: ChartedSurface::ellipsoid(Vector::new(0.03, 0.02, 0.04), any_pose(&mut rng)).unwrap(),
    };
    let state = ContactState {
        object: Coordinates { axis: 2, u: 0.3, v: -0.2 },
        tip: Coordinates { axis: 1, u: -0.5, v: 0.1 },
        psi: 0.7,
    };
    let velocity = RelativeVelocity { linear: Vector::new(0.02, -0.01, 0.0), angular: Vector::new(0.8, 0.5, -0.4) };
    for control in [RelativeControl::InChart(velocity), RelativeControl::Transported(velocity)] {
        let axes = [2, 1];
        let mut rate = |time: f64, at: &_| pair.packed_rates(time, at, axes, control);
        let mut end = |n: u32| {
            let length = 2.4 / f64::from(n);
            (0..n).fold(pack(&state, 0.0), |at, _| {
                let slope = rate(0.0, &at).unwrap();
                dormand_prince::step(&mut rate, 0.0, &at, &slope, length).unwrap().0
            })
        };
        let exact = end(512);
        let errors = [16, 32, 64].map(|n| (end(n) - exact).norm());
        for pair in errors.windows(2) {
            assert!((25.0..45.0).contains(&(pair[0] / pair[1])), "{errors:?}");
        }
        assert!(errors[0] > 1e-10, "{errors:?}");
        // Error control keeps its promise, through changes of chart too.
        for tolerance in [1e-5, 1e-7, 1e-9] {
            let found = pair.advance_under(&state, control, 2.4, tolerance).unwrap();
            let off = apart(&pair.object_from_tip(&found.state), &pair.object_from_tip(&unpack(&exact, axes)), 0.1);
            assert!(off <= tolerance, "{off} {tolerance} {}", found.n_steps);
        }
    }
}

/// Paths in transported frames do not depend on charts, and lead back.
#[test]
fn charts_do_not_matter_and_rolling_back_leads_back() {
    let mut rng = Rng::keyed(3, "integration", 0);
    let places = [any_pose(&mut rng), any_pose(&mut rng)];
    // The same ellipsoids with their axes named x, y, z, or y, z, x.
    let renamed = Pose::rotation(Vector::new(1.0, 1.0, 1.0).normalize() * (std::f64::consts::TAU / 3.0));
    let pair_with = |turn: &Pose, radii: [Vector; 2]| ContactPair {
        object: ChartedSurface::ellipsoid(radii[0], places[0] * turn).unwrap(),
        tip: ChartedSurface::ellipsoid(radii[1], places[1] * turn).unwrap(),
    };
    let pair = pair_with(&Pose::identity(), [Vector::new(0.09, 0.07, 0.12), Vector::new(0.03, 0.02, 0.04)]);
    let other = pair_with(&renamed, [Vector::new(0.07, 0.12, 0.09), Vector::new(0.02, 0.04, 0.03)]);
    for _ in 0..20 {
        let (state, velocity) = (any_state(&pair, &mut rng), any_velocity(&mut rng));
        let contact = pair.contact_pose(&state);
        let end = pair.advance_under(&state, RelativeControl::Transported(velocity), 5.0, 1e-10).unwrap();
        let same = other.state_at(&contact, 1e-12, 1e-7).unwrap();
        let x = contact.object_from_contact.inverse() * (other.contact_pose(&same).object_from_contact * Vector::x());
        let again = other.advance(&same, &velocity.in_frame_turned_by(x.y.atan2(x.x)), 5.0, 1e-10).unwrap();
        assert!(apart(&pair.object_from_tip(&end.state), &other.object_from_tip(&again), 0.1) < 1e-8);

        let back = velocity.in_frame_turned_by(-end.turned).scaled(-1.0);
        let start = pair.advance(&end.state, &back, 5.0, 1e-10).unwrap();
        assert!(apart(&pair.object_from_tip(&start), &contact.object_from_tip(), 0.1) < 1e-8);
    }
}

#[test]
fn states_are_found_again_from_poses() {
    let mut rng = Rng::keyed(4, "integration", 0);
    for pair in pairs(&mut rng) {
        for _ in 0..20 {
            let state = any_state(&pair, &mut rng);
            let contact = pair.contact_pose(&state).turned_by(rng.uniform(-3.0, 3.0));
            let found = pair.state_at(&contact, 1e-12, 1e-7).unwrap();
            assert!(apart(&pair.object_from_tip(&found), &contact.object_from_tip(), 0.1) < 1e-12);
            let psi = (found.psi - state.psi).rem_euclid(std::f64::consts::TAU);
            let same = found.object.axis == state.object.axis && found.tip.axis == state.tip.axis;
            assert!(!same || psi.min(std::f64::consts::TAU - psi) < 1e-7);
            let tilted = ContactPose {
                tip_from_contact: contact.tip_from_contact * UnitQuaternion::from_scaled_axis(Vector::x() * 0.01),
                ..contact
            };
            let refused = pair.state_at(&tilted, 1e-9, 1e-6);
            assert!(
                matches!(refused, Err(NoStep::NotTouching { angle, .. }) if (angle - 0.01).abs() < 1e-6),
                "{refused:?}"
            );
        }
    }
}

/// From the pose alone, also where the bodies stand a little apart or overlap.
#[test]
fn nearest_points_are_found_again_from_the_pose_alone() {
    let mut rng = Rng::keyed(7, "integration", 0);
    let mut n_found = 0;
    for pair in pairs(&mut rng) {
        for _ in 0..20 {
            let state = any_state(&pair, &mut rng);
            let gap = rng.uniform(-0.001, 0.003);
            let contact = pair.contact_pose(&state);
            let object_from_tip =
                contact.object_from_contact * Pose::translation(0.0, 0.0, gap) * contact.tip_from_contact.inverse();
            if pair
                .rates(&state, &RelativeVelocity::rolling(1.0, 1.0))
                .is_ok_and(|r| r.object.norm().max(r.tip.norm()) > 3.0)
            {
                // Nearly flat on flat: many points are nearly nearest.
                continue;
            }
            let mut near = state;
            for at in [&mut near.object, &mut near.tip] {
                at.u += rng.uniform(-0.05, 0.05);
                at.v += rng.uniform(-0.05, 0.05);
            }
            let (found, measured) = pair.nearest_points(&object_from_tip, &near).unwrap();
            assert!((measured - gap).abs() < 1e-12, "{measured} {gap}");
            let again = pair.contact_pose(&found);
            let off = again.object_from_contact.translation.vector - contact.object_from_contact.translation.vector;
            assert!(off.norm() < 1e-9, "{off}");
            let back = again.object_from_contact * Pose::translation(0.0, 0.0, gap) * again.tip_from_contact.inverse();
            assert!(apart(&back, &object_from_tip, 0.1) < 1e-9);
            n_found += 1;
        }
    }
    assert!(n_found > 300, "{n_found}");
}

/// A ball is nearest where its centre is.
#[test]
fn nearest_points_of_balls_are_those_of_surfaces() {
    let mut rng = Rng::keyed(8, "integration", 0);
    let radii = Vector::new(0.09, 0.07, 0.12);
    let surface = Surface::of(&Shape::Ellipsoid { radii }).unwrap();
    let pair = ContactPair {
        object: ChartedSurface::ellipsoid(radii, Pose::identity()).unwrap(),
        tip: ChartedSurface::sphere(0.02, Pose::identity()).unwrap(),
    };
    for _ in 0..200 {
        let center = Point::from(Vector::from(rng.direction()) * rng.uniform(0.13, 0.2));
        let object_from_tip = Pose::translation(center.x, center.y, center.z) * any_pose(&mut rng).rotation;
        let near = ContactState {
            object: pair.object.coordinates(&center),
            tip: pair.tip.coordinates(&object_from_tip.inverse_transform_point(&Point::origin())),
            psi: 0.0,
        };
        let (found, gap) = pair.nearest_points(&object_from_tip, &near).unwrap();
        let (foot, distance) = surface.project_signed(&center);
        assert!((gap - distance + 0.02).abs() < 1e-10);
        assert!((pair.object.point(&found.object) - foot.point_in_object).norm() < 1e-9);
    }
}

#[test]
fn what_cannot_move_is_refused_by_name() {
    let mut rng = Rng::keyed(5, "integration", 0);
    let plane = ChartedSurface::plane(any_pose(&mut rng));
    let cylinder = ChartedSurface::cylinder(0.02, any_pose(&mut rng)).unwrap();
    let boxy = ChartedSurface::superellipsoid(Vector::repeat(0.02), 4.0, 4.0, Pose::identity()).unwrap();
    let rolling = RelativeVelocity::rolling(0.3, 0.2);
    for (object, tip) in [(plane, plane), (plane, cylinder), (cylinder, plane)] {
        let pair = ContactPair { object, tip };
        let state = any_state(&pair, &mut rng);
        for velocity in [rolling, RelativeVelocity::sliding(0.1, 0.0), RelativeVelocity::twisting(0.1)] {
            let refused = pair.advance(&state, &velocity, 1.0, 1e-9);
            assert!(matches!(refused, Err(NoStep::SingularCurvature { .. })), "{refused:?}");
        }
    }
    // A superellipsoid is flat where an axis leaves it.
    let pair = ContactPair { object: plane, tip: boxy };
    let mut state = any_state(&pair, &mut rng);
    state.tip = boxy.coordinates(&Point::new(0.0, 0.0, 0.02));
    assert!(matches!(pair.rates(&state, &rolling), Err(NoStep::SingularCurvature { .. })));
    // Crossed cylinders touch in a point, parallel ones in a line.
    let pair = ContactPair { object: cylinder, tip: cylinder };
    let mut state = ContactState {
        object: any_coordinates(&cylinder, &mut rng),
        tip: any_coordinates(&cylinder, &mut rng),
        psi: 0.7,
    };
    assert!(pair.rates(&state, &rolling).is_ok());
    state.psi = 0.0;
    assert!(matches!(pair.rates(&state, &rolling), Err(NoStep::SingularCurvature { .. })));

    let ball = ContactPair { object: plane, tip: ChartedSurface::sphere(0.02, Pose::identity()).unwrap() };
    let state = any_state(&ball, &mut rng);
    let opening = RelativeVelocity { linear: Vector::new(0.0, 0.0, -0.01), angular: Vector::zeros() };
    assert_eq!(ball.advance(&state, &opening, 1.0, 1e-9), Err(NoStep::NotKept { speed: -0.01 }));
    for (duration, tolerance, x) in [(-1.0, 1e-9, 0.1), (f64::NAN, 1e-9, 0.1), (1.0, 0.0, 0.1), (1.0, 1e-9, f64::NAN)] {
        let refused = ball.advance(&state, &RelativeVelocity::rolling(x, 0.1), duration, tolerance);
        assert!(matches!(refused, Err(NoStep::Request { .. })), "{refused:?}");
    }
    assert_eq!(ball.advance(&state, &rolling, 0.0, 1e-9), Ok(state));
}

/// What the midpoint rules leave of an exact rolling step falls with its third power.
#[test]
fn midpoint_rules_agree_to_their_order() {
    let mut rng = Rng::keyed(6, "integration", 0);
    let (object_radii, tip_radii) = (Vector::new(0.03, 0.02, 0.04), Vector::new(0.009, 0.007, 0.006));
    let tip_pose = Pose::rotation(Vector::new(0.4, 0.2, -0.7));
    let object = ChartedSurface::ellipsoid(object_radii, Pose::identity()).unwrap();
    let (ball, ellipsoid) = (
        ContactPair { object, tip: ChartedSurface::sphere(0.006, Pose::identity()).unwrap() },
        ContactPair { object, tip: ChartedSurface::ellipsoid(tip_radii, tip_pose).unwrap() },
    );
    let tip = TipEllipsoid::new(tip_radii, tip_pose.rotation);
    let normal = |contact: &ContactPose| contact.object_from_contact * Vector::z();
    for _ in 0..10 {
        let velocity = RelativeVelocity { linear: Vector::zeros(), angular: Vector::from(rng.direction()) };
        let slips = |pair: &ContactPair, state: &ContactState, step: f64| {
            let end = pair.advance(state, &velocity, step, 1e-13).unwrap();
            let [from, to] = [state, &end].map(|s| pair.contact_pose(s));
            let [object_from_tip_0, object_from_tip_1] = [from, to].map(|c| c.object_from_tip());
            let matrix = |pose: &Pose| *pose.rotation.to_rotation_matrix().matrix();
            if *pair == ball {
                let [a, b] = [from, to]
                    .map(|c| rolling::Ball { center: c.object_from_tip() * Point::origin(), normal: normal(&c) });
                let turn = rolling::turn_between(&matrix(&object_from_tip_0), &matrix(&object_from_tip_1));
                return rolling::slip(0.006, &a, &b, &turn).norm();
            }
            let [a, b] = [from, to].map(|c| rolling_ellipsoid::Stance {
                center: c.object_from_tip() * Point::origin(),
                object_from_link: matrix(&c.object_from_tip()),
                normal: normal(&c),
            });
            rolling_ellipsoid::slip(&tip, &a, &b).norm()
        };
        for pair in [ball, ellipsoid] {
            let state = any_state(&pair, &mut rng);
            let [coarse, fine, finest] = [0.2, 0.1, 0.05].map(|step| slips(&pair, &state, step));
            assert!(coarse < 1e-4 && fine < 0.16 * coarse && finest < 0.14 * fine + 1e-12, "{coarse} {fine} {finest}");
        }
    }
}
