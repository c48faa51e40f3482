//! Robots with two arms of the shared models, against the text of their files.

use super::places::shared_models;
use super::{assert_consistent, difference, load, options, random_state, text};
use regrasp_base::Rng;
use regrasp_robot::{Manipulator, Part};

/// Every link of the model at random states, against the text. Names in the tree are behind `prefix`.
fn compare(manipulator: &Manipulator, text: &str, prefix: &str) {
    let tree = text::Tree::of(text);
    let mut rng = Rng::keyed(1, "shared robots", 0);
    let mut poses = Vec::new();
    for _ in 0..10 {
        let state = random_state(manipulator, &mut rng);
        manipulator.link_poses(&state, &mut poses);
        // A joint held fixed because its limits are equal is no coordinate.
        let position = |name: &str| {
            let k = manipulator.layout.index_of(&format!("{prefix}{name}"));
            state[k.unwrap_or_else(|| panic!("no coordinate {name}"))]
        };
        for link in tree.links() {
            let id = manipulator.robot.link_named(&format!("{prefix}{link}")).unwrap();
            let expected = tree.root_from(link, &position);
            assert!(difference(&poses[id.0], &expected) < 1e-11, "{link}");
        }
        assert_consistent(manipulator, &state);
    }
}

#[test]
fn two_iiwas_carry_two_allegro_hands() {
    let Some(models) = shared_models() else { return };
    let hand = super::places::repository().join("assets/hands/allegro_right/hand.toml");
    let arm = |side: &str| {
        format!(
            "[[arms]]\nname = \"{side}\"\nbase_link = \"{side}_iiwa_link_0\"\nmount_link = \"{side}_iiwa_link_ee\"\n\
             home = {{ {side}_iiwa_joint_2 = 0.5, {side}_iiwa_joint_4 = -1.2 }}\n\
             [[hands]]\nname = \"{side}_hand\"\nhand = {:?}\narm = \"{side}\"\nposition = [0.0, 0.0, 0.095]\n",
            hand.display().to_string()
        )
    };
    // Hands are listed in the other order than arms.
    let text = format!(
        "[[models]]\nurdf = \"package://models/robots/dual_iiwa14/dual_iiwa14_spheres.urdf\"\n{}{}",
        arm("right"),
        arm("left")
    );
    let robot = load(&text, &[], &options(&models)).unwrap();
    assert_eq!((robot.layout.len(), robot.arms.len(), robot.hands.len()), (46, 2, 2));
    let ranges =
        [Part::Common, Part::Arm(0), Part::Hand(0), Part::Arm(1), Part::Hand(1)].map(|p| robot.layout.range(p));
    assert_eq!(ranges, [0..0, 0..7, 7..23, 23..30, 30..46]);
    assert_eq!(robot.layout.names()[..2], ["right_iiwa_joint_1", "right_iiwa_joint_2"]);
    assert_eq!(robot.arms[1].home, [0.0, 0.5, 0.0, -1.2, 0.0, 0.0, 0.0]);
    let file = models.join("robots/dual_iiwa14/dual_iiwa14_spheres.urdf");
    compare(&robot, &std::fs::read_to_string(file).unwrap(), "");
    // 92 balls, less those of the two base links, are on the arms.
    let on_arms: usize = robot.arms.iter().map(|arm| arm.shapes.len()).sum();
    assert_eq!(on_arms + robot.common.shapes.len(), 92);
    assert!(robot.arms.iter().all(|arm| arm.shapes.iter().all(|s| robot.part_of(s.link) != Part::Common)));
    // The hand of the tree is the hand of its file: nothing of the arm is in its palm.
    let alone = regrasp_robot::load_hand(&hand, &options(&models)).unwrap().hand;
    for mounted in &robot.hands {
        assert_eq!(mounted.hand.palm.len(), alone.palm.len());
        for (ours, theirs) in mounted.hand.fingers.iter().zip(&alone.fingers) {
            assert_eq!(
                (&ours.chain.lower, &ours.chain.upper, &ours.rest),
                (&theirs.chain.lower, &theirs.chain.upper, &theirs.rest)
            );
            let tips = [ours, theirs].map(|finger| finger.chain.tip(&ours.rest, &finger.tip.center_in_body));
            assert_eq!(tips[0], tips[1]);
        }
    }
    // The flange meets the palm, two links on the arm that are not neighbours are tested.
    let link = |name: &str| robot.robot.link_named(name).unwrap();
    let rigid = |a: &str, b: &str| robot.may_touch(link(a), link(b));
    assert!(rigid("left_iiwa_link_3", "left_iiwa_link_4") && !rigid("left_iiwa_link_2", "left_iiwa_link_4"));
    assert!(!rigid("left_iiwa_link_7", "right_iiwa_link_7"));
}

#[test]
fn robots_with_torso_wheels_grippers_and_followers_keep_every_joint() {
    let Some(models) = shared_models() else { return };
    for (file, arms, coordinates, common) in [
        ("robots/pr2/pr2.urdf", ["torso_lift_link", "r_gripper_palm_link", "l_gripper_palm_link"], 0, ""),
        ("robots/baxter/baxter_spherized.urdf", ["torso", "right_hand", "left_hand"], 14, "none"),
        (
            "robots/tiago_dual_hey5/tiago_dual.urdf",
            ["torso_lift_link", "arm_right_tool_link", "arm_left_tool_link"],
            101,
            "",
        ),
    ] {
        let [base, right, left] = arms;
        let text = format!(
            "[[models]]\nname = \"body\"\nurdf = \"package://models/{file}\"\nposition = [0.0, 0.0, 0.0]\n\
             [[arms]]\nname = \"right\"\nbase_link = \"{base}\"\nmount_link = \"{right}\"\n\
             [[arms]]\nname = \"left\"\nbase_link = \"{base}\"\nmount_link = \"{left}\"\n"
        );
        let robot = load(&text, &[], &options(&models)).unwrap_or_else(|error| panic!("{file}: {error:?}"));
        let independent = robot.robot.joints.iter().filter(|joint| joint.moves() && joint.coupling.is_none()).count();
        assert_eq!(robot.layout.len(), independent, "{file}");
        assert!(coordinates == 0 || independent == coordinates, "{file}: {independent}");
        assert!(robot.arms.iter().all(|arm| arm.chain.n_coordinates() == 7), "{file}");
        assert_eq!(robot.layout.range(Part::Common).is_empty(), common == "none", "{file}");
        compare(&robot, &std::fs::read_to_string(models.join(file)).unwrap(), "");
    }
}
