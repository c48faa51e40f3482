//! Scenes with a task of kind `tracking`: what is said of them is true, and what they cannot do is refused.

use crate::folder::Folder;
use crate::places::repository;

fn football() -> String {
    repository().join("scenes/football.toml").to_str().expect("UTF-8").to_owned()
}

#[test]
fn flags_of_in_hand_planning_are_refused_by_name() {
    let (folder, scene) = (Folder::new(), football());
    for (flag, value) in [("--method", "classic"), ("--margin", "0.1"), ("--improve", "1"), ("--improve-work", "9")] {
        for command in ["plan", "bench"] {
            let run = folder.run(&[command, &scene, flag, value]);
            assert_eq!(run.code, Some(2), "{run:?}");
            for part in ["A507", flag, "tracking", "fix: leave it out"] {
                assert!(run.err.contains(part), "{part} is missing:\n{}", run.err);
            }
        }
    }
    // Also where only one of the scenes is of this kind.
    let run = folder.run(&["bench", "scene.toml", &scene, "--margin", "0.1"]);
    assert!(run.code == Some(2) && run.err.contains("A507"), "{run:?}");
}

#[test]
fn roadmaps_and_campaigns_refuse_the_scene() {
    let (folder, scene) = (Folder::new(), football());
    let build = folder.run(&["roadmap", "build", &scene, "-o", "a.roadmap"]);
    let campaign = folder.run(&["campaign", "determinism", &scene]);
    for run in [build, campaign] {
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.err.contains("A507") && run.err.contains("football.toml"), "{}", run.err);
    }
    assert!(!folder.path("a.roadmap").exists());
}

#[test]
fn plans_rows_and_pages_speak_of_sub_goals() {
    let (folder, scene) = (Folder::new(), football());
    let run = folder.run(&["plan", &scene, "-o", "plan.json"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    for part in ["rotation 94 deg, by tracking", "sub-goals on the path", "margin not defined for sliding contacts"] {
        assert!(run.err.contains(part), "{part} is missing:\n{}", run.err);
    }
    assert!(!run.err.contains("translation"), "the goal says no position:\n{}", run.err);
    let run = folder.run(&["bench", &scene, "--seeds", "1", "--csv", "rows.csv"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(!run.err.contains("NO FLOOR") && run.out.contains("on path"), "{run:?}");
    assert!(!run.out.contains("floors") && !run.out.contains("without"), "{}", run.out);
    assert_eq!(folder.run(&["bench", "--page", "page.md", "rows.csv"]).code, Some(0));
    let page = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(page.contains("sub-goals on the path") && !page.contains("| transfers |"), "{page}");
}

/// Scenario F-1 of Cherif 1999 from the suite of the repository, with other results and without the other rows.
#[test]
fn the_suite_of_paper_003_measures_its_scenarios_beside_the_published_numbers() {
    let folder = Folder::new();
    let suite = std::fs::read_to_string(repository().join("suites/cherif1999.toml")).expect("the suite");
    let (head, tables) = suite.split_once("[[tables]]\n").expect("tables");
    let table_5 = &tables[tables.find("title = \"Table 5").expect("table 5")..];
    let after_f1 = table_5.find("[[tables.rows]]\nname = \"F-1, start of F-2\"").expect("the row after F-1");
    let text = format!("{head}[[tables]]\n{}", &table_5[..after_f1])
        .replace("../scenes/football.toml", &football())
        .replace("../docs/benchmarks/cherif1999", "results");
    folder.write("suite.toml", text);
    let run = folder.run(&["bench", "suite.toml", "--seeds", "2"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let page = std::fs::read_to_string(folder.path("results/results.md")).unwrap();
    assert!(page.contains("| *F-1* | - | - | - | 43.0 s | - | 247 | 44 | 44 | - | - |"), "{page}");
    assert!(page.contains("| F-1 | 2/2 (100 %) | 2/2 |") && page.contains("solved at least 99 %: met"), "{page}");
    let rows = std::fs::read_to_string(folder.path("results/rows.csv")).unwrap();
    let mut folded = rows.lines().skip(1).map(|line| line.split(',').nth(3));
    assert!(folded.all(|method| method == Some("tracking")), "{rows}");
    // Settings of another kind of task are refused before anything is measured.
    folder.edit("suite.toml", &football(), "scene.toml");
    let run = folder.run(&["bench", "suite.toml"]);
    assert!(run.code == Some(2) && run.err.contains("B603") && run.err.contains("tracking"), "{run:?}");
}
