//! Short searches from a pose: what a search with little work finds, one with more finds often.

use crate::in_hand::{Asked, plan_with};
use crate::settings::{InHandSettings, SearchSettings};
use regrasp_base::Budget;
use regrasp_geometry::frame::pose_distance;
use regrasp_geometry::{Pose, frame};
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
    /// How far those that found none came, a share of the way from start to goal for each.
    pub ways: Vec<f64>,
}

impl Probe {
    /// Adds another search for the same.
    pub fn add(&mut self, other: Probe) {
        self.work += other.work;
        self.n_solved += other.n_solved;
        self.plan = self.plan.take().or(other.plan);
        self.ways.extend(other.ways);
    }

    /// True when it found a plan.
    pub fn is_solved(&self) -> bool {
        self.plan.is_some()
    }

    /// How far searches without a plan came on the mean, of the way from start to goal; 0 where there were none.
    pub fn mean_way(&self) -> f64 {
        self.ways.iter().sum::<f64>() / self.ways.len().max(1) as f64
    }
}

/// The share of the way from start to goal, over all legs, that a failed search for `query` has behind it where it came nearest, in 0..1.
/// `turn_length` weighs angles, in metres.
fn way_behind(query: &InHandQuery, failure: &Failure, turn_length: f64) -> f64 {
    let Some(miss) = &failure.nearest_miss else { return 0.0 };
    let nearest = Pose::from(&miss.world_from_object);
    let poses = query.poses();
    let far = |a: &Pose, b: &Pose| pose_distance(a, b, turn_length);
    let mut behind = 0.0;
    let mut best: f64 = 0.0;
    for leg in poses.windows(2) {
        let length = far(&leg[0], &leg[1]);
        // The miss is of one of the legs, of that whose end it is measured to.
        if (frame::rotation_between(&nearest, &leg[1]).norm() - miss.angle_left).abs() < 1e-6 {
            best = best.max(behind + (length - far(&nearest, &leg[1])).max(0.0));
        }
        behind += length;
    }
    if behind > 0.0 { best / behind } else { 0.0 }
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
                ways: Vec::new(),
                plan: Some(Box::new(plan_in_world(view, &query.name, plan))),
            },
            Err(failure) if failure.kind == regrasp_manipulation::failure::FailureKind::Interrupted => {
                return Err(failure);
            }
            Err(failure) => Probe {
                plan: None,
                work: failure.statistics.work,
                n_solved: 0,
                ways: vec![way_behind(asked.query, &failure, view.object.radius)],
            },
        });
    }
    Ok(probes)
}
