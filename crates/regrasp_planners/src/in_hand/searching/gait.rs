//! Two gait trees, from the start and from the goal, that grow until they meet.
//!
//! In place of sampling GS_n and linking (Saut 2011, sec. 4.2) the trees only ever hold what is feasible. Motions can be
//! gone backwards, so what leads from the goal leads to it.

/// Orders of relocations, by closure alone.
mod order;
/// A tree of grasps that grows by gaits.
mod tree;

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::moving::spin;
use crate::in_hand::moving::spin::Meeting;
use crate::in_hand::moving::transfer::{is_carried_out, transfer};
use crate::in_hand::regrasping::change::{Arrival, change_grasp, change_grasp_over, whole_transfer};
use crate::in_hand::searching::gait::tree::{Node, Place, Tree, land};
use arrayvec::ArrayVec;
use regrasp_base::Rng;
use regrasp_geometry::{Pose, interpolate_pose};
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::{GraspState, MAX_FINGERS};
use regrasp_manipulation::outline::{Outline, OutlineEdge};

/// Nodes at a common pose whose grasps are tried to be joined: any at first, in hard queries those most like the grasp that
/// is to be joined. By measurement, 20 seeds: that takes a fifth off the work of allegro/cube45_x, a twentieth off box_x.
const JOINS: usize = 4;

/// Nodes before which no extension wanders: easy queries are solved by then.
const EAGER_NODES: usize = 10;

/// Nodes from which on grasps are joined over third ones too: easy queries are solved by then. By measurement on the wide
/// hand's boxes, which take a tenth longer without.
const HARD_NODES: u64 = 30;

/// Nodes of the other tree, the nearest to a new one, of which it is asked whether closure lets fingers change to their grasps. By
/// measurement, 16 seeds of allegro/cube57_x, box_y and cylinder20_x: 200 of them, with twice as many gone to, take no less.
const NEAREST: usize = 64;
/// Those to whose grasps it does are gone to, so many at most. By measurement as above: 2 take a third more work on cylinder20_x, 8 more
/// time for as much work.
const GONE_TO: usize = 4;

/// Nodes of the other tree of which it is estimated how far they are from a common pose with a new one.
const MEETINGS_LOOKED_AT: usize = 64;

/// Where an extension aims.
enum Target {
    /// The other end of the query.
    Aim,
    /// A pose that the other tree has reached.
    Other(usize),
    /// Some pose near the way.
    Anywhere(Pose),
}

/// Looks for a sequence of motions from `start` (or from a grasp of its own choice) to the goal pose, and there to the
/// grasp `goal_grasp` if one is asked for.
pub fn grow(search: &mut Search, start: Option<GraspState>, goal_grasp: Option<&GraspState>) -> Result<Sequence, Stop> {
    let (start_pose, goal_pose) = (search.start, search.goal);
    let mut trees = [
        Tree::new(search, &start_pose, &goal_pose, start.as_ref()),
        Tree::new(search, &goal_pose, &start_pose, goal_grasp),
    ];
    let mut growing = 0;
    loop {
        if let Err(stop) = search.check() {
            search.reached = Some(Box::new(outline(&trees)));
            return Err(stop);
        }
        search.n_nodes = (trees[0].nodes.len() + trees[1].nodes.len()) as u64;
        let target = draw_target(search, &trees, growing);
        let pose = match &target {
            Target::Aim => trees[growing].aim,
            Target::Other(place) => *trees[1 - growing].places[*place].pool.world_from_object(),
            Target::Anywhere(pose) => *pose,
        };
        if let Some(node) = trees[growing].grow(search, &pose) {
            if growing == 0 {
                search.note(trees[0].nodes[node].state());
            }
            if let Some(solution) =
                meet(search, &mut trees, growing, node, &target).or_else(|| bridge(search, &mut trees, growing, node))
            {
                return Ok(solution);
            }
        }
        // The smaller tree grows, so that an easy end does not starve a hard one.
        growing = usize::from(trees[1].nodes.len() < trees[0].nodes.len());
        if search.rng.chance(0.2) {
            growing = 1 - growing;
        }
    }
}

/// Both trees, the nodes of the start's first.
fn outline(trees: &[Tree; 2]) -> Outline {
    let (mut poses, mut edges) = (Vec::new(), Vec::new());
    for tree in trees {
        let first = poses.len();
        poses.extend(tree.nodes.iter().map(|node| node.state().world_from_object));
        for (index, node) in tree.nodes.iter().enumerate() {
            let edge =
                |parent| OutlineEdge { nodes: [first + parent, first + index], changes_grasp: node.changes_grasp() };
            edges.extend(node.parent().map(edge));
        }
    }
    Outline::new(poses, edges)
}

fn draw_target(search: &mut Search, trees: &[Tree; 2], growing: usize) -> Target {
    let other = &trees[1 - growing];
    let is_young = trees[0].nodes.len() + trees[1].nodes.len() < EAGER_NODES;
    if !is_young && !search.rng.chance(search.settings.search.goal_share) {
        return Target::Anywhere(search.draw_pose());
    }
    if other.places.len() > 1 && search.rng.chance(OTHER_SHARE) {
        return Target::Other(nearest_of_some(search, &trees[growing], other));
    }
    Target::Aim
}

/// Of some places of the other tree, the one nearest to the growing tree.
fn nearest_of_some(search: &mut Search, tree: &Tree, other: &Tree) -> usize {
    let mut best = (f64::INFINITY, 0);
    for _ in 0..OTHERS_LOOKED_AT {
        let index = search.rng.below(other.places.len());
        let pose = other.places[index].pool.world_from_object();
        for place in &tree.places {
            let distance = search.distance(place.pool.world_from_object(), pose);
            if distance < best.0 && !other.places[index].nodes.is_empty() {
                best = (distance, index);
            }
        }
    }
    best.1
}

/// Places of the other tree that are compared before one is aimed at.
const OTHERS_LOOKED_AT: usize = 3;
/// Share of purposeful extensions that aim at what the other tree has reached.
const OTHER_SHARE: f64 = 0.4;

/// The whole way, if `node` of the growing tree completes it.
fn meet(search: &mut Search, trees: &mut [Tree; 2], growing: usize, node: usize, target: &Target) -> Option<Sequence> {
    let [first, second] = trees;
    let (tree, other) = if growing == 0 { (&*first, second) } else { (&*second, first) };
    let state = tree.nodes[node].state();
    let place = match target {
        Target::Aim => 0,
        Target::Other(place) => *place,
        Target::Anywhere(_) => return None,
    };
    if state.world_from_object != *other.places[place].pool.world_from_object() {
        return None;
    }
    if place == 0 && other.root_is_free {
        let way = land(search, other, tree.trace(node))?;
        return Some(from_the_start(growing, way));
    }
    let (there, join) = join(search, &Sequence::at(state.clone()), other, place)?;
    let way = tree.trace(node).then(join)?.then(other.trace(there).reversed())?;
    Some(from_the_start(growing, way))
}

/// From a new node to one of the other tree, and into its grasp: to the nearest ones that closure lets fingers change to, or where there
/// is none near, straight to the nearest pose and there over third contacts.
fn bridge(search: &mut Search, trees: &mut [Tree; 2], growing: usize, node: usize) -> Option<Sequence> {
    let [first, second] = trees;
    let (tree, other) = if growing == 0 { (&*first, second) } else { (&*second, first) };
    let state = tree.nodes[node].state();
    if spin::is_restricted(search.model(), state.holding) {
        // Hands that never change their grasp have to arrive by one transfer.
        return if search.model().may_release { bridge_halfway(search, tree, other, node, growing) } else { None };
    }
    let in_order = in_order(search, state, other);
    if !in_order.is_empty() {
        return in_order.into_iter().find_map(|there| {
            let (way, back) = way_to_common_pose(search, state, other.nodes[there].state())?;
            let mut rng = Rng::child(&search.rng, "join", 0);
            search.rng.bits();
            let join = change_grasp(search, &way, back.end(), Arrival::Exact, &mut rng)?;
            let way = tree.trace(node).then(join)?.then(back.reversed())?.then(other.trace(there).reversed())?;
            Some(from_the_start(growing, way))
        });
    }
    let mut nearest = (f64::INFINITY, None);
    for (index, place) in other.places.iter().enumerate() {
        let distance = search.distance(&state.world_from_object, place.pool.world_from_object());
        if distance < nearest.0 && !place.nodes.is_empty() {
            nearest = (distance, Some(index));
        }
    }
    let place = nearest.1?;
    let across = whole_transfer(search, state, other.places[place].pool.world_from_object())?;
    let (there, join) = join(search, &across, other, place)?;
    let way = tree.trace(node).then(join)?.then(other.trace(there).reversed())?;
    Some(from_the_start(growing, way))
}

/// Nodes of the other tree near `state` to whose grasps closure lets fingers change from that of `state`; the nearest first.
///
/// By measurement on allegro/box_y, cube57_x and cylinder20_x: of the changes that were tried between nearest nodes, 100 to 5,000 a search,
/// nine in ten to all failed for want of such an order.
fn in_order(search: &mut Search, state: &GraspState, other: &Tree) -> ArrayVec<usize, GONE_TO> {
    let to = |there: &Node| search.distance(&state.world_from_object, &there.state().world_from_object);
    let mut nearest: Vec<(f64, usize)> = other.nodes.iter().map(to).zip(0..).collect();
    // Stable: of nodes at one pose the oldest is the first.
    nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
    nearest.truncate(NEAREST);
    let in_order = |there: &usize| order::exists(search, state, other.nodes[*there].state());
    nearest.into_iter().map(|(_, there)| there).filter(in_order).take(GONE_TO).collect()
}

/// Transfers of `state` and of `theirs` to a common pose on the way between them: that of `theirs`, where `state` can be taken there.
fn way_to_common_pose(search: &mut Search, state: &GraspState, theirs: &GraspState) -> Option<(Sequence, Sequence)> {
    let [from, to] = [&state.world_from_object, &theirs.world_from_object];
    let mut moments = Vec::new();
    let made = transfer(&mut search.workspace, state, to, &mut moments);
    if made == 1.0 {
        let mut way = Sequence::at(state.clone());
        way.push_transfer(moments);
        return Some((way, Sequence::at(theirs.clone())));
    }
    let made_by_theirs = transfer(&mut search.workspace, theirs, from, &mut Vec::new());
    if made + made_by_theirs < 1.0 {
        return None;
    }
    let common = interpolate_pose(from, to, 0.5 * (made + 1.0 - made_by_theirs));
    Some((whole_transfer(search, state, &common)?, whole_transfer(search, theirs, &common)?))
}

/// From a new node and from one of the other tree to a pose between them, and there from one grasp into the other: where soft
/// fingertips leave the object few directions, transfers seldom arrive where the other tree is.
fn bridge_halfway(search: &mut Search, tree: &Tree, other: &Tree, node: usize, growing: usize) -> Option<Sequence> {
    let model = search.model();
    let state = tree.nodes[node].state();
    let n_seen = other.nodes.len().min(MEETINGS_LOOKED_AT);
    let mut seen: Vec<(f64, usize)> = Vec::with_capacity(n_seen);
    for k in 0..n_seen {
        let there = if n_seen == other.nodes.len() { k } else { search.rng.below(other.nodes.len()) };
        if let Some(way) = spin::way_to_meeting(model, [state, other.nodes[there].state()]) {
            seen.push((way, there));
        }
    }
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    seen.dedup_by_key(|(_, there)| *there);
    let drawn: ArrayVec<usize, JOINS> = seen.iter().map(|(_, there)| *there).take(JOINS).collect();
    drawn.into_iter().find_map(|there| {
        let theirs = other.nodes[there].state();
        let Meeting { moments: [mine, their_moments] } =
            spin::meet(model, [state, theirs], &mut search.workspace.work)?;
        let mut rng = Rng::child(&search.rng, "halfway", 0);
        search.rng.bits();
        let workspace = &mut search.workspace;
        if !is_carried_out(workspace, state, &mine) || !is_carried_out(workspace, theirs, &their_moments) {
            return None;
        }
        let (mut way, mut back) = (Sequence::at(state.clone()), Sequence::at(theirs.clone()));
        way.push_transfer(mine);
        back.push_transfer(their_moments);
        let join = change_grasp(search, &way, back.end(), Arrival::Exact, &mut rng)?;
        let way = tree.trace(node).then(join)?.then(back.reversed())?.then(other.trace(there).reversed())?;
        Some(from_the_start(growing, way))
    })
}

/// `way` and then relocations into exactly one of the nodes at `place` of `other`, which has the object pose that `way`
/// ends at.
fn join(search: &mut Search, way: &Sequence, other: &mut Tree, place: usize) -> Option<(usize, Sequence)> {
    let Tree { nodes: all, places, .. } = other;
    let Place { nodes, pool, .. } = &mut places[place];
    let nodes: Vec<usize> = match search.n_nodes < HARD_NODES {
        true => (0..JOINS.min(nodes.len())).map(|_| nodes[search.rng.below(nodes.len())]).collect(),
        false => {
            let mut likest = likest(search, way.end(), all, nodes);
            // Stable: of those that closure lets fingers change to, the likest is the first.
            likest.sort_by_key(|&there| !order::exists(search, way.end(), all[there].state()));
            likest.truncate(JOINS);
            likest
        }
    };
    nodes.into_iter().find_map(|there| {
        let mut rng = Rng::child(&search.rng, "join", 0);
        search.rng.bits();
        let to = all[there].state();
        let change = match search.n_nodes < HARD_NODES {
            true => change_grasp(search, way, to, Arrival::Exact, &mut rng),
            false => change_grasp_over(search, way, to, pool, &mut rng),
        };
        Some((there, change?))
    })
}

/// Of `nodes` up to [`NEAREST`] that hold most like `state`, the likest first, with the fingers that are seldom free to move counting most.
fn likest(search: &mut Search, state: &GraspState, all: &[Node], nodes: &[usize]) -> Vec<usize> {
    let n_fingers = search.model().n_fingers();
    let bound: ArrayVec<f64, MAX_FINGERS> = (0..n_fingers)
        .map(|finger| {
            let seen = search.tally.release(finger);
            1.0 - seen.n_held as f64 / seen.n_grasps.max(1) as f64
        })
        .collect();
    let unlikeness = |other: &GraspState| -> f64 {
        let normal = |state: &GraspState, finger: usize| state.contacts[finger].normal_in_object;
        (0..n_fingers).map(|f| bound[f] * (1.0 - normal(state, f).dot(&normal(other, f)))).sum()
    };
    let mut nodes = nodes.to_vec();
    search.rng.shuffle(&mut nodes);
    // Stable: equally like ones stay in random order.
    nodes.sort_by(|&a, &b| unlikeness(all[a].state()).total_cmp(&unlikeness(all[b].state())));
    nodes.truncate(NEAREST);
    nodes
}

/// `way` as it goes from the start to the goal, found from the end whose tree was growing.
fn from_the_start(growing: usize, way: Sequence) -> Sequence {
    if growing == 0 { way } else { way.reversed() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::in_hand::grasps::sample::draw_state;
    use crate::in_hand::roadmap_tests::with_settings;
    use crate::settings::InHandSettings;

    /// Both grasps come to the same pose, with the contacts' fingers, also where neither can be taken to the other's pose.
    #[test]
    fn two_grasps_come_to_a_pose_between_them() {
        with_settings("box_90x.toml", &InHandSettings::default(), |search| {
            let states: Vec<GraspState> = (0..400).filter_map(|_| draw_state(search)).take(40).collect();
            let [mut n_at_theirs, mut n_between] = [0; 2];
            for (state, theirs) in states.iter().flat_map(|state| states.iter().map(move |theirs| (state, theirs))) {
                if state.world_from_object == theirs.world_from_object {
                    continue;
                }
                let Some((way, back)) = way_to_common_pose(search, state, theirs) else {
                    let reaches = whole_transfer(search, state, &theirs.world_from_object).is_some();
                    assert!(!reaches, "it can be taken there");
                    continue;
                };
                assert_eq!((way.start(), back.start()), (state, theirs));
                let common = way.end().world_from_object;
                assert_eq!(common, back.end().world_from_object);
                let [from, to] = [&state.world_from_object, &theirs.world_from_object];
                let [mine, other] = [from, to].map(|pose| search.distance(&common, pose));
                let whole = search.distance(from, to);
                assert!((mine + other - whole).abs() < 1e-9 + 0.01 * whole, "{mine} + {other} = {whole}");
                if common == *to {
                    n_at_theirs += 1;
                } else {
                    n_between += 1;
                    let is_one_way = whole_transfer(search, state, to).is_some();
                    assert!(!is_one_way, "a way there is taken whole");
                }
            }
            assert!(n_at_theirs > 0 && n_between > 0, "{n_at_theirs} {n_between}");
        });
    }
}
