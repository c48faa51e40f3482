//! Tests of the scene crate over real scene files.

mod bad_inputs;
#[expect(dead_code, reason = "its `main` writes to stdout; here the text is compared")]
#[path = "../../examples/bulb_mesh.rs"]
mod bulb_mesh;
mod bundled;
mod carried_grasps;
mod hostile;
mod motion;
mod pairs;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod random_files;
mod scans;
mod several;
mod standing;
mod support;
mod task;
#[path = "../../../../tests/support/two_hands.rs"]
mod two_hands;
#[path = "../../../../tests/support/wide_scene.rs"]
mod wide_scene;
