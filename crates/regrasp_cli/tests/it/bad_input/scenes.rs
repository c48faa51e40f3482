//! Scene files.

use super::{complains, edit_is_refused, edit_is_refused_somewhere, refused};
use crate::folder::Folder;

#[test]
fn scene_that_is_not_there() {
    let folder = Folder::new();
    complains(&folder.run(&["plan", "scen.toml"]), "F001", "scen.toml", &["No such file"]);
}

#[test]
fn scene_that_is_a_folder() {
    let folder = Folder::new();
    complains(&folder.run(&["plan", "."]), "F001", ".", &["not a regular file"]);
}

#[test]
fn scene_with_a_key_that_is_not_known() {
    edit_is_refused(
        "scene.toml",
        "name = \"ball\"",
        "edge_distanse = 0.004\nname = \"ball\"",
        "S101",
        &["edge_distanse", "edge_distance"],
    );
}

#[test]
fn scene_without_a_goal() {
    let folder = Folder::new();
    folder.edit("scene.toml", "[goal]\nturn = { axis = \"x\", angle_deg = 90 }\n", "");
    refused(&folder, "S102", "scene.toml", &["goal", "turn"]);
}

#[test]
fn scene_that_is_not_toml() {
    edit_is_refused("scene.toml", "mass = 0.1", "mass = 0,1", "S100", &["0.1"]);
}

#[test]
fn scene_of_another_format() {
    edit_is_refused("scene.toml", "\"regrasp-scene\"", "\"moveit-scene\"", "S105", &["moveit-scene", "regrasp-scene"]);
}

#[test]
fn scene_with_negative_friction() {
    edit_is_refused("scene.toml", "friction = 0.8", "friction = -0.8", "S107", &["friction", "-0.8"]);
}

#[test]
fn scene_with_friction_that_is_not_a_number() {
    edit_is_refused("scene.toml", "friction = 0.8", "friction = nan", "V001", &["friction", "nan"]);
}

#[test]
fn scene_with_an_object_of_negative_mass() {
    edit_is_refused("scene.toml", "mass = 0.1", "mass = -0.1", "S107", &["mass", "-0.1"]);
}

#[test]
fn scene_with_a_ball_of_no_size() {
    edit_is_refused("scene.toml", "radius = 0.032", "radius = 0.0", "S107", &["radius"]);
}

#[test]
fn scene_with_a_quaternion_that_is_zero() {
    edit_is_refused("scene.toml", "position = [", "quat_xyzw = [0, 0, 0, 0]\nposition = [", "V003", &["quat_xyzw"]);
}

#[test]
fn scene_with_a_quaternion_that_is_too_long() {
    edit_is_refused(
        "scene.toml",
        "position = [",
        "quat_xyzw = [0, 0, 1, 1]\nposition = [",
        "V002",
        &["quat_xyzw", "1.41"],
    );
}

#[test]
fn scene_with_an_object_out_of_reach() {
    let folder = Folder::new();
    let line = folder.edit("scene.toml", "0.078]", "0.9]");
    refused(&folder, "P302", &format!("scene.toml:{}", line - 1), &["\"start\"", "0.9", "reach", "metres"]);
}

#[test]
fn scene_with_a_start_grasp_of_unknown_joints() {
    let grasp = "0.078]\ngrasp = { joints = { est_abduction = 0.1 } }";
    let folder = Folder::new();
    folder.edit("scene.toml", "0.078]", grasp);
    refused(&folder, "S120", "scene.toml:16", &["est_abduction", "east_abduction"]);
}

#[test]
fn scene_with_a_start_grasp_beyond_a_limit() {
    let folder = Folder::new();
    folder.edit("scene.toml", "0.078]", "0.078]\ngrasp = { joints = { east_abduction = 2.5 } }");
    refused(&folder, "P303", "scene.toml:16", &["east_abduction", "2.5", "0.61"]);
}

#[test]
fn scene_of_no_bytes() {
    let folder = Folder::new();
    folder.write("scene.toml", "");
    refused(&folder, "S100", "scene.toml", &["empty"]);
}

#[test]
fn scene_that_is_a_robot_or_a_hand() {
    let folder = Folder::new();
    complains(&folder.run(&["plan", "hand.urdf"]), "S100", "hand.urdf", &["XML"]);
    complains(&folder.run(&["plan", "hand.toml"]), "S105", "hand.toml:2", &["regrasp-hand", "regrasp-scene"]);
}

#[test]
fn scene_with_a_key_twice() {
    let folder = Folder::new();
    let line = folder.edit("scene.toml", "mass = 0.1", "mass = 0.1\nmass = 0.2");
    refused(&folder, "S100", &format!("scene.toml:{}", line + 1), &["duplicate key"]);
}

#[test]
fn scene_with_a_goal_that_is_not_a_number() {
    edit_is_refused("scene.toml", "angle_deg = 90", "angle_deg = nan", "V001", &["goal.turn.angle_deg", "nan"]);
}

#[test]
fn scene_with_a_goal_out_of_reach() {
    let folder = Folder::new();
    folder.edit("scene.toml", "turn = { axis = \"x\", angle_deg = 90 }", "position = [0.0, 0.0, 1.5]");
    refused(&folder, "P302", "scene.toml:17", &["\"goal\"", "1.5", "reach"]);
}

#[test]
fn scene_with_a_position_of_nonsense() {
    edit_is_refused_somewhere("scene.toml", "0.078]", "1e300]", "P302", "scene.toml:14", &["1e300", "reach"]);
}

#[test]
fn scene_of_another_version() {
    edit_is_refused("scene.toml", "format_version = 1", "format_version = 3", "S105", &["format_version", "3", "1"]);
}

#[test]
fn scene_in_latin_1() {
    let folder = Folder::new();
    let mut bytes = std::fs::read(folder.path("scene.toml")).unwrap();
    let line = bytes.iter().filter(|&&byte| byte == b'\n').count() + 1;
    bytes.extend(b"# caf\xe9\n");
    folder.write("scene.toml", bytes);
    refused(&folder, "F002", &format!("scene.toml:{line}"), &["Latin-1"]);
}
