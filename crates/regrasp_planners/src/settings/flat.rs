//! In-hand settings as files have them: all keys side by side.

use super::{
    Alpha, BaselineSettings, CostWeights, FingerWays, FirstTry, ImprovementSettings, InHandSettings, Method,
    ReleaseRule, SearchSettings,
};
use regrasp_manipulation::settings::{ForceSettings, PhysicsSettings, SpeedSettings, TransferMode};
use serde::{Deserialize, Serialize};

/// Defines the settings without groups, with their keys in the order of files, and both ways between them and those with groups.
/// A key that one of them lacks does not compile.
macro_rules! flat {
    (fields { $($key:ident: $type:ty,)* } $($group:ident: $group_type:ident { $($field:ident,)* })*) => {
        /// [`InHandSettings`] without groups.
        #[derive(Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub(super) struct FlatSettings {
            method: Method,
            $($key: $type,)*
        }

        impl From<InHandSettings> for FlatSettings {
            fn from(settings: InHandSettings) -> Self {
                let InHandSettings { method, n_threads: _, advise: _, $($group,)* } = settings;
                $(let $group_type { $($field,)* } = $group;)*
                FlatSettings { method, $($($field,)*)* }
            }
        }

        impl From<FlatSettings> for InHandSettings {
            fn from(flat: FlatSettings) -> Self {
                let FlatSettings { method, $($($field,)*)* } = flat;
                InHandSettings { method, n_threads: 1, advise: true, $($group: $group_type { $($field,)* },)* }
            }
        }
    };
}

flat! {
    fields {
        release_rule: ReleaseRule,
        transfer: TransferMode,
        friction_margin: f64,
        closure_margin: f64,
        step: f64,
        clearance: f64,
        edge_margin: f64,
        first_try: Option<FirstTry>,
        contact_allowance: f64,
        limit_margin: f64,
        joint_step: f64,
        lift_heights: Vec<f64>,
        rrt_iterations: usize,
        wander_distance: f64,
        wander_angle: f64,
        far_share: f64,
        passage_share: f64,
        goal_share: f64,
        try_fee: f64,
        aimless_share: f64,
        candidates: usize,
        candidates_kept: usize,
        least_holding: usize,
        transfers_alone: bool,
        free_after: u32,
        free_share: f64,
        restart_work: u64,
        search_work: Option<u64>,
        courses_work: u64,
        shortcuts: usize,
        improve_work: u64,
        long_plan: u64,
        shorten_share: f64,
        shorten_relocation: u64,
        straighten: bool,
        end_margin: f64,
        cost: CostWeights,
        forces: Option<ForceSettings>,
        speed: SpeedSettings,
        alpha: Alpha,
        guided_share: f64,
        edge_crossings: bool,
        finger_ways: FingerWays,
    }
    physics: PhysicsSettings {
        transfer, friction_margin, closure_margin, step, clearance, edge_margin, contact_allowance, limit_margin, joint_step, lift_heights, rrt_iterations, forces, speed,
    }
    search: SearchSettings {
        release_rule, first_try, wander_distance, wander_angle, far_share, passage_share, goal_share, try_fee, aimless_share, candidates, candidates_kept, least_holding, transfers_alone, free_after, free_share, restart_work, search_work, courses_work, shortcuts,
    }
    baselines: BaselineSettings {
        alpha, guided_share, edge_crossings, finger_ways,
    }
    improvement: ImprovementSettings {
        improve_work, long_plan, shorten_share, shorten_relocation, straighten, end_margin, cost,
    }
}

impl Default for FlatSettings {
    fn default() -> Self {
        InHandSettings::default().into()
    }
}
