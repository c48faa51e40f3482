//! The task graph: who holds the object by which grasp, or where it lies. Edges are tested when the cheapest path uses them.

use crate::context::Context;
use crate::exchange::{Give, Places, is_double_grasp};
use crate::failing::{Stage, Tally};
use crate::in_hand::{self, Change};
use crate::motions::{self, Step, Stuck};
use crate::placements::{Place, intermediate};
use crate::station::{Station, may_hold, station};
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
}

/// One hand gives to another.
struct Given {
    known: Known<Give>,
    cost: f64,
}

/// A hand changes its grasp.
struct Changed {
    known: Known<Change>,
    cost: f64,
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
/// What exchanges cost more for each that failed, in seconds, so that other ways get their turn. By hand.
const FAILED: f64 = 0.05;
/// A motion that was not found makes its edge this much dearer, in seconds; it is dead after so many.
const STUCK: f64 = 1.0;
const MOST_STUCK: usize = 3;

/// The graph.
struct Graph<'c, 'a> {
    context: &'c Context<'a>,
    places: Vec<Place>,
    /// By place, hand and grasp.
    grips: Vec<Vec<Vec<Grip>>>,
    /// By giver and taker.
    gives: BTreeMap<([usize; 2], [usize; 2]), Given>,
    /// By grasp before and grasp after, of one hand.
    changes: BTreeMap<([usize; 2], [usize; 2]), Changed>,
    searched_changes: usize,
    /// Places of the exchange, by both hands; of changes in one hand, by that hand twice.
    exchange: BTreeMap<[usize; 2], Places>,
    failed_gives: usize,
    tested: usize,
    /// How often motions to an edge were not found.
    stuck: BTreeMap<(Node, Node), usize>,
}

/// The cheapest plan that holds what it promises.
pub fn search(context: &Context, tally: &mut Tally) -> Result<RobotPlan, Failure> {
    let mut graph = Graph::new(context);
    let mut attempt = 0;
    loop {
        if let Err(interrupt) = context.budget.check(tally.statistics.work) {
            return Err(tally.failure(FailureKind::from(interrupt)));
        }
        if graph.tested > context.settings.max_edges {
            return Err(tally.failure(FailureKind::WorkSpent));
        }
        let Some(path) = graph.cheapest() else { return Err(tally.failure(FailureKind::Impossible)) };
        if !graph.test(&path, tally) {
            continue;
        }
        let steps = graph.steps(&path);
        attempt += 1;
        match motions::segments(context, &steps, attempt, tally) {
            Ok(segments) => {
                for stage in [Stage::Transit, Stage::Carry] {
                    tally.count(stage, Ok(()));
                }
                let mut plan = RobotPlan::answering_pick_and_place(context.scene, context.query);
                plan.method = "task_graph".into();
                plan.seed = context.seed;
                plan.settings = serde_json::to_value(context.settings).unwrap_or_default();
                plan.promises.clearance = context.settings.clearance;
                plan.promises.holding = Some(context.promises.clone());
                plan.statistics = tally.statistics();
                let changes =
                    steps.iter().filter_map(|step| if let Step::Change(own) = step { Some(*own) } else { None });
                plan.promises.in_hand = in_hand::promises(context, changes);
                plan.segments = segments;
                return Ok(plan);
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
    fn new(context: &'c Context<'a>) -> Self {
        let ends = [&context.query.world_from_object_start, &context.query.world_from_object_goal];
        let mut places: Vec<Place> = ends.iter().filter_map(|pose| Place::new(context, pose)).collect();
        if context.settings.put_down {
            places.extend(intermediate(context));
        }
        let center = |place: &Place| (place.world_from_object * context.object.center_of_mass).coords;
        let [start, goal] = [center(&places[0]), center(&places[1])];
        let of_grip = |place: usize, hand: usize, grasp: usize| {
            let at = center(&places[place]);
            let detour = match place {
                0 | 1 => 0.5 * (goal - start).norm(),
                _ => 0.5 * ((at - start).norm() + (goal - at).norm()),
            };
            let own = &context.hands[hand].grasps[grasp];
            let comes = places[place].world_from_object.rotation * own.direction;
            let base = context.robot.world_from_root().translation.vector;
            let natural = (at - base).try_normalize(1e-9).map_or(0.0, |towards: Vector| towards.dot(&comes));
            let poor = 0.5 * (1.0 - own.score) + 0.25 * (1.0 - natural);
            Grip { known: Known::New, cost: GRIP_SECONDS + SECONDS_PER_METRE * detour + POOR * poor }
        };
        let n_grasps = |hand: usize| context.hands[hand].grasps.len();
        let grips = (0..places.len())
            .map(|place| {
                (0..context.hands.len())
                    .map(|hand| (0..n_grasps(hand)).map(|grasp| of_grip(place, hand, grasp)).collect())
                    .collect()
            })
            .collect();
        let mut gives = BTreeMap::new();
        if context.settings.hand_over {
            for giver in 0..context.hands.len() {
                for taker in
                    (0..context.hands.len()).filter(|&taker| context.hands[taker].arm != context.hands[giver].arm)
                {
                    for i in 0..n_grasps(giver) {
                        for j in 0..n_grasps(taker) {
                            let score = context.hands[giver].grasps[i].score.min(context.hands[taker].grasps[j].score);
                            let cost = GIVE_SECONDS + POOR * (1.0 - score);
                            gives.insert(([giver, i], [taker, j]), Given { known: Known::New, cost });
                        }
                    }
                }
            }
        }
        Graph {
            context,
            places,
            grips,
            gives,
            changes: changes_of(context),
            searched_changes: 0,
            exchange: BTreeMap::new(),
            failed_gives: 0,
            tested: 0,
            stuck: BTreeMap::new(),
        }
    }

    fn dearer(&self, from: Node, to: Node) -> f64 {
        let stuck = self.stuck.get(&(from, to)).copied().unwrap_or_default();
        let change = if self.context.settings.cost == TaskCost::Changes { CHANGE } else { 0.0 };
        change + STUCK * stuck as f64
    }

    /// Edges from a node: where they lead, and what they cost.
    fn edges(&self, from: Node, into: &mut Vec<(Node, f64)>) {
        into.clear();
        match from {
            Node::Lies(place) => {
                for (hand, of_hand) in self.grips[place].iter().enumerate() {
                    let alive = of_hand.iter().enumerate().filter(|(_, grip)| !grip.known.is_dead());
                    into.extend(alive.map(|(grasp, grip)| (Node::Held([hand, grasp]), grip.cost)));
                }
            }
            Node::Held(giver) => {
                for (place, of_place) in self.grips.iter().enumerate().skip(1) {
                    let grip = &of_place[giver[0]][giver[1]];
                    if !grip.known.is_dead() {
                        into.push((Node::Lies(place), grip.cost));
                    }
                }
                let gives = self.gives.range((giver, [0, 0])..=(giver, [usize::MAX, usize::MAX]));
                let failed = FAILED * self.failed_gives as f64;
                let alive = gives.filter(|(_, given)| !given.known.is_dead());
                into.extend(alive.map(|((_, taker), given)| (Node::Held(*taker), given.cost + failed)));
                let changes = self.changes.range((giver, [0, 0])..=(giver, [usize::MAX, usize::MAX]));
                let alive = changes.filter(|(_, changed)| !changed.known.is_dead());
                into.extend(alive.map(|((_, after), changed)| (Node::Held(*after), changed.cost)));
            }
        }
        for (to, cost) in into.iter_mut() {
            *cost += self.dearer(from, *to);
        }
    }

    /// The cheapest path from the start to the goal through edges that are not dead (Dijkstra 1959).
    fn cheapest(&self) -> Option<Vec<Node>> {
        let goal = Node::Lies(1);
        let mut costs: BTreeMap<Node, (f64, Option<Node>)> = BTreeMap::from([(Node::Lies(0), (0.0, None))]);
        let mut waiting: BTreeMap<Node, f64> = BTreeMap::from([(Node::Lies(0), 0.0)]);
        let mut edges = Vec::new();
        while let Some((&node, &cost)) = waiting.iter().min_by(|a, b| a.1.total_cmp(b.1).then(a.0.cmp(b.0))) {
            waiting.remove(&node);
            if node == goal {
                let mut path = vec![goal];
                let mut at = goal;
                while let Some((_, Some(before))) = costs.get(&at) {
                    path.push(*before);
                    at = *before;
                }
                path.reverse();
                return Some(path);
            }
            self.edges(node, &mut edges);
            for &(to, of_edge) in &edges {
                let whole = cost + of_edge;
                if costs.get(&to).is_none_or(|known| whole < known.0) {
                    costs.insert(to, (whole, Some(node)));
                    waiting.insert(to, whole);
                }
            }
        }
        None
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
        let Some(given) = self.gives.get_mut(&(giver, taker)) else { return giver[0] == taker[0] };
        if matches!(given.known, Known::New) {
            tally.work(1);
            given.known = match is_double_grasp(self.context, giver, taker) {
                true => Known::Likely,
                false => {
                    tally.count(Stage::Exchange, Err("hands touch"));
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
            grip.known = match may_hold(self.context, &self.places[place], hand, own) {
                Ok(()) => Known::Likely,
                Err(reason) => {
                    tally.count(stage, Err(reason));
                    Known::Dead
                }
            };
        }
        !grip.known.is_dead()
    }

    fn test_grip(&mut self, from: Node, to: Node, tally: &mut Tally) -> bool {
        let (Node::Lies(place), Node::Held([hand, grasp])) = (from.min(to), from.max(to)) else { return true };
        let stage = self.stage_of(place);
        let grip = &mut self.grips[place][hand][grasp];
        if matches!(grip.known, Known::Likely) {
            self.tested += 1;
            let found = station(self.context, &self.places[place], [hand, grasp], stage, tally);
            tally.count(stage, found.as_ref().map(|_| ()).map_err(|reason| *reason));
            grip.known = found.map_or(Known::Dead, |found| Known::Found(Box::new(found)));
        }
        !grip.known.is_dead()
    }

    fn test_give(&mut self, from: Node, to: Node, tally: &mut Tally) -> bool {
        let (Node::Held(giver), Node::Held(taker)) = (from, to) else { return true };
        let Some(given) = self.gives.get_mut(&(giver, taker)) else { return giver[0] == taker[0] };
        if matches!(given.known, Known::Likely) {
            self.tested += 1;
            let hands = [giver[0], taker[0]];
            let places = self.exchange.entry(hands).or_insert_with(|| Places::new(self.context, hands));
            let found = places.give(self.context, giver, taker, tally);
            tally.count(Stage::Exchange, found.as_ref().map(|_| ()).map_err(|reason| *reason));
            self.failed_gives += usize::from(found.is_err());
            given.known = found.map_or(Known::Dead, |found| Known::Found(Box::new(found)));
        }
        !given.known.is_dead()
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
                self.gives.get(&(giver, taker)).and_then(|given| given.known.found()).map(Step::Give)
            }
            (Node::Lies(_), Node::Lies(_)) => None,
        };
        path.windows(2).filter_map(step).collect()
    }

    /// The motion to a step was not found: its edge becomes dearer, and dead in the end.
    fn blame(&mut self, path: &[Node], step: usize) {
        let step = step.min(path.len() - 2);
        let (from, to) = (path[step], path[step + 1]);
        let count = self.stuck.entry((from, to)).or_default();
        *count += 1;
        if *count < MOST_STUCK {
            return;
        }
        match (from.min(to), from.max(to)) {
            (Node::Lies(place), Node::Held([hand, grasp])) => self.grips[place][hand][grasp].known = Known::Dead,
            _ => {
                if let (Node::Held(before), Node::Held(after)) = (from, to)
                    && let Some(changed) = self.changes.get_mut(&(before, after))
                {
                    changed.known = Known::Dead;
                }
                if let (Node::Held(giver), Node::Held(taker)) = (from, to)
                    && let Some(given) = self.gives.get_mut(&(giver, taker))
                {
                    given.known = Known::Dead;
                }
            }
        }
    }
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
                found.insert(([hand, before], [hand, after]), Changed { known: Known::New, cost });
            }
        }
    }
    found
}
