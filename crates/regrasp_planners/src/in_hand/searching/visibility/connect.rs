//! connect_components(): joins components of the roadmap by one transfer and one regrasp, through GS_(n-1) (Saut 2011,
//! sec. 4.2.3; Sahbani 2007, algorithm 3).

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::searching::visibility::link::{Link, Roadmap, distance, single_sequence};
use std::collections::BTreeSet;
use std::rc::Rc;

/// Pairs of nodes that were tried: the answer seldom changes.
pub type TriedPairs = BTreeSet<(usize, usize)>;

/// From a random node, tries one untried node of each other component: the nearest. True when components were joined.
pub fn connect_components(search: &mut Search, roadmap: &mut Roadmap, tried: &mut TriedPairs) -> Result<bool, Stop> {
    search.check()?;
    let node = search.rng.below(roadmap.nodes().len());
    let own = roadmap.components().representative(node);
    let others: Vec<usize> = roadmap.components().representatives().filter(|&other| other != own).collect();
    let mut has_joined = false;
    for other in others {
        search.check()?;
        let Some((cost, there)) = nearest_untried(search, roadmap, tried, node, other) else { continue };
        tried.insert((node.min(there), node.max(there)));
        let (from, to) = (&roadmap.nodes()[node].point, &roadmap.nodes()[there].point);
        if let Some(steps) = single_sequence(search, from, to) {
            roadmap.add_edge(node, there, Link::Steps(Rc::new(steps)), cost);
            has_joined = true;
        }
    }
    Ok(has_joined)
}

/// The node of `component` nearest to `node` with which it was not tried, and its distance. None when the component
/// has been joined meanwhile or all were tried.
fn nearest_untried(
    search: &Search,
    roadmap: &Roadmap,
    tried: &TriedPairs,
    node: usize,
    component: usize,
) -> Option<(f64, usize)> {
    if roadmap.components().same(node, component) {
        return None;
    }
    let point = &roadmap.nodes()[node].point;
    (0..roadmap.nodes().len())
        .filter(|&other| roadmap.components().same(other, component))
        .filter(|&other| !tried.contains(&(node.min(other), node.max(other))))
        .map(|other| (distance(search, point, &roadmap.nodes()[other].point), other))
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
}
