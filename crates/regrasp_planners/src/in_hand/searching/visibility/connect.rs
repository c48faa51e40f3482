//! connect_components(): joins components of the roadmap by one transfer and one regrasp, through GS_(n-1) (Saut 2011,
//! sec. 4.2.3; Sahbani 2007, algorithm 3).

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::regrasping::change::patience_now;
use crate::in_hand::searching::visibility::explore::{Spare, Spares};
use crate::in_hand::searching::visibility::link::{GraspSpace, Link, LocalMethod, Roadmap, distance, single_sequence};
use regrasp_manipulation::grasp::state::GraspState;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Pairs of nodes that were tried: for those where only a finger's way was missing, how long it was looked for.
pub type TriedPairs = BTreeMap<(usize, usize), Option<usize>>;

/// Share of connections that start from a grasp which a component sees, where there is one. By hand.
const SPARE_SHARE: f64 = 0.5;

/// From a random grasp of a component, tries the nearest node of each other component. True when components were joined.
///
/// The grasp is a node, or one that only its component sees: the visibility PRM throws those away, but where a component has one
/// guard, such as the start, they are its only other chances. From a node, pairs are tried once, and again when a finger's way
/// may be looked for longer.
pub fn connect_components(
    search: &mut Search,
    roadmap: &mut Roadmap,
    tried: &mut TriedPairs,
    spares: &mut Spares,
) -> Result<bool, Stop> {
    search.check()?;
    if search.rng.chance(SPARE_SHARE)
        && let Some(spare) = spares.draw(&mut search.rng)
    {
        return connect_spare(search, roadmap, spare);
    }
    let node = search.rng.below(roadmap.nodes().len());
    let mut has_joined = false;
    for other in other_components(roadmap, node) {
        search.check()?;
        let point = &roadmap.nodes()[node].point;
        let patience = patience_now(search);
        let is_open = |there: usize| {
            let known = tried.get(&(node.min(there), node.max(there)));
            known.is_none_or(|looked| looked.is_some_and(|iterations| iterations < patience))
        };
        let Some((cost, there)) = nearest_of(search, roadmap, point, (node, other), is_open) else { continue };
        let n_failed = search.workspace.rrt_runs.failed;
        let (from, to) = (&roadmap.nodes()[node].point, &roadmap.nodes()[there].point);
        let steps = single_sequence(search, from, to);
        // A longer look for a finger's way may find what a short one did not; nothing else changes.
        let lacks_way = search.workspace.rrt_runs.failed > n_failed;
        tried.insert((node.min(there), node.max(there)), lacks_way.then_some(patience));
        if let Some(steps) = steps {
            roadmap.add_edge(node, there, Link::Steps(Rc::new(steps)), cost);
            has_joined = true;
        }
    }
    Ok(has_joined)
}

/// The same from a grasp that is no node; it becomes one where it joins components.
fn connect_spare(search: &mut Search, roadmap: &mut Roadmap, spare: Spare) -> Result<bool, Stop> {
    let Spare { state, guard, link } = spare;
    let mut joined: Vec<(usize, Link)> = Vec::new();
    for other in other_components(roadmap, guard) {
        search.check()?;
        let Some((_, there)) = nearest_of(search, roadmap, &state, (guard, other), |_| true) else { continue };
        if let Some(steps) = single_sequence(search, &state, &roadmap.nodes()[there].point) {
            joined.push((there, Link::Steps(Rc::new(steps))));
        }
    }
    let has_joined = !joined.is_empty();
    if has_joined {
        joined.push((guard, link));
        let space = GraspSpace { search, local_method: LocalMethod::GraspPath, stop: None };
        roadmap.add_linked(&space, state, joined);
        search.n_nodes = roadmap.nodes().len() as u64;
    }
    Ok(has_joined)
}

/// Representatives of the components that `node` is not in.
fn other_components(roadmap: &Roadmap, node: usize) -> Vec<usize> {
    let own = roadmap.components().representative(node);
    roadmap.components().representatives().filter(|&other| other != own).collect()
}

/// The node of component `other` nearest to `point` that is open, and its distance. None when the component has been joined to
/// that of `own` meanwhile, or none is open.
fn nearest_of(
    search: &Search,
    roadmap: &Roadmap,
    point: &GraspState,
    (own, other): (usize, usize),
    is_open: impl Fn(usize) -> bool,
) -> Option<(f64, usize)> {
    if roadmap.components().same(own, other) {
        return None;
    }
    (0..roadmap.nodes().len())
        .filter(|&node| roadmap.components().same(node, other) && is_open(node))
        .map(|node| (distance(search, point, &roadmap.nodes()[node].point), node))
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
}
