//! Frictionless point contact: forces along the inward normal, and nothing else.
//!
//! The cone is a ray; its space has one dimension.

use super::{Components, Directions};

/// Distance of the force from the end of the ray, positive inside.
#[inline]
pub fn depth(components: &Components) -> f64 {
    components.normal
}

/// Largest work over forces whose normal component is one.
#[inline]
pub fn support(directions: &Directions) -> f64 {
    directions.normal
}
