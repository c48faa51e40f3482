//! Two trees that grow towards each other, in a box of real coordinates.
//!
//! RRT-Connect: Kuffner, LaValle 2000, doi:10.1109/ROBOT.2000.844730; names follow their Figs. 2 and 5.

use crate::nearest::squared_distance;
use crate::smoothing::shorten_polyline;
use regrasp_base::Rng;
use std::cell::Cell;

/// Settings of [`RrtConnect::plan`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RrtSettings {
    /// Samples drawn before giving up. Default 120 (by measurement on a prototype).
    pub max_iterations: usize,
    /// Straight motions checked before giving up.
    pub max_checks: usize,
    /// Longest straight motion of an extension, in the coordinates' unit (Euclidean norm).
    pub step: f64,
    /// Shortcuts tried on a path found.
    pub n_shortcuts: usize,
}

impl Default for RrtSettings {
    fn default() -> Self {
        RrtSettings { max_iterations: 120, max_checks: 2000, step: 0.3, n_shortcuts: 10 }
    }
}

/// Points of one tree, flat.
#[derive(Debug, Clone, Default)]
struct Tree {
    values: Vec<f64>,
    parents: Vec<usize>,
}

impl Tree {
    fn restart(&mut self, root: &[f64]) {
        self.values.clear();
        self.parents.clear();
        self.push(root, 0);
    }

    fn push(&mut self, point: &[f64], parent: usize) -> usize {
        self.values.extend_from_slice(point);
        self.parents.push(parent);
        self.parents.len() - 1
    }

    fn point(&self, node: usize, dimension: usize) -> &[f64] {
        &self.values[node * dimension..(node + 1) * dimension]
    }

    fn nearest(&self, point: &[f64]) -> usize {
        let mut best = (f64::INFINITY, 0);
        for (node, other) in self.values.chunks_exact(point.len()).enumerate() {
            let distance = squared_distance(other, point);
            if distance < best.0 {
                best = (distance, node);
            }
        }
        best.1
    }

    /// Points from `node` to the root.
    fn way_to_root(&self, node: usize, dimension: usize) -> Vec<Vec<f64>> {
        let mut way = vec![self.point(node, dimension).to_vec()];
        let mut node = node;
        while node != 0 {
            node = self.parents[node];
            way.push(self.point(node, dimension).to_vec());
        }
        way
    }
}

/// How an extension ended.
enum Extension {
    /// The target is a node of the tree now: this one.
    Reached(usize),
    /// A step towards it was made, to this node.
    Advanced(usize),
    /// Not a step was valid.
    Trapped,
}

/// Memory of the search, to be used again and again.
#[derive(Debug, Clone, Default)]
pub struct RrtConnect {
    trees: [Tree; 2],
    sample: Vec<f64>,
    next: Vec<f64>,
}

impl RrtConnect {
    /// Empty memory.
    pub fn new() -> Self {
        RrtConnect::default()
    }

    /// A path of valid straight motions from `start` to `goal` within `bounds`, the least and the largest coordinates, both ends included; none when
    /// the budget of `settings` was not enough.
    ///
    /// `is_valid` says whether the straight motion between two points, ends included, is valid. `start` and `goal`
    /// must be valid. Panics unless all four slices are equally long and not empty.
    pub fn plan(
        &mut self,
        start: &[f64],
        goal: &[f64],
        bounds: [&[f64]; 2],
        settings: &RrtSettings,
        rng: &mut Rng,
        mut is_valid: impl FnMut(&[f64], &[f64]) -> bool,
    ) -> Option<Vec<Vec<f64>>> {
        let [lower, upper] = bounds;
        let dimension = start.len();
        assert!(dimension > 0 && [goal.len(), lower.len(), upper.len()] == [dimension; 3], "one value per dimension");
        if is_valid(start, goal) {
            return Some(vec![start.to_vec(), goal.to_vec()]);
        }
        // Nothing is valid once the checks are used up.
        let checks_left = Cell::new(settings.max_checks);
        let mut check = |a: &[f64], b: &[f64]| {
            checks_left.set(checks_left.get().saturating_sub(1));
            checks_left.get() > 0 && is_valid(a, b)
        };
        self.trees[0].restart(start);
        self.trees[1].restart(goal);
        let mut meeting = None;
        for iteration in 0..settings.max_iterations {
            if checks_left.get() == 0 {
                break;
            }
            self.sample.clear();
            self.sample.extend(lower.iter().zip(upper).map(|(&low, &high)| rng.uniform(low, high)));
            let [from_start, from_goal] = &mut self.trees;
            let start_grows = iteration % 2 == 0;
            let (growing, other) = if start_grows { (from_start, from_goal) } else { (from_goal, from_start) };
            let node = match extend(growing, &self.sample, settings.step, &mut self.next, &mut check) {
                Extension::Reached(node) | Extension::Advanced(node) => node,
                Extension::Trapped => continue,
            };
            let target = growing.point(node, dimension);
            if let Some(met) = connect(other, target, settings.step, &mut self.next, &mut check) {
                meeting = Some(if start_grows { (node, met) } else { (met, node) });
                break;
            }
        }
        let (in_start_tree, in_goal_tree) = meeting?;
        let mut path = self.trees[0].way_to_root(in_start_tree, dimension);
        path.reverse();
        path.extend(self.trees[1].way_to_root(in_goal_tree, dimension).into_iter().skip(1));
        shorten_polyline(&mut path, settings.n_shortcuts, rng, is_valid);
        Some(path)
    }
}

/// EXTEND of the paper: one step from the nearest node towards `target`.
fn extend(
    tree: &mut Tree,
    target: &[f64],
    step: f64,
    next: &mut Vec<f64>,
    is_valid: &mut impl FnMut(&[f64], &[f64]) -> bool,
) -> Extension {
    let near = tree.nearest(target);
    extend_from(tree, near, target, step, next, is_valid)
}

/// CONNECT of the paper: steps towards `target` until it is reached; the node there.
fn connect(
    tree: &mut Tree,
    target: &[f64],
    step: f64,
    next: &mut Vec<f64>,
    is_valid: &mut impl FnMut(&[f64], &[f64]) -> bool,
) -> Option<usize> {
    let mut near = tree.nearest(target);
    loop {
        match extend_from(tree, near, target, step, next, is_valid) {
            Extension::Reached(node) => return Some(node),
            Extension::Advanced(node) => near = node,
            Extension::Trapped => return None,
        }
    }
}

/// One step from `near` towards `target`.
fn extend_from(
    tree: &mut Tree,
    near: usize,
    target: &[f64],
    step: f64,
    next: &mut Vec<f64>,
    is_valid: &mut impl FnMut(&[f64], &[f64]) -> bool,
) -> Extension {
    let from = tree.point(near, target.len());
    let distance = squared_distance(from, target).sqrt();
    let reached = distance <= step;
    next.clear();
    if reached {
        next.extend_from_slice(target);
    } else {
        next.extend(from.iter().zip(target).map(|(a, b)| a + (b - a) * (step / distance)));
    }
    if !is_valid(from, next) {
        return Extension::Trapped;
    }
    let node = tree.push(next, near);
    if reached { Extension::Reached(node) } else { Extension::Advanced(node) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy_world::Toy;

    #[test]
    fn finds_a_path_exactly_where_flood_fill_does() {
        let mut rng = Rng::keyed(1, "rrt_toy", 0);
        let mut search = RrtConnect::new();
        let settings = RrtSettings { max_iterations: 4000, max_checks: 200_000, step: 0.7, n_shortcuts: 20 };
        let (mut n_connected, mut n_cut) = (0, 0);
        for _ in 0..120 {
            let toy = Toy::random(7, 0.35, &mut rng);
            let (start, goal) = (toy.free_point(&mut rng), toy.free_point(&mut rng));
            let colours = toy.flood();
            let connected = colours[toy.cell(&start)] == colours[toy.cell(&goal)];
            let path =
                search.plan(&start, &goal, [&[0.0; 2], &[toy.size(); 2]], &settings, &mut rng, |a, b| toy.sees(a, b));
            assert_eq!(path.is_some(), connected, "{start:?} to {goal:?}");
            let Some(path) = path else {
                n_cut += 1;
                continue;
            };
            assert!(path.windows(2).all(|w| toy.sees(&w[0], &w[1])));
            assert_eq!((&path[0], &path[path.len() - 1]), (&start, &goal));
            n_connected += 1;
        }
        assert!(n_connected > 30 && n_cut > 15, "{n_connected} {n_cut}");
    }

    #[test]
    fn the_budget_is_kept_and_the_same_stream_gives_the_same_path() {
        let mut rng = Rng::keyed(2, "rrt_toy", 0);
        let toy = Toy::new(3, &[(1, 0), (1, 1), (1, 2)]);
        let mut n_checks = 0;
        let settings = RrtSettings { max_iterations: usize::MAX, max_checks: 500, step: 0.2, n_shortcuts: 5 };
        let cut = RrtConnect::new().plan(&[0.5; 2], &[2.5; 2], [&[0.0; 2], &[3.0; 2]], &settings, &mut rng, |a, b| {
            n_checks += 1;
            n_checks > 1_000_000 || toy.sees(a, b)
        });
        assert!(cut.is_none() && n_checks <= 501, "{n_checks}");
        let toy = Toy::new(3, &[(1, 0), (1, 1)]);
        let mut search = RrtConnect::new();
        let settings = RrtSettings { max_iterations: 500, ..RrtSettings::default() };
        let mut run = || {
            let mut rng = Rng::keyed(3, "rrt_toy", 0);
            search.plan(&[0.5; 2], &[2.5, 0.5], [&[0.0; 2], &[3.0; 2]], &settings, &mut rng, |a, b| toy.sees(a, b))
        };
        let first = run();
        assert!(first.is_some());
        assert_eq!(first, run());
    }
}
