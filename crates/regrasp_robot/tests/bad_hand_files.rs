//! Every bad hand file and SRDF is refused with its message.

use regrasp_robot::import::srdf::{joints_of_group, load_srdf};
use regrasp_robot::{LoadOptions, load_hand, load_robot};
use std::fs;
use std::path::Path;

/// Two fingers of two joints on a base that turns; `lower` mimics in finger `b`.
const URDF: &str = r#"<robot name="pincer">
<link name="arm"/><link name="palm"/>
<link name="a1"/><link name="a2"/><link name="a_tip"/><link name="b1"/><link name="b2"/>
<joint name="wrist" type="revolute"><parent link="arm"/><child link="palm"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="ja1" type="revolute"><parent link="palm"/><child link="a1"/><origin xyz="0.03 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="ja2" type="revolute"><parent link="a1"/><child link="a2"/><origin xyz="0 0 0.05"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="ja_tip" type="fixed"><parent link="a2"/><child link="a_tip"/><origin xyz="0 0 0.04"/></joint>
<joint name="jb1" type="revolute"><parent link="palm"/><child link="b1"/><origin xyz="-0.03 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="jb2" type="revolute"><parent link="b1"/><child link="b2"/><origin xyz="0 0 0.05"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/><mimic joint="jb1" multiplier="-2" offset="0.5"/></joint>
</robot>"#;

const HEAD: &str = "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\n";
const POINT: &str = "tip = { shape = \"point\" }";

fn write_files(folder: &Path, hand: &str) -> std::path::PathBuf {
    fs::write(folder.join("hand.urdf"), URDF).unwrap();
    let path = folder.join("hand.toml");
    fs::write(&path, hand).unwrap();
    path
}

/// The messages for `hand` as `hand.toml`, with the folder left out.
fn messages(hand: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = write_files(folder.path(), hand);
    let error = load_hand(&path, &LoadOptions::default()).expect_err("the file is bad");
    let prefix = format!("{}/", folder.path().display());
    error.diagnostics.iter().map(|d| d.to_string().replace(&prefix, "")).collect()
}

/// A hand file with fingers `a` and `b`, where `more` stands in finger `a`.
fn with_finger(more: &str) -> String {
    format!(
        "{HEAD}base_link = \"palm\"\n[[fingers]]\nname = \"a\"\n{more}\n[[fingers]]\nname = \"b\"\ntip_link = \"b2\"\n{POINT}\n"
    )
}

macro_rules! refused {
    ($name:ident, $text:expr, [$($message:expr),* $(,)?]) => {
        #[test]
        fn $name() {
            let expected: Vec<&str> = vec![$($message),*];
            assert_eq!(messages(&$text), expected);
        }
    };
}

refused!(
    text_that_is_not_toml,
    "format = \n",
    ["U200 hand.toml:1:10: string values must be quoted, expected literal string"]
);
refused!(an_empty_file, "", ["U200 hand.toml: is empty; expected a TOML file"]);
refused!(
    a_urdf_called_toml,
    URDF,
    [
        "U200 hand.toml: looks like XML; expected a TOML file\n  fix: where it is a URDF, `regrasp inspect` makes a hand file of it, and `regrasp place HAND OBJECT` a scene of that"
    ]
);
refused!(
    a_scene_file,
    "format = \"regrasp-scene\"\nformat_version = 1\ntask = \"in_hand\"\n",
    [
        "U204 hand.toml:1:10 key \"format\": is \"regrasp-scene\"; expected \"regrasp-hand\"\n  fix: `regrasp inspect` on a URDF writes a hand file; a scene \
      names its own in `hand.file`"
    ]
);
refused!(
    a_file_of_comments,
    "# nothing",
    [
        "U202 hand.toml:1:1: has no `format`\n  fix: add format = \"regrasp-hand\" as the first line",
        "U202 hand.toml:1:1: has no `format_version`\n  fix: add format_version = 1",
        "U202 hand.toml:1:1: has no `urdf`\n  fix: add urdf = \"hand.urdf\"",
        "U202 hand.toml:1:1: has no `fingers`\n  fix: regrasp inspect hand.urdf -o hand.toml    # writes the fingers that it finds"
    ]
);
refused!(
    a_key_that_is_misspelt,
    format!("basse_link = \"palm\"\n{}", with_finger(&format!("tip_link = \"a_tip\"\n{POINT}\ncolour = 1"))),
    [
        r#"U201 hand.toml:1:1 key "basse_link": is not a key that exists here; expected format, format_version, urdf, srdf, base_link, allow, couplings, held, without_geometry, collision_from_visuals or fingers
  fix: did you mean base_link?"#,
        r#"U201 hand.toml:10:1 key "fingers[0].colour": is not a key that exists here; expected name, tip_link, first_joint, tip, pad, contact, torsion_radius or rest"#
    ]
);
refused!(
    another_version,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")).replace("format_version = 1", "format_version = 2"),
    [r#"U204 hand.toml:2:18 key "format_version": is 2; expected 1, the version that this program reads"#]
);
refused!(
    a_urdf_that_is_not_there,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")).replace("hand.urdf", "gone.urdf"),
    [
        r#"U101 hand.toml:3:8 key "urdf": "gone.urdf" not found; looked in: gone.urdf; expected a path relative to this file, or package://NAME/PATH"#
    ]
);
refused!(
    a_link_that_is_misspelt,
    with_finger(&format!("tip_link = \"a_tpi\"\n{POINT}")),
    [
        r#"U205 hand.toml:7:12 key "fingers[0].tip_link": the robot has no link "a_tpi"; expected the name of a link of the URDF
  fix: did you mean "a_tip"?"#
    ]
);
refused!(
    no_fingers,
    HEAD,
    [
        "U202 hand.toml:1:1: has no `fingers`\n  fix: regrasp inspect hand.urdf -o hand.toml    # writes the fingers that it finds"
    ]
);
refused!(
    an_empty_list_of_fingers,
    format!("{HEAD}fingers = []\n"),
    [r#"U202 hand.toml:4:11 key "fingers": is empty; expected at least one [[fingers]] table
  fix: regrasp inspect hand.urdf -o hand.toml    # writes the fingers that it finds"#]
);
refused!(
    fingers_that_are_numbers,
    format!("{HEAD}fingers = [1]\n"),
    [r#"U203 hand.toml:4:12 key "fingers[0]": is 1, an integer; expected a table"#]
);
refused!(
    a_tip_larger_than_the_hand,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"sphere\", radius = 5 }"),
    [
        r#"U217 hand.toml finger "a": its tip has a radius of 5 m, more than the 0.1082 m of the hand; expected a radius in metres"#
    ]
);
refused!(
    no_tip,
    with_finger("tip_link = \"a_tip\""),
    [r#"U202 hand.toml:5:1 table "fingers[0]": has no `tip`
  fix: add tip = { shape = "sphere", radius = 0.012, center = [0, 0, 0] }"#]
);
refused!(
    a_tip_shape_that_is_misspelt,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"spere\", radius = 0.01 }"),
    [
        r#"U213 hand.toml:8:17 key "fingers[0].tip.shape": is "spere" (did you mean "sphere"?); expected sphere, ellipsoid, point or mesh"#
    ]
);
refused!(
    an_ellipsoid_that_is_a_plate,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"ellipsoid\", radii = [0.01, 0.01, 0.001] }"),
    [
        r#"U213 hand.toml:8:38 key "fingers[0].tip.radii": is [0.01, 0.01, 0.001]; expected three lengths above 0, in metres, none less than a fifth of another"#
    ]
);
refused!(
    an_ellipsoid_without_radii_that_is_turned_by_no_rotation,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"ellipsoid\", quat_xyzw = [0, 0, 0, 0.5] }"),
    [
        "U202 hand.toml:8:7 table \"fingers[0].tip\": has no `radii`\n  fix: add radii = [0.009, 0.007, 0.007], the half axes in metres",
        r#"U213 hand.toml:8:42 key "fingers[0].tip.quat_xyzw": has length 0.5; expected a unit quaternion, x y z w"#
    ]
);
refused!(
    a_pad_without_a_direction_and_with_a_wide_angle,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}\npad = {{ axis = [0, 0, 0], angle_deg = 200 }}")),
    [
        r#"U213 hand.toml:9:16 key "fingers[0].pad.axis": is the zero vector, which is no direction; expected a direction out of the pad, in the frame of the tip link"#,
        r#"U213 hand.toml:9:39 key "fingers[0].pad.angle_deg": is 200; expected an angle above 0 and at most 180, in degrees"#
    ]
);
refused!(
    a_negative_tip_radius,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"sphere\", radius = -0.01 }"),
    [
        r#"U213 hand.toml:8:36 key "fingers[0].tip.radius": is -0.01; expected a length above 0, in metres, or shape = "point" for a sharp tip"#
    ]
);
refused!(
    a_tip_radius_of_nan,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"sphere\", radius = nan }"),
    [r#"V001 hand.toml:8:36 key "fingers[0].tip.radius": is nan; expected a finite number"#]
);
refused!(
    a_tip_radius_in_words,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"sphere\", radius = \"big\" }"),
    [r#"U203 hand.toml:8:36 key "fingers[0].tip.radius": is "big", a string; expected a number"#]
);
refused!(
    a_center_of_two_numbers,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"sphere\", radius = 0.01, center = [0, 1] }"),
    [r#"U203 hand.toml:8:51 key "fingers[0].tip.center": has 2 values; expected an array of 3 numbers"#]
);
refused!(
    a_hull_of_nothing,
    with_finger("tip_link = \"a_tip\"\ntip = { shape = \"mesh\" }"),
    [
        r#"U210 hand.toml:5:1 finger "a": tip link has no collision geometry; expected collision geometry of the tip link that encloses a volume
  fix: shape = "sphere" for a round tip"#
    ]
);
refused!(
    a_rest_position_outside_the_limits,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}\nrest = {{ ja1 = 2.0, ja3 = 0 }}")),
    [
        r#"U212 hand.toml:9:16 joint "ja1": rest position 2 is outside the limits; expected -1..1"#,
        r#"U205 hand.toml:9:27 key "rest": finger "a" has no independent joint "ja3"; expected one of ja1, ja2
  fix: did you mean ja1?"#
    ]
);
refused!(
    a_rest_position_of_a_follower,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")).replace("\"b2\"\n", "\"b2\"\nrest = { jb2 = 0.0 }\n"),
    [r#"U205 hand.toml:12:16 key "rest": finger "b" has no independent joint "jb2"; expected one of jb1
  fix: did you mean jb1?"#]
);
refused!(
    a_pair_that_is_none,
    format!(
        "{}\n",
        with_finger(&format!("tip_link = \"a_tip\"\n{POINT}"))
            .replace("base_link", "allow = [[\"a1\"], [\"a1\", \"b3\"]]\nbase_link")
    ),
    [
        r#"U203 hand.toml:4:10 key "allow[0]": has 1 values; expected pairs of link names: [["link_a", "link_b"], ...]"#,
        r#"U205 hand.toml:4:25 key "allow[1][1]": the robot has no link "b3"; expected the name of a link of the URDF
  fix: did you mean "b1"?"#
    ]
);
refused!(
    two_fingers_of_one_name,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")).replace("\"b\"", "\"a\""),
    [r#"U211 hand.toml:9:1 finger "a": the name is empty or used twice; expected a name of its own"#]
);
refused!(
    fingers_that_share_a_joint,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")).replace("\"palm\"", "\"arm\""),
    [r#"U208 hand.toml:9:1 finger "b": joint "wrist" moves finger "a" too; expected fingers that share no joint
  fix: base_link = "palm", so that shared joints belong to no finger"#]
);
refused!(
    a_tip_that_the_base_does_not_carry,
    with_finger(&format!("tip_link = \"arm\"\n{POINT}")),
    [
        r#"U206 hand.toml:5:1 finger "a": tip link "arm" is not carried by base link "palm"; expected a tip link below the base link
  fix: tip_link = "a_tip""#
    ]
);
refused!(
    a_base_on_another_finger,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")).replace("base_link = \"palm\"", "base_link = \"b1\""),
    [
        r#"U206 hand.toml:5:1 finger "a": tip link "a_tip" is not carried by base link "b1"; expected a tip link below the base link
  fix: base_link = "palm""#
    ]
);
refused!(
    a_first_joint_of_another_finger,
    with_finger(&format!("tip_link = \"a_tip\"\nfirst_joint = \"jb1\"\n{POINT}")),
    [
        r#"U206 hand.toml:5:1 finger "a": first joint "jb1" is not between "palm" and "a_tip"; expected a joint of the finger
  fix: first_joint = "ja1""#
    ]
);
refused!(
    no_tip_link,
    with_finger(POINT),
    [r#"U202 hand.toml:5:1 table "fingers[0]": has no `tip_link`
  fix: add tip_link = "a_tip", or another end: "b2""#]
);
refused!(
    a_tip_that_does_not_move,
    with_finger(&format!("tip_link = \"palm\"\n{POINT}")),
    [r#"U207 hand.toml:5:1 finger "a": no joint moves between "palm" and "palm"; expected at least one moving joint"#]
);
refused!(
    a_chain_that_starts_after_its_leader,
    with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")).replace("\"b2\"\n", "\"b2\"\nfirst_joint = \"jb2\"\n"),
    [
        r#"U209 hand.toml:9:1 finger "b": joint "jb2" follows joint "jb1", which is on another finger or on none; expected followers on the chain of the joint they follow
  fix: first_joint = "jb1""#
    ]
);

#[test]
fn a_good_hand_file_gives_chains_with_couplings() {
    let folder = tempfile::tempdir().unwrap();
    let text = with_finger(&format!("tip_link = \"a_tip\"\n{POINT}\nrest = {{ ja1 = 0.25 }}"));
    let loaded = load_hand(&write_files(folder.path(), &text), &LoadOptions::default()).unwrap();
    let hand = loaded.hand;
    assert_eq!(hand.joint_names(), ["ja1", "ja2", "jb1"]);
    assert_eq!(hand.fingers[0].rest, [0.25, 0.0]);
    // jb2 = -2 jb1 + 0.5 within -1..1 leaves jb1 within -0.25..0.75.
    let b = &hand.fingers[1].chain;
    assert!((b.lower[0] + 0.25).abs() < 1e-15 && (b.upper[0] - 0.75).abs() < 1e-15);
    // The last link is at z 0.05 of the first, turned by jb1 about y.
    let mut poses = Vec::new();
    b.forward(&[0.4], &mut poses);
    let turned: f64 = 0.4;
    let expected = nalgebra::Vector3::new(-0.03 + 0.05 * turned.sin(), 0.0, 0.05 * turned.cos());
    assert!((poses[1].translation.vector - expected).norm() < 1e-15);
    let angle = poses[1].rotation.scaled_axis().y;
    assert!((angle - (0.4 + (-2.0 * 0.4 + 0.5))).abs() < 1e-12, "{angle}");
    let roles: Vec<&str> = loaded.inputs.iter().map(|input| input.role.as_str()).collect();
    assert_eq!(roles, ["hand", "urdf"]);
    assert_eq!(loaded.inputs[1].sha256, regrasp_base::files::sha256(URDF.as_bytes()));
}

#[test]
fn joints_before_the_first_are_held_and_written_down_so() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{HEAD}[[fingers]]\nname = \"a\"\ntip_link = \"a_tip\"\nfirst_joint = \"ja1\"\n{POINT}\n[[fingers]]\nname = \"b\"\ntip_link = \"b2\"\nfirst_joint = \"jb1\"\n{POINT}\n"
    );
    let loaded = load_hand(&write_files(folder.path(), &text), &LoadOptions::default()).unwrap();
    assert_eq!(loaded.hand.joint_names(), ["ja1", "ja2", "jb1"]);
    assert!(loaded.notes.contains(&"joint \"wrist\" belongs to no finger; held at 0".to_owned()), "{:?}", loaded.notes);
    let written = regrasp_robot::inspect::hand_file_text(&loaded.hand, "hand.urdf", &Default::default());
    let again = load_hand(&write_files(folder.path(), &written), &LoadOptions::default()).unwrap().hand;
    assert_eq!(again.joint_names(), loaded.hand.joint_names());
    assert_eq!(again.fingers[0].tip, loaded.hand.fingers[0].tip);
}

#[test]
fn a_hand_in_millimetres_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_files(folder.path(), &with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")));
    fs::write(folder.path().join("hand.urdf"), URDF.replace("0.0", "").replace("xyz=\"0 0 5\"", "xyz=\"0 0 50\""))
        .unwrap();
    let error = load_hand(&path, &LoadOptions::default()).unwrap_err();
    assert_eq!(error.diagnostics[0].code, "U216", "{error}");
    assert_eq!(error.diagnostics[0].fix, "multiply every length of the URDF by 0.001");
}

const SRDF: &str = r#"<robot name="pincer">
<group name="a"><chain base_link="palm" tip_link="a_tip"/></group>
<group name="both"><group name="a"/><joint name="jb1"/><link name="b1"/></group>
<end_effector name="hand" group="both" parent_link="arm"/>
<disable_collisions link1="b1" link2="a1" reason="Never"/>
</robot>"#;

#[test]
fn an_srdf_gives_groups_end_effectors_and_pairs() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("srdf = \"hand.srdf\"\n{}", with_finger(&format!("tip_link = \"a_tip\"\n{POINT}")));
    let path = write_files(folder.path(), &text);
    fs::write(folder.path().join("hand.srdf"), SRDF).unwrap();
    let hand = load_hand(&path, &LoadOptions::default()).unwrap().hand;
    let link = |name: &str| hand.robot.link_named(name).unwrap();
    assert!(hand.may_touch(link("a1"), link("b1")));
    assert!(!hand.may_touch(link("a2"), link("b1")));
    let srdf = load_srdf(&folder.path().join("hand.srdf"), &hand.robot, &LoadOptions::default()).unwrap().srdf;
    let names: Vec<&str> =
        joints_of_group(&srdf, &hand.robot, "both").iter().map(|j| hand.robot.joints[j.0].name.as_str()).collect();
    assert_eq!(names, ["jb1", "ja1", "ja2"]);
    assert_eq!(srdf.end_effectors[0].parent_link, link("arm"));
    assert_eq!(srdf.disabled_pairs[0].reason, "Never");
}

#[test]
fn unknown_names_in_an_srdf_are_errors_or_notes() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path(), "");
    let robot = load_robot(&folder.path().join("hand.urdf"), &LoadOptions::default()).unwrap().robot;
    let path = folder.path().join("hand.srdf");
    let bad =
        SRDF.replace("a_tip", "a_tipp").replace("\"jb1\"", "\"jx_9\"").replace("group=\"both\"", "group=\"bohh\"");
    fs::write(&path, bad).unwrap();
    let prefix = format!("{}/", folder.path().display());
    let error = load_srdf(&path, &robot, &LoadOptions::default()).unwrap_err();
    let seen: Vec<String> = error.diagnostics.iter().map(|d| d.to_string().replace(&prefix, "")).collect();
    let expected = [
        "U161 hand.srdf:2:41 group \"a\": tip_link \"a_tipp\" is not a link of the robot; expected the name of a link\n  fix: did you mean \"a_tip\"?",
        "U162 hand.srdf:3:44 group \"both\": name \"jx_9\" is not a joint of the robot; expected the name of a joint\n  fix: --lenient to skip it",
        "U163 hand.srdf:4:27 end_effector \"hand\": group \"bohh\" is not a group of the robot; expected the name of a group\n  fix: did you mean \"both\"?",
    ];
    assert_eq!(seen, expected);
    assert_eq!(
        load_srdf(&path, &robot, &LoadOptions { lenient: true, ..LoadOptions::default() }).unwrap().notes.len(),
        3
    );
}
