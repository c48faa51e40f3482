//! Two trees that grow towards each other: RRT-Connect (Kuffner, LaValle 2000), with domains that shrink where motions collide
//! (Jaillet et al. 2005; Thomason et al. 2024).

use super::distance;
use super::tree::Tree;
use regrasp_base::{Budget, Interrupt, Rng};
use regrasp_robot::coupling::LinearLimit;

/// Settings of [`rrt_connect`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RrtSettings {
    /// Longest motion of one extension, in the joints' Euclidean distance.
    pub range: f64,
    /// Radius of the domain of a node of which a motion collided, in 7 coordinates; it grows with the square root of their number.
    pub radius: f64,
    /// By which share domains grow and shrink.
    pub change: f64,
    /// Least radius, as `radius`.
    pub least_radius: f64,
    /// Most samples.
    pub max_samples: u64,
}

impl Default for RrtSettings {
    fn default() -> Self {
        RrtSettings { range: 1.0, radius: 4.0, change: 1e-4, least_radius: 1.0, max_samples: 1_000_000 }
    }
}

impl RrtSettings {
    /// Settings for this many coordinates: in more of them motions are shorter and domains larger.
    pub fn for_dimension(dimension: usize) -> Self {
        match dimension {
            0..=9 => RrtSettings::default(),
            _ => RrtSettings { range: 0.5, radius: 100.0, ..RrtSettings::default() },
        }
    }
}

/// Where configurations are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Lowest values, all finite.
    pub lower: Vec<f64>,
    /// Highest values.
    pub upper: Vec<f64>,
    /// Limits of sums.
    pub linear_limits: Vec<LinearLimit>,
}

impl Region {
    /// The limits of a model. Joints without limits: half a turn about what `ends` have.
    pub fn of(model: &crate::ArmModel, ends: &[&[f64]]) -> Self {
        let around = |k: usize, pick: fn(f64, f64) -> f64| ends.iter().map(|end| end[k]).reduce(pick).unwrap_or(0.0);
        let coordinates = || model.coordinates.iter().enumerate();
        let bound = |limit: f64, otherwise: f64| if limit.is_finite() { limit } else { otherwise };
        let half = std::f64::consts::PI;
        Region {
            lower: coordinates().map(|(k, c)| bound(c.lower, around(k, f64::min) - half)).collect(),
            upper: coordinates().map(|(k, c)| bound(c.upper, around(k, f64::max) + half)).collect(),
            linear_limits: model.linear_limits.clone(),
        }
    }

    /// The region of some coordinates while all others are as in `configuration`.
    pub fn of_part(&self, part: &[usize], configuration: &[f64]) -> Self {
        let mut linear_limits = Vec::new();
        for limit in &self.linear_limits {
            let mut own = limit.clone();
            own.terms.clear();
            for &(k, multiplier) in &limit.terms {
                match part.iter().position(|&other| other == k) {
                    Some(k) => own.terms.push((k, multiplier)),
                    None => {
                        own.lower -= multiplier * configuration[k];
                        own.upper -= multiplier * configuration[k];
                    }
                }
            }
            if !own.terms.is_empty() {
                linear_limits.push(own);
            }
        }
        let own = |values: &[f64]| part.iter().map(|&k| values[k]).collect();
        Region { lower: own(&self.lower), upper: own(&self.upper), linear_limits }
    }

    /// Draws evenly.
    pub fn draw(&self, rng: &mut Rng, into: &mut Vec<f64>) {
        /// Draws that miss the limits of sums.
        const TRIES: usize = 1000;
        for _ in 0..TRIES {
            into.clear();
            into.extend(self.lower.iter().zip(&self.upper).map(|(&low, &high)| rng.uniform(low, high)));
            self.linear_limits.iter().for_each(|limit| limit.settle(into));
            if self.linear_limits.iter().all(|limit| limit.room(into) >= 0.0) {
                return;
            }
        }
    }
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct RrtOutcome {
    /// The path.
    pub path: Option<Vec<Vec<f64>>>,
    /// Nodes of both trees.
    pub n_nodes: usize,
    /// Samples drawn.
    pub n_samples: u64,
    /// What ended a search without a path.
    pub interrupt: Option<Interrupt>,
}

/// A path from `start` to one of `goals`, all of them free. `is_free` says whether the straight motion between two
/// configurations is, its first configuration known to be. One unit of work is one motion.
pub fn rrt_connect(
    start: &[f64],
    goals: &[Vec<f64>],
    region: &Region,
    settings: &RrtSettings,
    rng: &mut Rng,
    budget: &Budget,
    mut is_free: impl FnMut(&[f64], &[f64]) -> bool,
) -> RrtOutcome {
    let dimension = start.len();
    let mut outcome = RrtOutcome { path: None, n_nodes: 0, n_samples: 0, interrupt: None };
    for goal in goals {
        if is_free(start, goal) {
            outcome.path = Some(vec![start.to_vec(), goal.clone()]);
            return outcome;
        }
    }
    let mut trees = [Tree::new(dimension), Tree::new(dimension)];
    trees[0].push(start, 0);
    goals.iter().enumerate().for_each(|(node, goal)| {
        trees[1].push(goal, node);
    });
    let mut work = goals.len() as u64;
    let (mut grows, range) = (0, settings.range);
    let spread = (dimension as f64 / 7.0).sqrt();
    let (radius, least) = ((settings.radius * spread) as f32, (settings.least_radius * spread) as f32);
    let (mut sample, mut next) = (Vec::with_capacity(dimension), vec![0.0; dimension]);
    while outcome.n_samples < settings.max_samples && !goals.is_empty() {
        if outcome.n_samples.is_multiple_of(16)
            && let Err(interrupt) = budget.check(work)
        {
            outcome.interrupt = Some(interrupt);
            break;
        }
        outcome.n_samples += 1;
        // The smaller tree grows.
        if trees[grows].len() >= trees[1 - grows].len() {
            grows = 1 - grows;
        }
        region.draw(rng, &mut sample);
        let (near, squared) = trees[grows].nearest(&sample);
        let far = squared.sqrt();
        if far > trees[grows].radii[near] {
            continue;
        }
        let share = (range / f64::from(far).max(1e-9)).min(1.0);
        between(trees[grows].configuration(near), &sample, share, &mut next);
        work += 1;
        if !is_free(trees[grows].configuration(near), &next) {
            let own = &mut trees[grows].radii[near];
            *own = if own.is_infinite() { radius } else { (*own * (1.0 - settings.change as f32)).max(least) };
            continue;
        }
        let own = &mut trees[grows].radii[near];
        if own.is_finite() {
            *own *= 1.0 + settings.change as f32;
        }
        let mut last = trees[grows].push(&next, near);
        // Towards the other tree as far as it goes.
        let (other, _) = trees[1 - grows].nearest(&next);
        let target = trees[1 - grows].configuration(other).to_vec();
        let first = next.clone();
        let n_steps = (distance(&first, &target) / range).ceil().max(1.0) as usize;
        let mut is_met = true;
        for step in 1..=n_steps {
            if step == n_steps {
                next.copy_from_slice(&target);
            } else {
                between(&first, &target, step as f64 / n_steps as f64, &mut next);
            }
            work += 1;
            if !is_free(trees[grows].configuration(last), &next) {
                is_met = false;
                break;
            }
            if step < n_steps {
                last = trees[grows].push(&next, last);
            }
        }
        if is_met {
            let mut ways = [trees[grows].way_to_root(last), trees[1 - grows].way_to_root(other)];
            if grows == 1 {
                ways.swap(0, 1);
            }
            let [mut path, rest] = ways;
            path.reverse();
            path.extend(rest);
            outcome.path = Some(path);
            break;
        }
    }
    outcome.n_nodes = trees[0].len() + trees[1].len();
    outcome
}

fn between(from: &[f64], to: &[f64], share: f64, into: &mut [f64]) {
    for ((value, a), b) in into.iter_mut().zip(from).zip(to) {
        *value = a + share * (b - a);
    }
}
