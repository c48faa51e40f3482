//! Bad scene files (reliability B4): one clear message each, with file, line, element, value and what would be right.

use crate::support::{Folder, GOOD, cube, repository};

/// The good scene with `from` replaced, which must be there.
fn with(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    GOOD.replacen(from, to, 1)
}

#[track_caller]
fn refused(text: &str, expected: &str) {
    assert_eq!(Folder::new().messages(text), expected);
}

#[track_caller]
fn refused_with(text: &str, parts: &[&str]) {
    let messages = Folder::new().messages(text);
    for part in parts {
        assert!(messages.contains(part), "`{part}` is not in:\n{messages}");
    }
    assert_eq!(messages.lines().filter(|line| !line.starts_with("  fix:")).count(), 1, "one message:\n{messages}");
}

#[track_caller]
fn noted(text: &str, part: &str) {
    let notes = Folder::new().load(text).unwrap_or_else(|error| panic!("{error}")).notes;
    assert!(notes.iter().any(|note| note.contains(part)), "`{part}` is not in {notes:?}");
}

#[test]
fn the_good_scene_is_good() {
    let loaded = Folder::new().load(GOOD).unwrap();
    assert_eq!(loaded.notes, Vec::<String>::new());
    assert_eq!(loaded.scene.objects[0].edge_distance, 0.004);
}

#[test]
fn unknown_key() {
    refused(
        &with("friction = 0.8", "friction = 0.8\nfricton = 0.7"),
        "S101 scene.toml:13:1 key \"object.fricton\": is not a key that exists here; expected name, sphere, box, cylinder, capsule, \
         ellipsoid, mesh, friction, edge_distance, crease_angle_deg, mass, density or center_of_mass\n  fix: did you mean friction?",
    );
}

#[test]
fn bare_quaternion() {
    refused_with(
        &with("0.078]", "0.078]\nquat = [0, 0, 0, 1]"),
        &["S101 scene.toml:16:1 key \"start.quat\"", "fix: write quat_xyzw = [x, y, z, w] or quat_wxyz = [w, x, y, z]"],
    );
}

#[test]
fn decimal_comma() {
    refused_with(
        &with("friction = 0.8", "friction = 0,8"),
        &["S100 scene.toml:12:", "fix: write 0.8 with a point, not a comma"],
    );
}

#[test]
fn missing_keys() {
    refused(
        &with("friction = 0.8\n", ""),
        "S102 scene.toml:8:1 table \"object\": has no `friction`\n  fix: add friction = 0.8",
    );
    refused(
        &with("mass = 0.1\n", ""),
        "S102 scene.toml:8:1 table \"object\": has neither mass nor density\n  fix: add mass = 0.1, in kilograms, or density = 1000, in kg/m^3",
    );
    refused_with(
        &with("position = [0.0, 0.0, 0.078]\n", ""),
        &["S102 scene.toml:14:1 table \"start\": has no `position`"],
    );
    refused_with(
        &with("turn = { axis = \"x\", angle_deg = 90 }", ""),
        &["S102 scene.toml:17:1 table \"goal\": says neither a pose nor a turn"],
    );
}

#[test]
fn wrong_type() {
    refused(
        &with("friction = 0.8", "friction = \"0.8\""),
        "S103 scene.toml:12:12 key \"object.friction\": is \"0.8\", a string; expected a number",
    );
    refused_with(
        &with("[0.0, 0.0, 0.078]", "[0.0, 0.078]"),
        &["S103 scene.toml:15:12 key \"start.position\": has 2 values"],
    );
}

#[test]
fn another_format_version_or_task() {
    refused_with(
        &with("regrasp-scene", "regrasp-plan"),
        &["S105 scene.toml:1:10 key \"format\": is \"regrasp-plan\"", "\"regrasp-scene\""],
    );
    refused_with(
        &with("format_version = 1", "format_version = 3"),
        &["S105 scene.toml:2:18 key \"format_version\": is 3; expected 1 or 2"],
    );
    refused_with(
        &with("\"in_hand\"", "\"dual_arm\""),
        &["S105 scene.toml:3:8 key \"task\": is \"dual_arm\"; expected \"in_hand\" or \"tracking\""],
    );
}

#[test]
fn gravity_that_is_no_direction() {
    let stated = |gravity: &str| with("task = \"in_hand\"\n", &format!("task = \"in_hand\"\ngravity = {gravity}\n"));
    refused(
        &stated("[0, 0.0, 0]"),
        "S107 scene.toml:4:11 key \"gravity\": is the zero vector, which is no direction; expected a direction of any length, \
         in the hand's frame (version 1) or the world's (version 2), or \"any\"",
    );
    refused_with(&stated("\"down\""), &["S104 scene.toml:4:11 key \"gravity\": is \"down\"", "\"any\""]);
    refused_with(&stated("9.81"), &["S103 scene.toml:4:11 key \"gravity\": is 9.81"]);
    refused_with(&stated("[0, 0]"), &["S103 scene.toml:4:11 key \"gravity\": has 2 values"]);
    refused_with(&stated("[0, 0, nan]"), &["V001 scene.toml:4:18 key \"gravity[2]\""]);
    refused_with(&with("friction = 0.8", "friction = 0.8\ngravity = \"any\""), &["S101", "object.gravity"]);
}

#[test]
fn no_shape_or_two() {
    refused_with(
        &with("sphere = { radius = 0.032 }\n", ""),
        &["S106 scene.toml:8:1 table \"object\": has no shape; expected exactly one of sphere, box,"],
    );
    refused_with(
        &with("mass = 0.1", "box = { size = [0.05, 0.05, 0.05] }\nmass = 0.1"),
        &["S106", "has 2 shapes: object.sphere, object.box"],
    );
}

#[test]
fn lengths_of_zero_or_less() {
    refused(
        &with("radius = 0.032", "radius = -0.032"),
        "S107 scene.toml:10:21 key \"object.sphere.radius\": is -0.032; expected a length above 0, in metres",
    );
    refused_with(
        &with("sphere = { radius = 0.032 }", "box = { size = [0.05, 0, 0.05] }"),
        &["S107", "key \"object.box.size\": has the length 0"],
    );
}

#[test]
fn friction_below_zero_is_refused_and_odd_friction_is_noted() {
    refused(
        &with("friction = 0.8", "friction = -0.8"),
        "S107 scene.toml:12:12 key \"object.friction\": is -0.8; expected a friction coefficient from 0 to 1000",
    );
    noted(&with("friction = 0.8", "friction = 0"), "scene.toml:12:12: friction 0");
    noted(&with("friction = 0.8", "friction = 900"), "friction 900 is more than");
}

#[test]
fn mass_below_zero_is_refused_and_odd_mass_is_noted() {
    refused_with(&with("mass = 0.1", "mass = -1"), &["S107 scene.toml:11:8 key \"object.mass\": is -1"]);
    refused_with(
        &with("mass = 0.1", "mass = 0.1\ndensity = 500"),
        &["S106 scene.toml:12:11 key \"object.density\": cannot stand beside object.mass"],
    );
    noted(&with("mass = 0.1", "mass = 0"), "mass 0");
    noted(&with("mass = 0.1", "mass = 250"), "masses are in kilograms");
}

#[test]
fn numbers_that_are_not_finite() {
    refused(
        &with("friction = 0.8", "friction = nan"),
        "V001 scene.toml:12:12 key \"object.friction\": is nan; expected a finite number",
    );
    refused_with(&with("0.078]", "inf]"), &["V001 scene.toml:15:23 key \"start.position[2]\": is inf"]);
    refused_with(&with("mass = 0.1", "mass = 1e999"), &["V001 scene.toml:11:8 key \"object.mass\": is 1e999"]);
}

#[test]
fn quaternions_off_length_one() {
    let quat = |q: &str| with("0.078]", &format!("0.078]\nquat_xyzw = {q}"));
    refused(
        &quat("[0, 0, 0, 0]"),
        "V003 scene.toml:16:13 key \"start.quat_xyzw\": is the zero quaternion, which is no rotation\n  fix: no rotation is quat_xyzw = [0, 0, 0, 1]",
    );
    refused(
        &quat("[0, 0, 1, 1]"),
        "V002 scene.toml:16:13 key \"start.quat_xyzw\": has length 1.414214; expected a unit quaternion (length 1 within 0.01)\n  \
         fix: divided by its length it is [0.000000000, 0.000000000, 0.707106781, 0.707106781]",
    );
    refused_with(&quat("[1e200, 1e200, 0, 0]"), &["V002"]);
    refused_with(&quat("[0, 0, 0, 1]\nquat_wxyz = [1, 0, 0, 0]"), &["S106", "says the same as start.quat_xyzw"]);
    noted(&quat("[0, 0, 0.7071, 0.7071]"), "has length 0.999990 and was normalised");
}

#[test]
fn goal_at_the_start_is_noted() {
    noted(&with("angle_deg = 90", "angle_deg = 0"), "the goal pose is the start pose");
    noted(
        &with("turn = { axis = \"x\", angle_deg = 90 }", "position = [0.0, 0.0, 0.078]"),
        "the goal pose is the start pose",
    );
}

#[test]
fn goal_said_twice() {
    refused_with(
        &with("turn =", "position = [0, 0, 0.08]\nturn ="),
        &["S106 scene.toml:19:8 key \"goal.turn\": cannot stand beside goal.position"],
    );
}

#[test]
fn way_poses_that_cannot_be() {
    let way = |text: &str| with("[goal]", &format!("{text}\n[goal]"));
    refused_with(&way("[[way]]\n"), &["S102", "table \"way[0]\"", "says neither a pose nor a turn"]);
    refused_with(
        &way("[[way]]\nmove = [0, 0, 0]\n[[way]]\nmove = [0, 0, 0]\nposition = [0, 0, 0.08]"),
        &["S106", "key \"way[1].move\": cannot stand beside way[1].position"],
    );
    refused_with(&way("[[way]]\nturn = { axis = \"z\", angle_deg = 200 }"), &["S107", "no single pose"]);
    refused_with(&way("[way]\nmove = [0, 0, 0]"), &["S103", "expected tables [[way]]"]);
    refused_with(&way("[[way]]\nmove = [0, 0, 0]\ngrasp = \"automatic\""), &["S101", "way[0].grasp"]);
    refused_with(&way("[[way]]\nposition = [0, 0, 7.8]"), &["P302", "position [0, 0, 7.8]"]);
    let both = way("[[way]]\nmove = [0, 0, 0]").replace("angle_deg = 90", "angle_deg = 360");
    refused_with(&both, &["S106", "turns by more than 180 degrees beside [[way]]"]);
}

#[test]
fn bad_axis() {
    refused_with(
        &with("axis = \"x\"", "axis = \"X\""),
        &["S104 scene.toml:18:17 key \"goal.turn.axis\": is \"X\"", "expected x, y or z"],
    );
    refused_with(&with("axis = \"x\"", "axis = [0, 0, 0]"), &["S107", "is the zero vector"]);
    refused_with(
        &with("angle_deg = 90", "angle_deg = 5156"),
        &["S107", "is 5156; expected degrees between -3600 and 3600"],
    );
}

#[test]
fn positions_in_millimetres() {
    refused_with(
        &with("[0.0, 0.0, 0.078]", "[0, 0, 78]"),
        &[
            "P302 scene.toml:14:1 key \"start\": position [0, 0, 78] is 78.000 m from the hand",
            "[0, 0, 0.078] if these were millimetres",
        ],
    );
    refused_with(
        &with("angle_deg = 90 }", "angle_deg = 90 }\nmove = [0, 0, 10]"),
        &["P302", "key \"goal\"", "position [0, 0, 10.078]"],
    );
}

#[test]
fn objects_of_impossible_size() {
    refused_with(
        &with("radius = 0.032", "radius = 32"),
        &[
            "M201 scene.toml:10:10 key \"object.sphere\": is 64.0000 x 64.0000 x 64.0000 m",
            "lengths are in metres: multiply them by 0.001",
        ],
    );
    refused_with(&with("radius = 0.032", "radius = 0.000032"), &["M201", "multiply them by 1000"]);
    // 3 mm passes by itself, but not beside a hand of 0.1 m.
    refused_with(
        &with("radius = 0.032", "radius = 0.0015"),
        &["M201 scene.toml:8:1 key \"object\": is 0.0030 m large, the hand 0.", "scale = 1000"],
    );
}

#[test]
fn a_mesh_in_millimetres() {
    let folder = Folder::new();
    folder.write("mm.obj", &cube(20.0, 12));
    let messages = folder.messages(&with("sphere = { radius = 0.032 }", "mesh = { file = \"mm.obj\" }"));
    assert_eq!(
        messages,
        "M201 scene.toml:10:8 key \"object.mesh\": is 40.0000 x 40.0000 x 40.0000 m; expected a largest extent between 0.002 m and 3 m\n  \
         fix: it is probably in millimetres: mesh = { file = \"mm.obj\", scale = 0.001 }"
    );
    let scaled =
        folder.load(&with("sphere = { radius = 0.032 }", "mesh = { file = \"mm.obj\", scale = 0.001 }")).unwrap();
    assert!((scaled.scene.objects[0].center_of_mass.coords - nalgebra::Vector3::repeat(0.02)).norm() < 1e-12);
}

/// The object is right then, and no other scale of it helps.
#[test]
fn a_hand_in_millimetres_is_what_is_wrong_and_not_the_object() {
    let folder = Folder::new();
    folder.edit("hand.urdf", |text| text.replace("radius=\"0.055\" length=\"0.01\"", "radius=\"55\" length=\"10\""));
    let messages = folder.messages(&with("sphere = { radius = 0.032 }", "mesh = { file = \"cube.obj\" }"));
    assert!(messages.starts_with("M201 scene.toml") && messages.contains("fix: no hand is so large"), "{messages}");
    assert!(!messages.contains("it is probably in"), "{messages}");
}

#[test]
fn scale_of_zero_is_refused_and_a_mirror_is_not() {
    let mesh = |scale: &str| {
        with("sphere = { radius = 0.032 }", &format!("mesh = {{ file = \"cube.obj\", scale = {scale} }}"))
    };
    refused_with(&mesh("0"), &["S107", "key \"object.mesh.scale\": has a factor of 0"]);
    let folder = Folder::new();
    let loaded = folder.load(&mesh("[-1, 1, 2]")).unwrap();
    assert!((loaded.scene.objects[0].center_of_mass - nalgebra::Point3::new(-0.02, 0.02, 0.04)).norm() < 1e-12);
}

#[test]
fn a_mesh_wound_inside_out_is_turned_with_a_note() {
    let folder = Folder::new();
    let turned: String = cube(0.02, 12)
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>().as_slice() {
            ["f", a, b, c] => format!("f {a} {c} {b}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    folder.write("cube.obj", &turned);
    let loaded = folder.load(&with("sphere = { radius = 0.032 }", "mesh = { file = \"cube.obj\" }")).unwrap();
    assert!(loaded.notes.iter().any(|note| note.contains("wound inside out")), "{:?}", loaded.notes);
}

#[test]
fn an_open_mesh_needs_a_hull_or_its_mass_and_centre() {
    let mesh = |more: &str| with("sphere = { radius = 0.032 }", &format!("mesh = {{ file = \"open.obj\"{more} }}"));
    refused_with(
        &mesh(""),
        &[
            "M210 scene.toml:8:1 table \"object\": has no volume",
            "fix: mesh = { ..., solid = \"hull\" }, or give mass and center_of_mass",
        ],
    );
    let folder = Folder::new();
    let hull = folder.load(&mesh(", solid = \"hull\"")).unwrap();
    assert!((hull.scene.objects[0].center_of_mass.coords - nalgebra::Vector3::repeat(0.02)).norm() < 1e-12);
    let given = mesh("").replace("mass = 0.1", "mass = 0.1\ncenter_of_mass = [0.02, 0.02, 0.02]");
    assert_eq!(folder.load(&given).unwrap().scene.objects[0].center_of_mass, nalgebra::Point3::from([0.02; 3]));
}

#[test]
fn origin_of_a_mesh_moves_it() {
    let mesh = |origin: &str| {
        with("sphere = { radius = 0.032 }", &format!("mesh = {{ file = \"cube.obj\", origin = {origin} }}"))
    };
    let folder = Folder::new();
    let centered = folder.load(&mesh("\"center\"")).unwrap().scene.objects.remove(0);
    assert!(centered.center_of_mass.coords.norm() < 1e-12);
    assert!((centered.shape.bounds().1 - nalgebra::Point3::from([0.02; 3])).norm() < 1e-12);
    let moved = folder.load(&mesh("[0.0, 0.0, 0.04]")).unwrap().scene.objects.remove(0);
    assert!((moved.center_of_mass - nalgebra::Point3::new(0.02, 0.02, -0.02)).norm() < 1e-12);
    refused_with(&mesh("\"centre\""), &["S104", "did you mean \"center\"?"]);
}

#[test]
fn centre_of_mass_outside_the_object() {
    refused_with(
        &with("mass = 0.1", "mass = 0.1\ncenter_of_mass = [0, 0, 20]"),
        &["S107 scene.toml:12:18 key \"object.center_of_mass\": is [0, 0, 20], outside the object"],
    );
}

#[test]
fn meshes_that_are_no_meshes() {
    let mesh = with("sphere = { radius = 0.032 }", "mesh = { file = \"bad.obj\" }");
    let folder = Folder::new();
    for content in ["", "v 0 0 0\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"] {
        folder.write("bad.obj", content);
        let messages = folder.messages(&mesh);
        assert!(messages.contains("bad.obj"), "{content:?}: {messages}");
    }
    refused_with(&mesh, &["S110 scene.toml:10:17 key \"object.mesh.file\": \"bad.obj\" does not exist; looked at "]);
    refused_with(&mesh.replace("bad.obj", "."), &["S110", "is not a file"]);
    refused_with(&mesh.replace("bad.obj", ""), &["S110", "is empty"]);
}

#[test]
fn packages_that_are_not_given() {
    let text = with("\"hand.toml\"", "\"package://no_such_package/hand.toml\"");
    refused_with(
        &text,
        &[
            "U101 scene.toml:6:8 key \"hand.file\"",
            "--package no_such_package: not given",
            "fix: --package no_such_package=DIR",
        ],
    );
    refused_with(&with("\"hand.toml\"", "\"https://example.org/hand.toml\""), &["U103", "never fetched"]);
}

#[test]
fn faults_of_the_hand_file_keep_their_own_place() {
    let folder = Folder::new();
    folder.write("hand.toml", "format = \"regrasp-hand\"\nformat_version = 1\n");
    let messages = folder.messages(GOOD);
    assert!(messages.contains("hand.toml") && messages.contains("urdf"), "{messages}");
}

#[test]
fn grasps_with_wrong_names_or_counts() {
    let grasp = |text: &str| with("0.078]", &format!("0.078]\ngrasp = {text}"));
    refused_with(&grasp("\"auto\""), &["S104 scene.toml:16:9 key \"start.grasp\": is \"auto\"", "expected automatic"]);
    refused_with(&grasp("{}"), &["S106", "says neither of joints and contacts"]);
    refused_with(&grasp("{ contacts = { east = [0, 0, 0] } }"), &["S121", "has no contact for north, west, south"]);
    let contacts = "{ contacts = { est = [0, 0, 0], north = [0, 0, 0], west = [0, 0, 0], south = [0, 0, 0] } }";
    refused_with(&grasp(contacts), &["S120", "is not a finger of the hand (did you mean \"east\"?)"]);
    refused_with(&grasp("{ joints = { east_abduction = 0 } }"), &["S121", "has no value for east_proximal_flexion, "]);
    refused_with(
        &grasp("{ joints = { east_abduction = 30 } }"),
        &["P303", "key \"start.grasp.joints.east_abduction\": is 30, outside the joint's limits"],
    );
    refused_with(
        &grasp("{ joints = { east_abducton = 0 } }"),
        &["S120", "is not a joint of the hand (did you mean \"east_abduction\"?)"],
    );
}

#[test]
fn contacts_off_the_surface() {
    let contacts =
        "{ contacts = { east = [0.0381, 0, 0], north = [0, 0.032, 0], west = [-0.032, 0, 0], south = [0, -0.03, 0] } }";
    let messages = Folder::new().messages(&with("0.078]", &format!("0.078]\ngrasp = {contacts}")));
    for part in [
        "P304 scene.toml:14:1 key \"start\": contact of finger \"east\" is 6.10 mm outside the object's surface",
        "contact of finger \"south\" is 2.00 mm inside",
        "fix: the nearest point is [0.032000, 0.000000, 0.000000]",
    ] {
        assert!(messages.contains(part), "`{part}` is not in:\n{messages}");
    }
    assert_eq!(messages.matches("P304").count(), 2);
}

#[test]
fn obstacles_of_one_name() {
    let obstacle = "\n[[obstacles]]\nname = \"wall\"\nbox = { size = [0.1, 0.1, 0.01] }\nposition = [0, 0, 0.5]\n";
    refused_with(
        &format!("{GOOD}{obstacle}{obstacle}"),
        &["S112 scene.toml:25:1", "has the name \"wall\", as another body of the scene"],
    );
}

#[test]
fn a_mesh_far_from_its_own_origin() {
    let folder = Folder::new();
    let far: String = cube(0.02, 12).replace("v 0 ", "v 1000 ").replace("v 0.04 ", "v 1000.04 ");
    folder.write("far.obj", &far);
    let mesh = |more: &str| with("sphere = { radius = 0.032 }", &format!("mesh = {{ file = \"far.obj\"{more} }}"));
    assert_eq!(
        folder.messages(&mesh("")),
        "M204 scene.toml:10:8 key \"object.mesh\": lies 1000 m from the origin of its own file; expected at most 3 m: the \
         object frame is the frame of the file\n  fix: mesh = { file = ..., origin = \"center\" }"
    );
    let object = folder.load(&mesh(", origin = \"center\"")).unwrap().scene.objects.remove(0);
    assert!(object.center_of_mass.coords.norm() < 1e-9);
}

#[test]
fn files_of_another_kind_are_one_complaint() {
    refused("", "S100 scene.toml: is empty; expected a TOML file");
    refused(
        "\n<robot name=\"r\"/>\n",
        "S100 scene.toml: looks like XML; expected a TOML file\n  fix: where it is a URDF, `regrasp inspect` makes a hand file of it, and `regrasp place HAND OBJECT` a scene of that",
    );
    let hand = std::fs::read_to_string(repository().join("assets/hands/wide_four_finger/hand.toml")).unwrap();
    let messages = Folder::new().messages(&hand);
    assert!(messages.starts_with("S105") && messages.contains("is \"regrasp-hand\""), "{messages}");
    assert!(messages.contains("fix: `regrasp place HAND OBJECT` makes a scene of a hand file"), "{messages}");
    assert_eq!(messages.lines().filter(|line| !line.starts_with("  fix:")).count(), 1, "{messages}");
}

#[test]
fn faults_of_syntax_are_few() {
    let messages = Folder::new().messages(&"a b\n".repeat(100));
    let lines: Vec<&str> = messages.lines().collect();
    assert_eq!(lines.len(), 6, "{messages}");
    assert!(lines[5].contains("more faults of syntax"), "{messages}");
    assert!(Folder::new().messages(&format!("a = {}", "[".repeat(10_000))).lines().count() <= 6);
}

#[test]
fn enormous_numbers_are_shown_short() {
    for (from, to) in [("0.078]", "1e300]"), ("0.078]", "-1e154]"), ("friction = 0.8", "friction = -1e300")] {
        let messages = Folder::new().messages(&with(from, to));
        assert!(messages.contains("1e") && messages.len() < 250, "{messages}");
    }
    noted(&with("mass = 0.1", "mass = 1e5"), "mass 100000 kg");
}

#[test]
fn edges_that_leave_no_room_for_contacts() {
    refused_with(
        &with("sphere = { radius = 0.032 }", "box = { size = [0.007, 0.007, 0.05] }"),
        &["S107", "edge_distance", "leaves no place for a contact"],
    );
}

#[test]
fn files_that_are_no_text() {
    let folder = Folder::new();
    let path = std::env::temp_dir().join("regrasp_no_such_scene.toml");
    let error = regrasp_scene::load_scene(&path, &Default::default()).unwrap_err().to_string();
    assert!(error.starts_with("F001") && error.contains("cannot be read"), "{error}");
    let error = regrasp_scene::load_scene(&std::env::temp_dir(), &Default::default()).unwrap_err().to_string();
    assert!(error.contains("is not a regular file"), "{error}");
    assert!(folder.messages("\u{0}").starts_with("S100"));
    // A byte order mark is no fault.
    assert!(folder.load(&format!("\u{feff}{GOOD}")).is_ok());
}

#[test]
fn every_cause_is_found_in_one_run() {
    let text = GOOD
        .replace("friction = 0.8", "friction = -1")
        .replace("radius = 0.032", "radius = 0")
        .replace("angle_deg = 90", "angle = 90")
        .replace("[0.0, 0.0, 0.078]", "[0.0, 0.0, nan]");
    let messages = Folder::new().messages(&text);
    for part in
        ["object.friction", "object.sphere.radius", "has no `angle_deg`", "goal.turn.angle\"", "start.position[2]"]
    {
        assert!(messages.contains(part), "`{part}` is not in:\n{messages}");
    }
}

#[test]
fn contact_models_that_contradict_themselves() {
    let hand = |more: &str| {
        let start = GOOD.find("[object]").unwrap();
        format!("{}{more}\n\n{}", GOOD[..start].trim_end().to_owned() + "\n", &GOOD[start..])
    };
    refused_with(
        &hand("contact = \"soft\""),
        &["S104 scene.toml:", "key \"hand.contact\": is \"soft\"", "expected frictionless, point or soft_finger"],
    );
    refused_with(&hand("contact = \"soft_finger\""), &["S106 scene.toml:", "has no `torsion_radius` beside it"]);
    refused_with(&hand("torsion_radius = 0.005"), &["S106 scene.toml:", "stands without a contact model"]);
    refused_with(
        &hand("contact = \"point\"\ntorsion_radius = 0.005"),
        &["S106 scene.toml:", "stands beside \"point\", which has no torsion"],
    );
    refused_with(
        &hand("contact = \"soft_finger\"\ntorsion_radius = 5"),
        &[
            "S107 scene.toml:",
            "key \"hand.torsion_radius\": is 5",
            "expected a length above 0 and at most 0.05, in metres",
        ],
    );
    refused_with(
        &hand("contacts = { finger_9 = { model = \"point\" } }"),
        &["S120 scene.toml:", "key \"hand.contacts.finger_9\": is not a finger of the hand"],
    );
    refused_with(&hand("contacts = { east = {} }"), &["S102 scene.toml:", "has no `model`"]);
    refused_with(
        &hand("contacts = { east = { torsion_radius = 0.01 } }"),
        &["S106 scene.toml:", "key \"hand.contacts.east.torsion_radius\": stands without a contact model"],
    );
}

#[test]
fn contact_models_of_the_scene_reach_the_fingers() {
    use regrasp_robot::ContactModel;
    let start = GOOD.find("[object]").unwrap();
    let more = "contact = \"soft_finger\"\ntorsion_radius = 0.005\ncontacts = { north = { model = \"frictionless\" } }";
    let text = format!("{}\n{more}\n\n{}", GOOD[..start].trim_end(), &GOOD[start..]);
    let fingers = Folder::new().load(&text).unwrap().scene.hands.remove(0).hand.fingers;
    let soft = ContactModel::SoftFinger { torsion_radius: 0.005 };
    let expected = [soft, ContactModel::Frictionless, soft, soft];
    assert_eq!(fingers.iter().map(|finger| finger.tip.contact).collect::<Vec<_>>(), expected);
    let plain = Folder::new().load(GOOD).unwrap().scene.hands.remove(0).hand.fingers;
    assert!(plain.iter().all(|finger| finger.tip.contact == ContactModel::Point));
}

#[test]
fn fingertips_that_are_large_cubes() {
    let folder = Folder::new();
    let hand = repository().join("assets/hands/wide_four_finger");
    for name in ["egg_tips.toml", "egg_tips.urdf"] {
        folder.write(name, &std::fs::read_to_string(hand.join(name)).unwrap());
    }
    folder.write("egg_tip.obj", &cube(0.06, 12));
    let file = GOOD.lines().find(|line| line.starts_with("file = ")).unwrap();
    let messages = folder.messages(&with(file, "file = \"egg_tips.toml\""));
    assert_eq!(messages.matches("S108").count(), 4, "{messages}");
    assert!(
        messages.contains("finger \"east\": the tip's hull is ") && messages.contains(" mm off its smooth surface"),
        "{messages}"
    );
    assert!(messages.contains("expected a rounded tip, within 0.2 mm over its pad"), "{messages}");
}
