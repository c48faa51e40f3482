//! Bad inputs (`reliability.md` B4): exit code 2, one clear message with file, line, element, value and fix, no panic,
//! and nothing written.

use crate::folder::{Folder, Run};

/// Plans the folder's scene and expects exactly one complaint: `code`, at `place`, with every part of `says`.
#[track_caller]
fn refused(folder: &Folder, code: &str, place: &str, says: &[&str]) {
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--max-work", "1"]);
    complains(&run, code, place, says);
    assert!(!folder.path("plan.json").exists(), "a plan was written in spite of bad input");
}

#[track_caller]
fn complains(run: &Run, code: &str, place: &str, says: &[&str]) {
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.out.is_empty(), "{run:?}");
    assert!(!run.err.contains("panicked"), "{}", run.err);
    let complaints: Vec<&str> = run.err.lines().filter(|line| is_complaint(line)).collect();
    assert_eq!(complaints.len(), 1, "one cause, one message:\n{}", run.err);
    let head = complaints[0].trim_start_matches("error: ");
    assert!(head.starts_with(&format!("{code} ")), "expected {code}:\n{}", run.err);
    assert!(head.contains(place), "expected the place {place}:\n{}", run.err);
    for part in says {
        assert!(run.err.contains(part), "expected {part:?} in:\n{}", run.err);
    }
}

/// A line such as `error: U120 hand.urdf:42:9 joint "j2": ...`.
fn is_complaint(line: &str) -> bool {
    let code = line.trim_start_matches("error: ").split(' ').next().unwrap_or_default();
    code.len() == 4
        && code.starts_with(|c: char| c.is_ascii_uppercase())
        && code[1..].bytes().all(|b| b.is_ascii_digit())
}

/// Breaks `file` by replacing `old` with `new`, and expects the complaint on that line.
#[track_caller]
fn edit_is_refused(file: &str, old: &str, new: &str, code: &str, says: &[&str]) {
    let folder = Folder::new();
    let line = folder.edit(file, old, new);
    refused(&folder, code, &format!("{file}:{line}"), says);
}

const FIRST_LIMIT: &str = r#"<limit lower="-0.6108652382" upper="0.6108652382" effort="1.0" velocity="4.0"/>"#;
const PALM_SHAPE: &str = r#"<geometry><cylinder radius="0.055" length="0.01"/></geometry>"#;

fn palm_mesh(filename: &str) -> String {
    format!(r#"<geometry><mesh filename="{filename}"/></geometry>"#)
}

// Robot files.

#[test]
fn urdf_package_that_is_nowhere() {
    let mesh = palm_mesh("package://lost_hand/meshes/palm.stl");
    edit_is_refused(
        "hand.urdf",
        PALM_SHAPE,
        &mesh,
        "U101",
        &["link \"palm\"", "package://lost_hand/meshes/palm.stl", "looked in", "--package lost_hand=DIR"],
    );
}

#[test]
fn urdf_package_path_without_a_file() {
    edit_is_refused("hand.urdf", PALM_SHAPE, &palm_mesh("package://lost_hand"), "U102", &["palm", "no path after"]);
}

#[test]
fn urdf_mesh_without_a_name() {
    edit_is_refused("hand.urdf", PALM_SHAPE, &palm_mesh(""), "U102", &["palm", "empty"]);
}

#[test]
fn urdf_mesh_from_the_network() {
    edit_is_refused(
        "hand.urdf",
        PALM_SHAPE,
        &palm_mesh("http://example.org/palm.stl"),
        "U103",
        &["palm", "never fetched"],
    );
}

#[test]
fn urdf_mesh_outside_the_package() {
    let mesh = palm_mesh("../../../../../../../etc/hostname.stl");
    let folder = Folder::new();
    let line = folder.edit("hand.urdf", PALM_SHAPE, &mesh);
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json"]);
    // Whether the file exists must make no difference that matters: it is not read.
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains(&format!("hand.urdf:{line}")) && run.err.contains("palm"), "{}", run.err);
}

#[test]
fn urdf_limit_that_is_not_a_number() {
    edit_is_refused(
        "hand.urdf",
        r#"upper="0.6108652382""#,
        r#"upper="nan""#,
        "V001",
        &["joint \"east_abduction\"", "upper"],
    );
}

#[test]
fn urdf_number_with_a_comma() {
    edit_is_refused(
        "hand.urdf",
        r#"upper="0.6108652382""#,
        r#"upper="0,61""#,
        "U110",
        &["0,61", "0.61", "east_abduction"],
    );
}

#[test]
fn urdf_number_that_is_too_large() {
    edit_is_refused("hand.urdf", r#"upper="0.6108652382""#, r#"upper="1e999""#, "U110", &["1e999", "east_abduction"]);
}

#[test]
fn urdf_origin_with_two_numbers() {
    edit_is_refused("hand.urdf", r#"xyz="0 0 -0.013""#, r#"xyz="0 -0.013""#, "U111", &["xyz", "palm", "2 numbers"]);
}

#[test]
fn urdf_revolute_joint_without_limit() {
    let folder = Folder::new();
    folder.edit("hand.urdf", FIRST_LIMIT, "");
    refused(&folder, "U120", "hand.urdf:13", &["joint \"east_abduction\"", "revolute", "<limit", "continuous"]);
}

#[test]
fn urdf_limits_the_wrong_way_round() {
    edit_is_refused("hand.urdf", r#"lower="-0.6108652382""#, r#"lower="2""#, "U121", &["east_abduction", "2", "0.61"]);
}

#[test]
fn urdf_axis_of_no_direction() {
    edit_is_refused(
        "hand.urdf",
        r#"<axis xyz="1 0 0"/>"#,
        r#"<axis xyz="0 0 0"/>"#,
        "U122",
        &["east_abduction", "axis"],
    );
}

#[test]
fn urdf_joint_of_a_type_that_is_not_supported() {
    edit_is_refused(
        "hand.urdf",
        r#"name="east_abduction" type="revolute""#,
        r#"name="east_abduction" type="planar""#,
        "U125",
        &["planar", "east_abduction"],
    );
}

#[test]
fn urdf_mimic_of_a_joint_that_is_not_there() {
    let mimic = format!("{FIRST_LIMIT}<mimic joint=\"est_distal_flexion\"/>");
    edit_is_refused(
        "hand.urdf",
        FIRST_LIMIT,
        &mimic,
        "U140",
        &["east_abduction", "est_distal_flexion", "east_distal_flexion"],
    );
}

#[test]
fn urdf_mimic_of_itself() {
    let mimic = format!("{FIRST_LIMIT}<mimic joint=\"east_abduction\"/>");
    let folder = Folder::new();
    folder.edit("hand.urdf", FIRST_LIMIT, &mimic);
    refused(&folder, "U141", "hand.urdf:13", &["east_abduction", "cycle"]);
}

#[test]
fn urdf_two_links_of_one_name() {
    edit_is_refused(
        "hand.urdf",
        r#"<link name="north_base"/>"#,
        r#"<link name="north_base"/><link name="north_base"/>"#,
        "U131",
        &["north_base", "65"],
    );
}

#[test]
fn urdf_joint_to_a_link_that_is_not_there() {
    edit_is_refused(
        "hand.urdf",
        r#"<child link="east_base"/>"#,
        r#"<child link="east_bas"/>"#,
        "U132",
        &["east_abduction", "east_bas", "east_base"],
    );
}

#[test]
fn urdf_with_two_roots() {
    let folder = Folder::new();
    folder.edit("hand.urdf", r#"<link name="palm">"#, "<link name=\"table\"/><link name=\"palm\">");
    refused(&folder, "U133", "hand.urdf:3", &["palm", "table", "fixed joints"]);
}

#[test]
fn urdf_sphere_of_negative_radius() {
    edit_is_refused(
        "hand.urdf",
        r#"<sphere radius="0.005"/>"#,
        r#"<sphere radius="-0.005"/>"#,
        "U151",
        &["east_tip", "-0.005"],
    );
}

#[test]
fn urdf_mesh_scale_zero() {
    let folder = Folder::new();
    folder.write("palm.obj", TETRAHEDRON);
    let mesh = r#"<geometry><mesh filename="palm.obj" scale="1 0 1"/></geometry>"#;
    let line = folder.edit("hand.urdf", PALM_SHAPE, mesh);
    refused(&folder, "U152", &format!("hand.urdf:{line}"), &["palm", "scale", "1 0 1"]);
}

#[test]
fn urdf_with_a_document_type() {
    edit_is_refused(
        "hand.urdf",
        "<?xml version=\"1.0\"?>",
        "<?xml version=\"1.0\"?><!DOCTYPE robot [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;\">]>",
        "U104",
        &["DTD", "remove"],
    );
}

#[test]
fn urdf_that_is_cut_off() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(folder.path("hand.urdf")).unwrap();
    folder.write("hand.urdf", &text[..text.len() / 2]);
    refused(&folder, "U100", "hand.urdf:", &[]);
}

#[test]
fn urdf_in_utf_16() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(folder.path("hand.urdf")).unwrap();
    let mut bytes = vec![0xff, 0xfe];
    bytes.extend(text.encode_utf16().flat_map(u16::to_le_bytes));
    folder.write("hand.urdf", bytes);
    refused(&folder, "F002", "hand.urdf", &["UTF-16", "iconv"]);
}

#[test]
fn urdf_without_links() {
    let folder = Folder::new();
    folder.write("hand.urdf", "<robot name=\"nothing\"/>");
    refused(&folder, "U130", "hand.urdf:1", &["<link>"]);
}

#[test]
fn names_in_messages_cannot_drive_a_terminal() {
    let folder = Folder::new();
    folder.edit("hand.toml", r#"tip_link = "east_tip""#, "tip_link = \"east\\u001b[2J\\u202etip\"");
    let run = folder.run(&["plan", "scene.toml"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(!run.err.contains('\u{1b}') && !run.err.contains('\u{202e}'), "{}", run.err);
}

// Hand files and SRDF.

#[test]
fn hand_with_a_tip_link_that_is_not_there() {
    edit_is_refused(
        "hand.toml",
        r#"tip_link = "east_tip""#,
        r#"tip_link = "est_tip""#,
        "U205",
        &["est_tip", "east_tip"],
    );
}

#[test]
fn hand_with_a_key_that_is_not_known() {
    edit_is_refused("hand.toml", "base_link", "bass_link", "U201", &["bass_link", "base_link"]);
}

#[test]
fn hand_with_a_tip_of_no_size() {
    edit_is_refused("hand.toml", "radius = 0.005", "radius = 0", "U213", &["radius", "point"]);
}

#[test]
fn hand_of_another_version() {
    edit_is_refused("hand.toml", "version = 1", "version = 7", "U204", &["version", "1"]);
}

#[test]
fn srdf_with_a_link_that_is_not_there() {
    let folder = Folder::new();
    folder.write(
        "hand.srdf",
        "<robot name=\"wide_four_finger\">\n<disable_collisions link1=\"palm\" link2=\"est_proximal\" reason=\"Never\"/>\n</robot>",
    );
    folder.edit("hand.toml", "base_link", "srdf = \"hand.srdf\"\nbase_link");
    refused(&folder, "U161", "hand.srdf:2", &["est_proximal", "east_proximal"]);
}

// Scene files.

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
    folder.edit("scene.toml", "[goal]\nturn = { axis = \"z\", angle_deg = 180 }\n", "");
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

// Meshes.

const TETRAHEDRON: &str = "v 0 0 0\nv 0.05 0 0\nv 0 0.05 0\nv 0 0 0.05\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// Makes the object a mesh of `content` in `file`, and expects the complaint at `place`.
#[track_caller]
fn mesh_is_refused(file: &str, content: impl AsRef<[u8]>, code: &str, place: &str, says: &[&str]) {
    let folder = Folder::new();
    folder.write(file, content);
    folder.edit("scene.toml", "sphere = { radius = 0.032 }", &format!("mesh = {{ file = \"{file}\" }}"));
    refused(&folder, code, place, says);
}

#[test]
fn mesh_that_is_not_there() {
    edit_is_refused(
        "scene.toml",
        "sphere = { radius = 0.032 }",
        "mesh = { file = \"mug.stl\" }",
        "S110",
        &["mug.stl", "does not exist"],
    );
}

#[test]
fn mesh_in_millimetres() {
    let millimetres = TETRAHEDRON.replace("0.05", "50");
    mesh_is_refused("mug.obj", millimetres, "M201", "scene.toml", &["50", "millimetres", "scale"]);
}

#[test]
fn mesh_file_of_no_bytes() {
    mesh_is_refused("mug.stl", "", "M202", "mug.stl", &["empty"]);
}

#[test]
fn stl_that_is_cut_off() {
    let mut bytes = vec![b' '; 80];
    bytes.extend(u32::MAX.to_le_bytes());
    bytes.extend([0; 500]);
    mesh_is_refused("mug.stl", bytes, "M230", "mug.stl", &["4294967295", "10"]);
}

#[test]
fn stl_with_a_corner_that_is_not_a_number() {
    let mut bytes = vec![b' '; 80];
    bytes.extend(1u32.to_le_bytes());
    for x in [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 0.0, 0.01, 0.0f32] {
        bytes.extend(x.to_le_bytes());
    }
    bytes.extend([0, 0]);
    mesh_is_refused("mug.stl", bytes, "M203", "mug.stl", &["NaN"]);
}

#[test]
fn obj_with_index_zero() {
    mesh_is_refused("mug.obj", TETRAHEDRON.replace("f 1 2 4", "f 0 2 4"), "M241", "mug.obj:6", &["0"]);
}

#[test]
fn obj_with_an_index_out_of_range() {
    mesh_is_refused("mug.obj", TETRAHEDRON.replace("f 1 2 4", "f 1 2 44"), "M241", "mug.obj:6", &["44", "4"]);
}

#[test]
fn obj_with_a_number_that_cannot_be_read() {
    mesh_is_refused("mug.obj", TETRAHEDRON.replace("v 0 0.05 0", "v 0 0,05 0"), "M240", "mug.obj:3", &["0,05", "0.05"]);
}

#[test]
fn mesh_without_area() {
    mesh_is_refused("mug.obj", "v 0 0 0\nv 0.01 0 0\nv 0.02 0 0\nf 1 2 3\n", "M202", "mug.obj", &["area"]);
}

#[test]
fn mesh_with_a_hole_and_no_centre_of_mass() {
    mesh_is_refused("mug.obj", TETRAHEDRON.replace("f 2 3 4\n", ""), "M210", "scene.toml", &["center_of_mass"]);
}

// Plan files.

/// Checks a plan file and expects the complaint.
#[track_caller]
fn plan_is_refused(content: impl AsRef<[u8]>, code: &str, place: &str, says: &[&str]) {
    let folder = Folder::new();
    folder.write("plan.json", content);
    complains(&folder.run(&["check", "plan.json"]), code, place, says);
}

const PLAN: &str = include_str!("../../../../fuzz/seeds/plan_json/plan.json");

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
    plan_is_refused(PLAN.replace("\"format_version\": 1", "\"format_version\": 9"), "C403", "plan.json:3", &["9", "1"]);
}

#[test]
fn plan_with_too_few_joints() {
    plan_is_refused(
        PLAN.replacen("0.1,\n", "", 1),
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

// Arguments.

#[test]
fn output_that_cannot_be_written_is_refused_before_planning() {
    let folder = Folder::new();
    let run = folder.run(&["plan", "scene.toml", "-o", "missing/plan.json"]);
    complains(&run, "F003", "missing/plan.json", &["cannot be written", "fix:"]);
    assert!(!run.err.contains("query"), "planning had begun:\n{}", run.err);
}

#[test]
fn arguments_that_make_no_sense() {
    let folder = Folder::new();
    for (arguments, says) in [
        (["--threads", "0"], "between 1 and"),
        (["--threads", "100000"], "between 1 and"),
        (["--time-limit", "0"], "seconds"),
        (["--time-limit", "-3"], "seconds"),
        (["--time-limit", "inf"], "seconds"),
        (["--margin", "1.5"], "[0, 1)"),
        (["--method", "clasic"], "classic"),
        (["--package", "allegro"], "NAME=DIR"),
    ] {
        // With = so that a negative number is a value and not a flag.
        let joined = arguments.join("=");
        let run = folder.run(&["plan", "scene.toml", &joined]);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(says) && run.err.contains(arguments[1]), "{}", run.err);
    }
}

/// Several causes in several files: all of them in one run.
#[test]
fn all_causes_are_reported_in_one_run() {
    let folder = Folder::new();
    folder.edit("hand.urdf", FIRST_LIMIT, "");
    folder.edit("scene.toml", "mass = 0.1", "mass = -1.0");
    folder.edit("scene.toml", "friction = 0.8", "friction = nan");
    let run = folder.run(&["plan", "scene.toml", "--json"]);
    assert_eq!(run.code, Some(2));
    for code in ["U120", "S107", "V001"] {
        assert!(run.err.contains(code), "{code} is missing:\n{}", run.err);
        assert!(run.out.contains(&format!("\"code\":\"{code}\"")), "{}", run.out);
    }
    assert!(run.out.ends_with("{\"event\":\"result\",\"exit_code\":2}\n"), "{}", run.out);
}
