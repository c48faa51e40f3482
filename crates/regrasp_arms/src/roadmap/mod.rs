//! Roadmaps of robots with two arms, for many queries in one scene (Saut 2010, sec. V-A and V-B).
//!
//! Each arm with the common part has a roadmap of its own. The *super graph* merges them: from two nodes, one of each roadmap, two
//! configurations of the whole robot come about, one with each value of the common part. Only pairs of bodies that the two
//! roadmaps did not look at are tested. The graph knows what stands still. A query tests the motions of the path that it takes
//! against what the graph does not know, and looks for another way where they collide.

/// Files of graphs.
mod file;
/// Graphs that grow.
mod grow;
/// The roadmap of one arm.
mod one_arm;
/// Queries.
mod query;
/// Graphs made ready for queries.
mod roads;
/// The product of two roadmaps.
mod super_graph;

pub use query::{Changes, QueryOutcome, QuerySettings, Tests, query};
pub use roads::{Counts, Edge, Roads};
pub use super_graph::build;

use crate::model::ArmModel;
use crate::world::World;
use regrasp_base::files::sha256;
use std::fmt::Write as _;

/// Settings of [`build`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BuildSettings {
    /// Nodes of the roadmap of each arm.
    pub nodes_per_arm: usize,
    /// Draws without a new node after which the roadmap of an arm takes nodes that see others.
    pub patience: usize,
    /// Longest motion of the roadmaps of arms, in radians or metres of all joints.
    pub longest: f64,
    /// Distance that bodies keep, in metres.
    pub clearance: f64,
    /// True: the graph has no loops, and its edges only join what was apart.
    pub is_tree: bool,
}

impl Default for BuildSettings {
    fn default() -> Self {
        BuildSettings { nodes_per_arm: 50, patience: 60, longest: 4.0, clearance: 5e-4, is_tree: false }
    }
}

/// Configurations and free motions between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Graph {
    /// Configurations.
    pub nodes: Vec<Vec<f64>>,
    /// Straight motions, by indices of nodes, each once: the smaller first, in rising order.
    pub edges: Vec<[u32; 2]>,
}

impl Graph {
    /// By node: its neighbours, in rising order.
    pub fn neighbours(&self) -> Vec<Vec<u32>> {
        let mut neighbours = vec![Vec::new(); self.nodes.len()];
        for &[a, b] in &self.edges {
            neighbours[a as usize].push(b);
            neighbours[b as usize].push(a);
        }
        neighbours.iter_mut().for_each(|own| own.sort_unstable());
        neighbours
    }

    /// Adds an edge once.
    pub fn connect(&mut self, a: usize, b: usize) {
        let edge = [a.min(b) as u32, a.max(b) as u32];
        if let Err(place) = self.edges.binary_search(&edge) {
            self.edges.insert(place, edge);
        }
    }
}

/// A graph with what it was made for.
#[derive(Debug, Clone, PartialEq)]
pub struct SuperGraph {
    /// Names of the coordinates of a configuration.
    pub joints: Vec<String>,
    /// What stands for the robot: its bodies, pairs and limits, and where joints that are not planned stand.
    pub robot: String,
    /// What stands for the obstacles.
    pub world: String,
    /// Distance that bodies keep, in metres.
    pub clearance: f64,
    /// Seed.
    pub seed: u64,
    /// The graph.
    pub graph: Graph,
}

/// A text that differs where robots differ.
pub fn fingerprint_of_robot(model: &ArmModel) -> String {
    let mut text = String::new();
    for c in &model.coordinates {
        let _ = writeln!(text, "{} {:?} {:?}", c.name, c.lower, c.upper);
    }
    for limit in &model.linear_limits {
        let _ = writeln!(text, "{limit:?}");
    }
    for frame in &model.frames {
        let _ = writeln!(text, "{frame:?}");
    }
    // What is carried belongs to a query.
    for body in model.bodies.iter().filter(|body| body.attached.is_none()) {
        let _ = writeln!(text, "{} {:?} {:?}", body.name, body.frame, &model.balls[body.balls.clone()]);
        for placed in &body.shapes {
            let (position, orientation) = regrasp_geometry::frame::parts_of(&placed.parent_from_shape);
            let _ = writeln!(text, "{} {:?} {position:?} {orientation:?}", placed.shape.kind(), placed.shape.bounds());
        }
    }
    let own = |body: usize| model.bodies[body].attached.is_none();
    for pair in model.pairs.iter().filter(|pair| pair.bodies.iter().all(|&body| own(body))) {
        let _ = writeln!(text, "{:?}", pair.bodies);
    }
    sha256(text.as_bytes())
}

/// A text that differs where obstacles differ.
pub fn fingerprint_of_world(world: &World) -> String {
    let mut text = String::new();
    for obstacle in &world.obstacles {
        let placed = &obstacle.placed;
        let (position, orientation) = regrasp_geometry::frame::parts_of(&placed.parent_from_shape);
        let (center, radius) = placed.shape.bounding_sphere();
        let _ = writeln!(
            text,
            "{} {position:?} {orientation:?} {:?} {center:?} {radius:?}",
            placed.shape.kind(),
            placed.shape.bounds()
        );
    }
    sha256(text.as_bytes())
}
