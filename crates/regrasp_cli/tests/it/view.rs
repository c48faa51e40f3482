//! `regrasp view`, and the pages that other commands write. What a page says is tested in `regrasp_viewer`.

use crate::bad_input::complains;
use crate::folder::{Folder, Run};
use crate::places::repository;
use serde_json::Value;

/// What the page `name` was told.
fn story(folder: &Folder, name: &str) -> Value {
    let page = std::fs::read_to_string(folder.path(name)).unwrap();
    let (_, data) = page.split_once("<script type=\"application/json\" id=\"story\">").expect("a story");
    serde_json::from_str(data.split_once("</script>").expect("an end").0).expect("JSON")
}

fn fact(story: &Value, label: &str) -> String {
    let facts = story["facts"].as_array().unwrap();
    let found = facts.iter().find(|fact| fact[0] == label).unwrap_or_else(|| panic!("no {label} in {facts:?}"));
    found[1].as_str().unwrap().to_owned()
}

fn ends_with_page(run: &Run, name: &str) {
    let last = run.err.lines().rfind(|line| line.starts_with("page   ")).unwrap_or_else(|| panic!("{run:?}"));
    assert!(last.contains(name), "{last}");
}

#[test]
fn the_page_of_a_plan_has_the_plan_and_the_verdict() {
    let folder = Folder::planned();
    let run = folder.run(&["view", "plan.json", "-o", "plan.html", "--story", "story.json", "--title", "<b>A & B</b>"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    ends_with_page(&run, "plan.html");
    let told = story(&folder, "plan.html");
    let plan: Value = serde_json::from_slice(&std::fs::read(folder.path("plan.json")).unwrap()).unwrap();
    assert_eq!(told["plan"], plan);
    assert_eq!(told["title"], "<b>A & B</b>");
    assert!(fact(&told, "Checker").starts_with("ACCEPTED"));
    let alone: Value = serde_json::from_slice(&std::fs::read(folder.path("story.json")).unwrap()).unwrap();
    assert_eq!(alone, told);
    // The scene may be named; the same input, the same bytes.
    let again = folder.run(&["view", "plan.json", "scene.toml", "-o", "again.html", "--title", "<b>A & B</b>"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    assert_eq!(std::fs::read(folder.path("again.html")).unwrap(), std::fs::read(folder.path("plan.html")).unwrap());
}

#[test]
fn a_rejected_plan_has_a_page_that_says_so() {
    let folder = Folder::planned();
    folder.edit("scene.toml", "mass = 0.1", "mass = 0.2");
    let run = folder.run(&["view", "plan.json", "-o", "plan.html"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let told = story(&folder, "plan.html");
    assert!(fact(&told, "Checker").starts_with("REJECTED"));
    assert_eq!(told["judged"]["accepted"], false);
    assert!(!told["judged"]["violations"].as_array().unwrap().is_empty());
}

#[test]
fn plan_reports_success_and_failure() {
    let folder = Folder::new();
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--report", "report.html"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    ends_with_page(&run, "report.html");
    assert!(fact(&story(&folder, "report.html"), "Checker").starts_with("ACCEPTED"));

    // The start is fine, the goal is too far.
    let scene = repository().join("scenes/out_of_reach.toml");
    let arguments = ["plan", scene.to_str().unwrap(), "--max-work", "60000", "-o", "none.json", "--report", "why.html"];
    let run = folder.run(&arguments);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("NO PLAN") && !folder.path("none.json").exists(), "{}", run.err);
    ends_with_page(&run, "why.html");
    let told = story(&folder, "why.html");
    assert!(told["plan"].is_null() && told["judged"].is_null());
    assert!(!told["failure"]["causes"].as_array().unwrap().is_empty());
    assert!(!told["failure"]["advice"].as_str().unwrap().is_empty());
    let miss = &told["failure"]["nearest_miss"];
    assert!(miss["distance_left"].as_f64().unwrap() > 0.005, "{miss}");
    assert_eq!(miss["joints"].as_array().unwrap().len(), told["scene"]["hands"][0]["joints"].as_array().unwrap().len());
    assert_eq!(told["asked"].as_array().unwrap().len(), 2);
    // What was reached, with what hangs together.
    let nodes = told["roadmap"]["nodes"].as_array().unwrap();
    assert!(nodes.len() > 10 && !told["roadmap"]["edges"].as_array().unwrap().is_empty());
    assert_eq!(nodes[0]["component"], 0, "the start's");
    assert!(nodes.iter().any(|node| node["component"] != 0), "start and goal do not hang together");
    assert!(fact(&told, "Result").starts_with("NO PLAN"));
}

#[test]
fn the_demo_ends_with_the_path_of_its_page() {
    let folder = Folder::new();
    let run = folder.run(&["demo", "-o", "here"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.err.trim_end().lines().last().unwrap().contains("here/plan.html"), "{}", run.err);
    let told = story(&folder, "here/plan.html");
    assert_eq!(told["title"], "sphere_180z");
    assert!(std::fs::metadata(folder.path("here/plan.html")).unwrap().len() < 4_000_000);
}

#[test]
fn over_ssh_there_is_a_hint() {
    let folder = Folder::planned();
    let run = |ssh: bool| {
        let mut command = folder.command(&["view", "plan.json", "-o", "plan.html"]);
        match ssh {
            true => command.env("SSH_CONNECTION", "192.0.2.1 50000 192.0.2.2 22"),
            false => command.env_remove("SSH_CONNECTION"),
        };
        Run::of(command.output().unwrap()).err
    };
    assert!(run(true).contains("scp 192.0.2.2:") && !run(false).contains("scp"));
}

#[test]
fn the_graph_of_a_roadmap_is_shown_with_the_way_through_it() {
    let folder = Folder::planned();
    let build = ["roadmap", "build", "scene.toml", "-o", "a.roadmap", "--places", "12", "--angle", "30"];
    assert_eq!(folder.run(&build).code, Some(0));
    let run = folder.run(&["view", "plan.json", "-o", "plan.html", "--with-roadmap", "a.roadmap"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let told = story(&folder, "plan.html");
    let n_nodes = told["roadmap"]["nodes"].as_array().unwrap().len();
    assert!(n_nodes >= 2);
    for edge in told["roadmap"]["edges"].as_array().unwrap() {
        let ends: Vec<&Value> =
            (0..2).map(|k| &told["roadmap"]["nodes"][edge["nodes"][k].as_u64().unwrap() as usize]).collect();
        assert_eq!(ends[0]["component"], ends[1]["component"], "an edge joins components");
    }
    // A plan made on the graph goes through its nodes.
    let query =
        folder.run(&["roadmap", "query", "a.roadmap", "scene.toml", "-o", "on.json", "--grow", "--level", "forces"]);
    assert_eq!(query.code, Some(0), "{query:?}");
    assert_eq!(
        folder.run(&["view", "on.json", "-o", "on.html", "--with-roadmap", "a.roadmap", "--level", "forces"]).code,
        Some(0)
    );
    let told = story(&folder, "on.html");
    assert!(told["roadmap"]["solution"].as_array().unwrap().len() >= 2, "{}", told["roadmap"]["solution"]);
}

#[test]
fn files_that_cannot_be_read_or_written() {
    let folder = Folder::planned();
    let view = |arguments: &[&str]| folder.run(&[&["view"], arguments].concat());
    complains(&view(&["missing.json", "-o", "a.html"]), "F001", "missing.json", &["cannot be read"]);
    complains(&view(&["plan.json", "-o", "none/a.html"]), "F003", "none/a.html", &["cannot be written"]);
    for input in ["plan.json", "scene.toml", "hand.urdf"] {
        complains(&view(&["plan.json", "-o", input]), "F003", input, &["an input of this command"]);
    }
    complains(&view(&["plan.json", "-o", "a", "--story", "a"]), "A505", "--story", &["another file"]);
    complains(&view(&["plan.json", "-o", "a.html", "--with-roadmap", "plan.json"]), "R601", "plan.json", &[]);
    let run = view(&["plan.json"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    let run = folder.run(&["plan", "scene.toml", "-o", "a", "--report", "a"]);
    complains(&run, "A505", "--report", &["another file"]);
}

/// `text` with what means something in an attribute of XML escaped.
fn xml(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[test]
fn markup_in_files_and_their_names_stays_text() {
    let (link, finger, object) =
        ("</script><script>alert(1)</script>", "<img src=x onerror=alert(2)>", "<!--<script>]]>");
    let folder = Folder::new();
    let replaced = |name: &str, changes: &[(&str, String)]| {
        let mut text = std::fs::read_to_string(folder.path(name)).unwrap();
        for (old, new) in changes {
            assert!(text.contains(old), "{name} has no {old}");
            text = text.replace(old, new);
        }
        folder.write(name, text);
    };
    replaced("hand.urdf", &[("\"palm\"", format!("\"{}\"", xml(link)))]);
    replaced("hand.toml", &[("\"palm\"", format!("'{link}'")), ("name = \"north\"", format!("name = '{finger}'"))]);
    replaced("scene.toml", &[("\"ball\"", format!("'{object}'"))]);
    std::fs::rename(folder.path("scene.toml"), folder.path("<b onload=x>&.toml")).unwrap();
    let run = folder.run(&["plan", "<b onload=x>&.toml", "-o", "plan.json", "--report", "plan.html"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let told = story(&folder, "plan.html");
    assert_eq!(told["title"], "<b onload=x>&");
    let hand = &told["scene"]["hands"][0];
    assert_eq!(hand["links"][0]["name"], link);
    let names = |list: &Value| -> Vec<String> {
        list.as_array().unwrap().iter().map(|entry| entry["name"].as_str().unwrap().to_owned()).collect()
    };
    assert!(names(&hand["fingers"]).iter().any(|name| name == finger));
    assert_eq!(names(&told["scene"]["objects"]), [object]);
    let page = std::fs::read_to_string(folder.path("plan.html")).unwrap();
    // The viewer apart, which is the same in every page.
    let (own, _) = page.rsplit_once("<script>").unwrap();
    for markup in ["<img", "<b ", "<!--", "]]><", "alert(1)</"] {
        assert!(!own.contains(markup), "{markup} is in the page");
    }
    assert_eq!(own.matches("<script").count(), 1);
}

/// A folder with a run whose first leg is the plan of the folder.
fn with_run() -> Folder {
    let folder = Folder::planned();
    let run = std::fs::read_to_string(repository().join("fuzz/seeds/run_json/run.json")).unwrap();
    std::fs::write(folder.path("run.json"), run).unwrap();
    folder
}

#[test]
fn a_run_has_a_page_with_the_plans_of_its_legs() {
    let folder = with_run();
    let alone = folder.run(&["view", "run.json", "-o", "alone.html"]);
    assert_eq!(alone.code, Some(0), "{alone:?}");
    ends_with_page(&alone, "alone.html");
    assert!(alone.err.contains("run    1 of 2 goals reached, 1 legs, 2 events"), "{alone:?}");
    std::fs::copy(folder.path("plan.json"), folder.path("run.leg1.json")).unwrap();
    let run = folder.run(&["view", "run.json", "-o", "run.html", "--title", "<b>A & B</b>"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let [alone, page] = ["alone.html", "run.html"].map(|name| std::fs::read_to_string(folder.path(name)).unwrap());
    assert!(alone.contains("Plans of 0 of 1 legs") && !alone.contains("which finger holds when"));
    assert!(page.contains("which finger holds when") && page.contains("&lt;b&gt;A &amp; B&lt;/b&gt;"));
}

#[test]
fn runs_that_cannot_be_shown_are_refused() {
    let folder = with_run();
    for arguments in [["--png", "run.png"], ["--svg", "charts"], ["--story", "story.json"]] {
        let run = folder.run(&[&["view", "run.json"][..], &arguments].concat());
        complains(&run, "A512", arguments[0], &["is a run"]);
    }
    folder.edit("run.json", "\"format_version\": 1", "\"format_version\": 7");
    complains(&folder.run(&["view", "run.json", "-o", "run.html"]), "E803", "run.json:1:", &["is 7"]);
    let folder = with_run();
    std::fs::write(folder.path("run.leg1.json"), "{}").unwrap();
    complains(&folder.run(&["view", "run.json", "-o", "run.html"]), "C402", "run.leg1.json", &[]);
    // The page does not go where the plan of a leg is.
    std::fs::copy(folder.path("plan.json"), folder.path("run.leg1.json")).unwrap();
    let run = folder.run(&["view", "run.json", "-o", "run.leg1.json"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(!std::fs::read_to_string(folder.path("run.leg1.json")).unwrap().contains("<html"));
}
