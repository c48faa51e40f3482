//! Tests of the scene crate over real scene files.

mod bad_inputs;
mod bundled;
mod pairs;
mod random_files;
mod support;
mod task;
