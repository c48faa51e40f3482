//! Queries of bundled scenes by their kind, and plans judged as answers to them.

use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Report, check};
use regrasp_scene::{InHandQuery, LoadedScene, Query, TrackingQuery};

/// What a scene with one task asks for, and whether a plan answers it.
pub trait Queries {
    /// The query of `seed` of an in-hand task.
    fn in_hand(&self, seed: u64) -> InHandQuery;
    /// The query of `seed` of a tracking task.
    fn tracking(&self, seed: u64) -> TrackingQuery;
    /// What the checker says of `plan` as an answer to `query`.
    fn judge<Q: Clone + Into<Query>>(&self, query: &Q, plan: &Plan, settings: &CheckSettings) -> Report;
}

impl Queries for LoadedScene {
    fn in_hand(&self, seed: u64) -> InHandQuery {
        self.task().query(seed).as_in_hand().cloned().expect("an in-hand task")
    }

    fn tracking(&self, seed: u64) -> TrackingQuery {
        self.task().query(seed).as_tracking().cloned().expect("a tracking task")
    }

    fn judge<Q: Clone + Into<Query>>(&self, query: &Q, plan: &Plan, settings: &CheckSettings) -> Report {
        check((&self.scene, &self.state), Some(&query.clone().into()), plan, settings)
    }
}
