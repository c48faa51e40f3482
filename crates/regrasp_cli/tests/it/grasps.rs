//! `regrasp grasps` and what other commands do with its lists.

use crate::folder::{Folder, Run};
use crate::places::repository;
use serde_json::Value;
use std::fs;

const HAND: &str = "assets/hands/wide_four_finger/hand.toml";
const SCENE: &str = "scenes/box_90x.toml";

fn folder() -> Folder {
    let folder = Folder::new();
    let hand = "assets/hands/wide_four_finger";
    fs::create_dir_all(folder.path(hand)).unwrap();
    fs::create_dir_all(folder.path("scenes")).unwrap();
    for file in ["hand.toml", "hand.urdf"] {
        let file = format!("{hand}/{file}");
        folder.write(&file, fs::read(repository().join(&file)).unwrap());
    }
    folder.write(SCENE, fs::read(repository().join(SCENE)).unwrap());
    folder
}

#[track_caller]
fn succeeds(run: Run) -> Run {
    assert_eq!(run.code, Some(0), "{run:?}");
    run
}

#[test]
fn a_list_is_made_judged_shown_and_exported() {
    let folder = folder();
    let ask = |output: &str, threads: &str| {
        folder.run(&[
            "grasps",
            HAND,
            SCENE,
            "-o",
            output,
            "--grasps",
            "6",
            "--threads",
            threads,
            "--report",
            "page.html",
        ])
    };
    succeeds(ask("grasps.json", "2"));
    succeeds(ask("again.json", "1"));
    let bytes = fs::read(folder.path("grasps.json")).unwrap();
    assert_eq!(bytes, fs::read(folder.path("again.json")).unwrap(), "threads change nothing");
    let list: Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(list["grasps"].as_array().unwrap().len(), 6);
    assert_eq!(list["source"]["hand"], HAND);
    succeeds(folder.run(&["check", "grasps.json"]));
    succeeds(folder.run(&["check", "grasps.json", "--hand", HAND, "--object", SCENE]));
    succeeds(folder.run(&["view", "grasps.json", "-o", "gallery.html"]));
    let page = fs::read_to_string(folder.path("gallery.html")).unwrap();
    assert_eq!(page, fs::read_to_string(folder.path("page.html")).unwrap());
    assert_eq!(page.matches("<figure").count(), 6);
    let small = ["--frames", "2", "--width", "400"];
    succeeds(folder.run(&[&["view", "grasps.json", "--png", "two.png"], &small[..]].concat()));
    succeeds(folder.run(&[&["view", "grasps.json", "--png", "again.png"], &small[..]].concat()));
    let picture = fs::read(folder.path("two.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 4_000, "{} bytes", picture.len());
    assert_eq!(picture, fs::read(folder.path("again.png")).unwrap());
    succeeds(folder.run(&["export", "grasps.json", "--isaac", "i.yaml", "--moveit", "m.yaml", "--npz", "g.npz"]));
    let isaac = fs::read_to_string(folder.path("i.yaml")).unwrap();
    assert!(isaac.contains("format: isaac_grasp") && isaac.matches("confidence:").count() == 6);
    assert_eq!(fs::read_to_string(folder.path("m.yaml")).unwrap().matches("- id: grasp_").count(), 6);
    assert!(fs::read(folder.path("g.npz")).unwrap().starts_with(b"PK"));
}

#[test]
fn broken_lists_and_senseless_arguments_are_refused() {
    let folder = folder();
    succeeds(folder.run(&["grasps", HAND, SCENE, "-o", "grasps.json", "--grasps", "2"]));
    let text = fs::read_to_string(folder.path("grasps.json")).unwrap();
    let at = text.rfind("\"margin\":").unwrap() + 9;
    let end = at + text[at..].find(',').unwrap();
    folder.write("raised.json", format!("{}0.9{}", &text[..at], &text[end..]));
    let rejected = folder.run(&["check", "raised.json"]);
    assert_eq!(rejected.code, Some(1), "{rejected:?}");
    let is_refused = |arguments: &[&str], code: &str| {
        let run = folder.run(arguments);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(format!("{run:?}").contains(code), "{code}: {run:?}");
    };
    is_refused(&["grasps", HAND, SCENE, "--mass", "0.2"], "A511");
    is_refused(&["grasps", HAND, SCENE, "--friction-margin", "0.5"], "A503");
    is_refused(&["grasps", HAND, "missing.obj"], "S110");
    is_refused(&["export", "grasps.json", "--ros2", "r.yaml"], "A512");
    is_refused(&["view", "grasps.json", "--svg", "charts"], "A512");
    is_refused(&["view", "grasps.json", "--png", "p.png", "--frames", "0"], "A505");
    is_refused(&["check", SCENE, "--hand", HAND], "A512");
    folder.write(
        "other.json",
        text.replace("regrasp-grasps\",\n  \"format_version\": 1", "regrasp-grasps\",\n  \"format_version\": 9"),
    );
    is_refused(&["check", "other.json"], "G703");
    fs::remove_file(folder.path(SCENE)).unwrap();
    is_refused(&["check", "grasps.json"], "G720");
}

#[test]
fn no_grasp_is_told_with_its_causes() {
    let folder = folder();
    let none = folder.run(&["grasps", HAND, SCENE, "--margin", "0.9", "--frames", "500"]);
    assert_eq!(none.code, Some(1), "{none:?}");
    assert!(
        format!("{none:?}").contains("NO GRASP") && format!("{none:?}").contains("the best contacts seen"),
        "{none:?}"
    );
}

/// Also those that the scene names which they are made from: lists are no inputs of a list.
#[test]
fn bundled_lists_are_accepted() {
    let folder = Folder::new();
    let lists = repository().join("scenes/two_arms");
    let mut n_judged = 0;
    for entry in fs::read_dir(lists).unwrap() {
        let path = entry.unwrap().path();
        // Lists of shared models are judged in the tests of their scenes.
        let is_own = |name: &str| ["bar.", "block.", "horse.", "impossible_"].iter().any(|own| name.starts_with(own));
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name.ends_with(".grasps.json") && is_own(&name) {
            succeeds(folder.run(&["check", &path.to_string_lossy()]));
            n_judged += 1;
        }
    }
    assert_eq!(n_judged, 7);
}
