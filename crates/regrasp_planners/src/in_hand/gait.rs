//! The gait tree: from a node, relocate fingers with look-ahead, then transfer as far as the hand can follow.
//!
//! In place of sampling GS_n and linking (paper 000, section 4.2) the tree only ever holds what is feasible. In-hand-notes
//! section 3, method E, and real-hands-notes section 2, rule F2, found this to be the quickest way that also works on
//! real hands.

use super::candidates::{Candidate, Way, draw_candidates, draw_pose, follow_share};
use super::combine::{ClosureTable, rank, releasable};
use super::grasps::choose_grasp;
use super::pool::Pool;
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
/// Share of the way that relocations must gain otherwise.
const LEAST_GAIN: f64 = 0.01;
/// Least share of a transfer that is worth a node.
const LEAST_SHARE: f64 = 0.05;

struct Node {
    state: GraspState,
    /// None for a start grasp.
    parent: Option<usize>,
    /// Motions from the parent's state to this one.
    steps: Vec<Step>,
    /// Distance to the goal pose.
    to_goal: f64,
    /// Extensions tried from here.
    n_tries: u32,
    /// Index of its pose in [`Tree::places`].
    place: usize,
}

/// A pose of the object that nodes stand at.
struct Place {
    pool: Pool,
    nodes: Vec<usize>,
    /// Extensions tried from its nodes.
    n_tries: u32,
    /// True for the goal pose, where there is nothing left to do.
    is_goal: bool,
}

/// The tree, or rather trees: one per start grasp.
struct Tree {
    nodes: Vec<Node>,
    /// Poses; the first is that of the start.
    places: Vec<Place>,
    /// Start grasps tried.
    n_sown: u32,
    /// True when the planner chooses the start grasp.
    start_is_free: bool,
}

impl Tree {
    fn add_place(&mut self, search: &Search, world_from_object: &Pose) -> usize {
        let pool = Pool::new(world_from_object, &search.goal, search.model().n_fingers());
        let is_goal = search.distance(world_from_object, &search.goal) < REACHED;
        self.places.push(Place { pool, nodes: Vec::new(), n_tries: 0, is_goal });
        self.places.len() - 1
    }

    fn add_node(&mut self, node: Node) -> usize {
        self.places[node.place].nodes.push(self.nodes.len());
        self.nodes.push(node);
        self.nodes.len() - 1
    }
}

/// Looks for a sequence of motions from `start` (or from a grasp of its own choice) to the goal pose, and there to the
/// grasp `goal_grasp` if one is asked for.
pub fn grow(
    search: &mut Search,
    start: Option<GraspState>,
    goal_grasp: Option<&GraspState>,
) -> Result<(GraspState, Vec<Step>), Stop> {
    let goal = search.goal;
    let mut tree = Tree { nodes: Vec::new(), places: Vec::new(), n_sown: 0, start_is_free: start.is_none() };
    let start_pose = search.start;
    tree.add_place(search, &start_pose);
    let mut fresh = start.and_then(|state| root(search, &mut tree, state));
    loop {
        if let Some(node) = fresh {
            let state = tree.nodes[node].state.clone();
            search.note(&state);
            if tree.nodes[node].to_goal < REACHED
                && let Some(last) = finish(search, &state, goal_grasp)
            {
                return Ok(trace(tree, node, last));
            }
        }
        search.check()?;
        search.n_nodes = tree.nodes.len() as u64;
        let target = if search.rng.chance(search.model().settings.goal_share) {
            goal
        } else {
            draw_pose(search.model(), &search.start, &search.goal, &mut search.rng)
        };
        fresh = match pick(search, &tree, &target) {
            Some(node) => {
                tree.nodes[node].n_tries += 1;
                let place = tree.nodes[node].place;
                tree.places[place].n_tries += 1;
                extend(search, &mut tree, node, &target)
            }
            None => sow(search, &mut tree),
        };
    }
}

/// Adds a start grasp and goes with it towards the goal as far as it will.
fn root(search: &mut Search, tree: &mut Tree, state: GraspState) -> Option<usize> {
    search.note(&state);
    let to_goal = search.distance(&state.world_from_object, &search.goal);
    let node = tree.add_node(Node { state, parent: None, steps: Vec::new(), to_goal, n_tries: 0, place: 0 });
    let goal = search.goal;
    advance(search, tree, node, &goal, Vec::new()).or(Some(node))
}

/// Chooses a new start grasp: no finger has to move for it.
fn sow(search: &mut Search, tree: &mut Tree) -> Option<usize> {
    let model = search.model();
    let pose = search.start;
    tree.n_sown += 1;
    search.workspace.place_object(&pose);
    let mut options = Vec::with_capacity(model.n_fingers());
    for finger in 0..model.n_fingers() {
        if !tree.places[0].pool.grow(search, finger) {
            search.tally.add(Reason::NoContact(finger));
            return None;
        }
        options.push(tree.places[0].pool.choose(finger, model.settings.candidates_kept + 1, &mut search.rng));
    }
    match choose_grasp(search, &pose, &options) {
        Some(state) => root(search, tree, state),
        None => {
            search.tally.add(Reason::NotClosed);
            None
        }
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

/// The node to extend; None for a new start grasp.
///
/// Poses are weighed, not nodes: a pose collects grasps quickly, and what stands there often fails alike. Often it is the
/// nearest pose to the target, with a fee for each try, else any; of its nodes one of those tried least.
fn pick(search: &mut Search, tree: &Tree, target: &Pose) -> Option<usize> {
    let places = &tree.places;
    let mut chosen = None;
    if search.rng.chance(ANYWHERE_SHARE) {
        chosen = Some(search.rng.below(places.len()));
    } else {
        let fee = search.model().settings.try_fee * search.model().turn_length();
        let mut least = f64::INFINITY;
        if tree.start_is_free {
            least = search.distance(&search.start, target) + fee * f64::from(tree.n_sown);
        }
        for (index, place) in places.iter().enumerate() {
            let distance = search.distance(place.pool.world_from_object(), target) + fee * f64::from(place.n_tries);
            if distance < least && !place.nodes.is_empty() && !place.is_goal {
                (least, chosen) = (distance, Some(index));
            }
        }
    }
    let nodes = &places[chosen?].nodes;
    let draw = |search: &mut Search| (!nodes.is_empty()).then(|| nodes[search.rng.below(nodes.len())]);
    let (one, other) = (draw(search)?, draw(search)?);
    Some(if tree.nodes[other].n_tries < tree.nodes[one].n_tries { other } else { one })
}

/// Share of extensions from a pose taken at random.
const ANYWHERE_SHARE: f64 = 0.25;

/// One extension: candidates for every finger, the best combinations, their relocations, the transfer.
fn extend(search: &mut Search, tree: &mut Tree, node: usize, target: &Pose) -> Option<usize> {
    let model = search.model();
    let state = tree.nodes[node].state.clone();
    let to_goal = *target == search.goal;
    let elsewhere = (!to_goal).then(|| Way::new(&state.world_from_object, target));
    let place = tree.nodes[node].place;
    let mut options = Vec::with_capacity(model.n_fingers());
    for finger in 0..model.n_fingers() {
        options.push(options_of(search, &mut tree.places[place].pool, elsewhere.as_ref(), &state, finger));
    }
    let mut table = ClosureTable::new(model, &options);
    let present = options.iter().map(|of_finger| of_finger[0].follow).fold(1.0, f64::min);
    let least = if search.rng.chance(model.settings.aimless_share) { 0.0 } else { present + LEAST_GAIN };
    let ranked = rank(&mut search.workspace, &options, &mut table, Some(least), COMBINATIONS);
    if ranked.is_empty() {
        search.tally.add(Reason::NotClosed);
        return None;
    }
    let mut tried = Tried::default();
    let mut rng = Rng::child(&search.rng, "relocation", 0);
    search.rng.bits();
    for combination in &ranked {
        let steps =
            regrasp(&mut search.workspace, &state, &options, &combination.choice, &mut table, &mut tried, &mut rng);
        match steps {
            Some(steps) => return advance(search, tree, node, target, steps),
            None => search.tally.add(Reason::NoWayOver),
        }
    }
    None
}

/// The present contact of a finger and the best new ones: from the pool on the way to the goal, drawn anew elsewhere.
fn options_of(
    search: &mut Search,
    pool: &mut Pool,
    elsewhere: Option<&Way>,
    state: &GraspState,
    finger: usize,
) -> Vec<Candidate> {
    let settings = &search.model().settings;
    let workspace = &mut search.workspace;
    let (contact, joints) = (state.contacts[finger], state.joints[finger].clone());
    let follow = follow_share(workspace, finger, &contact, &joints, elsewhere.unwrap_or(pool.way()));
    let pose = &state.world_from_object;
    let foothold = Foothold { contact: &contact, joints: &joints };
    let is_stuck = !lift_is_within_reach(workspace.model, &Placement::from(pose), finger, &foothold);
    let mut options = vec![Candidate { contact, joints, follow }];
    if is_stuck {
        return options;
    }
    workspace.place_object(pose);
    let n_kept = settings.candidates_kept;
    match elsewhere {
        None => {
            pool.grow(search, finger);
            options.extend(pool.choose(finger, n_kept, &mut search.rng));
        }
        Some(way) => {
            let new = draw_candidates(workspace, finger, pose, way, settings.candidates, n_kept, &mut search.rng);
            search.n_samples += new.len() as u64;
            options.extend(new);
        }
    }
    if options.len() == 1 {
        search.tally.add(Reason::NoContact(finger));
    }
    options
}

/// Transfers from the end of `steps` towards `target` and adds a node where that ends.
fn advance(search: &mut Search, tree: &mut Tree, parent: usize, target: &Pose, mut steps: Vec<Step>) -> Option<usize> {
    let from = steps.last().map_or(&tree.nodes[parent].state, |step| &step.end).clone();
    let mut place = tree.nodes[parent].place;
    let mut moments = Vec::new();
    let share = transfer(&mut search.workspace, &from, target, &mut moments);
    if share < 1.0 {
        back_off(search, &from, &mut moments);
    }
    if let (Some(last), true) = (moments.last(), share > LEAST_SHARE) {
        let end = GraspState {
            world_from_object: last.world_from_object,
            contacts: from.contacts.clone(),
            joints: last.joints.clone(),
        };
        place = tree.add_place(search, &last.world_from_object);
        steps.push(Step { motion: Motion::Transfer(moments), end });
    } else {
        match search.workspace.blocking_pair.take() {
            Some(pair) => search.tally.add(Reason::TooNear(pair)),
            None => search.tally.add(Reason::OutOfReach),
        }
    }
    let state = steps.last()?.end.clone();
    let to_goal = search.distance(&state.world_from_object, &search.goal);
    Some(tree.add_node(Node { state, parent: Some(parent), steps, to_goal, n_tries: 0, place }))
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

/// The start state and all steps from there to `node`, then `last`.
fn trace(mut tree: Tree, mut node: usize, last: Vec<Step>) -> (GraspState, Vec<Step>) {
    let mut pieces = vec![last];
    while let Some(parent) = tree.nodes[node].parent {
        pieces.push(std::mem::take(&mut tree.nodes[node].steps));
        node = parent;
    }
    pieces.reverse();
    (tree.nodes.swap_remove(node).state, pieces.into_iter().flatten().collect())
}
