//! Roadmaps of robots: super graphs, and what pick and place saves. What is read must be written and read again as the same bytes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::robot_roadmap::RobotRoadmap;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("scene.toml.roadmap.json");
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(roadmap) = RobotRoadmap::from_json(path, text) {
        let written = roadmap.to_json();
        let again = RobotRoadmap::from_json(path, &written).expect("what is written can be read");
        assert!(again.to_json() == written, "another roadmap");
    }
});
