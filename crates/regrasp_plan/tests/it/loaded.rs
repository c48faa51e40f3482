//! Times, forces and torques for hand-made plans, by other formulas than the checker's: internal forces towards the centroid
//! of the contacts, the shortest forces and torsions that carry the weight on top, and torques by finite differences of
//! virtual work.

use crate::sample::{self, TIP_RADIUS, judge, kinds};
use nalgebra::{DMatrix, DVector};
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_plan::check::ViolationKind;
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::plan::{ForcePromises, SegmentKind};
use regrasp_plan::{Plan, Segment, Waypoint};
use regrasp_robot::ContactModel;
use regrasp_scene::{Gravity, Scene};

const GRAVITY_IN_WORLD: [f64; 3] = [0.0, 0.0, -9.80665];
/// Internal force per distance of a contact from the centroid of all, in newtons per metre.
const SQUEEZE: f64 = 110.0;
/// Pause between two segments, in seconds.
const PAUSE: f64 = 0.25;

/// The rolling sample with times and forces.
pub fn plan(scene: &Scene) -> Plan {
    load(crate::rolled::plan(scene, 10), scene)
}

/// Gives `plan` times, velocities, forces and torques.
pub fn load(mut plan: Plan, scene: &Scene) -> Plan {
    let mut now = 0.0;
    for segment in &mut plan.segments {
        now = assign_times(segment, now) + PAUSE;
        let moving = segment.moving_finger.as_ref().map(|name| name[1..].parse::<usize>().unwrap());
        for waypoint in &mut segment.waypoints {
            add_forces(waypoint, moving.filter(|_| segment.kind == SegmentKind::Regrasp), scene);
            add_torques(waypoint);
        }
    }
    plan.promises.forces = Some(ForcePromises {
        mass: scene.objects[0].mass,
        gravity_in_world: Some(GRAVITY_IN_WORLD),
        normal_force: [1.0, 8.0],
        joint_torques: vec![Some(0.9); plan.joint_names.len()],
    });
    plan
}

/// Times by the tips' ways at 20 mm/s; velocities by the harmonic mean where a joint goes on the same way. The end.
fn assign_times(segment: &mut Segment, start: f64) -> f64 {
    let waypoints = &mut segment.waypoints;
    waypoints[0].time = start;
    for w in 1..waypoints.len() {
        let way =
            (0..sample::N_FINGERS).map(|f| (tip_center(f, &waypoints[w]) - tip_center(f, &waypoints[w - 1])).norm());
        waypoints[w].time = waypoints[w - 1].time + (way.fold(0.0, f64::max) / 0.02).max(0.1);
    }
    for w in 1..waypoints.len() - 1 {
        let mean = |a: &Waypoint, b: &Waypoint, k: usize| (b.joints[k] - a.joints[k]) / (b.time - a.time);
        for k in 0..waypoints[w].joints.len() {
            let before = mean(&waypoints[w - 1], &waypoints[w], k);
            let after = mean(&waypoints[w], &waypoints[w + 1], k);
            let agree = before * after > 0.0;
            waypoints[w].joint_velocities[k] = if agree { 2.0 * before * after / (before + after) } else { 0.0 };
        }
    }
    waypoints.last().unwrap().time
}

fn joints_of(f: usize, waypoint: &Waypoint) -> [f64; 3] {
    [0, 1, 2].map(|k| waypoint.joints[3 * f + k])
}

fn tip_center(f: usize, waypoint: &Waypoint) -> Point {
    sample::hand_from_tip(f, &joints_of(f, waypoint)) * Point::origin()
}

fn add_forces(waypoint: &mut Waypoint, moving: Option<usize>, scene: &Scene) {
    for contact in waypoint.contacts.iter_mut().filter(|contact| contact.holds()) {
        contact.force_in_object = Some([0.0; 3]);
    }
    let held = |&f: &usize| Some(f) != moving && waypoint.contacts[f].holds();
    let holding: Vec<usize> = (0..sample::N_FINGERS).filter(held).collect();
    let points: Vec<Vector> =
        holding.iter().map(|&f| Vector::from(waypoint.contacts[f].point_in_object.unwrap())).collect();
    let centroid = points.iter().sum::<Vector>() / points.len() as f64;
    for (f, point) in holding.into_iter().zip(points) {
        waypoint.contacts[f].force_in_object = Some(((centroid - point) * SQUEEZE).into());
    }
    carry(waypoint, moving, scene, &(Vector::from(GRAVITY_IN_WORLD) * scene.objects[0].mass));
}

/// Adds the shortest forces and torsions that balance `weight`, which is in the world.
fn carry(waypoint: &mut Waypoint, moving: Option<usize>, scene: &Scene, weight: &Vector) {
    let pose = Pose::from(&waypoint.world_from_object);
    let weight = pose.rotation.inverse() * weight;
    let holding: Vec<usize> =
        (0..sample::N_FINGERS).filter(|&f| Some(f) != moving && waypoint.contacts[f].holds()).collect();
    let contacts: Vec<_> = holding.iter().map(|&f| contact_of(&waypoint.contacts[f]).unwrap()).collect();
    let torsion_radius = |f: usize| match scene.hands[0].hand.fingers[f].tip.contact {
        ContactModel::SoftFinger { torsion_radius } => torsion_radius,
        _ => 0.0,
    };
    // Columns: three of force for each contact, and one of torsion over torsion radius.
    let mut map = DMatrix::<f64>::zeros(6, 4 * contacts.len());
    for (i, (&f, contact)) in holding.iter().zip(&contacts).enumerate() {
        let arm = contact.point_in_object - scene.objects[0].center_of_mass;
        map.view_mut((0, 4 * i), (3, 3)).fill_with_identity();
        map.view_mut((3, 4 * i), (3, 3)).copy_from(&arm.cross_matrix());
        map.view_mut((3, 4 * i + 3), (3, 1)).copy_from(&(contact.normal_in_object.into_inner() * torsion_radius(f)));
    }
    let mut load = DVector::zeros(6);
    load.rows_mut(0, 3).copy_from(&-weight);
    // The centre of mass is the origin, and the weight has no moment about it.
    let carrying = map.svd(true, true).solve(&load, 1e-12).unwrap();
    for (i, &f) in holding.iter().enumerate() {
        let state = &mut waypoint.contacts[f];
        let force = Vector::from(state.force_in_object.unwrap()) + carrying.fixed_rows::<3>(4 * i);
        state.force_in_object = Some(force.into());
        if torsion_radius(f) > 0.0 {
            state.torsion = Some(carrying[4 * i + 3] * torsion_radius(f));
        }
    }
}

/// Work of force and torsion when a joint turns a little either way, over twice the angle.
fn add_torques(waypoint: &mut Waypoint) {
    const TURN: f64 = 1e-5;
    let hand_from_object = sample::world_from_hand().inverse() * Pose::from(&waypoint.world_from_object);
    waypoint.joint_torques = vec![0.0; waypoint.joints.len()];
    for f in 0..sample::N_FINGERS {
        let Some(contact) = contact_of(&waypoint.contacts[f]) else { continue };
        let force = hand_from_object * Vector::from(waypoint.contacts[f].force_in_object.unwrap());
        let couple =
            hand_from_object * contact.normal_in_object.into_inner() * waypoint.contacts[f].torsion.unwrap_or(0.0);
        let joints = joints_of(f, waypoint);
        let touching = sample::hand_from_tip(f, &joints).inverse() * hand_from_object * contact.point_in_object;
        for k in 0..3 {
            let turned = |by: f64| {
                let mut joints = joints;
                joints[k] += by;
                sample::hand_from_tip(f, &joints)
            };
            let (before, after) = (turned(-TURN), turned(TURN));
            let turn = (after.rotation * before.rotation.inverse()).scaled_axis();
            let work = force.dot(&(after * touching - before * touching)) + couple.dot(&turn);
            waypoint.joint_torques[3 * f + k] = work / (2.0 * TURN);
        }
    }
}

#[test]
fn plans_with_forces_and_times_are_accepted() {
    let (scene, soft) = (sample::scene(), sample::soft_scene());
    let plans = [
        (&scene, plan(&scene)),
        (&soft, plan(&soft)),
        (&scene, load(sample::plan_with_way(&scene), &scene)),
        (&scene, load(sample::plan_with_free_finger(&scene), &scene)),
        (&soft, load(sample::plan_with_two_away(&soft), &soft)),
    ];
    for (scene, plan) in &plans {
        let report = judge(scene, plan);
        assert!(report.accepted(), "{report:#?}");
        let residuals = (report.max_force_residual.unwrap(), report.max_moment_residual.unwrap());
        assert!(residuals.0 < 1e-11 && residuals.1 < 1e-11, "{residuals:?}");
        assert!(report.max_half_way_imbalance.unwrap() < 2e-3, "{report:?}");
        assert!(report.duration > 4.0, "{}", report.duration);
    }
}

#[test]
fn what_is_balanced_at_waypoints_far_apart_is_not_in_between() {
    let scene = sample::scene();
    let far = load(crate::rolled::plan(&scene, 10), &scene);
    let near = load(crate::rolled::plan(&scene, 20), &scene);
    let half_way = |plan: &Plan| judge(&scene, plan).max_half_way_imbalance.unwrap();
    // By the square of the step: the weight turns, and contacts go round.
    assert!(((half_way(&far) / half_way(&near)).log2() - 2.0).abs() < 0.2);
}

/// Forces that balance nothing, for gravity of any direction.
pub fn any_gravity_plan(scene: &Scene) -> Plan {
    let mut weightless = scene.clone();
    weightless.objects[0].mass = 0.0;
    let mut plan = load(crate::rolled::plan(scene, 10), &weightless);
    let forces = plan.promises.forces.as_mut().unwrap();
    (forces.mass, forces.gravity_in_world) = (scene.objects[0].mass, None);
    forces.normal_force = [0.5, 8.0];
    plan
}

#[test]
fn room_for_every_direction_is_room_for_each() {
    let mut rng = regrasp_base::Rng::keyed(1, "directions", 0);
    for scene in [sample::scene(), sample::soft_scene()] {
        let mut plan = any_gravity_plan(&scene);
        // The shortest forces that carry a weight, on top.
        let down = Vector::from(rng.direction()) * 9.80665;
        let squeezed = plan.clone();
        let under_any = scene.clone().under_gravity(Gravity::Any);
        assert!(judge(&under_any, &plan).accepted(), "{:#?}", judge(&under_any, &plan));
        // A plan does not choose its gravity: that of any direction is for scenes that ask for it.
        assert_eq!(kinds(&judge(&scene, &plan)), [ViolationKind::PromiseBroken]);
        for segment in &mut plan.segments {
            let moving = segment.moving_finger.as_ref().map(|name| name[1..].parse::<usize>().unwrap());
            for waypoint in &mut segment.waypoints {
                carry(waypoint, moving, &scene, &(down * scene.objects[0].mass));
                add_torques(waypoint);
            }
        }
        plan.promises.forces.as_mut().unwrap().gravity_in_world = Some(down.into());
        let under_it = scene.clone().under_gravity(Gravity::Direction(UnitVector::new_normalize(down)));
        assert!(judge(&under_it, &plan).accepted(), "{:#?}", judge(&under_it, &plan));
        // A heavier object leaves too little room, for one limit or the other.
        let mut plan = squeezed;
        let mut heavy = under_any;
        heavy.objects[0].mass *= 20.0;
        plan.promises.forces.as_mut().unwrap().mass *= 20.0;
        let found = kinds(&judge(&heavy, &plan));
        assert!(found.contains(&ViolationKind::ForceOutsideCone), "{found:?}");
        assert!(found.contains(&ViolationKind::NormalForceOutOfRange), "{found:?}");
        plan.promises.forces.as_mut().unwrap().joint_torques.fill(Some(0.4));
        assert!(kinds(&judge(&heavy, &plan)).contains(&ViolationKind::TorqueLimit));
    }
}

#[test]
fn every_rule_of_forces_is_broken_by_itself() {
    use ViolationKind::*;
    let (scene, soft) = (sample::scene(), sample::soft_scene());
    type Damage<'a> = &'a dyn Fn(&mut Plan);
    fn forces(plan: &mut Plan) -> &mut ForcePromises {
        plan.promises.forces.as_mut().unwrap()
    }
    let cases: [(&Scene, Damage, &[ViolationKind]); 12] = [
        (&scene, &|p| p.promises.forces = None, &[ForceMissing]),
        (&scene, &|p| p.segments[0].waypoints[3].contacts[2].force_in_object = None, &[ForceMissing]),
        (&scene, &|p| p.segments[0].waypoints[3].joint_torques.clear(), &[ForceMissing]),
        (&scene, &|p| forces(p).mass *= 1.001, &[ForceUnbalanced, PromiseBroken]),
        (&scene, &|p| forces(p).gravity_in_world = Some([0.0, 0.0, -9.7]), &[ForceUnbalanced, PromiseBroken]),
        (&scene, &|p| forces(p).gravity_in_world = Some([0.0, -9.80665, 0.0]), &[ForceUnbalanced, PromiseBroken]),
        (&scene, &|p| forces(p).joint_torques[4] = None, &[PromiseBroken]),
        (&scene, &|p| forces(p).joint_torques[4] = Some(1.5), &[PromiseBroken]),
        (&scene, &|p| forces(p).joint_torques[4] = Some(0.01), &[TorqueLimit]),
        (&scene, &|p| forces(p).normal_force[1] = 3.0, &[NormalForceOutOfRange]),
        (&scene, &|p| p.segments[0].waypoints[3].joint_torques[5] += 1e-5, &[TorqueWrong]),
        (
            &soft,
            &|p| p.segments[0].waypoints.iter_mut().for_each(|w| w.contacts[2].torsion = Some(0.04)),
            &[ForceUnbalanced, ForceOutsideCone, TorqueWrong],
        ),
    ];
    for (i, (scene, damage, expected)) in cases.iter().enumerate() {
        let mut plan = plan(scene);
        damage(&mut plan);
        let mut expected = expected.to_vec();
        expected.sort();
        assert_eq!(kinds(&judge(scene, &plan)), expected, "case {i}");
    }
}

#[test]
fn every_rule_of_time_is_broken_by_itself() {
    use ViolationKind::*;
    let scene = sample::scene();
    type Damage<'a> = &'a dyn Fn(&mut Plan);
    fn all(plan: &mut Plan) -> impl Iterator<Item = &mut Waypoint> {
        plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints)
    }
    let cases: [(Damage, &[ViolationKind]); 9] = [
        (&|p| p.segments[0].waypoints[3].time = p.segments[0].waypoints[2].time, &[TimeOrder]),
        (&|p| p.segments[1].waypoints.iter_mut().for_each(|w| w.time -= 0.3), &[TimeOrder]),
        // No time for forces to change.
        (&|p| p.segments[1].waypoints.iter_mut().for_each(|w| w.time -= PAUSE), &[TimeOrder]),
        (&|p| p.promises.motion.largest_speed = 0.01, &[TooFast]),
        (&|p| p.promises.motion.joint_velocities[4] = 0.01, &[JointTooFast]),
        (&|p| p.promises.motion.joint_velocities[4] = 4.0, &[PromiseBroken]),
        (&|p| p.promises.motion.joint_accelerations[4] = 0.01, &[JointAcceleration]),
        (&|p| p.segments[0].waypoints[0].joint_velocities[0] = 1e-5, &[VelocityInconsistent]),
        (&|p| all(p).for_each(|w| w.joint_velocities.iter_mut().for_each(|v| *v = -*v)), &[VelocityInconsistent]),
    ];
    for (i, (damage, expected)) in cases.iter().enumerate() {
        let mut plan = plan(&scene);
        damage(&mut plan);
        assert_eq!(&kinds(&judge(&scene, &plan)), expected, "case {i}");
    }
    // Standing at every waypoint is slow, but no contradiction.
    let mut halting = plan(&scene);
    all(&mut halting).for_each(|w| w.joint_velocities.fill(0.0));
    assert!(judge(&scene, &halting).accepted());
}

#[test]
fn the_sample_rolls_on_its_balls() {
    // Centres of tips are one radius from the contact: the samples above would be accepted within the tolerance too.
    let scene = sample::scene();
    for waypoint in plan(&scene).segments[0].waypoints.iter() {
        for f in 0..sample::N_FINGERS {
            let hand_from_object = sample::world_from_hand().inverse() * Pose::from(&waypoint.world_from_object);
            let contact = contact_of(&waypoint.contacts[f]).unwrap();
            let center = contact.point_in_object + contact.normal_in_object.into_inner() * TIP_RADIUS;
            assert!((tip_center(f, waypoint) - hand_from_object * center).norm() < 1e-9);
        }
    }
}
