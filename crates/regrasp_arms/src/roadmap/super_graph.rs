//! The product of two roadmaps (Saut 2010, sec. V-A.1 and V-A.2).

use super::one_arm::one_arm;
use super::{BuildSettings, Graph, SuperGraph, fingerprint_of_robot, fingerprint_of_world};
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Track};
use crate::search::Region;
use crate::world::World;
use regrasp_base::Rng;
use regrasp_roadmap::Components;

/// A node of the super graph: one node of each arm's roadmap, and from which of the two the common part is.
#[derive(Debug, Clone, Copy)]
struct Origin {
    nodes: [usize; 2],
    common: usize,
}

/// Builds the super graph of a robot of two arms; of a robot of one arm its roadmap. None of robots of another number of arms.
pub fn build(model: &ArmModel, world: &World, settings: &BuildSettings, seed: u64) -> Option<SuperGraph> {
    let parts = model.parts();
    let rest = model.configuration_of(&model.state);
    let region = Region::of(model, &[&rest]);
    let collider = ColliderSettings { clearance: settings.clearance, ..ColliderSettings::default() };
    let mut collider = Collider::new(model, world, collider);
    let mut roadmaps = Vec::new();
    for (index, arm) in parts.arms.iter().enumerate() {
        let others: Vec<usize> = parts
            .arms
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index)
            .flat_map(|(_, own)| own.clone())
            .collect();
        let belongs = |body: usize| !model.is_moved_by(body, &others);
        collider.only(belongs, |[a, b]| belongs(a) && belongs(b));
        let mut part: Vec<usize> = parts.common.iter().chain(arm).copied().collect();
        part.sort_unstable();
        let mut rng = Rng::keyed(seed, "arm_roadmap", index as u64);
        roadmaps.push(one_arm(&mut collider, &part, &rest, &region, settings, &mut rng));
    }
    let graph = match (roadmaps.as_slice(), parts.arms.as_slice()) {
        ([only], _) => only.clone(),
        ([first, second], [arm_a, arm_b]) => {
            let merge = Merge {
                model,
                parts: [arm_a, arm_b],
                common: &parts.common,
                roadmaps: [first, second],
                neighbours: [first.neighbours(), second.neighbours()],
                settings,
            };
            merge.run(&mut collider)
        }
        _ => return None,
    };
    Some(SuperGraph {
        joints: model.coordinates.iter().map(|c| c.name.clone()).collect(),
        robot: fingerprint_of_robot(model),
        world: fingerprint_of_world(world),
        clearance: settings.clearance,
        seed,
        graph,
    })
}

struct Merge<'a> {
    model: &'a ArmModel,
    parts: [&'a Vec<usize>; 2],
    common: &'a [usize],
    roadmaps: [&'a Graph; 2],
    neighbours: [Vec<Vec<u32>>; 2],
    settings: &'a BuildSettings,
}

impl Merge<'_> {
    fn run(&self, collider: &mut Collider) -> Graph {
        let mut graph = Graph::default();
        let mut origins: Vec<Origin> = Vec::new();
        let [n_a, n_b] = self.roadmaps.map(|roadmap| roadmap.nodes.len());
        // By pair of nodes and common part: the node of the super graph.
        let mut index_of: Vec<Option<usize>> = vec![None; n_a * n_b * 2];
        let n_common = if self.common.is_empty() { 1 } else { 2 };
        for common in 0..n_common {
            self.only_unknown(collider, common);
            for a in 0..n_a {
                for b in 0..n_b {
                    let whole = self.fused([a, b], common);
                    let limits = &self.model.linear_limits;
                    if limits.iter().any(|limit| limit.room(&whole) < 0.0) || collider.contact(&whole).is_some() {
                        continue;
                    }
                    index_of[(a * n_b + b) * 2 + common] = Some(graph.nodes.len());
                    graph.nodes.push(whole);
                    origins.push(Origin { nodes: [a, b], common });
                }
            }
        }
        let mut edges = Vec::new();
        let mut components = Components::new();
        graph.nodes.iter().for_each(|_| {
            components.push();
        });
        // Both ends with the common part of the first arm, of the second, of one each.
        for kind in 0..=n_common {
            match kind {
                2 => self.only_unknown_mixed(collider),
                common => self.only_unknown(collider, common),
            }
            if kind == 1 && n_common == 1 {
                break;
            }
            for (node, origin) in origins.iter().enumerate() {
                for other in self.linked(origin, kind, &index_of) {
                    if other <= node && kind < 2 {
                        continue;
                    }
                    if self.settings.is_tree && components.same(node, other) {
                        continue;
                    }
                    if collider.is_certified_free(&Track::straight(&graph.nodes[node], &graph.nodes[other])) {
                        edges.push([node.min(other) as u32, node.max(other) as u32]);
                        components.join(node, other);
                    }
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        graph.edges = edges;
        graph
    }

    /// The configuration with the arms of two nodes, and the common part of one of them.
    fn fused(&self, nodes: [usize; 2], common: usize) -> Vec<f64> {
        let [a, b] = [&self.roadmaps[0].nodes[nodes[0]], &self.roadmaps[1].nodes[nodes[1]]];
        let mut whole = [a, b][common].clone();
        self.parts[0].iter().for_each(|&k| whole[k] = a[k]);
        self.parts[1].iter().for_each(|&k| whole[k] = b[k]);
        whole
    }

    /// Nodes that a node may be connected with: their parts are connected in the roadmaps, or the same.
    fn linked(&self, origin: &Origin, kind: usize, index_of: &[Option<usize>]) -> Vec<usize> {
        let n_b = self.roadmaps[1].nodes.len();
        let around = |arm: usize| {
            let own = origin.nodes[arm];
            std::iter::once(own).chain(self.neighbours[arm][own].iter().map(|&other| other as usize))
        };
        let (from, to) = match kind {
            // From the common part of the first arm to that of the second.
            2 => (0, 1),
            common => (common, common),
        };
        if origin.common != from {
            return Vec::new();
        }
        let pairs = around(0).flat_map(|a| around(1).map(move |b| (a, b)));
        pairs.filter_map(|(a, b)| index_of[(a * n_b + b) * 2 + to]).collect()
    }

    /// Tests what the roadmap of arm `known` has not looked at: the other arm against obstacles, the common part and that arm.
    fn only_unknown(&self, collider: &mut Collider, known: usize) {
        let other = self.parts[1 - known];
        let own = |body: usize| self.model.is_moved_by(body, other);
        // How the other arm stands to itself does not depend on the common part: its own roadmap knows that.
        collider.only(own, |[a, b]| own(a) != own(b));
    }

    /// Tests all but how each arm stands to itself.
    fn only_unknown_mixed(&self, collider: &mut Collider) {
        let of = |body: usize| [0, 1].map(|arm| self.model.is_moved_by(body, self.parts[arm]));
        collider.only(|_| true, |[a, b]| of(a) != of(b) || of(a) == [false, false]);
    }
}
