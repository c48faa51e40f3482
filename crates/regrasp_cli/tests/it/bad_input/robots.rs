//! URDF, SRDF and hand files.

use super::{FIRST_LIMIT, TETRAHEDRON, complains, edit_is_refused, edit_is_refused_somewhere, refused};
use crate::folder::Folder;

const PALM_SHAPE: &str = r#"<geometry><cylinder radius="0.055" length="0.01"/></geometry>"#;

fn palm_mesh(filename: &str) -> String {
    format!(r#"<geometry><mesh filename="{filename}"/></geometry>"#)
}

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

#[test]
fn urdf_of_no_bytes() {
    let folder = Folder::new();
    folder.write("hand.urdf", "");
    refused(&folder, "U100", "hand.urdf", &["empty"]);
}

#[test]
fn urdf_that_is_a_folder() {
    let folder = Folder::new();
    std::fs::remove_file(folder.path("hand.urdf")).unwrap();
    std::fs::create_dir(folder.path("hand.urdf")).unwrap();
    refused(&folder, "U101", "hand.toml:4:8", &["hand.urdf", "is a folder"]);
}

#[test]
fn urdf_in_latin_1() {
    let folder = Folder::new();
    let mut bytes = b"<?xml version=\"1.0\"?>\n<!-- caf".to_vec();
    bytes.extend(b"\xe9 -->");
    bytes.extend(std::fs::read(folder.path("hand.urdf")).unwrap());
    folder.write("hand.urdf", bytes);
    refused(&folder, "F002", "hand.urdf:2", &["Latin-1", "iconv -f Latin-1"]);
}

#[test]
fn urdf_whose_links_carry_each_other() {
    let folder = Folder::new();
    folder.edit("hand.urdf", r#"<parent link="palm"/>"#, r#"<parent link="east_tip"/>"#);
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("U13") && run.err.contains("east_base"), "{}", run.err);
}

#[test]
fn urdf_limit_without_end() {
    edit_is_refused(
        "hand.urdf",
        r#"upper="0.6108652382""#,
        r#"upper="inf""#,
        "V001",
        &["joint \"east_abduction\"", "upper"],
    );
}

#[test]
fn urdf_sphere_of_nonsense() {
    edit_is_refused(
        "hand.urdf",
        r#"<sphere radius="0.005"/>"#,
        r#"<sphere radius="1e300"/>"#,
        "U151",
        &["east_tip", "1e300"],
    );
}

#[test]
fn urdf_that_nests_without_end() {
    let folder = Folder::new();
    folder.write("hand.urdf", "<a>".repeat(100_000));
    refused(&folder, "U105", "hand.urdf:1", &["64"]);
}

#[test]
fn hand_that_is_not_there() {
    edit_is_refused("scene.toml", "\"hand.toml\"", "\"hnd.toml\"", "S110", &["hand.file", "hnd.toml"]);
}

#[test]
fn hand_of_no_bytes() {
    let folder = Folder::new();
    folder.write("hand.toml", "");
    refused(&folder, "U200", "hand.toml", &["empty"]);
}

#[test]
fn hand_that_is_a_scene() {
    let folder = Folder::new();
    let run = folder.run(&["inspect", "scene.toml"]);
    complains(&run, "U204", "scene.toml:1", &["regrasp-scene", "regrasp-hand"]);
}

#[test]
fn hand_with_a_key_twice() {
    let folder = Folder::new();
    let line = folder.edit("hand.toml", "base_link", "base_link = \"palm\"\nbase_link");
    refused(&folder, "U200", &format!("hand.toml:{}", line + 1), &["duplicate key"]);
}

#[test]
fn hand_with_a_tip_larger_than_itself() {
    edit_is_refused_somewhere("hand.toml", "radius = 0.005", "radius = 5", "U217", "hand.toml", &["east", "5 m"]);
}

#[test]
fn hand_with_a_tip_of_negative_size() {
    edit_is_refused("hand.toml", "radius = 0.005", "radius = -0.005", "U213", &["radius", "-0.005"]);
}
