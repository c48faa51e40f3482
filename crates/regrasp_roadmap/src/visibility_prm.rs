//! A roadmap that keeps only samples that see nothing known or join what was apart.
//!
//! Visibility PRM: Simeon, Laumond, Nissoux 2000, doi:10.1163/156855300741960; names follow their section 3.
//! Incremental: a caller may mix [`VisibilityPrm::explore`] with edges and nodes of its own.

use crate::astar::{CheapestPath, cheapest_path};
use crate::components::Components;
use crate::nearest::nearest_few;
use crate::space::Space;
use regrasp_base::Rng;

/// A node of the roadmap.
#[derive(Debug, Clone)]
pub struct Node<P> {
    /// Where it is.
    pub point: P,
    /// True for guards, which later samples try to see; false for connectors.
    pub is_guard: bool,
}

/// An edge of the roadmap.
#[derive(Debug, Clone)]
pub struct Edge<M> {
    /// Node at which the motion starts.
    pub from: usize,
    /// Node at which it ends.
    pub to: usize,
    /// The motion.
    pub motion: M,
    /// Cost of going along it, either way.
    pub cost: f64,
}

/// What became of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It saw no guard and became one: this node.
    Guard(usize),
    /// It saw guards of several components and joined them: this node.
    Connector(usize),
    /// It saw guards of one component only, and was thrown away.
    Redundant,
    /// The draw gave no valid point.
    Invalid,
}

/// The roadmap, of points `P` and motions `M` of a [`Space`].
#[derive(Debug, Clone)]
pub struct VisibilityPrm<P, M> {
    nodes: Vec<Node<P>>,
    edges: Vec<Edge<M>>,
    /// Edges of each node.
    edges_of: Vec<Vec<usize>>,
    components: Components,
    n_redundant_in_row: usize,
}

impl<P, M> Default for VisibilityPrm<P, M> {
    fn default() -> Self {
        VisibilityPrm {
            nodes: Vec::new(),
            edges: Vec::new(),
            edges_of: Vec::new(),
            components: Components::new(),
            n_redundant_in_row: 0,
        }
    }
}

impl<P: Clone, M: Clone> VisibilityPrm<P, M> {
    /// An empty roadmap.
    pub fn new() -> Self {
        VisibilityPrm::default()
    }

    /// All nodes, in the order in which they were added.
    pub fn nodes(&self) -> &[Node<P>] {
        &self.nodes
    }

    /// All edges, in the order in which they were added.
    pub fn edges(&self) -> &[Edge<M>] {
        &self.edges
    }

    /// The connected components.
    pub fn components(&self) -> &Components {
        &self.components
    }

    /// Redundant samples since the last one kept. The paper estimates the share of the space that no guard sees as
    /// one over this number.
    pub fn n_redundant_in_row(&self) -> usize {
        self.n_redundant_in_row
    }

    /// Adds a guard unconditionally, without edges (a start, a goal, or what the caller knows to be worth keeping).
    pub fn add_guard(&mut self, point: P) -> usize {
        self.add(point, true)
    }

    fn add(&mut self, point: P, is_guard: bool) -> usize {
        self.nodes.push(Node { point, is_guard });
        self.edges_of.push(Vec::new());
        self.components.push()
    }

    /// Adds an edge that the caller found, joining components; its index.
    pub fn add_edge(&mut self, from: usize, to: usize, motion: M, cost: f64) -> usize {
        let edge = self.edges.len();
        self.edges.push(Edge { from, to, motion, cost });
        self.edges_of[from].push(edge);
        self.edges_of[to].push(edge);
        self.components.join(from, to);
        edge
    }

    /// Removes the edge that [`VisibilityPrm::edge_between`] gives, if there is one; components may fall apart. Indices
    /// of later edges go down by one.
    pub fn remove_edge_between(&mut self, from: usize, to: usize) -> Option<Edge<M>> {
        let joins = |edge: &Edge<M>| (edge.from, edge.to) == (from, to) || (edge.from, edge.to) == (to, from);
        let cheapest = (0..self.edges.len())
            .filter(|&index| joins(&self.edges[index]))
            .min_by(|&a, &b| self.edges[a].cost.total_cmp(&self.edges[b].cost))?;
        let removed = self.edges.remove(cheapest);
        self.components = Components::new();
        self.edges_of = vec![Vec::new(); self.nodes.len()];
        for _ in &self.nodes {
            self.components.push();
        }
        for (index, edge) in self.edges.iter().enumerate() {
            self.edges_of[edge.from].push(index);
            self.edges_of[edge.to].push(index);
            self.components.join(edge.from, edge.to);
        }
        Some(removed)
    }

    /// Adds a node that is no guard and links it to the nearest node that it sees in each component.
    ///
    /// For a start or goal: its component tells whether the roadmap sees it.
    pub fn attach(&mut self, space: &mut impl Space<Point = P, Motion = M>, point: P) -> usize {
        let seen = self.seen_components(space, &point, |_| true);
        let node = self.add(point, false);
        self.link(space, node, seen);
        node
    }

    /// Draws up to `n_samples` samples; stops early when `max_redundant` in a row were redundant. True when it stopped
    /// early: the guards see about all of the space.
    pub fn explore(
        &mut self,
        space: &mut impl Space<Point = P, Motion = M>,
        n_samples: usize,
        max_redundant: usize,
        rng: &mut Rng,
    ) -> bool {
        for _ in 0..n_samples {
            if self.n_redundant_in_row >= max_redundant {
                return true;
            }
            match space.sample(rng) {
                Some(point) => self.consider(space, point),
                None => Outcome::Invalid,
            };
        }
        self.n_redundant_in_row >= max_redundant
    }

    /// For each component with a guard that sees `point`: the nearest such guard, and the motion from the point to it.
    pub fn guards_seen(&self, space: &mut impl Space<Point = P, Motion = M>, point: &P) -> Vec<(usize, M)> {
        self.seen_components(space, point, |node| node.is_guard)
    }

    /// Adds a node that is no guard, with motions from it to others.
    pub fn add_linked(&mut self, space: &impl Space<Point = P, Motion = M>, point: P, seen: Vec<(usize, M)>) -> usize {
        let node = self.add(point, false);
        self.link(space, node, seen);
        node
    }

    /// Keeps `point` if it sees no guard or guards of several components.
    pub fn consider(&mut self, space: &mut impl Space<Point = P, Motion = M>, point: P) -> Outcome {
        let seen = self.guards_seen(space, &point);
        match seen.len() {
            0 => {
                self.n_redundant_in_row = 0;
                Outcome::Guard(self.add(point, true))
            }
            1 => {
                self.n_redundant_in_row += 1;
                Outcome::Redundant
            }
            _ => {
                self.n_redundant_in_row = 0;
                let node = self.add(point, false);
                self.link(space, node, seen);
                Outcome::Connector(node)
            }
        }
    }

    /// The cheapest path between two nodes; none when they are in different components.
    pub fn path(&self, start: usize, goal: usize) -> Option<CheapestPath> {
        if !self.components.same(start, goal) {
            return None;
        }
        let neighbours = |node: usize, out: &mut Vec<(usize, f64)>| {
            for &edge in &self.edges_of[node] {
                let edge = &self.edges[edge];
                out.push((if edge.from == node { edge.to } else { edge.from }, edge.cost));
            }
        };
        cheapest_path(start, |node| node == goal, neighbours, |_| 0.0)
    }

    /// The cheapest edge between two neighbouring nodes, and whether its motion starts at `from`.
    pub fn edge_between(&self, from: usize, to: usize) -> Option<(&Edge<M>, bool)> {
        self.edges_of[from]
            .iter()
            .map(|&edge| &self.edges[edge])
            .filter(|edge| (edge.from, edge.to) == (from, to) || (edge.from, edge.to) == (to, from))
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
            .map(|edge| (edge, edge.from == from))
    }

    /// For each component with an eligible node that sees the point: the nearest such node, and the motion from the
    /// point to it. In order of distance.
    fn seen_components(
        &self,
        space: &mut impl Space<Point = P, Motion = M>,
        point: &P,
        eligible: impl Fn(&Node<P>) -> bool,
    ) -> Vec<(usize, M)> {
        let candidates: Vec<usize> = (0..self.nodes.len()).filter(|&node| eligible(&self.nodes[node])).collect();
        let distances = candidates.iter().map(|&node| space.distance(point, &self.nodes[node].point));
        let order = nearest_few(distances, candidates.len());
        let mut seen: Vec<(usize, M)> = Vec::new();
        let mut seen_representatives: Vec<usize> = Vec::new();
        for node in order.into_iter().map(|i| candidates[i]) {
            let representative = self.components.representative(node);
            if seen_representatives.contains(&representative) {
                continue;
            }
            if let Some(motion) = space.connect(point, &self.nodes[node].point) {
                seen_representatives.push(representative);
                seen.push((node, motion));
            }
        }
        seen
    }

    fn link(&mut self, space: &impl Space<Point = P, Motion = M>, node: usize, seen: Vec<(usize, M)>) {
        for (other, motion) in seen {
            let cost = space.distance(&self.nodes[node].point, &self.nodes[other].point);
            self.add_edge(node, other, motion, cost);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy_world::Toy;

    #[test]
    fn components_agree_with_flood_fill() {
        let mut rng = Rng::keyed(1, "visibility", 0);
        let (mut n_connected, mut n_missed, mut n_cut, mut n_nodes, mut n_kept) = (0, 0, 0, 0, 0);
        for _ in 0..40 {
            let mut toy = Toy::random(7, 0.35, &mut rng);
            let mut roadmap: VisibilityPrm<Vec<f64>, f64> = VisibilityPrm::new();
            roadmap.explore(&mut toy, 20_000, 1500, &mut rng);
            n_kept += roadmap.nodes().len();
            n_nodes += 1;
            for node in roadmap.nodes().iter().filter(|node| node.is_guard) {
                assert!(toy.is_free(&node.point));
            }
            let colours = toy.flood();
            for _ in 0..20 {
                let (start, goal) = (toy.free_point(&mut rng), toy.free_point(&mut rng));
                let connected = colours[toy.cell(&start)] == colours[toy.cell(&goal)];
                let mut query = roadmap.clone();
                let (a, b) = (query.attach(&mut toy, start), query.attach(&mut toy, goal));
                match query.path(a, b) {
                    Some(path) => {
                        assert!(connected, "a path through a wall");
                        for w in path.nodes.windows(2) {
                            assert!(query.edge_between(w[0], w[1]).is_some());
                            assert!(toy.sees(&query.nodes()[w[0]].point, &query.nodes()[w[1]].point));
                        }
                        n_connected += 1;
                    }
                    None if connected => n_missed += 1,
                    None => n_cut += 1,
                }
            }
        }
        assert!(n_missed * 50 < n_connected && n_cut > 50, "{n_connected} found, {n_missed} missed, {n_cut} cut");
        assert!(n_kept < 60 * n_nodes, "a visibility roadmap is small");
    }

    #[test]
    fn two_rooms_and_a_door_need_two_guards_and_a_connector() {
        // Two rooms of 3 x 7, a wall between them with a door in its middle: guards off the door's line don't see
        // each other, samples in the door do.
        let wall: Vec<(usize, usize)> = (0..7).filter(|&y| y != 3).map(|y| (3, y)).collect();
        let mut toy = Toy::new(7, &wall);
        let mut rng = Rng::keyed(2, "visibility", 0);
        let mut roadmap: VisibilityPrm<Vec<f64>, f64> = VisibilityPrm::new();
        assert_eq!(roadmap.consider(&mut toy, vec![1.0, 0.5]), Outcome::Guard(0));
        assert_eq!(roadmap.consider(&mut toy, vec![1.2, 6.5]), Outcome::Redundant);
        assert_eq!(roadmap.consider(&mut toy, vec![6.0, 0.5]), Outcome::Guard(1));
        assert_eq!(roadmap.components().n_components(), 2);
        assert!(roadmap.path(0, 1).is_none());
        assert_eq!(roadmap.consider(&mut toy, vec![3.5, 3.5]), Outcome::Guard(2));
        let covered = roadmap.explore(&mut toy, 100_000, 500, &mut rng);
        assert!(covered && roadmap.components().n_components() == 1);
        let path = roadmap.path(0, 1).expect("the rooms are joined");
        // Through the door: no shorter than the taut string over the door's lower corners.
        let taut = 2.0f64.hypot(2.5) + 1.0 + 2.0f64.hypot(2.5);
        assert!(path.cost >= taut);
    }

    #[test]
    fn the_caller_may_join_components_itself() {
        let wall: Vec<(usize, usize)> = (0..3).map(|y| (1, y)).collect();
        let mut toy = Toy::new(3, &wall);
        let mut roadmap: VisibilityPrm<Vec<f64>, f64> = VisibilityPrm::new();
        roadmap.consider(&mut toy, vec![0.5, 0.5]);
        roadmap.consider(&mut toy, vec![2.5, 0.5]);
        roadmap.add_edge(1, 0, 2.0, 2.0);
        let path = roadmap.path(0, 1).expect("joined by hand");
        assert_eq!((path.nodes, path.cost), (vec![0, 1], 2.0));
        let (edge, forward) = roadmap.edge_between(0, 1).expect("the edge");
        assert_eq!((edge.motion, forward), (2.0, false));
    }

    #[test]
    fn a_removed_edge_splits_and_a_parallel_one_keeps_together() {
        let mut roadmap: VisibilityPrm<Vec<f64>, f64> = VisibilityPrm::new();
        for i in 0..3 {
            roadmap.add_guard(vec![f64::from(i)]);
        }
        roadmap.add_edge(0, 1, 5.0, 5.0);
        roadmap.add_edge(1, 0, 2.0, 2.0);
        roadmap.add_edge(1, 2, 1.0, 1.0);
        assert_eq!(roadmap.remove_edge_between(0, 1).expect("the cheaper edge").motion, 2.0);
        assert_eq!(roadmap.path(0, 2).expect("the dearer edge is left").cost, 6.0);
        assert_eq!(roadmap.remove_edge_between(1, 0).expect("the dearer edge").motion, 5.0);
        assert!(roadmap.path(0, 2).is_none() && roadmap.components().n_components() == 2);
        assert!(roadmap.path(2, 1).is_some() && roadmap.remove_edge_between(0, 1).is_none());
    }
}
