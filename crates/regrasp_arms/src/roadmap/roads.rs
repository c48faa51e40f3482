//! A graph made ready for queries, and the search that tests motions only when it takes them.

use super::{Graph, SuperGraph};
use crate::search::distance;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A graph with the neighbours of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Roads {
    /// The graph.
    pub graph: SuperGraph,
    /// By node, in rising order.
    neighbours: Vec<Vec<u32>>,
}

/// A motion of a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// From the start to a node, or straight to the goal.
    FromStart,
    /// Between two nodes, by their indices, the smaller first.
    Known([usize; 2]),
    /// From a node to the goal.
    ToGoal,
}

/// What a search counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Motions that were tested.
    pub tested: u64,
    /// Nodes that were expanded.
    pub expanded: u64,
}

/// How much nearer to the goal is better than a short way: paths are made shorter afterwards.
const GREED: f64 = 2.0;

#[derive(Debug, PartialEq)]
struct Open {
    rank: f64,
    cost: f64,
    node: usize,
    from: usize,
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        // The least rank first, of equals the first node.
        other.rank.total_cmp(&self.rank).then(other.node.cmp(&self.node)).then(other.from.cmp(&self.from))
    }
}

impl Roads {
    /// Of a graph.
    pub fn new(graph: SuperGraph) -> Self {
        let neighbours = graph.graph.neighbours();
        Roads { graph, neighbours }
    }

    /// Adds what searches found: nodes, and motions between nodes by their indices.
    pub fn enrich(&mut self, nodes: Vec<Vec<f64>>, edges: &[[usize; 2]]) {
        let Graph { nodes: own, .. } = &mut self.graph.graph;
        own.extend(nodes);
        edges.iter().for_each(|&[a, b]| self.graph.graph.connect(a, b));
        self.neighbours = self.graph.graph.neighbours();
    }

    /// Indices of the nearest nodes, the nearest first.
    pub fn nearest(&self, configuration: &[f64], n: usize) -> Vec<usize> {
        let nodes = self.graph.graph.nodes.iter().enumerate();
        let mut near: Vec<(f64, usize)> = nodes.map(|(node, own)| (distance(configuration, own), node)).collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if n < near.len() {
            near.select_nth_unstable_by(n, order);
            near.truncate(n);
        }
        near.sort_by(order);
        near.into_iter().map(|(_, node)| node).collect()
    }

    /// A path through the graph, start and goal included (A* that tests a motion when it takes it: Cohen, Phillips, Likhachev 2014).
    /// `is_free` tests a motion. None where what it leaves of the graph does not join them.
    pub fn path(
        &self,
        [start, goal]: [&[f64]; 2],
        n_neighbours: usize,
        counts: &mut Counts,
        mut is_free: impl FnMut(Edge, &[f64], &[f64]) -> bool,
    ) -> Option<Vec<Vec<f64>>> {
        let nodes = &self.graph.graph.nodes;
        let (at_start, at_goal) = (nodes.len(), nodes.len() + 1);
        let configuration = |node: usize| match node {
            node if node == at_start => start,
            node if node == at_goal => goal,
            node => nodes[node].as_slice(),
        };
        // The search would look at the whole graph before it gave up on a goal that no node reaches.
        let mut is_near_goal = vec![false; nodes.len()];
        let mut reaches_goal = None;
        for node in self.nearest(goal, n_neighbours) {
            let is_asked = reaches_goal.is_none();
            if is_asked {
                counts.tested += 1;
                reaches_goal = is_free(Edge::ToGoal, &nodes[node], goal).then_some(node);
            }
            is_near_goal[node] = !is_asked || reaches_goal.is_some();
        }
        reaches_goal?;
        let mut before = vec![usize::MAX; nodes.len() + 2];
        let mut open = BinaryHeap::new();
        let push = |open: &mut BinaryHeap<Open>, from: usize, cost: f64, node: usize| {
            let cost = cost + distance(configuration(from), configuration(node));
            let rank = cost + GREED * distance(configuration(node), goal);
            open.push(Open { rank, cost, node, from });
        };
        before[at_start] = at_start;
        self.nearest(start, n_neighbours).into_iter().for_each(|node| push(&mut open, at_start, 0.0, node));
        while let Some(Open { node, from, cost, .. }) = open.pop() {
            if before[node] != usize::MAX {
                continue;
            }
            let edge = match (from, node) {
                (from, _) if from == at_start => Edge::FromStart,
                (_, node) if node == at_goal => Edge::ToGoal,
                _ => Edge::Known([from.min(node), from.max(node)]),
            };
            let is_known = edge == Edge::ToGoal && reaches_goal == Some(from);
            if !is_known {
                counts.tested += 1;
                if !is_free(edge, configuration(from), configuration(node)) {
                    continue;
                }
            }
            before[node] = from;
            if node == at_goal {
                let mut path = vec![goal.to_vec()];
                let mut at = from;
                while at != at_start {
                    path.push(nodes[at].clone());
                    at = before[at];
                }
                path.push(start.to_vec());
                path.reverse();
                return Some(path);
            }
            counts.expanded += 1;
            if is_near_goal[node] {
                push(&mut open, node, cost, at_goal);
            }
            for &next in &self.neighbours[node] {
                if before[next as usize] == usize::MAX {
                    push(&mut open, node, cost, next as usize);
                }
            }
        }
        None
    }
}
