//! A hand file makes a manipulator without arms.

use super::places::{repository, shared_models};
use super::{assert_consistent, difference, load, options, random_state, text};
use regrasp_base::Rng;
use regrasp_geometry::{Pose, Vector};
use regrasp_robot::{LoadOptions, Manipulator, Part, load_hand, load_manipulator};

#[test]
fn a_hand_stands_exactly_where_it_is_put_and_its_joints_come_first() {
    let path = repository().join("assets/hands/wide_four_finger/hand.toml");
    let loaded = load_hand(&path, &LoadOptions::default()).unwrap();
    let hand = load_manipulator(&path, &LoadOptions::default()).unwrap().manipulator;
    assert_eq!(hand.layout.names(), loaded.hand.joint_names());
    assert_eq!((hand.arms.len(), hand.hands.len(), hand.layout.range(Part::Common)), (0, 1, 0..0));
    let rest: Vec<f64> = loaded.hand.fingers.iter().flat_map(|finger| finger.rest.clone()).collect();
    assert_eq!(hand.layout.rest(), rest);
    let limits = loaded.hand.fingers.iter().flat_map(|f| f.chain.lower.iter().copied().zip(f.chain.upper.clone()));
    assert!(limits.eq(hand.layout.coordinates.iter().map(|c| (c.lower, c.upper))));
    let world_from_hand = Pose::new(Vector::new(0.3, -0.1, 0.7), Vector::new(0.4, 1.0, -0.2));
    let placed = Manipulator::of_hand("hand".into(), loaded.hand, &world_from_hand).unwrap();
    let mut rng = Rng::keyed(1, "hand alone", 0);
    for _ in 0..20 {
        let state = random_state(&placed, &mut rng);
        assert_eq!(placed.world_from_hand(0, &state), world_from_hand);
        assert_consistent(&placed, &state);
    }
}

#[test]
fn the_wrist_of_a_hand_is_part_of_the_configuration() {
    let Some(models) = shared_models() else { return };
    let path = repository().join("assets/hands/shadow_right/hand.toml");
    let hand = load_manipulator(&path, &options(&models)).unwrap().manipulator;
    let common = hand.layout.range(Part::Common);
    let names: Vec<String> = hand.layout.names();
    assert_eq!(names[common.clone()], ["WRJ2", "WRJ1"]);
    let in_degrees = |radians: f64| radians.to_degrees().round();
    let limits = hand.layout.coordinates[common].iter().map(|c| [c.lower, c.upper].map(in_degrees));
    assert_eq!(limits.collect::<Vec<_>>(), [[-30.0, 10.0], [-40.0, 28.0]]);
    let tree = text::Tree::of(&std::fs::read_to_string(models.join("hands/shadow/shadow_right.urdf")).unwrap());
    let mut rng = Rng::keyed(1, "wrist", 0);
    let mut poses = Vec::new();
    for _ in 0..20 {
        let state = random_state(&hand, &mut rng);
        hand.link_poses(&state, &mut poses);
        // The file's couplings: the last joint of a finger follows the one before it.
        let position = |name: &str| {
            let leader = if name.ends_with("FJ1") { name.replace("J1", "J2") } else { name.to_owned() };
            state[hand.layout.index_of(&leader).unwrap()]
        };
        for link in tree.links() {
            let id = hand.robot.link_named(link).unwrap();
            let expected = hand.world_from_root().to_homogeneous() * tree.root_from(link, &position);
            assert!(difference(&poses[id.0], &expected) < 1e-12, "{link}");
        }
        assert_consistent(&hand, &state);
    }
    // At rest the palm is where it was put; a bent wrist moves it.
    let rest = hand.layout.rest();
    assert!(difference(&hand.world_from_hand(0, &rest), &nalgebra::Matrix4::identity()) < 1e-15);
    let mut bent = rest.clone();
    bent[0] = -0.3;
    assert!(difference(&hand.world_from_hand(0, &bent), &nalgebra::Matrix4::identity()) > 0.1);
}

#[test]
fn joints_of_the_hand_on_no_finger_follow_its_fingers() {
    let urdf = r#"<robot name="r"><link name="palm"/><link name="a"/><link name="b"/><link name="lid"/>
<joint name="ja" type="revolute"><parent link="palm"/><child link="a"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="lid_joint" type="prismatic"><parent link="palm"/><child link="lid"/><axis xyz="0 0 1"/><limit lower="0.01" upper="0.05"/></joint>
<joint name="jb" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
</robot>"#;
    let hand = "format = \"regrasp-hand\"\nformat_version = 1\nurdf = \"hand.urdf\"\n[[fingers]]\nname = \"f\"\n\
                tip_link = \"b\"\ntip = { shape = \"point\", position = [0.0, 0.0, 0.05] }\n";
    let robot = "[[hands]]\nname = \"only\"\nhand = \"hand.toml\"\nposition = [0.0, 0.5, 0.0]\n";
    let made = load(robot, &[("hand.urdf", urdf), ("hand.toml", hand)], &LoadOptions::default()).unwrap();
    assert_eq!(made.layout.names(), ["only/ja", "only/jb", "only/lid_joint"]);
    assert_eq!(made.layout.range(Part::Hand(0)), 0..3);
    let rest = made.layout.rest();
    assert_eq!(rest, [0.0, 0.0, 0.01]);
    assert!(made.is_hand_as_made(0, &rest) && !made.is_hand_as_made(0, &[0.0, 0.0, 0.02]));
    let mut poses = Vec::new();
    made.link_poses(&[0.0, 0.0, 0.03], &mut poses);
    let lid = made.robot.link_named("only/lid").unwrap();
    assert!((poses[lid.0].translation.vector - Vector::new(0.0, 0.5, 0.03)).norm() < 1e-15);
}

#[test]
fn two_hands_stand_beside_each_other_on_fixed_bases() {
    let hand = |name: &str| repository().join(format!("assets/hands/{name}/hand.toml")).display().to_string();
    let text = format!(
        "[[hands]]\nname = \"left\"\nhand = {:?}\nposition = [0.0, 0.25, 0.0]\n\
         [[hands]]\nname = \"right\"\nhand = {:?}\nposition = [0.0, -0.25, 0.0]\nquat_xyzw = [0.0, 0.0, 1.0, 0.0]\n",
        hand("wide_four_finger"),
        hand("tight_four_finger")
    );
    let both = load(&text, &[], &LoadOptions::default()).unwrap();
    assert_eq!(both.hands.iter().map(|hand| hand.arm).collect::<Vec<_>>(), [None, None]);
    let (left, right) = (both.layout.range(Part::Hand(0)), both.layout.range(Part::Hand(1)));
    assert_eq!((left.start, left.end, right.end), (0, right.start, both.layout.len()));
    assert!(both.layout.names()[left].iter().all(|name| name.starts_with("left/")));
    let mut rng = Rng::keyed(1, "two hands", 0);
    for _ in 0..10 {
        let state = random_state(&both, &mut rng);
        assert_consistent(&both, &state);
        assert_eq!(both.world_from_hand(1, &state).translation.vector, Vector::new(0.0, -0.25, 0.0));
    }
    // Links of different hands are never neighbours, unless nothing moves them against each other.
    let moves = |link: regrasp_robot::LinkId| !both.coordinates_above(link).is_empty();
    let across = both.allowed_pairs.iter().filter(|(a, b)| both.part_of(*a) != both.part_of(*b));
    assert!(across.into_iter().all(|&(a, b)| !moves(a) && !moves(b)));
}
