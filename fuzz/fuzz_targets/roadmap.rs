//! Roadmap files, as they come and with length and checksum made good, which lets an input through to the tables. What is
//! read must be written and read again as the same bytes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::planners::in_hand::roadmap::{GraspRoadmap, seal};
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let mut sealed = bytes.to_vec();
    seal(&mut sealed);
    for input in [bytes, &sealed] {
        let path = Path::new("hand_object.roadmap");
        if let Ok(roadmap) = GraspRoadmap::from_bytes(path, input) {
            let written = roadmap.to_bytes();
            let again = GraspRoadmap::from_bytes(path, &written).expect("what is written is read");
            assert!(again.to_bytes() == written, "another roadmap");
            assert_eq!(again.census(), roadmap.census());
        }
    }
});
