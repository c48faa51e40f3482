//! Motions of a whole robot through the commands.

use crate::folder::{Folder, Run};
use crate::places::repository;
use serde_json::Value;
use std::fs;

const SCENE: &str = "scenes/two_arms/among_lamps.toml";

/// A folder with the bundled scene and its robot, where a repository has them.
fn folder() -> Folder {
    let folder = Folder::new();
    for path in ["assets/robots/two_arms", "assets/hands/wide_four_finger", "scenes/two_arms"] {
        fs::create_dir_all(folder.path(path)).unwrap();
        for entry in fs::read_dir(repository().join(path)).unwrap() {
            let from = entry.unwrap().path();
            if from.is_file() {
                fs::copy(&from, folder.path(path).join(from.file_name().unwrap())).unwrap();
            }
        }
    }
    folder
}

#[track_caller]
fn succeeds(run: Run) -> Run {
    assert_eq!(run.code, Some(0), "{run:?}");
    run
}

#[test]
fn a_motion_goes_through_every_command() {
    let folder = folder();
    for task in ["swing", "carry"] {
        let name = |ending: &str| format!("{task}{ending}");
        let plan = name(".json");
        succeeds(folder.run(&["plan", SCENE, "--task", task, "-o", &plan]));
        let file: Value = serde_json::from_slice(&fs::read(folder.path(&plan)).unwrap()).unwrap();
        assert_eq!(
            (&file["task"], &file["query"], &file["format_version"]),
            (&"motion".into(), &task.into(), &3.into())
        );
        let checked = succeeds(folder.run(&["check", &plan, "--scene", SCENE]));
        assert!(checked.err.contains("ACCEPTED"), "{checked:?}");
        assert_eq!(checked.err.contains("taken for granted"), task == "carry", "{checked:?}");
        let [page, png, charts] = [".html", ".png", ".charts"].map(name);
        fs::create_dir_all(folder.path(&charts)).unwrap();
        succeeds(folder.run(&["view", &plan, SCENE, "-o", &page]));
        succeeds(folder.run(&["view", &plan, SCENE, "--png", &png, "--frames", "2", "--width", "240"]));
        succeeds(folder.run(&["view", &plan, SCENE, "--svg", &charts]));
        assert!(fs::read(folder.path(&png)).unwrap().starts_with(b"\x89PNG"));
        let [npz, ros2, mjcf] = [".npz", ".yaml", ".xml"].map(name);
        let export = ["export", &plan, "--scene", SCENE, "--npz", &npz, "--ros2", &ros2, "--mjcf", &mjcf];
        succeeds(folder.run(&export));
        assert!(fs::read(folder.path(&npz)).unwrap().starts_with(b"PK"));
        assert!(fs::read_to_string(folder.path(&ros2)).unwrap().contains("joint_names"));
        assert!(fs::read_to_string(folder.path(&mjcf)).unwrap().contains("<mujoco"));
    }
    // A plan with one thing changed is rejected.
    let mut file: Value = serde_json::from_slice(&fs::read(folder.path("carry.json")).unwrap()).unwrap();
    file["segments"][0]["waypoints"][1]["world_from_objects"][0]["position"][0] = 9.0.into();
    folder.write("slipped.json", serde_json::to_vec(&file).unwrap());
    let run = folder.run(&["check", "slipped.json", "--scene", SCENE]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("REJECTED") && run.err.contains("GraspChanges"), "{run:?}");
}

#[test]
fn what_has_no_meaning_for_a_motion_is_refused() {
    let folder = folder();
    for (arguments, code) in [
        (&["plan", SCENE, "--task", "swing", "--margin", "0.01"][..], "A507"),
        (&["plan", SCENE, "--task", "swing", "--hold"], "A507"),
        (&["bench", SCENE, "--seeds", "1"], "A507"),
        (&["roadmap", "build", SCENE, "-o", "a.roadmap"], "A507"),
    ] {
        let run = folder.run(arguments);
        assert_eq!(run.code, Some(2), "{arguments:?}: {run:?}");
        assert!(run.err.contains(code), "{arguments:?}: {run:?}");
    }
}
