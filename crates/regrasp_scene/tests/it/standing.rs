//! Tasks of pick and place: objects stand where they start and where they are asked to.

use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, load_scene_text};
use std::path::Path;

const SCENE: &str = r#"format = "regrasp-scene"
format_version = 2

[robot]
file = "ROBOT"

[[objects]]
name = "carton"
box = { size = [0.04, 0.06, 0.08] }
mass = 0.1
friction = 0.8
START

[[supports]]
name = "table"
box = { size = [0.5, 1.6, 0.02] }
position = [0.6, 0.0, 0.3]

[[supports]]
name = "post"
cylinder = { radius = 0.03, length = 0.2 }
position = [0.5, 0.5, 0.41]

[[obstacles]]
name = "lamp"
cylinder = { radius = 0.02, length = 0.7 }
position = [0.45, 0.0, 0.66]

[[tasks]]
task = "pick_and_place"
goal = { GOAL }
"#;

fn read(start: &str, goal: &str) -> Result<LoadedScene, String> {
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/robots/two_arms/robot.toml");
    let text = SCENE.replace("ROBOT", robot).replace("START", start).replace("GOAL", goal);
    load_scene_text(Path::new("scene.toml"), text.into_bytes(), &LoadOptions::default()).map_err(|e| e.to_string())
}

const START: &str = "position = [0.6, -0.3, 0.35]";
const GOAL: &str = "position = [0.6, 0.3, 0.35]";

#[test]
fn objects_that_stand_are_taken_as_they_are() {
    for (start, goal) in [
        (START, GOAL),
        // A tenth of a millimetre above the table, and on another face on the post.
        (
            "position = [0.6, -0.3, 0.35009]",
            "position = [0.5, 0.5, 0.53], quat_xyzw = [0.0, 0.70710678, 0.0, 0.70710678]",
        ),
        (START, "turn = { axis = \"z\", angle_deg = 90 }, move = [0.0, 0.4, 0.0]"),
    ] {
        let loaded = read(start, goal).unwrap_or_else(|error| panic!("{error}"));
        let query = loaded.task().pick_and_place().unwrap();
        assert_eq!(query.world_from_object_start, loaded.state.world_from_objects[0]);
    }
}

/// The pose that a message offers.
fn offered(error: &str) -> String {
    let at = error.find("paste ").expect("a pose to paste") + "paste ".len();
    let end = error[at..].find(", or add").expect("an end of the pose") + at;
    error[at..end].to_owned()
}

#[test]
fn the_nearest_stable_pose_is_offered_and_is_one() {
    let tilted = "position = [0.6, -0.3, 0.36]\nquat_xyzw = [0.03, 0.02, 0.1, 0.994]";
    let error = read(tilted, GOAL).unwrap_err();
    assert!(error.contains("P306") && error.contains("\"carton\"") && error.contains("at the start"), "{error}");
    let pose = offered(&error).replace(", quat_xyzw", "\nquat_xyzw");
    let loaded = read(&pose, GOAL).unwrap_or_else(|error| panic!("{error}"));
    let start = loaded.task().pick_and_place().unwrap().world_from_object_start;
    assert!((start.translation.z - 0.35).abs() < 1e-8);
    // The same by set_down, with a note for start and goal; the goal is seen from the start.
    let moved = "turn = { axis = \"z\", angle_deg = 30 }, move = [0.0, 0.4, 0.02] }\nset_down = true\n#";
    let loaded = read(tilted, moved).unwrap_or_else(|error| panic!("{error}"));
    let query = loaded.task().pick_and_place().unwrap();
    assert!((query.world_from_object_start.to_homogeneous() - start.to_homogeneous()).norm() < 1e-8);
    assert_eq!(query.world_from_object_start, loaded.state.world_from_objects[0]);
    assert!((query.world_from_object_goal.translation.z - 0.35).abs() < 1e-8);
    let notes: Vec<&String> = loaded.notes.iter().filter(|note| note.contains("set down")).collect();
    assert_eq!(notes.len(), 2, "{:?}", loaded.notes);
    // Two tenths of a millimetre are too much.
    let error = read("position = [0.6, -0.3, 0.3502]", GOAL).unwrap_err();
    assert!(error.contains("P306") && error.contains("0.20 mm"), "{error}");
}

#[test]
fn objects_beside_their_support_or_in_something_are_refused() {
    for (start, goal, words) in [
        (START, "position = [0.6, 0.3, 0.45]", ["P306", "100.00 mm"]),
        (START, "position = [0.45, 0.0, 0.35]", ["P307", "is in \"lamp\" at the goal"]),
        (START, "position = [0.5, 0.45, 0.35]", ["P307", "is in \"post\" at the goal"]),
    ] {
        let error = read(start, goal).unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
    // Beside every support: planners fail for that reason, and the reader has a note.
    for (start, goal, words) in [
        ("position = [0.2, -0.3, 0.35]", GOAL, "no support at the start"),
        (START, "position = [0.852, 0.0, 0.35]", "no support at the goal"),
    ] {
        let loaded = read(start, goal).unwrap_or_else(|error| panic!("{error}"));
        assert!(loaded.notes.iter().any(|note| note.contains(words)), "{:?}", loaded.notes);
    }
    let ball = "position = [0.6, -0.3, 0.34]";
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/robots/two_arms/robot.toml");
    let text = SCENE.replace("ROBOT", robot).replace("START", ball).replace("GOAL", GOAL);
    let text = text.replace("box = { size = [0.04, 0.06, 0.08] }", "sphere = { radius = 0.03 }");
    let read = |text: String| load_scene_text(Path::new("scene.toml"), text.into_bytes(), &LoadOptions::default());
    let error = read(text.clone()).unwrap_err().to_string();
    assert!(error.contains("P306") && error.contains("it rolls"), "{error}");
    let any = text.replace("format_version = 2", "format_version = 2\ngravity = \"any\"");
    let error = read(any).unwrap_err().to_string();
    assert!(error.contains("P306") && error.contains("gravity"), "{error}");
}
