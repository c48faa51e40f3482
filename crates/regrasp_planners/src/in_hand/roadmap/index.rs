//! What a graph is searched with: links by node with their costs, nodes by place, components.

use crate::in_hand::roadmap::graph::{Graph, Lists};
use crate::in_hand::roadmap::region::near_distance;
use regrasp_roadmap::Components;
use std::collections::BTreeMap;
use std::ops::Range;

/// What motions cost, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// Length by which angles of the object are weighed: a transfer costs its distance.
    pub turn_length: f64,
    /// A relocation costs this.
    pub relocation: f64,
}

/// The edges of a graph from both ends, and its nodes by place.
#[derive(Debug, Clone, Default)]
pub struct Index {
    /// First entry of every node in `links`, and the number of links at the end.
    firsts: Vec<u32>,
    links: Vec<Link>,
    /// The edge of each link.
    edges: Vec<u32>,
    /// Nodes of every place.
    nodes_at: Lists,
}

/// One end of an edge, as the node at the other end sees it: no more than a search looks at, as memory is what it waits for.
#[derive(Debug, Clone, Copy)]
struct Link {
    node: u32,
    cost: f32,
}

impl Index {
    /// Of a graph that is valid.
    pub fn new(graph: &Graph, costs: Costs) -> Self {
        let ends = graph.edges.iter().enumerate();
        let ends = ends.flat_map(|(index, edge)| [(edge.from, index as u32), (edge.to, index as u32)]);
        let edges_of = Lists::new(graph.nodes.len(), ends);
        let mut links = Vec::with_capacity(2 * graph.edges.len());
        for node in 0..graph.nodes.len() {
            for &index in edges_of.of(node) {
                let edge = &graph.edges[index as usize];
                let other = if edge.from as usize == node { edge.to } else { edge.from };
                let cost = if edge.passage.is_transfer() {
                    near_distance(graph.pose(node), graph.pose(other as usize), costs.turn_length)
                } else {
                    costs.relocation
                };
                links.push(Link { node: other, cost: cost as f32 });
            }
        }
        let (firsts, edges) = edges_of.into_tables();
        let places = graph.nodes.iter().enumerate().map(|(index, node)| (node.place, index as u32));
        Index { firsts, links, edges, nodes_at: Lists::new(graph.places.len(), places) }
    }

    fn range_of(&self, node: usize) -> Range<usize> {
        self.firsts[node] as usize..self.firsts[node + 1] as usize
    }

    /// Nodes at a place.
    pub fn nodes_at(&self, place: usize) -> &[u32] {
        self.nodes_at.of(place)
    }

    /// Appends the neighbours of `node` with what it costs to go there.
    pub fn neighbours(&self, node: usize, out: &mut Vec<(usize, f64)>) {
        let links = &self.links[self.range_of(node)];
        out.extend(links.iter().map(|link| (link.node as usize, f64::from(link.cost))));
    }

    /// The cheapest edge between two nodes.
    pub fn edge_between(&self, a: usize, b: usize) -> Option<u32> {
        let (links, edges) = (&self.links[self.range_of(a)], &self.edges[self.range_of(a)]);
        let between = links.iter().zip(edges).filter(|(link, _)| link.node as usize == b);
        let cheapest = between.min_by(|x, y| x.0.cost.total_cmp(&y.0.cost).then(x.1.cmp(y.1)));
        cheapest.map(|(_, &edge)| edge)
    }
}

/// Connected components of a graph.
pub fn components(graph: &Graph) -> Components {
    let mut components = Components::new();
    for _ in &graph.nodes {
        components.push();
    }
    for edge in &graph.edges {
        components.join(edge.from as usize, edge.to as usize);
    }
    components
}

/// The smallest node of each component and the component's size, largest first, of equals the one with the smaller node.
pub fn component_sizes(components: &Components) -> Vec<(usize, usize)> {
    let mut counts = BTreeMap::new();
    for node in 0..components.len() {
        *counts.entry(components.representative(node)).or_insert(0usize) += 1;
    }
    let mut sizes: Vec<(usize, usize)> = counts.into_iter().collect();
    sizes.sort_by_key(|&(_, size)| std::cmp::Reverse(size));
    sizes
}
