//! Tests of motions of whole robots.

#[path = "../../../../tests/support/places.rs"]
mod places;

/// Motions against dense sampling with distances of another kind.
mod certified;
/// Plans of scenes.
mod plans;
/// Roadmaps of robots with two arms.
mod roadmap;
/// Robots that tests load.
mod robots;
