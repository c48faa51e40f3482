//! Plan files. What is read must be written and read again as the same plan.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::plan::format::{from_json, to_json};
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("plan.json");
    if let Ok(plan) = from_json(path, bytes) {
        let again = from_json(path, to_json(&plan).as_bytes());
        assert_eq!(again.as_ref(), Ok(&plan));
    }
});
