//! The command line from outside: one test binary.

mod bad_input;
mod commands;
mod folder;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod suite;
#[path = "../../../../tests/support/wide_scene.rs"]
mod wide_scene;
