//! The cheapest gait along a course: A* over which track each finger is on at which station.
//!
//! What a finger costs by itself, with all other fingers out of its way, is known exactly; the sum over the fingers is the
//! heuristic. It is consistent: grasps together only forbid what fingers by themselves may do. Motions are proven only
//! along the cheapest path; what is refuted is forbidden and the search repeated (lazy evaluation: Bohlin and Kavraki,
//! ICRA 2000). A track has the same joints whoever passes, so that what is proven once is proven for all paths.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::grasps::candidate::Choice;
use crate::in_hand::grasps::combine::most_free;
use crate::in_hand::improving::closure::{StationClosure, StationContacts};
use crate::in_hand::improving::cost::joint_path;
use crate::in_hand::improving::course::Course;
use crate::in_hand::improving::track::Track;
use crate::in_hand::searching::legs::Solution;
use crate::settings::{CostWeights, ReleaseRule};
use regrasp_base::Rng;
use regrasp_geometry::frame;
use regrasp_manipulation::forces::held::balances;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::{Contacts, GraspState, Moment};
use regrasp_manipulation::model::{Carrier, Model};
use regrasp_manipulation::relocation::{Foothold, relocate};
use regrasp_manipulation::workspace::TipMode;
use regrasp_roadmap::{AStar, CheapestPath, Limits};
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// Units of work that expanding a node is counted as: about the time of so many configurations.
const WORK_PER_EXPANSION: u64 = 10;

/// Cost that relocations between two tracks have more for each time that one was refuted, as a share of the whole: what was in
/// the way at one station mostly is at the next too. By hand.
const REFUTED_FEE: f64 = 0.3;

/// The fingers on their tracks at a station; fewer of them than the hand has while the grasp at the start is put together.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Node {
    station: usize,
    choice: Choice,
}

/// Something that cannot be done, at a station or from it to the next.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum NoGood {
    /// A finger on a track, to the next station.
    Track(usize, usize, usize),
    /// Two fingers on tracks, to the next station.
    Pair(usize, [usize; 2], [usize; 2]),
    /// A whole grasp, to the next station.
    Grasp(usize, Choice),
    /// A grasp at a station.
    Start(Choice),
    /// The relocation of a finger from one track to another.
    Relocation(usize, usize, usize, usize),
}

/// What a finger pays by itself, by station and track.
pub struct Alone {
    /// The track that it begins on, if that is given.
    start: Option<usize>,
    /// From a station to the next; infinite where the track does not go there.
    advance: Vec<Vec<f64>>,
    /// From a station to the last one, at least.
    rest: Vec<Vec<f64>>,
}

/// The tracks along a course and what is known of gaits on them.
pub struct Gaits<'g, 'a> {
    course: &'g Course,
    tracks: &'g [Vec<Track>],
    goal: Option<&'g Choice>,
    alone: &'g [Alone],
    /// What the object pays from each station to the last.
    object_rest: Vec<f64>,
    relocation_cost: f64,
    joint_weight: f64,
    rule: ReleaseRule,
    closure: StationClosure<'g>,
    clashes: BTreeMap<(usize, [usize; 2], [usize; 2]), bool>,
    no_goods: BTreeSet<NoGood>,
    /// How often relocations of a finger from one track to another were refuted, at any station.
    refuted: BTreeMap<(usize, usize, usize), u32>,
    /// Cost that a refuted relocation has more, at all stations.
    refuted_fee: f64,
    proven_transfers: BTreeSet<Node>,
    proven_relocations: BTreeMap<(Node, usize, usize), Vec<Coordinates>>,
    nodes: Vec<Node>,
    ids: BTreeMap<Node, usize>,
    search: &'g mut Search<'a>,
    /// Why the search is to stop, once it is.
    stopped: Option<Stop>,
}

impl<'g, 'a> Gaits<'g, 'a> {
    /// Gaits on `tracks[finger]` along `course`, that end on the tracks `goal` if those are given.
    ///
    /// `contacts` holds the contacts of the tracks, `alone` what each finger pays; closed is what has the margin `margin`.
    pub fn new(
        search: &'g mut Search<'a>,
        course: &'g Course,
        tracks: &'g [Vec<Track>],
        contacts: &'g StationContacts,
        alone: &'g [Alone],
        goal: Option<&'g Choice>,
        margin: f64,
    ) -> Self {
        let model = search.model();
        let root = Node { station: 0, choice: Choice::new() };
        Gaits {
            course,
            tracks,
            goal,
            alone,
            object_rest: object_rest(model, &search.settings.improvement.cost, course),
            relocation_cost: search.settings.improvement.cost.relocation,
            joint_weight: search.settings.improvement.cost.joint_path,
            rule: search.settings.search.release_rule,
            closure: StationClosure::new(model, contacts, margin),
            clashes: BTreeMap::new(),
            no_goods: BTreeSet::new(),
            refuted: BTreeMap::new(),
            refuted_fee: if model.any_rolls() { REFUTED_FEE } else { 0.0 },
            proven_transfers: BTreeSet::new(),
            proven_relocations: BTreeMap::new(),
            nodes: vec![root.clone()],
            ids: BTreeMap::from([(root, 0)]),
            search,
            stopped: None,
        }
    }

    /// The scene, prepared.
    #[cfg(test)]
    pub fn model(&self) -> &'a Model<'a> {
        self.search.model()
    }

    /// Grasps seen so far.
    #[cfg(test)]
    pub fn n_nodes(&self) -> usize {
        self.nodes.len()
    }

    fn n_fingers(&self) -> usize {
        self.tracks.len()
    }

    fn id_of(&mut self, node: Node) -> usize {
        if let Some(&id) = self.ids.get(&node) {
            return id;
        }
        self.ids.insert(node.clone(), self.nodes.len());
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// What no gait from `node` costs less than.
    pub fn bound(&self, node: usize) -> f64 {
        let node = &self.nodes[node];
        let of_finger = |finger: usize| match node.choice.get(finger) {
            Some(&track) => self.alone[finger].rest[node.station][track],
            None => self.alone[finger].least(),
        };
        self.object_rest[node.station] + (0..self.n_fingers()).map(of_finger).sum::<f64>()
    }

    /// Appends the grasps that `node` leads to, with what it costs to go there.
    pub fn neighbours(&mut self, node: usize, out: &mut Vec<(usize, f64)>) {
        self.search.workspace.work += WORK_PER_EXPANSION;
        self.stopped = self.stopped.or_else(|| self.search.check().err());
        if self.stopped.is_some() {
            return;
        }
        let node = self.nodes[node].clone();
        if node.choice.len() < self.n_fingers() {
            self.put_together(&node, out);
        } else {
            self.advance(&node, out);
            self.relocate(&node, out);
        }
    }

    /// One more finger on a track at the start.
    fn put_together(&mut self, node: &Node, out: &mut Vec<(usize, f64)>) {
        let finger = node.choice.len();
        for track in 0..self.tracks[finger].len() {
            // Where the grasp is chosen all fingers begin on the object.
            let may_begin = match self.alone[finger].start {
                Some(start) => start == track,
                None => !self.tracks[finger][track].is_free(),
            };
            if !may_begin || !self.tracks[finger][track].spans(0) || !self.alone[finger].rest[0][track].is_finite() {
                continue;
            }
            let mut next = node.clone();
            next.choice.push(track);
            if !self.is_clear_of_others(&next, finger)
                || (next.choice.len() == self.n_fingers()
                    && (!self.is_allowed(&next) || self.no_goods.contains(&NoGood::Start(next.choice.clone()))))
            {
                continue;
            }
            out.push((self.id_of(next), 0.0));
        }
    }

    /// To the next station.
    fn advance(&mut self, node: &Node, out: &mut Vec<(usize, f64)>) {
        let station = node.station;
        if station == self.course.last() || self.cannot_advance(node) {
            return;
        }
        let next = Node { station: station + 1, choice: node.choice.clone() };
        // Contacts that roll may not hold any more.
        if self.closure.changes() && !self.is_held_at_next(&next) {
            return;
        }
        let alone: f64 = (0..self.n_fingers()).map(|f| self.alone[f].advance[station][node.choice[f]]).sum();
        if alone.is_finite() {
            let cost = alone + self.object_rest[station] - self.object_rest[station + 1];
            let next = self.id_of(next);
            out.push((next, cost));
        }
    }

    fn cannot_advance(&self, node: &Node) -> bool {
        let (station, choice) = (node.station, &node.choice);
        if self.no_goods.is_empty() {
            return false;
        }
        let n = self.n_fingers();
        let pair = |f: usize, g: usize| NoGood::Pair(station, [f, g], [choice[f], choice[g]]);
        self.no_goods.contains(&NoGood::Grasp(station, choice.clone()))
            || (0..n).any(|f| self.no_goods.contains(&NoGood::Track(station, f, choice[f])))
            || (0..n).any(|f| (f + 1..n).any(|g| self.no_goods.contains(&pair(f, g))))
    }

    /// One finger onto another track.
    fn relocate(&mut self, node: &Node, out: &mut Vec<(usize, f64)>) {
        let (station, all) = (node.station, (1u32 << self.n_fingers()) - 1);
        let moment = self.course.stations[station];
        for finger in 0..self.n_fingers() {
            let from = node.choice[finger];
            if !self.closure.is_closed(station, &node.choice, all & !(1 << finger)) {
                continue;
            }
            for track in 0..self.tracks[finger].len() {
                if track == from
                    || !self.tracks[finger][track].spans(moment)
                    || !self.alone[finger].rest[station][track].is_finite()
                    || self.no_goods.contains(&NoGood::Relocation(station, finger, from, track))
                {
                    continue;
                }
                let mut next = node.clone();
                next.choice[finger] = track;
                if !self.is_allowed(&next) || !self.is_clear_of_others(&next, finger) {
                    continue;
                }
                let of_finger = &self.tracks[finger];
                let path = joint_path(of_finger[from].at(moment), of_finger[track].at(moment));
                // Lifting off to stay free is counted where the finger lands again.
                let landing = if of_finger[track].is_free() { 0.0 } else { self.relocation_cost };
                let refuted = self.refuted.get(&(finger, from, track)).copied().unwrap_or(0);
                let cost = landing + self.joint_weight * path + self.refuted_fee * f64::from(refuted);
                out.push((self.id_of(next), cost));
            }
        }
    }

    /// Number of fingers that are free.
    fn n_free(&self, choice: &Choice) -> usize {
        choice.iter().enumerate().filter(|&(finger, &track)| self.tracks[finger][track].is_free()).count()
    }

    /// True when the release rule lets this grasp be, with no more free fingers than the settings allow.
    fn is_allowed(&mut self, node: &Node) -> bool {
        let all = (1u32 << self.n_fingers()) - 1;
        let most_free = most_free(self.search.model(), &self.search.settings.search);
        self.n_free(&node.choice) <= most_free
            && self.closure.is_closed(node.station, &node.choice, all)
            && (self.rule == ReleaseRule::WhereOthersHold
                || self.closure.n_releasable(node.station, &node.choice) == self.n_fingers())
    }

    /// True when all tracks go as far as the node's station and hold the object there.
    fn is_held_at_next(&mut self, node: &Node) -> bool {
        let (moment, all) = (self.course.stations[node.station], (1u32 << self.n_fingers()) - 1);
        let spans = |(finger, &track): (usize, &usize)| self.tracks[finger][track].spans(moment);
        node.choice.iter().enumerate().all(spans) && self.closure.is_closed(node.station, &node.choice, all)
    }

    /// True when `finger` is clear of the other fingers at the node's station.
    fn is_clear_of_others(&mut self, node: &Node, finger: usize) -> bool {
        let moment = self.course.stations[node.station];
        (0..node.choice.len()).filter(|&other| other != finger).all(|other| {
            let fingers = [finger.min(other), finger.max(other)];
            let tracks = fingers.map(|f| node.choice[f]);
            let joints = [0, 1].map(|k| self.tracks[fingers[k]][tracks[k]].at(moment));
            let workspace = &mut self.search.workspace;
            *self
                .clashes
                .entry((node.station, fingers, tracks))
                .or_insert_with(|| workspace.fingers_are_clear((fingers[0], joints[0]), (fingers[1], joints[1])))
        })
    }

    fn is_goal(&mut self, node: usize) -> bool {
        let Node { station, choice } = self.nodes[node].clone();
        station == self.course.last()
            && choice.len() == self.n_fingers()
            && match self.goal {
                Some(goal) => *goal == choice,
                // Fingers end on the object, and one may lift, so that another plan can go on from there.
                None => {
                    self.n_free(&choice) == 0
                        && (!self.search.model().may_release || self.closure.n_releasable(station, &choice) > 0)
                }
            }
    }

    fn state(&self, node: &Node) -> GraspState {
        let moment = self.course.stations[node.station];
        let on_track = |(finger, &track): (usize, &usize)| &self.tracks[finger][track];
        let of_track = |track: &Track| (track.foothold(moment).copied(), track.at(moment).clone());
        GraspState::of(self.course.poses[moment], node.choice.iter().enumerate().map(|which| of_track(on_track(which))))
    }

    /// The moments of a transfer from a node's station to the next.
    fn moments(&self, node: &Node) -> Vec<Moment> {
        let range = self.course.stations[node.station] + 1..=self.course.stations[node.station + 1];
        let on_track = |(finger, &track): (usize, &usize)| &self.tracks[finger][track];
        range
            .map(|moment| Moment {
                world_from_object: self.course.poses[moment],
                joints: node.choice.iter().enumerate().map(|which| on_track(which).at(moment).clone()).collect(),
                contacts: node.choice.iter().enumerate().map(|which| *on_track(which).contact(moment)).collect(),
            })
            .collect()
    }

    /// True when contacts that roll hold the object all the way from a node's station to the next.
    fn holds_throughout(&self, node: &Node, moments: &[Moment]) -> bool {
        let holding = self.state(node).holding;
        let first = self.course.stations[node.station];
        (0..moments.len()).all(|k| {
            let halfway: Contacts = (node.choice.iter().enumerate())
                .map(|(finger, &track)| *self.tracks[finger][track].contact_after(first + k))
                .collect();
            self.closure.holds(&halfway, holding) && self.closure.holds(&moments[k].contacts, holding)
        })
    }

    /// True when the transfer from the node's station to the next is free.
    fn prove_transfer(&mut self, node: &Node) -> bool {
        if self.proven_transfers.contains(node) {
            return true;
        }
        let state = self.state(node);
        if !self.is_balanced(&state.moment(), state.holding) {
            self.no_goods.insert(NoGood::Grasp(node.station, node.choice.clone()));
            return false;
        }
        let moments = self.moments(node);
        if self.closure.changes() && !self.holds_throughout(node, &moments) {
            self.no_goods.insert(NoGood::Grasp(node.station, node.choice.clone()));
            return false;
        }
        self.search.workspace.set_state(&state);
        for moment in moments {
            self.search.workspace.roll_to(&moment.contacts);
            if !self.search.workspace.step(&moment.world_from_object, &moment.joints, TipMode::AllHold) {
                let no_good = self.blamed(node);
                self.no_goods.insert(no_good);
                return false;
            }
            if !self.is_balanced(&moment, state.holding) {
                self.no_goods.insert(NoGood::Grasp(node.station, node.choice.clone()));
                return false;
            }
        }
        self.proven_transfers.insert(node.clone())
    }

    fn is_balanced(&mut self, at: &Moment, holding: u32) -> bool {
        balances(&mut self.search.workspace, &at.world_from_object, &at.joints, &at.contacts, holding)
    }

    /// What stopped a transfer, in the smallest terms.
    fn blamed(&self, node: &Node) -> NoGood {
        let model = self.search.model();
        let finger_of = |body: usize| match model.bodies[body].carrier {
            Carrier::Finger { finger, .. } => Some(finger),
            _ => None,
        };
        let (station, choice) = (node.station, &node.choice);
        let fingers = self.search.workspace.blocking_pair.map(|pair| [finger_of(pair.a), finger_of(pair.b)]);
        match fingers {
            Some([Some(f), Some(g)]) if f != g => {
                let (f, g) = (f.min(g), f.max(g));
                NoGood::Pair(station, [f, g], [choice[f], choice[g]])
            }
            Some([Some(f), _] | [None, Some(f)]) => NoGood::Track(station, f, choice[f]),
            _ => NoGood::Grasp(station, choice.clone()),
        }
    }

    /// True when there is a way for `finger` from its track to another.
    fn prove_relocation(&mut self, node: &Node, finger: usize, track: usize, rng: &mut Rng) -> bool {
        let key = (node.clone(), finger, track);
        if self.proven_relocations.contains_key(&key) {
            return true;
        }
        let state = self.state(node);
        if !self.is_balanced(&state.moment(), state.holding & !(1 << finger)) {
            self.refute_relocation(node, finger, track);
            return false;
        }
        self.search.workspace.set_state(&state);
        let to = &self.tracks[finger][track];
        let moment = self.course.stations[node.station];
        let path = relocate(
            &mut self.search.workspace,
            &state.world_from_object,
            finger,
            Foothold { contact: state.contact(finger).as_ref(), joints: &state.joints[finger] },
            Foothold { contact: to.foothold(moment), joints: to.at(moment) },
            rng,
        );
        match path {
            Some(path) => {
                self.proven_relocations.insert(key, path);
                true
            }
            None => {
                self.refute_relocation(node, finger, track);
                false
            }
        }
    }

    fn refute_relocation(&mut self, node: &Node, finger: usize, track: usize) {
        let from = node.choice[finger];
        self.no_goods.insert(NoGood::Relocation(node.station, finger, from, track));
        *self.refuted.entry((finger, from, track)).or_default() += 1;
    }

    /// True when every motion along `path` is proven; what is refuted is remembered.
    fn prove(&mut self, path: &[Node], rng: &mut Rng) -> Result<bool, Stop> {
        let state = self.state(&path[0]);
        self.search.workspace.set_state(&state);
        let mut is_proven = self.search.workspace.is_clear(TipMode::AllHold);
        if !is_proven {
            self.no_goods.insert(NoGood::Start(path[0].choice.clone()));
        }
        for pair in path.windows(2) {
            self.search.check()?;
            is_proven &= match relocated(&pair[0], &pair[1]) {
                None => self.prove_transfer(&pair[0]),
                Some((finger, track)) => self.prove_relocation(&pair[0], finger, track, rng),
            };
        }
        Ok(is_proven)
    }

    /// The motions along a proven path, and how many are done at each way pose.
    fn motions(&self, path: &[Node]) -> Solution {
        let mut way = Sequence::at(self.state(&path[0]));
        let mut steps_to_way = Vec::new();
        let mut way_stations = self.course.way_stations.iter().peekable();
        let mut moments: Vec<Moment> = Vec::new();
        for (index, node) in path.iter().enumerate() {
            while way_stations.next_if(|&&station| station == node.station).is_some() {
                way.push_transfer(std::mem::take(&mut moments));
                steps_to_way.push(way.steps().len());
            }
            let Some(next) = path.get(index + 1) else { break };
            match relocated(node, next) {
                None => moments.extend(self.moments(node)),
                Some((finger, track)) => {
                    way.push_transfer(std::mem::take(&mut moments));
                    let steps = self.proven_relocations[&(node.clone(), finger, track)].clone();
                    let there = self.course.stations[node.station];
                    way.push_regrasp(finger, self.tracks[finger][track].foothold(there).copied(), steps);
                }
            }
        }
        way.push_transfer(moments);
        Solution { way, steps_to_way }
    }

    /// The cheapest path within `limits` on what is not refuted, or one that costs at most `greed` times as much;
    /// with a greed of 0 it is Dijkstra's algorithm.
    pub fn cheapest(&mut self, limits: Limits, greed: f64) -> Option<CheapestPath> {
        // The limit is on estimates, which greed inflates.
        let limits = Limits { cost: greed.max(1.0) * limits.cost, ..limits };
        let shared = RefCell::new(self);
        AStar::new().cheapest_path_within(
            limits,
            0,
            |node| shared.borrow_mut().is_goal(node),
            |node, out| shared.borrow_mut().neighbours(node, out),
            |node| greed * shared.borrow().bound(node),
        )
    }

    /// The first of at most `n_tries` cheapest paths, each without what was refuted of those before, that can be proven.
    ///
    /// Err when the search is to stop.
    pub fn cheapest_proven(
        &mut self,
        limits: Limits,
        greed: f64,
        n_tries: usize,
        rng: &mut Rng,
    ) -> Result<Option<Solution>, Stop> {
        for _ in 0..n_tries {
            let path = self.cheapest(limits, greed);
            self.stopped.map_or(Ok(()), Err)?;
            let Some(path) = path else { return Ok(None) };
            let nodes: Vec<Node> = path.nodes[self.n_fingers()..].iter().map(|&id| self.nodes[id].clone()).collect();
            if self.prove(&nodes, rng)? {
                return Ok(Some(self.motions(&nodes)));
            }
        }
        Ok(None)
    }
}

/// What the object pays from each station to the last.
pub fn object_rest(model: &Model, weights: &CostWeights, course: &Course) -> Vec<f64> {
    let mut rest = vec![0.0; course.stations.len()];
    for station in (0..course.last()).rev() {
        let poses = &course.poses[course.stations[station]..=course.stations[station + 1]];
        let paths = poses.windows(2).map(|pair| frame::pose_distance(&pair[0], &pair[1], model.turn_length()));
        rest[station] = rest[station + 1] + weights.object_path * paths.sum::<f64>();
    }
    rest
}

/// The finger that changes its track from one node to the next, and its track then; none for a transfer.
fn relocated(from: &Node, to: &Node) -> Option<(usize, usize)> {
    (0..from.choice.len()).find(|&f| from.choice[f] != to.choice[f]).map(|f| (f, to.choice[f]))
}

impl Alone {
    /// Of one finger with `tracks`, which begins on the track `start` and ends on `goal` if those are given.
    pub fn new(course: &Course, tracks: &[Track], [start, goal]: [Option<usize>; 2], weights: &CostWeights) -> Self {
        let n_stations = course.stations.len();
        let mut advance = vec![vec![f64::INFINITY; tracks.len()]; n_stations];
        let mut rest = advance.clone();
        for station in (0..n_stations).rev() {
            let moment = course.stations[station];
            let here = || tracks.iter().enumerate().filter(|(_, track)| track.spans(moment));
            let mut staying = vec![f64::INFINITY; tracks.len()];
            for (index, track) in here() {
                if station == course.last() {
                    let is_goal = goal.is_none_or(|goal| goal == index);
                    staying[index] = if is_goal { 0.0 } else { f64::INFINITY };
                } else if track.spans(course.stations[station + 1]) {
                    let along = &track.joints[moment - track.first..=course.stations[station + 1] - track.first];
                    let path: f64 = along.windows(2).map(|pair| joint_path(&pair[0], &pair[1])).sum();
                    advance[station][index] = weights.joint_path * path;
                    staying[index] = advance[station][index] + rest[station + 1][index];
                }
            }
            // A finger that changes twice at one station might as well change once.
            for (index, track) in here() {
                let changes = here().filter(|&(other, _)| other != index).map(|(other, onto)| {
                    let path = joint_path(track.at(moment), onto.at(moment));
                    let landing = if onto.is_free() { 0.0 } else { weights.relocation };
                    landing + weights.joint_path * path + staying[other]
                });
                rest[station][index] = changes.fold(staying[index], f64::min);
            }
        }
        Alone { start, advance, rest }
    }

    /// What the finger pays at least from the start to the goal.
    pub fn least(&self) -> f64 {
        match self.start {
            Some(track) => self.rest[0][track],
            None => self.rest[0].iter().copied().fold(f64::INFINITY, f64::min),
        }
    }
}
