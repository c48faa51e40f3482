//! What the commands do when all is well, and how they end when they are stopped.

use crate::folder::{Folder, Run};
use crate::places::{repository, shared_models};
use serde_json::Value;
use std::process::Command;
use std::time::{Duration, Instant};

#[test]
fn help_and_version_say_what_they_should() {
    let folder = Folder::new();
    let help = folder.run(&["--help"]);
    assert_eq!(help.code, Some(0));
    for word in [
        "demo",
        "inspect",
        "place",
        "plan",
        "check",
        "view",
        "export",
        "bench",
        "growth",
        "roadmap",
        "--package",
        "--json",
        "--quiet",
        "--lenient",
    ] {
        assert!(help.out.contains(word), "{word} is missing:\n{}", help.out);
    }
    assert_eq!(folder.run(&["--version"]).out.trim(), concat!("regrasp ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn the_readme_names_only_commands_that_exist() {
    let readme = std::fs::read_to_string(repository().join("README.md")).unwrap();
    let known = ["demo", "inspect", "place", "plan", "grasps", "check", "view", "export", "bench", "growth", "roadmap"];
    for line in readme.lines().filter_map(|line| line.trim().strip_prefix("regrasp ")) {
        let command = line.split(' ').next().unwrap_or_default();
        assert!(known.contains(&command), "README.md: regrasp {line}");
    }
}

#[test]
fn the_demo_needs_no_files_and_its_plan_is_accepted_again() {
    let folder = Folder::new();
    let demo = folder.run(&["demo", "-o", "somewhere/else"]);
    assert_eq!(demo.code, Some(0), "{demo:?}");
    assert!(demo.out.is_empty());
    assert!((8..=12).contains(&demo.err.lines().count()), "about ten lines:\n{}", demo.err);
    assert!(demo.err.contains("ACCEPTED") && demo.err.contains("sha256"), "{}", demo.err);
    let check = folder.run(&["check", "somewhere/else/plan.json"]);
    assert_eq!(check.code, Some(0), "{check:?}");
    assert!(check.err.contains("ACCEPTED"), "{}", check.err);
    let chart = std::fs::read_to_string(folder.path("somewhere/else/gait.svg")).unwrap();
    assert!(chart.starts_with("<svg ") && chart.trim_end().ends_with("</svg>"), "{chart}");
    for finger in ["east", "north", "west", "south"] {
        assert!(chart.contains(&format!(">{finger}</text>")), "{finger} has no row");
    }
}

/// The same sha256 of `plan.json` on 1, 2 and 8 threads.
#[test]
fn the_number_of_threads_does_not_change_a_byte() {
    let folder = Folder::new();
    for scene in ["sphere_90x", "sphere_180z", "box_90x", "tight_sphere_180z"] {
        let scene = repository().join(format!("scenes/{scene}.toml"));
        for seed in ["0", "1", "2"] {
            let plans = ["1", "2", "8"].map(|threads| {
                let scene = scene.to_str().unwrap();
                let run = folder.run(&["plan", scene, "--seed", seed, "--threads", threads, "-o", "plan.json"]);
                assert_eq!(run.code, Some(0), "{run:?}");
                std::fs::read(folder.path("plan.json")).unwrap()
            });
            assert!(plans[0] == plans[1] && plans[0] == plans[2], "{} seed {seed}", scene.display());
        }
    }
}

#[test]
fn without_an_output_file_the_plan_goes_to_stdout_and_only_the_plan() {
    let folder = Folder::new();
    let to_file = folder.run(&["plan", "scene.toml", "--seed", "3", "-o", "plan.json"]);
    assert_eq!((to_file.code, to_file.out.as_str()), (Some(0), ""));
    let to_stdout = folder.run(&["plan", "scene.toml", "--seed", "3", "--quiet"]);
    assert_eq!((to_stdout.code, to_stdout.err.as_str()), (Some(0), ""));
    assert_eq!(to_stdout.out.as_bytes(), std::fs::read(folder.path("plan.json")).unwrap());
}

#[test]
fn json_is_one_object_per_line_and_the_last_is_the_exit_code() {
    let folder = Folder::new();
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--json"]);
    assert_eq!((run.code, run.err.as_str()), (Some(0), ""));
    let events: Vec<Value> = run.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let names: Vec<&str> = events.iter().map(|event| event["event"].as_str().unwrap()).collect();
    for name in ["loaded", "query", "plan", "check", "written"] {
        assert!(names.contains(&name), "{name} is missing in {names:?}");
    }
    assert_eq!(events.last().unwrap()["exit_code"], 0);
    let written = events.iter().find(|event| event["event"] == "written").unwrap();
    let bytes = std::fs::read(folder.path("plan.json")).unwrap();
    assert_eq!(written["sha256"], regrasp::base::files::sha256(&bytes));

    let refused = folder.run(&["plan", "scene.toml", "--threads", "0", "--json"]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.out.lines().all(|line| serde_json::from_str::<Value>(line).is_ok()), "{}", refused.out);
}

#[test]
fn no_plan_is_exit_code_1_with_causes_and_nothing_written() {
    let folder = Folder::new();
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--max-work", "2000", "--margin", "0.9"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("NO PLAN within the work allowed (not a proof)"), "{}", run.err);
    assert!(!folder.path("plan.json").exists());
}

/// A check with limits says what they cut, and does not accept the plan.
#[test]
fn limits_of_a_check_cut_it() {
    let folder = Folder::new();
    assert_eq!(folder.run(&["plan", "scene.toml", "-o", "plan.json"]).code, Some(0));
    let cut = folder.run(&["check", "plan.json", "--max-work", "10"]);
    assert_eq!(cut.code, Some(1), "{cut:?}");
    assert!(cut.err.contains("REJECTED") && cut.err.contains("after 10 units of work"), "{cut:?}");
    // Reading obeys the time limit too: either ends the command.
    let late = folder.run(&["check", "plan.json", "--time-limit", "0.000001"]);
    let (said, both) = (late.code, format!("{}{}", late.out, late.err));
    assert!(matches!(said, Some(1 | 2)) && both.contains("time limit"), "{late:?}");
    let limits = ["--max-work", "20000000", "--time-limit", "600"];
    assert_eq!(folder.run(&[&["check", "plan.json"], limits.as_slice()].concat()).code, Some(0));
}

/// A plan that is broken after it was written is rejected, with kind and place.
#[test]
fn a_broken_plan_is_rejected_with_exit_code_1() {
    let folder = Folder::new();
    assert_eq!(folder.run(&["plan", "scene.toml", "-o", "plan.json"]).code, Some(0));
    let text = std::fs::read_to_string(folder.path("plan.json")).unwrap();
    let mut plan: Value = serde_json::from_str(&text).unwrap();
    let joint = &mut plan["segments"][0]["waypoints"][1]["joints"][2];
    *joint = Value::from(joint.as_f64().unwrap() + 0.02);
    folder.write("broken.json", plan.to_string());
    let run = folder.run(&["check", "broken.json"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("REJECTED") && run.err.contains("ContactOffTip at segment 0"), "{}", run.err);

    // Another scene under the same name: the hash tells.
    folder.edit("scene.toml", "friction = 0.8", "friction = 0.79");
    let run = folder.run(&["check", "plan.json"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("InputHashMismatch"), "{}", run.err);
}

/// Ctrl-C ends a search within 100 ms with exit code 130. The best of three counts: the machine may be busy.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_search_at_once() {
    let folder = Folder::new();
    let scene = repository().join("scenes/tight_box_90x.toml");
    let mut fastest = Duration::MAX;
    for _ in 0..3 {
        let arguments =
            ["bench", scene.to_str().unwrap(), "--seeds", "1000000", "--quiet", "--no-check", "--csv", "rows.csv"];
        let mut child = folder.command(&arguments).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(600));
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was interrupted");
        let asked = Instant::now();
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130));
        fastest = fastest.min(asked.elapsed());
        let rows = std::fs::read_to_string(folder.path("rows.csv.partial")).unwrap();
        assert!(rows.starts_with("scene,method,seed,status,"), "{rows}");
        assert!(!folder.path("rows.csv").exists());
    }
    assert!(fastest < Duration::from_millis(100), "{fastest:?}");
}

#[test]
fn bench_writes_rows_and_the_page_is_made_of_them() {
    let folder = Folder::new();
    let run = folder.run(&["bench", "scene.toml", "--seeds", "3", "--csv", "out/rows.csv", "--time-limit", "60"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.out.contains("3/3"), "{}", run.out);
    let rows = std::fs::read_to_string(folder.path("out/rows.csv")).unwrap();
    assert_eq!(rows.lines().count(), 4);
    for column in [
        "scene",
        "method",
        "seed",
        "status",
        "plan_s",
        "floor_s",
        "check_s",
        "accepted",
        "nodes",
        "samples",
        "transfers",
        "relocations",
        "min_margin",
        "min_clearance",
    ] {
        assert!(rows.lines().next().unwrap().split(',').any(|name| name == column), "{column} is missing");
    }
    folder.write("limits.json", "{ \"scene\": 3600 }");
    for page in ["one.md", "two.md"] {
        let run = folder.run(&["bench", "--page", page, "--limits", "limits.json", "out/rows.csv"]);
        assert_eq!(run.code, Some(0), "{run:?}");
    }
    let page = std::fs::read_to_string(folder.path("one.md")).unwrap();
    assert!(page.contains("| scene | gait | 3/3 | 3/3 (3600 s) | 3/3 |"), "{page}");
    assert_eq!(page, std::fs::read_to_string(folder.path("two.md")).unwrap());
}

#[test]
fn seeds_planned_at_the_same_time_give_the_same_rows_in_the_same_order() {
    let folder = Folder::new();
    let rows = |n_at_once: &str| -> Vec<String> {
        let run = folder.run(&["bench", "scene.toml", "--seeds", "5", "--at-once", n_at_once, "--csv", "rows.csv"]);
        assert_eq!(run.code, Some(0), "{run:?}");
        let text = std::fs::read_to_string(folder.path("rows.csv")).unwrap();
        let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let is_time: Vec<bool> = names.iter().map(|name| name.ends_with("_s")).collect();
        let without_times = |line: &str| {
            let fields = line.split(',').zip(&is_time).filter(|(_, is_time)| !**is_time).map(|(field, _)| field);
            fields.collect::<Vec<_>>().join(",")
        };
        text.lines().map(without_times).collect()
    };
    let one = rows("1");
    assert_eq!(one.len(), 6, "{one:?}");
    assert_eq!(one, rows("3"));
    let refused = folder.run(&["bench", "scene.toml", "--at-once", "0"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
}

#[test]
fn a_plan_is_improved_by_work_or_by_time_and_says_which() {
    let folder = Folder::new();
    let plan = |arguments: &[&str]| {
        let run = folder.run(&[&["plan", "scene.toml", "-o", "plan.json"], arguments].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
        let text = std::fs::read_to_string(folder.path("plan.json")).unwrap();
        (run, serde_json::from_str::<serde_json::Value>(&text).unwrap())
    };
    let (run, by_work) = plan(&["--improve-work", "30000", "--threads", "1"]);
    assert!(run.err.contains("better ") && run.err.contains(" instead of "), "{}", run.err);
    assert_eq!(by_work, plan(&["--improve-work", "30000", "--threads", "3"]).1);
    assert_eq!(by_work["settings"]["improve_work"], 30_000);
    assert_eq!(by_work["statistics"]["cut_by_time"], false);
    let (run, by_time) = plan(&["--improve", "0.2"]);
    assert_eq!(by_time["statistics"]["cut_by_time"], true, "{}", run.err);
    let cost = |plan: &serde_json::Value, which: &str| {
        plan["statistics"]["improvement"][which]["cost"].as_f64().expect("a cost")
    };
    for plan in [&by_work, &by_time] {
        assert!(cost(plan, "improved") <= cost(plan, "first"));
    }
    let (run, plain) = plan(&[]);
    assert!(plain["statistics"].get("improvement").is_none() && !run.err.contains("better "));
}

#[test]
fn bench_compares_first_and_improved_plans() {
    let folder = Folder::new();
    let run = folder.run(&["bench", "scene.toml", "--seeds", "2", "--csv", "rows.csv", "--improve-work", "20000"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.out.contains("relocations") && run.out.contains("2/2"), "{}", run.out);
    let run = folder.run(&["bench", "--page", "page.md", "rows.csv"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let page = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(page.contains("## Improvement\n") && page.contains("| scene | 2/2 | 2/2 |"), "{page}");
}

#[test]
fn inspect_writes_a_hand_file_that_plans() {
    let folder = Folder::new();
    let run = folder.run(&["inspect", "hand.urdf", "-o", "guessed.toml", "--samples", "200"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    for word in ["east_abduction", "revolute", "4 fingers", "ball of radius 5.0 mm"] {
        assert!(run.out.contains(word), "{word} is missing:\n{}", run.out);
    }
    assert!(!run.out.contains("never change its grasp"), "{}", run.out);
    folder.edit("scene.toml", "hand.toml", "guessed.toml");
    let plan = folder.run(&["plan", "scene.toml", "-o", "plan.json"]);
    assert_eq!(plan.code, Some(0), "{plan:?}");
}

/// Hands that nobody here made: Allegro plans; three hard fingers, which can never change their grasp, are refused with the
/// reason, and turn an object by a transfer alone where that is asked for and enough.
#[test]
fn real_hands() {
    let Some(models) = shared_models() else { return };
    let package = format!("models={}", models.display());
    let folder = Folder::new();
    let scene = |name: &str| repository().join(format!("scenes/{name}.toml")).to_str().unwrap().to_owned();
    let allegro = scene("allegro/sphere32_x");
    let plan = folder.run(&["plan", &allegro, "--package", &package, "-o", "plan.json", "--time-limit", "120"]);
    assert_eq!(plan.code, Some(0), "{plan:?}");
    let check = folder.run(&["check", "plan.json", "--scene", &allegro, "--package", &package]);
    assert_eq!(check.code, Some(0), "{check:?}");
    let dclaw = models.join("hands/dclaw/dclaw.urdf");
    let run = folder.run(&["inspect", dclaw.to_str().unwrap(), "--package", &package, "--samples", "200"]);
    for words in ["it can never change its grasp: it has 3 fingers", "three points cannot", "--torsion-radius 0.005"] {
        assert!(run.out.contains(words), "{words} is missing: {}", run.out);
    }
    let started = Instant::now();
    for hand in ["dclaw", "trifinger"] {
        let scene = scene(&format!("{hand}/sphere32_z"));
        let run = folder.run(&["plan", &scene, "--package", &package, "-o", "none.json"]);
        assert_eq!(run.code, Some(1), "{run:?}");
        for words in ["impossible with this hand", "three points cannot", "can never change its grasp"] {
            assert!(run.err.contains(words), "{words} is missing: {}", run.err);
        }
    }
    assert!(started.elapsed() < Duration::from_secs(20), "refused only after {:?}", started.elapsed());
    assert!(!folder.path("none.json").exists());
    // Asked for, it is tried; here a transfer alone is enough.
    folder.write("alone.json", "{ \"transfers_alone\": true }");
    let one = scene("trifinger/sphere32_z");
    let run = folder.run(&["plan", &one, "--package", &package, "--settings", "alone.json", "-o", "one.json"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.err.contains("1 transfer, 0 relocations"), "{}", run.err);
    // Without the package the message names the flag.
    let run = folder.run(&["plan", &allegro]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("--package models=DIR"), "{}", run.err);
    // The environment names it too.
    let parent = models.parent().unwrap();
    let output = folder.command(&["inspect", &scene_hand(), "--samples", "1"]).env("ROS_PACKAGE_PATH", parent).output();
    assert_eq!(Run::of(output.unwrap()).code, Some(0));
}

fn scene_hand() -> String {
    repository().join("assets/hands/allegro_right/hand.toml").to_str().unwrap().to_owned()
}
