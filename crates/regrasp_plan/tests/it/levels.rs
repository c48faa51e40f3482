//! What a verdict covers, and that no plan sets the measure by which it is judged.

use crate::sample::{self, judge_for, kinds};
use crate::{loaded, rolled, tracked};
use regrasp_plan::check::{Level, ViolationKind};
use regrasp_plan::{Plan, Segment};
use regrasp_robot::ContactModel;
use regrasp_scene::{Gravity, Limits, Scene};

/// The kinds found at a level.
fn found(level: Level, scene: &Scene, plan: &Plan) -> Vec<ViolationKind> {
    kinds(&judge_for(level, scene, plan))
}

#[test]
fn a_plan_reaches_the_level_of_what_it_has() {
    let scene = sample::scene();
    // Contacts that stay while round fingertips pivot; the same with forces; rolling contacts with forces.
    let plain = sample::plan(&scene);
    let pivoting = loaded::load(sample::plan_with_way(&scene), &scene);
    let rolling = loaded::plan(&scene);
    let reached = [&plain, &pivoting, &rolling].map(|plan| judge_for(Level::Motion, &scene, plan).reached);
    assert_eq!(reached, [Some(Level::Geometry), Some(Level::Forces), Some(Level::Motion)]);
    assert_eq!(found(Level::Geometry, &scene, &plain), []);
    assert_eq!(found(Level::Forces, &scene, &plain), [ViolationKind::ForcesAbsent]);
    assert_eq!(found(Level::Motion, &scene, &plain), [ViolationKind::Slip, ViolationKind::ForcesAbsent]);
    // The verdict says how far tips would slip.
    assert!(judge_for(Level::Geometry, &scene, &plain).max_hold_slip.unwrap().slip > 0.5e-3);
    assert!(judge_for(Level::Motion, &scene, &rolling).max_hold_slip.unwrap().slip < 1e-5);
}

/// A transfer cut into segments of two waypoints each: what no segment shows, the whole does.
fn cut_up(plan: &Plan) -> Plan {
    let mut cut = plan.clone();
    cut.segments.clear();
    for segment in &plan.segments {
        if segment.moving_finger.is_some() {
            let mut slow = segment.clone();
            for waypoint in &mut slow.waypoints {
                waypoint.time *= 20.0;
                waypoint.joint_velocities.iter_mut().for_each(|velocity| *velocity /= 20.0);
            }
            cut.segments.push(slow);
            continue;
        }
        for pair in segment.waypoints.windows(2) {
            let mut waypoints = pair.to_vec();
            // At rest at every waypoint, and slow enough for it.
            for waypoint in &mut waypoints {
                waypoint.joint_velocities.fill(0.0);
                waypoint.time *= 20.0;
            }
            cut.segments.push(Segment { waypoints, ..segment.clone() });
        }
    }
    cut
}

#[test]
fn slip_is_summed_from_landing_to_lifting_whatever_the_segments() {
    let scene = sample::scene();
    // Fixed contacts over which the fingertips pivot, said to roll, in segments in which none slips by the slip tolerance.
    let mut pivoting = sample::plan(&scene);
    pivoting.segments.truncate(1);
    let end = pivoting.segments[0].waypoints.last().unwrap().world_from_object;
    pivoting.goal = end;
    for waypoint in &mut pivoting.segments[0].waypoints {
        waypoint.contacts.iter_mut().for_each(|contact| contact.mode = regrasp_plan::ContactMode::Rolling);
    }
    let fine = refined(&pivoting, 8);
    let cut = cut_up(&fine);
    let report = judge_for(Level::Geometry, &scene, &cut);
    assert!(report.max_slip.unwrap() < 0.1e-3, "{:?}", report.max_slip);
    assert_eq!(kinds(&report), [ViolationKind::Slip]);
    assert!(report.max_hold_slip.unwrap().slip > 0.5e-3);
    // Cutting up what rolls makes no slip.
    let rolling = loaded::plan(&scene);
    let whole = judge_for(Level::Motion, &scene, &rolling).max_hold_slip.unwrap();
    let parts = judge_for(Level::Motion, &scene, &cut_up(&rolling)).max_hold_slip.unwrap();
    assert!(whole.slip < 1e-5 && parts.slip < 1e-5, "{whole:?} {parts:?}");
}

/// Every step of the plan's segments in `n` equal parts.
fn refined(plan: &Plan, n: usize) -> Plan {
    let mut fine = plan.clone();
    for segment in &mut fine.segments {
        let coarse = std::mem::take(&mut segment.waypoints);
        for pair in coarse.windows(2) {
            for k in 0..n {
                let t = k as f64 / n as f64;
                let mut waypoint = pair[0].clone();
                waypoint.time += t * (pair[1].time - pair[0].time);
                for (joint, to) in waypoint.joints.iter_mut().zip(&pair[1].joints) {
                    *joint += t * (to - *joint);
                }
                let [from, to] = [0, 1].map(|i| regrasp_geometry::Pose::from(&pair[i].world_from_object));
                waypoint.world_from_object = (&regrasp_geometry::interpolate_pose(&from, &to, t)).into();
                segment.waypoints.push(waypoint);
            }
        }
        segment.waypoints.extend(coarse.last().cloned());
    }
    fine
}

#[test]
fn a_soft_fingertip_that_turns_about_the_normal_slips() {
    let scene = sample::scene();
    let plan = rolled::plan(&scene, 10);
    let twist = |torsion_radius: f64| {
        let mut soft = scene.clone();
        for finger in &mut soft.hands[0].hand.fingers {
            finger.tip.contact = ContactModel::SoftFinger { torsion_radius };
        }
        judge_for(Level::Motion, &soft, &plan)
    };
    let [small, large] = [0.002, 0.004].map(twist);
    assert!(kinds(&small).contains(&ViolationKind::Slip) && kinds(&large).contains(&ViolationKind::Slip));
    let rolls = judge_for(Level::Motion, &scene, &plan);
    assert!(!kinds(&rolls).contains(&ViolationKind::Slip));
    // By the torsion radius.
    let [hard, small, large] = [rolls, small, large].map(|report| report.max_hold_slip.unwrap().slip);
    assert!(((large - hard) / (small - hard) - 2.0).abs() < 0.05, "{hard} {small} {large}");
}

#[test]
fn tracking_demands_forces() {
    let mut scene = tracked::ball_scene();
    let mut plan = tracked::ball_plan(&mut scene);
    plan.promises.forces = None;
    for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
        waypoint.joint_torques.clear();
        for contact in &mut waypoint.contacts {
            (contact.force_in_object, contact.torsion) = (None, None);
        }
    }
    assert_eq!(found(Level::Geometry, &scene, &plan), [ViolationKind::ForcesAbsent]);
}

#[test]
fn the_measure_is_never_the_plans() {
    use ViolationKind::*;
    let scene = sample::scene();
    let good = loaded::plan(&scene);
    assert_eq!(found(Level::Motion, &scene, &good), []);
    type Damage<'a> = &'a dyn Fn(&mut Plan);
    let cases: [(Damage, Level, ViolationKind); 4] = [
        (&|p| p.promises.motion.largest_speed = 1e6, Level::Motion, LimitExceeded),
        (&|p| p.promises.motion.joint_accelerations[3] = 1e8, Level::Motion, LimitExceeded),
        (&|p| p.promises.motion.joint_accelerations.fill(20.5), Level::Motion, LimitExceeded),
        (&|p| p.promises.forces.as_mut().unwrap().normal_force[1] = 1e9, Level::Forces, LimitExceeded),
    ];
    for (i, (damage, level, expected)) in cases.into_iter().enumerate() {
        let mut plan = good.clone();
        damage(&mut plan);
        assert_eq!(found(level, &scene, &plan), [expected], "case {i}");
        if level > Level::Geometry {
            assert_eq!(found(Level::Geometry, &scene, &plan), [], "case {i}");
        }
    }
    // The same plan in a scene that asks for more.
    let strict = |limits: Limits| found(Level::Motion, &Scene { limits, ..scene.clone() }, &good);
    let own = scene.limits;
    assert_eq!(strict(Limits { friction_margin: None, ..own }), [FrictionMarginTooSmall]);
    assert_eq!(strict(Limits { friction_margin: Some(1.1), ..own }), [FrictionMarginTooSmall]);
    assert_eq!(strict(Limits { largest_speed: 1e-3, ..own }), [LimitExceeded]);
    assert_eq!(strict(Limits { normal_force: 1.0, ..own }), [LimitExceeded]);
    // Gravity is the scene's, or the world's down.
    let sideways = scene.clone().under_gravity(Gravity::Direction(regrasp_geometry::Vector::x_axis()));
    for other in [sideways, scene.clone().under_gravity(Gravity::Any)] {
        assert_eq!(found(Level::Geometry, &other, &good), [PromiseBroken]);
    }
}
