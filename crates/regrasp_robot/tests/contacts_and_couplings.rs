//! Contact models and couplings of hand files: what they make of a hand, and what is refused.

use regrasp_base::Rng;
use regrasp_geometry::Point;
use regrasp_robot::kinematics::finger_ik::IkSettings;
use regrasp_robot::{ContactModel, Hand, LoadOptions, load_hand};
use std::fs;

/// A finger of four joints and one of two, whose second follows the first.
const URDF: &str = r#"<robot name="pair">
<link name="palm"/><link name="a1"/><link name="a2"/><link name="a3"/><link name="a4"/><link name="b1"/><link name="b2"/>
<joint name="a_side" type="revolute"><parent link="palm"/><child link="a1"/><axis xyz="0 1 0"/><limit lower="-0.35" upper="0.35"/></joint>
<joint name="a_low" type="revolute"><parent link="a1"/><child link="a2"/><axis xyz="1 0 0"/><limit lower="-0.3" upper="1.6"/></joint>
<joint name="a_mid" type="revolute"><parent link="a2"/><child link="a3"/><origin xyz="0 0 0.045"/><axis xyz="1 0 0"/><limit lower="0" upper="1.6"/></joint>
<joint name="a_end" type="revolute"><parent link="a3"/><child link="a4"/><origin xyz="0 0 0.025"/><axis xyz="1 0 0"/><limit lower="0" upper="1.2"/></joint>
<joint name="b_low" type="revolute"><parent link="palm"/><child link="b1"/><origin xyz="0.03 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="1.5"/></joint>
<joint name="b_end" type="revolute"><parent link="b1"/><child link="b2"/><origin xyz="0 0 0.03"/><axis xyz="1 0 0"/><limit lower="0" upper="2"/><mimic joint="b_low" multiplier="2"/></joint>
</robot>"#;

/// A hand file with `more` in front of the fingers and `contact` in the first.
fn hand_file(more: &str, contact: &str) -> String {
    format!(
        "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\n{more}\n[[fingers]]\nname = \"a\"\n\
         tip_link = \"a4\"\ntip = {{ shape = \"point\", position = [0.0, 0.0, 0.02] }}\n{contact}\n[[fingers]]\nname = \"b\"\n\
         tip_link = \"b2\"\ntip = {{ shape = \"point\", position = [0.0, 0.0, 0.02] }}\n"
    )
}

fn load(text: &str, options: &LoadOptions) -> Result<Hand, Vec<String>> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("hand.urdf"), URDF).unwrap();
    let path = folder.path().join("hand.toml");
    fs::write(&path, text).unwrap();
    let prefix = format!("{}/", folder.path().display());
    load_hand(&path, options)
        .map(|loaded| loaded.hand)
        .map_err(|error| error.diagnostics.iter().map(|d| d.to_string().replace(&prefix, "")).collect())
}

fn coupling(joint: &str, leader: &str, more: &str) -> String {
    format!("[[couplings]]\njoint = \"{joint}\"\nleader = \"{leader}\"\n{more}\n")
}

#[test]
fn a_coupling_of_the_hand_file_moves_the_joint_and_narrows_the_leader() {
    let hand =
        load(&hand_file(&coupling("a_end", "a_mid", "multiplier = 0.8\noffset = 0.1"), ""), &LoadOptions::default());
    let hand = hand.unwrap();
    assert_eq!(hand.joint_names(), ["a_side", "a_low", "a_mid", "b_low"]);
    let chain = &hand.fingers[0].chain;
    // The follower reaches its limit of 1.2 where the leader is at (1.2 - 0.1) / 0.8.
    assert!((chain.upper[2] - 1.375).abs() < 1e-12 && chain.lower[2] == 0.0);
    let free = load(&hand_file("", ""), &LoadOptions::default()).unwrap();
    assert_eq!(free.joint_names(), ["a_side", "a_low", "a_mid", "a_end", "b_low"]);
    for (side, low, mid) in [(0.1, 0.4, 0.5), (-0.3, 1.2, 1.3)] {
        let tip = Point::new(0.0, 0.0, 0.02);
        let coupled = chain.tip(&[side, low, mid], &tip);
        let explicit = free.fingers[0].chain.tip(&[side, low, mid, 0.8 * mid + 0.1], &tip);
        assert!((coupled - explicit).norm() < 1e-15);
    }
}

#[test]
fn couplings_of_file_and_urdf_are_merged_into_chains() {
    let more =
        coupling("a_end", "a_mid", "multiplier = 0.5") + &coupling("a_mid", "a_low", "multiplier = 0.5\noffset = 0.2");
    let hand = load(&hand_file(&more, ""), &LoadOptions::default()).unwrap();
    assert_eq!(hand.joint_names(), ["a_side", "a_low", "b_low"]);
    let end = &hand.robot.joints[hand.robot.joint_named("a_end").unwrap().0];
    let follows = end.coupling.as_ref().unwrap();
    let (leader, multiplier) = follows.single().unwrap();
    assert_eq!(hand.robot.joints[leader.0].name, "a_low");
    assert!((multiplier - 0.25).abs() < 1e-15 && (follows.offset - 0.1).abs() < 1e-15);
    // The URDF's own coupling may be repeated, not changed.
    assert!(load(&hand_file(&coupling("b_end", "b_low", "multiplier = 2"), ""), &LoadOptions::default()).is_ok());
    let error =
        load(&hand_file(&coupling("b_end", "b_low", "multiplier = 1.9"), ""), &LoadOptions::default()).unwrap_err();
    assert_eq!(
        error,
        [
            r#"U219 hand.toml:5:9 key "couplings[0].joint": joint "b_end" follows another joint already; expected one coupling per joint, of the hand file or the URDF"#
        ]
    );
}

#[test]
fn bad_couplings_are_refused() {
    let refusal = |more: String| load(&hand_file(&more, ""), &LoadOptions::default()).unwrap_err().join("\n");
    let cycle = coupling("a_end", "a_mid", "") + &coupling("a_mid", "a_end", "");
    for (more, expected) in [
        (
            coupling("a_ned", "a_mid", ""),
            r#"U205 hand.toml:5:9 key "couplings[0].joint": the robot has no joint "a_ned""#,
        ),
        (
            coupling("a_end", "a_end", ""),
            r#"U141 hand.toml:5:9 key "couplings[0].joint": joint "a_end" follows itself"#,
        ),
        (cycle, r#"U141 hand.toml:5:9 key "couplings[0].joint": joint "a_end" follows itself"#),
        (coupling("a_end", "a_mid", "multiplier = 0"), r#"U213 hand.toml:7:14 key "couplings[0].multiplier": is 0"#),
        (
            coupling("a_end", "a_mid", "offset = 3"),
            r#"U143 hand.toml:5:9 key "couplings[0].joint": joint "a_end" follows joint "a_mid" to 3..4.6"#,
        ),
        (
            coupling("a_end", "a_mid", "ratio = 1"),
            r#"U201 hand.toml:7:1 key "couplings[0].ratio": is not a key that exists here"#,
        ),
        ("couplings = 3".to_owned(), r#"U203 hand.toml:4:13 key "couplings": is 3, an integer"#),
    ] {
        let seen = refusal(more);
        assert!(seen.starts_with(expected), "{seen}\nexpected {expected}");
    }
}

#[test]
fn inverse_kinematics_of_a_coupled_finger_reaches_what_it_can_reach() {
    let hand = load(&hand_file(&coupling("a_end", "a_mid", ""), ""), &LoadOptions::default()).unwrap();
    let finger = &hand.fingers[0];
    let (settings, mut rng) = (IkSettings::default(), Rng::keyed(1, "coupled", 0));
    let (mut n_solved, n_tries) = (0, 300);
    for _ in 0..n_tries {
        let q: Vec<f64> =
            finger.chain.lower.iter().zip(&finger.chain.upper).map(|(&low, &high)| rng.uniform(low, high)).collect();
        let target = finger.ik.tip(&q);
        let Some(found) = finger.ik.solve_random(&target, &settings, &mut rng) else { continue };
        n_solved += 1;
        assert!((finger.ik.tip(&found) - target).norm() < 1e-7 && finger.chain.within_limits(&found, 0.0));
        // Followers keep their own limits.
        assert!(found[2] <= 1.2);
    }
    assert!(n_solved * 100 >= n_tries * 97, "{n_solved} of {n_tries}");
}

#[test]
fn contact_models_come_from_the_finger_or_the_default() {
    let soft = ContactModel::SoftFinger { torsion_radius: 0.004 };
    let options = LoadOptions { contact: ContactModel::Frictionless, ..LoadOptions::default() };
    let hand = load(&hand_file("", "contact = \"soft_finger\"\ntorsion_radius = 0.004"), &options).unwrap();
    assert_eq!([hand.fingers[0].tip.contact, hand.fingers[1].tip.contact], [soft, ContactModel::Frictionless]);
    let hand = load(&hand_file("", "contact = \"point\""), &LoadOptions::default()).unwrap();
    assert_eq!([hand.fingers[0].tip.contact, hand.fingers[1].tip.contact], [ContactModel::Point; 2]);
    for (contact, expected) in [
        (
            "contact = \"soft\"",
            "U213 hand.toml:9:11 key \"fingers[0].contact\": is \"soft\"; expected frictionless, point or soft_finger",
        ),
        (
            "contact = \"soft_finger\"",
            "U218 hand.toml:9:11 key \"fingers[0].contact\": has no `torsion_radius` beside it",
        ),
        (
            "torsion_radius = 0.004",
            "U218 hand.toml:9:18 key \"fingers[0].torsion_radius\": stands without a contact model",
        ),
        (
            "contact = \"point\"\ntorsion_radius = 0.004",
            "U218 hand.toml:10:18 key \"fingers[0].torsion_radius\": stands beside \"point\"",
        ),
        (
            "contact = \"soft_finger\"\ntorsion_radius = 5",
            "U213 hand.toml:10:18 key \"fingers[0].torsion_radius\": is 5; expected a length above 0 and at most 0.05",
        ),
        (
            "contact = \"soft_finger\"\ntorsion_radius = 0",
            "U213 hand.toml:10:18 key \"fingers[0].torsion_radius\": is 0; expected",
        ),
        ("contact = 3", "U203 hand.toml:9:11 key \"fingers[0].contact\": is 3, an integer"),
    ] {
        let seen = load(&hand_file("", contact), &LoadOptions::default()).unwrap_err().join("\n");
        assert!(seen.starts_with(expected), "{seen}\nexpected {expected}");
    }
}

/// The last joint keeps its link level: it turns back by what two others turn.
const LEVEL: &str = "[[couplings]]\njoint = \"a_end\"\nterms = [{ leader = \"a_mid\", multiplier = -1.0 }, \
                     { leader = \"a_low\", multiplier = -1.0 }]\noffset = 1.3\n";

#[test]
fn a_joint_may_follow_several_others_and_limits_their_sum() {
    let hand = load(&hand_file(LEVEL, ""), &LoadOptions::default()).unwrap();
    assert_eq!(hand.joint_names(), ["a_side", "a_low", "a_mid", "b_low"]);
    let chain = &hand.fingers[0].chain;
    // Each leader keeps its own limits; a_end within 0..1.2 asks 0.1 <= a_low + a_mid <= 1.3 of both.
    assert_eq!((chain.lower.as_slice(), chain.upper.as_slice()), (&[-0.35, -0.3, 0.0][..], &[0.35, 1.6, 1.6][..]));
    let free = load(&hand_file("", ""), &LoadOptions::default()).unwrap();
    let mut rng = Rng::keyed(5, "level", 0);
    let (mut within, mut outside) = (0, 0);
    for _ in 0..500 {
        let q: Vec<f64> = chain.lower.iter().zip(&chain.upper).map(|(&low, &high)| rng.uniform(low, high)).collect();
        let end = 1.3 - q[1] - q[2];
        assert_eq!(chain.within_limits(&q, 0.0), (0.0..=1.2).contains(&end));
        *if chain.within_limits(&q, 0.0) { &mut within } else { &mut outside } += 1;
        let room = chain.limit_distance(&q);
        // Moved by less than the room, every limit is still kept; moved the worst way by more, one is not.
        if room > 1e-6 {
            for way in [1.0, -1.0] {
                let moved: Vec<f64> = q.iter().map(|q| q + way * 0.999 * room).collect();
                assert!(chain.within_limits(&moved, 0.0) && chain.within_limits(&q, 0.999 * room));
            }
            assert!(!chain.within_limits(&q, 1.001 * room));
        }
        let tip = Point::new(0.0, 0.0, 0.02);
        let explicit = free.fingers[0].chain.tip(&[q[0], q[1], q[2], end], &tip);
        assert!((chain.tip(&q, &tip) - explicit).norm() < 1e-15);
    }
    assert!(within > 100 && outside > 100);
    assert!(chain.within_limits(&hand.fingers[0].rest, 0.0));
}

#[test]
fn inspect_writes_couplings_with_several_leaders_so_that_they_are_read_again() {
    let hand = load(&hand_file(LEVEL, ""), &LoadOptions::default()).unwrap();
    let written = regrasp_robot::inspect::hand_file_text(&hand, "hand.urdf", &Default::default());
    let again = load(&written, &LoadOptions::default()).unwrap();
    assert_eq!(again.fingers[0].chain.linear_limits, hand.fingers[0].chain.linear_limits);
    let end = |hand: &Hand| hand.robot.joints[hand.robot.joint_named("a_end").unwrap().0].coupling.clone();
    assert_eq!(end(&again), end(&hand));
}

#[test]
fn bad_terms_are_refused() {
    let terms = |terms: &str| format!("[[couplings]]\njoint = \"a_end\"\nterms = {terms}\n");
    let one = |leader: &str, multiplier: f64| format!("{{ leader = \"{leader}\", multiplier = {multiplier} }}");
    let key = "hand.toml:6:9 key \"couplings[0].terms\"";
    for (more, expected) in [
        (terms("[]"), format!("U213 {key}: has 0 terms")),
        (
            terms(&format!("[{}, {}]", one("a_mid", 1.0), one("a_mid", -1.0))),
            "U213 hand.toml:6:48 key \"couplings[0].terms[1]\": names leader \"a_mid\" twice".into(),
        ),
        (
            terms(&format!("[{}, {}]", one("a_mid", 1.0), one("a_end", 1.0))),
            "U141 hand.toml:5:9 key \"couplings[0].joint\": joint \"a_end\" follows itself".into(),
        ),
        (
            terms(&format!("[{}]", one("a_mid", 0.0))),
            "U213 hand.toml:6:43 key \"couplings[0].terms[0].multiplier\": is 0".into(),
        ),
        (
            terms(&format!("[{}, {}]\noffset = 9.0", one("a_mid", 1.0), one("a_low", 1.0))),
            "U143 hand.toml:5:9 key \"couplings[0].joint\": joint \"a_end\" follows joints \"a_low\" and \"a_mid\" to \
             8.7..12.2, outside its own limits 0..1.2"
                .into(),
        ),
        (
            terms(&format!("[{}, {}]", one("a_mid", 1.0), one("b_low", 1.0))),
            "U209 hand.toml:8:1 finger \"a\": joint \"a_end\" follows joint \"b_low\", which is on another finger"
                .into(),
        ),
        (format!("{LEVEL}leader = \"a_mid\"\n"), "U201 hand.toml:8:1 key \"couplings[0].leader\"".into()),
    ] {
        let seen = load(&hand_file(&more, ""), &LoadOptions::default()).unwrap_err().join("\n");
        assert!(seen.starts_with(&expected), "{seen}\nexpected {expected}");
    }
    let rest = hand_file(LEVEL, "rest = { a_low = 1.5, a_mid = 1.5 }");
    let seen = load(&rest, &LoadOptions::default()).unwrap_err().join("\n");
    assert!(seen.starts_with("U212 ") && seen.contains("joint \"a_end\", which follows, outside its limits"), "{seen}");
}

#[test]
fn what_inspect_writes_has_contacts_and_couplings() {
    let text = hand_file(
        &coupling("a_end", "a_mid", "multiplier = 0.8\noffset = 0.1"),
        "contact = \"soft_finger\"\ntorsion_radius = 0.004",
    );
    let hand = load(&text, &LoadOptions::default()).unwrap();
    let written = regrasp_robot::inspect::hand_file_text(&hand, "hand.urdf", &Default::default());
    let again = load(&written, &LoadOptions::default()).unwrap();
    assert_eq!(again.joint_names(), hand.joint_names());
    for (a, b) in hand.fingers.iter().zip(&again.fingers) {
        assert_eq!(a.tip.contact, b.tip.contact);
        let q = &a.rest;
        assert!((a.ik.tip(q) - b.ik.tip(q)).norm() < 1e-12);
    }
}

/// Where holding a shared motor still would leave a finger without joints, the hand comes in with what its joints follow, and the
/// file that is written says so again.
#[test]
fn a_joint_that_follows_another_finger_is_tied_to_it() {
    let hand = load(&hand_file(&coupling("a_end", "b_low", ""), ""), &LoadOptions::default()).unwrap();
    let joint = |name: &str| hand.robot.joint_named(name).unwrap();
    let ties: Vec<_> = hand.ties.iter().map(|tie| (tie.follower, tie.coupling.single().unwrap())).collect();
    assert_eq!(ties, [(joint("a_end"), (joint("b_low"), 1.0))]);
    let written = regrasp_robot::inspect::hand_file_text(&hand, "hand.urdf", &Default::default());
    assert_eq!(load(&written, &LoadOptions::default()).unwrap().ties, hand.ties);
}
