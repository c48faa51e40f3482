//! The command line and the Python module are built with the features of outside crates with which the tests are: cargo compiles each
//! crate once for all of them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Features of every outside crate, by name and version; one set for programs, and one for build scripts and macros where that differs.
type Features = BTreeMap<String, BTreeSet<String>>;

fn features(of: &[&str]) -> Features {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let tree = ["tree", "--locked", "--prefix", "none", "--format", "{p} {f}"];
    let out = Command::new(env!("CARGO")).args(tree).args(of).current_dir(root).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let mut found = Features::new();
    for line in String::from_utf8(out.stdout).unwrap().lines() {
        let line = line.replace(" (*)", "").replace(" (proc-macro)", "");
        let mut words = line.splitn(3, ' ');
        let (Some(name), Some(version)) = (words.next(), words.next()) else { continue };
        // Those of the workspace have a path.
        if !line.contains(" (/") && !line.contains(":\\") {
            let features = words.next().unwrap_or_default().to_owned();
            found.entry(format!("{name} {version}")).or_default().insert(features);
        }
    }
    found
}

#[test]
fn what_ships_shares_outside_crates_with_the_tests() {
    let tests = features(&["--workspace", "--edges", "normal,build,dev"]);
    for ships in ["regrasp_cli", "regrasp_python"] {
        let own = features(&["--package", ships, "--edges", "normal,build"]);
        assert!(own.len() > 50, "{ships} has {} outside crates", own.len());
        let apart = own.iter().filter(|(name, features)| tests.get(*name) != Some(features));
        let apart: Vec<String> =
            apart.map(|(name, features)| format!("{name}: {features:?}, in tests {:?}", tests.get(name))).collect();
        assert!(
            apart.is_empty(),
            "{ships} is built with other features than the tests; name what is missing in \
             crates/regrasp_features/Cargo.toml:\n{}",
            apart.join("\n")
        );
    }
}
