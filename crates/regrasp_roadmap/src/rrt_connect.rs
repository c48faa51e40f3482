//! Two trees that grow towards each other, in a box of real coordinates.
//!
//! RRT-Connect: Kuffner, LaValle 2000, doi:10.1109/ROBOT.2000.844730; names follow their Figs. 2 and 5.

use crate::nearest::squared_distance;
use crate::smoothing::shorten_polyline;
use regrasp_base::Rng;

/// Settings of [`RrtConnect::plan`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RrtSettings {
    /// Samples drawn before giving up. Default 120 (real-hands-notes.md, section 2: twice its 60).
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

    /// A path of valid straight motions from `start` to `goal` within `lower..=upper`, both ends included; none when
    /// the budget of `settings` was not enough.
    ///
    /// `is_valid` says whether the straight motion between two points, ends included, is valid. `start` and `goal`
    /// must be valid. Panics unless all four slices are equally long and not empty.
    pub fn plan(
        &mut self,
        start: &[f64],
        goal: &[f64],
        lower: &[f64],
        upper: &[f64],
        settings: &RrtSettings,
        rng: &mut Rng,
        mut is_valid: impl FnMut(&[f64], &[f64]) -> bool,
    ) -> Option<Vec<Vec<f64>>> {
        let dimension = start.len();
        assert!(dimension > 0 && [goal.len(), lower.len(), upper.len()] == [dimension; 3], "one value per dimension");
        if is_valid(start, goal) {
            return Some(vec![start.to_vec(), goal.to_vec()]);
        }
        let mut n_checks = 1;
        let mut counted = |a: &[f64], b: &[f64]| {
            n_checks += 1;
            (is_valid(a, b), n_checks >= settings.max_checks)
        };
        self.trees[0].restart(start);
        self.trees[1].restart(goal);
        let mut active = 0;
        for _ in 0..settings.max_iterations {
            self.sample.clear();
            self.sample.extend(lower.iter().zip(upper).map(|(&low, &high)| rng.uniform(low, high)));
            let [first, second] = &mut self.trees;
            let (growing, other) = if active == 0 { (first, second) } else { (second, first) };
            let mut spent = false;
            let mut check = |a: &[f64], b: &[f64]| {
                let (valid, last) = counted(a, b);
                spent |= last;
                valid
            };
            let mut met = None;
            if let Extension::Reached(node) | Extension::Advanced(node) =
                extend(growing, &self.sample, settings.step, &mut self.next, &mut check)
            {
                self.sample.clear();
                self.sample.extend_from_slice(growing.point(node, dimension));
                if let Some(meeting) = connect(other, &self.sample, settings.step, &mut self.next, &mut check, &mut || false)
                {
                    met = Some((node, meeting));
                }
            }
            if let Some((node, meeting)) = met {
                let (from_start, from_goal) = if active == 0 { (node, meeting) } else { (meeting, node) };
                let mut path = self.trees[0].way_to_root(from_start, dimension);
                path.reverse();
                path.extend(self.trees[1].way_to_root(from_goal, dimension).into_iter().skip(1));
                shorten_polyline(&mut path, settings.n_shortcuts, rng, is_valid);
                return Some(path);
            }
            if spent {
                return None;
            }
            active = 1 - active;
        }
        None
    }
}
