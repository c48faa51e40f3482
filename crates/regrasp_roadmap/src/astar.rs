//! Cheapest paths in a graph: A* (Hart, Nilsson, Raphael 1968).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A path and its cost.
#[derive(Debug, Clone, PartialEq)]
pub struct CheapestPath {
    /// Nodes from start to goal; one node when the start is a goal.
    pub nodes: Vec<usize>,
    /// Sum of the costs of the edges.
    pub cost: f64,
}

/// An entry of the queue; the greatest is the one with the smallest estimate, then the smallest node.
#[derive(Debug, PartialEq)]
struct Open {
    estimate: f64,
    cost: f64,
    node: usize,
}

impl Eq for Open {}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        other.estimate.total_cmp(&self.estimate).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The cheapest path from `start` to the first node for which `is_goal` holds; none when there is none.
///
/// `neighbours` appends `(node, cost of the edge)` with costs of zero or more; an infinite cost is no edge. `heuristic`
/// must never exceed the cost of the rest of the way; zero makes it Dijkstra's algorithm. Nodes may be any indices;
/// memory grows with the largest one seen. Equal costs are decided by the smaller index.
pub fn cheapest_path(
    start: usize,
    mut is_goal: impl FnMut(usize) -> bool,
    mut neighbours: impl FnMut(usize, &mut Vec<(usize, f64)>),
    mut heuristic: impl FnMut(usize) -> f64,
) -> Option<CheapestPath> {
    let mut costs: Vec<f64> = Vec::new();
    let mut parents: Vec<usize> = Vec::new();
    let reach = |costs: &mut Vec<f64>, parents: &mut Vec<usize>, node: usize| {
        if node >= costs.len() {
            costs.resize(node + 1, f64::INFINITY);
            parents.resize(node + 1, usize::MAX);
        }
    };
    reach(&mut costs, &mut parents, start);
    costs[start] = 0.0;
    let mut queue = BinaryHeap::new();
    queue.push(Open { estimate: heuristic(start), cost: 0.0, node: start });
    let mut edges = Vec::new();
    while let Some(open) = queue.pop() {
        // A cheaper way was found after this entry was queued.
        if open.cost > costs[open.node] {
            continue;
        }
        if is_goal(open.node) {
            let mut nodes = vec![open.node];
            let mut node = open.node;
            while node != start {
                node = parents[node];
                nodes.push(node);
            }
            nodes.reverse();
            return Some(CheapestPath { nodes, cost: open.cost });
        }
        edges.clear();
        neighbours(open.node, &mut edges);
        for &(next, edge_cost) in &edges {
            assert!(edge_cost >= 0.0, "edge {} - {next} costs {edge_cost}", open.node);
            reach(&mut costs, &mut parents, next);
            let cost = open.cost + edge_cost;
            if cost < costs[next] {
                costs[next] = cost;
                parents[next] = open.node;
                queue.push(Open { estimate: cost + heuristic(next), cost, node: next });
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    /// Bellman and Ford: the second way of knowing.
    fn costs_from(start: usize, n: usize, edges: &[(usize, usize, f64)]) -> Vec<f64> {
        let mut costs = vec![f64::INFINITY; n];
        costs[start] = 0.0;
        for _ in 0..n {
            for &(a, b, cost) in edges {
                costs[b] = costs[b].min(costs[a] + cost);
                costs[a] = costs[a].min(costs[b] + cost);
            }
        }
        costs
    }

    #[test]
    fn agrees_with_bellman_ford_and_dijkstra() {
        let mut rng = Rng::keyed(1, "astar", 0);
        let (mut n_reached, mut n_cut) = (0, 0);
        for _ in 0..200 {
            let n = 30;
            let places: Vec<[f64; 2]> = (0..n).map(|_| [rng.unit(), rng.unit()]).collect();
            let distance = |a: usize, b: usize| (places[a][0] - places[b][0]).hypot(places[a][1] - places[b][1]);
            let edges: Vec<(usize, usize, f64)> = (0..40)
                .map(|_| {
                    let (a, b) = (rng.below(n), rng.below(n));
                    (a, b, distance(a, b) * rng.uniform(1.0, 2.0))
                })
                .collect();
            let known = costs_from(0, n, &edges);
            let neighbours = |node: usize, out: &mut Vec<(usize, f64)>| {
                for &(a, b, cost) in &edges {
                    if a == node {
                        out.push((b, cost));
                    } else if b == node {
                        out.push((a, cost));
                    }
                }
            };
            for goal in 0..n {
                let guided = cheapest_path(0, |node| node == goal, neighbours, |node| distance(node, goal));
                let blind = cheapest_path(0, |node| node == goal, neighbours, |_| 0.0);
                match (&guided, &blind) {
                    (Some(a), Some(b)) => {
                        assert!((a.cost - known[goal]).abs() < 1e-12 && (b.cost - known[goal]).abs() < 1e-12);
                        let walked: f64 = a
                            .nodes
                            .windows(2)
                            .map(|w| {
                                let mut out = Vec::new();
                                neighbours(w[0], &mut out);
                                let costs = out.iter().filter(|edge| edge.0 == w[1]).map(|edge| edge.1);
                                costs.fold(f64::INFINITY, f64::min)
                            })
                            .sum();
                        assert!((walked - a.cost).abs() < 1e-12);
                        assert_eq!((a.nodes[0], a.nodes[a.nodes.len() - 1]), (0, goal));
                        n_reached += 1;
                    }
                    (None, None) => {
                        assert!(known[goal].is_infinite());
                        n_cut += 1;
                    }
                    _ => panic!("A* and Dijkstra disagree"),
                }
            }
        }
        assert!(n_reached > 100 && n_cut > 100);
    }
}
