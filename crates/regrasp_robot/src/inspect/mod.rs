//! What a robot and a hand are like.

/// Fingers and tips guessed from a robot alone.
pub(crate) mod guess;
/// Rest postures.
mod rest;
/// Spheres fitted to the distal end of a link.
mod tip_sphere;
