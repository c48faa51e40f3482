//! Scene files beside a good hand and mesh, and the queries they give.
#![no_main]

use libfuzzer_sys::fuzz_target;
use regrasp::scene::load_scene;
use regrasp_fuzz::{Folder, options};
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::new);

fuzz_target!(|bytes: &[u8]| {
    let path = FOLDER.put("scene.toml", bytes);
    if let Ok(loaded) = load_scene(&path, &options(bytes)) {
        let _ = loaded.task().query(bytes.len() as u64);
    }
});
