//! The gait tree: from a node, relocate fingers with look-ahead, then transfer as far as the hand can follow.
//!
//! In place of sampling GS_n and linking (paper 000, section 4.2) the tree only ever holds what is feasible. In-hand-notes
//! section 3, method E, and real-hands-notes section 2, rule F2, found this to be the quickest way that also works on
//! real hands.

use super::candidates::{Candidate, Way, draw_candidates, draw_pose, follow_share};
use super::combine::{ClosureTable, rank, releasable};
use super::grasps::draw_grasp;
use super::regrasp::{Tried, regrasp};
use super::relocate::{Foothold, can_lift, lift_is_within_reach};
use super::search::{Search, Stop};
use super::shorten::change_grasp;
use super::state::{GraspState, Moment, Motion, Step};
use super::tally::Reason;
use super::transfer::transfer;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;

/// Combinations whose relocations are tried in one extension.
const COMBINATIONS: usize = 16;
/// Least share of a transfer that is worth a node.
const LEAST_SHARE: f64 = 0.05;

struct Node {
    state: GraspState,
    parent: usize,
    /// Motions from the parent's state to this one.
    steps: Vec<Step>,
    /// Distance to the goal pose.
    to_goal: f64,
    /// Extensions tried from here.
    n_tries: u32,
}

/// Looks for a sequence of motions from `start` (or from a grasp of its own choice) to the goal pose, and there to the
/// grasp `goal_grasp` if one is asked for.
pub fn grow(
    search: &mut Search,
    start: Option<GraspState>,
    goal_grasp: Option<&GraspState>,
) -> Result<(GraspState, Vec<Step>), Stop> {
    let goal = search.goal;
    let start = match start {
        Some(state) => state,
        None => {
            let pose = search.start;
            loop {
                if let Some(state) = draw_grasp(search, &pose, &goal)? {
                    break state;
                }
            }
        }
    };
    search.note(&start);
    let to_goal = search.distance(&start.world_from_object, &goal);
    let mut tree = vec![Node { state: start, parent: 0, steps: Vec::new(), to_goal, n_tries: 0 }];
    // First of all as far as the start grasp goes by itself.
    let mut fresh = advance(search, &mut tree, 0, &goal, Vec::new());
    loop {
        if let Some(node) = fresh {
            let state = tree[node].state.clone();
            search.note(&state);
            if tree[node].to_goal < REACHED
                && let Some(last) = finish(search, &state, goal_grasp)
            {
                return Ok(trace(tree, node, last));
            }
        }
        search.check()?;
        search.n_nodes = tree.len() as u64;
        let target = if search.rng.chance(search.model().settings.goal_share) {
            goal
        } else {
            draw_pose(search.model(), &search.start, &search.goal, &mut search.rng)
        };
        let node = pick(search, &tree, &target);
        tree[node].n_tries += 1;
        fresh = extend(search, &mut tree, node, &target);
    }
}

/// Relocations from a state at the goal pose to the grasp asked for there; none are needed where any will do.
fn finish(search: &mut Search, state: &GraspState, goal_grasp: Option<&GraspState>) -> Option<Vec<Step>> {
    match goal_grasp {
        None => Some(Vec::new()),
        Some(goal) => {
            let mut rng = Rng::child(&search.rng, "finish", 0);
            change_grasp(search, state, goal, false, &mut rng)
        }
    }
}

/// Distance to the goal below which it is reached; the last transfer ends exactly there (real-hands-notes, 5.1).
const REACHED: f64 = 1e-9;

/// The node to extend: often the nearest to the target with a fee for each try, else any.
fn pick(search: &mut Search, tree: &[Node], target: &Pose) -> usize {
    if search.rng.chance(0.35) {
        return search.rng.below(tree.len());
    }
    let scale = search.model().turn_length();
    let mut best = (f64::INFINITY, 0);
    for (index, node) in tree.iter().enumerate() {
        let distance = search.distance(&node.state.world_from_object, target) + 0.1 * scale * f64::from(node.n_tries);
        if distance < best.0 && node.to_goal > REACHED {
            best = (distance, index);
        }
    }
    best.1
}

/// One extension: candidates for every finger, the best combinations, their relocations, the transfer.
fn extend(search: &mut Search, tree: &mut Vec<Node>, node: usize, target: &Pose) -> Option<usize> {
    let model = search.model();
    let state = tree[node].state.clone();
    let way = Way::new(&state.world_from_object, target);
    let mut options = Vec::with_capacity(model.n_fingers());
    for finger in 0..model.n_fingers() {
        options.push(options_of(search, &state, finger, &way));
    }
    let mut table = ClosureTable::new(model, &options);
    let ranked = rank(&mut search.workspace, &options, &mut table, true, COMBINATIONS);
    if ranked.is_empty() {
        search.tally.add(Reason::NotClosed);
        return None;
    }
    let mut tried = Tried::default();
    let mut rng = Rng::child(&search.rng, "relocation", 0);
    for combination in &ranked {
        let steps =
            regrasp(&mut search.workspace, &state, &options, &combination.choice, &mut table, &mut tried, &mut rng);
        match steps {
            Some(steps) => {
                search.rng.bits();
                return advance(search, tree, node, target, steps);
            }
            None => search.tally.add(Reason::NoWayOver),
        }
    }
    search.rng.bits();
    None
}

/// The present contact of a finger and the best new ones.
fn options_of(search: &mut Search, state: &GraspState, finger: usize, way: &Way) -> Vec<Candidate> {
    let settings = &search.model().settings;
    let workspace = &mut search.workspace;
    let (contact, joints) = (state.contacts[finger], state.joints[finger].clone());
    let follow = follow_share(workspace, finger, &contact, &joints, way);
    let pose = &state.world_from_object;
    let foothold = Foothold { contact: &contact, joints: &joints };
    let is_stuck = !lift_is_within_reach(workspace.model, &Placement::from(pose), finger, &foothold);
    let mut options = vec![Candidate { contact, joints, follow }];
    if is_stuck {
        return options;
    }
    workspace.place_object(pose);
    let new =
        draw_candidates(workspace, finger, pose, way, settings.candidates, settings.candidates_kept, &mut search.rng);
    if new.is_empty() {
        search.tally.add(Reason::NoContact(finger));
    }
    search.n_samples += new.len() as u64;
    options.extend(new);
    options
}

/// Transfers from the end of `steps` towards `target` and adds a node where that ends.
fn advance(
    search: &mut Search,
    tree: &mut Vec<Node>,
    parent: usize,
    target: &Pose,
    mut steps: Vec<Step>,
) -> Option<usize> {
    let from = steps.last().map_or(&tree[parent].state, |step| &step.end).clone();
    let mut moments = Vec::new();
    let share = transfer(&mut search.workspace, &from, target, &mut moments);
    let is_whole = share >= 1.0;
    if !is_whole {
        back_off(search, &from, &mut moments);
    }
    if let (Some(last), true) = (moments.last(), share > LEAST_SHARE) {
        let end = GraspState {
            world_from_object: last.world_from_object,
            contacts: from.contacts.clone(),
            joints: last.joints.clone(),
        };
        steps.push(Step { motion: Motion::Transfer(moments), end });
    } else {
        match search.workspace.blocking_pair.take() {
            Some(pair) => search.tally.add(Reason::TooNear(pair)),
            None => search.tally.add(Reason::OutOfReach),
        }
    }
    let state = steps.last()?.end.clone();
    let to_goal = search.distance(&state.world_from_object, &search.goal);
    tree.push(Node { state, parent, steps, to_goal, n_tries: 0 });
    Some(tree.len() - 1)
}

/// Shortens a transfer that stopped at a limit or against something to where most fingers that may let go can be lifted.
fn back_off(search: &mut Search, from: &GraspState, moments: &mut Vec<Moment>) {
    let n_fingers = search.model().n_fingers();
    let releasable = releasable(search.model(), &from.contacts);
    let n_releasable = releasable.count_ones();
    let mut best: Option<(usize, u32)> = None;
    for back in BACK_OFFS {
        if back >= moments.len() {
            break;
        }
        let moment = &moments[moments.len() - 1 - back];
        let mut n_liftable = 0;
        for finger in (0..n_fingers).filter(|finger| releasable & (1 << finger) != 0) {
            search.workspace.set(&moment.world_from_object, &moment.joints, &from.contacts);
            let foothold = Foothold { contact: &from.contacts[finger], joints: &moment.joints[finger] };
            let can = can_lift(&mut search.workspace, &moment.world_from_object, finger, &foothold);
            n_liftable += u32::from(can);
        }
        if best.is_none_or(|(_, most)| n_liftable > most) {
            best = Some((back, n_liftable));
        }
        if n_liftable == n_releasable {
            break;
        }
    }
    let back = best.map_or(moments.len(), |(back, _)| back);
    moments.truncate(moments.len() - back);
}

/// Steps back from the end of a stopped transfer that are looked at.
const BACK_OFFS: [usize; 5] = [0, 1, 2, 4, 7];

/// The start state and all steps from the root to `node`, then `last`.
fn trace(mut tree: Vec<Node>, mut node: usize, last: Vec<Step>) -> (GraspState, Vec<Step>) {
    let mut pieces = vec![last];
    while node != 0 {
        pieces.push(std::mem::take(&mut tree[node].steps));
        node = tree[node].parent;
    }
    pieces.reverse();
    (tree.swap_remove(0).state, pieces.into_iter().flatten().collect())
}
