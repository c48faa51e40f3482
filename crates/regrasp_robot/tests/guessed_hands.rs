//! Hands guessed from a URDF: where their base is, which joints are held, and fixes that lead on when they are pasted.

use regrasp_robot::import::LoadedHand;
use regrasp_robot::{LoadOptions, load_hand};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A finger of two joints called `name` on `parent`.
fn finger(name: &str, parent: &str) -> String {
    let mut text = String::new();
    for (joint, from, to, at) in [
        ("low", parent.to_owned(), format!("{name}_a"), "0.03 0 0"),
        ("high", format!("{name}_a"), format!("{name}_b"), "0 0 0.04"),
    ] {
        let _ = write!(
            text,
            r#"<link name="{to}"><collision><origin xyz="0 0 0.02"/><geometry><capsule radius="0.005" length="0.04"/></geometry></collision></link>
<joint name="{name}_{joint}" type="revolute"><parent link="{from}"/><child link="{to}"/><origin xyz="{at}"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
"#
        );
    }
    text
}

/// A link called `name` that joint `{name}_joint` turns on `parent`.
fn turning(name: &str, parent: &str) -> String {
    format!(
        r#"<link name="{name}"/><joint name="{name}_joint" type="revolute"><parent link="{parent}"/><child link="{name}"/><axis xyz="0 0 1"/><limit lower="-1" upper="0.5"/></joint>
"#
    )
}

/// Writes the robot of `parts` and a hand file into `folder`; reads what `name` says.
fn load(folder: &Path, parts: &str, hand: &str, name: &str, base: Option<&str>) -> Result<LoadedHand, Vec<String>> {
    fs::write(folder.join("hand.urdf"), format!(r#"<robot name="r"><link name="root"/>{parts}</robot>"#)).unwrap();
    fs::write(folder.join("hand.toml"), hand).unwrap();
    let options = LoadOptions { base: base.map(str::to_owned), ..LoadOptions::default() };
    let prefix = format!("{}/", folder.display());
    load_hand(&folder.join(name), &options)
        .map_err(|error| error.diagnostics.iter().map(|d| d.to_string().replace(&prefix, "")).collect())
}

fn guess(parts: &str, base: Option<&str>) -> Result<LoadedHand, Vec<String>> {
    load(tempfile::tempdir().unwrap().path(), parts, "", "hand.urdf", base)
}

/// The hand: its base, and the joints of each finger.
fn summary(loaded: &LoadedHand) -> (String, Vec<Vec<String>>) {
    let hand = &loaded.hand;
    let base = hand.robot.links[hand.base.0].name.clone();
    (base, hand.fingers.iter().map(|finger| finger.chain.names.clone()).collect())
}

#[test]
fn a_fold_of_the_palm_that_two_fingers_share_is_held() {
    let parts =
        [finger("i", "root"), finger("m", "root"), turning("fold", "root"), finger("r", "fold"), finger("l", "fold")];
    let loaded = guess(&parts.concat(), None).unwrap();
    let (base, fingers) = summary(&loaded);
    assert_eq!(base, "root");
    assert_eq!(fingers.concat(), ["i_low", "i_high", "m_low", "m_high", "r_low", "r_high", "l_low", "l_high"]);
    assert!(
        loaded.notes.iter().any(|note| note == "joint \"fold_joint\" belongs to no finger; held at 0"),
        "{:?}",
        loaded.notes
    );
}

#[test]
fn a_robot_with_two_hands_asks_for_one_and_takes_it() {
    let hand = |side: &str| {
        let palm = format!("{side}_palm");
        let fingers: Vec<String> = ["a", "b", "c"].map(|name| finger(&format!("{side}_{name}"), &palm)).to_vec();
        turning(&format!("{side}_arm"), "root") + &turning(&palm, &format!("{side}_arm")) + &fingers.concat()
    };
    let parts = hand("left") + &hand("right");
    let messages = guess(&parts, None).unwrap_err();
    assert_eq!(
        messages,
        [
            "U208 hand.urdf: is a robot with more on it than one hand: fingers share joints with others; expected one hand\n  \
          fix: regrasp inspect with --base left_palm, or --base right_palm"
        ]
    );
    let (base, fingers) = summary(&guess(&parts, Some("right_palm")).unwrap());
    assert_eq!(base, "right_palm");
    assert_eq!(
        fingers.concat(),
        ["right_a_low", "right_a_high", "right_b_low", "right_b_high", "right_c_low", "right_c_high"]
    );
    // A base above the joints that all fingers share: those are held.
    let (base, fingers) = summary(&guess(&parts, Some("left_arm")).unwrap());
    assert_eq!(
        (base.as_str(), fingers[0].as_slice()),
        ("left_arm", ["left_a_low".to_owned(), "left_a_high".to_owned()].as_slice())
    );
}

#[test]
fn two_hands_on_one_stand_ask_for_one_and_are_taken_together_where_that_is_said() {
    let hand = |side: &str, n_fingers: usize| {
        let palm = format!("{side}_palm");
        let mount = turning(&palm, "root").replace("revolute", "fixed");
        let finger = |k: usize| finger(&format!("{side}_{k}"), &palm);
        mount + &(0..n_fingers).map(finger).collect::<String>()
    };
    let parts = hand("left", 3) + &hand("right", 4);
    assert_eq!(
        guess(&parts, None).unwrap_err(),
        [
            "U208 hand.urdf: is a robot with more on it than one hand: several links carry three fingers or more each; expected one hand\n  \
          fix: regrasp inspect with --base left_palm, or --base right_palm, or --base root for one hand of all fingers"
        ]
    );
    assert_eq!(summary(&guess(&parts, Some("left_palm")).unwrap()).1.len(), 3);
    assert_eq!(summary(&guess(&parts, Some("root")).unwrap()).1.len(), 7);
    // A thumb, or two, on a link of its own makes no second hand.
    let (base, fingers) = summary(&guess(&(hand("palm", 3) + &hand("thumb", 2)), None).unwrap());
    assert_eq!((base.as_str(), fingers.len()), ("root", 5));
}

/// Nobody plans around what is only drawn, so it is said; fingertips have their own remark.
#[test]
fn links_that_are_drawn_and_have_no_collision_geometry_are_named() {
    let drawn = r#"<link name="cover"><visual><geometry><box size="0.1 0.1 0.01"/></geometry></visual></link>"#;
    let cover = turning("cover", "root").replace("revolute", "fixed").replace(r#"<link name="cover"/>"#, drawn);
    let fingers = [finger("i", "root"), finger("m", "root"), finger("r", "root")].concat();
    let said = |parts: &str| {
        let notes = guess(parts, None).unwrap().notes;
        notes.into_iter().filter(|note| note.starts_with("links that are drawn")).collect::<Vec<String>>()
    };
    assert_eq!(
        said(&(cover + &fingers)),
        [
            "links that are drawn but have no collision geometry, so that plans do not keep clear of them (unless `collision_from_visuals` in the \
          hand file names them): \"cover\""
        ]
    );
    assert_eq!(said(&fingers), [""; 0]);
}

#[test]
fn a_gripper_on_an_arm_beside_wheels_is_named() {
    let arm = turning("torso", "root")
        + &turning("shoulder", "torso")
        + &turning("elbow", "shoulder")
        + &turning("wrist", "elbow");
    let parts =
        turning("wheel", "root") + &arm + &turning("head", "torso") + &finger("l", "wrist") + &finger("r", "wrist");
    // Wheel and head without geometry are no fingers.
    assert_eq!(summary(&guess(&parts, None).unwrap()).0, "wrist");
    let ball = r#"<collision><geometry><sphere radius="0.05"/></geometry></collision>"#;
    let shaped = |name: &str| (format!("<link name=\"{name}\"/>"), format!("<link name=\"{name}\">{ball}</link>"));
    let parts = [shaped("wheel"), shaped("head")].iter().fold(parts, |text, (bare, full)| text.replace(bare, full));
    assert_eq!(fix(&guess(&parts, None).unwrap_err()), "regrasp inspect with --base wrist");
    assert_eq!(summary(&guess(&parts, Some("wrist")).unwrap()).1.concat(), ["l_low", "l_high", "r_low", "r_high"]);
}

#[test]
fn a_base_link_that_is_not_there() {
    let parts = turning("palm", "root") + &finger("a", "palm");
    assert_eq!(
        guess(&parts, Some("plam")).unwrap_err(),
        [
            "U205 hand.urdf argument \"--base\": the robot has no link \"plam\"; expected the name of a link of the URDF\n  fix: --base palm"
        ]
    );
    assert_eq!(
        guess(&parts, Some("a_b")).unwrap_err(),
        [
            "U214 hand.urdf: has no joint that moves below link \"a_b\", so no finger; expected a hand with moving fingers"
        ]
    );
}

const HEAD: &str = "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\n";

fn table(name: &str, more: &str) -> String {
    format!(
        "[[fingers]]\nname = \"{name}\"\ntip_link = \"{name}_b\"\n{more}tip = {{ shape = \"sphere\", radius = 0.005, center = [0, 0, 0.04] }}\n"
    )
}

/// The fix of the first message.
fn fix(messages: &[String]) -> String {
    messages[0].split_once("\n  fix: ").unwrap_or_else(|| panic!("{messages:?}")).1.to_owned()
}

#[test]
fn first_joints_that_are_printed_hold_what_two_of_three_fingers_share() {
    let folder = tempfile::tempdir().unwrap();
    let parts = [finger("i", "root"), turning("fold", "root"), finger("r", "fold"), finger("l", "fold")].concat();
    let file = |r: &str, l: &str| format!("{HEAD}{}{}{}", table("i", ""), table("r", r), table("l", l));
    let messages = load(folder.path(), &parts, &file("", ""), "hand.toml", None).unwrap_err();
    assert_eq!(
        fix(&messages),
        "first_joint = \"r_low\" in finger \"r\" and first_joint = \"l_low\" in finger \"l\", so that shared joints are held"
    );
    let pasted = file("first_joint = \"r_low\"\n", "first_joint = \"l_low\"\n");
    assert_eq!(load(folder.path(), &parts, &pasted, "hand.toml", None).unwrap().hand.fingers.len(), 3);
}

#[test]
fn base_links_that_are_printed_lead_to_a_hand() {
    let folder = tempfile::tempdir().unwrap();
    let parts = turning("palm", "root") + &finger("i", "palm") + &finger("t", "palm");
    let file = |head: &str| format!("{HEAD}{head}{}{}", table("i", ""), table("t", ""));
    // Too low, then too high.
    for head in ["base_link = \"i_a\"\n", "base_link = \"root\"\n"] {
        let messages = load(folder.path(), &parts, &file(head), "hand.toml", None).unwrap_err();
        let fix = fix(&messages);
        assert!(fix.starts_with("base_link = \"palm\""), "{fix}");
        let pasted = format!("{}\n", fix.split(',').next().unwrap());
        assert_eq!(load(folder.path(), &parts, &file(&pasted), "hand.toml", None).unwrap().hand.fingers.len(), 2);
    }
}

#[test]
fn a_follower_of_another_finger_is_tied_and_can_be_held_in_the_urdf() {
    let folder = tempfile::tempdir().unwrap();
    let mimic = |text: &str| text.replace(r#"upper="1"/></joint>"#, r#"upper="1"/><mimic joint="i_high"/></joint>"#);
    let parts = finger("i", "root")
        + &finger("t", "root").replacen("upper=\"1\"/></joint>", "@", 1).replace('@', r#"upper="1"/></joint>"#);
    // Only the last joint of the thumb follows.
    let at = parts.rfind("<joint name=\"t_high\"").unwrap();
    let parts = format!("{}{}", &parts[..at], mimic(&parts[at..]));
    let loaded = load(folder.path(), &parts, "", "hand.urdf", None).unwrap();
    assert_eq!(loaded.hand.ties.len(), 1);
    let tag = r#"<joint name="t_high" type="fixed">"#;
    let pasted = parts.replace(r#"<joint name="t_high" type="revolute">"#, tag);
    let loaded = load(folder.path(), &pasted, "", "hand.urdf", None).unwrap();
    assert_eq!(summary(&loaded).1, [vec!["i_low", "i_high"], vec!["t_low"]]);
    assert_eq!(loaded.hand.ties, []);
}

#[test]
fn a_hand_file_without_a_urdf_is_told_the_one_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("left.urdf"), "").unwrap();
    fs::write(folder.path().join("hand.toml"), "format = \"regrasp-hand\"\nformat_version = 1\n").unwrap();
    let error = load_hand(&folder.path().join("hand.toml"), &LoadOptions::default()).unwrap_err();
    assert_eq!(error.diagnostics[0].fix, "add urdf = \"left.urdf\"");
}

/// A coupling that the follower's limits contradict is refused where no position is left, and told where hardly any is.
#[test]
fn leaders_that_can_hardly_move_are_told() {
    let coupled = |offset: f64| {
        let mimic =
            format!(r#"<joint name="i_high" type="revolute"><mimic joint="i_low" multiplier="1" offset="{offset}"/>"#);
        let parts = [finger("i", "root"), finger("m", "root")].concat();
        guess(&parts.replace(r#"<joint name="i_high" type="revolute">"#, &mimic), None)
    };
    let stuck =
        |loaded: LoadedHand| loaded.notes.iter().filter(|note| note.contains("can move only")).cloned().collect();
    let told: Vec<String> = stuck(coupled(-2.0).unwrap());
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(
        told[0].starts_with(
            "joint \"i_low\" can move only from 1 to 1, of -1..1: the limits of what follows it (\"i_high\")"
        ),
        "{told:?}"
    );
    assert_eq!(stuck(coupled(-1.0).unwrap()), Vec::<String>::new());
    let refused = coupled(-2.5).unwrap_err().concat();
    assert!(refused.contains("U143") && refused.contains("without <mimic> it moves by itself"), "{refused}");
}

#[test]
fn links_without_geometry_are_no_fingers_beside_others_that_have_some() {
    let parts = [finger("i", "root"), turning("caster", "root"), finger("m", "root"), finger("r", "root")].concat();
    let (_, fingers) = summary(&guess(&parts, None).unwrap());
    assert_eq!(fingers.len(), 3, "{fingers:?}");
    // Balls of a millimetre only stand in for geometry.
    let ball = r#"<link name="motor"><collision><geometry><sphere radius="0.001"/></geometry></collision></link>"#;
    let motor = turning("motor", "root").replace(r#"<link name="motor"/>"#, ball);
    let (_, fingers) = summary(&guess(&[finger("i", "root"), motor, finger("m", "root")].concat(), None).unwrap());
    assert_eq!(fingers.len(), 2, "{fingers:?}");
    // A bare tree still has its ends as fingers.
    let collision = r#"<collision><origin xyz="0 0 0.02"/><geometry><capsule radius="0.005" length="0.04"/></geometry></collision>"#;
    let bare = parts.replace(collision, "");
    assert!(!bare.contains("collision"));
    assert_eq!(summary(&guess(&bare, None).unwrap()).1.len(), 4);
}

#[test]
fn pairs_that_a_hand_file_excuses_stay_excused_in_what_inspect_writes() {
    let folder = tempfile::tempdir().unwrap();
    let parts = [finger("i", "root"), finger("m", "root"), finger("r", "root")].concat();
    let hand = |allow: &str| {
        let fingers = ["i", "m", "r"].map(|name| {
            format!("[[fingers]]\nname = \"{name}\"\ntip_link = \"{name}_b\"\ntip = {{ shape = \"sphere\", radius = 0.005, center = [0.0, 0.0, 0.04] }}\n")
        });
        format!(
            "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\nbase_link = \"root\"\n{allow}\n{}",
            fingers.concat()
        )
    };
    let loaded = load(folder.path(), &parts, &hand("allow = [[\"i_b\", \"m_b\"]]"), "hand.toml", None).unwrap();
    let none = Default::default();
    let text = regrasp_robot::inspect::hand_file_text(&loaded.hand, "hand.urdf", &none);
    assert!(text.contains("[\"i_b\", \"m_b\"],") && text.matches("_b\"],").count() == 1, "{text}");
    let plain = load(folder.path(), &parts, &hand(""), "hand.toml", None).unwrap();
    assert!(!regrasp_robot::inspect::hand_file_text(&plain.hand, "hand.urdf", &none).contains("allow"));
}

/// A wrist below the palm and a thing that turns on it: where they stand is the URDF's own position, of the one that is said and of the one
/// that is not.
#[test]
fn joints_of_no_finger_stand_where_the_file_says_or_as_near_to_zero_as_they_can() {
    let folder = tempfile::tempdir().unwrap();
    let joint = |name: &str, lower: f64| {
        format!(
            r#"<link name="{name}_link"><collision><origin xyz="0 0 -0.05"/><geometry><box size="0.01 0.01 0.01"/></geometry></collision></link>
            <joint name="{name}" type="revolute"><parent link="root"/><child link="{name}_link"/><axis xyz="1 0 0"/>
            <limit lower="{lower}" upper="1" effort="1" velocity="1"/></joint>"#
        )
    };
    let parts =
        [joint("wrist", -0.5), joint("lamp", 0.2), finger("i", "root"), finger("m", "root"), finger("t", "root")];
    let fingers = format!("{}{}{}", table("i", ""), table("m", ""), table("t", ""));
    let text = format!("{HEAD}[held]\nwrist = -0.25\n{fingers}");
    let loaded = load(folder.path(), &parts.concat(), &text, "hand.toml", None).unwrap();
    let found: Vec<(String, f64)> = loaded.hand.held_joints().into_iter().collect();
    assert_eq!(found, [("lamp".to_owned(), 0.2), ("wrist".to_owned(), -0.25)]);
    let held: Vec<&String> = loaded.notes.iter().filter(|note| note.contains("held at")).collect();
    let said =
        ["joint \"wrist\" belongs to no finger; held at -0.25", "joint \"lamp\" belongs to no finger; held at 0.2"];
    assert_eq!(held, said);
    // The boxes are where those positions put them, by hand.
    for (name, angle) in found {
        let link = loaded.hand.robot.link_named(&format!("{name}_link")).unwrap();
        let placed = &loaded.hand.palm.iter().find(|shape| shape.link == link).unwrap().placed;
        let expected = regrasp_geometry::Vector::new(0.0, 0.05 * angle.sin(), -0.05 * angle.cos());
        let found = placed.parent_from_shape.translation.vector;
        assert!((found - expected).norm() < 1e-12, "{name}: {found} {expected}");
    }
}

#[test]
fn spreads_that_fingers_share_by_a_coupling_are_held() {
    let mimic = |text: &str| text.replacen(r#"upper="1"/></joint>"#, r#"upper="1"/><mimic joint="i_low"/></joint>"#, 1);
    let parts = [finger("i", "root"), mimic(&finger("m", "root")), finger("t", "root")].concat();
    let loaded = guess(&parts, None).unwrap();
    assert_eq!(summary(&loaded).1, [vec!["i_high"], vec!["m_high"], vec!["t_low", "t_high"]]);
    assert!(loaded.notes.iter().any(|note| note.contains("\"i_low\" belongs to no finger")), "{:?}", loaded.notes);
}

/// A motor that moves the last joints of several fingers cannot be held; the table of joints says what follows what.
#[test]
fn last_joints_that_fingers_share_are_listed_with_what_they_follow() {
    let mimic = r#"upper="1"/><mimic joint="i_high" multiplier="0.5"/></joint>"#;
    let fingers = finger("m", "root");
    let (low, high) = fingers.split_once(r#"<link name="m_b">"#).unwrap();
    let high = high.replacen(r#"upper="1"/></joint>"#, mimic, 1);
    let parts = [finger("i", "root"), format!(r#"{low}<link name="m_b">{high}"#), finger("t", "root")].concat();
    let folder = tempfile::tempdir().unwrap();
    let loaded = load(folder.path(), &parts, "", "hand.urdf", None).unwrap();
    assert_eq!(loaded.hand.ties.len(), 1);
    let settings = regrasp_robot::inspect::InspectSettings { n_postures: 10 };
    let mut rng = regrasp_base::Rng::keyed(0, "test", 0);
    let path = folder.path().join("hand.urdf");
    let found = regrasp_robot::inspect::inspect(&path, &LoadOptions::default(), &settings, &mut rng).unwrap();
    let follows = found.robot.joints.iter().filter_map(|row| Some((row.name.as_str(), row.follows.as_ref()?)));
    let follows: Vec<(&str, &str, f64)> = follows.map(|(name, f)| (name, f.joint.as_str(), f.multiplier)).collect();
    assert_eq!(follows, [("m_high", "i_high", 0.5)]);
}

/// Where a motor that fingers share is held: in the middle of what it and its followers can do, or where the file says. Joints, tips and
/// held positions are the same in the file that is written.
#[test]
fn motors_that_fingers_share_are_held_where_the_file_says() {
    let folder = tempfile::tempdir().unwrap();
    // The follower reaches from -1 to 1 for the leader's -0.25 to 0.75.
    let mimic = r#"upper="1"/><mimic joint="i_low" multiplier="2" offset="-0.5"/></joint>"#;
    let follows = finger("m", "root").replacen(r#"upper="1"/></joint>"#, mimic, 1);
    let parts = [finger("i", "root"), follows, finger("t", "root")].concat();
    let fingers = |rest: &str| format!("{}{}{}", table("i", rest), table("m", ""), table("t", ""));
    let held = |loaded: &LoadedHand| -> Vec<(String, f64)> {
        let robot = &loaded.hand.robot;
        loaded.hand.held.iter().map(|(joint, at)| (robot.joints[joint.0].name.clone(), *at)).collect()
    };
    let tips = |loaded: &LoadedHand| -> Vec<regrasp_geometry::Point> {
        let fingers = loaded.hand.fingers.iter();
        fingers.map(|finger| finger.chain.tip(&finger.rest, &finger.tip.center_in_body)).collect()
    };
    for (text, expected) in [
        (format!("{HEAD}{}", fingers("")), 0.25),
        (format!("{HEAD}{}", fingers("rest = { i_low = 0.5 }\n")), 0.5),
        (format!("{HEAD}[held]\ni_low = -0.1\n{}", fingers("")), -0.1),
    ] {
        let loaded = load(folder.path(), &parts, &text, "hand.toml", None).unwrap();
        assert_eq!(held(&loaded), [("i_low".to_owned(), expected)]);
        // The follower is not commanded.
        assert_eq!(loaded.hand.held_joints().into_iter().collect::<Vec<_>>(), [("i_low".to_owned(), expected)]);
        assert_eq!(summary(&loaded).1, [vec!["i_high"], vec!["m_high"], vec!["t_low", "t_high"]]);
        // By the two joints alone: the tips of i and m, 0.04 above the second joint, which is 0.04 above the first.
        let turned = |angle: f64| 0.03 + 0.08 * angle.sin();
        assert!((tips(&loaded)[0].x - turned(expected)).abs() < 1e-12);
        assert!((tips(&loaded)[1].x - turned(2.0 * expected - 0.5)).abs() < 1e-12);
        let written = regrasp_robot::inspect::hand_file_text(&loaded.hand, "hand.urdf", &Default::default());
        let again = load(folder.path(), &parts, &written, "hand.toml", None).unwrap();
        assert_eq!((held(&again), summary(&again)), (held(&loaded), summary(&loaded)));
        assert_eq!(tips(&again), tips(&loaded));
    }
    for (line, message) in [
        ("i_lwo = 0.1", "U205 hand.toml:5:9 key \"held.i_lwo\": the robot has no joint \"i_lwo\""),
        ("i_low = 3.0", "U212 hand.toml:5:9 key \"held.i_low\": position 3 is outside the limits of joint \"i_low\""),
        ("m_low = 0.0", "U213 hand.toml:5:9 key \"held.m_low\": joint \"m_low\" does not move by itself"),
    ] {
        let text = format!("{HEAD}[held]\n{line}\n{}", fingers(""));
        let messages = load(folder.path(), &parts, &text, "hand.toml", None).unwrap_err();
        assert!(messages[0].starts_with(message), "{messages:?}\nexpected {message}");
    }
}

/// Two fingers on one motor, of which the second one's far joint follows its own near one, which follows the motor: what is written is
/// read, and says the same.
#[test]
fn fingers_on_one_motor_are_read_as_they_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let follow = |text: String, joint: &str, multiplier: &str| {
        let (before, after) = text.split_once(&format!("<joint name=\"{joint}\"")).unwrap();
        let mimic = format!(r#"<mimic joint="i_low" multiplier="{multiplier}" offset="0.01"/></joint>"#);
        format!("{before}<joint name=\"{joint}\"{}", after.replacen("</joint>", &mimic, 1))
    };
    let mut second = follow(finger("m", "root"), "m_low", "0.7");
    second = follow(second, "m_high", "0.333333333333333");
    let parts = [follow(finger("i", "root"), "i_high", "0.9"), second].concat();
    let loaded = guess(&parts, None).unwrap();
    assert!(!loaded.hand.ties.is_empty(), "the second finger follows the first one");
    let written = regrasp_robot::inspect::hand_file_text(&loaded.hand, "hand.urdf", &Default::default());
    let again = load(folder.path(), &parts, &written, "hand.toml", None)
        .unwrap_or_else(|messages| panic!("{messages:?}\n{written}"));
    assert_eq!(summary(&again), summary(&loaded));
    let limits = |loaded: &LoadedHand| -> Vec<f64> {
        loaded
            .hand
            .fingers
            .iter()
            .flat_map(|finger| finger.chain.lower.iter().chain(&finger.chain.upper))
            .copied()
            .collect()
    };
    assert_eq!(limits(&again), limits(&loaded));
}

/// A finger of three joints on the root, with a capsule on each link; the one in the middle is `middle` long, in metres.
fn phalanges(name: &str, middle: f64) -> String {
    let links = [
        ("root".to_owned(), "a", [0.03, 0.0], 0.03),
        (format!("{name}_a"), "b", [0.0, 0.03], middle),
        (format!("{name}_b"), "c", [0.0, middle], 0.03),
    ];
    let mut text = String::new();
    for (parent, link, [x, z], length) in links {
        let _ = write!(
            text,
            r#"<link name="{name}_{link}"><collision><origin xyz="0 0 {}"/><geometry><capsule radius="0.005" length="{length}"/></geometry></collision></link>
<joint name="{name}_{link}_joint" type="revolute"><parent link="{parent}"/><child link="{name}_{link}"/><origin xyz="{x} 0 {z}"/><axis xyz="0 1 0"/><limit lower="-0.4" upper="0.8"/></joint>
"#,
            0.5 * length
        );
    }
    text
}

/// A cube fixed to the root, of this size in metres.
fn box_around(size: f64) -> String {
    format!(
        r#"<link name="safety_box"><collision><geometry><box size="{size} {size} {size}"/></geometry></collision></link>
<joint name="box_joint" type="fixed"><parent link="root"/><child link="safety_box"/><origin xyz="0 0 0.05"/></joint>
"#
    )
}

#[test]
fn a_volume_around_all_fingertips_is_left_out_and_written_down() {
    let folder = tempfile::tempdir().unwrap();
    let fingers = finger("i", "root") + &finger("t", "root");
    let parts = box_around(0.4) + &fingers;
    let loaded = load(folder.path(), &parts, "", "hand.urdf", None).unwrap();
    let hand = &loaded.hand;
    let names: Vec<&str> = hand.without_geometry.iter().map(|link| hand.robot.links[link.0].name.as_str()).collect();
    assert_eq!((names, hand.palm.len()), (vec!["safety_box"], 0));
    let note = "link \"safety_box\" touches most fingertips in every posture";
    assert!(loaded.notes.iter().any(|text| text.starts_with(note)), "{:?}", loaded.notes);

    // The file that is written says so; without the line the geometry is the hand's.
    let text = regrasp_robot::inspect::hand_file_text(hand, "hand.urdf", &std::collections::BTreeSet::new());
    let line = "without_geometry = [\"safety_box\"]\n";
    assert!(text.contains(line), "{text}");
    let read = load(folder.path(), &parts, &text, "hand.toml", None).unwrap();
    assert_eq!((&read.hand.without_geometry, read.hand.palm.len()), (&hand.without_geometry, 0));
    let read = load(folder.path(), &parts, &text.replace(line, ""), "hand.toml", None).unwrap();
    assert_eq!((read.hand.without_geometry.len(), read.hand.palm.len()), (0, 1));

    // What fingertips can leave is a part of the hand.
    let loaded = guess(&(box_around(0.04) + &fingers), None).unwrap();
    assert_eq!((loaded.hand.without_geometry.len(), loaded.hand.palm.len()), (0, 1));

    let unknown = text.replace("[\"safety_box\"]", "[\"safety_bax\"]");
    let messages = load(folder.path(), &parts, &unknown, "hand.toml", None).unwrap_err();
    assert!(messages[0].contains("U205") && fix(&messages).contains("safety_box"), "{messages:?}");
}

#[test]
fn links_of_a_finger_that_are_always_near_each_other_are_not_tested() {
    let folder = tempfile::tempdir().unwrap();
    let parts = phalanges("i", 0.008) + &phalanges("t", 0.03);
    let loaded = load(folder.path(), &parts, "", "hand.urdf", None).unwrap();
    let may_touch = |loaded: &LoadedHand, [a, b]: [&str; 2]| {
        let link = |name: &str| loaded.hand.robot.link_named(name).unwrap();
        loaded.hand.may_touch(link(a), link(b))
    };
    assert!(may_touch(&loaded, ["i_a", "i_c"]) && !may_touch(&loaded, ["t_a", "t_c"]));
    assert!(!may_touch(&loaded, ["i_a", "t_c"]));
    let note =
        "links of one finger that are within 1 mm of each other in most postures are not tested against each other";
    let said: Vec<&String> = loaded.notes.iter().filter(|text| text.starts_with(note)).collect();
    assert!(said.len() == 1 && said[0].ends_with(": \"i_a\" and \"i_c\""), "{:?}", loaded.notes);

    // The file that is written says so.
    let text = regrasp_robot::inspect::hand_file_text(&loaded.hand, "hand.urdf", &std::collections::BTreeSet::new());
    let read = load(folder.path(), &parts, &text, "hand.toml", None).unwrap();
    assert_eq!(read.hand.allowed_pairs, loaded.hand.allowed_pairs);
    let loaded = guess(&(phalanges("i", 0.03) + &phalanges("t", 0.03)), None).unwrap();
    assert!(!may_touch(&loaded, ["i_a", "i_c"]) && !loaded.notes.iter().any(|text| text.starts_with(note)));
}

/// A plate fixed to `parent`, at height `z`, in metres.
fn plate(name: &str, parent: &str, z: f64) -> String {
    format!(
        r#"<link name="{name}"><collision><geometry><box size="0.1 0.1 0.02"/></geometry></collision></link>
<joint name="{name}_joint" type="fixed"><parent link="{parent}"/><child link="{name}"/><origin xyz="0 0 {z}"/></joint>
"#
    )
}

/// Links that one joint connects meet there. Links with a held joint or a body without geometry between them may meet or not.
#[test]
fn links_across_held_joints_and_bare_bodies_are_tested_unless_they_always_meet() {
    let may_touch = |loaded: &LoadedHand, [a, b]: [&str; 2]| {
        let link = |name: &str| loaded.hand.robot.link_named(name).unwrap();
        loaded.hand.may_touch(link(a), link(b))
    };
    let note = "links with only bodies without collision geometry, or held joints, between them";
    // A knuckle without geometry.
    let of_knuckle = |z| plate("palm", "root", z) + &turning("knuckle", "root") + &finger("t", "knuckle");
    // Where its two joints are in one place they are as one.
    let on_the_spot = of_knuckle(-0.05).replace("0.03 0 0", "0 0 0") + &finger("i", "root");
    assert!(may_touch(&guess(&on_the_spot, None).unwrap(), ["palm", "t_a"]));
    let apart = guess(&(of_knuckle(-0.05) + &finger("i", "root")), None).unwrap();
    assert!(!may_touch(&apart, ["palm", "t_a"]) && !may_touch(&apart, ["palm", "t_b"]));
    assert!(may_touch(&apart, ["palm", "i_a"]) && may_touch(&apart, ["t_a", "t_b"]));
    assert!(!apart.notes.iter().any(|text| text.starts_with(note)), "{:?}", apart.notes);
    let meeting = guess(&(of_knuckle(0.0) + &finger("i", "root")), None).unwrap();
    assert!(may_touch(&meeting, ["palm", "t_a"]) && !may_touch(&meeting, ["palm", "t_b"]));
    let said: Vec<&String> = meeting.notes.iter().filter(|text| text.starts_with(note)).collect();
    assert!(said.len() == 1 && said[0].ends_with(": \"palm\" and \"t_a\""), "{:?}", meeting.notes);
    // A fold of the palm that is held.
    let parts = [
        plate("palm", "root", -0.05),
        finger("i", "root"),
        finger("m", "root"),
        turning("fold", "root"),
        plate("flap", "fold", -0.08),
        finger("r", "fold"),
        finger("l", "fold"),
    ];
    let folded = guess(&parts.concat(), None).unwrap();
    for (pair, allowed) in [("flap r_a", true), ("palm i_a", true), ("palm r_a", false), ("flap i_a", false)] {
        let (a, b) = pair.split_once(' ').unwrap();
        assert_eq!(may_touch(&folded, [a, b]), allowed, "{pair}");
    }
}

#[test]
fn a_mesh_that_is_far_too_large_is_not_left_out_as_a_volume_around_the_fingers() {
    let loaded = guess(&(box_around(40.0) + &finger("i", "root") + &finger("t", "root")), None).unwrap();
    assert_eq!((loaded.hand.without_geometry.len(), loaded.hand.palm.len()), (0, 1));
}
