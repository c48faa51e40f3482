//! Lists and obstacles of tasks of pick and place.

use crate::support::Folder;

const SCENE: &str = r#"format = "regrasp-scene"
format_version = 2

[robot]
file = "ROBOT"
hands = [{ name = "lonely", file = "HAND", world_from_hand = { position = [0.0, 3.0, 0.0] } }]

[[objects]]
name = "cup"
cylinder = { radius = 0.03, length = 0.08 }
mass = 0.1
friction = 0.8
position = [0.5, 0.5, 0.35]

[[supports]]
name = "table"
box = { size = [0.5, 1.6, 0.02] }
position = [0.6, 0.0, 0.3]

[[obstacles]]
name = "lamp"
cylinder = { radius = 0.02, length = 0.4 }
position = [0.5, 0.0, 0.51]

[[tasks]]
task = "pick_and_place"
goal = { position = [0.5, -0.5, 0.35] }
"#;

fn scene() -> String {
    let assets = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets");
    let hand = format!("{assets}/hands/wide_four_finger/hand.toml");
    SCENE.replace("ROBOT", &format!("{assets}/robots/two_arms/robot.toml")).replace("HAND", &hand)
}

#[test]
fn an_obstacle_stands_on_its_support_and_not_in_it() {
    let good = Folder::new().load(&scene()).unwrap_or_else(|error| panic!("{error}"));
    assert!(good.task().query(0).as_pick_and_place().is_some());
    let messages = Folder::new().messages(&scene().replace("[0.5, 0.0, 0.51]", "[0.5, 0.0, 0.45]"));
    assert!(messages.contains("S113"), "{messages}");
    assert!(messages.contains("\"lamp\" overlaps the support \"table\""), "{messages}");
    // Scenes of other tasks are read as before.
    let motion = scene().replace("pick_and_place", "motion").replace("position = [0.5, -0.5, 0.35]", "joints = {}");
    let loaded = Folder::new().load(&motion.replace("[0.5, 0.0, 0.51]", "[0.5, 0.0, 0.45]"));
    assert!(loaded.is_ok(), "{loaded:?}");
}

#[test]
fn lists_are_of_hands_that_a_robot_carries() {
    let with = |hand: &str| {
        scene().replace("friction = 0.8\n", &format!("friction = 0.8\ngrasps = {{ {hand} = \"list.json\" }}\n"))
    };
    let messages = Folder::new().messages(&with("lonely"));
    assert!(messages.contains("S120") && messages.contains("is a hand that no robot carries"), "{messages}");
    assert!(messages.contains("a hand of the robot: right, left"), "{messages}");
    let messages = Folder::new().messages(&with("right"));
    assert!(messages.contains("S110"), "{messages}");
}
