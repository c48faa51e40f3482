//! A folder with a good hand, object and scene, files of which a test may break; and the program run in it.

use crate::places::repository;
use crate::wide_scene::{SCENE, copy_hand};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// A folder that is removed at the end of the test.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// The wide four-finger hand with a ball.
    pub fn new() -> Self {
        let folder = Folder(tempfile::tempdir().expect("a temporary folder"));
        copy_hand(&repository(), folder.0.path());
        folder.write("scene.toml", SCENE);
        folder
    }

    /// The same, with `plan.json`, an accepted plan of the scene.
    pub fn planned() -> Self {
        let folder = Folder::new();
        let run = folder.run(&["plan", "scene.toml", "-o", "plan.json"]);
        assert_eq!(run.code, Some(0), "{run:?}");
        folder
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("the folder is writable");
    }

    /// Replaces the first `old` in a file by `new` and returns the line of the change, from 1.
    pub fn edit(&self, name: &str, old: &str, new: &str) -> usize {
        let text = std::fs::read_to_string(self.path(name)).expect("the file is there");
        let at = text.find(old).unwrap_or_else(|| panic!("{name} has no {old:?}"));
        self.write(name, text.replacen(old, new, 1));
        text[..at].matches('\n').count() + 1
    }

    /// Runs the program in it, with an environment that names no packages.
    pub fn run(&self, arguments: &[&str]) -> Run {
        Run::of(self.command(arguments).output().expect("the program runs"))
    }

    /// The program in it, ready to run, with its outputs captured.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_regrasp"));
        command
            .args(arguments)
            .current_dir(self.0.path())
            .env_remove("ROS_PACKAGE_PATH")
            .env_remove("AMENT_PREFIX_PATH")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }
}

/// What the program did.
#[derive(Debug)]
pub struct Run {
    /// Exit code.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Run {
    /// From the captured output.
    pub fn of(output: Output) -> Self {
        Run {
            code: output.status.code(),
            out: String::from_utf8(output.stdout).expect("stdout is UTF-8"),
            err: String::from_utf8(output.stderr).expect("stderr is UTF-8"),
        }
    }
}
