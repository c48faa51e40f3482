//! Roadmap files.

use super::complains;
use crate::folder::Folder;
use crate::roadmap_file::ROADMAP;
use regrasp::planners::in_hand::roadmap::seal;

/// Asks for a file and expects the complaint, from `info` and from `query`, which then leaves the file alone.
#[track_caller]
fn roadmap_is_refused(content: &[u8], code: &str, says: &[&str]) {
    let folder = Folder::new();
    folder.write("a.roadmap", content);
    complains(&folder.run(&["roadmap", "info", "a.roadmap"]), code, "a.roadmap", says);
    let query = folder.run(&["roadmap", "query", "a.roadmap", "scene.toml", "-o", "plan.json", "--grow"]);
    complains(&query, code, "a.roadmap", says);
    assert!(!folder.path("plan.json").exists());
    assert!(std::fs::read(folder.path("a.roadmap")).unwrap() == content, "the file was changed");
}

/// The good file with eight bytes replaced, and length and checksum made good.
fn with_number(at: usize, number: u64) -> Vec<u8> {
    let mut bytes = ROADMAP.to_vec();
    bytes[at..at + 8].copy_from_slice(&number.to_le_bytes());
    seal(&mut bytes);
    bytes
}

#[test]
fn the_file_that_the_others_are_made_of_is_good() {
    let folder = Folder::new();
    folder.write("a.roadmap", ROADMAP);
    let run = folder.run(&["roadmap", "info", "a.roadmap"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.out.contains("wide_four_finger"), "{}", run.out);
}

#[test]
fn roadmap_that_is_cut_off() {
    let said = format!("{}", ROADMAP.len());
    let half = format!("{}", ROADMAP.len() / 2);
    roadmap_is_refused(&ROADMAP[..ROADMAP.len() / 2], "R603", &[&said, &half, "fix: "]);
    roadmap_is_refused(&ROADMAP[..ROADMAP.len() - 1], "R603", &[&said, "fix: "]);
    roadmap_is_refused(&ROADMAP[..20], "R603", &["20 bytes", "fix: "]);
    let mut longer = ROADMAP.to_vec();
    longer.push(0);
    roadmap_is_refused(&longer, "R603", &[&said, "fix: "]);
}

#[test]
fn roadmap_of_another_version() {
    let mut bytes = ROADMAP.to_vec();
    bytes[8] = 99;
    roadmap_is_refused(&bytes, "R602", &["99", "expected 5", "fix: "]);
}

#[test]
fn roadmap_that_is_something_else() {
    roadmap_is_refused(b"", "R601", &["fix: "]);
    roadmap_is_refused(b"format = \"regrasp-scene\"", "R601", &["666f726d6174203d", "fix: "]);
}

#[test]
fn roadmap_with_a_wrong_checksum() {
    let mut bytes = ROADMAP.to_vec();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    let sum: String = ROADMAP[24..32].iter().rev().map(|byte| format!("{byte:02x}")).collect();
    roadmap_is_refused(&bytes, "R604", &["damaged", &sum, "byte 24", "fix: "]);
}

#[test]
fn roadmap_with_huge_counts() {
    for (index, what) in [
        "bytes about itself",
        "places",
        "contacts",
        "nodes",
        "edges",
        "ways of fingers",
        "joint values",
        "numbers of motions",
    ]
    .into_iter()
    .enumerate()
    {
        let at = 32 + 8 * index;
        let place = format!("byte {at}");
        for huge in [u64::MAX, u64::MAX / 16, 1 << 60] {
            roadmap_is_refused(&with_number(at, huge), "R606", &[&place, &huge.to_string(), what, "fix: "]);
        }
        // Not more than the file has bytes, and yet not what it holds.
        roadmap_is_refused(&with_number(at, ROADMAP.len() as u64), "R606", &["tables of", "fix: "]);
    }
    roadmap_is_refused(&with_number(32 + 8 * 8, 13), "R606", &["finger 0", "13 joints", "fix: "]);
    let mut bytes = ROADMAP.to_vec();
    bytes[12] = 200;
    seal(&mut bytes);
    roadmap_is_refused(&bytes, "R606", &["200 fingers", "fix: "]);
}

#[test]
fn roadmap_that_says_nonsense_about_itself() {
    let at = ROADMAP.windows(10).position(|window| window == b"\"friction\"").unwrap();
    let mut bytes = ROADMAP.to_vec();
    bytes[at + 1] = b'F';
    seal(&mut bytes);
    roadmap_is_refused(&bytes, "R605", &["Friction", "fix: "]);
}

#[test]
fn roadmap_that_is_a_folder_or_not_there() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("a.roadmap")).unwrap();
    complains(&folder.run(&["roadmap", "info", "a.roadmap"]), "F001", "a.roadmap", &["not a regular file"]);
    complains(&folder.run(&["roadmap", "info", "b.roadmap"]), "F001", "b.roadmap", &[]);
}

#[test]
fn roadmap_of_another_scene_or_for_another_margin() {
    let query = |folder: &Folder, more: &[&str]| {
        let mut arguments = vec!["roadmap", "query", "a.roadmap", "scene.toml", "-o", "plan.json"];
        arguments.extend(more);
        folder.run(&arguments)
    };
    let folder = Folder::new();
    folder.write("a.roadmap", ROADMAP);
    let says = &["closure_margin", "0.005", "0.01", "fix: "];
    complains(&query(&folder, &["--margin", "0.01"]), "R615", "a.roadmap", says);
    folder.write("strict.json", "{ \"release_rule\": \"everywhere_every_finger\" }");
    let says = &["release_rule", "where_others_hold", "everywhere_every_finger", "fix: "];
    complains(&query(&folder, &["--settings", "strict.json"]), "R615", "a.roadmap", says);
    folder.edit("scene.toml", "friction = 0.8", "friction = 0.4");
    complains(&query(&folder, &[]), "R612", "a.roadmap", &["0.8", "0.4", "fix: "]);
    assert!(!folder.path("plan.json").exists());
}
