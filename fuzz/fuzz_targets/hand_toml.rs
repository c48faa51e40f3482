//! Hand files beside a good URDF.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::robot::import::load_hand;
use regrasp_fuzz::{Folder, options};
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::new);

fuzz_target!(|bytes: &[u8]| {
    let path = FOLDER.put("hand.toml", bytes);
    let _ = load_hand(&path, &options(bytes));
});
