//! Sampling-based search in any space. Knows no robot and no pose.
//!
//! The one generic seam is [`Space`]: sample, distance, connect. Searches over joint values of one finger take plain
//! slices and a closure instead ([`rrt_connect`]).

/// Cheapest paths in a graph.
pub mod astar;
/// Connected components of a growing graph.
pub mod components;
/// Nearest neighbours, by looking at all.
pub mod nearest;
/// What a best-first search has still to look at.
pub mod open_list;
/// Two trees that grow towards each other, in a box of real coordinates.
pub mod rrt_connect;
/// Shortcuts.
pub mod smoothing;
/// What a space must answer.
pub mod space;
/// A roadmap that keeps only samples that see nothing known or join what was apart.
pub mod visibility_prm;

pub use astar::{AStar, CheapestPath, Limits, cheapest_path};
pub use components::Components;
pub use open_list::{OpenList, Rank};
pub use rrt_connect::{RrtConnect, RrtSettings};
pub use smoothing::{shorten_path, shorten_polyline};
pub use space::Space;
pub use visibility_prm::{Outcome, VisibilityPrm};

#[cfg(test)]
mod toy_world;
