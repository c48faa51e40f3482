//! Linking an object pose to the graph: grasps of nodes at places nearby, taken there by one transfer.

use super::super::model::MAX_FINGERS;
use super::super::search::{Search, Stop};
use super::super::shorten::{Arrival, change_grasp, whole_transfer};
use super::super::state::{GraspState, Sequence};
use super::super::transfer::ik_settings;
use super::super::workspace::{TipMode, tip_target};
use super::GraspRoadmap;
use super::graph::contact_ids;
use super::landmarks::Bounds;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, UnitVector, interpolate_pose};
use regrasp_robot::kinematics::finger_ik::IkSettings;

/// One end of a query, with the nodes that may be linked to it.
pub struct QueryEnd {
    /// Pose of the object.
    pub pose: Pose,
    /// The grasp given there.
    pub given: Option<GraspState>,
    /// Nodes that every finger alone can follow from.
    pub anchors: Vec<Anchor>,
    /// Nodes not looked at yet, the most promising last.
    candidates: Vec<Candidate>,
    near: Vec<Place>,
}

/// A node that may be linked to an end.
#[derive(Debug, Clone, Copy)]
pub struct Anchor {
    /// The node.
    pub node: usize,
    /// What the link costs.
    pub cost: f64,
}

/// Proven motions between an end of a query and a node.
#[derive(Debug, Clone)]
pub struct Link {
    /// The node.
    pub node: usize,
    /// Nodes of the path that it skips, because they have the same grasp.
    pub n_skipped: usize,
    /// From the node to the end's pose.
    pub transfer: Sequence,
    /// At the end's pose, from the grasp given there to that of the transfer; no motion where any grasp will do.
    pub changes: Sequence,
}

/// A node, and the least that a path through it costs.
struct Candidate {
    anchor: Anchor,
    place: usize,
    estimate: f64,
}

/// What is known of the footholds of one place: whether a finger alone could follow with it to the end's pose.
struct Place {
    /// Some poses of the way from the place to the end.
    way: [Pose; LOOKS.len()],
    follows: [Vec<(u32, bool)>; MAX_FINGERS],
}

impl QueryEnd {
    /// An end without anchors.
    pub fn new(pose: Pose, given: Option<GraspState>) -> Self {
        QueryEnd { pose, given, anchors: Vec::new(), candidates: Vec::new(), near: Vec::new() }
    }

    /// Takes the nodes at some places, given with their distances, for candidates; `bounds` tell what the way from there on
    /// costs.
    pub fn look_around(&mut self, roadmap: &GraspRoadmap, places: &[(f64, usize)], bounds: &Bounds) {
        let (graph, costs) = (&roadmap.graph, roadmap.about.costs);
        for &(distance, place) in places {
            for &node in roadmap.index.nodes_at(place) {
                let node = node as usize;
                let mut cost = distance;
                if let Some(given) = &self.given {
                    let moves = |&finger: &usize| *graph.contact(node, finger) != given.contacts[finger];
                    cost += costs.relocation * (0..graph.n_fingers()).filter(moves).count() as f64;
                }
                let estimate = cost + roadmap.landmarks.bound(node, bounds);
                self.candidates.push(Candidate { anchor: Anchor { node, cost }, place: self.near.len(), estimate });
            }
            let way = LOOKS.map(|share| interpolate_pose(&graph.places[place], &self.pose, share));
            self.near.push(Place { way, follows: Default::default() });
        }
        let order =
            |a: &Candidate, b: &Candidate| b.estimate.total_cmp(&a.estimate).then(b.anchor.node.cmp(&a.anchor.node));
        self.candidates.sort_unstable_by(order);
    }

    /// Turns the most promising candidates into anchors until there are `n_wanted`, as far as there are.
    pub fn fill(&mut self, search: &mut Search, roadmap: &GraspRoadmap, n_wanted: usize) -> Result<(), Stop> {
        while self.anchors.len() < n_wanted {
            search.check()?;
            let Some(candidate) = self.candidates.pop() else { break };
            if may_follow(search, roadmap, candidate.anchor.node, &mut self.near[candidate.place]) {
                self.anchors.push(candidate.anchor);
            }
        }
        Ok(())
    }

    /// The motions between the end and `path`, which begins at one of the anchors: from the last of its first nodes that
    /// have one grasp, else from the anchor. None when neither is feasible; then the anchor is none any more.
    pub fn prove(
        &mut self,
        search: &mut Search,
        roadmap: &GraspRoadmap,
        path: impl Iterator<Item = usize> + Clone,
    ) -> Option<Link> {
        let anchor = path.clone().next()?;
        let grasp = contact_ids(&roadmap.graph, anchor);
        let alike = path.take_while(|&node| contact_ids(&roadmap.graph, node) == grasp);
        let (n_skipped, last) = alike.enumerate().last()?;
        let mut link = self.link(search, roadmap, last, n_skipped);
        if link.is_none() && n_skipped > 0 {
            link = self.link(search, roadmap, anchor, 0);
        }
        if link.is_none() {
            self.anchors.retain(|other| other.node != anchor);
        }
        link
    }

    fn link(&self, search: &mut Search, roadmap: &GraspRoadmap, node: usize, n_skipped: usize) -> Option<Link> {
        let transfer = whole_transfer(search, &roadmap.graph.state(node), &self.pose)?;
        let changes = match &self.given {
            None => Sequence::at(transfer.end().clone()),
            Some(given) => {
                let mut rng = Rng::child(&search.rng, "given_grasp", 0);
                search.rng.bits();
                change_grasp(search, &Sequence::at(given.clone()), transfer.end(), Arrival::Exact, &mut rng)?
            }
        };
        Some(Link { node, n_skipped, transfer, changes })
    }
}

/// True unless some finger alone cannot follow from the node to the end's pose.
fn may_follow(search: &mut Search, roadmap: &GraspRoadmap, node: usize, place: &mut Place) -> bool {
    let graph = &roadmap.graph;
    (0..graph.n_fingers()).all(|finger| {
        let foothold = graph.nodes[node].footholds[finger];
        if let Some(&(_, follows)) = place.follows[finger].iter().find(|(other, _)| *other == foothold) {
            return follows;
        }
        let follows = follows(search, roadmap, node, finger, &place.way);
        place.follows[finger].push((foothold, follows));
        follows
    })
}

/// True when a finger alone reaches its contact of a node, clear of object, palm and obstacles, at some moments of a way.
fn follows(search: &mut Search, roadmap: &GraspRoadmap, node: usize, finger: usize, way: &[Pose]) -> bool {
    let model = search.model();
    let contact = roadmap.graph.contact(node, finger);
    let mut seed = roadmap.graph.joints(node, finger);
    way.iter().all(|pose| {
        let world_from_object = Placement::from(pose);
        let normal = world_from_object.vector(&contact.normal_in_object);
        let target = tip_target(&world_from_object, contact, model.fingers[finger].tip_radius);
        // Moments are far apart; reach is asked about, not continuity.
        let settings = ik_settings(model, finger, UnitVector::new_unchecked(normal));
        let settings = IkSettings { max_step: FARTHEST, ..settings };
        let Some(joints) = model.fingers[finger].ik.solve_near(&target, &seed, &settings) else { return false };
        search.workspace.place_object_and_finger(pose, finger, &joints);
        seed = joints;
        search.workspace.finger_alone_is_clear(finger, TipMode::Near { finger, normal_in_world: normal })
    })
}

/// Shares of a way at which single fingers are looked at: the end first, where most of those fail that fail.
const LOOKS: [f64; 2] = [1.0, 0.5];
/// Largest change of a joint between them.
const FARTHEST: f64 = 1.5;
