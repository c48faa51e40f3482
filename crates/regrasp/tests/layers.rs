//! The walls of the tower (`ARCHITECTURE.md`): who may depend on whom, read from `cargo metadata`.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Each crate, lowest first, with the crates of this workspace that it may use.
const TOWER: &[(&str, &[&str])] = &[
    ("regrasp_base", &[]),
    ("regrasp_geometry", &["regrasp_base"]),
    ("regrasp_roadmap", &["regrasp_base"]),
    ("regrasp_robot", &["regrasp_base", "regrasp_geometry"]),
    ("regrasp_scene", &["regrasp_base", "regrasp_geometry", "regrasp_robot"]),
    ("regrasp_grasp", &["regrasp_base", "regrasp_geometry", "regrasp_robot", "regrasp_scene"]),
    ("regrasp_plan", &["regrasp_base", "regrasp_geometry", "regrasp_robot", "regrasp_scene", "regrasp_grasp"]),
    // Broken plans for tests and campaigns.
    (
        "regrasp_mutations",
        &["regrasp_base", "regrasp_geometry", "regrasp_robot", "regrasp_scene", "regrasp_grasp", "regrasp_plan"],
    ),
    (
        "regrasp_planners",
        &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_roadmap",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            // Its tests break plans.
            "regrasp_mutations",
            "regrasp_plan",
        ],
    ),
    (
        "regrasp_export",
        &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_plan",
            // Its tests plan.
            "regrasp_planners",
        ],
    ),
    (
        "regrasp_viewer",
        &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            "regrasp_plan",
            // Its tests plan.
            "regrasp_planners",
        ],
    ),
    (
        "regrasp",
        &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_roadmap",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            "regrasp_plan",
            "regrasp_planners",
            "regrasp_export",
            "regrasp_viewer",
        ],
    ),
    (
        "regrasp_bench",
        &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            "regrasp_mutations",
            "regrasp_plan",
            "regrasp_planners",
        ],
    ),
    ("regrasp_cli", &["regrasp", "regrasp_bench"]),
    ("regrasp_python", &["regrasp"]),
];

/// Outside crates that belong to named crates only.
const PRIVATE: &[(&str, &[&str])] = &[
    ("parry3d-f64", &["regrasp_geometry"]),
    // The viewer reads its own pictures back, in tests.
    ("roxmltree", &["regrasp_robot", "regrasp_viewer"]),
    ("clap", &["regrasp_cli"]),
    ("ctrlc", &["regrasp_cli"]),
    ("pyo3", &["regrasp_python"]),
    ("zip", &["regrasp_export"]),
    ("clarabel", &["regrasp_grasp", "regrasp_plan"]),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Direct dependencies of every crate of the workspace, of every kind (normal, dev, build).
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo metadata runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata is JSON");
    let text = |value: &Value| value.as_str().expect("a string").to_owned();
    metadata["packages"]
        .as_array()
        .expect("packages")
        .iter()
        // Tasks of developers: it runs programs and knows no crate.
        .filter(|package| package["name"] != "xtask")
        .map(|package| {
            let needs = package["dependencies"].as_array().expect("dependencies");
            (text(&package["name"]), needs.iter().map(|need| text(&need["name"])).collect())
        })
        .collect()
}

#[test]
fn every_crate_stands_on_lower_floors_only() {
    let dependencies = dependencies();
    let ours: BTreeSet<&str> = TOWER.iter().map(|&(name, _)| name).collect();
    let found: BTreeSet<&str> = dependencies.keys().map(String::as_str).collect();
    assert_eq!(found, ours, "a crate joined or left the workspace: change TOWER and ARCHITECTURE.md too");
    for &(name, allowed) in TOWER {
        for need in dependencies[name].iter().filter(|need| ours.contains(need.as_str())) {
            assert!(allowed.contains(&need.as_str()), "{name} must not depend on {need}");
        }
    }
}

#[test]
fn the_tower_has_no_way_up() {
    for (floor, &(name, allowed)) in TOWER.iter().enumerate() {
        for need in allowed {
            let below = TOWER[..floor].iter().any(|(lower, _)| lower == need);
            assert!(below, "{name} may use {need}, which does not stand below it");
        }
    }
}

#[test]
fn private_dependencies_stay_private() {
    for (name, needs) in dependencies() {
        for &(library, owners) in PRIVATE {
            assert!(!needs.contains(library) || owners.contains(&name.as_str()), "{name} must not depend on {library}");
        }
    }
}

/// The checker's own words: no path of `regrasp_plan` may name the planner, not even in tests or comments that link.
#[test]
fn the_sources_keep_what_the_manifests_promise() {
    let forbidden: &[(&str, &str)] = &[
        ("std::process::Command", "starts a program"),
        ("std::env::var", "reads the environment"),
        ("env::current_dir", "reads the current directory"),
        ("SystemTime::now", "reads the calendar"),
    ];
    let faces = ["regrasp_cli", "regrasp_bench", "regrasp_python"];
    for &(name, _) in TOWER.iter().filter(|(name, _)| !faces.contains(name)) {
        let files = sources(&root().join("crates").join(name).join("src"));
        let texts: Vec<String> =
            files.iter().map(|file| std::fs::read_to_string(file).expect("a source file is readable")).collect();
        let for_tests: BTreeSet<&str> = texts.iter().flat_map(|text| test_modules(text)).collect();
        for (file, text) in files.iter().zip(&texts) {
            let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            if for_tests.contains(stem) {
                continue;
            }
            // Test modules stand last in a file; they may look for the shared models.
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            for (word, what) in forbidden {
                assert!(!code.contains(word), "{} {what} ({word}); only a face may", file.display());
            }
        }
    }
}

/// Names of the modules that `text` declares, in files of their own, for tests only.
fn test_modules(text: &str) -> impl Iterator<Item = &str> {
    text.split("#[cfg(test)]\n").skip(1).filter_map(|rest| {
        let line = rest.lines().next()?.trim().strip_suffix(';')?;
        line.split("mod ").nth(1)
    })
}

/// No source file is longer than 600 lines unless its head says why (`Longer than 600 lines because`).
#[test]
fn files_stay_short() {
    for &(name, _) in TOWER {
        for file in sources(&root().join("crates").join(name).join("src")) {
            let text = std::fs::read_to_string(&file).expect("a source file is readable");
            let lines = text.lines().count();
            let excused = text.lines().take(10).any(|line| line.contains("Longer than 600 lines because"));
            assert!(lines <= 600 || excused, "{} has {lines} lines", file.display());
        }
    }
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a source folder is readable") {
        let path = entry.expect("an entry is readable").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}
