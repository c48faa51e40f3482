//! Bad inputs (`reliability.md` B4): exit code 2, one clear message with file, line, element, value and fix, no panic,
//! and nothing written.

mod arguments;
mod extremes;
mod meshes;
mod plans;
mod roadmaps;
mod robots;
mod scenes;

use crate::folder::{Folder, Run};

/// Plans the folder's scene and expects exactly one complaint: `code`, at `place`, with every part of `says`.
#[track_caller]
fn refused(folder: &Folder, code: &str, place: &str, says: &[&str]) {
    let run = folder.run(&["plan", "scene.toml", "-o", "plan.json", "--max-work", "1"]);
    complains(&run, code, place, says);
    assert!(!folder.path("plan.json").exists(), "a plan was written in spite of bad input");
}

#[track_caller]
pub fn complains(run: &Run, code: &str, place: &str, says: &[&str]) {
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.out.is_empty(), "{run:?}");
    assert!(!run.err.contains("panicked"), "{}", run.err);
    let complaints: Vec<&str> = run.err.lines().filter(|line| is_complaint(line)).collect();
    assert_eq!(complaints.len(), 1, "one cause, one message:\n{}", run.err);
    let head = complaints[0].trim_start_matches("error: ");
    assert!(head.starts_with(&format!("{code} ")), "expected {code}:\n{}", run.err);
    assert!(head.contains(place), "expected the place {place}:\n{}", run.err);
    for part in says {
        assert!(run.err.contains(part), "expected {part:?} in:\n{}", run.err);
    }
}

/// A line such as `error: U120 hand.urdf:42:9 joint "j2": ...`.
fn is_complaint(line: &str) -> bool {
    let code = line.trim_start_matches("error: ").split(' ').next().unwrap_or_default();
    code.len() == 4
        && code.starts_with(|c: char| c.is_ascii_uppercase())
        && code[1..].bytes().all(|b| b.is_ascii_digit())
}

/// Breaks `file` by replacing `old` with `new`, and expects the complaint on that line.
#[track_caller]
fn edit_is_refused(file: &str, old: &str, new: &str, code: &str, says: &[&str]) {
    let folder = Folder::new();
    let line = folder.edit(file, old, new);
    refused(&folder, code, &format!("{file}:{line}"), says);
}

/// As [`edit_is_refused`], with the complaint at another `place`.
#[track_caller]
fn edit_is_refused_somewhere(file: &str, old: &str, new: &str, code: &str, place: &str, says: &[&str]) {
    let folder = Folder::new();
    folder.edit(file, old, new);
    refused(&folder, code, place, says);
}

const FIRST_LIMIT: &str = r#"<limit lower="-0.6108652382" upper="0.6108652382" effort="1.0" velocity="4.0"/>"#;

/// A corner of a cube of 5 cm.
const TETRAHEDRON: &str = "v 0 0 0\nv 0.05 0 0\nv 0 0.05 0\nv 0 0 0.05\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
