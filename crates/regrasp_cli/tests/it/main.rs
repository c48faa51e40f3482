//! The command line from outside: one test binary.

mod bad_input;
mod commands;
mod export;
mod folder;
mod grasps;
mod growth;
#[cfg(unix)]
mod motion;
mod outputs;
mod pictures;
mod place;
#[path = "../../../../tests/support/places.rs"]
mod places;
mod roadmap;
mod roadmap_file;
mod suite;
mod tracking;
mod two_hands;
mod view;
#[path = "../../../../tests/support/wide_scene.rs"]
mod wide_scene;
