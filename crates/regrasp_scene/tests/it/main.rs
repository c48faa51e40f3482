//! Tests of the scene crate over real scene files.

mod bad_inputs;
mod bundled;
mod pairs;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod random_files;
mod support;
mod task;
#[path = "../../../../tests/support/wide_scene.rs"]
mod wide_scene;
