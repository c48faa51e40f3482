//! `regrasp roadmap` from outside: build, ask, grow, and writes that are cut off.

use crate::folder::{Folder, Run};
use crate::roadmap_file::ROADMAP;
use serde_json::Value;

/// A folder with a graph that answers the folder's scene.
fn folder_with_graph() -> Folder {
    let folder = Folder::new();
    folder.write("build.json", r#"{ "places": 40, "grasps": 40, "neighbours": 12 }"#);
    let run = folder.run(&[
        "roadmap",
        "build",
        "scene.toml",
        "-o",
        "a.roadmap",
        "--build-settings",
        "build.json",
        "--within",
        "0.005",
        "--seed",
        "1",
    ]);
    assert_eq!(run.code, Some(0), "{run:?}");
    folder
}

/// Asks with `--json`; the run and the work that the plan says it took.
fn ask(folder: &Folder, more: &[&str]) -> (Run, u64) {
    let mut arguments =
        vec!["roadmap", "query", "a.roadmap", "scene.toml", "-o", "plan.json", "--json", "--level", "forces"];
    arguments.extend(more);
    let run = folder.run(&arguments);
    assert_eq!(run.code, Some(0), "{run:?}");
    let events = run.out.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut work =
        events.filter(|event| event["event"] == "plan").map(|plan| plan["statistics"]["work"].as_u64().unwrap());
    let work = work.next_back().expect("a plan");
    (run, work)
}

fn info(folder: &Folder) -> Value {
    let run = folder.run(&["roadmap", "info", "a.roadmap", "--json"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    serde_json::from_str(run.out.lines().next().unwrap()).unwrap()
}

#[test]
fn a_graph_grows_by_what_is_asked_and_later_queries_use_it() {
    let folder = folder_with_graph();
    let graph = || std::fs::read(folder.path("a.roadmap")).unwrap();
    let built = graph();
    let (_, first) = ask(&folder, &[]);
    assert!(graph() == built, "a query changes the file though it was not asked to");
    let (_, growing) = ask(&folder, &["--grow"]);
    assert_eq!(growing, first);
    let (before, after) = (GraphSize::of(&built), info(&folder));
    assert_eq!(after["about"]["n_grown"], 1);
    assert!(after["census"]["places"].as_u64().unwrap() >= before.places + 2, "{after}");
    let (_, later) = ask(&folder, &[]);
    // What is proven anew, because fingertips roll, costs work again.
    assert!(later < first, "{later} of {first} configurations looked at");
    assert_eq!(folder.run(&["check", "plan.json", "--level", "forces"]).code, Some(0));
    // Smoothing costs work and is still right.
    let (_, smooth) = ask(&folder, &["--smooth"]);
    assert!(smooth >= later);
    assert_eq!(folder.run(&["check", "plan.json", "--level", "forces"]).code, Some(0));
}

/// Numbers in the header of a file.
struct GraphSize {
    places: u64,
}

impl GraphSize {
    fn of(bytes: &[u8]) -> Self {
        GraphSize { places: u64::from_le_bytes(bytes[40..48].try_into().unwrap()) }
    }
}

/// Writes are cut off by a limit of the system on the size of files: the program is killed while it writes, or told that
/// the disk is full.
#[cfg(unix)]
#[test]
fn a_write_that_is_cut_off_leaves_the_old_file_whole() {
    use std::process::{Command, Stdio};
    let folder = folder_with_graph();
    let old = std::fs::read(folder.path("a.roadmap")).unwrap();
    let limit = 64;
    assert!(old.len() > limit * 1024, "{} bytes are written before the limit stops it", old.len());
    let with_limit = |before: &str| {
        let program = env!("CARGO_BIN_EXE_regrasp");
        let script = format!(
            "{before} ulimit -f {limit}; exec \"{program}\" roadmap query a.roadmap scene.toml --grow --quiet --level forces"
        );
        let mut command = Command::new("sh");
        command.args(["-c", &script]).current_dir(folder.path("")).stdin(Stdio::null());
        Run::of(command.stdout(Stdio::piped()).stderr(Stdio::piped()).output().expect("there is a shell"))
    };
    let temporary = || -> Vec<u64> {
        let files = std::fs::read_dir(folder.path("")).unwrap().map(Result::unwrap);
        let parts = files.filter(|file| file.file_name().to_string_lossy().ends_with(".tmp"));
        parts.map(|file| file.metadata().unwrap().len()).collect()
    };

    // Killed in the middle of it: no exit code, and a part of the new file lies beside the old one.
    let killed = with_limit("");
    assert_eq!(killed.code, None, "{killed:?}");
    let left = temporary();
    assert!(left.len() == 1 && left[0] > 0 && left[0] < old.len() as u64, "{left:?}");
    assert!(std::fs::read(folder.path("a.roadmap")).unwrap() == old, "the old file was touched");

    // Told that there is no room: it says so and takes its part away.
    let refused = with_limit("trap '' XFSZ;");
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.err.contains("F003") && refused.err.contains("a.roadmap"), "{}", refused.err);
    assert_eq!(temporary(), left, "only what the killed one left is there");
    assert!(std::fs::read(folder.path("a.roadmap")).unwrap() == old, "the old file was touched");

    // What was left behind is in nobody's way.
    ask(&folder, &["--grow"]);
    assert_eq!(info(&folder)["about"]["n_grown"], 1);
}

/// Random queries of the folder's graph, with the arguments of `more`.
fn bench(folder: &Folder, more: &str) -> Run {
    let begin = ["roadmap", "bench", "a.roadmap", "scene.toml"];
    folder.run(&begin.into_iter().chain(more.split_whitespace()).collect::<Vec<_>>())
}

#[test]
fn a_bench_writes_rows_and_facts_that_the_page_takes() {
    let folder = folder_with_graph();
    let run = bench(&folder, "--queries 6 --single 6 --csv rows.csv --graph graph.json");
    assert_eq!(run.code, Some(0), "{run:?}");
    let page = folder.run(&["bench", "--page", "page.md", "rows.csv", "graph.json"]);
    assert_eq!(page.code, Some(0), "{page:?}");
    let text = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(text.contains("## Many queries, one roadmap") && text.contains("| rows.csv | 6 |"), "{text}");
    let census = &info(&folder)["census"];
    let facts = format!(
        "| scene | {} | {} | {} | {} |",
        census["places"], census["nodes"], census["transfers"], census["relocations"]
    );
    assert!(text.contains(&facts), "{facts} in {text}");
}

/// A graph keeps the margin that single searches ask for first, unless it connects too little.
#[test]
fn a_build_asks_for_a_large_margin_and_for_less_where_that_connects_little() {
    let margin = |folder: &Folder| info(folder)["about"]["settings"]["closure_margin"].as_f64().unwrap();
    let folder = folder_with_graph();
    assert_eq!(margin(&folder), 0.02);
    let build = |scene: &str, more: &[&str]| {
        let arguments =
            ["roadmap", "build", scene, "-o", "a.roadmap", "--build-settings", "build.json", "--within", "0.005"];
        let run = folder.run(&[&arguments, more].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
        run.out + &run.err
    };
    let said = build("scene.toml", &["--seed", "1", "--margin", "0.005"]);
    assert!(!said.contains("again"), "{said}");
    assert_eq!(margin(&folder), 0.005);
    // A hand of short reach: few places are connected with either margin, and the graph that connects more is kept.
    let tight = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/tight_box_90x.toml");
    let said = build(tight, &["--seed", "1", "--json"]);
    let events = said.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let again: Vec<Value> = events.filter(|event| event["event"] == "again").collect();
    assert_eq!(again.len(), 1, "{said}");
    let first = again[0]["covered"].as_f64().unwrap();
    assert!(first < 0.95 && again[0]["next_closure_margin"] == 0.005, "{again:?}");
    let census = &info(&folder)["census"];
    let kept = census["places_covered"].as_f64().unwrap() / census["places"].as_f64().unwrap();
    assert!(kept >= first && [0.02, 0.005].contains(&margin(&folder)), "{census}");
}

#[test]
fn a_bench_writes_plans_that_say_what_they_were_asked() {
    let folder = folder_with_graph();
    let run = bench(&folder, "--queries 3 --single 2 --plans plans");
    assert_eq!(run.code, Some(0), "{run:?}");
    let check =
        |plan: &str, more: &[&str]| folder.run(&[&["check", plan, "--scene", "scene.toml"], more].concat()).code;
    for plan in ["plans/roadmap/0.json", "plans/roadmap/2.json", "plans/single/1.json"] {
        assert_eq!(check(plan, &["--own-query"]), Some(0), "{plan}");
        assert_ne!(check(plan, &[]), Some(0), "{plan} is no answer to the scene's query");
    }
    let asked = |plan: &str| {
        let text = std::fs::read_to_string(folder.path(plan)).unwrap();
        let plan: serde_json::Value = serde_json::from_str(&text).unwrap();
        (plan["asked"]["start"].clone(), plan["asked"]["goal"].clone())
    };
    assert_eq!(asked("plans/roadmap/1.json"), asked("plans/single/1.json"), "the same query");
    assert_ne!(asked("plans/roadmap/0.json"), asked("plans/roadmap/1.json"));
    assert!(!folder.path("plans/single/2.json").exists(), "two were planned without the graph");

    folder.write("file", b"");
    let refused = bench(&folder, "--queries 1 --plans file");
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.err.contains("F003"), "{refused:?}");
}

#[test]
fn the_file_of_the_fuzz_seed_answers_too() {
    let folder = Folder::new();
    folder.write("a.roadmap", ROADMAP);
    assert!(ROADMAP.len() <= 4096, "the fuzzer cuts its inputs there");
    assert_eq!(folder.run(&["roadmap", "info", "a.roadmap"]).code, Some(0));
}
