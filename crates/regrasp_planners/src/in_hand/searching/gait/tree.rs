//! A tree of grasps that grows from one end of the query by gaits: relocate fingers with look-ahead, then transfer as far
//! as the hand can follow.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::grasps::candidate::{Candidate, Choice, Way, clear_share, follow_share};
use crate::in_hand::grasps::choose::choose_grasp;
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::combine::{Ranked, most_free, rank};
use crate::in_hand::grasps::free::{draw_leavable, free_posture, free_posture_at};
use crate::in_hand::grasps::freedom::Freedom;
use crate::in_hand::grasps::pool::Pool;
use crate::in_hand::moving::spin;
use crate::in_hand::moving::spin::{Arrival, LOOP_REACH};
use crate::in_hand::moving::transfer::{is_carried_out, transfer};
use crate::in_hand::refusals::is_stuck;
use crate::in_hand::regrasping::regrasp::{ChangeGoal, Tried, regrasp, regrasp_over};
use crate::in_hand::regrasping::unlock::{draw_bound_finger, unlock};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::grasp::state::{GraspState, Moment};
use regrasp_manipulation::model::releasable;
use regrasp_manipulation::relocation::{Foothold, can_lift, lift_is_within_reach};

/// Combinations whose relocations are tried in one extension.
const COMBINATIONS: usize = 16;
/// Share of the way that relocations must gain otherwise.
const LEAST_GAIN: f64 = 0.01;
/// Least share of a transfer that is worth a node.
const LEAST_SHARE: f64 = 0.05;

/// A grasp that can be reached from the tree's end of the query.
pub struct Node {
    /// None for a grasp at the tree's end of the query.
    parent: Option<usize>,
    /// Motions from the parent's state to this one.
    way: Sequence,
    /// Extensions tried from here.
    pub n_tries: u32,
    /// Index of its pose in [`Tree::places`].
    pub place: usize,
}

impl Node {
    /// The grasp.
    pub fn state(&self) -> &GraspState {
        self.way.end()
    }

    /// Index of the node that it grew from; none for a grasp at the tree's end of the query.
    pub fn parent(&self) -> Option<usize> {
        self.parent
    }

    /// True when a finger changes its contact on the way from the parent.
    pub fn changes_grasp(&self) -> bool {
        self.way.steps().iter().any(|step| matches!(step.motion(), Motion::Regrasp { .. }))
    }
}

/// A pose of the object that nodes stand at.
pub struct Place {
    /// Candidates gathered there.
    pub pool: Pool,
    /// Nodes that stand there.
    pub nodes: Vec<usize>,
    /// Extensions tried from its nodes.
    pub n_tries: u32,
}

/// All that was reached from one end of the query.
pub struct Tree {
    /// Nodes.
    pub nodes: Vec<Node>,
    /// Poses; the first is that of the tree's end of the query.
    pub places: Vec<Place>,
    /// The pose at the other end.
    pub aim: Pose,
    /// Grasps tried at its own end.
    n_sown: u32,
    /// True when the planner chooses the grasp at its own end.
    pub root_is_free: bool,
}

impl Tree {
    /// The tree that grows from `home` towards `aim`, with the grasp `given` at home if one is.
    pub fn new(search: &mut Search, home: &Pose, aim: &Pose, given: Option<&GraspState>) -> Self {
        let mut tree =
            Tree { nodes: Vec::new(), places: Vec::new(), aim: *aim, n_sown: 0, root_is_free: given.is_none() };
        tree.add_place(search, home);
        if let Some(state) = given {
            tree.add_root(state.clone());
        }
        tree
    }

    fn add_place(&mut self, search: &Search, world_from_object: &Pose) -> usize {
        let pool = Pool::new(world_from_object, &self.aim, search.model().n_fingers());
        self.places.push(Place { pool, nodes: Vec::new(), n_tries: 0 });
        self.places.len() - 1
    }

    fn add_node(&mut self, node: Node) -> usize {
        self.places[node.place].nodes.push(self.nodes.len());
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn add_root(&mut self, state: GraspState) -> usize {
        self.add_node(Node { parent: None, way: Sequence::at(state), n_tries: 0, place: 0 })
    }

    /// All motions from the tree's end of the query to `node`.
    pub fn trace(&self, mut node: usize) -> Sequence {
        let mut nodes = vec![node];
        while let Some(parent) = self.nodes[node].parent {
            nodes.push(parent);
            node = parent;
        }
        let start = Sequence::at(self.nodes[node].state().clone());
        nodes.iter().rev().fold(start, |way, &node| {
            way.then(self.nodes[node].way.clone()).expect("a node's motions begin in exactly its parent's state")
        })
    }

    /// One step of growth towards `target`: the new node, if there is one.
    pub fn grow(&mut self, search: &mut Search, target: &Pose) -> Option<usize> {
        // Hands that have to arrive by one transfer look for the grasp with which they do.
        let model = search.model();
        let tries_grasps = self.root_is_free && !model.may_release && spin::is_restricted(model, model.all_fingers());
        let picked = if tries_grasps { None } else { pick(search, self, target) };
        match picked {
            Some(node) => {
                self.nodes[node].n_tries += 1;
                let place = self.nodes[node].place;
                self.places[place].n_tries += 1;
                let is_given = self.nodes[node].parent.is_none() && !self.root_is_free;
                // A given grasp is first taken as far as it goes by itself.
                // Where no finger may lift only the object can move, until one may.
                let is_stuck = || is_given && is_stuck(search.model(), self.nodes[node].state());
                if (is_given && self.nodes[node].n_tries == 1) || !search.model().may_release || is_stuck() {
                    let here = Sequence::at(self.nodes[node].state().clone());
                    return advance(search, self, node, target, here);
                }
                if let Some(finger) = draw_bound_finger(search) {
                    let state = self.nodes[node].state().clone();
                    let way = unlock(search, &state, finger, &mut self.places[place].pool)?;
                    return advance(search, self, node, target, way);
                }
                extend(search, self, node, target)
            }
            None => sow(search, self),
        }
    }
}

/// The node to extend; None for a new grasp at the tree's end of the query.
///
/// Poses are weighed, not nodes: a pose collects grasps quickly, and what stands there often fails alike. Often it is the
/// nearest pose to the target, with a fee for each try, else any; of its nodes one of those tried least.
fn pick(search: &mut Search, tree: &Tree, target: &Pose) -> Option<usize> {
    let places = &tree.places;
    let mut chosen = None;
    if search.rng.chance(ANYWHERE_SHARE) {
        chosen = Some(search.rng.below(places.len()));
    } else {
        let fee = search.settings.search.try_fee * search.model().turn_length();
        let mut least = f64::INFINITY;
        if tree.root_is_free {
            least = search.distance(places[0].pool.world_from_object(), target) + fee * f64::from(tree.n_sown);
        }
        for (index, place) in places.iter().enumerate() {
            let distance = search.distance(place.pool.world_from_object(), target) + fee * f64::from(place.n_tries);
            if distance < least && !place.nodes.is_empty() {
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
    let state = tree.nodes[node].state().clone();
    let to_aim = *target == tree.aim;
    let elsewhere = (!to_aim).then(|| Way::new(&state.world_from_object, target));
    let place = tree.nodes[node].place;
    let leavable = draw_leavable(search, &state, tree.places[place].n_tries);
    let mut options = Vec::with_capacity(model.n_fingers());
    for finger in 0..model.n_fingers() {
        let pool = &mut tree.places[place].pool;
        let mut of_finger = options_of(search, pool, elsewhere.as_ref(), &state, finger);
        if leavable & (1 << finger) != 0 {
            let way = elsewhere.as_ref().unwrap_or(tree.places[place].pool.way());
            of_finger.extend(free_posture(search, finger, &state, way));
        }
        options.push(of_finger);
    }
    let mut table = ClosureTable::new(model, &options);
    let freedom = Freedom::towards(model, &options, &state.world_from_object, target);
    let here: Choice = options.iter().map(|_| 0).collect();
    let present = options.iter().map(|of_finger| of_finger[0].follow).fold(1.0, f64::min)
        * freedom.as_ref().map_or(1.0, |freedom| freedom.share(&here));
    let least = if search.rng.chance(search.settings.search.aimless_share) { 0.0 } else { present + LEAST_GAIN };
    let ranked = rank(search, &options, &mut table, freedom.as_ref(), Some(least), COMBINATIONS);
    search.tally.note_releases(table.releases(), &state.world_from_object);
    if ranked.is_empty() {
        search.tally.add(Reason::NotClosed);
        return None;
    }
    let mut tried = Tried::default();
    let mut rng = Rng::child(&search.rng, "relocation", 0);
    search.rng.bits();
    for combination in &ranked {
        let way =
            regrasp(&mut search.workspace, &state, &options, &combination.choice, &mut table, &mut tried, &mut rng);
        match way {
            Some(way) => return advance(search, tree, node, target, way),
            None if tried.lacks_forces => {}
            None => note_stuck(search, &mut table, &combination.choice, &tried),
        }
    }
    drop(table);
    if search.n_nodes < DETOUR_NODES || tried.lacks_forces {
        return None;
    }
    let way = detour(search, &state, options, &ranked, &mut tree.places[place].pool)?;
    advance(search, tree, node, target, way)
}

/// Relocations from `state` over third contacts to one of the grasps `ranked` among `options`, none of which is reached by moving each finger
/// at most once.
fn detour(
    search: &mut Search,
    state: &GraspState,
    mut options: Vec<Vec<Candidate>>,
    ranked: &[Ranked],
    pool: &mut Pool,
) -> Option<Sequence> {
    for (finger, of_finger) in options.iter_mut().enumerate() {
        of_finger.extend(pool.any(search, finger, DETOUR_CONTACTS));
    }
    let mut table = ClosureTable::new(search.model(), &options);
    let away = |choice: &Choice, goal: &Choice| choice.iter().zip(goal).filter(|(a, b)| a != b).count();
    let goal = ChangeGoal {
        is_there: |choice: &Choice| ranked.iter().any(|ranked| ranked.choice == *choice),
        n_away: |choice: &Choice| ranked.iter().map(|r| away(choice, &r.choice)).min().unwrap_or(0) as f64,
    };
    let mut rng = Rng::child(&search.rng, "detour", 0);
    search.rng.bits();
    regrasp_over(&mut search.workspace, state, &options, &goal, &mut table, DETOUR_RELOCATIONS, &mut rng)
}

/// Nodes from which on extensions make detours: easy queries are solved by then. By hand. What detours bring is in docs/benchmarks/hands.md.
const DETOUR_NODES: u64 = 30;
/// Third contacts per finger. By hand.
const DETOUR_CONTACTS: usize = 4;
/// Relocations tried for one. By hand.
const DETOUR_RELOCATIONS: usize = 12;

/// Takes note of a combination that could not be reached: for want of release if no finger that has to move may be the
/// first, else for want of a path of a finger, or of an order.
fn note_stuck(search: &mut Search, table: &mut ClosureTable, goal: &Choice, tried: &Tried) {
    let present: Choice = goal.iter().map(|_| 0).collect();
    let holding = table.holding(&present);
    let moving = || (0..goal.len()).filter(|&finger| goal[finger] != 0);
    if moving().any(|finger| table.is_closed(&present, holding & !(1 << finger))) {
        search.tally.add(if tried.failed_towards(goal) { Reason::NoWayOver } else { Reason::NoOrder });
        return;
    }
    moving().for_each(|finger| search.tally.add(Reason::Bound(finger)));
}

/// The present contact or free posture of a finger, and the best contacts of the pool for its way.
fn options_of(
    search: &mut Search,
    pool: &mut Pool,
    elsewhere: Option<&Way>,
    state: &GraspState,
    finger: usize,
) -> Vec<Candidate> {
    let workspace = &mut search.workspace;
    let (contact, joints) = (state.contact(finger), state.joints[finger].clone());
    let (pose, way) = (&state.world_from_object, elsewhere.unwrap_or(pool.way()));
    let follow = match &contact {
        Some(contact) => follow_share(workspace, finger, contact, &joints, way),
        None => clear_share(workspace, finger, &joints, pose, way).unwrap_or(0.0),
    };
    let foothold = Foothold { contact: contact.as_ref(), joints: &joints };
    let is_stuck = !lift_is_within_reach(workspace.model, &Placement::from(pose), finger, &foothold);
    let mut options = vec![Candidate { contact, joints, follow }];
    if is_stuck {
        return options;
    }
    let n_kept = search.settings.search.candidates_kept;
    options.extend(match elsewhere {
        None => pool.towards_aim(search, finger, n_kept),
        Some(way) => pool.along(search, finger, way, n_kept),
    });
    if options.len() == 1 {
        search.tally.add(Reason::NoContact(finger));
    }
    options
}

/// Transfers from the end of `way`, which begins at `parent`, towards `target` and adds a node where that ends.
fn advance(search: &mut Search, tree: &mut Tree, parent: usize, target: &Pose, mut way: Sequence) -> Option<usize> {
    let from = way.end().clone();
    let mut place = tree.nodes[parent].place;
    let mut moments = Vec::new();
    let n_refused = search.workspace.refusals.n_seen();
    let share = transfer(&mut search.workspace, &from, target, &mut moments);
    // What no forces balance is counted by itself.
    let lacks_forces = search.workspace.refusals.n_seen() > n_refused;
    let model = search.model();
    let may_close_in = model.may_release && *target == tree.aim && spin::is_restricted(model, from.holding);
    if share < 1.0
        && may_close_in
        && let Some(arrival) = close_in(search, &from, &moments, target)
    {
        moments.extend(arrival);
        place = tree.add_place(search, target);
        way.push_transfer(moments);
        return Some(tree.add_node(Node { parent: Some(parent), way, n_tries: 0, place }));
    }
    if share < 1.0 {
        back_off(search, &from, &mut moments);
    }
    if let (Some(last), true) = (moments.last(), share > LEAST_SHARE) {
        place = tree.add_place(search, &last.world_from_object);
        way.push_transfer(moments);
    } else if !lacks_forces {
        match search.workspace.blocking_pair.take() {
            Some(pair) => search.tally.add(Reason::TooNear(pair)),
            None => search.tally.add(Reason::OutOfReach),
        }
    }
    let has_moved = !way.steps().is_empty();
    has_moved.then(|| tree.add_node(Node { parent: Some(parent), way, n_tries: 0, place }))
}

/// The rest of a transfer from `from` that came near `goal` with `moments` and stopped because soft fingertips would have to
/// turn about their normals: a loop that ends exactly there.
fn close_in(search: &mut Search, from: &GraspState, moments: &[Moment], goal: &Pose) -> Option<Vec<Moment>> {
    let model = search.model();
    let end = moments.last().map_or_else(|| from.clone(), |last| from.at(last));
    let turn = spin::turn_needed(model, &end, goal)?;
    search.tally.note_turn(turn);
    if spin::twist_between(model, &end.world_from_object, goal).norm() > LOOP_REACH {
        return None;
    }
    let mut rng = Rng::child(&search.rng, "loop", 0);
    search.rng.bits();
    let Arrival { moments, .. } = spin::arrive_by_loop(model, &end, goal, &mut rng, &mut search.workspace.work)?;
    is_carried_out(&mut search.workspace, &end, &moments).then_some(moments)
}

/// Shortens a transfer that stopped at a limit or against something to where most fingers that may let go can be lifted.
fn back_off(search: &mut Search, from: &GraspState, moments: &mut Vec<Moment>) {
    let n_fingers = search.model().n_fingers();
    let mut best: Option<(usize, u32)> = None;
    for back in BACK_OFFS {
        if back >= moments.len() {
            break;
        }
        let moment = &moments[moments.len() - 1 - back];
        let releasable = releasable(search.model(), &moment.contacts, from.holding);
        let mut n_liftable = 0;
        for finger in (0..n_fingers).filter(|finger| releasable & (1 << finger) != 0) {
            search.workspace.set_held(&moment.world_from_object, &moment.joints, &moment.contacts, from.holding);
            let contact = &moment.contacts[finger];
            let foothold = Foothold { contact: Some(contact), joints: &moment.joints[finger] };
            let can = can_lift(&mut search.workspace, &moment.world_from_object, finger, &foothold);
            n_liftable += u32::from(can);
        }
        if best.is_none_or(|(_, most)| n_liftable > most) {
            best = Some((back, n_liftable));
        }
        if n_liftable == releasable.count_ones() {
            break;
        }
    }
    let back = best.map_or(moments.len(), |(back, _)| back);
    moments.truncate(moments.len() - back);
}

/// Steps back from the end of a stopped transfer that are looked at.
const BACK_OFFS: [usize; 5] = [0, 1, 2, 4, 7];

/// Grasps of all fingers that are looked for before one with fewer will do.
const SOWN_IN_VAIN: u32 = 10;

/// `way`, which ends at the tree's own pose, with the fingers that are free there put on contacts as far as they reach any.
/// None where they do, but find no way to a closed grasp.
pub fn land(search: &mut Search, tree: &mut Tree, way: Sequence) -> Option<Sequence> {
    let model = search.model();
    let state = way.end().clone();
    if state.is_held_by_all() {
        return Some(way);
    }
    let mut options = Vec::with_capacity(model.n_fingers());
    for finger in 0..model.n_fingers() {
        let mut of_finger = vec![Candidate::present(&state, finger)];
        if !state.holds(finger) {
            of_finger.extend(tree.places[0].pool.towards_aim(search, finger, search.settings.search.candidates_kept));
        }
        options.push(of_finger);
    }
    if options.iter().all(|of_finger| of_finger.len() == 1) {
        return Some(way);
    }
    let mut table = ClosureTable::new(model, &options);
    let ranked = rank(search, &options, &mut table, None, Some(0.0), LANDINGS);
    let lands = |choice: &Choice| (0..options.len()).all(|f| options[f].len() == 1 || choice[f] != 0);
    let mut tried = Tried::default();
    let mut rng = Rng::child(&search.rng, "landing", 0);
    search.rng.bits();
    ranked.iter().filter(|combination| lands(&combination.choice)).find_map(|combination| {
        let goal = &combination.choice;
        let down = regrasp(&mut search.workspace, &state, &options, goal, &mut table, &mut tried, &mut rng)?;
        way.clone().then(down)
    })
}

/// Grasps that fingers which are free at an end may land in.
const LANDINGS: usize = 64;

/// Adds a grasp near `state` and the transfer that takes it to the tree's aim, for hands that never change their grasp.
fn arrive(search: &mut Search, tree: &mut Tree, state: &GraspState) -> Option<usize> {
    let aim = tree.aim;
    let Some(Arrival { start, moments }) = spin::arrive(search.model(), state, &aim, &mut search.workspace.work) else {
        let root = tree.add_root(state.clone());
        return advance(search, tree, root, &aim, Sequence::at(state.clone())).or(Some(root));
    };
    let is_clear = is_carried_out(&mut search.workspace, &start, &moments);
    let mut way = Sequence::at(start.clone());
    let root = tree.add_root(start);
    if !is_clear {
        return Some(root);
    }
    way.push_transfer(moments);
    let place = tree.add_place(search, &aim);
    Some(tree.add_node(Node { parent: Some(root), way, n_tries: 0, place }))
}

/// Chooses a new grasp at the tree's end of the query, where no finger has to move for it, and takes it towards the aim.
fn sow(search: &mut Search, tree: &mut Tree) -> Option<usize> {
    let model = search.model();
    let pose = *tree.places[0].pool.world_from_object();
    tree.n_sown += 1;
    search.workspace.place_object(&pose);
    let mut options = Vec::with_capacity(model.n_fingers());
    for finger in 0..model.n_fingers() {
        let mut candidates =
            tree.places[0].pool.towards_aim(search, finger, search.settings.search.candidates_kept + 1);
        if model.fingers[finger].closes() && !search.holds_only {
            // It may hold here, but to move the object it has to be free.
            candidates.extend(free_posture_at(search, finger, &pose, tree.places[0].pool.way()));
        }
        if candidates.is_empty() {
            search.tally.add(Reason::NoContact(finger));
            // A finger that reaches nothing is left free, once grasps of all fingers were looked for in vain.
            if tree.n_sown <= SOWN_IN_VAIN || !tree.nodes.is_empty() || most_free(model, &search.settings.search) == 0 {
                return None;
            }
            candidates.extend(free_posture_at(search, finger, &pose, tree.places[0].pool.way()));
            if candidates.is_empty() {
                return None;
            }
        }
        options.push(candidates);
    }
    let freedom = Freedom::towards(model, &options, &pose, &tree.aim);
    match choose_grasp(search, &pose, &options, freedom.as_ref()) {
        Some(state) if !model.may_release && spin::is_restricted(model, state.holding) => arrive(search, tree, &state),
        Some(state) => {
            let here = Sequence::at(state.clone());
            let node = tree.add_root(state);
            let aim = tree.aim;
            advance(search, tree, node, &aim, here).or(Some(node))
        }
        None => {
            search.tally.add(search.no_grasp());
            None
        }
    }
}
