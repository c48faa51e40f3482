//! Linking an object pose to the graph: grasps of nodes at places nearby, taken there by one transfer.

use super::super::candidates::{Way, follow_share};
use super::super::model::MAX_FINGERS;
use super::super::search::{Search, Stop};
use super::super::shorten::{change_grasp, whole_transfer};
use super::super::state::{GraspState, Step};
use super::GraspRoadmap;
use super::landmarks::Bounds;
use super::region::nearest_places;
use regrasp_base::Rng;
use regrasp_geometry::Pose;

/// One end of a query, with the nodes that are linked to it.
pub struct QueryEnd {
    /// Pose of the object.
    pub pose: Pose,
    /// The grasp given there.
    pub given: Option<GraspState>,
    /// Links found.
    pub links: Vec<Link>,
}

/// Proven motions between an end of a query and a node.
#[derive(Debug)]
pub struct Link {
    /// The node.
    pub node: usize,
    /// What they cost.
    pub cost: f64,
    /// From the node to the end's pose.
    pub transfer: Step,
    /// From the grasp given at the end to that of the transfer.
    pub changes: Vec<Step>,
}

/// A node that may be linked, and the least that a path through it costs.
struct Candidate {
    node: usize,
    place: usize,
    cost: f64,
    estimate: f64,
}

/// What is known of the footholds of one place: whether a finger alone could follow with it to the end's pose.
struct Place {
    way: Way,
    follows: [Vec<(u32, bool)>; MAX_FINGERS],
}

impl QueryEnd {
    /// An end without links.
    pub fn new(pose: Pose, given: Option<GraspState>) -> Self {
        QueryEnd { pose, given, links: Vec::new() }
    }

    /// Adds up to `n_wanted` links to nodes at the places that are `places` in the order of their distance, the most
    /// promising first by what `bounds` says of the way from there on.
    pub fn look_around(
        &mut self,
        search: &mut Search,
        roadmap: &GraspRoadmap,
        places: std::ops::Range<usize>,
        bounds: &Bounds,
        n_wanted: usize,
    ) -> Result<(), Stop> {
        let (mut near, mut candidates) = self.candidates(roadmap, places, bounds);
        let n_wanted = self.links.len() + n_wanted;
        // Stable: equal estimates stay in the order of places and nodes.
        candidates.sort_by(|a, b| a.estimate.total_cmp(&b.estimate));
        for candidate in &candidates {
            search.check()?;
            if self.links.len() >= n_wanted {
                break;
            }
            if may_follow(search, roadmap, candidate.node, &mut near[candidate.place])
                && let Some(link) = self.link(search, roadmap, candidate.node, candidate.cost)
            {
                self.links.push(link);
            }
        }
        Ok(())
    }

    fn candidates(
        &self,
        roadmap: &GraspRoadmap,
        places: std::ops::Range<usize>,
        bounds: &Bounds,
    ) -> (Vec<Place>, Vec<Candidate>) {
        let (graph, costs) = (&roadmap.graph, roadmap.about.costs);
        let has_nodes = |place: usize| !roadmap.index.nodes_at(place).is_empty();
        let nearest = nearest_places(&graph.places, &self.pose, costs.turn_length, places.end, has_nodes);
        let (mut near, mut candidates) = (Vec::new(), Vec::new());
        for &(distance, place) in nearest.iter().skip(places.start) {
            for &node in roadmap.index.nodes_at(place) {
                let node = node as usize;
                let mut cost = distance;
                if let Some(given) = &self.given {
                    let moves = |&finger: &usize| *graph.contact(node, finger) != given.contacts[finger];
                    cost += costs.relocation * (0..graph.n_fingers()).filter(moves).count() as f64;
                }
                let estimate = cost + roadmap.landmarks.bound(node, bounds);
                candidates.push(Candidate { node, place: near.len(), cost, estimate });
            }
            near.push(Place { way: Way::new(&graph.places[place], &self.pose), follows: Default::default() });
        }
        (near, candidates)
    }

    /// The motions between the end and a node, if they are feasible.
    pub fn link(&self, search: &mut Search, roadmap: &GraspRoadmap, node: usize, cost: f64) -> Option<Link> {
        let transfer = whole_transfer(search, &roadmap.graph.state(node), &self.pose)?;
        let changes = match &self.given {
            None => Vec::new(),
            Some(given) => {
                let mut rng = Rng::child(&search.rng, "given_grasp", 0);
                search.rng.bits();
                change_grasp(search, given, &transfer.end, false, &mut rng)?
            }
        };
        Some(Link { node, cost, transfer, changes })
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
        let (contact, joints) = (graph.contact(node, finger), graph.joints(node, finger));
        let follows = follow_share(&mut search.workspace, finger, contact, &joints, &place.way) >= 1.0;
        place.follows[finger].push((foothold, follows));
        follows
    })
}
