//! The cheapest path through the task graph.

use super::{Graph, Node};

impl Graph<'_, '_> {
    /// By node, what the cheapest way from it to the goal costs (Dijkstra 1959, from the goal). Costs only grow while edges are tested, so
    /// that later no way costs less.
    fn costs_to_goal(&self) -> Vec<f64> {
        // All edges, then sorted by where they end: `into[first[to]..first[to + 1]]`.
        let (mut all, mut edges) = (Vec::new(), Vec::new());
        let mut first = vec![0; self.n_nodes + 1];
        for from in 0..self.n_nodes {
            self.edges(self.node(from), &mut edges);
            for &(to, cost) in &edges {
                all.push((from as u32, to as u32, cost));
                first[to + 1] += 1;
            }
        }
        for node in 0..self.n_nodes {
            first[node + 1] += first[node];
        }
        let mut next = first.clone();
        let mut into = vec![(0, 0.0); all.len()];
        for (from, to, cost) in all {
            let place = &mut next[to as usize];
            into[*place] = (from, cost);
            *place += 1;
        }
        let mut least = vec![f64::INFINITY; self.n_nodes];
        least[self.index(Node::Lies(1))] = 0.0;
        let mut open: Vec<usize> = (0..self.n_nodes).collect();
        while let Some(place) = (0..open.len()).min_by(|&a, &b| least[open[a]].total_cmp(&least[open[b]])) {
            let to = open.swap_remove(place);
            if least[to] == f64::INFINITY {
                break;
            }
            for &(from, cost) in &into[first[to]..first[to + 1]] {
                least[from as usize] = least[from as usize].min(cost + least[to]);
            }
        }
        least
    }

    /// The cheapest path from the start to the goal through edges that are not dead (A*: Hart, Nilsson, Raphael 1968).
    pub(super) fn cheapest(&mut self) -> Option<Vec<Node>> {
        const NONE: usize = usize::MAX;
        // Where little of what was known is true any more, it is found anew.
        if self.to_goal.len() != self.n_nodes || self.n_looked > self.n_nodes {
            (self.to_goal, self.n_looked) = (self.costs_to_goal(), 0);
        }
        let goal = self.index(Node::Lies(1));
        let least = &self.to_goal;
        let mut costs = vec![f64::INFINITY; self.n_nodes];
        let mut before = vec![NONE; self.n_nodes];
        let mut is_done = vec![false; self.n_nodes];
        costs[self.index(Node::Lies(0))] = 0.0;
        let mut edges = Vec::new();
        let mut n_looked = 0;
        let path = loop {
            let mut nearest = (f64::INFINITY, NONE);
            for (node, &cost) in costs.iter().enumerate() {
                if cost + least[node] < nearest.0 && !is_done[node] {
                    nearest = (cost + least[node], node);
                }
            }
            let (_, node) = nearest;
            if node == NONE {
                break None;
            }
            is_done[node] = true;
            n_looked += 1;
            if node == goal {
                let mut path = vec![node];
                while before[path[path.len() - 1]] != NONE {
                    path.push(before[path[path.len() - 1]]);
                }
                break Some(path.into_iter().rev().map(|index| self.node(index)).collect());
            }
            let cost = costs[node];
            self.edges(self.node(node), &mut edges);
            for &(to, of_edge) in &edges {
                if cost + of_edge < costs[to] && !is_done[to] {
                    (costs[to], before[to]) = (cost + of_edge, node);
                }
            }
        };
        self.n_looked += n_looked;
        path
    }
}
