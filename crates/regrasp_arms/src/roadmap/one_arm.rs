//! The roadmap of one arm with the common part: a visibility roadmap (Simeon, Laumond, Nissoux 2000) that goes on until it has as
//! many nodes as asked for.

use super::{BuildSettings, Graph};
use crate::motion::{Collider, Track};
use crate::search::{Region, distance};
use regrasp_base::Rng;
use regrasp_roadmap::Components;

/// Nodes that a node beyond the visibility roadmap is connected with, at most.
const NEIGHBOURS: usize = 3;
/// Draws per node asked for, at most.
const DRAWS_PER_NODE: usize = 400;

/// The roadmap over the coordinates `part`; all others are as in `rest`. `collider` tests what belongs to the part.
pub fn one_arm(
    collider: &mut Collider,
    part: &[usize],
    rest: &[f64],
    region: &Region,
    settings: &BuildSettings,
    rng: &mut Rng,
) -> Graph {
    let mut graph = Graph::default();
    let mut components = Components::new();
    let region = region.of_part(part, rest);
    let (mut drawn, mut without, mut is_guard) = (Vec::new(), 0, Vec::<bool>::new());
    for _ in 0..settings.nodes_per_arm * DRAWS_PER_NODE {
        if graph.nodes.len() >= settings.nodes_per_arm {
            break;
        }
        region.draw(rng, &mut drawn);
        let mut whole = rest.to_vec();
        part.iter().zip(&drawn).for_each(|(&k, value)| whole[k] = *value);
        if !collider.is_sampled_free(&whole, &whole) || collider.contact(&whole).is_some() {
            continue;
        }
        // The nearest first.
        let mut near: Vec<(f64, usize)> =
            graph.nodes.iter().enumerate().map(|(index, node)| (distance(node, &whole), index)).collect();
        near.retain(|(far, _)| *far <= settings.longest);
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let is_visibility = without < settings.patience;
        let mut seen: Vec<usize> = Vec::new();
        for &(_, index) in &near {
            let is_known = seen.iter().any(|&other| components.same(other, index));
            if is_visibility && (is_known || !is_guard[index]) || seen.len() >= NEIGHBOURS.max(2) && !is_visibility {
                continue;
            }
            if collider.is_certified_free(&Track::straight(&graph.nodes[index], &whole)) {
                seen.push(index);
            }
        }
        // Guards see nothing; connectors see several components. Later all that sees something is taken.
        let is_new_guard = seen.is_empty();
        if is_visibility && seen.len() == 1 {
            without += 1;
            continue;
        }
        if !is_visibility && is_new_guard {
            continue;
        }
        without = if is_visibility { 0 } else { without };
        let node = graph.nodes.len();
        graph.nodes.push(whole);
        is_guard.push(is_new_guard);
        components.push();
        for other in seen {
            graph.connect(other, node);
            components.join(other, node);
        }
    }
    graph
}
