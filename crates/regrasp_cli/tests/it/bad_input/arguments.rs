//! Arguments, settings and outputs.

use super::{FIRST_LIMIT, complains};
use crate::folder::Folder;

#[test]
fn output_that_cannot_be_written_is_refused_before_planning() {
    let folder = Folder::new();
    let run = folder.run(&["plan", "scene.toml", "-o", "missing/plan.json"]);
    complains(&run, "F003", "missing/plan.json", &["cannot be written", "fix:"]);
    assert!(!run.err.contains("query"), "planning had begun:\n{}", run.err);
}

#[test]
fn arguments_that_make_no_sense() {
    let folder = Folder::new();
    for (arguments, says) in [
        (["--threads", "0"], "between 1 and"),
        (["--threads", "100000"], "between 1 and"),
        (["--time-limit", "0"], "seconds"),
        (["--time-limit", "-3"], "seconds"),
        (["--time-limit", "inf"], "seconds"),
        (["--improve", "0"], "seconds"),
        (["--improve", "-1"], "seconds"),
        (["--improve", "NaN"], "seconds"),
        (["--improve-work", "1.5"], "whole number"),
        (["--improve-work", "-1"], "whole number"),
        (["--margin", "1.5"], "[0, 1)"),
        (["--method", "clasic"], "classic"),
        (["--package", "allegro"], "NAME=DIR"),
    ] {
        // With = so that a negative number is a value and not a flag.
        let joined = arguments.join("=");
        let run = folder.run(&["plan", "scene.toml", &joined]);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(says) && run.err.contains(arguments[1]), "{}", run.err);
    }
}

#[test]
fn weights_of_a_cost_that_make_no_sense() {
    let folder = Folder::new();
    for (settings, says) in [
        ("{ \"cost\": { \"relocation\": -1.0 } }", "cost.relocation is -1"),
        ("{ \"cost\": { \"margin\": 1e300 } }", "cost.margin is"),
        ("{ \"cost\": { \"relocations\": 1.0 } }", "relocations"),
        ("{ \"improve_work\": -1 }", "-1"),
    ] {
        folder.write("settings.json", settings);
        let run = folder.run(&["plan", "scene.toml", "--settings", "settings.json"]);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(says) && run.err.contains("settings.json"), "{}", run.err);
    }
}

/// Several causes in several files: all of them in one run.
#[test]
fn all_causes_are_reported_in_one_run() {
    let folder = Folder::new();
    folder.edit("hand.urdf", FIRST_LIMIT, "");
    folder.edit("scene.toml", "mass = 0.1", "mass = -1.0");
    folder.edit("scene.toml", "friction = 0.8", "friction = nan");
    let run = folder.run(&["plan", "scene.toml", "--json"]);
    assert_eq!(run.code, Some(2));
    for code in ["U120", "S107", "V001"] {
        assert!(run.err.contains(code), "{code} is missing:\n{}", run.err);
        assert!(run.out.contains(&format!("\"code\":\"{code}\"")), "{}", run.out);
    }
    assert!(run.out.ends_with("{\"event\":\"result\",\"exit_code\":2}\n"), "{}", run.out);
}

#[test]
fn output_that_is_a_folder_or_no_file() {
    let folder = Folder::new();
    complains(&folder.run(&["plan", "scene.toml", "-o", "."]), "F003", ".", &["cannot be written"]);
    for device in ["/dev/null", "/dev/stdout"] {
        if std::path::Path::new(device).exists() {
            let run = folder.run(&["plan", "scene.toml", "-o", device]);
            complains(&run, "F003", device, &["not a regular file"]);
        }
    }
}

/// No command writes over what it reads.
#[test]
fn output_that_is_an_input() {
    let folder = Folder::new();
    folder.write("settings.json", "{}");
    for output in ["scene.toml", "hand.toml", "./hand.urdf", "settings.json"] {
        let run = folder.run(&["plan", "scene.toml", "--settings", "settings.json", "-o", output]);
        complains(&run, "F003", output, &["an input of this command"]);
    }
    let run = folder.run(&["inspect", "hand.urdf", "--samples", "1", "-o", "hand.urdf"]);
    complains(&run, "F003", "hand.urdf", &["an input of this command"]);
    let run = folder.run(&["bench", "scene.toml", "--seeds", "1", "--csv", "scene.toml"]);
    complains(&run, "F003", "scene.toml", &["an input of this command"]);
    assert!(std::fs::read_to_string(folder.path("scene.toml")).unwrap().starts_with("format = \"regrasp-scene\""));
    assert!(std::fs::read_to_string(folder.path("hand.urdf")).unwrap().starts_with("<?xml"));
}

#[test]
fn seed_below_zero_and_package_that_is_no_folder() {
    let folder = Folder::new();
    for (arguments, says) in [
        (["--seed", "-1"], "whole number"),
        (["--seed", "1.5"], "whole number"),
        (["--max-work", "1e6"], "whole number"),
        (["--package", "allegro=/no/such/folder"], "/no/such/folder is not a folder"),
    ] {
        let run = folder.run(&["plan", "scene.toml", arguments[0], arguments[1]]);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains(says) && run.err.contains(arguments[1]), "{}", run.err);
    }
}

#[test]
fn settings_that_make_no_sense() {
    let folder = Folder::new();
    for (text, code, place, says) in [
        ("[]", "A504", "settings.json:1", "is a list"),
        ("{ \"closure_margn\": 0.1 }", "A504", "settings.json:1", "closure_margn"),
        ("{\n \"closure_margin\": 1e999 }", "A504", "settings.json:2", "out of range"),
        ("{ \"closure_margin\": -1 }", "A503", "settings.json", "closure_margin is -1"),
        ("", "A504", "settings.json:1", "JSON object"),
    ] {
        folder.write("settings.json", text);
        let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--settings", "settings.json"]);
        complains(&run, code, place, &[says]);
    }
}

#[test]
fn benchmark_pages_of_what_is_no_benchmark() {
    let folder = Folder::new();
    let run = folder.run(&["bench", "--page", "page.md", "scene.toml"]);
    complains(&run, "V020", "scene.toml:1", &["columns", "--csv"]);
    folder.write("limits.json", "{ \"cube\": -1 }");
    let run = folder.run(&["bench", "--page", "page.md", "--limits", "limits.json", "rows.csv"]);
    complains(&run, "V023", "limits.json", &["cube", "-1", "seconds above 0"]);
    let run = folder.run(&["bench", "--page", "page.md", "rows.csv"]);
    complains(&run, "F001", "rows.csv", &["cannot be read"]);
    assert!(!folder.path("page.md").exists());
}

/// Each kind of task has its methods; one of the other kind is no synonym for the default.
#[test]
fn methods_of_another_kind_of_task() {
    let folder = Folder::new();
    let run = folder.run(&["plan", "scene.toml", "--method", "tracking+gaiting"]);
    complains(&run, "A507", "--method", &["tracking+gaiting", "gait", "visibility"]);
    let wide = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/tracking_sphere_wide.toml");
    let run = folder.run(&["plan", wide, "--method", "visibility"]);
    complains(&run, "A507", "--method", &["visibility", "tracking+gaiting"]);
}
