//! Arms of the shared models and of the bundled robot: reachable poses that are found.

use super::miss;
use super::places::{repository, shared_models};
use regrasp_base::Rng;
use regrasp_robot::kinematics::arm_ik::{ArmIk, IkBudget};
use regrasp_robot::{LoadOptions, Manipulator, ResolveOptions, load_manipulator};
use std::f64::consts::PI;
use std::path::Path;

fn robot_of(models: &Path, urdf: &str, base: &str, mount: &str) -> Manipulator {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.toml");
    let text = format!(
        "format = \"regrasp-robot\"\nformat_version = 1\n[[models]]\nurdf = \"package://models/robots/{urdf}\"\n\
         [[arms]]\nname = \"arm\"\nbase_link = \"{base}\"\nmount_link = \"{mount}\"\n"
    );
    std::fs::write(&path, text).unwrap();
    let packages = vec![("models".to_owned(), models.to_owned())];
    let options = LoadOptions { resolve: ResolveOptions { packages, ..Default::default() }, ..Default::default() };
    load_manipulator(&path, &options).unwrap_or_else(|error| panic!("{urdf}: {error}")).manipulator
}

/// Share of random poses within reach for which a posture is found, without a hint.
fn share_found(robot: &Manipulator, n_poses: u64) -> (f64, bool) {
    let arm = &robot.arms[0];
    let ik = ArmIk::new(robot, 0).unwrap();
    let mut n_found = 0;
    for pose in 0..n_poses {
        let mut rng = Rng::keyed(11, "reachable", pose);
        let ends = arm.chain.lower.iter().zip(&arm.chain.upper);
        let joints: Vec<f64> = ends.map(|(&low, &high)| rng.uniform(low.max(-PI), high.min(PI))).collect();
        let mut poses = Vec::new();
        arm.chain.forward(&joints, &mut poses);
        let target = poses[poses.len() - 1] * arm.last_from_mount;
        let budget = IkBudget { postures: 1, ..Default::default() };
        if let Ok(found) = ik.solve(&target, &arm.home, &budget) {
            for one in &found {
                assert!(miss(&arm.chain, &arm.last_from_mount, &one.joints, &target) < 1e-9);
                assert!(arm.chain.within_limits(&one.joints, 0.0));
            }
            n_found += 1;
        }
    }
    (n_found as f64 / n_poses as f64, ik.has_closed_form())
}

/// Robot, base link and mount link of an arm; whether the closed form holds.
const ARMS: [(&str, &str, &str, bool); 5] = [
    ("panda/panda.urdf", "panda_link0", "panda_link8", false),
    ("pr2/pr2.urdf", "torso_lift_link", "r_gripper_palm_link", false),
    ("baxter/baxter_spherized.urdf", "torso", "right_hand", false),
    ("dual_iiwa14/dual_iiwa14_spheres.urdf", "left_iiwa_link_0", "left_iiwa_link_ee", true),
    ("tiago_dual_hey5/tiago_dual.urdf", "torso_lift_link", "arm_left_tool_link", false),
];

fn poses_within_reach_are_found(n_poses: u64) {
    let Some(models) = shared_models() else { return };
    for (urdf, base, mount, is_closed) in ARMS {
        let robot = robot_of(&models, urdf, base, mount);
        let (share, has_closed_form) = share_found(&robot, n_poses);
        assert!(share >= 0.995, "{urdf}: {share}");
        assert_eq!(has_closed_form, is_closed, "{urdf}");
    }
}

#[test]
fn poses_within_reach_of_real_arms_are_found() {
    poses_within_reach_are_found(200);
}

#[test]
#[ignore = "long: 10,000 poses per arm"]
fn ten_thousand_poses_within_reach_of_real_arms_are_found() {
    poses_within_reach_are_found(10_000);
}

#[test]
fn arms_of_the_bundled_robot_have_the_closed_form() {
    let path = repository().join("assets/robots/upper_body/robot.toml");
    let robot = load_manipulator(&path, &LoadOptions::default()).unwrap().manipulator;
    assert!((0..2).all(|arm| ArmIk::new(&robot, arm).unwrap().has_closed_form()));
    assert_eq!(share_found(&robot, 2000), (1.0, true));
    // The other bundled robot has arms of four joints.
    let path = repository().join("assets/robots/two_arms/robot.toml");
    let robot = load_manipulator(&path, &LoadOptions::default()).unwrap().manipulator;
    let error = ArmIk::new(&robot, 0).unwrap_err();
    assert!(error.to_string().starts_with("arm \"right\" has 4 independent joints"), "{error}");
}
