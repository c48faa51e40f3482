//! Cheapest paths in a graph: A* (Hart, Nilsson, Raphael 1968).

use crate::open_list::{OpenList, Rank};

/// A path and its cost.
#[derive(Debug, Clone, PartialEq)]
pub struct CheapestPath {
    /// Nodes from start to goal; one node when the start is a goal.
    pub nodes: Vec<usize>,
    /// Sum of the costs of the edges.
    pub cost: f64,
}

/// The cheapest path from `start` to the first node for which `is_goal` holds; none when there is none. One search with
/// fresh memory: see [`AStar::cheapest_path`].
pub fn cheapest_path(
    start: usize,
    is_goal: impl FnMut(usize) -> bool,
    neighbours: impl FnMut(usize, &mut Vec<(usize, f64)>),
    heuristic: impl FnMut(usize) -> f64,
) -> Option<CheapestPath> {
    AStar::new().cheapest_path(start, is_goal, neighbours, heuristic)
}

/// What is known of a node in the search whose number it carries.
#[derive(Debug, Clone, Copy)]
struct Mark {
    search: u32,
    parent: u32,
    cost: f64,
}

/// Where a search ends without a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Paths that cost as much or more are not wanted.
    pub cost: f64,
    /// Most nodes expanded.
    pub n_expanded: usize,
}

impl Limits {
    /// None.
    pub const NONE: Limits = Limits { cost: f64::INFINITY, n_expanded: usize::MAX };
}

/// Memory of searches, one after the other: a search of a large graph costs what it looks at, not the graph's size.
#[derive(Debug, Default)]
pub struct AStar {
    marks: Vec<Mark>,
    search: u32,
    queue: OpenList<()>,
    edges: Vec<(usize, f64)>,
    n_expanded: usize,
}

impl AStar {
    /// Empty memory.
    pub fn new() -> Self {
        AStar::default()
    }

    /// Nodes that the last search expanded.
    pub fn n_expanded(&self) -> usize {
        self.n_expanded
    }

    /// [`AStar::cheapest_path_within`] with no limits.
    pub fn cheapest_path(
        &mut self,
        start: usize,
        is_goal: impl FnMut(usize) -> bool,
        neighbours: impl FnMut(usize, &mut Vec<(usize, f64)>),
        heuristic: impl FnMut(usize) -> f64,
    ) -> Option<CheapestPath> {
        self.cheapest_path_within(Limits::NONE, start, is_goal, neighbours, heuristic)
    }

    /// The cheapest path from `start` to the first node for which `is_goal` holds; none when there is none, or none within
    /// the limits.
    ///
    /// `neighbours` appends `(node, cost of the edge)` with costs of zero or more; an infinite cost is no edge.
    /// `heuristic` must never exceed the cost of the rest of the way; zero makes it Dijkstra's algorithm. With one that
    /// does, a path is found where there is one, but perhaps not the cheapest. Nodes may be any indices below 2^32; memory
    /// grows with the largest one seen. Equal estimates are decided by the one that has come farthest, then by the smaller
    /// index.
    pub fn cheapest_path_within(
        &mut self,
        limits: Limits,
        start: usize,
        mut is_goal: impl FnMut(usize) -> bool,
        mut neighbours: impl FnMut(usize, &mut Vec<(usize, f64)>),
        mut heuristic: impl FnMut(usize) -> f64,
    ) -> Option<CheapestPath> {
        self.begin();
        self.reach(start, start, 0.0);
        self.queue.push(Rank { estimate: heuristic(start), cost: 0.0, number: start }, ());
        while let Some((open, ())) = self.queue.pop() {
            // A cheaper way was found after this entry was queued.
            if open.cost > self.marks[open.number].cost {
                continue;
            }
            if open.estimate >= limits.cost {
                return None;
            }
            if is_goal(open.number) {
                return Some(CheapestPath { nodes: self.way_to(open.number, start), cost: open.cost });
            }
            if self.n_expanded >= limits.n_expanded {
                return None;
            }
            self.n_expanded += 1;
            let mut edges = std::mem::take(&mut self.edges);
            edges.clear();
            neighbours(open.number, &mut edges);
            for &(next, edge_cost) in &edges {
                assert!(edge_cost >= 0.0, "edge {} - {next} costs {edge_cost}", open.number);
                let cost = open.cost + edge_cost;
                if self.reach(next, open.number, cost) {
                    self.queue.push(Rank { estimate: cost + heuristic(next), cost, number: next }, ());
                }
            }
            self.edges = edges;
        }
        None
    }

    /// Forgets the last search.
    fn begin(&mut self) {
        self.queue.clear();
        self.n_expanded = 0;
        self.search = self.search.wrapping_add(1);
        if self.search == 0 {
            self.marks.clear();
            self.search = 1;
        }
    }

    /// True when `cost` is less than what was known of `node`; it is known from now on.
    fn reach(&mut self, node: usize, parent: usize, cost: f64) -> bool {
        if node >= self.marks.len() {
            assert!(u32::try_from(node).is_ok(), "node {node} of at most 2^32");
            self.marks.resize(node + 1, Mark { search: 0, parent: u32::MAX, cost: f64::INFINITY });
        }
        let mark = &mut self.marks[node];
        let known = if mark.search == self.search { mark.cost } else { f64::INFINITY };
        if cost < known {
            *mark = Mark { search: self.search, parent: parent as u32, cost };
        }
        cost < known
    }

    fn way_to(&self, mut node: usize, start: usize) -> Vec<usize> {
        let mut nodes = vec![node];
        while node != start {
            node = self.marks[node].parent as usize;
            nodes.push(node);
        }
        nodes.reverse();
        nodes
    }
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
        let mut memory = AStar::new();
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
                // Memory that other searches, of other graphs, have used.
                let again = memory.cheapest_path(0, |node| node == goal, neighbours, |node| distance(node, goal));
                assert_eq!(again, guided);
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
