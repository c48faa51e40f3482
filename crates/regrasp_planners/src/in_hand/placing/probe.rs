//! Short searches from a pose: what a search with little work finds, one with more finds often.

use crate::in_hand::{Asked, plan_with};
use crate::settings::{InHandSettings, SearchSettings};
use regrasp_base::Budget;
use regrasp_geometry::Pose;
use regrasp_manipulation::failure::Failure;
use regrasp_manipulation::in_world::plan_in_world;
use regrasp_manipulation::progress::Progress;
use regrasp_plan::Plan;
use regrasp_scene::{HandView, InHandQuery};

/// What a short search came to.
#[derive(Debug, Clone)]
pub struct Probe {
    /// The plan that it found, not shortened; none where it found none.
    pub plan: Option<Box<Plan>>,
    /// Configurations that it looked at.
    pub work: u64,
    /// Number of searches that found a plan: of several made one after the other.
    pub n_solved: u32,
}

impl Probe {
    /// Adds another search for the same.
    pub fn add(&mut self, other: Probe) {
        self.work += other.work;
        self.n_solved += other.n_solved;
        self.plan = self.plan.take().or(other.plan);
    }

    /// True when it found a plan.
    pub fn is_solved(&self) -> bool {
        self.plan.is_some()
    }
}

/// Searches from `world_from_object` for every query, each with `work`. Errors: the caller asked to stop.
pub fn probe(
    view: &HandView,
    queries: &[InHandQuery],
    world_from_object: &Pose,
    (settings, seed, budget): (&InHandSettings, u64, &Budget),
    work: u64,
) -> Result<Vec<Probe>, Failure> {
    let search = SearchSettings { first_try: None, shortcuts: 0, ..settings.search.clone() };
    let mut short = InHandSettings { search, n_threads: 1, ..settings.clone() };
    (short.improvement.improve_work, short.improvement.shorten_share) = (0, 0.0);
    let silent = |_: Progress| {};
    let mut probes = Vec::with_capacity(queries.len());
    for query in queries {
        let query = query.started_at(world_from_object);
        let seen = view.hand_from_world().map(|hand_from_world| query.seen_from(&hand_from_world));
        let asked = Asked { view, query: seen.as_ref().unwrap_or(&query), seed, progress: &silent };
        let limits = Budget { max_work: work, ..budget.clone() };
        probes.push(match plan_with(&asked, &short, &limits, work) {
            Ok(plan) => Probe {
                work: plan.statistics.work,
                n_solved: 1,
                plan: Some(Box::new(plan_in_world(view, &query.name, plan))),
            },
            Err(failure) if failure.kind == regrasp_manipulation::failure::FailureKind::Interrupted => {
                return Err(failure);
            }
            Err(failure) => Probe { plan: None, work: failure.statistics.work, n_solved: 0 },
        });
    }
    Ok(probes)
}
