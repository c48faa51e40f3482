//! Robots and hands that are made to be slow, to forge messages, or to carry numbers and counts that nothing can plan with.

use regrasp_base::InputError;
use regrasp_robot::{LoadOptions, ResolveOptions, load_hand, load_robot};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Reading a megabyte may take this long, on a machine that is busy. Quadratic readers took minutes.
const PATIENCE: Duration = Duration::from_secs(16);

fn robot(text: &str) -> Result<Vec<String>, InputError> {
    robot_with(text, &LoadOptions::default())
}

fn robot_with(text: &str, options: &LoadOptions) -> Result<Vec<String>, InputError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.urdf");
    fs::write(&path, text).unwrap();
    let started = Instant::now();
    let read = load_robot(&path, options).map(|loaded| loaded.notes);
    assert!(started.elapsed() < PATIENCE, "{:?} for {} bytes", started.elapsed(), text.len());
    read
}

fn first_code(read: Result<Vec<String>, InputError>) -> &'static str {
    read.expect_err("the file is bad").diagnostics[0].code
}

fn repeated(n: usize, element: impl Fn(usize) -> String) -> String {
    (0..n).map(element).collect()
}

#[test]
fn nothing_hides_deep_nesting_from_the_guard() {
    for before in ["", "<?x \"?>", "<?x '?>", "<!-- \" -->", "<!-- > ' -->", "<a><![CDATA[ \" ]]></a>", "<a></a \">"] {
        let text = format!("{before}{}", "<a>".repeat(200_000));
        assert_eq!(first_code(robot(&text)), "U105", "{before}");
    }
    // What is no nesting is none: tags in comments, character data, values and instructions.
    let tags = "<a>".repeat(100);
    let flat =
        format!("<?x {tags}?><robot name='r' note='>'><!-- {tags} --><link name='a'/><![CDATA[{tags}]]></robot>");
    assert_eq!(robot(&flat).unwrap(), Vec::<String>::new());
    assert_eq!(first_code(robot("<!DOCTYPE robot [ <!ENTITY a 'b'> ]><robot/>")), "U104");
    assert_eq!(first_code(robot("<robot><!ELEMENT></robot>")), "U100");
    assert_eq!(first_code(robot("<robot name='a><link/></robot>")), "U100");
    assert_eq!(first_code(robot("<robot <link/>")), "U100");
}

#[test]
fn attributes_and_name_spaces_are_counted_before_they_are_compared() {
    let attributes = |n| format!("<robot {}><link name='a'/></robot>", repeated(n, |i| format!("a{i}='=' ")));
    assert!(robot(&attributes(250)).is_ok());
    assert_eq!(first_code(robot(&attributes(100_000))), "U105");
    let spaces = |n| format!("<robot><link name='a'/>{}</robot>", repeated(n, |i| format!("<x xmlns:a{i}='u{i}'/>")));
    assert!(robot(&spaces(900)).is_ok());
    assert_eq!(first_code(robot(&spaces(50_000))), "U105");
}

#[test]
fn a_megabyte_of_faults_is_read_in_time_listed_in_part_and_counted() {
    let link = |inside: String| format!("<robot name='r'><link name='a'>\n{inside}</link></robot>");
    let error = robot(&link(repeated(9_990, |_| format!("<collision/>{}\n", " ".repeat(90))))).unwrap_err();
    assert_eq!((error.diagnostics.len(), error.n_more), (20, 9_970));
    assert_eq!(error.diagnostics[19].place.line, Some(21));
    assert!(error.to_string().ends_with("and 9,970 more"), "{error}");
    assert_eq!(first_code(robot(&link(repeated(60_000, |_| "<collision/>\n".into())))), "U105");
    // The same dropped: some remarks are listed.
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    let notes = robot_with(&link(repeated(9_990, |_| format!("<collision/>{}\n", " ".repeat(90)))), &lenient).unwrap();
    assert_eq!(notes.len(), 101);
    assert!(notes[100].ends_with("and 9890 more notes"), "{}", notes[100]);
    // Good elements, visuals, names that are a slip away from known ones, files that are not there.
    let ball = "<geometry><sphere radius='0.001'/></geometry>";
    assert!(robot(&link(repeated(10_000, |_| format!("<collision>{ball}</collision>\n")))).is_ok());
    assert!(robot(&link(repeated(15_000, |_| format!("<visual>{ball}</visual>\n")))).is_ok());
    assert!(robot(&link(repeated(60_000, |_| "<colision/>\n".into()))).is_ok());
    for name in ["n", "package://n"] {
        let mesh = |i| format!("<collision><geometry><mesh filename='{name}{i}/a.obj'/></geometry></collision>\n");
        assert_eq!(first_code(robot(&link(repeated(10_000, mesh)))), "U101");
    }
    let joints =
        repeated(20_000, |i| format!("<joint name='j{i}' type='fixed'><parent link='x'/><child link='y'/></joint>"));
    assert_eq!(first_code(robot(&format!("<robot name='r'><link name='a'/>{joints}</robot>"))), "U105");
}

/// A hand of `n_fingers` fingers of `n_joints` joints, each of which is followed by `n_followers`; the hand file beside it.
fn write_hand(folder: &Path, n_fingers: usize, n_joints: usize, n_followers: usize) -> std::path::PathBuf {
    let mut urdf = String::from("<robot name='r'><link name='palm'/>\n");
    let mut hand = String::from("format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\n");
    for finger in 0..n_fingers {
        let mut parent = "palm".to_owned();
        for joint in 0..n_joints + n_followers {
            let link = format!("l{finger}_{joint}");
            let follows = if joint < n_joints { String::new() } else { format!("<mimic joint='j{finger}_0'/>") };
            let _ = writeln!(
                urdf,
                "<link name='{link}'/><joint name='j{finger}_{joint}' type='revolute'><parent link='{parent}'/>\
                 <child link='{link}'/><origin xyz='0.01 0 0.01' rpy='0 0 {finger}'/><axis xyz='0 1 0'/>\
                 <limit lower='-1' upper='1'/>{follows}</joint>"
            );
            parent = link;
        }
        let _ =
            write!(hand, "[[fingers]]\nname = \"f{finger}\"\ntip_link = \"{parent}\"\ntip = {{ shape = \"point\" }}\n");
    }
    fs::write(folder.join("hand.urdf"), urdf + "</robot>").unwrap();
    let path = folder.join("hand.toml");
    fs::write(&path, hand).unwrap();
    path
}

#[test]
fn hands_of_too_many_fingers_or_joints_are_refused() {
    for (n_fingers, n_joints, n_followers, code) in
        [(7, 2, 0, ""), (65, 2, 0, "U221"), (2, 12, 4, ""), (2, 13, 0, "U222"), (2, 12, 5, "U222")]
    {
        let folder = tempfile::tempdir().unwrap();
        let path = write_hand(folder.path(), n_fingers, n_joints, n_followers);
        for path in [path, folder.path().join("hand.urdf")] {
            match load_hand(&path, &LoadOptions::default()) {
                Ok(loaded) => assert_eq!((loaded.hand.fingers.len(), code), (n_fingers, ""), "{}", path.display()),
                Err(error) => assert_eq!(error.diagnostics[0].code, code, "{error}"),
            }
        }
    }
}

#[test]
fn a_megabyte_of_names_that_do_not_exist_is_read_in_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_hand(folder.path(), 2, 2, 0);
    let mut urdf = fs::read_to_string(folder.path().join("hand.urdf")).unwrap().replace("</robot>", "");
    for i in 0..900 {
        let _ = write!(
            urdf,
            "<link name='a_link_{i}'/><joint name='a_joint_{i}' type='fixed'><parent link='palm'/><child link='a_link_{i}'/></joint>"
        );
    }
    fs::write(folder.path().join("hand.urdf"), urdf + "</robot>").unwrap();
    let hand = fs::read_to_string(&path).unwrap();
    let pairs = repeated(25_000, |i| format!("[\"a_lynk_{i}\", \"another_lynk_{i}\"],\n"));
    fs::write(&path, hand.replacen("[[fingers]]", &format!("srdf = \"hand.srdf\"\nallow = [{pairs}]\n[[fingers]]"), 1))
        .unwrap();
    let disabled = repeated(15_000, |i| format!("<disable_collisions link1='a_lynk_{i}' link2='b_lynk_{i}'/>\n"));
    fs::write(folder.path().join("hand.srdf"), format!("<robot name='r'>{disabled}</robot>")).unwrap();
    let started = Instant::now();
    let error = load_hand(&path, &LoadOptions::default()).unwrap_err();
    assert!(started.elapsed() < 2 * PATIENCE, "{:?}", started.elapsed());
    assert_eq!(error.diagnostics.len(), 20);
    assert!(error.diagnostics[0].fix.contains("did you mean \"a_link_"), "{}", error.diagnostics[0]);
    assert_eq!(error.n_more, 2 * 25_000 + 2 * 15_000 - 20);
}

#[test]
fn names_that_drive_a_terminal_or_fill_it_are_refused() {
    let link = |name: &str| format!("<robot name='r'><link name='a'/><link name='{name}'/></robot>");
    for name in ["a&#10;check ACCEPTED", "a&#x9b;2J", "a\u{202e}b", "a\u{200f}", "a\u{2028}", &"n".repeat(257)] {
        let error = robot(&link(name)).unwrap_err();
        assert_eq!(error.diagnostics[0].code, "V004", "{error}");
        assert!(error.to_string().lines().count() == 1 && error.to_string().len() < 400, "{error}");
        assert_eq!(first_code(robot(&format!("<robot name='{name}'><link name='a'/></robot>"))), "V004");
        let joint = format!("<joint name='{name}' type='fixed'><parent link='a'/><child link='b'/></joint>");
        let text = format!("<robot name='r'><link name='a'/><link name='b'/>{joint}</robot>");
        assert_eq!(first_code(robot(&text)), "V004");
    }
    assert_eq!(first_code(robot(&link(&"ü".repeat(256)))), "U133", "two roots, and good names");
    // Names that are asked for and do not exist are shown in part.
    let joint =
        format!("<joint name='j' type='fixed'><parent link='{}'/><child link='a'/></joint>", "n".repeat(1_000_000));
    let error = robot(&format!("<robot name='r'><link name='a'/>{joint}</robot>")).unwrap_err();
    assert_eq!(error.diagnostics[0].code, "U132");
    assert!(error.to_string().len() < 4_000, "{}", error.to_string().len());
    // Files with such names may be asked for: the message stays one line.
    let mesh = "<collision><geometry><mesh filename='a&#10;check ACCEPTED.obj'/></geometry></collision>";
    let error = robot(&format!("<robot name='r'><link name='a'>{mesh}</link></robot>")).unwrap_err();
    assert!(error.to_string().lines().all(|line| !line.starts_with("check")), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = write_hand(folder.path(), 2, 2, 0);
    let hand = fs::read_to_string(&path).unwrap();
    fs::write(&path, hand.replacen("\"f0\"", "\"f0\\ncheck ACCEPTED\"", 1)).unwrap();
    assert_eq!(load_hand(&path, &LoadOptions::default()).unwrap_err().diagnostics[0].code, "V004");
}

/// A robot of one joint with these elements in it.
fn with_joint(inside: &str) -> String {
    format!(
        "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\
         <joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 1 0'/><limit lower='-1' upper='1'/></joint>\
         <joint name='k' type='revolute'><parent link='b'/><child link='c'/>{inside}</joint></robot>"
    )
}

fn joint_of(inside: &str) -> Result<regrasp_robot::Joint, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.urdf");
    fs::write(&path, with_joint(inside)).unwrap();
    let loaded = load_robot(&path, &LoadOptions::default()).map_err(|error| error.diagnostics[0].code.to_owned())?;
    let index = loaded.robot.joint_named("k").unwrap().0;
    Ok(loaded.robot.joints[index].clone())
}

#[test]
fn axes_of_any_length_are_directions() {
    for axis in ["0 0 1e200", "0 0 1e-200", "0 0 1e-320", "0 0 1.7e308"] {
        let joint = joint_of(&format!("<axis xyz='{axis}'/><limit lower='-1' upper='1'/>")).unwrap();
        assert_eq!(joint.axis, nalgebra::Vector3::z_axis(), "{axis}");
    }
    let joint = joint_of("<axis xyz='3e200 0 -4e200'/><limit lower='-1' upper='1'/>").unwrap();
    assert!((joint.axis.into_inner() - nalgebra::Vector3::new(0.6, 0.0, -0.8)).norm() < 1e-15);
    assert_eq!(joint_of("<axis xyz='0 0 0'/><limit lower='-1' upper='1'/>").unwrap_err(), "U122");
}

#[test]
fn limits_that_no_plan_can_hold_are_refused_or_taken_as_not_given() {
    let limit = |text: &str| joint_of(&format!("<axis xyz='0 0 1'/><limit {text}/>"));
    for (velocity, expected) in
        [("4", Some(4.0)), ("1e308", None), ("1e9", Some(1e9)), ("0", None), ("1e-6", Some(1e-6))]
    {
        let joint = limit(&format!("lower='-1' upper='1' effort='{velocity}' velocity='{velocity}'")).unwrap();
        let limits = joint.limits.unwrap();
        assert_eq!((limits.velocity, limits.effort), (expected, expected), "{velocity}");
    }
    for velocity in ["1e-9", "9.9e-7", "1e-320"] {
        assert_eq!(limit(&format!("lower='-1' upper='1' velocity='{velocity}'")).unwrap_err(), "U123", "{velocity}");
    }
    assert_eq!(limit("lower='-1e300' upper='1'").unwrap_err(), "U124");
    assert_eq!(limit("lower='-1' upper='1.1e6'").unwrap_err(), "U124");
    assert!(limit("lower='-1e6' upper='1e6'").is_ok());
    for coupling in ["multiplier='1e7'", "multiplier='1e-320'", "multiplier='-1e-7'", "offset='1e7'", "multiplier='0'"]
    {
        let inside = format!("<axis xyz='0 0 1'/><limit lower='-1e6' upper='1e6'/><mimic joint='j' {coupling}/>");
        assert_eq!(joint_of(&inside).unwrap_err(), "U142", "{coupling}");
    }
}

#[test]
fn reading_stops_at_the_deadline() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 0.01\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    fs::write(folder.path().join("a.obj"), mesh).unwrap();
    let path = folder.path().join("hand.urdf");
    let collision = "<collision><geometry><mesh filename='a.obj'/></geometry></collision>";
    fs::write(&path, format!("<robot name='r'><link name='a'>{collision}</link></robot>")).unwrap();
    let resolve = ResolveOptions::default();
    let late = LoadOptions { deadline: Some(Instant::now()), resolve: resolve.clone(), ..LoadOptions::default() };
    assert_eq!(load_robot(&path, &late).unwrap_err().diagnostics[0].code, "F004");
    let deadline = Instant::now().checked_add(Duration::from_secs(3600));
    assert!(load_robot(&path, &LoadOptions { deadline, resolve, ..LoadOptions::default() }).is_ok());
}
