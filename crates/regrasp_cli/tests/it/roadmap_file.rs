//! A small good roadmap file, for tests to break: of the scene of `wide_scene.rs`.

/// Made by `regrasp roadmap build scene.toml --places 3 --within 0.001 --angle 10` with build settings of few grasps.
pub const ROADMAP: &[u8] = include_bytes!("../../../../fuzz/seeds/roadmap/sphere.roadmap");
