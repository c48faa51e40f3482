//! The plan as it is written to a file.

/// Pieces of plans with forces and times.
pub mod pieces;
/// A plan of given segments.
pub mod plan;
/// A plan in the making.
pub mod recorder;
/// What a waypoint says when it is read back.
pub mod waypoint;
