//! Grasp lists. What is read must be written and read again as the same list.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::grasp::list::format::{from_json, to_json};
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("grasps.json");
    if let Ok(list) = from_json(path, bytes) {
        let again = from_json(path, to_json(&list).as_bytes());
        assert_eq!(again.as_ref(), Ok(&list));
    }
});
