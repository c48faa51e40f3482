//! A path: searched for in samples, then made shorter.

use super::Stage;
use super::ends::End;
use super::problem::{KnownRoads, Problem};
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Track};
use crate::roadmap::{Changes, Counts, SuperGraph, Tests};
use crate::search::{
    InTurnSettings, Region, RrtOutcome, RrtSettings, SimplifySettings, in_turn, rrt_connect, simplify,
};
use crate::world::World;
use regrasp_base::{Budget, Rng};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::motion_settings::{MotionMethod, MotionSettings, PartsMove, Validation};
use regrasp_plan::robot_plan::RobotStatistics;
use std::sync::Arc;

/// Samples of a search before the graph is asked.
const BEFORE_GRAPH: u64 = 150;
/// Nodes of the graph that an end is joined to, at most.
const GRAPH_NEIGHBOURS: usize = 30;

/// A path whose straight motions are free.
pub struct Found {
    pub path: Vec<Vec<f64>>,
    pub statistics: RobotStatistics,
    /// True where a graph was asked first and had no way.
    pub is_new: bool,
}

/// Finds a path from `start` to one of `goals` (states). Where samples lead nowhere for want of room, at most `certified_samples` are
/// tried with certified motions alone.
pub fn find(
    problem: &Problem,
    model: &ArmModel,
    (start, goals, certified_samples): (&[f64], &[Vec<f64>], u64),
    settings: &MotionSettings,
    (seed, budget): (u64, &Budget),
    watch: &mut dyn FnMut(Stage),
) -> Result<Found, Failure> {
    let start = model.configuration_of(start);
    let mut refused = None;
    let mut free_goals = Vec::new();
    for goal in goals {
        let goal = model.configuration_of(goal);
        match problem.refuse(model, &goal, End::Goal, settings) {
            Ok(()) => free_goals.push(goal),
            Err(failure) => refused = refused.or(Some(failure)),
        }
    }
    if free_goals.is_empty() {
        let nothing = || Failure::bare(FailureKind::GoalInvalid, "the goal cannot be reached".into(), "");
        return Err(refused.unwrap_or_else(nothing));
    }
    watch(Stage::Prepared);
    let world = Arc::clone(&problem.world);
    let statistics = RobotStatistics::default();
    let mut search = Search { model, world, start, goals: free_goals, settings, statistics, is_new: false };
    let (mut interrupt, mut is_hopeless) = (None, false);
    // With room to certify, then without, then with certified motions only.
    let certified = settings.validation == Validation::Certified;
    for (round, margin) in [settings.search_margin, 0.0].into_iter().enumerate() {
        if !certified && margin > 0.0 {
            continue;
        }
        let clearance = settings.clearance + margin;
        let sampled = ColliderSettings { clearance, resolution: settings.resolution, ..ColliderSettings::default() };
        let mut collider = Collider::new(model, &problem.world, sampled);
        if !collider.is_sampled_free(&search.start, &search.start) {
            continue;
        }
        let mut rng = Rng::keyed(seed, "motion", round as u64);
        let outcome = search.sampled(problem, &mut collider, &mut rng, budget);
        interrupt = outcome.interrupt.or(interrupt);
        watch(Stage::Searched);
        is_hopeless = outcome.path.is_none();
        let Some(path) = outcome.path else { continue };
        let mut simplified: Vec<Vec<f64>> = Vec::new();
        let shortcuts = SimplifySettings { n_shortcuts: settings.shortcuts, ..SimplifySettings::default() };
        for mut run in search.runs(&path) {
            simplify(&mut run, &shortcuts, &mut rng, |a, b| collider.is_sampled_free(a, b));
            simplified.extend(run.into_iter().skip(usize::from(!simplified.is_empty())));
        }
        let path = simplified;
        search.count(&collider);
        watch(Stage::Simplified);
        if !certified {
            return Ok(search.found(path));
        }
        let certified = search.certified(problem, path, &mut rng, budget);
        watch(Stage::Certified);
        if let Some(path) = certified {
            return Ok(search.found(path));
        }
    }
    // What samples do not find, certified motions do not either.
    if certified && interrupt.is_none() && !is_hopeless && settings.parts == PartsMove::AtOnce {
        let mut rng = Rng::keyed(seed, "certified_motion", 0);
        let certified = search.certified_from_nothing(problem, certified_samples, &mut rng, budget);
        watch(Stage::Searched);
        if let Some(path) = certified {
            return Ok(search.found(path));
        }
    }
    let kind = interrupt.map_or(FailureKind::WorkSpent, FailureKind::from);
    let message = format!("no free motion was found in {} samples", search.statistics.samples);
    Err(Failure::bare(kind, message, "try another seed, a larger budget, or a smaller clearance"))
}

struct Search<'m, 's> {
    model: &'m ArmModel,
    world: Arc<World>,
    start: Vec<f64>,
    goals: Vec<Vec<f64>>,
    settings: &'s MotionSettings,
    statistics: RobotStatistics,
    /// True where the graph had no way when it was asked last.
    is_new: bool,
}

impl Search<'_, '_> {
    fn found(self, path: Vec<Vec<f64>>) -> Found {
        Found { path, statistics: self.statistics, is_new: self.is_new }
    }

    fn count(&mut self, collider: &Collider) {
        self.statistics.work += 8 * collider.counts.blocks + collider.counts.exact;
    }

    fn take(&mut self, outcome: &RrtOutcome) {
        self.statistics.nodes += outcome.n_nodes as u64;
        self.statistics.samples += outcome.n_samples;
    }

    fn sampled(&mut self, problem: &Problem, collider: &mut Collider, rng: &mut Rng, budget: &Budget) -> RrtOutcome {
        let all = RrtSettings {
            max_samples: self.settings.max_samples,
            ..RrtSettings::for_dimension(self.model.dimension())
        };
        let goals: Vec<Vec<f64>> =
            self.goals.iter().filter(|goal| collider.is_sampled_free(goal, goal)).cloned().collect();
        let outcome = match (self.settings.method, goals.as_slice()) {
            (_, []) => RrtOutcome { path: None, n_nodes: 0, n_samples: 0, interrupt: None },
            (MotionMethod::InTurn, [goal]) => {
                let few = RrtSettings { max_samples: all.max_samples.min(BEFORE_GRAPH), ..all };
                let parts = self.settings.parts;
                let settings = InTurnSettings { all, parts, ..InTurnSettings::default() };
                let may_use = |known: &&KnownRoads| parts == PartsMove::AtOnce && self.is_of(&known.roads.graph);
                match problem.roads.as_ref().filter(may_use) {
                    None => in_turn(collider, &self.start, goal, &settings, rng, budget),
                    Some(known) => {
                        // What is easy needs no graph.
                        let one = RrtSettings { max_samples: BEFORE_GRAPH, ..settings.one };
                        let easy = InTurnSettings { one, all: few, parts };
                        let mut outcome = in_turn(collider, &self.start, goal, &easy, rng, budget);
                        if outcome.path.is_none() && outcome.interrupt.is_none() {
                            outcome.path = self.by_graph(known, collider.settings, goal);
                            self.is_new = outcome.path.is_none();
                        }
                        if outcome.path.is_none() && outcome.interrupt.is_none() {
                            self.take(&outcome);
                            outcome = in_turn(collider, &self.start, goal, &settings, rng, budget);
                        }
                        outcome
                    }
                }
            }
            _ => {
                let region = Region::of(self.model, &[&self.start, &goals[0]]);
                rrt_connect(&self.start, &goals, &region, &all, rng, budget, |a, b| collider.is_sampled_free(a, b))
            }
        };
        self.take(&outcome);
        outcome
    }

    /// Pieces of a path that are made shorter by themselves: where parts move in turn, those in which the same one moves.
    fn runs(&self, path: &[Vec<f64>]) -> Vec<Vec<Vec<f64>>> {
        if self.settings.parts == PartsMove::AtOnce || path.len() < 2 {
            return vec![path.to_vec()];
        }
        let parts = self.model.parts();
        let all: Vec<Vec<usize>> = parts.arms.into_iter().chain([parts.common]).collect();
        let moving = |pair: &[Vec<f64>]| all.iter().position(|own| own.iter().any(|&k| pair[0][k] != pair[1][k]));
        let mut runs: Vec<Vec<Vec<f64>>> = Vec::new();
        let mut last = None;
        for pair in path.windows(2) {
            let own = moving(pair);
            if runs.is_empty() || own != last {
                runs.push(vec![pair[0].clone()]);
            }
            last = own;
            if let Some(run) = runs.last_mut() {
                run.push(pair[1].clone());
            }
        }
        runs
    }

    /// True where a graph is of these joints.
    fn is_of(&self, graph: &SuperGraph) -> bool {
        graph.joints.iter().eq(self.model.coordinates.iter().map(|coordinate| &coordinate.name))
    }

    /// A path of the graph whose motions are tested against what it does not know.
    fn by_graph(&mut self, known: &KnownRoads, settings: ColliderSettings, goal: &[f64]) -> Option<Vec<Vec<f64>>> {
        let model = self.model;
        let is_changed = |body: usize| known.changed.contains(&model.bodies[body].link);
        let changes = Changes { whole: &self.world, unknown: &known.unknown, is_changed: &is_changed };
        let mut tests = Tests::new(model, &changes, settings);
        let mut counts = Counts::default();
        let path = known
            .roads
            .path([&self.start, goal], GRAPH_NEIGHBOURS, &mut counts, |edge, a, b| tests.is_sampled_free(edge, a, b));
        self.statistics.nodes += counts.expanded;
        self.statistics.work += 8 * counts.tested;
        path
    }

    /// The path with certified motions: what is not free is searched for anew between its ends.
    fn certified(
        &mut self,
        problem: &Problem,
        path: Vec<Vec<f64>>,
        rng: &mut Rng,
        budget: &Budget,
    ) -> Option<Vec<Vec<f64>>> {
        let mut collider = certifying(self.model, problem, self.settings);
        let mut is_free = |a: &[f64], b: &[f64]| collider.is_certified_free(&Track::straight(a, b));
        let mut whole = vec![path[0].clone()];
        let mut is_repaired = false;
        let mut found = true;
        for pair in path.windows(2) {
            if is_free(&pair[0], &pair[1]) {
                whole.push(pair[1].clone());
                continue;
            }
            if self.settings.parts == PartsMove::InTurn {
                found = false;
                break;
            }
            is_repaired = true;
            let region = Region::of(self.model, &[&pair[0], &pair[1]]);
            let few = RrtSettings { max_samples: 500, ..RrtSettings::for_dimension(self.model.dimension()) };
            let goals = [pair[1].clone()];
            let outcome = rrt_connect(&pair[0], &goals, &region, &few, rng, budget, &mut is_free);
            self.statistics.nodes += outcome.n_nodes as u64;
            self.statistics.samples += outcome.n_samples;
            match outcome.path {
                Some(detour) => whole.extend(detour.into_iter().skip(1)),
                None => {
                    found = false;
                    break;
                }
            }
        }
        if found && is_repaired {
            let shortcuts = SimplifySettings { n_shortcuts: self.settings.shortcuts, ..SimplifySettings::default() };
            simplify(&mut whole, &shortcuts, rng, &mut is_free);
            // Places between configurations of certified motions make certified motions.
        }
        self.count(&collider);
        found.then_some(whole)
    }

    fn certified_from_nothing(
        &mut self,
        problem: &Problem,
        max_samples: u64,
        rng: &mut Rng,
        budget: &Budget,
    ) -> Option<Vec<Vec<f64>>> {
        let mut collider = certifying(self.model, problem, self.settings);
        let settings = RrtSettings { max_samples, ..RrtSettings::for_dimension(self.model.dimension()) };
        let region = Region::of(self.model, &[&self.start, &self.goals[0]]);
        let mut is_free = |a: &[f64], b: &[f64]| collider.is_certified_free(&Track::straight(a, b));
        let outcome = rrt_connect(&self.start, &self.goals, &region, &settings, rng, budget, &mut is_free);
        let shortcuts = SimplifySettings { n_shortcuts: self.settings.shortcuts, ..SimplifySettings::default() };
        let path = outcome.path.clone().map(|mut path| {
            simplify(&mut path, &shortcuts, rng, &mut is_free);
            path
        });
        self.count(&collider);
        self.take(&outcome);
        path
    }
}

pub fn certifying<'c>(model: &'c ArmModel, problem: &'c Problem, settings: &MotionSettings) -> Collider<'c> {
    let settings = ColliderSettings { clearance: settings.clearance, ..ColliderSettings::default() };
    Collider::new(model, &problem.world, settings)
}
