//! Short searches from a pose: what a search with little work finds, one with more finds often.

use crate::in_hand::{Asked, plan_with};
use crate::settings::{ImprovementSettings, InHandSettings, SearchSettings};
use regrasp_base::Budget;
use regrasp_geometry::Pose;
use regrasp_geometry::frame::pose_distance;
use regrasp_manipulation::failure::{Failure, FailureKind};
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
    // Refusals before the search have no way behind them.
    let has_searched = matches!(failure.kind, FailureKind::WorkSpent | FailureKind::TimeLimit);
    let Some(miss) = failure.nearest_miss.as_ref().filter(|_| has_searched) else { return 0.0 };
    let poses = query.poses();
    let legs: Vec<f64> = poses.windows(2).map(|leg| pose_distance(&leg[0], &leg[1], turn_length)).collect();
    let way: f64 = legs.iter().sum();
    // The miss is measured to the end of the leg that failed; a query of one leg does not number it.
    let failed = failure.leg.unwrap_or(1) - 1;
    let left = miss.distance_left + turn_length * miss.angle_left;
    let behind = legs[..failed].iter().sum::<f64>() + (legs[failed] - left).max(0.0);
    if way > 0.0 { behind / way } else { 0.0 }
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
    short.improvement = ImprovementSettings::none();
    let silent = |_: Progress| {};
    let mut probes = Vec::with_capacity(queries.len());
    for query in queries {
        let query = query.started_at(world_from_object);
        let seen = view.hand_from_world().map(|hand_from_world| query.seen_from(&hand_from_world));
        let asked = Asked { view, query: seen.as_ref().unwrap_or(&query), seed, progress: &silent };
        let limits = Budget { max_work: work, ..budget.clone() };
        probes.push(match plan_with(&asked, &short, &limits, work, false) {
            Ok(plan) => Probe {
                work: plan.statistics.work,
                n_solved: 1,
                ways: Vec::new(),
                plan: Some(Box::new(plan_in_world(view, &query.name, plan))),
            },
            Err(failure) if failure.kind == FailureKind::Interrupted => {
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use regrasp_manipulation::failure::NearestMiss;
    use regrasp_plan::plan::PoseData;
    use regrasp_robot::LoadOptions;

    /// A search that stopped short of the end of its leg by `angle_left`, in radians, and `distance_left`, in metres.
    fn short_of(kind: FailureKind, leg: Option<usize>, angle_left: f64, distance_left: f64) -> Failure {
        let world_from_object = PoseData::from(&Pose::identity());
        let miss = NearestMiss { world_from_object, angle_left, distance_left, joints: Vec::new() };
        Failure { leg, nearest_miss: Some(Box::new(miss)), ..Failure::bare(kind, String::new(), "") }
    }

    #[test]
    fn the_way_behind_is_measured_over_all_legs() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
        let loaded = regrasp_scene::load_scene(&path, &LoadOptions::default()).unwrap();
        let query = loaded.task().query(0).as_in_hand().unwrap().clone();
        let start = query.world_from_object_start;
        let moved = |angle: f64, along: f64| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
            Pose::from_parts(start.translation * Translation3::new(along, 0.0, 0.0), turn * start.rotation)
        };
        // A turn by 1 rad, which counts as 0.05 m, and then 0.05 m along x.
        let one =
            InHandQuery { world_from_object_goal: moved(1.0, 0.0), world_from_object_way: vec![], ..query.clone() };
        let two = InHandQuery {
            world_from_object_way: vec![moved(1.0, 0.0)],
            world_from_object_goal: moved(1.0, 0.05),
            ..query.clone()
        };
        let spent = FailureKind::WorkSpent;
        for (query, failure, expected) in [
            (&one, short_of(spent, None, 0.25, 0.0), 0.75),
            (&one, short_of(spent, None, 0.25, 0.0125), 0.5),
            (&one, short_of(spent, None, 3.0, 0.0), 0.0),
            (&one, short_of(FailureKind::StartInvalid, None, 0.0, 0.0), 0.0),
            (&one, Failure::bare(spent, String::new(), ""), 0.0),
            (&two, short_of(spent, Some(1), 0.0, 0.0), 0.5),
            (&two, short_of(spent, Some(2), 0.0, 0.025), 0.75),
        ] {
            let way = way_behind(query, &failure, 0.05);
            assert!((way - expected).abs() < 1e-9, "{way} {expected}");
        }
    }
}
