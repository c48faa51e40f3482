//! Answering queries (paper 004, section IV-D): start and goal are linked to the graph, the graph is searched, the path is
//! smoothed.

use super::super::endpoints::{End, given_grasp, object_blocked_by, refuse_buried_object};
use super::super::link::reversed;
use super::super::model::Model;
use super::super::record;
use super::super::search::{Search, Stop};
use super::super::settings::InHandSettings;
use super::super::shorten::transfer_regrasp;
use super::super::state::{GraspState, Motion, Step};
use super::GraspRoadmap;
use super::anchor::{Link, QueryEnd};
use super::build::legs_of;
use super::landmarks::Bounds;
use super::region::nearest_places;
use super::registry::Registry;
use super::route::motion_along;
use crate::failure::{Failure, FailureKind};
use regrasp_base::{Budget, InputError, Rng};
use regrasp_geometry::Pose;
use regrasp_plan::Plan;
use regrasp_plan::plan::Statistics;
use regrasp_roadmap::AStar;
use regrasp_scene::{GraspRequest, InHandQuery, Scene};
use std::path::Path;
use std::sync::atomic::AtomicUsize;

/// Places nearest to each end whose grasps are tried: few at first, more where these lead nowhere.
const PLACES: [usize; 4] = [0, 3, 8, 24];
/// Links that are looked for at each end, from which A* chooses.
const LINKS: usize = 2;

/// A roadmap opened for a scene.
#[derive(Debug)]
pub struct RoadmapPlanner<'a> {
    model: Model<'a>,
    roadmap: &'a GraspRoadmap,
}

/// Memory of queries, one after the other: saves time, changes nothing.
#[derive(Debug, Default)]
pub struct QueryMemory {
    a_star: AStar,
}

/// A plan, and what the roadmap can learn from it.
#[derive(Debug)]
pub struct Answer {
    /// The plan.
    pub plan: Plan,
    /// Links that were found at start and goal.
    links: [Vec<Link>; 2],
}

impl<'a> RoadmapPlanner<'a> {
    /// Opens a roadmap, which came from `path`, for a scene.
    ///
    /// Errors: it was built for another one (`R610` to `R613`).
    pub fn new(path: &Path, roadmap: &'a GraspRoadmap, scene: &'a Scene) -> Result<Self, InputError> {
        roadmap.refuse_other_scene(path, scene)?;
        Ok(RoadmapPlanner { model: Model::new(scene, &roadmap.about.settings), roadmap })
    }

    /// Settings of the planner that the roadmap's motions were proven with.
    pub fn settings(&self) -> &InHandSettings {
        &self.model.settings
    }

    /// A query from one pose of the roadmap's region to another, drawn uniformly by seed among those at which the object
    /// is clear of palm and obstacles; the planner chooses the grasps.
    pub fn random_query(&self, seed: u64) -> InHandQuery {
        let draw = |purpose: &str| {
            let mut rng = Rng::keyed(seed, purpose, 0);
            loop {
                let pose = self.roadmap.about.region.draw(&self.model.scene.object.center_of_mass, &mut rng);
                if object_blocked_by(&self.model, &pose).is_none() {
                    return pose;
                }
            }
        };
        InHandQuery {
            world_from_object_start: draw("random_start"),
            world_from_object_goal: draw("random_goal"),
            start_grasp: GraspRequest::Automatic,
            goal_grasp: GraspRequest::Automatic,
        }
    }

    /// Answers a query. The same query, seed and roadmap give the same plan.
    pub fn plan(
        &self,
        query: &InHandQuery,
        seed: u64,
        budget: &Budget,
        memory: &mut QueryMemory,
    ) -> Result<Answer, Failure> {
        let model = &self.model;
        let poses = (query.world_from_object_start, query.world_from_object_goal);
        refuse_buried_object(model, End::Start, &poses.0)?;
        refuse_buried_object(model, End::Goal, &poses.1)?;
        let mut rng = Rng::keyed(seed, "given_grasps", 0);
        let start_grasp = given_grasp(model, End::Start, &poses.0, &query.start_grasp, &mut rng)?;
        let goal_grasp = given_grasp(model, End::Goal, &poses.1, &query.goal_grasp, &mut rng)?;
        let winner = AtomicUsize::new(usize::MAX);
        let mut search = Search::new(model, poses, (seed, 0), (budget, budget.max_work), &winner, &|_| {});
        search.rng = Rng::keyed(seed, "roadmap_query", 0);
        let answer = self.answer(&mut search, query, seed, (start_grasp, goal_grasp), memory);
        answer.unwrap_or_else(|stop| Err(self.stopped(&stop, &search)))
    }

    fn answer(
        &self,
        search: &mut Search,
        query: &InHandQuery,
        seed: u64,
        (start_grasp, goal_grasp): (Option<GraspState>, Option<GraspState>),
        memory: &mut QueryMemory,
    ) -> Result<Result<Answer, Failure>, Stop> {
        let mut start = QueryEnd::new(search.start, start_grasp);
        let mut goal = QueryEnd::new(search.goal, goal_grasp);
        let mut n_expanded = 0;
        for places in PLACES.windows(2) {
            let places = places[0]..places[1];
            // Where the goal will be linked is not known yet: at one of the nodes around.
            let around = self.nodes_around(&goal.pose, places.clone());
            let bounds = self.roadmap.landmarks.bounds(around.into_iter());
            start.look_around(search, self.roadmap, places.clone(), &bounds, LINKS)?;
            let bounds = self.bounds_to(&start);
            goal.look_around(search, self.roadmap, places, &bounds, LINKS)?;
            if start.links.is_empty() || goal.links.is_empty() {
                continue;
            }
            let path = self.route(&start, &goal, &mut memory.a_star);
            n_expanded += memory.a_star.n_expanded();
            let Some(path) = path else { continue };
            let Some((begin, mut steps)) = self.motions(&start, &goal, &path) else {
                let message = "a stored transfer does not come out as it was proven: the roadmap is of another version \
                               of the program, or was made by hand";
                return Ok(Err(self.failure(message.into(), search)));
            };
            straighten(search, &begin, &mut steps);
            let statistics =
                Statistics { nodes: n_expanded as u64, work: search.workspace.work, ..Statistics::default() };
            let mut plan = record::record(&self.model, query, seed, &begin, &steps, statistics);
            plan.method = "roadmap".into();
            return Ok(Ok(Answer { plan, links: [start.links, goal.links] }));
        }
        Ok(Err(if start.links.is_empty() {
            self.not_linked(End::Start, search)
        } else if goal.links.is_empty() {
            self.not_linked(End::Goal, search)
        } else {
            self.failure("the roadmap does not lead from start to goal".into(), search)
        }))
    }

    /// Nodes at the places that are `places` in the order of their distance from a pose, with that distance.
    fn nodes_around(&self, pose: &Pose, places: std::ops::Range<usize>) -> Vec<(usize, f64)> {
        let (graph, index) = (&self.roadmap.graph, &self.roadmap.index);
        let has_nodes = |place: usize| !index.nodes_at(place).is_empty();
        let nearest = nearest_places(&graph.places, pose, self.model.turn_length(), places.end, has_nodes);
        let at = |&(distance, place): &(f64, usize)| {
            index.nodes_at(place).iter().map(move |&node| (node as usize, distance)).collect::<Vec<_>>()
        };
        nearest.iter().skip(places.start).flat_map(at).collect()
    }

    /// Lower bounds of the cost of reaching one of the links of an end, and the end by it.
    fn bounds_to(&self, end: &QueryEnd) -> Bounds {
        self.roadmap.landmarks.bounds(end.links.iter().map(|link| (link.node, link.cost)))
    }

    /// The cheapest way from a link of the start to one of the goal, as nodes.
    fn route(&self, start: &QueryEnd, goal: &QueryEnd, a_star: &mut AStar) -> Option<Vec<usize>> {
        let roadmap = self.roadmap;
        let (from, to) = (roadmap.graph.nodes.len(), roadmap.graph.nodes.len() + 1);
        let neighbours = |node: usize, out: &mut Vec<(usize, f64)>| {
            if node == from {
                out.extend(start.links.iter().map(|link| (link.node, link.cost)));
                return;
            }
            roadmap.index.neighbours(node, out);
            out.extend(goal.links.iter().filter(|link| link.node == node).map(|link| (to, link.cost)));
        };
        let bounds = self.bounds_to(goal);
        let bound = |node: usize| if node < from { roadmap.landmarks.bound(node, &bounds) } else { 0.0 };
        let path = a_star.cheapest_path(from, |node| node == to, neighbours, bound)?.nodes;
        Some(path[1..path.len() - 1].to_vec())
    }

    /// All motions from the start to the goal along a path, with the grasp to begin with.
    fn motions(&self, start: &QueryEnd, goal: &QueryEnd, path: &[usize]) -> Option<(GraspState, Vec<Step>)> {
        let graph = &self.roadmap.graph;
        let cheapest = |end: &'_ QueryEnd, node: usize| {
            let at_node = (0..end.links.len()).filter(|&which| end.links[which].node == node);
            at_node.min_by(|&a, &b| end.links[a].cost.total_cmp(&end.links[b].cost))
        };
        let first = &start.links[cheapest(start, *path.first()?)?];
        let last = &goal.links[cheapest(goal, *path.last()?)?];
        let begin = start.given.clone().unwrap_or_else(|| first.transfer.end.clone());
        let mut steps = first.changes.clone();
        steps.extend(reversed(&graph.state(first.node), std::slice::from_ref(&first.transfer)));
        for pair in path.windows(2) {
            let edge = self.roadmap.index.edge_between(pair[0], pair[1])?;
            steps.push(motion_along(&self.model, self.roadmap, edge, pair[0])?);
        }
        steps.push(last.transfer.clone());
        if let Some(given) = &goal.given {
            steps.extend(reversed(given, &last.changes));
        }
        Some((begin, steps))
    }

    fn not_linked(&self, end: End, search: &Search) -> Failure {
        let (name, pose) = match end {
            End::Start => ("start", &search.start),
            End::Goal => ("goal", &search.goal),
        };
        let center_of_mass = self.model.scene.object.center_of_mass;
        let inside = self.roadmap.about.region.contains(pose, &center_of_mass, 1e-9);
        let place = if inside { "which is in its region" } else { "which is outside its region" };
        self.failure(format!("no grasp of the roadmap can be taken to the {name}, {place}"), search)
    }

    fn failure(&self, message: String, search: &Search) -> Failure {
        Failure {
            kind: FailureKind::NotConnected,
            message,
            advice: "build the roadmap with more places, or over a region that holds start and goal".into(),
            causes: search.tally.causes(&self.model),
            nearest_miss: None,
            statistics: Statistics { work: search.workspace.work, ..Statistics::default() },
        }
    }

    fn stopped(&self, stop: &Stop, search: &Search) -> Failure {
        let kind = match stop {
            Stop::Budget(interrupt) => (*interrupt).into(),
            Stop::Restart | Stop::Overtaken => FailureKind::WorkSpent,
        };
        Failure { kind, ..self.failure("the query was cut".into(), search) }
    }
}

/// Transfers that follow each other with one grasp become one, where that is free.
fn straighten(search: &mut Search, start: &GraspState, steps: &mut Vec<Step>) {
    let is_transfer = |step: &Step| matches!(step.motion, Motion::Transfer(_));
    let mut first = 0;
    while first < steps.len() {
        let n = steps[first..].iter().take_while(|step| is_transfer(step)).count();
        if n >= 2 {
            let from = if first == 0 { start.clone() } else { steps[first - 1].end.clone() };
            let to = steps[first + n - 1].end.clone();
            let mut rng = Rng::child(&search.rng, "straighten", first as u64);
            if let Some(straight) = transfer_regrasp(search, &from, &to, false, &mut rng)
                && straight.len() == 1
            {
                steps.splice(first..first + n, straight);
            }
        }
        first += n.max(1);
    }
}

impl GraspRoadmap {
    /// The roadmap with the ends of an answered query as new places.
    #[must_use]
    pub fn grown_by(self, answer: &Answer) -> Self {
        let mut about = self.about;
        let mut registry = Registry::new(self.graph);
        for links in &answer.links {
            let Some(first) = links.first() else { continue };
            let place = registry.add_place(first.transfer.end.world_from_object);
            for link in links {
                registry.add_legs(link.node as u32, &legs_of(std::slice::from_ref(&link.transfer), Some(place)));
            }
        }
        about.n_grown += 1;
        GraspRoadmap::new(about, registry.into_graph())
    }
}
