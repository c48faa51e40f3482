//! A folder with a good hand, object and scene, files of which a test may break; and the program run in it.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The scene of [`Folder::new`].
pub const SCENE: &str = r#"format = "regrasp-scene"
format_version = 1
task = "in_hand"

[hand]
file = "hand.toml"

[object]
name = "ball"
sphere = { radius = 0.032 }
mass = 0.1
friction = 0.8

[start]
position = [0.0, 0.0, 0.078]

[goal]
turn = { axis = "z", angle_deg = 180 }
"#;

/// A folder that is removed at the end of the test.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// The wide four-finger hand with a ball.
    pub fn new() -> Self {
        let folder = Folder(tempfile::tempdir().expect("a temporary folder"));
        let hand = repository().join("assets/hands/wide_four_finger");
        for name in ["hand.toml", "hand.urdf"] {
            std::fs::copy(hand.join(name), folder.path(name)).expect("the bundled hand is there");
        }
        folder.write("scene.toml", SCENE);
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

/// The root of the repository.
pub fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// The shared models, if they are here: `REGRASP_MODELS`, else `../shared/models` beside the repository or above it.
pub fn models() -> Option<PathBuf> {
    let named = std::env::var_os("REGRASP_MODELS").map(PathBuf::from);
    let root = repository().canonicalize().expect("the repository is there");
    let near = root.ancestors().map(|folder| folder.join("../shared/models"));
    let found = named.into_iter().chain(near).find(|folder| folder.is_dir());
    if found.is_none() {
        // Past the capture of test output, so that the log says it.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no shared models");
    }
    found.and_then(|folder| folder.canonicalize().ok())
}
