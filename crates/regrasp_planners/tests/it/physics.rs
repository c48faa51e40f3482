//! Forces, torques, times and velocities of plans, substituted into what they have to satisfy.

use crate::in_hand_methods::scene;
use crate::places::shared_models;
use crate::queries::Queries;
use crate::soft_and_coupled;
use nalgebra::{DMatrix, UnitQuaternion};
use regrasp_base::{Budget, Rng};
use regrasp_geometry::{Point, Pose, UnitVector, Vector, frame};
use regrasp_grasp::{Contact, ContactForce, ContactModel, Grip};
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Level};
use regrasp_plan::plan::{SegmentKind, Waypoint};
use regrasp_planners::Failure;
use regrasp_planners::FailureKind;
use regrasp_planners::in_hand::PhysicsSettings;
use regrasp_planners::in_hand::placing::place;
use regrasp_planners::in_hand::{ForceSettings, InHandSettings, plan_in_hand};
use regrasp_scene::{Gravity, Limits, LoadedScene, Scene};

const SCENES: [&str; 4] = ["sphere_90x.toml", "box_90x.toml", "soft_pair_roll.toml", "shadow/sphere32_z.toml"];

fn settings() -> InHandSettings {
    InHandSettings {
        physics: PhysicsSettings {
            friction_margin: 1.5,
            forces: Some(ForceSettings::default()),
            ..PhysicsSettings::default()
        },
        ..InHandSettings::default()
    }
}

fn plan_with(loaded: &LoadedScene, settings: &InHandSettings, seed: u64) -> Result<Plan, Failure> {
    let (query, budget) = (loaded.in_hand(seed), Budget::work(3_000_000));
    let plan = plan_in_hand(&loaded.view(), &query, settings, seed, &budget, &|_| {})?;
    let report = loaded.judge(&query, &plan, &CheckSettings::default());
    assert!(report.accepted(), "seed {seed}: {report:#?}");
    Ok(plan)
}

/// Calls `ask` with plans of the bundled scenes.
fn for_plans(mut ask: impl FnMut(&str, &LoadedScene, &Plan)) {
    let models = shared_models();
    for name in SCENES {
        let loaded = match &models {
            Some(models) => soft_and_coupled::scene(name, models),
            None if name.contains('/') => continue,
            None => scene(name),
        };
        // Of two soft fingertips that must not turn about the normals some seeds find no plan.
        let plans = (0..4).filter_map(|seed| plan_with(&loaded, &settings(), seed).ok());
        assert!(plans.take(3).map(|plan| ask(name, &loaded, &plan)).count() == 3, "{name}: too few plans");
    }
}

fn holds(plan: &Plan, segment: usize, waypoint: &Waypoint, finger: usize) -> bool {
    let moves = plan.segments[segment].moving_finger.as_ref() == Some(&plan.fingers[finger]);
    waypoint.contacts[finger].holds() && !moves
}

fn exerted(waypoint: &Waypoint, finger: usize) -> ContactForce {
    let state = &waypoint.contacts[finger];
    let force = Vector::from(state.force_in_object.expect("a finger that holds has a force"));
    ContactForce { force, torsion: state.torsion.unwrap_or(0.0) }
}

#[test]
fn forces_balance_the_weight_inside_all_limits() {
    for_plans(|name, loaded, plan| {
        let promised = plan.promises.forces.as_ref().expect("forces were asked for");
        let object = &loaded.scene.objects[0];
        assert_eq!((promised.mass, promised.gravity_in_world), (object.mass, Some([0.0, 0.0, -9.80665])), "{name}");
        for (s, segment) in plan.segments.iter().enumerate() {
            for waypoint in &segment.waypoints {
                let world_from_object = Pose::from(&waypoint.world_from_object);
                let down = Vector::new(0.0, 0.0, -9.80665) * object.mass;
                let (mut force, mut torque) = (world_from_object.rotation.inverse() * down, Vector::zeros());
                for finger in 0..plan.fingers.len() {
                    let state = &waypoint.contacts[finger];
                    let model = loaded.scene.hands[0].hand.fingers[finger].tip.contact;
                    assert_eq!(state.holds(), state.force_in_object.is_some());
                    let is_soft = matches!(model, ContactModel::SoftFinger { .. });
                    assert_eq!(state.torsion.is_some(), state.holds() && is_soft, "{name}");
                    if !state.holds() {
                        continue;
                    }
                    let given = exerted(waypoint, finger);
                    if !holds(plan, s, waypoint, finger) {
                        assert_eq!((given.force, given.torsion), (Vector::zeros(), 0.0), "{name}: lifts or lands");
                        continue;
                    }
                    let normal = Vector::from(state.normal_in_object.unwrap());
                    let point = Point::from(state.point_in_object.unwrap());
                    force += given.force;
                    torque += (point - object.center_of_mass).cross(&given.force) + normal * given.torsion;
                    let contact =
                        Contact { point_in_object: point, normal_in_object: UnitVector::new_normalize(normal) };
                    let grip = Grip { contact, model };
                    let parts = grip.components(&given, plan.promises.friction);
                    assert!(grip.depth(&parts, plan.promises.friction) > 0.0, "{name}: {parts:?}");
                    assert!(parts.normal > 2.0 && parts.normal < 15.0, "{name}: {parts:?}");
                }
                assert!(force.norm() < 1e-10 && torque.norm() < 1e-11, "{name}: {force} {torque}");
                for (torque, limit) in waypoint.joint_torques.iter().zip(&promised.joint_torques) {
                    assert!(limit.is_none_or(|limit| torque.abs() < limit), "{name}: {torque}");
                }
            }
        }
    });
}

/// The work of a joint's torque is that of its finger's force, at whatever the joint moves: finite differences of the
/// point and the direction of the tip that touch.
#[test]
fn joint_torques_do_the_work_of_the_forces() {
    for_plans(|name, loaded, plan| {
        for (s, segment) in plan.segments.iter().enumerate() {
            for waypoint in segment.waypoints.iter().step_by(5) {
                let world_from_object = Pose::from(&waypoint.world_from_object);
                let mut first = 0;
                for (index, finger) in loaded.scene.hands[0].hand.fingers.iter().enumerate() {
                    let n_joints = finger.chain.n_coordinates();
                    let joints = &waypoint.joints[first..first + n_joints];
                    let torques = &waypoint.joint_torques[first..first + n_joints];
                    first += n_joints;
                    if !holds(plan, s, waypoint, index) {
                        assert!(torques.iter().all(|&torque| torque == 0.0));
                        continue;
                    }
                    let given = exerted(waypoint, index);
                    let force = world_from_object.rotation * given.force;
                    let normal =
                        world_from_object.rotation * Vector::from(waypoint.contacts[index].normal_in_object.unwrap());
                    let tip_at = |joints: &[f64]| {
                        let mut bodies = Vec::new();
                        finger.chain.forward(joints, &mut bodies);
                        *bodies.last().expect("a finger has joints")
                    };
                    let here = tip_at(joints);
                    let touching = here * finger.tip.center_in_body - normal * finger.tip.radius();
                    let touching_in_body = here.inverse_transform_point(&touching);
                    for (j, torque) in torques.iter().enumerate() {
                        let step = 1e-6;
                        let at = |sign: f64| {
                            let mut moved = joints.to_vec();
                            moved[j] += sign * step;
                            tip_at(&moved)
                        };
                        let (low, high) = (at(-1.0), at(1.0));
                        let way = high * touching_in_body - low * touching_in_body;
                        let turn = UnitQuaternion::scaled_axis(&(high.rotation * low.rotation.inverse()));
                        let work = (force.dot(&way) + given.torsion * normal.dot(&turn)) / (2.0 * step);
                        assert!((work - torque).abs() < 1e-6, "{name}, joint {j} of {}: {work} {torque}", finger.name);
                    }
                }
            }
        }
    });
}

/// Largest distance that a point of the ball about the centre of mass goes, by sampling it.
fn object_way(scene: &Scene, from: &Waypoint, to: &Waypoint) -> f64 {
    let (from, to) = (Pose::from(&from.world_from_object), Pose::from(&to.world_from_object));
    let turn = frame::rotation_between(&from, &to);
    let across = if turn.norm() > 0.0 { turn.cross(&Vector::new(0.3, 0.5, 0.7)).normalize() } else { Vector::x() };
    [across, turn.cross(&across).normalize(), -across]
        .iter()
        .filter(|direction| direction.norm() > 0.5)
        .map(|direction| {
            let point = scene.objects[0].center_of_mass + from.rotation.inverse() * direction * scene.objects[0].radius;
            (to * point - from * point).norm()
        })
        .fold(0.0, f64::max)
}

/// Joint `j` a share `u` of the time between two waypoints: the cubic by de Casteljau.
fn cubic(from: &Waypoint, to: &Waypoint, j: usize, u: f64) -> f64 {
    let third = (to.time - from.time) / 3.0;
    let [a, d] = [from.joints[j], to.joints[j]];
    let mut points = [a, a + third * from.joint_velocities[j], d - third * to.joint_velocities[j], d];
    for n in (1..4).rev() {
        for i in 0..n {
            points[i] += u * (points[i + 1] - points[i]);
        }
    }
    points[0]
}

/// How far the joints have come along their chord, as a share of it, and how fast they go on.
fn progress(from: &Waypoint, to: &Waypoint, u: f64) -> (f64, f64) {
    let square: f64 = from.joints.iter().zip(&to.joints).map(|(a, b)| (b - a) * (b - a)).sum();
    if square < 1e-18 {
        return (u, 1.0);
    }
    let along = |u: f64| -> f64 {
        let n = from.joints.len();
        (0..n).map(|j| (to.joints[j] - from.joints[j]) * (cubic(from, to, j, u) - from.joints[j])).sum::<f64>() / square
    };
    (along(u), (along(u + 1e-6) - along(u - 1e-6)) / 2e-6)
}

/// Tips are nowhere faster than allowed, and never far from where they were on the chord, which the search has looked at. The
/// largest speed.
fn check_tips(loaded: &LoadedScene, from: &Waypoint, to: &Waypoint, largest: f64, name: &str) -> f64 {
    let (span, mut first, mut fastest) = (to.time - from.time, 0, 0.0f64);
    for finger in &loaded.scene.hands[0].hand.fingers {
        let range = first..first + finger.chain.n_coordinates();
        first = range.end;
        let tip = |u: f64| finger.ik.tip(&range.clone().map(|j| cubic(from, to, j, u)).collect::<Vec<_>>());
        for k in 0..=32 {
            let u = f64::from(k) / 32.0;
            let speed = (tip(u + 1e-6) - tip(u - 1e-6)).norm() / (2e-6 * span);
            assert!(speed <= largest * (1.0 + 1e-6), "{name}: {speed} m/s");
            fastest = fastest.max(speed);
            let (sigma, _) = progress(from, to, u);
            let chord: Vec<f64> =
                range.clone().map(|j| from.joints[j] + sigma * (to.joints[j] - from.joints[j])).collect();
            let stray = (tip(u) - finger.ik.tip(&chord)).norm();
            assert!(stray < 0.2e-3, "{name}: {stray} m off the chord");
        }
    }
    fastest
}

#[test]
fn plans_rest_between_segments_and_keep_to_their_limits() {
    for_plans(|name, loaded, plan| {
        let limits = &plan.promises.motion;
        let speed = settings().physics.speed;
        assert_eq!(plan.segments[0].waypoints[0].time, 0.0);
        let mut fastest: f64 = 0.0;
        for (s, segment) in plan.segments.iter().enumerate() {
            let (first, last) = (&segment.waypoints[0], segment.waypoints.last().unwrap());
            for end in [first, last] {
                assert!(end.joint_velocities.iter().all(|&velocity| velocity == 0.0), "{name}: not at rest");
            }
            if let Some(before) = s.checked_sub(1).map(|before| &plan.segments[before]) {
                let ended = before.waypoints.last().unwrap();
                let are_transfers = [before.kind, segment.kind].iter().all(|kind| *kind == SegmentKind::Transfer);
                let ramp = if are_transfers { 0.0 } else { speed.ramp };
                assert!((first.time - ended.time - ramp).abs() < 1e-9, "{name}");
            }
            for pair in segment.waypoints.windows(2) {
                let (from, to) = (&pair[0], &pair[1]);
                let span = to.time - from.time;
                assert!(span >= 0.999e-3, "{name}: {span}");
                fastest = fastest.max(check_tips(loaded, from, to, limits.largest_speed, name));
                let slopes = [0.0, 1.0].map(|u| progress(from, to, u).1);
                assert!(slopes.iter().all(|slope| (-1e-9..=3.0 + 1e-9).contains(slope)), "{name}: {slopes:?}");
                let speed = (0..=16).map(|k| progress(from, to, f64::from(k) / 16.0).1).fold(0.0, f64::max);
                let object = object_way(&loaded.scene, from, to) * speed / span;
                assert!(object <= limits.largest_speed * (1.0 + 1e-9), "{name}: {object} m/s");
                fastest = fastest.max(object);
                for j in 0..plan.joint_names.len() {
                    for k in 0..=16 {
                        let u = f64::from(k) / 16.0;
                        let around = |h: f64| [u - h, u, u + h].map(|u| cubic(from, to, j, u));
                        let (short, [before, _, after]) = (1e-4, around(1e-4));
                        let velocity = (after - before) / (2.0 * short * span);
                        // Second differences of a cubic are exact however long; short ones are lost in rounding where steps take a millisecond.
                        let (long, [before, now, after]) = (1e-2, around(1e-2));
                        let acceleration = (after - 2.0 * now + before) / (long * long * span * span);
                        assert!(velocity.abs() <= limits.joint_velocities[j] * (1.0 + 1e-6), "{name}: {velocity}");
                        let most = limits.joint_accelerations[j] * (1.0 + 1e-4);
                        assert!(acceleration.abs() <= most, "{name}, segment {s}: {acceleration}");
                    }
                }
            }
        }
        // Slow by intention, not for want of anything.
        assert!(fastest > 0.5 * limits.largest_speed, "{name}: {fastest} m/s at most");
    });
}

/// Forces of plans for any direction balance nothing; with what the least-norm inverse of the grasp map adds they balance
/// the weight in each of many directions, inside all limits: the inverse is that of a singular value decomposition.
#[test]
fn plans_for_any_direction_hold_in_each() {
    let mut rng = Rng::keyed(1, "directions", 0);
    for name in ["sphere_90x.toml", "box_90x.toml"] {
        let loaded = scene(name);
        let loaded = LoadedScene { scene: loaded.scene.under_gravity(Gravity::Any), ..loaded };
        let plan = plan_with(&loaded, &settings(), 0).unwrap_or_else(|failure| panic!("{name}: {failure}"));
        assert_eq!(plan.promises.forces.as_ref().expect("forces were asked for").gravity_in_world, None);
        let object = &loaded.scene.objects[0];
        for (s, segment) in plan.segments.iter().enumerate() {
            for waypoint in segment.waypoints.iter().step_by(4) {
                let holding: Vec<usize> = (0..plan.fingers.len()).filter(|&f| holds(&plan, s, waypoint, f)).collect();
                let at = |finger: usize| {
                    let state = &waypoint.contacts[finger];
                    let normal = Vector::from(state.normal_in_object.unwrap());
                    (Point::from(state.point_in_object.unwrap()) - object.center_of_mass, normal)
                };
                let mut map = DMatrix::zeros(6, 3 * holding.len());
                let mut sum = Vector::zeros();
                for (index, &finger) in holding.iter().enumerate() {
                    let arm = at(finger).0;
                    sum += exerted(waypoint, finger).force;
                    for axis in 0..3 {
                        let force = Vector::ith(axis, 1.0);
                        let column = 3 * index + axis;
                        map.fixed_view_mut::<3, 1>(0, column).copy_from(&force);
                        map.fixed_view_mut::<3, 1>(3, column).copy_from(&(arm.cross(&force) / object.radius));
                    }
                }
                assert!(sum.norm() < 1e-10, "{name}: {sum}");
                let inverse = map.pseudo_inverse(1e-9).expect("the grasp is closed");
                for _ in 0..20 {
                    let load = Vector::from(rng.direction()) * (object.mass * 9.80665);
                    let more = inverse.columns(0, 3) * -load;
                    for (index, &finger) in holding.iter().enumerate() {
                        let force = exerted(waypoint, finger).force
                            + Vector::new(more[3 * index], more[3 * index + 1], more[3 * index + 2]);
                        let normal = at(finger).1;
                        let pressing = -force.dot(&normal);
                        let across = (force + normal * pressing).norm();
                        assert!(pressing > 2.0 && pressing < 15.0, "{name}: {pressing}");
                        assert!(across < plan.promises.friction * pressing, "{name}: {across} {pressing}");
                    }
                }
            }
        }
    }
}

fn changed(name: &str, change: impl FnOnce(&mut Scene)) -> LoadedScene {
    let mut loaded = scene(name);
    change(&mut loaded.scene);
    loaded
}

#[test]
fn without_forces_there_is_no_plan_and_the_cause_is_named() {
    let budget = Budget::work(60_000);
    let fails = |loaded: &LoadedScene, settings: &InHandSettings| {
        let failure = plan_in_hand(&loaded.view(), &loaded.in_hand(0), settings, 0, &budget, &|_| {});
        let failure = failure.expect_err("nothing balances it");
        let causes: Vec<&str> = failure.causes.iter().map(|cause| cause.reason.as_str()).collect();
        (causes.join("\n"), failure.advice)
    };
    // Four fingertips at 15 N and friction 0.8 over 1.5 hold 68 N together, and no grasp has them all pull upwards.
    let (causes, _) = fails(&changed("sphere_90x.toml", |scene| scene.objects[0].mass = 6.9), &settings());
    assert!(causes.contains("no contact forces balance the weight: "), "{causes}");
    let strong = ForceSettings { normal_force: [2.0, 500.0], ..ForceSettings::default() };
    let (causes, _) = fails(
        &changed("sphere_90x.toml", |scene| {
            scene.objects[0].mass = 20.0;
            scene.limits.normal_force = 500.0;
        }),
        &InHandSettings { physics: PhysicsSettings { forces: Some(strong), ..settings().physics }, ..settings() },
    );
    assert!(causes.contains(" would need more than 1 N m"), "{causes}");
    let weak = ForceSettings { torque_share: 0.1, ..ForceSettings::default() };
    let (causes, advice) = fails(
        &scene("sphere_90x.toml"),
        &InHandSettings { physics: PhysicsSettings { forces: Some(weak), ..settings().physics }, ..settings() },
    );
    assert!(causes.contains("balance the weight: joint \"") && causes.contains(" would need more than 0.1 N m"));
    assert!(advice.contains("stronger motors: no contact forces balance the weight: joint \""), "{advice}");
    // The same without asking about forces.
    let heavy = changed("sphere_90x.toml", |scene| scene.objects[0].mass = 20.0);
    let plain = InHandSettings { physics: PhysicsSettings { forces: None, ..settings().physics }, ..settings() };
    let query = heavy.in_hand(0);
    let plan = plan_in_hand(&heavy.view(), &query, &plain, 0, &budget, &|_| {}).expect("geometry knows no weight");
    let report = heavy.judge(&query, &plan, &CheckSettings::default());
    assert_eq!(report.reached, Some(Level::Geometry), "{report:#?}");
    assert!(plan.promises.forces.is_none());
    let waypoints = || plan.segments.iter().flat_map(|segment| &segment.waypoints);
    assert!(waypoints().all(|w| w.joint_torques.is_empty() && w.contacts.iter().all(|c| c.force_in_object.is_none())));
}

#[test]
fn an_object_heavier_than_all_fingertips_hold_is_refused_before_the_search() {
    let heavy = changed("sphere_90x.toml", |scene| scene.objects[0].mass = 7.0);
    let query = heavy.in_hand(0);
    let planned = plan_in_hand(&heavy.view(), &query, &settings(), 0, &Budget::unlimited(), &|_| {});
    let failure = planned.expect_err("4 x 15 N x sqrt(1 + (0.8 / 1.5)^2) is 68 N");
    assert_eq!((failure.kind, failure.statistics.work), (FailureKind::Impossible, 0), "{failure:?}");
    assert!(failure.message.contains("weighs 69 N (7 kg)") && failure.message.contains("at most 68 N"), "{failure:?}");
    assert!(failure.advice.contains("6.93 at most"), "{failure:?}");
    let placed = place(&heavy.view(), &[query.held()], &settings(), (0, 1), &Budget::unlimited(), &|_| {});
    assert_eq!(placed.expect_err("nor can it be held elsewhere").message, failure.message);
}

#[test]
fn gravity_is_the_scenes_or_the_worlds_down() {
    let of = |loaded: &LoadedScene| {
        let plan = plan_with(loaded, &settings(), 0).expect("a sphere is held from any side");
        Vector::from(plan.promises.forces.and_then(|forces| forces.gravity_in_world).expect("a direction"))
    };
    assert!((of(&scene("sphere_90x.toml")) - Vector::new(0.0, 0.0, -9.80665)).norm() < 1e-12);
    let sideways = changed("sphere_90x.toml", |scene| scene.gravity = Some(Gravity::Direction(Vector::x_axis())));
    assert!((of(&sideways) - Vector::new(9.80665, 0.0, 0.0)).norm() < 1e-12);
}

/// Settings ask for more than the scene allows: the plan keeps to the scene.
#[test]
fn plans_keep_to_the_limits_of_the_scene() {
    let tight = Limits { largest_speed: 0.02, joint_acceleration: 5.0, normal_force: 6.0, ..Limits::default() };
    let loaded = changed("sphere_90x.toml", |scene| scene.limits = tight);
    let plan = plan_with(&loaded, &settings(), 0).expect("a slow plan");
    assert_eq!(plan.promises.motion.largest_speed, 0.02);
    assert!(plan.promises.motion.joint_accelerations.iter().all(|limit| *limit == 5.0));
    assert_eq!(plan.promises.forces.expect("forces").normal_force, [2.0, 6.0]);
}
