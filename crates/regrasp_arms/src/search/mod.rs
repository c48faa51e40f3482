//! Paths from configuration to configuration.

/// One arm after the other.
pub mod in_turn;
/// Two trees that grow towards each other.
pub mod rrt_connect;
/// Shorter paths.
pub mod simplify;
/// A tree of configurations.
pub mod tree;

pub use in_turn::{InTurnSettings, in_turn};
pub use rrt_connect::{Region, RrtOutcome, RrtSettings, rrt_connect};
pub use simplify::{SimplifySettings, simplify};
pub use tree::Tree;

/// Euclidean distance.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

/// Length of a path.
pub fn length(path: &[Vec<f64>]) -> f64 {
    path.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum()
}
