//! The files that `regrasp demo` carries along are those of the repository.

use std::fs;
use std::path::Path;

#[test]
fn the_demo_has_the_files_of_the_repository() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the repository");
    for name in [
        "scenes/sphere_180z.toml",
        "assets/hands/wide_four_finger/hand.toml",
        "assets/hands/wide_four_finger/hand.urdf",
    ] {
        let read = |path: &Path| fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let copy = root.join("crates/regrasp_cli/demo").join(name);
        assert!(read(&root.join(name)) == read(&copy), "{} differs from {name}: copy it", copy.display());
    }
}
