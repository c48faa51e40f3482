//! Fingertips that are drawn and have no collision geometry: their visuals stand for it.

use regrasp_base::Rng;
use regrasp_robot::import::LoadedHand;
use regrasp_robot::inspect::InspectSettings;
use regrasp_robot::inspect::hand_file_text;
use regrasp_robot::inspect::whole::{FileNames, inspect_whole, robot_file_text};
use regrasp_robot::{LoadOptions, TipShape, load_hand, load_manipulator, load_robot};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::Arc;

const BALL: &str = r#"<visual><origin xyz="0 0 0.03"/><geometry><sphere radius="0.008"/></geometry></visual>"#;
const ROD: &str =
    r#"<collision><origin xyz="0 0 0.02"/><geometry><cylinder radius="0.006" length="0.03"/></geometry></collision>"#;

/// A link called `to` with what is in `inside`, on a joint of the same name.
fn link(from: &str, to: &str, (at, axis): (&str, &str), inside: &str) -> String {
    format!(
        r#"<link name="{to}">{inside}</link><joint name="{to}_joint" type="revolute"><parent link="{from}"/><child link="{to}"/><origin xyz="{at}"/><axis xyz="{axis}"/><limit lower="-1" upper="1"/></joint>
"#
    )
}

/// Three fingers of three joints on `palm`, whose last links have `tip` inside and whose middle links have `middle`.
fn fingers(palm: &str, middle: &str, tip: &str) -> String {
    let mut text = String::new();
    for (name, x) in [("i", 0.04), ("m", 0.0), ("t", -0.04)] {
        let [a, b, c] = ["a", "b", "c"].map(|part| format!("{name}_{part}"));
        text += &link(palm, &a, (&format!("{x} 0.03 0"), "1 0 0"), "");
        text += &link(&a, &b, ("0 0 0.01", "0 1 0"), middle);
        text += &link(&b, &c, ("0 0 0.04", "0 1 0"), tip);
        // A frame without anything, as many hands have at the end of a finger.
        let _ = write!(
            text,
            r#"<link name="{name}_end"/><joint name="{name}_end_joint" type="fixed"><parent link="{c}"/><child link="{name}_end"/><origin xyz="0 0 0.05"/></joint>"#
        );
    }
    text
}

fn write_urdf(folder: &Path, parts: &str) -> std::path::PathBuf {
    let path = folder.join("hand.urdf");
    let palm = r#"<link name="palm"><visual><geometry><box size="0.1 0.1 0.02"/></geometry></visual></link>"#;
    fs::write(&path, format!(r#"<robot name="r">{palm}{parts}</robot>"#)).unwrap();
    path
}

fn guess(folder: &Path, parts: &str) -> LoadedHand {
    load_hand(&write_urdf(folder, parts), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// What is said of links whose visuals stand, or could stand, for their collision geometry.
fn said(loaded: &LoadedHand) -> Vec<&String> {
    loaded.notes.iter().filter(|note| note.starts_with("links without collision geometry")).collect()
}

/// The hand file that is written for `loaded`, read back.
fn again(folder: &Path, loaded: &LoadedHand) -> LoadedHand {
    let path = folder.join("hand.toml");
    fs::write(&path, hand_file_text(&loaded.hand, "hand.urdf", &BTreeSet::new())).unwrap();
    load_hand(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn what_is_drawn_of_a_fingertip_is_measured_where_it_has_no_collision_geometry() {
    let folder = tempfile::tempdir().unwrap();
    let same = guess(folder.path(), &fingers("palm", ROD, &BALL.replace("visual", "collision")));
    let drawn = guess(folder.path(), &fingers("palm", ROD, BALL));
    assert_eq!(drawn.hand.fingers.len(), 3);
    for (finger, other) in drawn.hand.fingers.iter().zip(&same.hand.fingers) {
        assert!(matches!(finger.tip.shape, TipShape::Sphere { radius } if radius == 0.008), "{:?}", finger.tip.shape);
        assert_eq!((finger.tip.link, finger.tip.center_in_body), (other.tip.link, other.tip.center_in_body));
        assert_eq!(finger.rest, other.rest);
    }
    assert_eq!(
        said(&drawn),
        [
            "links without collision geometry for which their visuals stand (`collision_from_visuals` in the hand file): \"i_c\", \"m_c\", \"t_c\""
        ]
    );
    assert_eq!(said(&same), [""; 0]);
    // The palm is drawn too. It is no fingertip, and a hand with some collision geometry may mean that it has none.
    assert!(drawn.hand.palm.is_empty());

    let read = again(folder.path(), &drawn);
    assert_eq!(read.hand.fingers.len(), 3);
    for (finger, other) in drawn.hand.fingers.iter().zip(&read.hand.fingers) {
        assert_eq!((finger.tip.link, finger.tip.radius()), (other.tip.link, other.tip.radius()));
        assert!((finger.tip.center_in_body - other.tip.center_in_body).norm() < 1e-6);
        assert!(read.hand.robot.links[finger.tip.link.0].collision_from_visuals);
    }
}

#[test]
fn all_that_is_drawn_is_collision_geometry_where_a_hand_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = guess(folder.path(), &fingers("palm", &ROD.replace("collision", "visual"), BALL));
    let has_geometry = loaded.hand.robot.links.iter().filter(|link| !link.collision.is_empty()).count();
    assert_eq!((has_geometry, loaded.hand.palm.len()), (7, 1));
    assert_eq!(again(folder.path(), &loaded).hand.palm.len(), 1);
}

#[test]
fn meshes_that_are_drawn_are_read_files_and_may_be_missing() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = r#"<visual><geometry><mesh filename="tip.obj" scale="0.001 0.001 0.001"/></geometry></visual>"#;
    let lost = guess(folder.path(), &fingers("palm", ROD, mesh));
    let notes = said(&lost);
    assert!(notes.len() == 1 && notes[0].contains("cannot be read") && notes[0].contains("tip.obj"), "{notes:?}");
    assert!(lost.hand.fingers.iter().all(|finger| matches!(finger.tip.shape, TipShape::Point)));

    // The same where what cannot be read is left out.
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    let lost = load_hand(&folder.path().join("hand.urdf"), &lenient).unwrap();
    assert!(said(&lost)[0].contains("cannot be read"), "{:?}", lost.notes);
    assert!(!hand_file_text(&lost.hand, "hand.urdf", &BTreeSet::new()).contains("collision_from_visuals"));

    let corners = ["v -8 -8 0", "v 8 -8 0", "v 8 8 0", "v -8 8 0", "v 0 0 30"];
    let faces = ["f 1 3 2", "f 1 4 3", "f 1 2 5", "f 2 3 5", "f 3 4 5", "f 4 1 5"];
    fs::write(folder.path().join("tip.obj"), corners.join("\n") + "\n" + &faces.join("\n")).unwrap();
    let found = guess(folder.path(), &fingers("palm", ROD, mesh));
    assert_eq!(found.inputs.iter().filter(|input| input.name == "tip.obj").count(), 1);
    assert!(found.hand.fingers.iter().all(|finger| matches!(finger.tip.shape, TipShape::Hull { .. })));
    let read = again(folder.path(), &found);
    assert_eq!(read.inputs.iter().map(|input| input.role.as_str()).collect::<Vec<_>>(), ["hand", "urdf", "mesh"]);
}

/// A sheet has no inside: said once for each link, by its name.
#[test]
fn a_tip_that_is_a_sheet_is_refused_once() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tip.obj"), "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0.02\nf 1 2 3\n").unwrap();
    let mesh = r#"<collision><geometry><mesh filename="tip.obj"/></geometry></collision>"#;
    let error =
        load_hand(&write_urdf(folder.path(), &fingers("palm", ROD, mesh)), &LoadOptions::default()).unwrap_err();
    let said: Vec<(&str, &str)> = error.diagnostics.iter().map(|d| (d.code, d.element.as_str())).collect();
    let expected = [r#"link "i_c""#, r#"link "m_c""#, r#"link "t_c""#].map(|link| ("U210", link));
    assert_eq!(said, expected, "{error}");
}

#[test]
fn a_hand_file_names_only_links_whose_visuals_are_all_they_have() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = guess(folder.path(), &fingers("palm", ROD, BALL));
    let text = hand_file_text(&loaded.hand, "hand.urdf", &BTreeSet::new());
    let list = r#"collision_from_visuals = ["i_c", "m_c", "t_c"]"#;
    assert!(text.contains(list), "{text}");
    let with = |names: &str| {
        let path = folder.path().join("hand.toml");
        fs::write(&path, text.replace(list, &format!("collision_from_visuals = {names}"))).unwrap();
        let read = load_hand(&path, &LoadOptions::default());
        read.map_err(|error| error.diagnostics.iter().map(|d| format!("{} {}", d.code, d.problem)).collect::<Vec<_>>())
    };
    assert_eq!(with(r#"["palm", "i_c", "m_c", "t_c"]"#).unwrap().hand.palm.len(), 1);
    let refused = |names: &str| with(names).unwrap_err();
    assert_eq!(refused(r#"["i_d"]"#), ["U205 the robot has no link \"i_d\""]);
    assert_eq!(refused(r#"["i_b"]"#), ["U213 link \"i_b\" has collision geometry of its own"]);
    assert_eq!(refused(r#"["i_end"]"#), ["U213 link \"i_end\" has no visual geometry"]);
    assert_eq!(refused("[3]").len(), 1);
    assert_eq!(refused("true").len(), 1);
}

#[test]
fn a_hand_on_a_robot_has_the_tips_that_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let mut parts = String::new();
    for k in 0..6 {
        let from = if k == 0 { "palm".to_owned() } else { format!("arm_{}", k - 1) };
        parts += &link(&from, &format!("arm_{k}"), ("0 0 0.1", ["0 0 1", "0 1 0"][k % 2]), ROD);
    }
    parts += r#"<link name="hand"/><joint name="hand_joint" type="fixed"><parent link="arm_5"/><child link="hand"/></joint>"#;
    parts += &fingers("hand", ROD, BALL);
    let urdf = write_urdf(folder.path(), &parts);
    let options = LoadOptions::default();
    let robot = Arc::new(load_robot(&urdf, &options).unwrap().robot);
    let settings = InspectSettings { n_postures: 10 };
    let whole = inspect_whole(robot, (&urdf, None), &options, &settings, &mut Rng::keyed(1, "i", 0)).unwrap().unwrap();
    let hand = whole.hands[0].hand.as_ref().unwrap();
    assert!(hand.fingers.iter().all(|finger| finger.tip.radius() == 0.008));
    assert!(whole.notes.iter().any(|note| note.contains("for which their visuals stand")), "{:?}", whole.notes);
    fs::write(folder.path().join("hand.toml"), hand_file_text(hand, "hand.urdf", &BTreeSet::new())).unwrap();
    let names = FileNames { urdf: "hand.urdf".into(), srdf: None, hands: vec![Some("hand.toml".into())] };
    let path = folder.path().join("robot.toml");
    fs::write(&path, robot_file_text(&whole.robot, &whole, &names)).unwrap();
    let read = load_manipulator(&path, &options).unwrap_or_else(|error| panic!("{error}")).manipulator;
    for finger in &read.hands[0].hand.fingers {
        assert_eq!(finger.tip.radius(), 0.008);
        assert_eq!(read.robot.links[finger.tip.link.0].collision.len(), 1);
    }
}
