//! Tasks of kind `motion`.

use crate::support::Folder;
use regrasp_geometry::Pose;
use regrasp_scene::{Holder, LoadedScene, MotionGoal, MotionQuery};

const SCENE: &str = r#"format = "regrasp-scene"
format_version = 2

[robot]
file = "ROBOT"
world_from_robot = { position = [0.1, 0.0, 0.0] }

[[objects]]
name = "box"
box = { size = [0.04, 0.04, 0.04] }
mass = 0.1
friction = 0.8
position = [0.4, -0.3, 0.5]

[[obstacles]]
name = "lamp"
cylinder = { radius = 0.02, length = 0.4 }
position = [0.5, 0.0, 0.7]

[[tasks]]
task = "motion"
start = { joints = { torso_yaw = 0.2 } }
goal = { joints = { right_elbow = -0.9 } }
carried = [{ object = "box", hand = "right" }]
"#;

fn scene() -> String {
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/robots/two_arms/robot.toml");
    SCENE.replace("ROBOT", robot)
}

fn with(from: &str, to: &str) -> String {
    let text = scene();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

fn load(text: &str) -> LoadedScene {
    Folder::new().load(text).unwrap_or_else(|error| panic!("{error}"))
}

fn query(loaded: &LoadedScene) -> MotionQuery {
    loaded.task().query(7).as_motion().expect("a motion").clone()
}

#[track_caller]
fn refused(text: &str, parts: &[&str]) {
    let messages = Folder::new().messages(text);
    for part in parts {
        assert!(messages.contains(part), "no `{part}` in: {messages}");
    }
}

#[test]
fn a_motion_has_all_joints_of_the_robot() {
    let loaded = load(&scene());
    let (query, robot) = (query(&loaded), &loaded.scene.robots[0]);
    assert_eq!((query.name.as_str(), query.robot, loaded.task().kind_name()), ("", 0, "motion"));
    let (rest, at) = (robot.layout.rest(), |name: &str| robot.layout.index_of(name).unwrap());
    let mut start = rest.clone();
    start[at("torso_yaw")] = 0.2;
    let mut goal = start.clone();
    goal[at("right_elbow")] = -0.9;
    // What the goal leaves out ends where it starts, not in the rest posture.
    assert_eq!((&query.start, &query.goal), (&start, &MotionGoal::Joints(goal)));
    let [carried] = query.carried.as_slice() else { panic!("one object") };
    assert_eq!((carried.object, carried.holder), (0, Holder::Hand(0)));
    assert_eq!(carried.world_from_object, Pose::translation(0.4, -0.3, 0.5));
    assert_eq!(carried.holder.link(&loaded.scene, 0), Some(robot.hands[0].hand.base));
    assert!(query.open_coordinates(&loaded.scene).iter().all(|is_open| !is_open));
}

#[test]
fn a_motion_may_do_without_start_objects_and_hands() {
    let text = with("start = { joints = { torso_yaw = 0.2 } }\n", "");
    assert_eq!(query(&load(&text)).start, load(&text).scene.robots[0].layout.rest());
    let from = scene().find("[[objects]]").unwrap();
    let to = scene().find("[[obstacles]]").unwrap();
    let text = format!("{}{}", &scene()[..from], &scene()[to..]);
    let loaded = load(&text.replace("carried = [{ object = \"box\", hand = \"right\" }]\n", ""));
    assert!(loaded.scene.objects.is_empty() && query(&loaded).carried.is_empty());
    // In-hand tasks still need both.
    let in_hand = "task = \"in_hand\"\ngoal = { move = [0.0, 0.0, 0.01] }\n";
    let at = text.find("task = \"motion\"").unwrap();
    refused(&format!("{}{in_hand}", &text[..at]), &["S102", "objects"]);
}

#[test]
fn bad_motions_are_refused_with_their_places() {
    refused(&with("torso_yaw = 0.2", "torso_jaw = 0.2"), &["S120", "torso_jaw", "did you mean"]);
    refused(&with("torso_yaw = 0.2", "torso_yaw = 20.0"), &["P303", "20", "outside the joint's limits"]);
    refused(&with("goal = { joints = { right_elbow = -0.9 } }", ""), &["S102", "goal"]);
    refused(
        &with("goal = { joints = { right_elbow = -0.9 } }", "goal = {}"),
        &["S106", "neither of joints and wrists"],
    );
    refused(&with("hand = \"right\"", "hand = \"middle\""), &["S120", "middle"]);
    refused(&with("hand = \"right\"", "arm = \"right\""), &["S106", "carries a hand"]);
    refused(&with("object = \"box\", hand", "object = \"ball\", hand"), &["S120", "ball"]);
    let wrist = "goal = { wrists = [{ arm = \"right\", position = [0.4, 0.0, 0.5] }] }";
    refused(&with("goal = { joints = { right_elbow = -0.9 } }", wrist), &["P305", "only"]);
    refused(
        &with("task = \"motion\"", "task = \"move\""),
        &["S105", "\"in_hand\", \"tracking\", \"motion\" or \"pick_and_place\""],
    );
}
