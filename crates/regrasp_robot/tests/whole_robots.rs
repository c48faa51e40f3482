//! Robots with arms: parts guessed from the tree and from SRDFs, and robot files that load.

#[path = "../../../tests/support/places.rs"]
mod places;

use places::{repository, shared_models};
use regrasp_base::Rng;
use regrasp_robot::inspect::InspectSettings;
use regrasp_robot::inspect::hand_file_text;
use regrasp_robot::inspect::whole::{FileNames, WholeRobot, inspect_whole, robot_file_text};
use regrasp_robot::{LoadOptions, Manipulator, Part, ResolveOptions, load_manipulator, load_robot};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

fn options(models: &Path, lenient: bool) -> LoadOptions {
    let packages = vec![("models".to_owned(), models.to_owned())];
    LoadOptions { resolve: ResolveOptions { packages, ..Default::default() }, lenient, ..Default::default() }
}

fn inspected(urdf: &Path, srdf: Option<&Path>, options: &LoadOptions) -> WholeRobot {
    let robot = Arc::new(load_robot(urdf, options).unwrap_or_else(|error| panic!("{error}")).robot);
    let settings = InspectSettings { n_postures: 60 };
    let mut rng = Rng::keyed(1, "inspect", 0);
    let whole = inspect_whole(robot, (urdf, srdf), options, &settings, &mut rng);
    whole.unwrap_or_else(|error| panic!("{error}")).expect("a robot with arms")
}

/// Name, base link, mount link and joints of each arm.
fn arms(whole: &WholeRobot) -> Vec<(String, String, String, usize)> {
    let link = |link: regrasp_robot::LinkId| whole.robot.links[link.0].name.clone();
    let row = |arm: &regrasp_robot::inspect::whole::ArmGuess| {
        (arm.name.clone(), link(arm.base), link(arm.mount), arm.joints.len())
    };
    whole.guess.arms.iter().map(row).collect()
}

/// The files as `regrasp inspect -o` writes them, read back.
fn read_back(whole: &WholeRobot, urdf: &Path, srdf: Option<&Path>, options: &LoadOptions) -> Manipulator {
    let folder = tempfile::tempdir().unwrap();
    let text = |path: &Path| path.display().to_string();
    let mut hands = Vec::new();
    for hand in &whole.hands {
        let name = format!("{}.toml", hand.guess.name);
        hands.push(hand.hand.as_ref().ok().map(|made| {
            std::fs::write(folder.path().join(&name), hand_file_text(made, &text(urdf), &BTreeSet::new())).unwrap();
            name
        }));
    }
    let names = FileNames { urdf: text(urdf), srdf: srdf.map(text), hands };
    let path = folder.path().join("robot.toml");
    std::fs::write(&path, robot_file_text(&whole.robot, whole, &names)).unwrap();
    load_manipulator(&path, options).unwrap_or_else(|error| panic!("{error}")).manipulator
}

fn row(name: &str, base: &str, mount: &str, joints: usize) -> (String, String, String, usize) {
    (name.into(), base.into(), mount.into(), joints)
}

#[test]
fn shared_robots_are_understood_and_their_files_load() {
    let Some(models) = shared_models() else { return };
    let robots = models.join("robots");
    let iiwa = |side: &str| row(side, &format!("{side}_iiwa_link_0"), &format!("{side}_iiwa_link_7"), 7);
    for (urdf, srdf, expected, common, held) in [
        ("panda/panda_spherized.urdf", None, vec![row("arm", "panda_link0", "panda_hand", 7)], vec![], None),
        (
            "panda/panda_spherized.urdf",
            Some("panda/panda.srdf"),
            vec![row("panda_arm", "panda_link0", "panda_link8", 7)],
            vec![],
            None,
        ),
        (
            "pr2/pr2.urdf",
            Some("pr2/pr2_manipulation.srdf"),
            vec![
                row("right_arm", "torso_lift_link", "r_wrist_roll_link", 7),
                row("left_arm", "torso_lift_link", "l_wrist_roll_link", 7),
            ],
            vec!["torso_lift_joint"],
            Some("head_pan_joint"),
        ),
        (
            "baxter/baxter_spherized.urdf",
            Some("baxter/baxter.srdf"),
            vec![
                row("left_arm", "left_arm_mount", "left_gripper", 7),
                row("right_arm", "right_arm_mount", "right_gripper", 7),
            ],
            vec![],
            None,
        ),
        ("dual_iiwa14/dual_iiwa14_spheres.urdf", None, vec![iiwa("left"), iiwa("right")], vec![], None),
        (
            "tiago_dual_hey5/tiago_dual.urdf",
            None,
            vec![
                row("left", "torso_lift_link", "arm_left_7_link", 7),
                row("right", "torso_lift_link", "arm_right_7_link", 7),
            ],
            vec!["torso_lift_joint"],
            Some("head_1_joint"),
        ),
    ] {
        let (urdf, srdf) = (robots.join(urdf), srdf.map(|srdf| robots.join(srdf)));
        let options = options(&models, true);
        let whole = inspected(&urdf, srdf.as_deref(), &options);
        let mut seen = arms(&whole);
        let mut expected = expected;
        seen.sort();
        expected.sort();
        assert_eq!(seen, expected, "{}", urdf.display());
        let names = |ids: &[regrasp_robot::JointId]| -> Vec<String> {
            ids.iter().map(|id| whole.robot.joints[id.0].name.clone()).collect()
        };
        assert_eq!(names(&whole.guess.common), common, "{}", urdf.display());
        if let Some(held) = held {
            assert!(names(&whole.guess.others).iter().any(|name| name == held), "{}", urdf.display());
        }
        let robot = read_back(&whole, &urdf, srdf.as_deref(), &options);
        assert_eq!(robot.arms.len(), whole.guess.arms.len());
        assert_eq!(robot.hands.len(), whole.hands.iter().filter(|hand| hand.hand.is_ok()).count());
        let common: Vec<String> =
            robot.layout.coordinates[robot.layout.range(Part::Common)].iter().map(|c| c.name.clone()).collect();
        assert_eq!(common, names(&whole.guess.common));
        // The boxes around TIAGo's hands are left out, of hands and robot, and nothing else is.
        let mut left_out = Vec::new();
        for (found, read) in whole.hands.iter().filter_map(|hand| hand.hand.as_ref().ok()).zip(&robot.hands) {
            let name = |of: &regrasp_robot::Robot, id: &regrasp_robot::LinkId| of.links[id.0].name.clone();
            let names: Vec<String> = found.without_geometry.iter().map(|id| name(&found.robot, id)).collect();
            let again = &read.hand.without_geometry;
            assert_eq!(names, again.iter().map(|id| name(&robot.robot, id)).collect::<Vec<_>>());
            assert!(again.iter().all(|id| robot.robot.links[id.0].collision.is_empty()));
            left_out.extend(names);
        }
        left_out.sort();
        let is_tiago = urdf.ends_with("tiago_dual.urdf");
        let boxes = ["hand_left_safety_box", "hand_right_safety_box"];
        assert_eq!(left_out, if is_tiago { boxes.to_vec() } else { vec![] }, "{}", urdf.display());
        // So are pairs of phalanges of TIAGo's fingers, whose hulls reach into each other, and pairs with its palm.
        let n_notes = |start: &str| whole.notes.iter().filter(|note| note.starts_with(start)).count();
        let crowded = n_notes("links of one finger that are within 1 mm");
        let stuck = n_notes("links that touch in every posture are not tested");
        assert_eq!((crowded, stuck), if is_tiago { (2, 2) } else { (0, 0) });
        assert_eq!(whole.notes.len(), left_out.len() + crowded + stuck);
        // Pairs that always touch are excused, pairs that never do are not.
        for [a, b] in &whole.pairs.always {
            let link = |name: &str| robot.robot.link_named(name).unwrap();
            assert!(robot.may_touch(link(a), link(b)));
        }
    }
}

#[test]
fn unknown_links_of_an_srdf_are_notes_where_lenient() {
    let Some(models) = shared_models() else { return };
    let (urdf, srdf) = (models.join("robots/baxter/baxter_spherized.urdf"), models.join("robots/baxter/baxter.srdf"));
    let robot = Arc::new(load_robot(&urdf, &options(&models, false)).unwrap().robot);
    let settings = InspectSettings { n_postures: 1 };
    let strict =
        inspect_whole(robot, (&urdf, Some(&srdf)), &options(&models, false), &settings, &mut Rng::keyed(1, "i", 0));
    let error = strict.unwrap_err().to_string();
    assert!(error.contains("U161") && error.contains("--lenient"), "{error}");
    let whole = inspected(&urdf, Some(&srdf), &options(&models, true));
    assert!(whole.srdf.unwrap().notes.iter().any(|note| note.contains("skipped: there is no link")));
}

#[test]
fn the_bundled_body_has_two_arms_and_a_common_torso() {
    let urdf = repository().join("assets/robots/upper_body/body.urdf");
    let whole = inspected(&urdf, None, &LoadOptions::default());
    let mut seen = arms(&whole);
    seen.sort();
    assert_eq!(seen, [row("left", "left_dock", "left_flange", 7), row("right", "right_dock", "right_flange", 7)]);
    assert_eq!((whole.guess.common.len(), whole.guess.others.len(), whole.hands.len()), (4, 0, 0));
    let robot = read_back(&whole, &urdf, None, &LoadOptions::default());
    assert_eq!(robot.layout.len(), 18);
    // Hands and robots with short arms are none of them.
    for other in ["assets/hands/wide_four_finger/hand.urdf", "assets/robots/two_arms/body.urdf"] {
        let path = repository().join(other);
        let robot = Arc::new(load_robot(&path, &LoadOptions::default()).unwrap().robot);
        let settings = InspectSettings { n_postures: 1 };
        let whole = inspect_whole(robot, (&path, None), &LoadOptions::default(), &settings, &mut Rng::keyed(1, "i", 0))
            .unwrap();
        assert!(whole.is_none(), "{other}");
    }
}
