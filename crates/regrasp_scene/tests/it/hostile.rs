//! Scenes that are made to be slow, to forge messages, or to carry numbers that nothing can plan with; and what scenes may open.

use crate::support::{Folder, GOOD, cube};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::load_scene;
use std::time::{Duration, Instant};

/// Reading a megabyte may take this long, on a machine that is busy. Quadratic readers took minutes.
const PATIENCE: Duration = Duration::from_secs(16);

fn with(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    GOOD.replacen(from, to, 1)
}

fn codes(text: &str) -> Vec<&'static str> {
    match Folder::new().load(text) {
        Ok(_) => Vec::new(),
        Err(error) => error.diagnostics.iter().map(|diagnostic| diagnostic.code).collect(),
    }
}

#[test]
fn a_megabyte_of_faults_is_read_in_time_listed_in_part_and_counted() {
    let repeated = |n: usize, line: &dyn Fn(usize) -> String| (0..n).map(line).collect::<String>();
    let obstacle = "[[obstacles]]\nname = \"a\"\nsphere = { radius = 0.01 }\nposition = [1, 1, 1]\n";
    for (text, n) in [
        (repeated(80_000, &|i| format!("k{i} = 1\n")) + GOOD, 80_000),
        (GOOD.to_owned() + &repeated(20_000, &|_| "[[obstacles]]\n".into()), 60_000),
        (GOOD.to_owned() + &repeated(12_000, &|_| obstacle.into()), 11_999),
        (
            with(
                "hand.toml\"",
                &format!("hand.toml\"\nrest = {{ {} a = 1 }}", repeated(60_000, &|i| format!("k{i} = 1, "))),
            ),
            60_001,
        ),
    ] {
        let folder = Folder::new();
        let started = Instant::now();
        let error = folder.load(&text).expect_err("the scene is bad");
        assert!(started.elapsed() < PATIENCE, "{:?} for {} bytes", started.elapsed(), text.len());
        assert_eq!((error.diagnostics.len(), error.diagnostics.len() + error.n_more), (20, n), "{error}");
    }
}

#[test]
fn directions_of_any_length_are_directions() {
    let expected = Folder::new().load(GOOD).unwrap().task().goal.clone();
    for axis in ["[1e200, 0, 0]", "[1e-200, 0.0, 0]", "[1e-320, 0, 0]", "[1.7e308, 0, 0]"] {
        let loaded = Folder::new().load(&with("axis = \"x\"", &format!("axis = {axis}"))).unwrap();
        assert_eq!(loaded.task().goal, expected, "{axis}");
        assert_eq!(loaded.notes, Vec::<String>::new());
    }
    let down = Folder::new().load(&with("task =", "gravity = [0, 0, -1]\ntask =")).unwrap().scene.gravity;
    for length in ["1e200", "1e-200", "1e-320"] {
        let loaded = Folder::new().load(&with("task =", &format!("gravity = [0, 0, -{length}]\ntask ="))).unwrap();
        assert_eq!(loaded.scene.gravity, down, "{length}");
    }
    assert_eq!(codes(&with("axis = \"x\"", "axis = [0, 0, 0]")), ["S107"]);
    assert_eq!(codes(&with("task =", "gravity = [0, 0, 0.0]\ntask =")), ["S107"]);
}

#[test]
fn numbers_that_no_plan_can_hold_are_refused() {
    let friction = |value: &str| codes(&with("friction = 0.8", &format!("friction = {value}")));
    let mass = |value: &str| codes(&with("mass = 0.1", &format!("mass = {value}")));
    for good in ["0", "1e-320", "1e-12", "1000"] {
        assert_eq!((friction(good), mass(good)), (vec![], vec![]), "{good}");
    }
    assert_eq!((friction("1e9"), mass("1e7")), (vec!["S107"], vec!["S107"]));
    assert_eq!(codes(&with("mass = 0.1", "density = 1e300")), ["S107"]);
    assert_eq!(codes(&with("mass = 0.1", "density = 1e-300")), Vec::<&str>::new());
}

#[test]
fn names_that_drive_a_terminal_or_fill_it_are_refused() {
    for name in ["a\\ncheck  ACCEPTED", "a\\u001b[2J", "a\\u202e", "a\\u200f", &"n".repeat(1_000_000)] {
        let folder = Folder::new();
        let object = with("name = \"ball\"", &format!("name = \"{name}\""));
        let obstacle =
            format!("{GOOD}\n[[obstacles]]\nname = \"{name}\"\nsphere = {{ radius = 0.01 }}\nposition = [1, 1, 1]\n");
        for text in [object, obstacle] {
            let messages = folder.messages(&text);
            assert!(messages.starts_with("V004 scene.toml:"), "{messages}");
            assert!(messages.lines().count() == 1 && messages.len() < 500, "{messages}");
        }
        // Names of files are shown on one line, and in part.
        let text = with("sphere = { radius = 0.032 }", &format!("mesh = {{ file = \"{name}.obj\" }}"));
        let messages = folder.messages(&text);
        assert!(messages.starts_with("S110 ") && messages.lines().count() == 1 && messages.len() < 6_000, "{messages}");
    }
}

#[test]
fn reading_stops_at_the_deadline() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    crate::wide_scene::copy_hand(&crate::support::repository(), folder.path());
    std::fs::write(folder.path().join("cube.obj"), cube(0.02, 12)).unwrap();
    std::fs::write(&path, with("sphere = { radius = 0.032 }", "mesh = { file = \"cube.obj\" }")).unwrap();
    let late = LoadOptions { deadline: Some(Instant::now()), ..LoadOptions::default() };
    let error = load_scene(&path, &late).unwrap_err();
    assert!(error.diagnostics.iter().all(|diagnostic| diagnostic.code == "F004"), "{error}");
    let deadline = Instant::now().checked_add(Duration::from_secs(3600));
    assert!(load_scene(&path, &LoadOptions { deadline, ..LoadOptions::default() }).is_ok());
}

/// What SECURITY.md says of the files that a scene names: any regular file, wherever it is. Robots may not (`regrasp_robot`).
#[cfg(unix)]
#[test]
fn scenes_name_any_regular_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let (inside, outside) = (folder.path().join("a/b/project"), folder.path().join("elsewhere"));
    for path in [&inside, &outside] {
        std::fs::create_dir_all(path).unwrap();
    }
    crate::wide_scene::copy_hand(&crate::support::repository(), &inside);
    std::fs::write(outside.join("cube.obj"), cube(0.02, 12)).unwrap();
    std::os::unix::fs::symlink(outside.join("cube.obj"), inside.join("link.obj")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", inside.join("zero.obj")).unwrap();
    let path = inside.join("scene.toml");
    let load = |file: &str| {
        std::fs::write(&path, with("sphere = { radius = 0.032 }", &format!("mesh = {{ file = \"{file}\" }}"))).unwrap();
        load_scene(&path, &LoadOptions::default())
    };
    let absolute = outside.join("cube.obj").display().to_string();
    for file in ["../../../elsewhere/cube.obj", "link.obj", absolute.as_str()] {
        let loaded = load(file).unwrap_or_else(|error| panic!("{error}"));
        // The plan says by name and hash what was read.
        let mesh = loaded.scene.inputs.iter().find(|input| input.role == "mesh").unwrap();
        assert_eq!(mesh.name, file);
        let is_noted = loaded.notes.iter().any(|note| note.contains("is an absolute path"));
        assert_eq!(is_noted, file == absolute, "{:?}", loaded.notes);
    }
    for (file, code) in [("zero.obj", "S110"), ("/dev/zero", "S110"), ("..", "S110"), ("https://a.org/b.obj", "U103")] {
        assert_eq!(load(file).unwrap_err().diagnostics[0].code, code, "{file}");
    }
}

#[test]
fn brackets_that_are_never_closed_are_refused_at_once() {
    // A line pasted again and again: the parser would call itself for every bracket.
    for line in ["box = { size =hand.toml\"\n", "a = [\n", "b = [{ c = \"\"\"{ \n"] {
        let error = Folder::new().load(&format!("{GOOD}{}", line.repeat(10_000))).unwrap_err().to_string();
        assert!(error.contains("S100") && error.contains("not closed"), "{error}");
    }
}
