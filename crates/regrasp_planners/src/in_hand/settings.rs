//! Settings of the in-hand planner. Every default says where it comes from.

use serde::{Deserialize, Serialize};

/// Which algorithm plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Gait tree: transfer as far as possible, relocate with look-ahead, restart. The default, by measurement.
    Gait,
    /// Paper 000: visibility PRM in GS_n, components joined by transfer-regrasp paths, dichotomic decomposition.
    Visibility,
    /// Paper 000's baseline: visibility PRM whose local method is one transfer-regrasp or regrasp-transfer.
    Classic,
}

/// Settings of [`super::plan_in_hand`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InHandSettings {
    /// Algorithm.
    pub method: Method,
    /// Threads that may search at once; the plan does not depend on it. At least 1.
    pub n_threads: usize,
    /// Closure margin asked of every holding set; dimensionless, in [0, 1). See `regrasp_grasp::margin`.
    pub closure_margin: f64,
}

impl Default for InHandSettings {
    fn default() -> Self {
        InHandSettings { method: Method::Gait, n_threads: 1, closure_margin: 0.005 }
    }
}
