//! Lower bounds of the cost between nodes, from distances to a few landmarks by the triangle inequality.
//!
//! Goldberg and Harrelson, *Computing the shortest path: A\* search meets graph theory* (SODA 2005). Landmarks are chosen
//! far from each other, as there.

use super::graph::Graph;
use super::index::Index;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Landmarks of a graph: on the box 8 leave A* twice the nodes of 16, 32 cost more memory than they save.
const N_LANDMARKS: usize = 16;
/// Relative error of distances in single precision, doubled.
const ROUNDING: f32 = 2.4e-7;

/// Distances of every node from the landmarks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Landmarks {
    /// Number of landmarks.
    pub n_landmarks: usize,
    /// Cost from each landmark to a node, `n_landmarks` per node; infinite where no way leads.
    pub distances: Vec<f32>,
}

/// A cost and a node, as Dijkstra's queue wants them.
#[derive(PartialEq)]
struct Entry(f64, usize);

impl Eq for Entry {}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Landmarks {
    /// Chooses landmarks of a graph, each the node farthest from those before, and measures.
    pub fn choose(graph: &Graph, index: &Index) -> Self {
        let n_nodes = graph.nodes.len();
        let n_landmarks = N_LANDMARKS.min(n_nodes);
        let mut distances = vec![f32::INFINITY; n_nodes * n_landmarks];
        let mut nearest = vec![f64::INFINITY; n_nodes];
        let mut landmark = 0;
        for which in 0..n_landmarks {
            // The first is the node farthest from node 0.
            let from = if which == 0 { farthest(&costs_from(graph, index, 0)) } else { landmark };
            for (node, cost) in costs_from(graph, index, from).into_iter().enumerate() {
                distances[node * n_landmarks + which] = cost as f32;
                nearest[node] = nearest[node].min(cost);
            }
            landmark = farthest(&nearest);
        }
        Landmarks { n_landmarks, distances }
    }

    /// The distances of a node.
    pub fn of(&self, node: usize) -> &[f32] {
        &self.distances[node * self.n_landmarks..(node + 1) * self.n_landmarks]
    }

    /// Lower bounds of the cost to the nearest of some goals, each a node and what remains to be paid there.
    pub fn bounds(&self, goals: impl Iterator<Item = (usize, f64)>) -> Bounds {
        let mut bounds = vec![(f32::INFINITY, f32::INFINITY); self.n_landmarks];
        for (node, rest) in goals {
            let rest = rest as f32;
            for (bound, &distance) in bounds.iter_mut().zip(self.of(node)) {
                // By the triangle inequality, with the landmark beyond the goal and with it behind the node.
                let slack = ROUNDING * (rest + 2.0 * distance);
                bound.0 = bound.0.min(rest - distance - slack);
                bound.1 = bound.1.min(rest + distance - slack);
            }
        }
        Bounds { bounds }
    }

    /// The bound for a node.
    pub fn bound(&self, node: usize, bounds: &Bounds) -> f64 {
        let mut best = 0f32;
        for (&distance, &(beyond, behind)) in self.of(node).iter().zip(&bounds.bounds) {
            // Not a number where a landmark sees neither: no bound.
            best = best.max((distance + beyond).max(behind - distance) - ROUNDING * distance);
        }
        f64::from(best)
    }
}

/// What [`Landmarks::bound`] needs to know of the goals.
#[derive(Debug, Clone)]
pub struct Bounds {
    bounds: Vec<(f32, f32)>,
}

/// The node of the greatest finite cost.
fn farthest(costs: &[f64]) -> usize {
    let mut best = (f64::NEG_INFINITY, 0);
    for (node, &cost) in costs.iter().enumerate() {
        if cost.is_finite() && cost > best.0 {
            best = (cost, node);
        }
    }
    best.1
}

/// Cost of the cheapest way from a node to every other (Dijkstra).
fn costs_from(graph: &Graph, index: &Index, start: usize) -> Vec<f64> {
    let mut costs = vec![f64::INFINITY; graph.nodes.len()];
    costs[start] = 0.0;
    let mut queue = BinaryHeap::from([Reverse(Entry(0.0, start))]);
    let mut neighbours = Vec::new();
    while let Some(Reverse(Entry(cost, node))) = queue.pop() {
        if cost > costs[node] {
            continue;
        }
        neighbours.clear();
        index.neighbours(node, &mut neighbours);
        for &(next, step) in &neighbours {
            if cost + step < costs[next] {
                costs[next] = cost + step;
                queue.push(Reverse(Entry(cost + step, next)));
            }
        }
    }
    costs
}
