//! `regrasp growth` at its smallest sizes, and the page of what it wrote.

use crate::bad_input::complains;
use crate::folder::Folder;
use std::collections::BTreeSet;

fn text(folder: &Folder, name: &str) -> String {
    std::fs::read_to_string(folder.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn every_curve_is_measured_checked_and_put_on_the_page() {
    let folder = Folder::new();
    let run = folder.run(&["growth", "--up-to", "100", "--trials", "1", "-o", "scenes", "--results", "curves"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(!run.err.contains("miss ") && !run.err.contains("REJECTED"), "{}", run.err);
    for (curve, n_points, n_rows) in [("fingers", 8, 8), ("triangles", 1, 1), ("obstacles", 3, 3), ("threads", 4, 40)] {
        assert_eq!(run.err.matches(&format!("point  {curve} ")).count(), n_points, "{curve}: {}", run.err);
        let rows = text(&folder, &format!("curves/{curve}.csv"));
        assert_eq!(rows.lines().count(), 1 + n_rows, "{curve}");
        assert_eq!(rows.matches(",solved,").count(), n_rows, "{curve}: {rows}");
        assert_eq!(rows.matches(",true,").count(), n_rows, "every plan is accepted: {rows}");
        let picture = text(&folder, &format!("curves/{curve}.svg"));
        assert!(picture.contains("<circle") && !picture.contains("NaN"), "{picture}");
    }
    assert!(run.out.contains("plans per s") && run.out.contains("10/10"), "{}", run.out);

    // The scenes are there for any other command.
    let plan = folder.run(&["plan", "scenes/obstacles_box_10.toml", "-o", "plan.json"]);
    assert_eq!(plan.code, Some(0), "{plan:?}");
    assert_eq!(folder.run(&["check", "plan.json"]).code, Some(0));
    let hands: BTreeSet<String> = std::fs::read_dir(folder.path("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".urdf"))
        .collect();
    assert_eq!(hands.len(), 4, "{hands:?}");

    let files = ["fingers", "triangles", "obstacles", "threads"].map(|curve| format!("curves/{curve}.csv"));
    let arguments: Vec<&str> =
        ["bench", "--page"].into_iter().chain(["page.md"]).chain(files.iter().map(String::as_str)).collect();
    assert_eq!(folder.run(&arguments).code, Some(0));
    let page = text(&folder, "page.md");
    assert_eq!(page.matches("## Growth\n").count(), 1);
    for part in
        ["### Fingers", "](curves/triangles.svg)", "| ellipsoid | 100 | 1/1 | 1/1 |", "| box | 8 | 10/10 | 10/10 |"]
    {
        assert!(page.contains(part), "{part} is missing in\n{page}");
    }
}

#[test]
fn a_point_without_a_plan_says_so() {
    let folder = Folder::new();
    let run = folder.run(&["growth", "fingers", "--up-to", "3", "--trials", "2", "--max-work", "5", "-o", "out"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(run.err.matches("work_spent").count(), 4, "two objects, two trials: {}", run.err);
    assert_eq!(run.out.matches("0/2").count(), 2, "{}", run.out);
    assert_eq!(folder.run(&["bench", "--page", "out/page.md", "out/fingers.csv"]).code, Some(0));
    let page = text(&folder, "out/page.md");
    assert!(
        page.contains("| sphere | 3 | 0/2 | - |") && page.contains("- fingers_box_3 (gait) seed 1: work_spent"),
        "{page}"
    );
    assert!(page.contains("](fingers.svg)"), "the picture lies beside the page: {page}");
}

#[test]
fn arguments_that_make_no_sense() {
    let folder = Folder::new();
    let run = folder.run(&["growth", "triangles", "--up-to", "99"]);
    complains(&run, "A506", "command line", &["--up-to", "is 99", "at least 100"]);
    folder.write("taken", "a file");
    let run = folder.run(&["growth", "fingers", "-o", "taken"]);
    complains(&run, "F003", "taken", &["cannot be written"]);
    for (arguments, says) in [
        (["growth", "legs", "--quiet"], "fingers, triangles, obstacles, threads"),
        (["growth", "--trials", "0"], "between 1 and"),
        (["growth", "--trials", "-1"], "between 1 and"),
        (["growth", "--trials", "18446744073709551615"], "between 1 and"),
        (["growth", "--up-to", "-3"], "whole number"),
        (["growth", "--time-limit", "0"], "seconds"),
    ] {
        let run = folder.run(&arguments);
        assert!(run.code == Some(2) && run.err.contains(says), "{run:?}");
    }
    assert!(!folder.path("regrasp-growth").exists(), "nothing was begun");
}
