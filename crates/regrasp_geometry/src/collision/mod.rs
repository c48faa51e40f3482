//! Separation of shapes, at rest and along motions.
//!
//! Every answer is of one of three kinds: separated by at least a distance, penetrating, or unresolved; unresolved
//! counts as collision. A separation is always proved by a direction: the supports of both shapes along it are at
//! least that far apart, whatever the search that found the direction did.

/// Which of many balls are near a point.
pub mod ball_tree;
/// The search for a separating direction (GJK).
pub mod gjk;
/// Convex shapes against triangle meshes, through a tree of boxes.
pub mod mesh_tree;
/// Rotation matrix and translation of a shape: the form that support queries want.
pub mod placement;
/// Support functions of convex shapes.
pub mod support;
/// What lies inside a mesh.
mod winding;

pub use ball_tree::{Ball, BallTree};
pub use gjk::{Placed, Separation, separation};
pub use mesh_tree::{HalfSpace, MeshBody, MeshTree};
pub use placement::Placement;
pub use support::gap_along;
