//! `regrasp bench SUITE.toml`: what was measured is kept as long as nothing it depends on has changed.

use crate::folder::Folder;

const SUITE: &str = r#"format = "regrasp-suite"
format_version = 1
title = "A small suite"
results = "results"

[[tables]]
title = "Table 1"
[[tables.published]]
name = "published"
time_s = [0.4, 5, 21]
[[tables.rows]]
name = "gait"
scene = "scene.toml"
trials = 3

[[figures]]
name = "figure_1"
title = "Figure 1"
alpha = [0.5, 0.9]
[[figures.curves]]
name = "sphere"
scene = "scene.toml"
trials = 2
time_limit_s = 60
settings = { method = "visibility" }
"#;

/// Lines of a CSV file but for the first.
fn rows(folder: &Folder, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(folder.path(name)).unwrap_or_default();
    text.lines().skip(1).map(str::to_owned).collect()
}

#[test]
fn a_suite_is_measured_once_and_again_where_its_inputs_changed() {
    let folder = Folder::new();
    folder.write("suite.toml", SUITE);
    let run = folder.run(&["bench", "suite.toml", "--seeds", "1"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let first = rows(&folder, "results/rows.csv");
    assert_eq!(first.len(), 3, "one trial of each row and point: {first:?}");

    // Cut off: the rows of the partial file count too.
    std::fs::rename(folder.path("results/rows.csv"), folder.path("results/rows.csv.partial")).unwrap();
    let run = folder.run(&["bench", "suite.toml"]);
    assert!(run.err.contains("7 trials, 3 of them measured before"), "{run:?}");
    let all = rows(&folder, "results/rows.csv");
    assert_eq!(all.len(), 7);
    assert!(first.iter().all(|row| all.contains(row)), "kept as they were, times included");
    assert!(!folder.path("results/rows.csv.partial").exists());

    let page = std::fs::read_to_string(folder.path("results/results.md")).unwrap();
    assert!(page.contains("| *published* |") && page.contains("| gait | 3/3 | 3/3 |"), "{page}");
    assert!(page.contains("| 0.9 | 2/2 |") && page.contains("](figure_1.svg)"), "{page}");
    let picture = std::fs::read_to_string(folder.path("results/figure_1.svg")).unwrap();
    assert_eq!(picture.matches("<circle").count(), 2);

    // Another limit for the curve: its rows are measured again, the table's are not.
    folder.edit("suite.toml", "time_limit_s = 60", "time_limit_s = 61");
    let run = folder.run(&["bench", "suite.toml"]);
    assert!(run.err.contains("7 trials, 3 of them measured before"), "{run:?}");
    folder.edit("scene.toml", "friction = 0.8", "friction = 0.9");
    let run = folder.run(&["bench", "suite.toml"]);
    assert!(run.err.contains("7 trials, 0 of them measured before"), "{run:?}");

    // The page of suites links the pictures from where it is, and plans nothing.
    assert_eq!(folder.run(&["bench", "--page", "page.md", "suite.toml"]).code, Some(0));
    let page = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(page.contains("## A small suite") && page.contains("](results/figure_1.svg)"), "{page}");
}

#[test]
fn suites_stand_alone_and_their_faults_are_told_with_their_place() {
    let folder = Folder::new();
    folder.write("suite.toml", SUITE);
    let run = folder.run(&["bench", "suite.toml", "scene.toml"]);
    assert!(run.code == Some(2) && run.err.contains("A505"), "{run:?}");
    let line = folder.edit("suite.toml", "trials = 3", "trails = 3");
    let run = folder.run(&["bench", "suite.toml"]);
    assert!(run.code == Some(2) && run.err.contains("B600"), "{run:?}");
    assert!(run.err.contains(&format!("suite.toml:{line}:")), "line {line}: {}", run.err);
    folder.edit("suite.toml", "trails = 3", "trials = 3");
    folder.edit("suite.toml", "scene = \"scene.toml\"", "scene = \"missing.toml\"");
    let run = folder.run(&["bench", "suite.toml"]);
    assert!(run.code == Some(2) && run.err.contains("missing.toml"), "{run:?}");
    assert!(!folder.path("results/rows.csv.partial").exists(), "nothing was begun");
}

#[test]
fn a_file_of_open_brackets_is_refused_whoever_reads_it_first() {
    // Both ways in: a file that `bench` asks whether it is a suite, and one that says so. The parser overflowed its stack on the first.
    let folder = Folder::new();
    let broken =
        "turn = { axis = \"x\", angle_deg = 90 0.1\n\n[start]\nposition = [0.0, 0.0, 0.078]\n\n[goal]\n".repeat(10_000);
    for head in ["format = \"regrasp-scene\"\n[goal]\n", "format = \"regrasp-suite\"\n[goal]\n"] {
        folder.write("deep.toml", format!("{head}{broken}"));
        let run = folder.run(&["bench", "deep.toml"]);
        assert!(run.code == Some(2) && run.err.contains("brackets"), "{run:?}");
    }
}
