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
    ] {
        let run = folder.run(arguments);
        assert_eq!(run.code, Some(2), "{arguments:?}: {run:?}");
        assert!(run.err.contains(code), "{arguments:?}: {run:?}");
    }
}

#[test]
fn a_roadmap_of_a_robot_is_built_used_and_refused_elsewhere() {
    let folder = folder();
    folder.write("small.json", r#"{"nodes_per_arm": 5}"#);
    let build = ["roadmap", "build", SCENE, "--task", "swing", "--build-settings", "small.json", "-o", "a.json"];
    let built = succeeds(folder.run(&build));
    assert!(built.err.contains("nodes"), "{built:?}");
    let info = succeeds(folder.run(&["roadmap", "info", "a.json"]));
    assert!(info.out.contains("motion") && info.out.contains("nodes"), "{info:?}");
    let plan = |out: &str| folder.run(&["plan", SCENE, "--task", "swing", "--roadmap", "a.json", "-o", out]);
    succeeds(plan("plan.json"));
    succeeds(plan("again.json"));
    assert_eq!(fs::read(folder.path("plan.json")).unwrap(), fs::read(folder.path("again.json")).unwrap());
    // Beside the scene it is found.
    fs::copy(folder.path("a.json"), folder.path("scenes/two_arms/among_lamps.roadmap.json")).unwrap();
    let beside = succeeds(folder.run(&["plan", SCENE, "--task", "swing", "-o", "beside.json"]));
    assert!(beside.err.contains("among_lamps.roadmap.json"), "{beside:?}");
    // Other obstacles: refused where it is named, left out where it is not.
    let scene = fs::read_to_string(folder.path(SCENE)).unwrap();
    folder.write(
        SCENE,
        scene + "\n[[obstacles]]\nname = \"far\"\nbox = { size = [0.1, 0.1, 0.1] }\nposition = [5, 5, 5]\n",
    );
    let run = plan("other.json");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("R616") && run.err.contains("what rests around the robot"), "{run:?}");
    let run = succeeds(folder.run(&["plan", SCENE, "--task", "swing", "-o", "other.json"]));
    assert!(run.err.contains("is not used"), "{run:?}");
    folder.write("b.json", "{}");
    let run = folder.run(&["plan", SCENE, "--task", "swing", "--roadmap", "b.json"]);
    assert!(run.code == Some(2) && run.err.contains("R601"), "{run:?}");
    // Nothing to grow, and a roadmap of other obstacles.
    fs::remove_file(folder.path("scenes/two_arms/among_lamps.roadmap.json")).unwrap();
    for named in [&[][..], &["--roadmap", "a.json"]] {
        let run = folder.run(&[&["plan", SCENE, "--task", "swing", "--grow"], named].concat());
        assert!(run.code == Some(2) && (run.err.contains("A507") || run.err.contains("R616")), "{run:?}");
    }
}

#[test]
fn a_roadmap_of_a_robot_grows_and_is_saved() {
    let folder = folder();
    let scene = repository().join("scenes/two_arms/justin_horse_wall.toml");
    let scene = scene.to_str().unwrap();
    folder.write("small.json", r#"{"nodes_per_arm": 2, "exchanges": 0, "tries": 0}"#);
    succeeds(folder.run(&["roadmap", "build", scene, "--build-settings", "small.json", "-o", "a.json"]));
    let read = || fs::read(folder.path("a.json")).unwrap();
    let (mut n_grown, mut n_known) = (0, 0);
    for seed in ["0", "1", "2", "3"] {
        let before = read();
        let run =
            succeeds(folder.run(&["plan", scene, "--roadmap", "a.json", "--grow", "-o", "plan.json", "--seed", seed]));
        assert!(run.err.contains("ACCEPTED"), "{run:?}");
        // What is said is what is written.
        let is_known = run.err.contains("grown  by nothing");
        assert_eq!(is_known, before == read(), "{run:?}");
        assert!(is_known || read().len() > before.len(), "{run:?}");
        (n_grown, n_known) = (n_grown + u32::from(!is_known), n_known + u32::from(is_known));
    }
    assert!(n_grown > 0 && n_known > 0, "{n_grown} {n_known}");
    let info = succeeds(folder.run(&["roadmap", "info", "a.json"]));
    assert!(info.out.contains("1 exchange"), "{info:?}");
}
