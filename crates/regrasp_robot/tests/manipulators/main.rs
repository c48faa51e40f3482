//! Manipulators: layouts, kinematics of whole trees, robot files, and what is refused.

#[path = "../../../../tests/support/places.rs"]
mod places;

mod hands_alone;
mod refused;
mod robot_file_keys;
mod shared_robots;
mod text;
mod two_arms;
mod upper_body;

use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_robot::{LoadOptions, Manipulator, ResolveOptions, load_manipulator};
use std::path::Path;

/// Options with the shared models as package `models`.
fn options(models: &Path) -> LoadOptions {
    let packages = vec![("models".to_owned(), models.to_owned())];
    LoadOptions { resolve: ResolveOptions { packages, ..Default::default() }, ..Default::default() }
}

/// The manipulator of a robot file with this text, in a folder of its own with these other files.
fn load(text: &str, others: &[(&str, &str)], options: &LoadOptions) -> Result<Manipulator, Vec<String>> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in others {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let path = folder.path().join("robot.toml");
    std::fs::write(&path, format!("format = \"regrasp-robot\"\nformat_version = 1\n{text}")).unwrap();
    let prefix = format!("{}/", folder.path().display());
    load_manipulator(&path, options)
        .map(|loaded| loaded.manipulator)
        .map_err(|error| error.diagnostics.iter().map(|d| d.to_string().replace(&prefix, "")).collect())
}

/// A state within the limits of all coordinates; continuous ones within a turn.
fn random_state(manipulator: &Manipulator, rng: &mut Rng) -> Vec<f64> {
    let draw = |lower: f64, upper: f64, rng: &mut Rng| rng.uniform(lower.max(-3.0), upper.min(3.0));
    manipulator.layout.coordinates.iter().map(|c| draw(c.lower, c.upper, rng)).collect()
}

fn difference(pose: &Pose, matrix: &nalgebra::Matrix4<f64>) -> f64 {
    (pose.to_homogeneous() - matrix).abs().max()
}

/// Poses of links and hands, and chains of arms and fingers, are those of one tree.
fn assert_consistent(manipulator: &Manipulator, state: &[f64]) {
    let mut poses = Vec::new();
    manipulator.link_poses(state, &mut poses);
    let close = |a: &Pose, b: &Pose| (a.to_homogeneous() - b.to_homogeneous()).abs().max() < 1e-12;
    for (index, arm) in manipulator.arms.iter().enumerate() {
        let joints = manipulator.arm_joints(index, state);
        let from_chain = poses[arm.base.0] * arm.chain.last_frame(joints).to_pose() * arm.last_from_mount;
        assert!(close(&from_chain, &poses[arm.mount.0]), "arm {}", arm.name);
    }
    for (index, mounted) in manipulator.hands.iter().enumerate() {
        let world_from_hand = manipulator.world_from_hand(index, state);
        assert!(close(&world_from_hand, &poses[mounted.hand.base.0]), "hand {}", mounted.name);
        if !manipulator.is_hand_as_made(index, state) {
            continue;
        }
        let mut first = 0;
        for finger in &mounted.hand.fingers {
            let all = manipulator.finger_joints(index, state);
            let own = &all[first..first + finger.chain.n_coordinates()];
            first += own.len();
            let in_body = mounted.hand.robot.fixed_pose_in_body(finger.tip.link);
            let from_chain = world_from_hand * finger.chain.last_frame(own).to_pose() * in_body;
            assert!(close(&from_chain, &poses[finger.tip.link.0]), "finger {}", finger.name);
        }
    }
}
