//! Joints with several leaders: the checker's kinematics and limits against the planner's chains and against differences.

use crate::sample;
use regrasp_base::Rng;
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::violation::ViolationKind;
use regrasp_plan::check::{CheckSettings, check};
use regrasp_robot::{Chain, Coupling, JointId, LinearLimit};
use regrasp_scene::Scene;
use std::sync::Arc;

/// The sample's scene with a first finger whose last joint turns back by half of what the first turns and all of what the
/// second does, within limits of its own.
fn scene() -> Scene {
    let mut scene = sample::scene();
    let finger = &mut scene.hands[0].hand.fingers[0];
    let chain = &finger.chain;
    let terms = [(0, -0.5), (1, -1.0)];
    let mut joints = chain.joints.clone();
    joints[2].drive = Coupling { terms: terms.into_iter().collect(), offset: 0.4 };
    let limits = [-0.2, 0.9];
    let linear = LinearLimit::new(chain.names[2].clone(), &joints[2].drive, limits);
    let coupled = Chain::new(joints, chain.names[..2].to_vec(), chain.lower[..2].to_vec(), chain.upper[..2].to_vec());
    finger.chain = coupled.with_linear_limits(vec![linear]);
    finger.rest.pop();
    let robot = Arc::make_mut(&mut scene.hands[0].hand.robot);
    let leader = |j: usize| robot.joint_named(&format!("f0_j{j}")).unwrap();
    let terms: [(JointId, f64); 2] = [(leader(0), -0.5), (leader(1), -1.0)];
    let follower = leader(2);
    let joint = &mut robot.joints[follower.0];
    joint.coupling = Some(Coupling { terms: terms.into_iter().collect(), offset: 0.4 });
    let own = joint.limits.as_mut().unwrap();
    (own.lower, own.upper) = (limits[0], limits[1]);
    scene
}

#[test]
fn tips_velocities_and_limits_agree_with_the_chain() {
    let scene = scene();
    let model = sample::with_task(&scene, CheckedHand::new).unwrap();
    let (ours, theirs) = (&model.fingers[0], &scene.hands[0].hand.fingers[0]);
    assert_eq!(ours.coordinates, 0..2);
    let row = model.limits.iter().find(|row| row.name == "f0_j2").unwrap();
    let mut rng = Rng::keyed(1, "couplings", 0);
    let (mut within, mut beyond) = (0, 0);
    for _ in 0..300 {
        let joints: Vec<f64> = (0..model.joint_names.len()).map(|_| rng.uniform(-1.0, 1.0)).collect();
        let center = ours.center_in_world(&joints);
        assert!(
            (center - sample::world_from_hand() * theirs.chain.tip(&joints[..2], &theirs.tip.center_in_body)).norm()
                < 1e-12
        );
        let rates: Vec<f64> = joints.iter().map(|_| rng.uniform(-1.0, 1.0)).collect();
        let [before, after] = [-1e-6, 1e-6].map(|h| {
            let moved: Vec<f64> = joints.iter().zip(&rates).map(|(q, rate)| q + h * rate).collect();
            ours.center_in_world(&moved)
        });
        let velocity = ours.path.velocity(&ours.center, &joints, &rates);
        assert!((velocity - (after - before) / 2e-6).norm() < 1e-8);
        let position = row.drive.position(&joints);
        let is_within = (row.lower..=row.upper).contains(&position);
        assert_eq!(theirs.chain.within_linear_limits(&joints[..2], 0.0), is_within);
        *if is_within { &mut within } else { &mut beyond } += 1;
    }
    assert!(within > 50 && beyond > 50, "{within} within, {beyond} beyond");
}

#[test]
fn a_sum_beyond_its_limits_is_reported_at_waypoints_and_between() {
    let coupled = scene();
    let mut plan = sample::plan(&sample::scene());
    let follower = plan.joint_names.iter().position(|name| name == "f0_j2").unwrap();
    plan.joint_names.remove(follower);
    plan.promises.motion.joint_velocities.remove(follower);
    plan.promises.motion.joint_accelerations.remove(follower);
    for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
        waypoint.joints.remove(follower);
        waypoint.joint_velocities.remove(follower);
        // Half the way back and the second joint put the last one at 0.3.
        waypoint.joints[1] = 0.1 - 0.5 * waypoint.joints[0];
    }
    let beyond = |plan: &regrasp_plan::Plan| {
        let report = check((&coupled, &sample::state(&coupled)), None, plan, &CheckSettings::default());
        let of_follower = report.violations.iter().filter(|violation| violation.subjects.iter().any(|s| s == "f0_j2"));
        of_follower.filter(|violation| violation.kind == ViolationKind::JointLimit).count()
    };
    assert_eq!(beyond(&plan), 0);
    let mut broken = plan.clone();
    broken.segments[0].waypoints[1].joints[1] = -0.6 - 0.5 * broken.segments[0].waypoints[1].joints[0];
    assert!(beyond(&broken) > 0, "a follower at 1.0 is beyond 0.9");
    // Both ends at 0.88, with velocities that take the sum beyond 0.9 on the way.
    let mut between = plan.clone();
    let span = between.segments[0].waypoints[1].time - between.segments[0].waypoints[0].time;
    for (waypoint, (way, rate)) in between.segments[0].waypoints[..2].iter_mut().zip([(0.0, -0.4), (0.2, 0.2)]) {
        waypoint.joints[0] = way;
        waypoint.joints[1] = -0.48 - 0.5 * way;
        waypoint.joint_velocities[0] = 0.2 / span;
        waypoint.joint_velocities[1] = rate / span;
    }
    assert!(beyond(&between) > 0, "between two waypoints");
}
