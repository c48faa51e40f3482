//! Which files are read: packages, relative paths, allowed folders, encodings, remarks, leniency, garbage.

use proptest::prelude::*;
use regrasp_robot::{JointKind, LoadOptions, LoadedRobot, ResolveOptions, load_hand, load_robot};
use std::fs;
use std::path::{Path, PathBuf};

/// A tetrahedron with legs of 1, 2 and 3 mm, and volume 1 mm^3.
const OBJ: &str = "v 0 0 0\nv 0.001 0 0\nv 0 0.002 0\nv 0 0 0.003\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// Writes `text` to `root/name`, with the folders above it.
fn write(root: &Path, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
    let path = root.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, text).unwrap();
    path
}

/// A robot of one link with the mesh `name`.
fn with_mesh(name: &str) -> String {
    format!(
        "<robot name='r'><link name='a'><collision><geometry><mesh filename='{name}'/></geometry></collision></link></robot>"
    )
}

fn load(path: &Path) -> Result<LoadedRobot, Vec<String>> {
    load_with(path, &LoadOptions::default())
}

fn load_with(path: &Path, options: &LoadOptions) -> Result<LoadedRobot, Vec<String>> {
    load_robot(path, options).map_err(|error| error.diagnostics.iter().map(ToString::to_string).collect())
}

fn code(result: Result<LoadedRobot, Vec<String>>) -> String {
    result.expect_err("the file is bad")[0].split(' ').next().unwrap().to_owned()
}

#[test]
fn packages_are_found_in_the_documented_order() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let name = "package://allegro/meshes/tip.obj";
    let urdf = write(root, "ws/allegro/urdf/hand.urdf", with_mesh(name));
    // Last in the order first: a folder of that name above the model, with a remark.
    let tip = |package: &str| write(root, &format!("{package}/meshes/tip.obj"), OBJ);
    let own = tip("ws/allegro");
    let loaded = load(&urdf).unwrap();
    assert_eq!(loaded.inputs[1].path, fs::canonicalize(own).unwrap());
    assert_eq!(loaded.inputs[1].name, name);
    assert!(loaded.notes[0].contains("has no package.xml"), "{:?}", loaded.notes);
    // A package.xml of that name.
    write(root, "ws/package.xml", "<package><name>allegro</name></package>");
    let by_xml = tip("ws");
    let loaded = load(&urdf).unwrap();
    assert_eq!(loaded.inputs[1].path, fs::canonicalize(by_xml).unwrap());
    assert_eq!(loaded.notes, Vec::<String>::new());
    // Search paths: a source folder and an install prefix.
    let mut options = LoadOptions::default();
    for (prefix, package) in [("ros", "ros/allegro"), ("ament", "ament/share/allegro")] {
        let in_path = tip(package);
        options.resolve.search_paths = vec![root.join("nowhere"), root.join(prefix)];
        assert_eq!(load_with(&urdf, &options).unwrap().inputs[1].path, in_path);
    }
    // A package given by name goes before all.
    let given = tip("given");
    options.resolve.packages = vec![("other".into(), root.join("ws")), ("allegro".into(), root.join("given"))];
    assert_eq!(load_with(&urdf, &options).unwrap().inputs[1].path, given);
}

#[test]
fn a_file_of_that_name_elsewhere_is_pointed_at() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = write(folder.path(), "hand.urdf", with_mesh("package://allegro/meshes/tip.obj"));
    write(folder.path(), "parts/tip.obj", OBJ);
    let message = load(&urdf).unwrap_err().join("\n");
    let expected = format!(
        "fix: --package allegro=DIR (a file of that name is at {})",
        folder.path().join("parts/tip.obj").display()
    );
    assert!(message.ends_with(&expected), "{message}");
}

#[test]
fn another_case_of_letters_is_taken_with_a_remark() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = write(folder.path(), "hand.urdf", with_mesh("Meshes/Tip.OBJ"));
    write(folder.path(), "meshes/tip.obj", OBJ);
    let loaded = load(&urdf).unwrap();
    assert_eq!(loaded.notes.len(), 1);
    assert!(loaded.notes[0].ends_with("the case of letters differs"), "{}", loaded.notes[0]);
    assert!(loaded.notes[0].contains("meshes/tip.obj is taken"), "{}", loaded.notes[0]);
}

#[test]
fn files_outside_the_models_folders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let secret = write(root, "secret.obj", OBJ);
    write(root, "model/meshes/tip.obj", OBJ);
    let absolute = secret.display().to_string();
    let with_scheme = format!("file://{absolute}");
    let climbing = format!("package://model/..{absolute}");
    for name in [
        "../secret.obj",
        "meshes/../../secret.obj",
        absolute.as_str(),
        with_scheme.as_str(),
        "package://model/../secret.obj",
        "package://model/meshes/../../secret.obj",
    ] {
        let urdf = write(root, "model/hand.urdf", with_mesh(name));
        assert_eq!(code(load(&urdf)), "U103", "{name}");
    }
    for name in [
        "..%2fsecret.obj",
        "..\\secret.obj",
        "C:\\secret.obj",
        "\\\\?\\secret.obj",
        "package://../secret.obj",
        "package://..\\x/secret.obj",
        "package:///secret.obj",
        climbing.as_str(),
        "/dev/zero",
        "meshes",
        ".",
    ] {
        let urdf = write(root, "model/hand.urdf", with_mesh(name));
        let code = code(load(&urdf));
        assert!(["U101", "U102", "U103"].contains(&code.as_str()), "{name} {code}");
    }
    // Nor does a search path let a package name climb out of it.
    let mut options = LoadOptions::default();
    options.resolve.search_paths = vec![root.join("model")];
    let urdf = write(root, "model/hand.urdf", with_mesh("package://../secret.obj"));
    assert_eq!(code(load_with(&urdf, &options)), "U101");
    // A folder at the root of the file system is no package.
    let urdf = write(root, "model/hand.urdf", with_mesh("package://etc/passwd"));
    assert_eq!(code(load(&urdf)), "U101");
    // A package given by name is allowed wherever it is.
    let urdf = write(root, "model/hand.urdf", with_mesh("../secret.obj"));
    let resolve = ResolveOptions { packages: vec![("all".into(), root.to_owned())], ..Default::default() };
    assert!(load_with(&urdf, &LoadOptions { resolve, ..Default::default() }).is_ok());
}

#[cfg(unix)]
#[test]
fn symbolic_links_are_judged_by_where_they_lead() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write(root, "secret.obj", OBJ);
    let urdf = write(root, "model/hand.urdf", with_mesh("link.obj"));
    symlink("../secret.obj", root.join("model/link.obj")).unwrap();
    assert_eq!(code(load(&urdf)), "U103");
    fs::remove_file(root.join("model/link.obj")).unwrap();
    symlink("link.obj", root.join("model/link.obj")).unwrap();
    assert_eq!(code(load(&urdf)), "U101");
    fs::remove_file(root.join("model/link.obj")).unwrap();
    symlink("/dev/zero", root.join("model/link.obj")).unwrap();
    assert_eq!(code(load(&urdf)), "U101");
}

#[test]
fn a_urdf_folder_may_name_files_of_its_package() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = write(folder.path(), "hand/urdf/hand.urdf", with_mesh("../meshes/tip.obj"));
    write(folder.path(), "hand/meshes/tip.obj", OBJ);
    assert!(load(&urdf).is_ok());
}

#[test]
fn where_the_package_is_known_the_fix_corrects_the_path_in_it() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "allegro/package.xml", "<package><name>allegro</name></package>");
    write(folder.path(), "allegro/meshes/tip.obj", OBJ);
    let refused = |name: &str| {
        let urdf = write(folder.path(), "allegro/urdf/hand.urdf", with_mesh(name));
        load(&urdf).expect_err("there is no such file").remove(0)
    };
    let misspelt = refused("package://allegro/meshes/tpi.obj");
    assert!(misspelt.contains("fix: correct the path after the package, which is "), "{misspelt}");
    assert!(misspelt.ends_with(": did you mean \"package://allegro/meshes/tip.obj\"?"), "{misspelt}");
    assert_eq!(misspelt.matches("folder of that name").count(), 1, "the same folder is named once: {misspelt}");
    let elsewhere = refused("package://allegro/collision/tip.obj");
    assert!(elsewhere.contains("fix: correct the path") && !elsewhere.contains("did you mean"), "{elsewhere}");
    assert!(elsewhere.contains("(a file of that name is at "), "{elsewhere}");
    assert!(refused("package://alegro/meshes/tip.obj").contains("fix: --package alegro=DIR"), "no package, no path");
    // Folders outside the package are not listed.
    let outside = refused("package://allegro/../allegro/meshes/tpi.obj");
    assert!(!outside.contains("did you mean"), "{outside}");
}

#[test]
fn encodings_and_kinds_of_file() {
    let folder = tempfile::tempdir().unwrap();
    let good = "<robot name='r'><link name='a'/></robot>";
    let with_mark = write(folder.path(), "bom.urdf", format!("\u{feff}{good}"));
    assert!(load(&with_mark).is_ok());
    let unicode = write(folder.path(), "hand \u{e9}.urdf", "<robot name='r'><link name='\u{e9}\u{4e2d}'/></robot>");
    assert_eq!(load(&unicode).unwrap().robot.links[0].name, "\u{e9}\u{4e2d}");
    let utf16: Vec<u8> = [0xff, 0xfe].into_iter().chain(good.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    assert_eq!(code(load(&write(folder.path(), "utf16.urdf", utf16))), "F002");
    assert_eq!(code(load(&write(folder.path(), "latin.urdf", b"<robot name='r'><link name='\xe9'/></robot>"))), "F002");
    assert_eq!(code(load(folder.path())), "F001");
    assert_eq!(code(load(&folder.path().join("absent.urdf"))), "F001");
}

#[test]
fn hostile_xml_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let load_text = |text: String| code(load(&write(folder.path(), "hand.urdf", text)));
    let deep = |n: usize| format!("<robot>{}{}</robot>", "<a>".repeat(n), "</a>".repeat(n));
    assert_eq!(load_text(deep(65)), "U105");
    assert_eq!(load_text(deep(1_000_000)), "U105");
    assert_eq!(load_text(format!("<robot>{}", "<a b='>'>".repeat(1_000_000))), "U105");
    assert_eq!(load_text(format!("<robot>{}</robot>", "<a/>".repeat(1_000_001))), "U105");
    let links: String = (0..1001).map(|i| format!("<link name='l{i}'/>")).collect();
    assert_eq!(load_text(format!("<robot>{links}</robot>")), "U105");
    // Comments and attributes that look like tags do not count as nesting.
    let harmless = format!(
        "<robot name='r'><!-- {} --><link name='a' note='{}'/></robot>",
        "<a>".repeat(100),
        "&lt;a>".repeat(100)
    );
    assert!(load(&write(folder.path(), "hand.urdf", harmless)).is_ok());
}

/// Elements of Drake, whose prefix such files often do not declare, are passed over; what is wrong elsewhere has its place.
#[test]
fn prefixes_that_are_not_declared_are_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let text = |radius: &str| {
        format!(
            r#"<robot name="r"><drake:x/><link name="a"><collision><geometry><sphere radius="{radius}"/></geometry><drake:proximity_properties>
<drake:mu_static value="1"/></drake:proximity_properties></collision></link><drake:collision_filter_group name="g" drake:rotor="2"/></robot>"#
        )
    };
    let read = load(&write(folder.path(), "hand.urdf", text("0.01"))).unwrap();
    let declared = text("0.01").replacen("<robot", "<robot xmlns:drake='http://drake.mit.edu'", 1);
    let other = load(&write(folder.path(), "other.urdf", declared)).unwrap();
    assert_eq!(format!("{:?}", read.robot), format!("{:?}", other.robot));
    assert_eq!(read.robot.links[0].collision.len(), 1);
    let refused = load(&write(folder.path(), "hand.urdf", text("-1"))).unwrap_err().remove(0);
    assert!(refused.contains("U151") && refused.contains("hand.urdf:1:71"), "{refused}");
}

#[test]
fn xacro_files_are_known_by_their_content() {
    let folder = tempfile::tempdir().unwrap();
    let plain = r#"<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><link name="root"/></robot>"#;
    // Already expanded: the ending alone means nothing.
    let path = write(folder.path(), "hand.urdf.xacro", plain);
    assert_eq!(load(&path).unwrap().robot.links.len(), 1);
    for text in [
        plain.replace("<link name=\"root\"/>", "<link name=\"root\"/><xacro:macro name=\"m\"/>"),
        // The prefix is not declared.
        "<robot name='r'><xacro:macro name='m'/></robot>".to_owned(),
    ] {
        fs::write(&path, text).unwrap();
        let refused = load(&path).unwrap_err().remove(0);
        let command = format!("xacro {} -o {}", path.display(), folder.path().join("hand.urdf").display());
        assert!(refused.starts_with("U107") && refused.contains("<xacro:macro>"), "{refused}");
        assert!(refused.ends_with(&command), "{refused}");
    }
}

#[test]
fn what_is_defaulted_or_normalised_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "tip.obj", OBJ);
    let text = "<robot name='r'>
<link name='a'><colision/></link><link name='b'><collision><geometry><mesh filename='tip.obj' scale='-2 1 1'/></geometry></collision></link>
<link name='c'/><link name='d'/><link name='e'/><link name='f'/>
<joint name='no_axis' type='revolute'><parent link='a'/><child link='b'/><limit lower='-1' upper='1'/></joint>
<joint name='long_axis' type='continuous'><parent link='b'/><child link='c'/><axis xyz='0 0 2'/><limit lower='0' upper='1'/></joint>
<joint name='still' type='revolute'><parent link='c'/><child link='d'/><axis xyz='0 0 1'/><limit lower='0.5' upper='0.5'/></joint>
<joint name='degrees' type='revolute'><parent link='d'/><child link='e'/><axis xyz='0 0 1'/><limit upper='90' effort='0' velocity='2'/></joint>
<joint name='fixed' type='fixed'><parent link='e'/><child link='f'/><mimic joint='degrees'/></joint>
</robot>";
    let path = write(folder.path(), "hand.urdf", text);
    let loaded = load(&path).unwrap();
    let notes: Vec<String> =
        loaded.notes.iter().map(|n| n.replace(&format!("{}/", folder.path().display()), "")).collect();
    let expected = [
        "hand.urdf:2:16 link \"a\": <colision> is not known and not read; did you mean <collision>?",
        "hand.urdf:2:70 link \"b\": \"tip.obj\" is mirrored by its scale; its triangles are turned back",
        "hand.urdf:4:1 joint \"no_axis\": has no <axis>; URDF's default 1 0 0 is taken",
        "hand.urdf:5:78 joint \"long_axis\": axis has length 2; taken as a direction",
        "hand.urdf:5:97 joint \"long_axis\": is continuous; its lower and upper limits are not used",
        "hand.urdf:7:93 joint \"degrees\": <limit> has no lower; URDF's default 0 is taken",
        "hand.urdf:7:93 joint \"degrees\": effort limit 0 is taken as not given",
        "hand.urdf:7:93 joint \"degrees\": limits 0..90 look like degrees; they are read as radians",
        "hand.urdf:8:69 joint \"fixed\": is fixed; its <mimic> is not used",
        "hand.urdf:6:1 joint \"still\": lower and upper limit are both 0.5; held fixed",
    ];
    assert_eq!(notes, expected);
    let robot = loaded.robot;
    assert_eq!(robot.joints[2].kind, JointKind::Fixed);
    assert!((robot.joints[2].parent_from_joint.rotation.angle() - 0.5).abs() < 1e-15);
    let limits = robot.joints[3].limits.unwrap();
    assert_eq!((limits.velocity, limits.effort), (Some(2.0), None));
    let regrasp_geometry::Shape::Mesh(mesh) = &robot.links[1].collision[0].shape else { panic!("not a mesh") };
    // Mirrored and stretched by two: still positive.
    assert!((mesh.signed_volume() - 2e-9).abs() < 1e-18);
}

#[test]
fn chains_of_followers_follow_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let joint = |name: &str, parent: &str, child: &str, more: &str| {
        format!(
            "<joint name='{name}' type='revolute'><parent link='{parent}'/><child link='{child}'/><axis xyz='0 0 1'/><limit lower='-9' upper='9'/>{more}</joint>"
        )
    };
    let text = format!(
        "<robot name='r'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>{}{}{}</robot>",
        joint("j3", "c", "d", "<mimic joint='j2' multiplier='2' offset='1'/>"),
        joint("j2", "b", "c", "<mimic joint='j1' multiplier='3' offset='0.5'/>"),
        joint("j1", "a", "b", ""),
    );
    let robot = load(&write(folder.path(), "hand.urdf", text)).unwrap().robot;
    let coupling = robot.joints[0].coupling.as_ref().unwrap();
    let (leader, multiplier) = coupling.single().unwrap();
    // j3 = 2 (3 j1 + 0.5) + 1
    assert_eq!((robot.joints[leader.0].name.as_str(), multiplier, coupling.offset), ("j1", 6.0, 2.0));
}

#[test]
fn lenient_reading_lists_what_it_drops() {
    let folder = tempfile::tempdir().unwrap();
    let text = "<robot name='r'><link name='a'><collision><geometry><mesh filename='gone.stl'/></geometry></collision>
<collision><geometry><cone/></geometry></collision><collision/></link><link name='b'/>
<joint name='j' type='planar'><parent link='a'/><child link='b'/></joint></robot>";
    let path = write(folder.path(), "hand.urdf", text);
    assert_eq!(load(&path).unwrap_err().len(), 4);
    let loaded = load_with(&path, &LoadOptions { lenient: true, ..Default::default() }).unwrap();
    assert_eq!(loaded.notes.len(), 4, "{:?}", loaded.notes);
    assert!(loaded.notes[0].contains("collision geometry dropped: \"gone.stl\" not found"));
    assert!(loaded.notes[3].ends_with("type \"planar\" is not supported; held fixed"));
    assert_eq!(loaded.robot.joints[0].kind, JointKind::Fixed);
}

/// A bundled URDF and hand file, as seeds of garbage.
fn seeds() -> (String, String) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/wide_four_finger");
    (fs::read_to_string(folder.join("hand.urdf")).unwrap(), fs::read_to_string(folder.join("hand.toml")).unwrap())
}

/// `text` with a part cut out, doubled, or replaced.
fn mutated(text: &str, at: usize, length: usize, with: &str, how: u8) -> Vec<u8> {
    let bytes = text.as_bytes();
    let at = at % bytes.len();
    let end = (at + length).min(bytes.len());
    let (head, part, tail) = (&bytes[..at], &bytes[at..end], &bytes[end..]);
    match how {
        0 => [head, tail].concat(),
        1 => [head, part, part, tail].concat(),
        _ => [head, with.as_bytes(), tail].concat(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn no_robot_file_causes_a_panic(at in 0usize..20_000, length in 0usize..200, with in "[ -~]{0,8}|nan|1e999|-1|0|<joint>|\"|&#0;", how in 0u8..3) {
        let folder = tempfile::tempdir().unwrap();
        let path = write(folder.path(), "hand.urdf", mutated(&seeds().0, at, length, &with, how));
        let _ = load_hand(&path, &LoadOptions::default());
        let _ = load_hand(&path, &LoadOptions { lenient: true, ..Default::default() });
    }

    #[test]
    fn no_hand_file_causes_a_panic(at in 0usize..2_000, length in 0usize..60, with in "[ -~]{0,8}|nan|inf|-1|0|\\[\\[", how in 0u8..3) {
        let folder = tempfile::tempdir().unwrap();
        let (urdf, hand) = seeds();
        write(folder.path(), "hand.urdf", urdf);
        let path = write(folder.path(), "hand.toml", mutated(&hand, at, length, &with, how));
        let _ = load_hand(&path, &LoadOptions::default());
    }

    #[test]
    fn no_text_causes_a_panic(text in "\\PC{0,200}") {
        let folder = tempfile::tempdir().unwrap();
        let _ = load_robot(&write(folder.path(), "hand.urdf", &text), &LoadOptions::default());
        let _ = load_hand(&write(folder.path(), "hand.toml", &text), &LoadOptions::default());
    }
}
