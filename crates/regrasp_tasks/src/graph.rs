//! The task graph: who holds the object by which grasp, or where it lies. Edges are tested when the cheapest path uses them.

mod cheapest;

use crate::context::Context;
use crate::exchange::{Give, HANDS_TOUCH, Places, hands_touch, is_double_grasp};
use crate::failing::{Stage, Tally};
use crate::forces;
use crate::in_hand::{self, Change};
use crate::miss::with_nearest;
use crate::motions::{self, Made, Step, Stuck};
use crate::placements::{Place, intermediate};
use crate::roadmap::{TaskAnswer, TaskRoadmap};
use crate::station::{Effort, HAND_COLLIDES, Station, TOO_HEAVY, failed_try, may_hold, station};
use regrasp_geometry::Vector;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::task_settings::TaskCost;
use regrasp_plan::RobotPlan;
use std::collections::BTreeMap;

/// A node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Node {
    /// The object lies at a place, by its index.
    Lies(usize),
    /// A hand holds it by a grasp.
    Held([usize; 2]),
}

/// What is known about an edge.
#[derive(Debug, Clone)]
enum Known<T> {
    /// Nothing.
    New,
    /// The cheap tests are passed.
    Likely,
    /// Postures are found.
    Found(Box<T>),
    /// It leads nowhere.
    Dead,
}

impl<T> Known<T> {
    fn is_dead(&self) -> bool {
        matches!(self, Known::Dead)
    }

    fn found(&self) -> Option<&T> {
        match self {
            Known::Found(found) => Some(found),
            _ => None,
        }
    }
}

/// A hand's grasp at a place.
struct Grip {
    known: Known<Station>,
    cost: f64,
    /// How often motions to it were not found: to take the object, and to put it down.
    stuck: [usize; 2],
    /// Few postures were tried already.
    is_second_look: bool,
}

/// One hand gives to another.
struct Given {
    known: Known<Give>,
    cost: f64,
    /// How often motions to it were not found.
    stuck: usize,
    /// The best places of the exchange were tried already.
    is_second_look: bool,
}

/// A hand changes its grasp.
struct Changed {
    known: Known<Change>,
    cost: f64,
    /// How often motions to it were not found.
    stuck: usize,
}

/// Cost of taking or putting down, of giving; in seconds about. By hand: what plans take.
const GRIP_SECONDS: f64 = 3.0;
const GIVE_SECONDS: f64 = 4.0;
/// Cost of a change of grasp in the hand, and of each radian that the object turns; in seconds. By hand: what plans take.
const CHANGE_SECONDS: f64 = 10.0;
const SECONDS_PER_RADIAN: f64 = 5.0;
/// What counts for a change of the holder where few changes are wanted.
const CHANGE: f64 = 100.0;
/// Seconds for each metre of the way of an object.
const SECONDS_PER_METRE: f64 = 2.0;
/// What a poor grasp costs more than a good one, in seconds. By hand.
const POOR: f64 = 2.0;
/// What a grasp costs more whose largest contact force is the weight of the object larger than another one's, in seconds; forces up to
/// [`EASY`] weights cost nothing. By hand.
const STRAIN: f64 = 2.0;
/// Forces of three fingers about an object are about as large as its weight.
const EASY: f64 = 1.0;
/// What exchanges cost more for each that failed, in seconds, so that other ways get their turn. By hand.
const FAILED: f64 = 0.05;
/// What an exchange costs more that was not found at the best places, in seconds. By hand.
const SECOND_LOOK: f64 = 1.0;
/// What a grasp costs more at start or goal that was not found with few postures of the arm, in seconds: more than any plan. By hand.
const LAST_RESORT: f64 = 1000.0;
/// What an exchange costs more that the roadmap does not have, in seconds. By hand.
const NOT_MADE: f64 = 2.0;
/// A motion that was not found makes its edge this much dearer, in seconds; it is dead after so many.
const STUCK: f64 = 1.0;
const MOST_STUCK: usize = 3;

/// The graph.
struct Graph<'c, 'a> {
    context: &'c Context<'a>,
    /// What was made before.
    roadmap: Option<&'c TaskRoadmap>,
    places: Vec<Place>,
    /// By place, hand and grasp.
    grips: Vec<Vec<Vec<Grip>>>,
    /// By the hands of giver and taker: by their grasps, those of the taker in a row.
    gives: BTreeMap<[usize; 2], Vec<Given>>,
    /// By grasp before and grasp after, of one hand.
    changes: BTreeMap<([usize; 2], [usize; 2]), Changed>,
    searched_changes: usize,
    /// By hand: the number of its first grasp among the nodes.
    first_held: Vec<usize>,
    n_nodes: usize,
    /// Places of the exchange, by both hands; of changes in one hand, by that hand twice.
    exchange: BTreeMap<[usize; 2], Places>,
    failed_gives: usize,
    /// How often places were drawn.
    rounds: usize,
    tested: usize,
    /// By node, what the cheapest way to the goal costs at least.
    to_goal: Vec<f64>,
    /// How many nodes searches looked at since then.
    n_looked: usize,
}

/// The cheapest plan that holds what it promises, and what the roadmap did not have. Errors: with the nearest miss.
pub fn search(context: &Context, roadmap: Option<&TaskRoadmap>, tally: &mut Tally) -> Result<TaskAnswer, Failure> {
    let mut graph = Graph::new(context, roadmap);
    plan_in(&mut graph, tally).map_err(|failure| match failure.kind {
        FailureKind::Interrupted => failure,
        _ => with_nearest(failure, context, tally, &graph.exchange),
    })
}

fn plan_in(graph: &mut Graph, tally: &mut Tally) -> Result<TaskAnswer, Failure> {
    let (context, roadmap) = (graph.context, graph.roadmap);
    let roads = roadmap.and_then(|roadmap| roadmap.roads.as_ref());
    let mut attempt = 0;
    loop {
        if let Err(interrupt) = context.budget.check(tally.statistics.work) {
            return Err(tally.failure(FailureKind::from(interrupt)));
        }
        if graph.tested > context.settings.max_edges {
            return Err(tally.failure(FailureKind::WorkSpent));
        }
        let Some(path) = graph.path() else { return Err(tally.failure(FailureKind::Impossible)) };
        if !graph.test(&path, tally) {
            continue;
        }
        let steps = graph.steps(&path);
        attempt += 1;
        match motions::segments(context, &steps, (attempt, roads), tally) {
            Ok(Made { segments, new_ways }) => {
                for stage in [Stage::Transit, Stage::Carry] {
                    tally.count(stage, Ok(()));
                }
                let mut plan = RobotPlan::answering_pick_and_place(context.scene, context.query);
                plan.method = if roadmap.is_some() { "super_graph" } else { "task_graph" }.into();
                plan.seed = context.seed;
                plan.settings = serde_json::to_value(context.settings).unwrap_or_default();
                plan.promises.clearance = context.settings.clearance;
                plan.promises.holding = Some(context.promises.clone());
                plan.statistics = tally.statistics();
                let changes =
                    steps.iter().filter_map(|step| if let Step::Change(own) = step { Some(*own) } else { None });
                plan.promises.in_hand = in_hand::promises(context, changes);
                plan.segments = segments;
                let exchanges = steps
                    .iter()
                    .filter_map(|step| if let Step::Give(give) = step { Some((*give).clone()) } else { None })
                    .collect();
                return Ok(TaskAnswer { plan, new_ways, exchanges });
            }
            Err(Stuck { stage, step, reason, interrupt }) => {
                tally.count(stage, Err(&reason));
                if let Some(kind) = interrupt {
                    return Err(tally.failure(kind));
                }
                drop(steps);
                graph.blame(&path, step);
            }
        }
    }
}

impl<'c, 'a> Graph<'c, 'a> {
    fn new(context: &'c Context<'a>, roadmap: Option<&'c TaskRoadmap>) -> Self {
        let ends = [&context.query.world_from_object_start, &context.query.world_from_object_goal];
        let mut places: Vec<Place> = ends.iter().filter_map(|pose| Place::new(context, pose)).collect();
        if context.settings.put_down {
            places.extend(intermediate(context, 0));
        }
        let grips = places.iter().enumerate().map(|(index, _)| grips_at(context, &places, index)).collect();
        let n_grasps = |hand: usize| context.hands[hand].grasps.len();
        let mut gives: BTreeMap<[usize; 2], Vec<Given>> = BTreeMap::new();
        for giver in 0..context.hands.len() {
            for taker in 0..context.hands.len() {
                if !context.settings.hand_over || context.hands[taker].arm == context.hands[giver].arm {
                    continue;
                }
                let score = |hand: usize, grasp: usize| context.hands[hand].grasps[grasp].score;
                let given = |i: usize, j: usize| {
                    let cost = GIVE_SECONDS + POOR * (1.0 - score(giver, i).min(score(taker, j)));
                    Given { known: Known::New, cost, stuck: 0, is_second_look: false }
                };
                let all = (0..n_grasps(giver)).flat_map(|i| (0..n_grasps(taker)).map(move |j| (i, j)));
                gives.insert([giver, taker], all.map(|(i, j)| given(i, j)).collect());
            }
        }
        if let Some(roadmap) = roadmap {
            gives.values_mut().flatten().for_each(|given| given.cost += NOT_MADE);
            for give in &roadmap.exchanges {
                let n = n_grasps(give.taker[0]);
                let of_pair = gives.get_mut(&[give.giver[0], give.taker[0]]);
                if let Some(given) = of_pair.and_then(|of| of.get_mut(give.giver[1] * n + give.taker[1])) {
                    (given.known, given.cost) = (Known::Found(Box::new(give.clone())), given.cost - NOT_MADE);
                }
            }
        }
        let (first_held, n_nodes) = numbers(context, places.len());
        Graph {
            context,
            roadmap,
            places,
            grips,
            gives,
            changes: changes_of(context),
            searched_changes: 0,
            first_held,
            n_nodes,
            exchange: BTreeMap::new(),
            failed_gives: 0,
            rounds: 1,
            tested: 0,
            to_goal: Vec::new(),
            n_looked: 0,
        }
    }

    /// The cheapest path. More places are drawn where there is none, and before a change of grasp in a hand is searched for.
    fn path(&mut self) -> Option<Vec<Node>> {
        loop {
            let path = self.cheapest();
            let settings = self.context.settings;
            if !settings.put_down || self.rounds >= settings.placement_rounds {
                return path;
            }
            if path.as_ref().is_some_and(|path| !self.needs_search_in_hand(path)) {
                return path;
            }
            let known = self.places.len();
            self.places.extend(intermediate(self.context, self.rounds));
            self.rounds += 1;
            let context = self.context;
            let new = (known..self.places.len()).map(|index| grips_at(context, &self.places, index));
            self.grips.extend(new);
            (self.first_held, self.n_nodes) = numbers(context, self.places.len());
        }
    }

    fn needs_search_in_hand(&self, path: &[Node]) -> bool {
        path.windows(2).any(|pair| {
            let (Node::Held(before), Node::Held(after)) = (pair[0], pair[1]) else { return false };
            self.changes.get(&(before, after)).is_some_and(|changed| matches!(changed.known, Known::New))
        })
    }

    /// The number of a node: places first, then grasps by hand.
    fn index(&self, node: Node) -> usize {
        match node {
            Node::Lies(place) => place,
            Node::Held([hand, grasp]) => self.first_held[hand] + grasp,
        }
    }

    /// The node of a number.
    fn node(&self, index: usize) -> Node {
        if index < self.places.len() {
            return Node::Lies(index);
        }
        let hand = self.first_held.partition_point(|&first| first <= index) - 1;
        Node::Held([hand, index - self.first_held[hand]])
    }

    /// The edge of one hand that gives to another one.
    fn given(&mut self, giver: [usize; 2], taker: [usize; 2]) -> Option<&mut Given> {
        let n = self.context.hands[taker[0]].grasps.len();
        self.gives.get_mut(&[giver[0], taker[0]])?.get_mut(giver[1] * n + taker[1])
    }

    /// Edges from a node: the numbers of the nodes where they lead, and what they cost.
    fn edges(&self, from: Node, into: &mut Vec<(usize, f64)>) {
        into.clear();
        let change = if self.context.settings.cost == TaskCost::Changes { CHANGE } else { 0.0 };
        match from {
            Node::Lies(place) => {
                for (hand, of_hand) in self.grips[place].iter().enumerate() {
                    let alive = of_hand.iter().enumerate().filter(|(_, grip)| !grip.known.is_dead());
                    let cost = |grip: &Grip| grip.cost + change + STUCK * grip.stuck[0] as f64;
                    into.extend(alive.map(|(grasp, grip)| (self.first_held[hand] + grasp, cost(grip))));
                }
            }
            Node::Held([hand, grasp]) => {
                for (place, of_place) in self.grips.iter().enumerate().skip(1) {
                    let grip = &of_place[hand][grasp];
                    if !grip.known.is_dead() {
                        into.push((place, grip.cost + change + STUCK * grip.stuck[1] as f64));
                    }
                }
                let failed = FAILED * self.failed_gives as f64;
                for ([_, taker], of_pair) in self.gives.range([hand, 0]..=[hand, usize::MAX]) {
                    let n = self.context.hands[*taker].grasps.len();
                    let own = of_pair[grasp * n..(grasp + 1) * n].iter().enumerate();
                    let alive = own.filter(|(_, given)| !given.known.is_dead());
                    let cost = |given: &Given| given.cost + failed + change + STUCK * given.stuck as f64;
                    into.extend(alive.map(|(j, given)| (self.first_held[*taker] + j, cost(given))));
                }
                let from = [hand, grasp];
                let changes = self.changes.range((from, [0, 0])..=(from, [usize::MAX, usize::MAX]));
                let alive = changes.filter(|(_, changed)| !changed.known.is_dead());
                let cost = |changed: &Changed| changed.cost + change + STUCK * changed.stuck as f64;
                into.extend(alive.map(|((_, [hand, after]), changed)| (self.first_held[*hand] + after, cost(changed))));
            }
        }
    }

    /// Tests the edges of a path, the cheapest test first. False where one turns out dead.
    fn test(&mut self, path: &[Node], tally: &mut Tally) -> bool {
        path.windows(2).all(|pair| self.test_likely(pair[0], pair[1], tally))
            && path.windows(2).all(|pair| self.test_grip(pair[0], pair[1], tally))
            && path.windows(2).all(|pair| self.test_pair(pair[0], pair[1], tally))
            && path.windows(2).all(|pair| self.test_give(pair[0], pair[1], tally))
            && path.windows(2).all(|pair| self.test_change(pair[0], pair[1], tally))
    }

    fn stage_of(&self, place: usize) -> Stage {
        [Stage::Grasp, Stage::Place].get(place).copied().unwrap_or(Stage::PutDown)
    }

    /// Pairs of grasps in which the hands hit each other are dead.
    fn test_pair(&mut self, from: Node, to: Node, tally: &mut Tally) -> bool {
        let (Node::Held(giver), Node::Held(taker)) = (from, to) else { return true };
        let (context, roadmap) = (self.context, self.roadmap);
        let Some(given) = self.given(giver, taker) else { return giver[0] == taker[0] };
        if matches!(given.known, Known::New) {
            tally.work(1);
            let is_apart = match roadmap {
                Some(roadmap) => roadmap.is_apart(giver, taker),
                None => is_double_grasp(context, giver, taker),
            };
            given.known = match is_apart {
                true => Known::Likely,
                false => {
                    tally.count(Stage::Exchange, Err(HANDS_TOUCH));
                    tally.keep(Stage::Exchange, 0, || hands_touch([giver, taker]));
                    Known::Dead
                }
            };
        }
        !given.known.is_dead()
    }

    fn test_likely(&mut self, from: Node, to: Node, tally: &mut Tally) -> bool {
        let (Node::Lies(place), Node::Held([hand, grasp])) = (from.min(to), from.max(to)) else { return true };
        let stage = self.stage_of(place);
        let grip = &mut self.grips[place][hand][grasp];
        if matches!(grip.known, Known::New) {
            tally.work(1);
            let own = &self.context.hands[hand].grasps[grasp];
            let at = &self.places[place];
            let found = may_hold(self.context, at, hand, own)
                .and_then(|()| forces::strain(self.context, hand, own, &at.world_from_object).ok_or(TOO_HEAVY));
            match found {
                Ok(strain) => {
                    let dearer = STRAIN * (strain - EASY).max(0.0);
                    grip.known = Known::Likely;
                    grip.cost += dearer;
                    // Another one may be cheaper now.
                    return dearer == 0.0;
                }
                Err(reason) => {
                    tally.count(stage, Err(reason));
                    tally.keep(stage, 0, || failed_try(at, [hand, grasp], reason, None));
                    grip.known = Known::Dead;
                }
            }
        }
        !grip.known.is_dead()
    }

    fn test_grip(&mut self, from: Node, to: Node, tally: &mut Tally) -> bool {
        let (Node::Lies(place), Node::Held([hand, grasp])) = (from.min(to), from.max(to)) else { return true };
        let stage = self.stage_of(place);
        let grip = &mut self.grips[place][hand][grasp];
        if matches!(grip.known, Known::Likely) {
            self.tested += 1;
            let effort = if grip.is_second_look { Effort::Full } else { Effort::Little };
            let found = station(self.context, &self.places[place], [hand, grasp], (stage, effort), tally);
            if found.is_ok() || effort == Effort::Little {
                tally.count(stage, found.as_ref().map(|_| ()).map_err(|reason| *reason));
            }
            if let (Err(reason), Effort::Little) = (&found, effort)
                && place < 2
                && *reason != HAND_COLLIDES
            {
                // Its turn comes again if nothing else is left.
                (grip.is_second_look, grip.cost) = (true, grip.cost + LAST_RESORT);
                return false;
            }
            grip.known = found.map_or(Known::Dead, |found| Known::Found(Box::new(found)));
        }
        !grip.known.is_dead()
    }

    fn test_give(&mut self, from: Node, to: Node, tally: &mut Tally) -> bool {
        let (Node::Held(giver), Node::Held(taker)) = (from, to) else { return true };
        let context = self.context;
        let Some(given) = self.given(giver, taker) else { return giver[0] == taker[0] };
        if !matches!(given.known, Known::Likely) {
            return !given.known.is_dead();
        }
        let is_second_look = given.is_second_look;
        self.tested += 1;
        let hands = [giver[0], taker[0]];
        let places = self.exchange.entry(hands).or_insert_with(|| Places::new(context, hands));
        let effort = if is_second_look { Effort::Full } else { Effort::Little };
        let found = places.give(context, [giver, taker], effort, tally);
        if let (Err(_), Effort::Little) = (&found, effort) {
            // Another pair may be easier; this one gets a second look when its turn comes.
            self.failed_gives += 1;
            if let Some(given) = self.given(giver, taker) {
                (given.is_second_look, given.cost) = (true, given.cost + SECOND_LOOK);
            }
            return false;
        }
        tally.count(Stage::Exchange, found.as_ref().map(|_| ()).map_err(|reason| *reason));
        self.failed_gives += usize::from(found.is_err());
        let is_found = found.is_ok();
        if let Some(given) = self.given(giver, taker) {
            given.known = found.map_or(Known::Dead, |found| Known::Found(Box::new(found)));
        }
        is_found
    }

    /// Changes of the grasp of one hand, the dearest test of all.
    fn test_change(&mut self, from: Node, to: Node, tally: &mut Tally) -> bool {
        let (Node::Held(before), Node::Held(after)) = (from, to) else { return true };
        let Some(changed) = self.changes.get_mut(&(before, after)) else { return before[0] != after[0] };
        if matches!(changed.known, Known::New) {
            self.tested += 1;
            self.searched_changes += 1;
            let hand = before[0];
            let found = match self.searched_changes > self.context.settings.in_hand_searches {
                true => Err("not searched for (`in_hand_searches`)"),
                false => {
                    let places = self.exchange.entry([hand; 2]).or_insert_with(|| Places::new(self.context, [hand; 2]));
                    in_hand::change(self.context, places, [hand, before[1], after[1]], tally)
                }
            };
            tally.count(Stage::InHand, found.as_ref().map(|_| ()).map_err(|reason| *reason));
            changed.known = found.map_or(Known::Dead, |found| Known::Found(Box::new(found)));
        }
        !changed.known.is_dead()
    }

    /// The steps of a path whose edges are tested.
    fn steps(&self, path: &[Node]) -> Vec<Step<'_>> {
        let step = |pair: &[Node]| match (pair[0], pair[1]) {
            (Node::Lies(place), Node::Held([hand, grasp])) => {
                self.grips[place][hand][grasp].known.found().map(|found| Step::Pick(found, &self.places[place]))
            }
            (Node::Held([hand, grasp]), Node::Lies(place)) => {
                self.grips[place][hand][grasp].known.found().map(|found| Step::Place(found, &self.places[place]))
            }
            (Node::Held(before), Node::Held(after)) if before[0] == after[0] => {
                self.changes.get(&(before, after)).and_then(|changed| changed.known.found()).map(Step::Change)
            }
            (Node::Held(giver), Node::Held(taker)) => {
                let n = self.context.hands[taker[0]].grasps.len();
                let of_pair = self.gives.get(&[giver[0], taker[0]]);
                of_pair.and_then(|of_pair| of_pair[giver[1] * n + taker[1]].known.found()).map(Step::Give)
            }
            (Node::Lies(_), Node::Lies(_)) => None,
        };
        path.windows(2).filter_map(step).collect()
    }

    /// The motion to a step was not found: its edge becomes dearer, and dead in the end.
    fn blame(&mut self, path: &[Node], step: usize) {
        let step = step.min(path.len() - 2);
        match (path[step], path[step + 1]) {
            (Node::Lies(place), Node::Held([hand, grasp])) => self.grips[place][hand][grasp].is_stuck(0),
            (Node::Held([hand, grasp]), Node::Lies(place)) => self.grips[place][hand][grasp].is_stuck(1),
            (Node::Held(before), Node::Held(after)) => {
                if let Some(changed) = self.changes.get_mut(&(before, after)) {
                    changed.stuck += 1;
                    if changed.stuck >= MOST_STUCK {
                        changed.known = Known::Dead;
                    }
                } else if let Some(given) = self.given(before, after) {
                    given.stuck += 1;
                    if given.stuck >= MOST_STUCK {
                        given.known = Known::Dead;
                    }
                }
            }
            (Node::Lies(_), Node::Lies(_)) => {}
        }
    }
}

impl Grip {
    /// A motion to take the object, or to put it down, was not found.
    fn is_stuck(&mut self, way: usize) {
        self.stuck[way] += 1;
        if self.stuck[way] >= MOST_STUCK {
            self.known = Known::Dead;
        }
    }
}

/// Ways to take the object at a place, or to put it down there, by hand and grasp.
fn grips_at(context: &Context, places: &[Place], index: usize) -> Vec<Vec<Grip>> {
    let center = |place: &Place| (place.world_from_object * context.object.center_of_mass).coords;
    let [start, goal, at] = [0, 1, index].map(|k| center(&places[k]));
    let detour = match index {
        0 | 1 => 0.5 * (goal - start).norm(),
        _ => 0.5 * ((at - start).norm() + (goal - at).norm()),
    };
    let grip = |hand: usize, grasp: usize| {
        let own = &context.hands[hand].grasps[grasp];
        let comes = places[index].world_from_object.rotation * own.direction;
        let base = context.robot.world_from_root().translation.vector;
        let natural = (at - base).try_normalize(1e-9).map_or(0.0, |towards: Vector| towards.dot(&comes));
        let poor = 0.5 * (1.0 - own.score) + 0.25 * (1.0 - natural);
        Grip {
            known: Known::New,
            cost: GRIP_SECONDS + SECONDS_PER_METRE * detour + POOR * poor,
            stuck: [0; 2],
            is_second_look: false,
        }
    };
    let of_hand = |hand: usize| (0..context.hands[hand].grasps.len()).map(|grasp| grip(hand, grasp)).collect();
    (0..context.hands.len()).map(of_hand).collect()
}

/// By hand, the number of its first grasp among the nodes, after those of so many places; and the number of nodes.
fn numbers(context: &Context, n_places: usize) -> (Vec<usize>, usize) {
    let mut n_nodes = n_places;
    let mut first_held = Vec::new();
    for hand in &context.hands {
        first_held.push(n_nodes);
        n_nodes += hand.grasps.len();
    }
    (first_held, n_nodes)
}

/// Changes of grasp that are worth a search: from each grasp to the nearest ones.
fn changes_of(context: &Context) -> BTreeMap<([usize; 2], [usize; 2]), Changed> {
    let mut found = BTreeMap::new();
    if !context.settings.in_hand {
        return found;
    }
    for (hand, own) in context.hands.iter().enumerate() {
        for before in 0..own.grasps.len() {
            let far = |after: usize| in_hand::distance(context, hand, [before, after]).map(|far| (far, after));
            let mut near: Vec<(f64, usize)> = (0..own.grasps.len()).filter_map(far).collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for (far, after) in near.into_iter().take(context.settings.in_hand_neighbours) {
                let cost = CHANGE_SECONDS + SECONDS_PER_RADIAN * far;
                found.insert(([hand, before], [hand, after]), Changed { known: Known::New, cost, stuck: 0 });
            }
        }
    }
    found
}
