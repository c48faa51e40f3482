//! `regrasp place`: from a hand and an object to a plan, without an edit; and grasps that only hold.

use crate::folder::Folder;
use crate::places::shared_models;
use serde_json::Value;

/// The lines of `--json`, the event of this name.
fn event(out: &str, name: &str) -> Value {
    out.lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("a line of JSON"))
        .find(|event| event["event"] == name)
        .unwrap_or_else(|| panic!("no event {name} in\n{out}"))
}

#[test]
fn a_scene_that_was_placed_is_planned_without_an_edit() {
    let folder = Folder::new();
    let hand = hand_of(&folder);
    let arguments =
        ["place", &hand, "box:0.05,0.05,0.06", "--turn", "z:90", "-o", "placed.toml", "--alternatives", "1"];
    let placed = folder.run(&[arguments.as_slice(), &["--pictures", "pictures"]].concat());
    assert_eq!(placed.code, Some(0), "{placed:?}");
    assert!(folder.path("placed.2.toml").is_file());
    let picture = std::fs::read(folder.path("pictures/place-1.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG"));
    let text = std::fs::read(folder.path("placed.toml")).unwrap();
    assert_eq!(folder.run(&arguments).code, Some(0));
    assert_eq!(std::fs::read(folder.path("placed.toml")).unwrap(), text, "the same bytes again");
    for scene in ["placed.toml", "placed.2.toml"] {
        let plan = folder.run(&["plan", scene, "-o", "plan.json"]);
        assert!(plan.code == Some(0) && plan.err.contains("ACCEPTED"), "{plan:?}");
    }
    // A scene file as the object, and several turns.
    let again = ["place", &hand, "scene.toml", "--turn", "x:60", "--turn", "z:90", "-o", "two.toml", "--json"];
    let placed = folder.run(&again);
    assert_eq!(placed.code, Some(0), "{placed:?}");
    let places = event(&placed.out, "places");
    assert_eq!(places["places"][0]["searches"].as_array().unwrap().len(), 2);
    for task in ["x60", "z90"] {
        let plan = folder.run(&["plan", "two.toml", "--task", task, "-o", "plan.json"]);
        assert!(plan.code == Some(0) && plan.err.contains("ACCEPTED"), "{task} {plan:?}");
    }
}

/// Of two turns of a board one is found: the other is named, and what comes next plans the one that was.
#[test]
fn turns_that_were_not_found_are_named() {
    let folder = Folder::new();
    let hand = hand_of(&folder);
    let arguments = ["place", &hand, "box:0.2,0.1,0.03", "--turn", "x:180", "--turn", "z:40", "-o", "board.toml"];
    let placed = folder.run(&arguments);
    assert_eq!(placed.code, Some(0), "{placed:?}");
    for words in ["short searches found z40, and not x180", "next   regrasp plan board.toml --task z40 -o plan.json"] {
        assert!(placed.err.contains(words), "{words} is missing:\n{}", placed.err);
    }
    let plan = folder.run(&["plan", "board.toml", "--task", "z40", "-o", "plan.json"]);
    assert!(plan.code == Some(0) && plan.err.contains("ACCEPTED"), "{plan:?}");
}

/// What the scene of the folder calls its hand.
fn hand_of(folder: &Folder) -> String {
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    let line = text.lines().find(|line| line.starts_with("file = ")).unwrap();
    line.trim_start_matches("file = ").trim_matches('"').to_owned()
}

#[test]
fn a_grasp_that_only_holds_answers_no_turn() {
    let folder = Folder::new();
    let hold = folder.run(&["plan", "scene.toml", "--hold", "-o", "hold.json"]);
    assert!(hold.code == Some(0) && hold.err.contains("ACCEPTED"), "{hold:?}");
    assert!(hold.err.contains("normal forces"), "{}", hold.err);
    assert_eq!(folder.run(&["check", "hold.json", "--hold"]).code, Some(0));
    let as_turn = folder.run(&["check", "hold.json"]);
    assert!(as_turn.code == Some(1) && as_turn.err.contains("GoalMismatch"), "{as_turn:?}");
    let view = folder.run(&["view", "hold.json", "--hold", "-o", "hold.html", "--png", "hold.png"]);
    assert_eq!(view.code, Some(0), "{view:?}");
}

#[test]
fn an_open_start_is_planned_checked_and_told() {
    let folder = Folder::new();
    folder.edit("scene.toml", "position = [0.0, 0.0, 0.078]", "position = \"auto\"");
    let plan = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--report", "plan.html"]);
    assert!(plan.code == Some(0) && plan.err.contains("the object starts at ["), "{plan:?}");
    assert!(plan.err.contains("the scene leaves the start open"), "{plan:?}");
    assert_eq!(folder.run(&["check", "plan.json"]).code, Some(0));
    let bench = folder.run(&["bench", "scene.toml", "--seeds", "2"]);
    assert_eq!(bench.code, Some(0), "{bench:?}");
}

#[test]
fn nonsense_is_refused_with_what_was_expected() {
    let folder = Folder::new();
    let hand = hand_of(&folder);
    for (object, turn, expected) in [
        ("sphere:big", "z:90", "sphere:RADIUS"),
        ("box:0.05", "z:90", "box:X,Y,Z"),
        ("sphere:0.03", "up:90", "AXIS:DEGREES"),
        ("nothing.obj", "z:90", "nothing.obj"),
        ("nothing.toml", "z:90", "nothing.toml"),
    ] {
        let run = folder.run(&["place", &hand, object, "--turn", turn, "-o", "out.toml"]);
        assert!(run.code == Some(2) && run.err.contains(expected), "{object} {turn}: {run:?}");
        assert!(!folder.path("out.toml").exists());
    }
    let large = folder.run(&["place", &hand, "sphere:0.4", "-o", "out.toml"]);
    assert!(large.code == Some(1) && large.err.contains("found no pose"), "{large:?}");
    let onto_itself = folder.run(&["place", &hand, "scene.toml", "-o", "scene.toml"]);
    assert_eq!(onto_itself.code, Some(2), "{onto_itself:?}");
}

/// Three commands from the URDF of the left Allegro hand to an accepted plan.
#[test]
fn a_hand_that_was_never_seen_is_three_commands_away() {
    let Some(models) = shared_models() else { return };
    let folder = Folder::new();
    let urdf = models.join("hands/allegro/allegro_left.urdf");
    let inspect = folder.run(&["inspect", urdf.to_str().unwrap(), "-o", "left.toml"]);
    assert_eq!(inspect.code, Some(0), "{inspect:?}");
    for words in ["index", "thumb", "region that 3 fingertips reach", "suggested place", "every finger can let go"] {
        assert!(inspect.out.contains(words), "{words} is missing in\n{}", inspect.out);
    }
    assert_eq!(folder.run(&["place", "left.toml", "sphere:0.032", "-o", "placed.toml"]).code, Some(0));
    let plan = folder.run(&["plan", "placed.toml", "-o", "plan.json"]);
    assert!(plan.code == Some(0) && plan.err.contains("ACCEPTED"), "{plan:?}");
}
