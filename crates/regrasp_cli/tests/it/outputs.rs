//! What is written is not lost: two outputs are two files, a failed write is a failure, links and permissions stay.

use crate::bad_input::complains;
use crate::folder::{Folder, Run};
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::Stdio;

/// The file of the first argument is the file of the second, in all the ways in which it can be.
#[test]
fn two_outputs_to_one_file_are_refused_however_they_are_spelled() {
    let folder = Folder::planned();
    fs::write(folder.path("there"), "x").unwrap();
    fs::hard_link(folder.path("there"), folder.path("hard")).unwrap();
    symlink("there", folder.path("soft")).unwrap();
    symlink("new", folder.path("dangling")).unwrap();
    symlink(".", folder.path("here")).unwrap();
    fs::create_dir(folder.path("sub")).unwrap();
    let absolute = folder.path("new").to_str().unwrap().to_owned();
    let pairs = [
        ("new", "new"),
        ("new", "./new"),
        ("new", "sub/../new"),
        ("new", "here/new"),
        ("new", absolute.as_str()),
        ("dangling", "new"),
        ("there", "hard"),
        ("soft", "hard"),
    ];
    let commands: [(&[&str], &str, &str); 6] = [
        (&["plan", "scene.toml"], "-o", "--report"),
        (&["view", "plan.json", "scene.toml"], "-o", "--story"),
        (&["view", "plan.json", "scene.toml"], "-o", "--png"),
        (&["view", "plan.json", "scene.toml"], "--story", "--png"),
        (&["export", "plan.json"], "--npz", "--ros2"),
        (&["export", "plan.json"], "--ros2", "--mjcf"),
    ];
    for (first, second) in pairs {
        for (command, one, other) in commands {
            let run = folder.run(&[command, &[one, first, other, second]].concat());
            complains(&run, "A505", "command line", &["the file that", "writes to"]);
        }
    }
    // Files that a flag does not name are outputs as well.
    let beside: [&[&str]; 4] = [
        &["plan", "scene.toml", "-o", "new", "--report", "new.rejected.json"],
        &["plan", "scene.toml", "-o", "sub/causes.svg", "--failure", "here/sub"],
        &["view", "plan.json", "scene.toml", "-o", "sub/gait.svg", "--svg", "sub"],
        &["roadmap", "bench", "none.roadmap", "scene.toml", "--csv", "rows", "--graph", "./rows.partial"],
    ];
    for arguments in beside {
        complains(&folder.run(arguments), "A505", "command line", &["the file that", "writes to"]);
    }
    assert_eq!(fs::read_to_string(folder.path("there")).unwrap(), "x");
    assert!(!folder.path("new").exists());
    // Different files are different.
    let run = folder.run(&["plan", "scene.toml", "-o", "new", "--report", "sub/new"]);
    assert_eq!(run.code, Some(0), "{run:?}");
}

#[test]
fn inputs_are_not_written_over_by_any_of_their_names() {
    let folder = Folder::planned();
    fs::hard_link(folder.path("scene.toml"), folder.path("hard")).unwrap();
    symlink("hand.urdf", folder.path("soft")).unwrap();
    fs::write(folder.path("settings.json"), "{}").unwrap();
    let runs: [(&[&str], &str); 6] = [
        (&["plan", "scene.toml", "-o", "hard"], "hard"),
        (&["plan", "scene.toml", "-o", "plan.json", "--report", "soft"], "soft"),
        (&["bench", "scene.toml", "--seeds", "1", "--csv", "hand.urdf"], "hand.urdf"),
        (&["bench", "scene.toml", "--seeds", "1", "--csv", "s", "--settings", "s.partial"], "s.partial"),
        (&["roadmap", "build", "scene.toml", "-o", "hand.toml"], "hand.toml"),
        (
            &["roadmap", "build", "scene.toml", "--settings", "settings.json", "-o", "./settings.json"],
            "./settings.json",
        ),
    ];
    fs::write(folder.path("s.partial"), "{}").unwrap();
    for (arguments, file) in runs {
        complains(&folder.run(arguments), "F003", file, &["an input of this command"]);
    }
}

#[test]
fn a_folder_that_is_a_file_is_found_before_the_search() {
    let folder = Folder::new();
    fs::write(folder.path("file"), "x").unwrap();
    for name in ["file", "file/below", "scene.toml"] {
        let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--failure", name]);
        complains(&run, "F003", name, &["cannot be written"]);
        assert!(!run.err.contains("query"), "before the search: {}", run.err);
    }
    assert!(!folder.path("plan.json").exists());
}

/// Runs with stdout at a file that is always full, and with one whose reader is gone.
fn with_lost_stdout(folder: &Folder, arguments: &[&str]) -> [Run; 2] {
    let full = fs::File::options().write(true).open("/dev/full").expect("Linux");
    let to_full = Run::of(folder.command(arguments).stdout(Stdio::from(full)).output().unwrap());
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    [to_full, Run::of(folder.command(arguments).stdout(writer).output().unwrap())]
}

/// No result that nobody got is a good one.
#[test]
fn a_failed_write_to_stdout_is_no_success() {
    let folder = Folder::planned();
    let commands: [&[&str]; 9] = [
        &["plan", "scene.toml"],
        &["plan", "scene.toml", "--json"],
        &["plan", "scene.toml", "--quiet"],
        &["check", "plan.json", "--json"],
        &["export", "plan.json", "--npz", "a.npz", "--json"],
        &["inspect", "hand.urdf", "--samples", "10"],
        &["bench", "scene.toml", "--seeds", "1"],
        &["bench", "scene.toml", "--seeds", "1", "--json"],
        &["--help"],
    ];
    for arguments in commands {
        for run in with_lost_stdout(&folder, arguments) {
            assert_eq!(run.code, Some(2), "{arguments:?}: {run:?}");
            assert!(run.err.contains("F003 stdout: cannot be written"), "{arguments:?}: {}", run.err);
            assert!(
                !run.err.contains("panicked") && !run.err.contains("folder that exists"),
                "{arguments:?}: {}",
                run.err
            );
        }
    }
    let [full, gone] = with_lost_stdout(&folder, &["plan", "scene.toml"]);
    assert!(full.err.contains("fix: make room on the disk"), "{}", full.err);
    assert!(gone.err.contains("fix: let the program that reads the output read all of it"), "{}", gone.err);
}

#[test]
fn links_and_permissions_of_outputs_stay_and_read_only_files_are_refused() {
    let folder = Folder::new();
    let plan = |output: &str| folder.run(&["plan", "scene.toml", "-o", output, "--quiet"]);
    fs::write(folder.path("private"), "x").unwrap();
    fs::set_permissions(folder.path("private"), fs::Permissions::from_mode(0o600)).unwrap();
    symlink("private", folder.path("link")).unwrap();
    assert_eq!(plan("link").code, Some(0));
    assert!(fs::symlink_metadata(folder.path("link")).unwrap().is_symlink());
    assert_eq!(fs::metadata(folder.path("private")).unwrap().permissions().mode() & 0o777, 0o600);
    assert!(fs::read_to_string(folder.path("private")).unwrap().contains("regrasp-plan"));
    fs::set_permissions(folder.path("private"), fs::Permissions::from_mode(0o444)).unwrap();
    let run = folder.run(&["plan", "scene.toml", "-o", "private"]);
    complains(&run, "F003", "private", &["cannot be written", "allow writing to it"]);
    assert!(!run.err.contains("query"), "before the search: {}", run.err);
}

/// The others are planned, the bad ones are listed at the end, and the exit code says so.
#[test]
fn one_bad_scene_does_not_end_a_bench() {
    let folder = Folder::new();
    fs::create_dir(folder.path("scenes")).unwrap();
    let scene = fs::read_to_string(folder.path("scene.toml")).unwrap().replace("hand.toml", "../hand.toml");
    fs::write(folder.path("scenes/a.toml"), scene.replace("radius = 0.032", "radius = -1")).unwrap();
    fs::write(folder.path("scenes/b.toml"), &scene).unwrap();
    fs::write(folder.path("scenes/c.toml"), "format = 3").unwrap();
    let run = folder.run(&["bench", "scenes", "--seeds", "2", "--csv", "rows.csv"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.out.contains("2/2"), "{}", run.out);
    assert_eq!(fs::read_to_string(folder.path("rows.csv")).unwrap().lines().count(), 3);
    let told = run.err.split("2 of 3 scenes could not be read").nth(1).unwrap_or_default();
    assert!(told.contains("a.toml") && told.contains("c.toml") && !told.contains("b.toml"), "{}", run.err);
    let json = folder.run(&["bench", "scenes", "--seeds", "1", "--json"]);
    assert_eq!((json.code, json.out.matches("\"event\":\"left_out\"").count()), (Some(2), 2), "{json:?}");
    let none = folder.run(&["bench", "scenes/a.toml", "scenes/c.toml"]);
    assert_eq!(none.code, Some(2), "{none:?}");
}

/// Names and times that no format holds are refused with a code, and no file is written.
#[test]
fn what_a_format_cannot_hold_is_not_exported() {
    let folder = Folder::planned();
    let mut plan: serde_json::Value = serde_json::from_slice(&fs::read(folder.path("plan.json")).unwrap()).unwrap();
    for segment in plan["segments"].as_array_mut().unwrap() {
        for waypoint in segment["waypoints"].as_array_mut().unwrap() {
            waypoint["time"] = serde_json::Value::from(100.0 - waypoint["time"].as_f64().unwrap());
        }
    }
    folder.write("odd.json", plan.to_string());
    let export = |format: &str| folder.run(&["export", "odd.json", "--no-check", format, "out"]);
    complains(&export("--ros2"), "C421", "odd.json", &["segment 0, waypoint 1 is at", "after a waypoint at 100"]);
    // A name that would need gigabytes is refused by the reader.
    plan["hands"][0]["joint_names"][0] = serde_json::Value::from("j".repeat(1_000_000));
    folder.write("odd.json", plan.to_string());
    complains(&export("--npz"), "V004", "odd.json", &["the name has 1,000,000 characters"]);
    assert!(!folder.path("out").exists());
}

/// `view` has no `--scene`: its advice says how to name one.
#[test]
fn a_plan_without_its_scene_is_told_how_to_name_one() {
    let folder = Folder::planned();
    fs::create_dir(folder.path("deep")).unwrap();
    fs::rename(folder.path("scene.toml"), folder.path("deep/other.toml")).unwrap();
    let view = folder.run(&["view", "plan.json", "-o", "page.html"]);
    complains(&view, "C420", "plan.json", &["name the scene file: regrasp view PLAN SCENE"]);
    let check = folder.run(&["check", "plan.json"]);
    complains(&check, "C420", "plan.json", &["name the scene file: --scene FILE"]);
}

/// A page in a file that is named as a picture opens in no viewer.
#[test]
fn pages_are_not_written_into_pictures() {
    let folder = Folder::planned();
    complains(
        &folder.run(&["view", "plan.json", "-o", "page.PNG"]),
        "A505",
        "--output",
        &["page.PNG", "--png FILE.png"],
    );
    assert!(!folder.path("page.PNG").exists());
}

/// Advice is about what was short, and words about what they are of.
#[test]
fn words_say_what_is_meant() {
    let folder = Folder::planned();
    let none = folder.run(&["plan", "scene.toml", "--max-work", "0", "-o", "none.json"]);
    assert_eq!(none.code, Some(1), "{none:?}");
    assert!(none.err.contains("allow more work") && !none.err.contains("more time"), "{}", none.err);
    let plan = folder.run(&["plan", "scene.toml", "-o", "again.json"]);
    assert!(plan.err.contains("closure margin at least") && plan.err.contains("(exact cones)"), "{}", plan.err);
}
