//! A graph that grows: what is added is looked up first, so that the same grasp is one node whichever way led to it.

use crate::in_hand::roadmap::graph::{Edge, FootholdIds, Graph, Leg, NOT_STORED, Node, Passage, Track};
use arrayvec::ArrayVec;
use regrasp_geometry::Pose;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints, MAX_FINGERS};
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A graph with what finds its parts again.
#[derive(Debug, Default)]
pub struct Registry {
    graph: Graph,
    contacts: BTreeMap<[u64; 6], u32>,
    footholds: BTreeMap<(u32, u32, u32), Vec<u32>>,
    nodes: BTreeMap<(u32, FootholdIds), u32>,
    edges: BTreeSet<(u32, u32)>,
    /// Ways added, as their range in [`Graph::ways`], by finger and the footholds that they join.
    ways: BTreeMap<[u32; 3], Vec<Range<usize>>>,
}

impl Registry {
    /// Of a graph that is there already.
    pub fn new(graph: Graph) -> Self {
        let mut registry = Registry::default();
        for (id, contact) in graph.contacts.iter().enumerate() {
            registry.contacts.insert(key_of(contact), id as u32);
        }
        for (id, node) in graph.nodes.iter().enumerate() {
            for finger in 0..graph.n_fingers() {
                let foothold = node.footholds[finger];
                let contact = graph.footholds[finger].contacts[foothold as usize];
                let known = registry.footholds.entry((node.place, finger as u32, contact)).or_default();
                if !known.contains(&foothold) {
                    known.push(foothold);
                }
            }
            registry.nodes.insert((node.place, node.footholds), id as u32);
        }
        registry.edges = graph.edges.iter().map(|edge| ordered(edge.from, edge.to)).collect();
        registry.graph = graph;
        registry
    }

    /// The graph.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// The graph, done growing.
    pub fn into_graph(self) -> Graph {
        self.graph
    }

    /// Adds a place.
    pub fn add_place(&mut self, world_from_object: Pose) -> u32 {
        self.graph.places.push(world_from_object);
        self.graph.places.len() as u32 - 1
    }

    /// The node of a grasp at `place`, which has its object pose.
    pub fn node_of(&mut self, place: u32, state: &GraspState) -> u32 {
        let mut footholds = [0; MAX_FINGERS];
        for finger in 0..self.graph.n_fingers() {
            let contact = self.contact_id(&state.contacts[finger]);
            footholds[finger] = self.foothold_id(place, finger, contact, &state.joints[finger]);
        }
        self.node_id(place, footholds)
    }

    /// Follows `legs` from a node, adding nodes and edges; the node at the end. None when the graph is full.
    pub fn add_legs(&mut self, from: u32, legs: &[Leg]) -> Option<u32> {
        let mut here = from;
        for leg in legs {
            here = match leg {
                Leg::Transfer { place, joints, between } => {
                    self.add_transfer(here, *place, joints, between.as_deref())?
                }
                Leg::Relocation { finger, path, contact } => self.add_relocation(here, *finger, path, contact)?,
                Leg::Timed { place, end, track } => self.add_timed(here, *place, end, track)?,
            };
        }
        Some(here)
    }

    fn add_transfer(
        &mut self,
        from: u32,
        place: u32,
        joints: &[Coordinates],
        between: Option<&[HandJoints]>,
    ) -> Option<u32> {
        let n_fingers = self.graph.n_fingers();
        let mut footholds = [0; MAX_FINGERS];
        for finger in 0..n_fingers {
            let contact = self.graph.contact_id(from as usize, finger);
            footholds[finger] = self.foothold_id(place, finger, contact, &joints[finger]);
        }
        let to = self.node_id(place, footholds);
        let stored = between.and_then(|moments| Some((moments, u16::try_from(moments.len()).ok()?)));
        let stored = stored.filter(|&(_, n)| n != NOT_STORED);
        let first = u32::try_from(self.graph.strands.len()).ok()?;
        let n_between = stored.map_or(NOT_STORED, |(_, n)| n);
        if !self.is_joined(from, to) {
            let mut strands = ArrayVec::<u32, MAX_FINGERS>::new();
            for finger in (0..n_fingers).take_while(|_| stored.is_some()) {
                let joins = [finger as u32, self.graph.nodes[from as usize].footholds[finger], footholds[finger]];
                let moments = stored.map_or(&[][..], |(moments, _)| moments);
                let numbers = moments.iter().flat_map(|joints| joints[finger].iter().map(|&q| q as f32));
                strands.push(self.way_id(joins, numbers.collect())?);
            }
            self.graph.strands.extend(strands);
            self.add_edge(Edge { from, to, passage: Passage::Transfer { first, n_between } });
        }
        Some(to)
    }

    fn add_timed(&mut self, from: u32, place: Option<u32>, end: &GraspState, track: &Track) -> Option<u32> {
        let place = match (track.finger, place) {
            (Some(_), _) => self.graph.nodes[from as usize].place,
            (None, Some(place)) => place,
            (None, None) => self.add_place(end.world_from_object),
        };
        let to = self.node_of(place, end);
        if !self.is_joined(from, to) {
            let first = u32::try_from(self.graph.tracks.len()).ok()?;
            let Track { finger, n_between, ref numbers } = *track;
            self.graph.tracks.extend_from_slice(numbers);
            self.add_edge(Edge { from, to, passage: Passage::Timed { finger, first, n_between } });
        }
        Some(to)
    }

    fn add_relocation(&mut self, from: u32, finger: usize, path: &[Coordinates], contact: &Contact) -> Option<u32> {
        let (last, between) = path.split_last()?;
        let n_between = u16::try_from(between.len()).ok()?;
        let mut node = self.graph.nodes[from as usize];
        let left = node.footholds[finger];
        let contact = self.contact_id(contact);
        node.footholds[finger] = self.foothold_id(node.place, finger, contact, last);
        let to = self.node_id(node.place, node.footholds);
        let joins = [finger as u32, left, node.footholds[finger]];
        if !self.is_joined(from, to) {
            let first = self.way_id(joins, between.iter().flatten().map(|&q| q as f32).collect())?;
            self.add_edge(Edge { from, to, passage: Passage::Relocation { finger: finger as u8, first, n_between } });
        }
        Some(to)
    }

    /// Index of the first number of a way in the table, which the same way of a finger has only once. None when the table
    /// is full.
    fn way_id(&mut self, joins: [u32; 3], numbers: Vec<f32>) -> Option<u32> {
        let table = &mut self.graph.ways;
        let known = self.ways.entry(joins).or_default();
        let at = match known.iter().find(|range| table[Range::clone(range)] == numbers[..]) {
            Some(range) => range.start,
            None => {
                known.push(table.len()..table.len() + numbers.len());
                table.extend_from_slice(&numbers);
                table.len() - numbers.len()
            }
        };
        u32::try_from(at).ok()
    }

    /// Adds an edge between nodes that are not joined.
    fn add_edge(&mut self, edge: Edge) {
        self.edges.insert(ordered(edge.from, edge.to));
        self.graph.edges.push(edge);
    }

    /// True when no edge is wanted between two nodes: there is one, or they are one.
    fn is_joined(&self, a: u32, b: u32) -> bool {
        a == b || self.edges.contains(&ordered(a, b))
    }

    fn contact_id(&mut self, contact: &Contact) -> u32 {
        let contacts = &mut self.graph.contacts;
        *self.contacts.entry(key_of(contact)).or_insert_with(|| {
            contacts.push(*contact);
            contacts.len() as u32 - 1
        })
    }

    fn foothold_id(&mut self, place: u32, finger: usize, contact: u32, joints: &[f64]) -> u32 {
        let table = &mut self.graph.footholds[finger];
        let known = self.footholds.entry((place, finger as u32, contact)).or_default();
        if let Some(id) = known.iter().copied().find(|&id| table.joints_of(id) == joints) {
            return id;
        }
        let id = table.contacts.len() as u32;
        table.contacts.push(contact);
        table.joints.extend_from_slice(joints);
        known.push(id);
        id
    }

    fn node_id(&mut self, place: u32, footholds: FootholdIds) -> u32 {
        let nodes = &mut self.graph.nodes;
        *self.nodes.entry((place, footholds)).or_insert_with(|| {
            nodes.push(Node { place, footholds });
            nodes.len() as u32 - 1
        })
    }
}

fn ordered(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn key_of(contact: &Contact) -> [u64; 6] {
    let (p, n) = (&contact.point_in_object, &contact.normal_in_object);
    [p.x, p.y, p.z, n.x, n.y, n.z].map(f64::to_bits)
}
