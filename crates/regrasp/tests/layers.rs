//! The walls of the tower (`ARCHITECTURE.md`): who may depend on whom, read from `cargo metadata`.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A crate with the crates of this workspace that it may use.
struct Floor {
    name: &'static str,
    /// In what ships.
    ships_with: &'static [&'static str],
    /// Beside these, in its tests, benchmarks and examples.
    tests_with: &'static [&'static str],
}

/// A crate whose tests need no more than itself.
const fn floor(name: &'static str, ships_with: &'static [&'static str]) -> Floor {
    Floor { name, ships_with, tests_with: &[] }
}

/// Each crate, lowest first. No crate of this workspace is a build dependency of another.
const TOWER: &[Floor] = &[
    // No code, but features of outside crates.
    floor("regrasp_features", &[]),
    floor("regrasp_base", &[]),
    floor("regrasp_geometry", &["regrasp_base"]),
    floor("regrasp_roadmap", &["regrasp_base"]),
    floor("regrasp_robot", &["regrasp_base", "regrasp_geometry"]),
    floor("regrasp_scene", &["regrasp_base", "regrasp_geometry", "regrasp_robot"]),
    floor("regrasp_grasp", &["regrasp_base", "regrasp_geometry", "regrasp_robot"]),
    floor("regrasp_plan", &["regrasp_base", "regrasp_geometry", "regrasp_robot", "regrasp_scene", "regrasp_grasp"]),
    // Broken plans for tests and campaigns.
    floor(
        "regrasp_mutations",
        &["regrasp_base", "regrasp_geometry", "regrasp_robot", "regrasp_scene", "regrasp_grasp", "regrasp_plan"],
    ),
    floor(
        "regrasp_manipulation",
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
    Floor {
        name: "regrasp_grasp_lists",
        ships_with: &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            "regrasp_manipulation",
        ],
        // Its tests check, and break lists.
        tests_with: &["regrasp_plan", "regrasp_mutations"],
    },
    floor(
        "regrasp_arms",
        &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_roadmap",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_plan",
            "regrasp_manipulation",
        ],
    ),
    Floor {
        name: "regrasp_planners",
        ships_with: &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_roadmap",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            "regrasp_plan",
            "regrasp_manipulation",
        ],
        tests_with: &["regrasp_mutations"],
    },
    Floor {
        name: "regrasp_tasks",
        ships_with: &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            "regrasp_plan",
            "regrasp_manipulation",
            "regrasp_grasp_lists",
            "regrasp_arms",
            // A hand changes its grasp within a task.
            "regrasp_planners",
        ],
        // Its tests break plans.
        tests_with: &["regrasp_mutations"],
    },
    Floor {
        name: "regrasp_export",
        ships_with: &["regrasp_base", "regrasp_geometry", "regrasp_robot", "regrasp_scene", "regrasp_plan"],
        // Its tests plan.
        tests_with: &["regrasp_planners"],
    },
    Floor {
        name: "regrasp_viewer",
        ships_with: &["regrasp_base", "regrasp_geometry", "regrasp_robot", "regrasp_scene", "regrasp_plan"],
        // Its tests plan.
        tests_with: &["regrasp_planners"],
    },
    floor(
        "regrasp",
        &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_roadmap",
            "regrasp_robot",
            "regrasp_scene",
            "regrasp_grasp",
            "regrasp_plan",
            "regrasp_grasp_lists",
            "regrasp_arms",
            "regrasp_tasks",
            "regrasp_planners",
            "regrasp_export",
            "regrasp_viewer",
        ],
    ),
    Floor {
        name: "regrasp_bench",
        ships_with: &[
            "regrasp_base",
            "regrasp_geometry",
            "regrasp_scene",
            "regrasp_plan",
            "regrasp_mutations",
            "regrasp_planners",
        ],
        tests_with: &["regrasp_robot"],
    },
    floor("regrasp_cli", &["regrasp_features", "regrasp", "regrasp_bench"]),
    floor("regrasp_python", &["regrasp_features", "regrasp"]),
];

/// Outside crates that belong to named crates only.
const PRIVATE: &[(&str, &[&str])] = &[
    ("parry3d-f64", &["regrasp_geometry"]),
    // The viewer reads its own pictures back, in tests.
    ("roxmltree", &["regrasp_geometry", "regrasp_robot", "regrasp_viewer"]),
    ("clap", &["regrasp_cli"]),
    ("ctrlc", &["regrasp_cli"]),
    ("pyo3", &["regrasp_python"]),
    ("zip", &["regrasp_export"]),
    ("clarabel", &["regrasp_grasp", "regrasp_plan"]),
    ("pulp", &["regrasp_arms"]),
    ("wide", &["regrasp_robot"]),
    ("robust", &["regrasp_geometry"]),
    ("saphyr-parser", &["regrasp_grasp"]),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A direct dependency: the crate that is needed, and by what: nothing for what ships, else `dev` or `build`.
type Need = (String, Option<String>);

/// Direct dependencies of every crate of the workspace.
fn dependencies() -> BTreeMap<String, BTreeSet<Need>> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo metadata runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata is JSON");
    let text = |value: &Value| value.as_str().expect("a string").to_owned();
    let need = |need: &Value| (text(&need["name"]), need["kind"].as_str().map(str::to_owned));
    let packages = metadata["packages"].as_array().expect("packages");
    let of = |package: &Value| package["dependencies"].as_array().expect("dependencies").iter().map(need).collect();
    // Tasks of developers: they run programs and know no crate.
    let packages = packages.iter().filter(|package| package["name"] != "xtask");
    packages.map(|package| (text(&package["name"]), of(package))).collect()
}

#[test]
fn every_crate_stands_on_lower_floors_only() {
    let dependencies = dependencies();
    let ours: BTreeSet<&str> = TOWER.iter().map(|floor| floor.name).collect();
    let found: BTreeSet<&str> = dependencies.keys().map(String::as_str).collect();
    assert_eq!(found, ours, "a crate joined or left the workspace: change TOWER and ARCHITECTURE.md too");
    for Floor { name, ships_with, tests_with } in TOWER {
        let kinds = dependencies[*name].iter().filter(|(need, _)| ours.contains(need.as_str()));
        for (need, kind) in kinds {
            let need = need.as_str();
            let may = match kind.as_deref() {
                None => ships_with.contains(&need),
                Some("dev") => ships_with.contains(&need) || tests_with.contains(&need),
                Some(_) => false,
            };
            let kind = kind.as_deref().unwrap_or("normal");
            assert!(may, "{name} must not depend on {need} (a dependency of the kind \"{kind}\")");
        }
    }
}

/// A row that allows more than is needed is no wall.
#[test]
fn the_tower_allows_no_more_than_is_needed_by_tests() {
    let dependencies = dependencies();
    for Floor { name, tests_with, .. } in TOWER {
        for need in *tests_with {
            let is_needed = dependencies[*name].contains(&((*need).to_owned(), Some("dev".to_owned())));
            assert!(is_needed, "the tests of {name} do without {need}: change TOWER");
        }
    }
}

#[test]
fn the_tower_has_no_way_up() {
    for (index, Floor { name, ships_with, tests_with }) in TOWER.iter().enumerate() {
        for need in ships_with.iter().chain(*tests_with) {
            let below = TOWER[..index].iter().any(|lower| lower.name == *need);
            assert!(below, "{name} may use {need}, which does not stand below it");
        }
    }
}

/// Faces show plans; they do not make them.
#[test]
fn exporters_and_viewer_ship_without_planners() {
    for Floor { name, ships_with, .. } in
        TOWER.iter().filter(|floor| ["regrasp_export", "regrasp_viewer"].contains(&floor.name))
    {
        for planner in ["regrasp_planners", "regrasp_manipulation", "regrasp_roadmap", "regrasp_grasp"] {
            assert!(!ships_with.contains(&planner), "{name} must not ship with {planner}");
        }
    }
}

/// The checker shares nothing but its results: only plans that are broken for its tests look at how it works.
#[test]
fn nobody_looks_inside_the_checker() {
    let inside = [
        "kinematics",
        "bodies",
        "between",
        "motion",
        "contact",
        "tip",
        "model",
        "surface",
        "rolling",
        "slip",
        "robots",
    ];
    for floor in TOWER.iter().filter(|floor| !["regrasp_plan", "regrasp_mutations"].contains(&floor.name)) {
        for file in sources(&root().join("crates").join(floor.name).join("src")) {
            let text = std::fs::read_to_string(&file).expect("a source file is readable");
            for room in inside {
                assert!(!text.contains(&format!("check::{room}::")), "{} looks into check::{room}", file.display());
            }
        }
    }
}

#[test]
fn private_dependencies_stay_private() {
    for (name, needs) in dependencies() {
        for &(library, owners) in PRIVATE {
            let needs_it = needs.iter().any(|(need, _)| need == library);
            assert!(!needs_it || owners.contains(&name.as_str()), "{name} must not depend on {library}");
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
    for name in TOWER.iter().map(|floor| floor.name).filter(|name| !faces.contains(name)) {
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
    for Floor { name, .. } in TOWER {
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
