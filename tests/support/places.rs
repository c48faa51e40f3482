//! Where tests find the repository and the shared models. Test binaries of several crates include this file by its path:
//! a crate of it would be one more that everything depends on.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The root of the repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the repository is there")
}

/// The shared models: `REGRASP_MODELS`, else `shared/models` beside a folder above; none, and the log says so, when they
/// are absent.
pub fn shared_models() -> Option<PathBuf> {
    let named = std::env::var_os("REGRASP_MODELS").map(PathBuf::from);
    let above = repository().ancestors().map(|folder| folder.join("shared/models")).find(|folder| folder.is_dir());
    let found = named.or(above);
    if found.is_none() {
        // Past the capture of test output, so that the log says it.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no shared models");
    }
    found
}
