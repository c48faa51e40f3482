//! `regrasp export`: what it writes, and what it refuses. What the files say is tested where they are made, and in Python.

use crate::bad_input::complains;
use crate::folder::Folder;

#[test]
fn formats_asked_for_are_written_and_no_other() {
    let folder = Folder::planned();
    let run = folder.run(&["export", "plan.json", "--npz", "plan.npz", "--ros2", "plan.yaml", "--json"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(run.out.matches("\"event\":\"written\"").count(), 2, "{}", run.out);
    assert!(run.out.contains("\"accepted\":true"), "what is exported was judged: {}", run.out);
    let npz = std::fs::read(folder.path("plan.npz")).unwrap();
    assert!(npz.starts_with(b"PK\x03\x04"), "an archive");
    let yaml = std::fs::read_to_string(folder.path("plan.yaml")).unwrap();
    assert!(yaml.contains("joint_names: [\"") && yaml.contains("\n- positions: ["), "{yaml}");
    let again = folder.run(&["export", "plan.json", "--npz", "again.npz", "--no-check"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    assert_eq!(std::fs::read(folder.path("again.npz")).unwrap(), npz, "the same plan, the same bytes");
    assert!(!folder.path("again.yaml").exists());
}

#[test]
fn what_the_checker_rejects_is_not_exported_unless_forced() {
    let folder = Folder::planned();
    folder.edit("scene.toml", "mass = 0.1", "mass = 0.2");
    let run = folder.run(&["export", "plan.json", "--ros2", "plan.yaml"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.err.contains("REJECTED") && !folder.path("plan.yaml").exists(), "{}", run.err);
    let run = folder.run(&["export", "plan.json", "--ros2", "plan.yaml", "--no-check"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(folder.path("plan.yaml").exists());
}

#[test]
fn without_a_format_there_is_nothing_to_do() {
    let run = Folder::new().run(&["export", "plan.json"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.err.contains("--npz") && run.err.contains("--ros2"), "{}", run.err);
}

#[test]
fn files_that_cannot_be_read_or_written() {
    let folder = Folder::planned();
    let export = |arguments: &[&str]| folder.run(&[&["export"], arguments].concat());
    complains(&export(&["missing.json", "--npz", "a.npz"]), "F001", "missing.json", &["cannot be read"]);
    complains(&export(&["scene.toml", "--npz", "a.npz"]), "C401", "scene.toml:1", &["schema"]);
    complains(&export(&["plan.json", "--npz", "none/a.npz"]), "F003", "none/a.npz", &["cannot be written"]);
    complains(&export(&["plan.json", "--npz", "."]), "F003", ".", &["cannot be written"]);
    for input in ["plan.json", "scene.toml", "hand.urdf"] {
        complains(&export(&["plan.json", "--ros2", input]), "F003", input, &["an input of this command"]);
    }
    let same = export(&["plan.json", "--npz", "a", "--ros2", "a"]);
    complains(&same, "A505", "command line", &["--ros2", "the file that --npz writes to"]);
}
