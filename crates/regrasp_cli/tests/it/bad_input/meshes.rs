//! Mesh files of objects.

use super::{TETRAHEDRON, edit_is_refused, refused};
use crate::folder::Folder;

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

#[test]
fn mesh_that_is_a_folder_or_a_pipe() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("mug.obj")).unwrap();
    folder.edit("scene.toml", "sphere = { radius = 0.032 }", "mesh = { file = \"mug.obj\" }");
    refused(&folder, "S110", "scene.toml:10", &["mug.obj", "is not a file"]);
    std::fs::remove_dir(folder.path("mug.obj")).unwrap();
    if std::process::Command::new("mkfifo").arg(folder.path("mug.obj")).status().is_ok_and(|status| status.success()) {
        refused(&folder, "S110", "scene.toml:10", &["mug.obj", "is not a file"]);
    }
}

#[test]
fn mesh_of_a_format_that_is_not_read() {
    mesh_is_refused("mug.3ds", "<COLLADA/>", "M200", "mug.3ds", &[".3ds", ".dae or .glb", "trimesh"]);
    mesh_is_refused("mug", TETRAHEDRON, "M200", "mug", &["no extension"]);
}

#[test]
fn mesh_of_one_triangle() {
    let triangle = "v 0 0 0\nv 0.05 0 0\nv 0 0.05 0\nf 1 2 3\n";
    mesh_is_refused("mug.obj", triangle, "M210", "scene.toml", &["not a closed solid", "hull", "center_of_mass"]);
}

#[test]
fn mesh_of_a_point() {
    mesh_is_refused("mug.obj", "v 0 0 0\nf 1 1 1\n", "M202", "mug.obj", &["area"]);
}

#[test]
fn mesh_far_from_its_origin() {
    let far = TETRAHEDRON.replace("v 0", "v 1000000");
    mesh_is_refused("mug.obj", far, "M204", "scene.toml", &["origin", "center"]);
}

#[test]
fn obj_with_a_negative_index_out_of_range() {
    mesh_is_refused("mug.obj", TETRAHEDRON.replace("f 1 2 4", "f 1 2 -9"), "M241", "mug.obj:6", &["-9", "4"]);
}

#[test]
fn obj_with_an_infinite_corner() {
    mesh_is_refused(
        "mug.obj",
        TETRAHEDRON.replace("v 0 0.05 0", "v 0 1e999 0"),
        "M203",
        "mug.obj:3",
        &["1e999", "finite numbers"],
    );
}

#[test]
fn stl_in_text_that_is_cut_off() {
    let text = "solid mug\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0.05 0 0\n";
    mesh_is_refused("mug.stl", text, "M231", "mug.stl:", &["cut short"]);
}
