//! Settings of the in-hand planner. Those of tracking have them too, as its keys in files are the same.

/// The methods of Saut 2011.
mod baselines;
/// As files have them.
mod flat;
/// The improvement of plans.
mod improvement;
/// All of them, in groups.
mod in_hand;
/// The search.
mod search;

pub use baselines::{Alpha, BaselineSettings, FingerWays};
pub use improvement::{CostWeights, ImprovementSettings};
pub use in_hand::InHandSettings;
pub use search::{FirstTry, Method, ReleaseRule, SearchSettings};
