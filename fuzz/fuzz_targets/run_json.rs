//! Runs of the executor. What is read must be written and read again as the same run, and a page can be made of it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::viewer::runs::format::{from_json, to_json};
use regrasp::viewer::runs::html;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("run.json");
    if let Ok(run) = from_json(path, bytes) {
        let again = from_json(path, to_json(&run).as_bytes());
        assert_eq!(again.as_ref(), Ok(&run));
        assert!(html(&run, &[], None).ends_with("</html>\n"));
    }
});
