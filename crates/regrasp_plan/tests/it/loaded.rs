//! Times, forces and torques for hand-made plans, by other formulas than the checker's: internal forces towards the centroid
//! of the contacts, the shortest forces and torsions that carry the weight on top, and torques by finite differences of
//! virtual work.

use crate::sample;
use nalgebra::{DMatrix, DVector};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::plan::{ForcePromises, SegmentKind};
use regrasp_plan::{Plan, Segment, Waypoint};
use regrasp_robot::ContactModel;
use regrasp_scene::Scene;

const GRAVITY_IN_WORLD: [f64; 3] = [0.0, 0.0, -9.80665];
/// Internal force per distance of a contact from the centroid of all, in newtons per metre.
const SQUEEZE: f64 = 110.0;
/// Pause between two segments, in seconds.
pub const PAUSE: f64 = 0.25;

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

pub fn tip_center(f: usize, waypoint: &Waypoint) -> Point {
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
pub fn carry(waypoint: &mut Waypoint, moving: Option<usize>, scene: &Scene, weight: &Vector) {
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
pub fn add_torques(waypoint: &mut Waypoint) {
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
