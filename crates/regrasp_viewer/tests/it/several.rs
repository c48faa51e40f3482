//! Stories of scenes of two hands, two objects and a support, and of a robot with two arms.

use crate::places::repository;
use crate::sample::story_without_plan;
use crate::two_hands::SCENE;
use regrasp_geometry::Pose;
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene};
use regrasp_viewer::story::{Carrier, JointStory, LinkStory, Role, SceneStory, world_from_links};
use std::collections::BTreeSet;

fn load() -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let hand = repository().join("assets/hands/wide_four_finger/hand.toml").canonicalize().unwrap();
    let path = folder.path().join("two_hands.toml");
    std::fs::write(&path, SCENE.replace("\"hand.toml\"", &format!("{:?}", hand.display().to_string()))).unwrap();
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn load_two_arms() -> LoadedScene {
    load_scene(&repository().join("scenes/robot_two_arms.toml"), &LoadOptions::default()).unwrap()
}

fn story_of(loaded: &LoadedScene, task: &str) -> SceneStory {
    story_without_plan(loaded.manipulation_of(loaded.task_named(task).unwrap()), &LoadOptions::default()).scene
}

fn at_rest(joints: &[JointStory]) -> Vec<f64> {
    joints.iter().map(|joint| joint.at_rest).collect()
}

/// Where the shapes that collide stand that are `of` some body, by the name of body and link.
fn placed(story: &SceneStory, of: impl Fn(Carrier) -> bool) -> Vec<(String, Pose)> {
    let posed = |links: &[LinkStory], joints: &[JointStory], k: usize| world_from_links(links, &at_rest(joints))[k];
    let world_from = |on: Carrier| match on {
        Carrier::Hand(hand, link) => posed(&story.hands[hand].links, &story.hands[hand].joints, link),
        Carrier::RobotPart(part, link) => posed(&story.robot_parts[part].links, &story.robot_parts[part].joints, link),
        Carrier::Object(object) => Pose::from(&story.objects[object].world_from_object),
        Carrier::Support(_) | Carrier::Obstacle(_) => Pose::identity(),
    };
    let pieces = story.pieces.iter().filter(|piece| piece.role == Role::Collision && of(piece.on));
    pieces
        .map(|piece| (story.name_of(piece.on).unwrap(), world_from(piece.on) * Pose::from(&piece.from_mesh)))
        .collect()
}

fn assert_same_place((name, pose): &(String, Pose), (other_name, other): &(String, Pose)) {
    let off = (pose.translation.vector - other.translation.vector).norm();
    assert!(off < 1e-12 && pose.rotation.angle_to(&other.rotation) < 1e-7, "{name} and {other_name} are {off} m apart");
}

#[test]
fn every_body_is_in_its_list_with_links_joints_and_shapes() {
    let loaded = load();
    for (task, moved) in [("turn_ball", 0), ("turn_box", 1)] {
        let story = story_of(&loaded, task);
        assert_eq!((story.moving_hand, story.moved_object), (moved, moved));
        assert_eq!(story.hands.iter().map(|hand| &*hand.name).collect::<Vec<_>>(), ["right", "left"]);
        assert_eq!(story.objects.iter().map(|object| &*object.name).collect::<Vec<_>>(), ["ball", "box"]);
        assert_eq!((&story.supports[..], &story.obstacles[..]), (&["table".to_owned()][..], &["lamp".to_owned()][..]));
        assert!(story.robot_parts.is_empty());
        for (hand, told) in loaded.scene.hands.iter().zip(&story.hands) {
            assert_eq!(told.joints.iter().map(|joint| joint.name.clone()).collect::<Vec<_>>(), hand.hand.joint_names());
            assert_eq!(told.links.len(), hand.hand.robot.links.len());
            assert_eq!(told.fingers.len(), hand.hand.fingers.len());
        }
        // The left hand rests with a finger of its own.
        let west = |hand: usize| story.hands[hand].joints.iter().find(|joint| joint.name == "west_abduction").unwrap();
        assert_eq!((west(1).at_rest, west(0).at_rest == 0.25), (0.25, false));
        let carriers: BTreeSet<String> = story.pieces.iter().map(|piece| format!("{:?}", piece.on)).collect();
        for on in ["Object(0)", "Object(1)", "Support(0)", "Obstacle(0)", "Hand(0, 0)", "Hand(1, 0)"] {
            assert!(carriers.contains(on), "{on} of {carriers:?}");
        }
    }
}

#[test]
fn bodies_are_the_same_whichever_hand_moves() {
    for (loaded, tasks) in [(load(), ["turn_ball", "turn_box"]), (load_two_arms(), ["turn_ball", "turn_box"])] {
        let [ball, box_] = tasks.map(|task| story_of(&loaded, task));
        assert_eq!(ball.hands, box_.hands);
        assert_eq!(ball.robot_parts, box_.robot_parts);
        assert_eq!(ball.objects, box_.objects);
    }
}

/// The planner keeps away from what rests where its chains of joints put it; the story has trees of links.
#[test]
fn what_rests_stands_where_planners_keep_away_from_it() {
    for (loaded, n_parts) in [(load(), 0), (load_two_arms(), 3)] {
        let task = loaded.manipulation_of(loaded.task_named("turn_ball").unwrap());
        let story = story_of(&loaded, "turn_ball");
        assert_eq!(story.robot_parts.len(), n_parts);
        let is_moved = |on: Carrier| matches!(on, Carrier::Hand(0, _) | Carrier::Object(0) | Carrier::Obstacle(_));
        let mut told = placed(&story, |on| !is_moved(on));
        let bystanders = task.bystanders().into_iter();
        let mut kept_away: Vec<(String, Pose)> =
            bystanders.map(|body| (body.name, body.placed.parent_from_shape)).collect();
        // Planners name shapes of tips after their fingers, links of arms after the robot, and count the flange twice: as part of the
        // hand that it carries, and as part of the arm.
        let places = |all: &mut Vec<(String, Pose)>| {
            let key = |pose: &Pose| [0, 1, 2].map(|k| (pose.translation.vector[k] * 1e9).round() as i64);
            all.sort_by_key(|(_, pose)| key(pose));
            all.dedup_by(|(_, a), (_, b)| key(a) == key(b) && a.rotation.angle_to(&b.rotation) < 1e-7);
        };
        places(&mut told);
        places(&mut kept_away);
        assert_eq!(told.len(), kept_away.len());
        told.iter().zip(&kept_away).for_each(|(told, kept_away)| assert_same_place(told, kept_away));
    }
}

#[test]
fn arms_and_hands_share_out_the_links_of_their_robot() {
    let loaded = load_two_arms();
    let (robot, story) = (&loaded.scene.robots[0], story_of(&loaded, "turn_ball"));
    let names: Vec<&str> = story.robot_parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["two_arms", "two_arms/right", "two_arms/left"]);
    let mut world_from_link = Vec::new();
    robot.link_poses(&loaded.state.joints_of_robot(&loaded.scene, 0), &mut world_from_link);
    let trees = story.robot_parts.iter().map(|part| (&part.links, &part.joints));
    let trees: Vec<_> = trees.chain(story.hands.iter().map(|hand| (&hand.links, &hand.joints))).collect();
    let mut seen = BTreeSet::new();
    for (links, joints) in trees {
        for (link, pose) in links.iter().zip(world_from_links(links, &at_rest(joints))) {
            assert!(seen.insert(link.name.clone()), "{} is in two bodies", link.name);
            let id = robot.robot.links.iter().position(|of_robot| of_robot.name == link.name).unwrap();
            assert_same_place(&(link.name.clone(), pose), &("the robot's".into(), world_from_link[id]));
        }
    }
    assert_eq!(seen.len(), robot.robot.links.len());
    let shoulder = story.robot_parts[1].joints.iter().find(|joint| joint.name == "right_shoulder").unwrap();
    assert_eq!(shoulder.at_rest, 0.5);
}
