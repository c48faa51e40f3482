//! Isaac grasp files. What is read has finite numbers and quaternions of length one.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::grasp::list::isaac::from_isaac;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let Ok(read) = from_isaac(Path::new("grasps.yaml"), bytes) else { return };
    for grasp in &read.grasps {
        let pose = &grasp.object_from_link;
        let length = pose.quat_xyzw.iter().map(|x| x * x).sum::<f64>();
        assert!((length - 1.0).abs() < 1e-9 && pose.quat_xyzw[3] >= 0.0);
        assert!(pose.position.iter().chain(grasp.joints.values()).all(|x| x.is_finite()));
    }
});
