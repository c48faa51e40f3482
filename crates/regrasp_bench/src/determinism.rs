//! The same bytes on any number of threads.

use crate::row::{Problem, status_of};
use regrasp_base::{Budget, files};
use regrasp_planners::{InHandSettings, Progress, plan_in_hand};
use regrasp_scene::HandView;

/// One query with each number of threads.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Scene.
    pub scene: String,
    /// Seed.
    pub seed: u64,
    /// Per number of threads: SHA-256 of the plan file's bytes, or of the failure without its times.
    pub digests: Vec<(usize, String)>,
    /// `solved`, or the kind of failure, with the first number of threads.
    pub status: String,
}

impl Comparison {
    /// True when all digests are equal.
    pub fn is_same(&self) -> bool {
        self.digests.windows(2).all(|pair| pair[0].1 == pair[1].1)
    }
}

/// Plans `problem` with each number of threads; only work is limited.
pub fn compare(problem: Problem, settings: &InHandSettings, budget: &Budget, threads: &[usize]) -> Comparison {
    let mut comparison =
        Comparison { scene: problem.name(), seed: problem.seed, digests: Vec::new(), status: String::new() };
    let view = HandView::of(&problem.task);
    let query = problem.query.as_in_hand().expect("campaigns refuse scenes of other tasks");
    for &n_threads in threads {
        let settings = InHandSettings { n_threads, ..settings.clone() };
        let silent = |_: Progress| {};
        let (status, bytes) = match plan_in_hand(&view, query, &settings, problem.seed, budget, &silent) {
            Ok(plan) => ("solved".to_owned(), regrasp_plan::format::to_json(&plan)),
            Err(failure) => (status_of(&failure), serde_json::to_string(&failure).unwrap_or_default()),
        };
        if comparison.status.is_empty() {
            comparison.status = status;
        }
        comparison.digests.push((n_threads, files::sha256(bytes.as_bytes())));
    }
    comparison
}
