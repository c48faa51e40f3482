//! The cheapest path through the task graph.

use super::{Graph, Node};

impl Graph<'_, '_> {
    /// By node, what the cheapest way from it to the goal costs (Bellman 1958). Costs only grow while edges are tested, so that later no way
    /// costs less.
    fn costs_to_goal(&self) -> Vec<f64> {
        let mut least = vec![f64::INFINITY; self.n_nodes];
        least[self.index(Node::Lies(1))] = 0.0;
        // All edges in a row, asked for once; by node, where its edges end.
        let (mut all, mut ends, mut edges) = (Vec::new(), Vec::with_capacity(self.n_nodes), Vec::new());
        for index in 0..self.n_nodes {
            self.edges(self.node(index), &mut edges);
            all.extend(edges.iter().map(|&(to, cost)| (to as u32, cost)));
            ends.push(all.len());
        }
        loop {
            let (mut is_settled, mut first) = (true, 0);
            for (index, &end) in ends.iter().enumerate() {
                let own = &all[first..end];
                first = end;
                let best = own.iter().map(|&(to, cost)| cost + least[to as usize]).fold(least[index], f64::min);
                if best < least[index] {
                    (least[index], is_settled) = (best, false);
                }
            }
            if is_settled {
                return least;
            }
        }
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
