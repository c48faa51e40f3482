//! SRDF files beside a good robot.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::robot::Robot;
use regrasp::robot::import::load_robot;
use regrasp::robot::import::srdf::load_srdf;
use regrasp_fuzz::{Folder, options};
use std::sync::LazyLock;

static FOLDER: LazyLock<(Folder, Robot)> = LazyLock::new(|| {
    let folder = Folder::new();
    let path = folder.put("hand.urdf", regrasp_fuzz::URDF.as_bytes());
    let robot = load_robot(&path, &Default::default()).expect("the seed is good").robot;
    (folder, robot)
});

fuzz_target!(|bytes: &[u8]| {
    let path = FOLDER.0.put("hand.srdf", bytes);
    let _ = load_srdf(&path, &FOLDER.1, &options(bytes));
});
