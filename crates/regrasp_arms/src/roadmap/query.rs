//! Queries: the graph is searched as if nothing had changed, then the motions of the path are tested against what the graph does not
//! know (Saut 2010, sec. V-B).

use super::SuperGraph;
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Track};
use crate::search::{Region, RrtSettings, distance, rrt_connect};
use crate::world::World;
use regrasp_base::{Budget, Interrupt, Rng};
use std::cmp::Ordering;
use std::collections::{BTreeSet, BinaryHeap};

/// Settings of [`query`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuerySettings {
    /// Nodes of the graph that start and goal are tried to be connected with.
    pub n_neighbours: usize,
    /// Most samples of one local search.
    pub max_samples: u64,
}

impl Default for QuerySettings {
    fn default() -> Self {
        QuerySettings { n_neighbours: 30, max_samples: 100_000 }
    }
}

/// What a query found.
#[derive(Debug, Clone, PartialEq)]
pub struct QueryOutcome {
    /// The path.
    pub path: Option<Vec<Vec<f64>>>,
    /// Paths of the graph that were looked at.
    pub n_paths: u64,
    /// Motions of the graph that were tested anew.
    pub n_tested: u64,
    /// Nodes that local searches added to the graph.
    pub n_added: u64,
    /// What ended a search without a path.
    pub interrupt: Option<Interrupt>,
}

/// A path from `start` to `goal`. `known` is the world that the graph was made in; `unknown` has what it does not know: obstacles that
/// are new, and `model` may carry something. What a local search finds enriches the graph.
pub fn query(
    graph: &mut SuperGraph,
    model: &ArmModel,
    [whole, unknown]: [&World; 2],
    ends: [&[f64]; 2],
    settings: &QuerySettings,
    (seed, budget): (u64, &Budget),
) -> QueryOutcome {
    let of_collider = ColliderSettings { clearance: graph.clearance, ..ColliderSettings::default() };
    let mut all = Collider::new(model, whole, of_collider);
    let mut new = Collider::new(model, unknown, of_collider);
    // What is carried is new to everything, and so is what is around to the robot.
    let is_carried = |body: usize| model.bodies[body].attached.is_some();
    new.only(|_| true, |[a, b]| is_carried(a) || is_carried(b));
    let mut carried = Collider::new(model, whole, of_collider);
    carried.only(is_carried, |_| false);
    let has_carried = model.bodies.iter().any(|body| body.attached.is_some());
    let mut outcome = QueryOutcome { path: None, n_paths: 0, n_tested: 0, n_added: 0, interrupt: None };
    let direct = Track::straight(ends[0], ends[1]);
    if all.is_certified_free(&direct) {
        outcome.path = Some(ends.iter().map(|end| end.to_vec()).collect());
        return outcome;
    }
    let mut lazy = Lazy::new(graph, ends, settings.n_neighbours);
    let mut rng = Rng::keyed(seed, "roadmap_query", 0);
    loop {
        if let Err(interrupt) = budget.check(outcome.n_tested) {
            outcome.interrupt = Some(interrupt);
            break;
        }
        let Some(nodes) = lazy.path() else {
            let joined = lazy.reconnect(&mut all, &mut rng, settings, budget, &mut outcome);
            if joined { continue } else { break }
        };
        outcome.n_paths += 1;
        let mut is_free = true;
        for pair in nodes.windows(2) {
            let edge = [pair[0].min(pair[1]), pair[0].max(pair[1])];
            if lazy.valid.contains(&edge) {
                continue;
            }
            outcome.n_tested += 1;
            let track = Track::straight(&lazy.nodes[pair[0]], &lazy.nodes[pair[1]]);
            // Of motions of the graph all else is known; those to start and goal are new.
            let is_known = edge[1] < lazy.n_graph;
            let own = match is_known {
                true => new.is_certified_free(&track) && (!has_carried || carried.is_certified_free(&track)),
                false => all.is_certified_free(&track),
            };
            if own {
                lazy.valid.insert(edge);
            } else {
                lazy.cut(edge);
                is_free = false;
                break;
            }
        }
        if is_free {
            outcome.path = Some(nodes.iter().map(|&node| lazy.nodes[node].clone()).collect());
            break;
        }
    }
    let added = lazy.enrich();
    outcome.n_added = added.0.len() as u64;
    for node in added.0 {
        graph.graph.nodes.push(node);
    }
    for [a, b] in added.1 {
        graph.graph.connect(a, b);
    }
    outcome
}

/// The graph of one query.
struct Lazy {
    nodes: Vec<Vec<f64>>,
    neighbours: Vec<Vec<usize>>,
    /// Nodes that the graph had before.
    n_graph: usize,
    start: usize,
    goal: usize,
    /// Edges that were tested.
    valid: BTreeSet<[usize; 2]>,
    /// Nodes and edges of local searches.
    found: Vec<[usize; 2]>,
    n_tries: u64,
}

/// Local searches of one query.
const MOST_TRIES: u64 = 8;

#[derive(Debug, PartialEq)]
struct Open {
    cost: f64,
    node: usize,
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        // The least cost first, of equals the first node.
        other.cost.total_cmp(&self.cost).then(other.node.cmp(&self.node))
    }
}

impl Lazy {
    fn new(graph: &SuperGraph, ends: [&[f64]; 2], n_neighbours: usize) -> Self {
        let n_graph = graph.graph.nodes.len();
        let mut nodes = graph.graph.nodes.clone();
        let mut neighbours: Vec<Vec<usize>> = graph
            .graph
            .neighbours()
            .into_iter()
            .map(|own| own.into_iter().map(|node| node as usize).collect())
            .collect();
        for end in ends {
            let mut near: Vec<(f64, usize)> =
                nodes[..n_graph].iter().enumerate().map(|(node, other)| (distance(end, other), node)).collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.truncate(n_neighbours);
            let node = nodes.len();
            nodes.push(end.to_vec());
            neighbours.push(near.iter().map(|&(_, other)| other).collect());
            near.iter().for_each(|&(_, other)| neighbours[other].push(node));
        }
        let (valid, found) = (BTreeSet::new(), Vec::new());
        Lazy { nodes, neighbours, n_graph, start: n_graph, goal: n_graph + 1, valid, found, n_tries: 0 }
    }

    fn cut(&mut self, [a, b]: [usize; 2]) {
        self.neighbours[a].retain(|&other| other != b);
        self.neighbours[b].retain(|&other| other != a);
    }

    /// The shortest path that is not known to collide (A*).
    fn path(&self) -> Option<Vec<usize>> {
        let goal = &self.nodes[self.goal];
        let mut costs = vec![f64::INFINITY; self.nodes.len()];
        let mut parents = vec![usize::MAX; self.nodes.len()];
        let mut open = BinaryHeap::from([Open { cost: 0.0, node: self.start }]);
        let mut is_closed = vec![false; self.nodes.len()];
        costs[self.start] = 0.0;
        while let Some(Open { node, .. }) = open.pop() {
            if std::mem::replace(&mut is_closed[node], true) {
                continue;
            }
            if node == self.goal {
                let mut path = vec![node];
                while path[path.len() - 1] != self.start {
                    path.push(parents[path[path.len() - 1]]);
                }
                path.reverse();
                return Some(path);
            }
            for &next in &self.neighbours[node] {
                let cost = costs[node] + distance(&self.nodes[node], &self.nodes[next]);
                if cost < costs[next] {
                    (costs[next], parents[next]) = (cost, node);
                    open.push(Open { cost: cost + distance(&self.nodes[next], goal), node: next });
                }
            }
        }
        None
    }

    /// Nodes that `from` is connected with.
    fn component(&self, from: usize) -> Vec<bool> {
        let mut is_reached = vec![false; self.nodes.len()];
        let mut waiting = vec![from];
        is_reached[from] = true;
        while let Some(node) = waiting.pop() {
            for &next in &self.neighbours[node] {
                if !std::mem::replace(&mut is_reached[next], true) {
                    waiting.push(next);
                }
            }
        }
        is_reached
    }

    /// Joins what start and goal are connected with by a local search; its path becomes part of the graph.
    fn reconnect(
        &mut self,
        all: &mut Collider,
        rng: &mut Rng,
        settings: &QuerySettings,
        budget: &Budget,
        outcome: &mut QueryOutcome,
    ) -> bool {
        if self.n_tries >= MOST_TRIES {
            return false;
        }
        self.n_tries += 1;
        let (from_start, from_goal) = (self.component(self.start), self.component(self.goal));
        // Ends of motions that are known to be free: the two nearest to each other, else start and goal.
        let tested: BTreeSet<usize> = self.valid.iter().flatten().copied().collect();
        let side = |is_in: &[bool], end: usize| -> Vec<usize> {
            tested.iter().copied().filter(|&node| is_in[node]).chain([end]).collect()
        };
        let (firsts, lasts) = (side(&from_start, self.start), side(&from_goal, self.goal));
        let mut best = (f64::INFINITY, self.start, self.goal);
        if self.n_tries < MOST_TRIES {
            for &a in &firsts {
                for &b in &lasts {
                    let far = distance(&self.nodes[a], &self.nodes[b]);
                    if far < best.0 && all.contact(&self.nodes[a]).is_none() && all.contact(&self.nodes[b]).is_none() {
                        best = (far, a, b);
                    }
                }
            }
        }
        let (_, a, b) = best;
        let region = Region::of(all.model, &[&self.nodes[a], &self.nodes[b]]);
        let settings =
            RrtSettings { max_samples: settings.max_samples, ..RrtSettings::for_dimension(all.model.dimension()) };
        let goals = [self.nodes[b].clone()];
        // In samples first; where a motion of that path cannot be certified, with certified motions.
        let mut found =
            rrt_connect(&self.nodes[a], &goals, &region, &settings, rng, budget, |p, q| all.is_sampled_free(p, q));
        let mut is_certified = |p: &[f64], q: &[f64]| all.is_certified_free(&Track::straight(p, q));
        let is_proved = found.path.iter().flat_map(|path| path.windows(2)).all(|pair| is_certified(&pair[0], &pair[1]));
        if found.interrupt.is_none() && !is_proved {
            found = rrt_connect(&self.nodes[a], &goals, &region, &settings, rng, budget, is_certified);
        }
        outcome.interrupt = found.interrupt;
        let Some(path) = found.path else { return false };
        let mut last = a;
        let n = path.len();
        for (index, point) in path.into_iter().enumerate().skip(1) {
            let node = if index + 1 == n { b } else { self.nodes.len() };
            if node == self.nodes.len() {
                self.nodes.push(point);
                self.neighbours.push(Vec::new());
            }
            self.neighbours[last].push(node);
            self.neighbours[node].push(last);
            let edge = [last.min(node), last.max(node)];
            self.valid.insert(edge);
            self.found.push(edge);
            last = node;
        }
        true
    }

    /// Nodes and edges that local searches added, start and goal among them, by the indices that the graph gives them.
    fn enrich(&self) -> (Vec<Vec<f64>>, Vec<[usize; 2]>) {
        if self.found.is_empty() {
            return (Vec::new(), Vec::new());
        }
        let nodes = self.nodes[self.n_graph..].to_vec();
        let edges = self.valid.iter().copied().filter(|[_, b]| *b >= self.n_graph);
        (nodes, edges.chain(self.found.iter().copied()).collect())
    }
}
