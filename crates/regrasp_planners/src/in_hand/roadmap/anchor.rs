//! Linking an object pose to the graph: grasps of nodes at places nearby, taken there by one transfer; where none follows,
//! by a detour of transfers and relocations.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::regrasping::change::{Arrival, change_grasp, whole_transfer};
use crate::in_hand::roadmap::GraspRoadmap;
use crate::in_hand::roadmap::graph::contact_ids;
use crate::in_hand::roadmap::landmarks::Bounds;
use crate::in_hand::roadmap::route::same_posture;
use crate::in_hand::roadmap::track::pieces_of;
use crate::in_hand::searching::gait;
use crate::in_hand::searching::shorten::shorten;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, UnitVector, interpolate_pose};
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::grasp::state::{GraspState, MAX_FINGERS};
use regrasp_manipulation::recording::pieces::Piece;
use regrasp_manipulation::rolling::follow::ik_settings;
use regrasp_manipulation::workspace::TipMode;
use regrasp_roadmap::{OpenList, Rank};
use regrasp_robot::kinematics::finger_ik::IkSettings;

/// One end of a query, with the nodes that may be linked to it.
pub struct QueryEnd {
    /// Pose of the object.
    pub pose: Pose,
    /// The grasp given there.
    pub given: Option<GraspState>,
    /// Nodes that every finger alone can follow from.
    pub anchors: Vec<Anchor>,
    /// Nodes not looked at yet: by the least that a path through them costs, then the smallest.
    candidates: OpenList<Candidate>,
    near: Vec<Place>,
    /// A proven link to one of the anchors.
    known: Option<Link>,
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
    /// From the node to the end's pose, and there into the grasp given, if one is.
    pub way: Sequence,
    /// The same with forces and times, motion by motion; where fingertips roll, and empty before they are asked for.
    pub pieces: Vec<Piece>,
    /// True when every transfer of the way comes out again from its two ends, so that a graph of contacts that stay can keep it.
    pub can_be_kept: bool,
}

/// A node that may become an anchor.
struct Candidate {
    anchor: Anchor,
    place: usize,
}

/// What is known of the footholds of one place: whether a finger alone could follow with it to the end's pose.
struct Place {
    /// Some poses of the way from the place to the end.
    way: [Pose; LOOKS.len()],
    follows: [Vec<(u32, bool)>; MAX_FINGERS],
}

/// How far along a path its link to an end goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkKind {
    /// To its first node.
    Shortest,
    /// As far as one grasp goes, which makes one transfer of several.
    Longest,
}

impl QueryEnd {
    /// An end without anchors.
    pub fn new(pose: Pose, given: Option<GraspState>) -> Self {
        QueryEnd { pose, given, anchors: Vec::new(), candidates: OpenList::new(), near: Vec::new(), known: None }
    }

    /// Takes the nodes at some places, given with their distances, for candidates; `bounds` tell what the way from there on
    /// costs.
    pub fn look_around(&mut self, roadmap: &GraspRoadmap, places: &[(f64, usize)], bounds: &Bounds) {
        let (graph, costs) = (&roadmap.graph, roadmap.about.costs);
        let mut candidates = Vec::new();
        for &(distance, place) in places {
            for &node in roadmap.index.nodes_at(place) {
                let node = node as usize;
                let mut cost = distance;
                if let Some(given) = &self.given {
                    let moves = |&finger: &usize| *graph.contact(node, finger) != given.contacts[finger];
                    cost += costs.relocation * (0..graph.n_fingers()).filter(moves).count() as f64;
                }
                let estimate = cost + roadmap.landmarks.bound(node, bounds);
                let candidate = Candidate { anchor: Anchor { node, cost }, place: self.near.len() };
                candidates.push((Rank::of(estimate, node), candidate));
            }
            let way = LOOKS.map(|share| interpolate_pose(&graph.places[place], &self.pose, share));
            self.near.push(Place { way, follows: Default::default() });
        }
        self.candidates.extend(candidates);
    }

    /// Turns the most promising candidates into anchors until there are `n_wanted`, as far as there are.
    pub fn fill(&mut self, search: &mut Search, roadmap: &GraspRoadmap, n_wanted: usize) -> Result<(), Stop> {
        while self.anchors.len() < n_wanted {
            search.check()?;
            let Some((_, candidate)) = self.candidates.pop() else { break };
            if may_follow(search, roadmap, candidate.anchor.node, &mut self.near[candidate.place]) {
                self.anchors.push(candidate.anchor);
            }
        }
        Ok(())
    }

    /// The motions between the end and `path`, which begins at one of the anchors. None when they are not feasible; then the
    /// anchor is none any more. A longest one begins at the last of the first nodes that have one grasp, if that is feasible.
    pub fn prove(
        &mut self,
        search: &mut Search,
        roadmap: &GraspRoadmap,
        path: impl Iterator<Item = usize> + Clone,
        kind: LinkKind,
    ) -> Option<Link> {
        let anchor = path.clone().next()?;
        if let Some(known) = self.known.as_ref().filter(|known| known.node == anchor) {
            return Some(known.clone());
        }
        let link = if kind == LinkKind::Longest { self.longest_link(search, roadmap, path) } else { None };
        let link = link.or_else(|| self.link(search, roadmap, anchor, 0));
        if link.is_none() {
            self.anchors.retain(|other| other.node != anchor);
        }
        link
    }

    /// The motions between the end and its first anchor that has any, with forces and times where fingertips roll. Anchors that
    /// have none are given up, and others taken for them as long as there are any.
    pub fn linked(&mut self, search: &mut Search, roadmap: &GraspRoadmap) -> Result<Option<Link>, Stop> {
        loop {
            self.fill(search, roadmap, 1)?;
            let Some(anchor) = self.anchors.first().map(|anchor| anchor.node) else { return Ok(None) };
            let Some(link) = self.prove(search, roadmap, std::iter::once(anchor), LinkKind::Shortest) else { continue };
            if !link.pieces.is_empty() {
                return Ok(Some(link));
            }
            match pieces_of(search.model(), &link.way) {
                Ok(pieces) => {
                    let link = Link { pieces, ..link };
                    self.known = Some(link.clone());
                    return Ok(Some(link));
                }
                Err(unbalanced) => {
                    search.tally.add(Reason::NoForces(unbalanced));
                    self.give_up(anchor);
                }
            }
        }
    }

    /// Takes a node for no anchor any more.
    pub fn give_up(&mut self, node: usize) {
        self.anchors.retain(|anchor| anchor.node != node);
        self.known = self.known.take().filter(|known| known.node != node);
    }

    /// From the last of the first nodes of `path` that have one grasp, where that is not the first.
    fn longest_link(
        &self,
        search: &mut Search,
        roadmap: &GraspRoadmap,
        path: impl Iterator<Item = usize> + Clone,
    ) -> Option<Link> {
        let anchor = path.clone().next()?;
        let grasp = contact_ids(&roadmap.graph, anchor);
        let alike = path.take_while(|&node| contact_ids(&roadmap.graph, node) == grasp);
        let (n_skipped, last) = alike.enumerate().last()?;
        if n_skipped > 0 { self.link(search, roadmap, last, n_skipped) } else { None }
    }

    /// Looks for a way to a node as one looks for a plan; the node becomes an anchor. False when there is none within the
    /// search's share of work.
    pub fn detour(&mut self, search: &mut Search, roadmap: &GraspRoadmap, node: usize) -> Result<bool, Stop> {
        let there = roadmap.graph.state(node);
        search.begin_leg(0, self.pose, there.world_from_object);
        let mut way = match gait::grow(search, self.given.clone(), Some(&there)) {
            Err(Stop::Restart) => return Ok(false),
            found => found?,
        };
        shorten(search, &mut way, Arrival::Exact);
        let way = way.reversed();
        let can_be_kept = search.model().any_rolls() || comes_out_again(search, &way);
        self.anchors.push(Anchor { node, cost: 0.0 });
        self.known = Some(Link { node, n_skipped: 0, way, pieces: Vec::new(), can_be_kept });
        Ok(true)
    }

    fn link(&self, search: &mut Search, roadmap: &GraspRoadmap, node: usize, n_skipped: usize) -> Option<Link> {
        let transfer = whole_transfer(search, &roadmap.graph.state(node), &self.pose)?;
        let way = match &self.given {
            None => transfer,
            Some(given) => {
                let mut rng = Rng::child(&search.rng, "given_grasp", 0);
                search.rng.bits();
                let given = Sequence::at(given.clone());
                let changes = change_grasp(search, &given, transfer.end(), Arrival::Exact, &mut rng)?;
                transfer.then(changes.reversed())?
            }
        };
        Some(Link { node, n_skipped, way, pieces: Vec::new(), can_be_kept: true })
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
        // Moments are far apart; reach is asked about, not continuity.
        let settings = ik_settings(model, finger, UnitVector::new_unchecked(normal));
        let settings = IkSettings { max_step: FARTHEST, ..settings };
        let Some(joints) = model.fingers[finger].touch_near(&world_from_object, contact, &seed, &settings) else {
            return false;
        };
        search.workspace.place_object_and_finger(pose, finger, &joints);
        seed = joints;
        search.workspace.finger_alone_is_clear(finger, TipMode::Near { finger, normal_in_world: normal })
    })
}

/// True when each transfer of `way` is a straight one, proven again from its two ends.
fn comes_out_again(search: &mut Search, way: &Sequence) -> bool {
    (0..way.steps().len()).all(|index| {
        let step = &way.steps()[index];
        if !matches!(step.motion(), Motion::Transfer(_)) {
            return true;
        }
        let again = whole_transfer(search, way.state_before(index), &step.end().world_from_object);
        again.is_some_and(|again| same_posture(&again.end().joints, &step.end().joints))
    })
}

/// Shares of a way at which single fingers are looked at: at the end most of those fail that fail.
const LOOKS: [f64; 1] = [1.0];
/// Largest change of a joint between them.
const FARTHEST: f64 = 1.5;
