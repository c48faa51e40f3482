//! A small good roadmap file, for tests to break: of the scene of `wide_scene.rs`.

/// Made by `regrasp roadmap build scenes/sphere_90x.toml --within 0.001 --angle 8 --seed 7` with build settings of few
/// grasps, and contacts that stay (`transfer = "fixed"`): a graph whose fingertips roll is larger than what the fuzzer takes.
pub const ROADMAP: &[u8] = include_bytes!("../../../../fuzz/seeds/roadmap/sphere.roadmap");
