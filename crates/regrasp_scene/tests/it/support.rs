//! Where the repository and the shared models are, and scenes written for one test.

use regrasp_base::InputError;
use regrasp_robot::import::{LoadOptions, ResolveOptions};
use regrasp_scene::{LoadedScene, load_scene};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The root of the repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The shared models; says SKIPPED when they are absent.
pub fn shared_models() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("REGRASP_MODELS") {
        return Some(PathBuf::from(given));
    }
    let found = repository().ancestors().map(|folder| folder.join("shared/models")).find(|folder| folder.is_dir());
    if found.is_none() {
        // Past the capture of test output, so that the log says it.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no shared models");
    }
    found
}

/// Options with `models` as the package of that name.
pub fn with_models(models: &Path) -> LoadOptions {
    LoadOptions {
        resolve: ResolveOptions { packages: vec![("models".into(), models.to_owned())], search_paths: vec![] },
        lenient: false,
    }
}

/// A folder with the bundled hands, a cube mesh and a scene file.
pub struct Folder {
    folder: tempfile::TempDir,
}

/// Object, start and goal of a good scene.
pub const GOOD: &str = r#"format = "regrasp-scene"
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
turn = { axis = "x", angle_deg = 90 }
"#;

impl Folder {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let hand = repository().join("assets/hands/wide_four_finger");
        for name in ["hand.toml", "hand.urdf"] {
            std::fs::copy(hand.join(name), folder.path().join(name)).unwrap();
        }
        let new = Folder { folder };
        new.write("cube.obj", &cube(0.02, 12));
        new.write("open.obj", &cube(0.02, 10));
        new
    }

    pub fn write(&self, name: &str, content: &str) {
        std::fs::write(self.folder.path().join(name), content).unwrap();
    }

    /// Loads `text` as `scene.toml` of the folder.
    pub fn load(&self, text: &str) -> Result<LoadedScene, InputError> {
        self.write("scene.toml", text);
        load_scene(&self.folder.path().join("scene.toml"), &LoadOptions::default())
    }

    /// The messages for `text`, with the folder's path cut off.
    pub fn messages(&self, text: &str) -> String {
        let error = self.load(text).expect_err("the scene is bad");
        error.to_string().replace(&format!("{}/", self.folder.path().display()), "")
    }
}

/// The first `n_triangles` of the 12 of a cube of half edge `half` whose lowest corner is the origin.
pub fn cube(half: f64, n_triangles: usize) -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let at = |bit: usize| if corner >> bit & 1 == 1 { 2.0 * half } else { 0.0 };
        text.push_str(&format!("v {} {} {}\n", at(0), at(1), at(2)));
    }
    let quads = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    for [a, b, c] in triangles.take(n_triangles) {
        text.push_str(&format!("f {a} {b} {c}\n"));
    }
    text
}
