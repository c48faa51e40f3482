//! Rules of forces and times, each broken by itself.

use crate::loaded::{PAUSE, add_torques, any_gravity_plan, carry, load, plan, tip_center};
use crate::sample::{self, TIP_RADIUS, judge, kinds};
use regrasp_geometry::{Pose, UnitVector, Vector};
use regrasp_plan::check::ViolationKind;
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::plan::ForcePromises;
use regrasp_plan::{Plan, Waypoint};
use regrasp_scene::{Gravity, Scene};

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
