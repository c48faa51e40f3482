//! Robot files beside a good hand and URDF: what loads has consistent kinematics, and its arms inverse kinematics.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::robot::kinematics::arm_ik::{ArmIk, IkBudget};
use regrasp::robot::load_manipulator;
use regrasp_fuzz::{Folder, options};
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::new);

fuzz_target!(|bytes: &[u8]| {
    let path = FOLDER.put("robot.toml", bytes);
    let Ok(loaded) = load_manipulator(&path, &options(bytes)) else { return };
    let robot = loaded.manipulator;
    let rest = robot.layout.rest();
    assert!(robot.layout.within_limits(&rest, 0.0));
    let mut poses = Vec::new();
    robot.link_poses(&rest, &mut poses);
    assert!(poses.iter().all(|pose| pose.translation.vector.iter().all(|x| x.is_finite())));
    for (index, arm) in robot.arms.iter().enumerate() {
        let Ok(ik) = ArmIk::new(&robot, index) else { continue };
        let home = arm.chain.last_frame(&arm.home).to_pose() * arm.last_from_mount;
        let budget = IkBudget { postures: 1, starts: 2, free_angles: 8, seed: 0 };
        let _ = ik.solve(&home, &arm.home, &budget);
    }
});
