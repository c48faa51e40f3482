//! Pictures that commands write. What is in them is tested in `regrasp_viewer`.

use crate::bad_input::complains;
use crate::folder::Folder;
use crate::places::repository;

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Names in a folder, in order.
fn names(folder: &Folder, name: &str) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path(name)).expect("the folder is there");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_plan_has_a_storyboard_and_charts_and_they_are_the_same_again() {
    let folder = Folder::planned();
    let view = |png: &str, svg: &str| {
        let size = ["--frames", "3", "--width", "360", "--columns", "3"];
        let run = folder.run(&[&["view", "plan.json", "--png", png, "--svg", svg], &size[..]].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
    };
    view("a.png", "a");
    view("b.png", "deep/b");
    assert!(bytes(&folder, "a.png").starts_with(b"\x89PNG\r\n"));
    assert!(bytes(&folder, "a.png") == bytes(&folder, "b.png"));
    let charts = ["clearance.svg", "forces.svg", "gait.svg", "joints.svg", "margin.svg", "orientation.svg"];
    assert_eq!(names(&folder, "a"), charts);
    for name in charts {
        assert!(bytes(&folder, &format!("a/{name}")).starts_with(b"<svg "));
        assert!(bytes(&folder, &format!("a/{name}")) == bytes(&folder, &format!("deep/b/{name}")), "{name}");
    }
}

#[test]
fn pictures_that_cannot_be_made_are_refused() {
    let folder = Folder::planned();
    let plan = bytes(&folder, "plan.json");
    for (arguments, code) in [
        (&["--png", "a.png", "--frames", "1"][..], "A505"),
        (&["--png", "a.png", "--width", "20"], "A505"),
        (&["--png", "a.png", "--columns", "0"], "A505"),
        (&["--png", "plan.json"], "F003"),
        (&["--png", "nowhere/a.png"], "F003"),
        (&["--png", "hand.urdf"], "F003"),
        (&["--svg", "plan.json"], "F003"),
    ] {
        let run = folder.run(&[&["view", "plan.json"], arguments].concat());
        complains(&run, code, "", &[]);
    }
    assert!(plan == bytes(&folder, "plan.json"));
    // A storyboard's size without a storyboard.
    assert_eq!(folder.run(&["view", "plan.json", "-o", "a.html", "--frames", "4"]).code, Some(2));
}

#[test]
fn a_failure_has_pictures_too() {
    let folder = Folder::new();
    let scene = repository().join("scenes/out_of_reach.toml");
    let scene = scene.to_str().expect("a path in UTF-8");
    let run = folder.run(&["plan", scene, "--max-work", "20000", "--failure", "why", "-o", "none.json"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert_eq!(names(&folder, "why"), ["causes.svg", "reached.svg"]);
}

/// Each impossible task of a robot: found in a search (with causes) or before it. Pictures have the same bytes every time.
#[test]
fn failed_tasks_of_robots_are_drawn_in_their_scenes() {
    for (name, words, is_search) in [
        ("double_grasp", "exchange: hands touch", true),
        ("place", "place: ", true),
        ("reach", "goal: out of reach", false),
        ("start", "start: in collision", false),
        ("support", "goal: no support", false),
        ("weight", "", false),
    ] {
        let folder = Folder::new();
        let scene = repository().join(format!("scenes/two_arms/impossible_{name}.toml"));
        let scene = scene.to_str().expect("a path in UTF-8");
        let plan = |more: &[&str]| {
            let run = folder.run(&[&["plan", scene, "-o", "none.json", "--json"], more].concat());
            assert_eq!(run.code, Some(1), "{name}: {run:?}");
            assert!(run.out.contains(words), "{name}: {run:?}");
        };
        plan(&["--failure", "why", "--report", "why.html"]);
        let html = String::from_utf8(bytes(&folder, "why.html")).expect("UTF-8");
        assert!(html.contains("NO PLAN") && html.contains("data:image/png;base64,"), "{name}");
        let expected: &[&str] = if is_search { &["causes.svg", "scene.png"] } else { &["scene.png"] };
        assert_eq!(names(&folder, "why"), expected, "{name}");
        assert!(bytes(&folder, "why/scene.png").starts_with(b"\x89PNG\r\n"));
        if is_search {
            plan(&["--failure", "again"]);
            for file in expected {
                let [one, other] = ["why", "again"].map(|of| bytes(&folder, &format!("{of}/{file}")));
                assert!(one == other, "{name}: {file}");
            }
        }
    }
}

#[test]
fn a_graph_is_drawn_with_and_without_a_query() {
    let folder = Folder::new();
    folder.write("build.json", r#"{ "places": 40, "grasps": 40, "neighbours": 12 }"#);
    let build = ["roadmap", "build", "scene.toml", "-o", "a.roadmap", "--build-settings", "build.json"];
    let run = folder.run(&[&build[..], &["--within", "0.005", "--seed", "1"]].concat());
    assert_eq!(run.code, Some(0), "{run:?}");
    let graph = bytes(&folder, "a.roadmap");
    for arguments in [&["-o", "alone.svg"][..], &["scene.toml", "-o", "query.svg"]] {
        let run = folder.run(&[&["roadmap", "picture", "a.roadmap"], arguments].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
    }
    let text = |name: &str| String::from_utf8(bytes(&folder, name)).expect("UTF-8");
    assert!(!text("alone.svg").contains("class=\"solution\""));
    assert!(text("query.svg").contains("class=\"solution\""));
    assert!(graph == bytes(&folder, "a.roadmap"), "drawing changes nothing");
    complains(&folder.run(&["roadmap", "picture", "a.roadmap", "-o", "a.roadmap"]), "F003", "", &[]);
}
