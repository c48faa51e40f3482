//! Answering queries (Sahbani 2007, sec. IV-D): start and goal are linked to the graph, the graph is searched, the path is
//! smoothed.

use crate::in_hand::attempt::search::{Context, Search, Stop};
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::recording::record::settings_of;
use crate::in_hand::refusals::given_grasp;
use crate::in_hand::regrasping::change::{Arrival, transfer_regrasp};
use crate::in_hand::roadmap::GraspRoadmap;
use crate::in_hand::roadmap::anchor::{Link, LinkKind, QueryEnd};
use crate::in_hand::roadmap::build::legs_of;
use crate::in_hand::roadmap::index::Index;
use crate::in_hand::roadmap::landmarks::{Bounds, Landmarks};
use crate::in_hand::roadmap::region::nearest_places;
use crate::in_hand::roadmap::registry::Registry;
use crate::in_hand::roadmap::route::Passing;
use crate::in_hand::roadmap::track::{TimedEdge, legs_of_pieces};
use crate::in_hand::searching::shorten::shorten;
use crate::settings::InHandSettings;
use regrasp_base::{Budget, InputError, Rng};
use regrasp_geometry::Pose;
use regrasp_manipulation::ends::blocked::{object_blocked_by, refuse_buried_object, refuse_object_out_of_reach};
use regrasp_manipulation::ends::end::End;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::forces::limits::Unbalanced;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::in_world::{failure_in_world, plan_in_world};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::recording::pieces::{Piece, dynamics, joined, plan_of_piece};
use regrasp_manipulation::recording::recorder::{Joins, Recorder};
use regrasp_manipulation::settings::SpeedSettings;
use regrasp_plan::Plan;
use regrasp_plan::plan::Statistics;
use regrasp_roadmap::AStar;
use regrasp_scene::{GraspRequest, HandView, InHandQuery};
use std::path::Path;
use std::sync::atomic::AtomicUsize;

/// Places nearest to each end whose grasps are tried: few at first, more where these lead nowhere.
const RINGS: [usize; 4] = [0, 1, 4, 24];
/// Places nearest to an end that a detour may lead to, where nothing else links it.
const DETOURS: usize = 16;
/// Configurations that a detour may cost: as many as hard single queries take.
const DETOUR_WORK: u64 = 50_000;
/// Anchors at each end from which A* chooses.
const ANCHORS: usize = 1;
/// A path costs at most so many times the cheapest one between the anchors (weighted A*, Pohl 1970).
const GREED: f64 = 2.5;

/// A roadmap opened for a scene.
#[derive(Debug)]
pub struct RoadmapPlanner<'a> {
    model: Model<'a>,
    settings: InHandSettings,
    /// True when forces and times of the graph are those of this scene and these settings.
    knows_dynamics: bool,
    roadmap: &'a GraspRoadmap,
    links: LinkKind,
}

/// Memory of queries, one after the other: saves time, changes nothing.
#[derive(Debug, Default)]
pub struct QueryMemory {
    a_star: AStar,
}

/// A plan, and what the roadmap can learn from it.
#[derive(Debug)]
pub struct RoadmapAnswer {
    /// The plan.
    pub plan: Plan,
    /// Links of start and goal to the graph.
    links: [Link; 2],
}

impl<'a> RoadmapPlanner<'a> {
    /// Opens a roadmap, which came from `path`, for a scene.
    ///
    /// Errors: it was built for another one (`R610` to `R614`), or its tables are not of the hand it names (`R606`).
    pub fn new(path: &Path, roadmap: &'a GraspRoadmap, view: &'a HandView<'a>) -> Result<Self, InputError> {
        roadmap.refuse_other_scene(path, view)?;
        Ok(Self::of_agreed(roadmap, view, &roadmap.about.settings.physics.speed))
    }

    /// Opens a roadmap for a scene that [`GraspRoadmap::refuse_other_scene`] did not refuse; motions have this speed.
    pub fn of_agreed(roadmap: &'a GraspRoadmap, view: &'a HandView<'a>, speed: &SpeedSettings) -> Self {
        let mut settings = roadmap.about.settings.clone();
        settings.physics.speed = *speed;
        let settings = settings.within(&view.limits);
        let model = Model::new(view, &settings.physics);
        let knows_dynamics = is_same(&roadmap.about.dynamics, &dynamics(&model));
        RoadmapPlanner { model, settings, knows_dynamics, roadmap, links: LinkKind::Shortest }
    }

    /// With transfers that follow each other with one grasp made one, where that is free: shorter motions, slower answers.
    #[must_use]
    pub fn smoothing(self) -> Self {
        RoadmapPlanner { links: LinkKind::Longest, ..self }
    }

    /// Settings of the planner that the roadmap's motions were proven with.
    pub fn settings(&self) -> &InHandSettings {
        &self.settings
    }

    /// A query from one pose of the roadmap's region to another, drawn uniformly by seed among those at which the object
    /// is clear of palm and obstacles; the planner chooses the grasps.
    pub fn random_query(&self, seed: u64) -> InHandQuery {
        let draw = |purpose: &str| {
            let mut rng = Rng::keyed(seed, purpose, 0);
            loop {
                let pose = self.roadmap.about.region.draw(&self.model.view.object.center_of_mass, &mut rng);
                if object_blocked_by(&self.model, &pose).is_none() {
                    return self.model.view.world_from(&pose);
                }
            }
        };
        InHandQuery {
            name: String::new(),
            hand: self.model.view.hand_index,
            object: self.model.view.object_index,
            world_from_object_start: draw("random_start"),
            world_from_object_way: Vec::new(),
            world_from_object_goal: draw("random_goal"),
            start_grasp: GraspRequest::Automatic,
            goal_grasp: GraspRequest::Automatic,
            open_start: None,
        }
    }

    /// Answers a query without way poses. The same query, seed and roadmap give the same plan.
    pub fn plan(
        &self,
        query: &InHandQuery,
        seed: u64,
        budget: &Budget,
        memory: &mut QueryMemory,
    ) -> Result<RoadmapAnswer, Failure> {
        let view = self.model.view;
        let seen = view.hand_from_world().map(|hand_from_world| query.seen_from(&hand_from_world));
        let found = self.plan_in_hand_frame(seen.as_ref().unwrap_or(query), seed, budget, memory);
        found
            .map(|answer| RoadmapAnswer { plan: plan_in_world(view, &query.name, answer.plan), ..answer })
            .map_err(|failure| failure_in_world(view, failure))
    }

    fn plan_in_hand_frame(
        &self,
        query: &InHandQuery,
        seed: u64,
        budget: &Budget,
        memory: &mut QueryMemory,
    ) -> Result<RoadmapAnswer, Failure> {
        let model = &self.model;
        let poses = [query.world_from_object_start, query.world_from_object_goal];
        refuse_way_poses(query)?;
        for (end, pose) in [(End::Start, &poses[0]), (End::Goal, &poses[1])] {
            refuse_buried_object(model, end, pose)?;
            refuse_object_out_of_reach(model, end, pose)?;
        }
        let mut rng = Rng::keyed(seed, "given_grasps", 0);
        let start_grasp = given_grasp(model, End::Start, &poses[0], &query.start_grasp, &mut rng)?;
        let goal_grasp = given_grasp(model, End::Goal, &poses[1], &query.goal_grasp, &mut rng)?;
        let winner = AtomicUsize::new(usize::MAX);
        let context = Context { model, settings: &self.settings, seed, budget, winner: &winner, progress: &|_| {} };
        let mut search = Search::new(context, poses, 0, budget.max_work);
        search.rng = Rng::keyed(seed, "roadmap_query", 0);
        let answer = self.answer(&mut search, query, seed, start_grasp, goal_grasp, memory);
        answer.unwrap_or_else(|stop| Err(self.stopped(&stop, &search)))
    }

    fn answer(
        &self,
        search: &mut Search,
        query: &InHandQuery,
        seed: u64,
        start_grasp: Option<GraspState>,
        goal_grasp: Option<GraspState>,
        memory: &mut QueryMemory,
    ) -> Result<Result<RoadmapAnswer, Failure>, Stop> {
        let (roadmap, landmarks) = (self.roadmap, &self.roadmap.landmarks);
        let mut start = QueryEnd::new(search.start, start_grasp);
        let mut goal = QueryEnd::new(search.goal, goal_grasp);
        let (mut n_expanded, mut seen) = (0, (false, false));
        for round in 0..RINGS.len() {
            if let Some(ring) = RINGS.windows(2).nth(round) {
                let around_start = self.places_around(&start.pose, ring[0]..ring[1]);
                let around_goal = self.places_around(&goal.pose, ring[0]..ring[1]);
                // Where the goal will be linked is not known yet: at one of the nodes around.
                let ends = around_goal.iter().flat_map(|&(distance, place)| {
                    roadmap.index.nodes_at(place).iter().map(move |&node| (node as usize, distance))
                });
                start.look_around(roadmap, &around_start, &landmarks.bounds(ends));
                start.fill(search, roadmap, ANCHORS)?;
                goal.look_around(roadmap, &around_goal, &self.bounds_to(&start));
            } else {
                for (end, which) in [(&mut start, 0), (&mut goal, 1)] {
                    if !self.is_linked(search, end)? {
                        self.detour(search, end, which)?;
                    }
                }
            }
            loop {
                start.fill(search, roadmap, ANCHORS)?;
                goal.fill(search, roadmap, ANCHORS)?;
                seen = (seen.0 || !start.anchors.is_empty(), seen.1 || !goal.anchors.is_empty());
                if start.anchors.is_empty() || goal.anchors.is_empty() {
                    break;
                }
                if self.model.any_rolls() {
                    let Some(first) = start.linked(search, roadmap)? else { continue };
                    let Some(last) = goal.linked(search, roadmap)? else { continue };
                    let path = self.route(&start, &goal, &mut memory.a_star);
                    n_expanded += memory.a_star.n_expanded();
                    let Some(path) = path else { break };
                    match self.rolled_plan(search, query, seed, [&first, &last], &path, n_expanded) {
                        Some(Ok(plan)) => return Ok(Ok(RoadmapAnswer { plan, links: [first, last] })),
                        // On from another grasp.
                        Some(Err(unbalanced)) => {
                            search.tally.add(Reason::NoForces(unbalanced));
                            start.give_up(first.node);
                            continue;
                        }
                        None => return Ok(Err(self.does_not_fit(search))),
                    }
                }
                let path = self.route(&start, &goal, &mut memory.a_star);
                n_expanded += memory.a_star.n_expanded();
                let Some(path) = path else { break };
                let Some(first) = start.prove(search, roadmap, path.iter().copied(), self.links) else {
                    continue;
                };
                let rest = path[first.n_skipped..].iter().rev().copied();
                let Some(last) = goal.prove(search, roadmap, rest, self.links) else {
                    continue;
                };
                let between = &path[first.n_skipped..path.len() - last.n_skipped];
                let Some(recorder) = self.motions(search, [&first, &last], between) else {
                    return Ok(Err(self.does_not_fit(search)));
                };
                let statistics =
                    Statistics { nodes: n_expanded as u64, work: search.workspace.work, ..Statistics::default() };
                let mut plan = match recorder.finish(query, seed, &[], statistics) {
                    Ok(plan) => plan,
                    Err(unbalanced) => {
                        // On from another grasp.
                        search.tally.add(Reason::NoForces(unbalanced));
                        start.anchors.retain(|other| other.node != path[0]);
                        continue;
                    }
                };
                (plan.method, plan.settings) = ("roadmap".into(), settings_of(&self.settings));
                return Ok(Ok(RoadmapAnswer { plan, links: [first, last] }));
            }
        }
        Ok(Err(match seen {
            (false, _) => self.not_linked(End::Start, search),
            (_, false) => self.not_linked(End::Goal, search),
            _ => self.failure("the roadmap does not lead from start to goal".into(), search),
        }))
    }

    /// True when an end has an anchor, where fingertips roll one with motions that have forces.
    fn is_linked(&self, search: &mut Search, end: &mut QueryEnd) -> Result<bool, Stop> {
        if self.model.any_rolls() {
            return Ok(end.linked(search, self.roadmap)?.is_some());
        }
        Ok(!end.anchors.is_empty())
    }

    /// Links an end by a search of its own.
    fn detour(&self, search: &mut Search, end: &mut QueryEnd, which: usize) -> Result<(), Stop> {
        for (index, (_, place)) in self.places_around(&end.pose, 0..DETOURS).into_iter().enumerate() {
            let Some(&node) = self.roadmap.index.nodes_at(place).first() else { continue };
            let mut own = search.for_detour(which * DETOURS + index, DETOUR_WORK.min(search.work_left()));
            let found = end.detour(&mut own, self.roadmap, node as usize);
            search.workspace.work += own.workspace.work;
            if found? && self.is_linked(search, end)? {
                break;
            }
        }
        Ok(())
    }

    /// The places with nodes that are `ring` in the order of their distance from a pose, with that distance.
    fn places_around(&self, pose: &Pose, ring: std::ops::Range<usize>) -> Vec<(f64, usize)> {
        let (graph, index) = (&self.roadmap.graph, &self.roadmap.index);
        let has_nodes = |place: usize| !index.nodes_at(place).is_empty();
        let mut nearest = nearest_places(&graph.places, pose, self.model.turn_length(), ring.end, has_nodes);
        nearest.drain(..ring.start.min(nearest.len()));
        nearest
    }

    /// Lower bounds of the cost of reaching one of the anchors of an end, and the end from there.
    fn bounds_to(&self, end: &QueryEnd) -> Bounds {
        self.roadmap.landmarks.bounds(end.anchors.iter().map(|anchor| (anchor.node, anchor.cost)))
    }

    /// A cheap way from an anchor of the start to one of the goal, as nodes.
    fn route(&self, start: &QueryEnd, goal: &QueryEnd, a_star: &mut AStar) -> Option<Vec<usize>> {
        let roadmap = self.roadmap;
        let (from, to) = (roadmap.graph.nodes.len(), roadmap.graph.nodes.len() + 1);
        let neighbours = |node: usize, out: &mut Vec<(usize, f64)>| {
            if node == from {
                out.extend(start.anchors.iter().map(|anchor| (anchor.node, anchor.cost)));
                return;
            }
            roadmap.index.neighbours(node, out);
            out.extend(goal.anchors.iter().filter(|anchor| anchor.node == node).map(|anchor| (to, anchor.cost)));
        };
        let bounds = self.bounds_to(goal);
        let bound = |node: usize| if node < from { GREED * roadmap.landmarks.bound(node, &bounds) } else { 0.0 };
        let path = a_star.cheapest_path(from, |node| node == to, neighbours, bound)?.nodes;
        Some(path[1..path.len() - 1].to_vec())
    }

    /// The plan of rolling motions along a path, with the forces and times that the graph has where those are of this scene and the
    /// motions stay as they are. None when what is stored does not fit together.
    fn rolled_plan(
        &self,
        search: &mut Search,
        query: &InHandQuery,
        seed: u64,
        [first, last]: [&Link; 2],
        path: &[usize],
        n_expanded: usize,
    ) -> Option<Result<Plan, Unbalanced>> {
        let graph = &self.roadmap.graph;
        let edges = path.windows(2).map(|pair| {
            let edge = self.roadmap.index.edge_between(pair[0], pair[1])?;
            TimedEdge::along(graph, edge, pair[0])
        });
        let statistics = |search: &Search| Statistics {
            nodes: n_expanded as u64,
            work: search.workspace.work,
            ..Statistics::default()
        };
        let plan = if self.knows_dynamics && self.links == LinkKind::Shortest {
            let mut pieces: Vec<Piece> = first.pieces.iter().rev().map(|piece| piece.clone().reversed()).collect();
            for edge in edges {
                pieces.push(edge?.piece(&self.model));
            }
            pieces.extend(last.pieces.iter().cloned());
            Ok(plan_of_piece(&self.model, query, seed, joined(&self.model, pieces), statistics(search)))
        } else {
            let mut way = first.way.reversed();
            for edge in edges {
                edge?.push_to(&self.model, &mut way);
            }
            way = way.then(last.way.clone())?;
            if self.links == LinkKind::Longest {
                let is_open = query.goal_grasp == GraspRequest::Automatic;
                shorten(search, &mut way, if is_open { Arrival::AnyPosture } else { Arrival::Exact });
            }
            let mut recorder = Recorder::at(&self.model, way.start(), Joins::TransfersInARow);
            recorder.sequence(&way);
            recorder.finish(query, seed, &[], statistics(search))
        };
        Some(plan.map(|plan| Plan { method: "roadmap".into(), settings: settings_of(&self.settings), ..plan }))
    }

    fn does_not_fit(&self, search: &Search) -> Failure {
        let message = "a stored transfer does not come out as it was proven: the roadmap is of another version of the program, \
                       or was made by hand";
        self.failure(message.into(), search)
    }

    /// All motions from the start to the goal along a path. None when what is stored does not fit together.
    fn motions(&self, search: &mut Search, [first, last]: [&Link; 2], path: &[usize]) -> Option<Recorder<'_, 'a>> {
        let graph = &self.roadmap.graph;
        let to_first = first.way.reversed();
        if *to_first.end() != graph.state(path[0]) || *last.way.start() != graph.state(path[path.len() - 1]) {
            return None;
        }
        let edges = path.windows(2).map(|pair| {
            let edge = self.roadmap.index.edge_between(pair[0], pair[1])?;
            Passing::along(&self.model, graph, edge, pair[0])
        });
        let mut recorder = Recorder::at(&self.model, to_first.start(), Joins::TransfersInARow);
        if self.links == LinkKind::Longest {
            let mut way = to_first;
            for edge in edges {
                edge?.push_to(&mut way);
            }
            way = way.then(last.way.clone())?;
            straighten(search, &mut way);
            recorder.sequence(&way);
        } else {
            recorder.sequence(&to_first);
            for edge in edges {
                edge?.record_to(&mut recorder);
            }
            recorder.sequence(&last.way);
        }
        Some(recorder)
    }

    fn not_linked(&self, end: End, search: &Search) -> Failure {
        let (name, pose) = match end {
            End::Start => ("start", &search.start),
            End::Way(_) | End::Goal => ("goal", &search.goal),
        };
        let center_of_mass = self.model.view.object.center_of_mass;
        let inside = self.roadmap.about.region.contains(pose, &center_of_mass, 1e-9);
        let place = if inside { "which is in its region" } else { "which is outside its region" };
        self.failure(format!("no grasp of the roadmap can be taken to the {name}, {place}"), search)
    }

    fn failure(&self, message: String, search: &Search) -> Failure {
        Failure {
            kind: FailureKind::NotConnected,
            message,
            advice: "build the roadmap with more places, or over a region that holds start and goal".into(),
            causes: search.whole_tally().causes(&self.model),
            leg: None,
            nearest_miss: None,
            robot_miss: None,
            reached: None,
            statistics: Statistics { work: search.workspace.work, ..Statistics::default() },
        }
    }

    fn stopped(&self, stop: &Stop, search: &Search) -> Failure {
        Failure { kind: stop.kind(), ..self.failure("the query was cut".into(), search) }
    }
}

/// True when forces and times that depend on `built` are those that `asked` gives; files keep numbers but for rounding.
fn is_same(built: &[f64], asked: &[f64]) -> bool {
    built.len() == asked.len() && built.iter().zip(asked).all(|(a, b)| (a - b).abs() <= 1e-12 * a.abs().max(b.abs()))
}

/// Transfers that follow each other with one grasp become one, where that is free.
fn straighten(search: &mut Search, way: &mut Sequence) {
    let mut first = 0;
    while first < way.steps().len() {
        let transfers = way.steps()[first..].iter().take_while(|step| matches!(step.motion(), Motion::Transfer(_)));
        let last = first + transfers.count().max(1) - 1;
        if last > first {
            let (from, to) = (way.state_before(first).clone(), way.steps()[last].end().clone());
            let mut rng = Rng::child(&search.rng, "straighten", first as u64);
            let straight = transfer_regrasp(search, &from, &to, Arrival::Exact, &mut rng);
            if let Some(straight) = straight.filter(|straight| straight.steps().len() <= 1) {
                let fits = way.replace(first..=last, straight);
                debug_assert!(fits, "the same ends");
            }
        }
        first = last + 1;
    }
}

impl GraspRoadmap {
    /// The roadmap with the ends of an answered query as new places, each linked by the motions found.
    #[must_use]
    pub fn grown_by(self, answer: &RoadmapAnswer) -> Self {
        let GraspRoadmap { mut about, graph, mut landmarks, .. } = self;
        let mut registry = Registry::new(graph);
        let before = (registry.graph().nodes.len(), registry.graph().edges.len());
        let fingers = registry.graph().footholds.clone();
        for link in answer.links.iter().filter(|link| link.can_be_kept) {
            let legs = if link.pieces.is_empty() {
                Some(legs_of(&link.way, |pose| registry.add_place(*pose)))
            } else {
                legs_of_pieces(&fingers, &link.way, &link.pieces, |_| None)
            };
            legs.and_then(|legs| registry.add_legs(link.node as u32, &legs));
        }
        about.n_grown += 1;
        let graph = registry.into_graph();
        let index = Index::new(&graph, about.costs);
        if graph.edges.len() - before.1 == graph.nodes.len() - before.0 {
            landmarks.extend(&graph, &index);
        } else {
            // What was added closes a ring: ways between old nodes may have become shorter.
            landmarks = Landmarks::choose(&graph, &index);
        }
        GraspRoadmap { about, graph, landmarks, index }
    }
}

/// A roadmap is asked leg by leg.
fn refuse_way_poses(query: &InHandQuery) -> Result<(), Failure> {
    if query.open_start.is_some() {
        let message =
            "the query leaves the start pose open; a roadmap answers queries from a pose that is given".to_owned();
        let advice = "give a start position, such as the one that regrasp place writes";
        return Err(Failure::bare(FailureKind::StartInvalid, message, advice));
    }
    let n_way_poses = query.world_from_object_way.len();
    if n_way_poses == 0 {
        return Ok(());
    }
    let message = format!("the query has {n_way_poses} way poses; a roadmap answers queries from one pose to another");
    let advice = "ask leg by leg, each from the grasp in which the one before ends, or use regrasp plan";
    Err(Failure::bare(FailureKind::WayInvalid, message, advice))
}
