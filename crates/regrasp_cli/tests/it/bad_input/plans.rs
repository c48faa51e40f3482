//! Plan files.

use super::complains;
use crate::folder::Folder;

/// Checks a plan file and expects the complaint.
#[track_caller]
fn plan_is_refused(content: impl AsRef<[u8]>, code: &str, place: &str, says: &[&str]) {
    let folder = Folder::new();
    folder.write("plan.json", content);
    complains(&folder.run(&["check", "plan.json"]), code, place, says);
}

const PLAN: &str = include_str!("../../../../../fuzz/seeds/plan_json/plan.json");

#[test]
fn plan_that_is_cut_off() {
    plan_is_refused(&PLAN[..PLAN.len() / 2], "C401", "plan.json:", &[]);
}

#[test]
fn plan_of_another_format() {
    plan_is_refused(
        PLAN.replace("\"regrasp-plan\"", "\"lerobot\""),
        "C402",
        "plan.json:2",
        &["lerobot", "regrasp-plan"],
    );
}

#[test]
fn plan_of_another_version() {
    plan_is_refused(
        PLAN.replace("\"format_version\": 3", "\"format_version\": 9"),
        "C403",
        "plan.json:3",
        &["9", "3", "2"],
    );
}

#[test]
fn plan_with_too_few_joints() {
    plan_is_refused(
        PLAN.replacen("\n0.1,\n", "\n", 1),
        "C404",
        "plan.json:",
        &["segments[0].waypoints[0].joints", "3", "4"],
    );
}

#[test]
fn plan_with_a_key_that_is_not_known() {
    plan_is_refused(
        PLAN.replacen("\"seed\": 1", "\"seed\": 1, \"sede\": 2", 1),
        "C401",
        "plan.json:",
        &["sede", "seed"],
    );
}

#[test]
fn plan_whose_scene_is_not_there() {
    let folder = Folder::new();
    std::fs::remove_file(folder.path("scene.toml")).unwrap();
    folder.write("plan.json", PLAN);
    complains(&folder.run(&["check", "plan.json"]), "C420", "plan.json", &["scene.toml", "--scene"]);
}

#[test]
fn plan_of_no_bytes() {
    plan_is_refused("", "C401", "plan.json:1", &["schema"]);
}

#[test]
fn plan_that_is_a_folder() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("plan.json")).unwrap();
    complains(&folder.run(&["check", "plan.json"]), "F001", "plan.json", &["not a regular file"]);
}

#[test]
fn plan_of_a_version_in_words() {
    let text = PLAN.replace("\"format_version\": 3", "\"format_version\": \"one\"");
    plan_is_refused(text, "C403", "plan.json:3", &["one", "3", "2"]);
}

#[test]
fn plan_with_a_key_twice() {
    plan_is_refused(PLAN.replacen("\"seed\": 1", "\"seed\": 1, \"seed\": 2", 1), "C401", "plan.json:", &["seed"]);
}

#[test]
fn plan_with_a_joint_beyond_all_numbers() {
    plan_is_refused(PLAN.replacen("\n0.1,\n", "\n1e999,\n", 1), "C401", "plan.json:", &["out of range"]);
    plan_is_refused(PLAN.replacen("\n0.1,\n", "\n1e300,\n", 1), "C409", "plan.json:", &["1e300", "joints"]);
}

#[test]
fn plan_with_something_after_it() {
    plan_is_refused(format!("{PLAN}rubbish"), "C401", "plan.json:", &["trailing"]);
}

#[test]
fn plan_that_is_a_scene() {
    let folder = Folder::new();
    complains(&folder.run(&["check", "scene.toml"]), "C401", "scene.toml:1", &["schema/plan.schema.json"]);
}
