//! Scenes written for one test.

pub use crate::places::{repository, shared_models};
pub use crate::wide_scene::SCENE as GOOD;
use crate::wide_scene::copy_hand;
use regrasp_base::InputError;
use regrasp_robot::import::{LoadOptions, ResolveOptions};
use regrasp_scene::{LoadedScene, load_scene};
use std::path::{Path, PathBuf};

/// Options with `models` as the package of that name.
pub fn with_models(models: &Path) -> LoadOptions {
    LoadOptions {
        resolve: ResolveOptions { packages: vec![("models".into(), models.to_owned())], search_paths: vec![] },
        ..LoadOptions::default()
    }
}

/// A folder with the bundled hands, a cube mesh and a scene file.
pub struct Folder {
    folder: tempfile::TempDir,
}

impl Folder {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        copy_hand(&repository(), folder.path());
        let new = Folder { folder };
        new.write("cube.obj", &cube(0.02, 12));
        new.write("open.obj", &cube(0.02, 10));
        new
    }

    pub fn write(&self, name: &str, content: &str) {
        std::fs::write(self.folder.path().join(name), content).unwrap();
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn edit(&self, name: &str, change: impl Fn(&str) -> String) {
        let text = std::fs::read_to_string(self.path(name)).unwrap();
        self.write(name, &change(&text));
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
