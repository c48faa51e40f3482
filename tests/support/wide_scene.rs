//! A good scene with the wide four-finger hand, for tests to break. Included by its path, as `places.rs`.

use std::path::Path;

/// Text of a scene file beside the files of [`copy_hand`].
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
turn = { axis = "x", angle_deg = 90 }
"#;

/// Copies `hand.toml` and `hand.urdf` of the bundled wide hand into `folder`.
pub fn copy_hand(repository: &Path, folder: &Path) {
    for name in ["hand.toml", "hand.urdf"] {
        let source = repository.join("assets/hands/wide_four_finger").join(name);
        std::fs::copy(source, folder.join(name)).expect("the bundled hand is there");
    }
}
