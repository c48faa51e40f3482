//! Queries: the graph is searched as if nothing had changed, then the motions of the path are tested against what the graph does not
//! know (Saut 2010, sec. V-B).

use super::roads::{Counts, Edge, Roads};
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Track};
use crate::search::{InTurnSettings, Region, RrtOutcome, RrtSettings, in_turn, rrt_connect};
use crate::world::World;
use regrasp_base::{Budget, Interrupt, Rng};
use std::collections::BTreeSet;

/// Settings of [`query`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuerySettings {
    /// Nodes of the graph that start and goal are tried to be connected with.
    pub n_neighbours: usize,
    /// Most samples of one local search.
    pub max_samples: u64,
    /// Distance that the search keeps besides the graph's, in metres, so that its motions can be certified.
    pub search_margin: f64,
    /// Configurations per radian or metre that the search looks at.
    pub resolution: f64,
}

impl Default for QuerySettings {
    fn default() -> Self {
        QuerySettings { n_neighbours: 30, max_samples: 100_000, search_margin: 2e-3, resolution: 32.0 }
    }
}

/// What a query found.
#[derive(Debug, Clone, PartialEq)]
pub struct QueryOutcome {
    /// The path.
    pub path: Option<Vec<Vec<f64>>>,
    /// Paths of the graph that were looked at.
    pub n_paths: u64,
    /// Motions of the graph that were tested anew.
    pub n_tested: u64,
    /// Nodes that local searches added to the graph.
    pub n_added: u64,
    /// What ended a search without a path.
    pub interrupt: Option<Interrupt>,
}

/// What a graph does not know.
pub struct Changes<'c> {
    /// Everything that rests now.
    pub whole: &'c World,
    /// What the graph does not know of that.
    pub unknown: &'c World,
    /// Bodies of the robot that are not as the graph has them, besides those that are attached.
    pub is_changed: &'c dyn Fn(usize) -> bool,
}

/// Tests of what a graph does not know, and of everything.
pub struct Tests<'c> {
    /// Everything.
    pub all: Collider<'c>,
    /// What rests and is new against the robot, and pairs with bodies that are new.
    new: Collider<'c>,
    /// Bodies that are new against what rests.
    changed: Option<Collider<'c>>,
}

impl<'c> Tests<'c> {
    /// Of a robot among what has changed.
    pub fn new(model: &'c ArmModel, changes: &Changes<'c>, settings: ColliderSettings) -> Self {
        let is_new = |body: usize| model.bodies[body].attached.is_some() || (changes.is_changed)(body);
        let mut new = Collider::new(model, changes.unknown, settings);
        new.only(|_| true, |[a, b]| is_new(a) || is_new(b));
        let changed = (0..model.bodies.len()).any(is_new).then(|| {
            let mut changed = Collider::new(model, changes.whole, settings);
            changed.only(is_new, |_| false);
            changed
        });
        Tests { all: Collider::new(model, changes.whole, settings), new, changed }
    }

    /// True where samples of a motion are free.
    pub fn is_sampled_free(&mut self, edge: Edge, from: &[f64], to: &[f64]) -> bool {
        match edge {
            Edge::Known(_) => {
                self.new.is_sampled_free(from, to)
                    && self.changed.as_mut().is_none_or(|changed| changed.is_sampled_free(from, to))
            }
            Edge::FromStart | Edge::ToGoal => self.all.is_sampled_free(from, to),
        }
    }

    /// True where a motion is free at every moment.
    pub fn is_certified_free(&mut self, edge: Edge, from: &[f64], to: &[f64]) -> bool {
        let track = Track::straight(from, to);
        match edge {
            Edge::Known(_) => {
                self.new.is_certified_free(&track)
                    && self.changed.as_mut().is_none_or(|changed| changed.is_certified_free(&track))
            }
            Edge::FromStart | Edge::ToGoal => self.all.is_certified_free(&track),
        }
    }
}

/// Paths that are looked at where motions of the ones before could not be certified.
const MOST_PATHS: u64 = 30;

/// A path of certified motions from the first to the second of `ends`. The graph is searched with samples of the motions that it takes,
/// tested against what it does not know; then the path is certified. Where the graph has no way, a search joins the ends, and its path
/// enriches the graph.
pub fn query(
    roads: &mut Roads,
    model: &ArmModel,
    changes: &Changes,
    ends: [&[f64]; 2],
    settings: &QuerySettings,
    (seed, budget): (u64, &Budget),
) -> QueryOutcome {
    let clearance = roads.graph.clearance;
    let of = |margin: f64| ColliderSettings {
        clearance: clearance + margin,
        resolution: settings.resolution,
        ..ColliderSettings::default()
    };
    let mut exact = Tests::new(model, changes, of(0.0));
    let mut outcome = QueryOutcome { path: None, n_paths: 0, n_tested: 0, n_added: 0, interrupt: None };
    if exact.is_certified_free(Edge::FromStart, ends[0], ends[1]) {
        outcome.path = Some(ends.iter().map(|end| end.to_vec()).collect());
        return outcome;
    }
    let mut sampled = Tests::new(model, changes, of(settings.search_margin));
    // By the bits of both ends: motions that could not be certified.
    let mut refused: BTreeSet<Vec<u64>> = BTreeSet::new();
    let key = |a: &[f64], b: &[f64]| -> Vec<u64> { a.iter().chain(b).map(|x| x.to_bits()).collect() };
    let mut counts = Counts::default();
    while outcome.n_paths < MOST_PATHS {
        if let Err(interrupt) = budget.check(counts.tested) {
            outcome.interrupt = Some(interrupt);
            break;
        }
        let found = roads.path(ends, settings.n_neighbours, &mut counts, |edge, a, b| {
            (refused.is_empty() || !refused.contains(&key(a, b))) && sampled.is_sampled_free(edge, a, b)
        });
        let Some(path) = found else { break };
        outcome.n_paths += 1;
        let n = path.len() - 1;
        let edge = |k: usize| match k {
            0 => Edge::FromStart,
            k if k + 1 == n => Edge::ToGoal,
            _ => Edge::Known([0, 0]),
        };
        let mut is_proved = true;
        for (k, pair) in path.windows(2).enumerate() {
            if !exact.is_certified_free(edge(k), &pair[0], &pair[1]) {
                refused.insert(key(&pair[0], &pair[1]));
                is_proved = false;
            }
        }
        if is_proved {
            outcome.path = Some(path);
            break;
        }
    }
    outcome.n_tested = counts.tested;
    if outcome.path.is_none() && outcome.interrupt.is_none() {
        let found = join([&mut exact.all, &mut sampled.all], ends, settings, (seed, budget));
        outcome.interrupt = found.interrupt;
        // Bodies that are not as the graph has them may be in the way where it has them.
        if let Some(path) = &found.path
            && !(0..model.bodies.len()).any(changes.is_changed)
        {
            roads.add(path, &mut exact.all);
            outcome.n_added = path.len() as u64;
        }
        outcome.path = found.path;
    }
    outcome
}

/// A search between the ends without the graph.
fn join(
    [exact, sampled]: [&mut Collider; 2],
    ends: [&[f64]; 2],
    settings: &QuerySettings,
    (seed, budget): (u64, &Budget),
) -> RrtOutcome {
    let model = exact.model;
    let all = RrtSettings { max_samples: settings.max_samples, ..RrtSettings::for_dimension(model.dimension()) };
    let mut rng = Rng::keyed(seed, "roadmap_query", 0);
    let parts = InTurnSettings { all, ..InTurnSettings::default() };
    let found = in_turn(sampled, ends[0], ends[1], &parts, &mut rng, budget);
    let mut is_certified = |p: &[f64], q: &[f64]| exact.is_certified_free(&Track::straight(p, q));
    let is_proved =
        found.path.as_ref().is_some_and(|path| path.windows(2).all(|pair| is_certified(&pair[0], &pair[1])));
    if is_proved || found.interrupt.is_some() {
        return found;
    }
    let region = Region::of(model, &ends);
    rrt_connect(ends[0], &[ends[1].to_vec()], &region, &all, &mut rng, budget, is_certified)
}
