//! Numbers, counts and names at the end of what a file can say: planned with or refused where they are read, never a bug.

use crate::folder::Folder;

/// What comes of planning with `old` replaced by `new` everywhere in `file`.
#[track_caller]
fn ends_with(file: &str, old: &str, new: &str, code: i32, says: &str) {
    let folder = Folder::new();
    let text = std::fs::read_to_string(folder.path(file)).unwrap();
    assert!(text.contains(old), "{file} has no {old:?}");
    folder.write(file, text.replace(old, new));
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--max-work", "20000"]);
    assert_eq!(run.code, Some(code), "{new}: {}", run.err);
    assert!(run.err.contains(says), "{new}: {}", run.err);
    assert_eq!(folder.path("plan.json").exists(), code == 0);
    // `bench` accepts what `plan` does.
    if code == 0 {
        let arguments = ["bench", "scene.toml", "--seeds", "1", "--max-work", "20000", "--json"];
        let bench = folder.run(&arguments);
        assert!(bench.code == Some(0) && bench.out.contains("\"accepted\":true"), "{new}: {} {}", bench.out, bench.err);
    }
}

#[test]
fn an_object_without_weight_is_planned_for() {
    ends_with("scene.toml", "mass = 0.1", "mass = 0", 0, "");
    ends_with("scene.toml", "mass = 0.1", "mass = 1e-12", 0, "");
    ends_with("scene.toml", "mass = 0.1", "mass = 1e-320", 0, "");
}

#[test]
fn friction_and_mass_have_an_end() {
    ends_with("scene.toml", "friction = 0.8", "friction = 1e9", 2, "S107");
    ends_with("scene.toml", "friction = 0.8", "friction = 1000", 0, "");
    ends_with("scene.toml", "mass = 0.1", "mass = 1e10", 2, "S107");
}

#[test]
fn limits_of_joints_that_limit_nothing_are_not_given_and_those_that_allow_nothing_are_refused() {
    ends_with("hand.urdf", "effort=\"1.0\"", "effort=\"1e10\"", 0, "taken as not given");
    ends_with("hand.urdf", "velocity=\"4.0\"", "velocity=\"1e308\"", 0, "taken as not given");
    ends_with("hand.urdf", "velocity=\"4.0\"", "velocity=\"1e-9\"", 2, "U123");
    ends_with("hand.urdf", "velocity=\"4.0\"", "velocity=\"1e-320\"", 2, "U123");
    ends_with("hand.urdf", "upper=\"2.00712864\"", "upper=\"1e300\"", 2, "U124");
}

#[test]
fn the_length_of_a_direction_means_nothing() {
    ends_with("scene.toml", "axis = \"x\"", "axis = [1e200, 0, 0]", 0, "rotation 90 deg");
    ends_with("scene.toml", "axis = \"x\"", "axis = [1e-200, 0, 0]", 0, "rotation 90 deg");
    ends_with("scene.toml", "task =", "gravity = [0, 0, -1e200]\ntask =", 0, "");
    ends_with("hand.urdf", "<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 1e200 0\"/>", 0, "");
    ends_with("scene.toml", "[start]", "[start]\nposition_within = 1e-320", 0, "");
}

#[test]
fn no_name_forges_a_verdict() {
    let forged = "a\\ncheck  ACCEPTED   40 waypoints";
    for (file, old) in [("scene.toml", "name = \"ball\""), ("hand.toml", "name = \"east\"")] {
        let folder = Folder::new();
        folder.edit(file, old, &format!("name = \"{forged}\""));
        let run = folder.run(&["plan", "scene.toml", "--max-work", "1"]);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains("V004") && !run.err.lines().any(|line| line.starts_with("check")), "{}", run.err);
    }
    // A file of such a name may be read; what is said of it stays one line.
    let folder = Folder::new();
    let name = "a\ncheck  ACCEPTED.toml";
    folder.write(name, std::fs::read_to_string(folder.path("scene.toml")).unwrap());
    let run = folder.run(&["plan", name, "--max-work", "20000", "-o", "b\ncheck  ACCEPTED   forged.json"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let verdicts: Vec<&str> = run.err.lines().filter(|line| line.starts_with("check  ACCEPTED")).collect();
    assert!(verdicts.len() == 1 && verdicts[0].contains("waypoints"), "{}", run.err);
}

#[test]
fn a_time_limit_holds_for_reading_too() {
    let folder = Folder::new();
    folder.write("mug.obj", super::TETRAHEDRON);
    folder.edit("scene.toml", "sphere = { radius = 0.032 }", "mesh = { file = \"mug.obj\" }");
    let run = folder.run(&["plan", "scene.toml", "--time-limit", "1e-9"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("NO PLAN within the time limit") && run.err.contains("was read"), "{}", run.err);
}
