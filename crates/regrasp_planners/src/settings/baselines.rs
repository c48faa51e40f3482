//! Settings of the methods of Saut 2011.

use serde::{Deserialize, Serialize};

/// How often `connect_components` is tried instead of `explore` (Saut 2011, sec. 5.2): alpha is the share of
/// `explore`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Alpha {
    /// The same all along.
    Constant {
        /// Value, in `[0, 1]`.
        value: f64,
    },
    /// From `start`, less by `step` at each attempt to merge components, down to `end` (Saut 2011, box: 0.5, 0.005, 0.3).
    Decreasing {
        /// First value.
        start: f64,
        /// Decrement per attempt.
        step: f64,
        /// Last value.
        end: f64,
    },
    /// Inverse to the size of the graph: `max(end, start / (1 + nodes / scale))` (Saut 2011, sec. 5.2, last remark).
    Adaptive {
        /// Value of the empty graph.
        start: f64,
        /// Lowest value.
        end: f64,
        /// Number of nodes at which the value is halved.
        scale: f64,
    },
    /// Biased by growth (Sahbani 2007, sec. IV-A, which gives no formula): merging has the probability `first` in the empty
    /// graph and comes nearer to `last` as the graph grows, half of the way at `scale` nodes.
    Growing {
        /// Probability of a merge in the empty graph.
        first: f64,
        /// Probability that it tends to.
        last: f64,
        /// Number of nodes at which half of the way is gone.
        scale: f64,
    },
}

impl Alpha {
    /// The share of exploration after `n_merges` attempts to merge components, with `n_nodes` in the graph.
    pub fn value(&self, n_merges: u32, n_nodes: usize) -> f64 {
        match *self {
            Alpha::Constant { value } => value,
            Alpha::Decreasing { start, step, end } => (start - step * f64::from(n_merges)).max(end),
            Alpha::Adaptive { start, end, scale } => (start / (1.0 + n_nodes as f64 / scale)).max(end),
            Alpha::Growing { first, last, scale } => {
                let grown = n_nodes as f64 / (n_nodes as f64 + scale);
                1.0 - (first + (last - first) * grown)
            }
        }
    }

    /// What is wrong with it, if anything.
    pub(super) fn validate(&self) -> Result<(), String> {
        let (shares, above_zero) = match *self {
            Alpha::Constant { value } => ([value, value], 1.0),
            Alpha::Decreasing { start, step, end } => ([start, end], if step >= 0.0 { 1.0 } else { step }),
            Alpha::Adaptive { start, end, scale } => ([start, end], scale),
            Alpha::Growing { first, last, scale } => ([first, last], scale),
        };
        if shares.iter().all(|share| (0.0..=1.0).contains(share)) && above_zero > 0.0 && above_zero.is_finite() {
            return Ok(());
        }
        Err(format!("alpha is {self:?}; shares must be between 0 and 1, a step at least 0, a scale above 0"))
    }
}

/// How the methods of Saut 2011 look for the way of a finger that changes its contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FingerWays {
    /// Over the surface first, then straight in the joints; RRT-Connect where both are blocked. The default.
    SurfaceFirst,
    /// RRT-Connect alone, as Saut 2011, sec. 4.2.3 has it.
    RrtOnly,
}

/// What the methods of Saut 2011 are asked beside.
#[derive(Debug, Clone, PartialEq)]
pub struct BaselineSettings {
    /// Schedule of alpha, for the methods of Saut 2011.
    pub alpha: Alpha,
    /// Share of poses that the methods of Saut 2011 draw near the path from start to goal. The others are drawn
    /// uniformly where the hand reaches, as in Saut 2011, sec. 4.2.2.
    pub guided_share: f64,
    /// Whether contacts may cross edges of the object on paths in GS_n. What lies too near an edge is jumped over: the
    /// finger that holds there changes its contact.
    pub edge_crossings: bool,
    /// How the way of a finger that changes its contact is looked for.
    pub finger_ways: FingerWays,
}

impl Default for BaselineSettings {
    fn default() -> Self {
        BaselineSettings {
            alpha: Alpha::Constant { value: 0.9 },
            guided_share: 0.9,
            edge_crossings: true,
            finger_ways: FingerWays::SurfaceFirst,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_follows_its_schedule() {
        let decreasing = Alpha::Decreasing { start: 0.5, step: 0.005, end: 0.3 };
        assert_eq!([0, 20, 40, 1000].map(|merges| decreasing.value(merges, 7)), [0.5, 0.4, 0.3, 0.3]);
        let adaptive = Alpha::Adaptive { start: 0.9, end: 0.1, scale: 50.0 };
        assert_eq!([0, 50, 1_000_000].map(|nodes| adaptive.value(3, nodes)), [0.9, 0.45, 0.1]);
        // Explores first, merges more and more.
        let growing = Alpha::Growing { first: 0.1, last: 0.7, scale: 100.0 };
        assert_eq!([0, 100].map(|nodes| growing.value(3, nodes)), [0.9, 0.6]);
        assert!((growing.value(0, usize::MAX) - 0.3).abs() < 1e-9);
        for alpha in [decreasing, adaptive, growing, Alpha::Constant { value: 1.0 }] {
            assert_eq!(alpha.validate(), Ok(()));
            let text = serde_json::to_string(&alpha).unwrap();
            assert_eq!(serde_json::from_str::<Alpha>(&text).unwrap(), alpha, "{text}");
        }
        assert!(Alpha::Constant { value: 1.5 }.validate().is_err());
        assert!(Alpha::Decreasing { start: 0.5, step: -0.1, end: 0.3 }.validate().is_err());
        assert!(Alpha::Growing { first: 0.1, last: f64::NAN, scale: 1.0 }.validate().is_err());
        assert!(Alpha::Adaptive { start: 0.9, end: 0.1, scale: 0.0 }.validate().is_err());
    }
}
