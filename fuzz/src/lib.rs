//! What the fuzz targets share: a folder with a small good hand, scene and mesh, one file of which is replaced per input.

use regrasp::geometry::import::read_mesh;
use regrasp::robot::import::LoadOptions;
use std::path::{Path, PathBuf};

/// A small good hand: palm and four one-joint fingers.
pub const URDF: &str = include_str!("../seeds/urdf/hand.urdf");
/// A hand file for [`URDF`].
pub const HAND: &str = include_str!("../seeds/hand_toml/hand.toml");
/// A scene for [`HAND`].
pub const SCENE: &str = include_str!("../seeds/scene_toml/scene.toml");
/// An arm of seven joints beside a wheel.
pub const ARM: &str = include_str!("../seeds/robot_toml/arm.urdf");
/// A tetrahedron.
pub const OBJ: &str = include_str!("../seeds/obj/tetrahedron.obj");

/// A folder of this process with all of them.
pub struct Folder(PathBuf);

impl Folder {
    /// Makes it below the folder for temporary files.
    pub fn new() -> Self {
        let folder = std::env::temp_dir().join(format!("regrasp_fuzz_{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("the folder for temporary files is writable");
        let made = Folder(folder);
        made.put("hand.urdf", URDF.as_bytes());
        made.put("hand.toml", HAND.as_bytes());
        made.put("arm.urdf", ARM.as_bytes());
        made.put("scene.toml", SCENE.as_bytes());
        made.put("tetrahedron.obj", OBJ.as_bytes());
        made
    }

    /// Replaces a file and returns its path.
    pub fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).expect("the folder for temporary files is writable");
        path
    }
}

impl Default for Folder {
    fn default() -> Self {
        Folder::new()
    }
}

/// Lenient on every other input, by its length, so that both ways are tried.
pub fn options(bytes: &[u8]) -> LoadOptions {
    LoadOptions { lenient: bytes.len() % 2 == 1, ..LoadOptions::default() }
}

/// Reads `bytes` as the mesh file `name`, and asks of the mesh all that is asked afterwards.
pub fn ask_mesh(name: &str, bytes: &[u8]) {
    if let Ok(mesh) = read_mesh(Path::new(name), bytes) {
        assert!(mesh.vertices().iter().all(|vertex| vertex.coords.iter().all(|x| x.is_finite())));
        let _ = (mesh.bounds(), mesh.signed_volume(), mesh.statistics().is_watertight());
    }
}
