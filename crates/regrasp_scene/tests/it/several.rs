//! Scenes of several hands and objects (version 2 of the format).

use crate::support::{Folder, GOOD};
use crate::two_hands::SCENE;
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_robot::{Hand, JointKind};
use regrasp_scene::{Gravity, HandView, LoadedScene, Manipulation, Obstacle, State};
use std::collections::BTreeMap;

/// The scene of two hands with `from` replaced, which must be there.
fn with(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    SCENE.replacen(from, to, 1)
}

/// The scene without its last `n` tasks.
fn without_tasks(n: usize) -> String {
    let parts: Vec<&str> = SCENE.split("[[tasks]]").collect();
    parts[..parts.len() - n].join("[[tasks]]")
}

fn load(text: &str) -> LoadedScene {
    Folder::new().load(text).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn refused(text: &str, expected: &str) {
    assert_eq!(Folder::new().messages(text), expected);
}

/// Where the left hand stands, from the numbers of the file.
fn world_from_left() -> Pose {
    let turn = Rotation3::from_axis_angle(&Vector::x_axis(), 0.96f64.atan2(0.28));
    Pose::from_parts(Translation3::new(0.5, 0.0, 0.05), UnitQuaternion::from_rotation_matrix(&turn))
}

#[track_caller]
fn assert_near(found: &Pose, expected: &Pose, what: &str) {
    let off = (found.translation.vector - expected.translation.vector).norm();
    assert!(off < 1e-12 && found.rotation.angle_to(&expected.rotation) < 1e-7, "{what}: {found} and {expected}");
}

#[test]
fn names_places_and_tasks_are_those_of_the_file() {
    let loaded = load(SCENE);
    let scene = &loaded.scene;
    assert_eq!(loaded.notes, Vec::<String>::new());
    assert_eq!(scene.hands.iter().map(|hand| hand.name.as_str()).collect::<Vec<_>>(), ["right", "left"]);
    assert_eq!(scene.objects.iter().map(|object| object.name.as_str()).collect::<Vec<_>>(), ["ball", "box"]);
    assert_eq!(
        (scene.hand_named("left"), scene.object_named("box"), scene.hand_named("box")),
        (Some(1), Some(1), None)
    );
    assert_eq!(scene.supports.iter().map(|support| support.body.name.as_str()).collect::<Vec<_>>(), ["table"]);
    assert_eq!(scene.obstacles.iter().map(|obstacle| obstacle.name.as_str()).collect::<Vec<_>>(), ["lamp"]);
    assert_eq!(scene.hands[0].world_from_hand, Pose::identity());
    assert_near(&scene.hands[1].world_from_hand, &world_from_left(), "left hand");

    let tasks: Vec<_> = loaded.tasks.iter().map(|task| (task.name.as_str(), task.hand, task.object)).collect();
    assert_eq!(tasks, [("turn_ball", 0, 0), ("turn_box", 1, 1)]);
    assert_eq!(loaded.task_named("turn_box"), Some(&loaded.tasks[1]));
    assert_eq!(loaded.task_named("turn_lamp"), None);
    assert_eq!(loaded.clone().choosing("turn_box").map(|chosen| chosen.task().clone()), Some(loaded.tasks[1].clone()));
    for (task, angle) in loaded.tasks.iter().zip([90f64, 45.0]) {
        let query = task.query(3);
        assert_eq!(
            (query.name(), query.hand(), query.object(), query.task()),
            (task.name.as_str(), task.hand, task.object, "in_hand")
        );
        // Without [start] the object starts where it rests.
        assert_eq!(*query.start(), loaded.state.world_from_objects[task.object]);
        let turn = query.goal().rotation * query.start().rotation.inverse();
        assert!((turn.scaled_axis() - Vector::x() * angle.to_radians()).norm() < 1e-12, "{}", task.name);
    }
}

#[test]
fn everything_is_at_rest_at_first_and_nobody_holds_anything() {
    let loaded = load(SCENE);
    let State { robot_joints, hand_joints, world_from_objects } = &loaded.state;
    assert!(robot_joints.is_empty());
    let at_rest = [0.0, -0.8, 1.2].repeat(4);
    let mut left = at_rest.clone();
    left[6] = 0.25;
    assert_eq!(hand_joints, &[at_rest, left]);
    assert_eq!(world_from_objects[0], Pose::translation(0.0, 0.0, 0.078));
    assert_near(&world_from_objects[1], &(world_from_left() * Pose::translation(0.0, 0.0, 0.078)), "box");
}

#[test]
fn a_start_of_a_task_is_another_pose_than_where_the_object_rests() {
    let start = "start = { position = [0.01, 0.0, 0.078] }\ngoal = { turn = { axis = \"x\", angle_deg = 90 } }";
    let loaded = load(&with("goal = { turn = { axis = \"x\", angle_deg = 90 } }", start));
    assert_eq!(*loaded.task().query(0).start(), Pose::translation(0.01, 0.0, 0.078));
    assert_eq!(loaded.state.world_from_objects[0], Pose::translation(0.0, 0.0, 0.078));
}

/// Poses of all links of a hand at `joints`, in the frame of its base link, straight from the tree of the robot.
fn base_from_links(hand: &Hand, joints: &[f64]) -> Vec<Pose> {
    let names = hand.joint_names();
    let root_from = |link: usize| {
        let chain = hand.robot.joints_to(regrasp_robot::LinkId(link));
        chain.iter().fold(Pose::identity(), |pose, id| {
            let joint = &hand.robot.joints[id.0];
            let position = names.iter().position(|name| *name == joint.name).map_or(0.0, |index| joints[index]);
            assert!(joint.kind == JointKind::Revolute || position == 0.0, "{} slides", joint.name);
            let turn = UnitQuaternion::from_axis_angle(&joint.axis, position);
            pose * joint.parent_from_joint * Pose::from_parts(Translation3::identity(), turn)
        })
    };
    let base_from_root = root_from(hand.base.0).inverse();
    (0..hand.robot.links.len()).map(|link| base_from_root * root_from(link)).collect()
}

/// The collision shapes of the hand `index` in the world, by `name/link`, each with where it is.
fn shapes_of_hand(loaded: &LoadedScene, index: usize) -> BTreeMap<String, Vec<(Shape, Pose)>> {
    let placed = &loaded.scene.hands[index];
    let world_from_base = if index == 0 { Pose::identity() } else { world_from_left() };
    let mut shapes: BTreeMap<String, Vec<(Shape, Pose)>> = BTreeMap::new();
    let poses = base_from_links(&placed.hand, &loaded.state.hand_joints[index]);
    for (link, base_from_link) in placed.hand.robot.links.iter().zip(&poses) {
        for shape in &link.collision {
            let pose = world_from_base * base_from_link * shape.parent_from_shape;
            shapes.entry(format!("{}/{}", placed.name, link.name)).or_default().push((shape.shape.clone(), pose));
        }
    }
    shapes
}

/// Takes away the obstacle called `name`, which must be at `pose`.
#[track_caller]
fn take(obstacles: &mut Vec<Obstacle>, name: &str, pose: &Pose) -> Obstacle {
    let index = obstacles.iter().position(|obstacle| obstacle.name == name);
    let obstacle = obstacles.remove(index.unwrap_or_else(|| panic!("no {name}")));
    assert_near(&obstacle.placed.parent_from_shape, pose, name);
    obstacle
}

/// Checks what the hand `hand` sees with the object `object`: everything else is an obstacle, in the hand's frame.
fn assert_sees(loaded: &LoadedScene, (hand, object): (usize, usize), down: Vector) {
    let task = Manipulation { scene: &loaded.scene, state: &loaded.state, hand_index: hand, object_index: object };
    let view = HandView::of(&task);
    assert_eq!((view.hand_index, view.object_index), (hand, object));
    assert_eq!((view.hand_name, view.object.name.as_str()), (["right", "left"][hand], ["ball", "box"][object]));
    let Gravity::Direction(seen) = view.gravity else { panic!("a direction") };
    assert!((seen.into_inner() - down).norm() < 1e-12, "{seen:?}");

    let hand_from_world = if hand == 0 { Pose::identity() } else { world_from_left().inverse() };
    let mut obstacles = view.obstacles.to_vec();
    let mut others = BTreeMap::from([
        ("lamp", Pose::translation(0.25, 0.1, 0.3)),
        ("table", Pose::translation(0.25, 0.0, -0.2)),
        ("ball", Pose::translation(0.0, 0.0, 0.078)),
        ("box", world_from_left() * Pose::translation(0.0, 0.0, 0.078)),
    ]);
    others.remove(["ball", "box"][object]);
    for (name, world_from_body) in others {
        take(&mut obstacles, name, &(hand_from_world * world_from_body));
        assert_near(&view.hand_from(&world_from_body), &(hand_from_world * world_from_body), name);
        assert_near(&view.world_from(&view.hand_from(&world_from_body)), &world_from_body, name);
    }
    // What is left are links of the other hand.
    let links = shapes_of_hand(loaded, 1 - hand);
    assert!(links.len() > 8, "{:?}", links.keys());
    for (name, shapes) in links {
        for (shape, world_from_shape) in shapes {
            let pose = hand_from_world * world_from_shape;
            let is_it = |obstacle: &&Obstacle| {
                let off = (obstacle.placed.parent_from_shape.translation.vector - pose.translation.vector).norm();
                obstacle.name == name && obstacle.placed.shape.kind() == shape.kind() && off < 1e-12
            };
            let found = obstacles.iter().find(is_it).unwrap_or_else(|| panic!("no {name} at {pose}")).clone();
            assert_near(&found.placed.parent_from_shape, &pose, &name);
            let extent = |shape: &Shape| shape.bounds();
            assert_eq!(extent(&found.placed.shape), extent(&shape), "{name}");
        }
        obstacles.retain(|obstacle| obstacle.name != name);
    }
    obstacles.retain(|obstacle| !obstacle.name.contains("/tip of "));
    assert!(obstacles.is_empty(), "{:?}", obstacles.iter().map(|obstacle| &obstacle.name).collect::<Vec<_>>());
}

#[test]
fn each_hand_sees_everything_else_from_its_own_frame() {
    let loaded = load(SCENE);
    let (upright, tilted) = (Vector::new(0.0, 0.0, -1.0), Vector::new(0.0, -0.96, -0.28));
    // The box is not in the right hand, nor the ball in the left one, but where they are each can be asked about.
    for (pair, down) in [((0, 0), upright), ((1, 1), tilted), ((0, 1), upright), ((1, 0), tilted)] {
        assert_sees(&loaded, pair, down);
    }
}

#[test]
fn the_other_hand_is_seen_in_the_posture_that_it_has() {
    let mut loaded = load(SCENE);
    for (index, joint) in loaded.state.hand_joints[1].iter_mut().enumerate() {
        *joint += 0.02 * (index as f64 + 1.0);
    }
    assert_sees(&loaded, (0, 0), Vector::new(0.0, 0.0, -1.0));
}

#[test]
fn gravity_and_queries_of_the_world_turn_with_the_hand() {
    let loaded =
        load(&with("[[robot.hands]]\nname = \"right\"", "gravity = [1, 0, 0]\n[[robot.hands]]\nname = \"right\""));
    assert_sees(&loaded, (0, 0), Vector::x());
    assert_sees(&loaded, (1, 1), Vector::x());
    let query = loaded.tasks[1].query(0);
    let query = query.as_in_hand().unwrap();
    let seen = query.seen_from(&world_from_left().inverse());
    assert_near(&seen.world_from_object_start, &Pose::translation(0.0, 0.0, 0.078), "start");
    assert_eq!((seen.hand, seen.object, &seen.start_grasp), (1, 1, &query.start_grasp));
    let any = load(&with("[[robot.hands]]\nname = \"right\"", "gravity = \"any\"\n[[robot.hands]]\nname = \"right\""));
    assert_eq!(HandView::of(&any.manipulation_of(&any.tasks[1])).gravity, Gravity::Any);
}

/// Version 1 is the same with one hand, one object and one task.
#[test]
fn one_hand_and_one_object_may_be_left_out_of_the_task() {
    let text = r#"format = "regrasp-scene"
format_version = 2
[[robot.hands]]
name = "hand"
file = "hand.toml"
[[objects]]
name = "ball"
sphere = { radius = 0.032 }
mass = 0.1
friction = 0.8
position = [0.0, 0.0, 0.078]
[[tasks]]
task = "in_hand"
goal = { turn = { axis = "x", angle_deg = 90 } }
"#;
    let (one, two) = (load(GOOD), load(text));
    assert_eq!((&one.tasks, &one.state), (&two.tasks, &two.state));
    assert_eq!((one.task().name.as_str(), one.task().query(5)), ("", two.task().query(5)));
    assert_eq!((&one.scene.hands[0].name, one.view().obstacles.len()), (&two.scene.hands[0].name, 0));
    assert_eq!(two.view().hand_from_world(), None);
}

#[test]
fn tasks_without_names_have_names_that_differ() {
    let names = |text: &str| load(text).tasks.into_iter().map(|task| task.name).collect::<Vec<_>>();
    let text = SCENE.replace("name = \"turn_ball\"\n", "").replace("name = \"turn_box\"\n", "");
    assert_eq!(names(&text), ["task_1", "task_2"]);
}

#[test]
fn hands_and_objects_of_tasks_are_known() {
    refused(
        &with("hand = \"left\"\nobject", "hand = \"lefd\"\nobject"),
        "S120 scene.toml:49:8 key \"tasks[1].hand\": is \"lefd\", which the scene does not have (did you mean \"left\"?); \
         expected right, left",
    );
    refused(
        &with("object = \"ball\"\n", "object = \"table\"\n"),
        "S120 scene.toml:43:10 key \"tasks[0].object\": is \"table\", which the scene does not have; expected ball, box",
    );
    refused(
        &with("object = \"ball\"\n", ""),
        "S102 scene.toml:39:1 table \"tasks[0]\": has no `object`\n  fix: add object = \"ball\"",
    );
    refused(
        &with("task = \"in_hand\"\nhand = \"left\"", "task = \"dual_arm\"\nhand = \"left\""),
        "S105 scene.toml:48:8 key \"tasks[1].task\": is \"dual_arm\"; expected \"in_hand\", \"tracking\", \"motion\" or \"pick_and_place\", the tasks that \
         this version plans",
    );
}

#[test]
fn bodies_and_tasks_have_names_of_their_own() {
    let taken = |place: &str, name: &str, what: &str| {
        format!("S112 scene.toml:{place}: has the name \"{name}\", as another {what}; expected names that differ")
    };
    let body = "body of the scene";
    refused(&with("name = \"lamp\"", "name = \"left\""), &taken("34:1 key \"obstacles[0]\"", "left", body));
    refused(&with("name = \"table\"", "name = \"ball\""), &taken("29:1 key \"supports[0]\"", "ball", body));
    refused(&with("name = \"turn_box\"", "name = \"turn_ball\""), &taken("46:1 key \"tasks[1]\"", "turn_ball", "task"));
    let one_object = with("name = \"box\"", "name = \"ball\"").replace("object = \"box\"", "object = \"ball\"");
    refused(&one_object, &taken("21:1 key \"objects[1]\"", "ball", body));
    let one_hand = with("name = \"left\"", "name = \"right\"").replace("hand = \"left\"", "hand = \"right\"");
    refused(&one_hand, &taken("8:1 key \"robot.hands[1]\"", "right", body));
}

#[test]
fn there_are_tasks_hands_objects_and_their_poses() {
    let task_fix = "  fix: add [[tasks]] with task = \"in_hand\", hand, object and goal";
    refused(&without_tasks(2), &format!("S102 scene.toml:1:1: has no `tasks`\n{task_fix}"));
    let none = without_tasks(2).replace("format_version = 2\n", "format_version = 2\ntasks = []\n");
    refused(&none, &format!("S102 scene.toml:1:1: asks for nothing\n{task_fix}"));
    refused(
        &with("position = [0.5, -0.07488, 0.07184]\n", ""),
        "S102 scene.toml:21:1 table \"objects[1]\": has no `position`\n  fix: add position = [x, y, z], in metres",
    );
    refused(
        &with("name = \"box\"\n", ""),
        "S102 scene.toml:21:1 table \"objects[1]\": has no `name`\n  fix: add name = \"cube\"",
    );
    refused(
        &with("name = \"left\"\n", ""),
        "S102 scene.toml:8:1 table \"robot.hands[1]\": has no `name`\n  fix: add name = \"right\"",
    );
    refused(
        &with("format_version = 2", "format_version = 3"),
        "S105 scene.toml:2:18 key \"format_version\": is 3; expected 1 or 2, the versions that this program reads",
    );
}

#[test]
fn an_object_that_no_finger_of_the_hand_reaches_is_refused() {
    let messages =
        Folder::new().messages(&with("hand = \"left\"\nobject = \"box\"", "hand = \"right\"\nobject = \"box\""));
    assert!(
        messages.starts_with("P302 scene.toml:50:10 key \"tasks[1].object\": position [0.5, -0.07488, 0.07184]"),
        "{messages}"
    );
}
