//! Lower bounds of the cost between nodes, from distances to a few landmarks by the triangle inequality.
//!
//! Goldberg and Harrelson, *Computing the shortest path: A\* search meets graph theory* (SODA 2005). Landmarks are chosen
//! far from each other, as there.

use crate::in_hand::roadmap::graph::Graph;
use crate::in_hand::roadmap::index::Index;
use regrasp_roadmap::{OpenList, Rank};

/// Landmarks of a graph. By measurement on the box: A* expands 600, 206, 100 and 53 nodes with 8, 16, 32 and 64 of them.
const N_LANDMARKS: usize = 63;
/// Largest distance in steps.
const MOST_STEPS: f64 = 254.0;

/// Distances of every node from the landmarks, in steps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Landmarks {
    /// Cost of one step.
    pub step: f64,
    /// What is known of each node.
    pub rows: Vec<Row>,
}

/// Distances of one node from up to [`N_LANDMARKS`] landmarks in steps, rounded down, zero where there is no landmark; then
/// its slack, the steps by which they may be too short. One line of a processor's cache: looking it up costs most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(align(64))]
pub struct Row(pub [u8; ROW_BYTES]);

/// Bytes of a [`Row`].
pub const ROW_BYTES: usize = N_LANDMARKS + 1;

impl Row {
    /// What is known of a node of which nothing is known.
    const NOTHING: Row = {
        let mut row = [0; ROW_BYTES];
        row[N_LANDMARKS] = u8::MAX;
        Row(row)
    };

    fn slack(&self) -> u8 {
        self.0[N_LANDMARKS]
    }
}

impl Landmarks {
    /// Chooses landmarks of a connected graph, each the node farthest from those before, and measures.
    pub fn choose(graph: &Graph, index: &Index) -> Self {
        let n_nodes = graph.nodes.len();
        // No two nodes are farther apart than twice the farthest from node 0.
        let from_first = costs_from(graph, index, 0);
        let mut landmark = farthest(&from_first);
        let step = (2.0 * from_first[landmark] / MOST_STEPS).max(f64::MIN_POSITIVE);
        let mut row = Row([0; ROW_BYTES]);
        row.0[N_LANDMARKS] = 1;
        let mut landmarks = Landmarks { step, rows: vec![row; n_nodes] };
        let mut nearest = vec![f64::INFINITY; n_nodes];
        for which in 0..N_LANDMARKS.min(n_nodes) {
            for (node, cost) in costs_from(graph, index, landmark).into_iter().enumerate() {
                landmarks.rows[node].0[which] = landmarks.steps(cost);
                nearest[node] = nearest[node].min(cost);
            }
            landmark = farthest(&nearest);
        }
        landmarks
    }

    fn steps(&self, cost: f64) -> u8 {
        // Saturates: not a number is zero.
        (cost / self.step).min(MOST_STEPS) as u8
    }

    /// Goes on for nodes that were added to `graph`, each of which the edges after it link to one node before it: no way
    /// between other nodes has become shorter.
    pub fn extend(&mut self, graph: &Graph, index: &Index) {
        let mut neighbours = Vec::new();
        for node in self.rows.len()..graph.nodes.len() {
            neighbours.clear();
            index.neighbours(node, &mut neighbours);
            let parent = neighbours.iter().find(|(other, _)| *other < node);
            self.rows.push(parent.map_or(Row::NOTHING, |&(other, cost)| self.beside(&self.rows[other], cost)));
        }
    }

    /// Of a node whose only edge, of cost `cost`, leads to a node with `row`.
    fn beside(&self, row: &Row, cost: f64) -> Row {
        let farther = row.0.map(|distance| self.step * f64::from(distance) + cost);
        let is_too_far = farther[..N_LANDMARKS].iter().any(|&cost| cost >= self.step * MOST_STEPS);
        if is_too_far || row.slack() >= MOST_SLACK {
            return Row::NOTHING;
        }
        let mut beside = Row(farther.map(|cost| self.steps(cost)));
        beside.0[N_LANDMARKS] = row.slack() + 1;
        beside
    }

    /// Lower bounds of the cost to the nearest of some goals, each a node and what remains to be paid there.
    pub fn bounds(&self, goals: impl Iterator<Item = (usize, f64)>) -> Bounds {
        let mut bounds = Bounds { near: Row([0; ROW_BYTES]), far: Row([u8::MAX; ROW_BYTES]) };
        for (node, rest) in goals {
            let (row, rest) = (&self.rows[node], self.steps(rest));
            let ends = bounds.near.0.iter_mut().zip(&mut bounds.far.0);
            for ((near, far), &distance) in ends.zip(&row.0) {
                // The distance that is taken away may be too short.
                *near = (*near).max(distance.saturating_add(row.slack()).saturating_sub(rest));
                *far = (*far).min(distance.saturating_add(rest));
            }
        }
        // No landmark: says nothing.
        (bounds.near.0[N_LANDMARKS], bounds.far.0[N_LANDMARKS]) = (u8::MAX, 0);
        bounds
    }

    /// The bound for a node.
    pub fn bound(&self, node: usize, bounds: &Bounds) -> f64 {
        let row = &self.rows[node];
        let (mut beyond, mut behind) = (0, 0);
        for ((&distance, &near), &far) in row.0.iter().zip(&bounds.near.0).zip(&bounds.far.0) {
            beyond = distance.saturating_sub(near).max(beyond);
            behind = far.saturating_sub(distance).max(behind);
        }
        self.step * f64::from(beyond.max(behind.saturating_sub(row.slack())))
    }
}

/// Slack of a node beside which nothing is told of a new one any more.
const MOST_SLACK: u8 = 100;

/// What [`Landmarks::bound`] needs to know of the goals, in steps: by the triangle inequality a node is as far from them as
/// it is farther from some landmark than `near`, or nearer to it than `far`.
#[derive(Debug, Clone)]
pub struct Bounds {
    near: Row,
    far: Row,
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
    let mut queue = OpenList::new();
    queue.push(Rank::of(0.0, start), ());
    let mut neighbours = Vec::new();
    while let Some((Rank { estimate: cost, number: node, .. }, ())) = queue.pop() {
        if cost > costs[node] {
            continue;
        }
        neighbours.clear();
        index.neighbours(node, &mut neighbours);
        for &(next, step) in &neighbours {
            if cost + step < costs[next] {
                costs[next] = cost + step;
                queue.push(Rank::of(cost + step, next), ());
            }
        }
    }
    costs
}
