//! The graph of grasps and proven motions, as numbers in flat tables.
//!
//! A node is a grasp: a place (object pose) and a foothold (contact and joints) of every finger. An edge is a transfer
//! (other place) or the relocation of one finger (same place); both can be gone both ways.
//!
//! Where contacts stay where they are, both store their joints between the ends; the object's poses follow from the ends. Where
//! fingertips roll, contacts travel in a transfer, so that its ends are different grasps. Such graphs store motions with contacts, contact forces
//! and times, see [`super::track`].

use arrayvec::ArrayVec;
use regrasp_geometry::Pose;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::{Contacts, GraspState, HandJoints, MAX_FINGERS};
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::collections::BTreeMap;

/// Footholds of all fingers, as indices into the tables of each; unused ones are zero.
pub type FootholdIds = [u32; MAX_FINGERS];

/// A grasp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node {
    /// Index of its place.
    pub place: u32,
    /// Foothold of every finger.
    pub footholds: FootholdIds,
}

/// How an edge is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Passage {
    /// All fingers hold, the object moves from the first node's place to the second's.
    Transfer {
        /// Index of the first of its numbers, one per finger, in [`Graph::strands`].
        first: u32,
        /// Moments between its ends, at equal shares of the way; [`NOT_STORED`] where they are to be stepped again.
        n_between: u16,
    },
    /// One finger moves.
    Relocation {
        /// The finger.
        finger: u8,
        /// Index of the first number of its way in [`Graph::ways`].
        first: u32,
        /// Joint vectors of its way, those at both ends left out.
        n_between: u16,
    },
    /// A motion with contacts, forces and times.
    Timed {
        /// The finger that moves; None where all hold and the object moves.
        finger: Option<u8>,
        /// Index of the first of its numbers in [`Graph::tracks`].
        first: u32,
        /// Waypoints between its ends.
        n_between: u16,
    },
}

impl Passage {
    /// True when the object moves.
    pub fn is_transfer(&self) -> bool {
        matches!(self, Passage::Transfer { .. } | Passage::Timed { finger: None, .. })
    }
}

/// In place of a number of moments: they are not at equal shares of the way, and not stored.
pub const NOT_STORED: u16 = u16::MAX;

/// A proven motion between two nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Node that it was proven from.
    pub from: u32,
    /// Node that it leads to.
    pub to: u32,
    /// How.
    pub passage: Passage,
}

/// Footholds of one finger: contacts that it takes at some place, with its joints there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Footholds {
    /// Number of joints of the finger.
    pub n_coordinates: usize,
    /// Indices into [`Graph::contacts`].
    pub contacts: Vec<u32>,
    /// Joints, `n_coordinates` per foothold.
    pub joints: Vec<f64>,
}

impl Footholds {
    /// Joints of foothold `id`.
    pub fn joints_of(&self, id: u32) -> &[f64] {
        let first = id as usize * self.n_coordinates;
        &self.joints[first..first + self.n_coordinates]
    }
}

/// The tables.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Graph {
    /// Object poses.
    pub places: Vec<Pose>,
    /// Contacts, in the object frame, that footholds share.
    pub contacts: Vec<Contact>,
    /// Footholds, finger by finger.
    pub footholds: Vec<Footholds>,
    /// Grasps.
    pub nodes: Vec<Node>,
    /// Motions.
    pub edges: Vec<Edge>,
    /// For each transfer the index of the first number of every finger's way in [`Graph::ways`].
    pub strands: Vec<u32>,
    /// Numbers of motions with forces and times, one motion after the other.
    pub tracks: Vec<f64>,
    /// Joints of single fingers between the ends of motions, in single precision: the rounding moves a fingertip by some
    /// ten nanometres, far below every clearance. Motions in which a finger does the same share its way.
    pub ways: Vec<f32>,
}

impl Graph {
    /// An empty graph for fingers with these numbers of joints.
    pub fn new(n_coordinates: impl IntoIterator<Item = usize>) -> Self {
        let footholds =
            n_coordinates.into_iter().map(|n| Footholds { n_coordinates: n, ..Footholds::default() }).collect();
        Graph { footholds, ..Graph::default() }
    }

    /// Number of fingers.
    pub fn n_fingers(&self) -> usize {
        self.footholds.len()
    }

    /// The pose of a node's place.
    pub fn pose(&self, node: usize) -> &Pose {
        &self.places[self.nodes[node].place as usize]
    }

    /// Joints of one finger at a node.
    pub fn joints(&self, node: usize, finger: usize) -> Coordinates {
        self.joints_of(node, finger).iter().copied().collect()
    }

    /// Joints of one finger at a node, in place.
    pub fn joints_of(&self, node: usize, finger: usize) -> &[f64] {
        self.footholds[finger].joints_of(self.nodes[node].footholds[finger])
    }

    /// Contact of one finger at a node.
    pub fn contact(&self, node: usize, finger: usize) -> &Contact {
        &self.contacts[self.contact_id(node, finger) as usize]
    }

    /// Index of the contact of one finger at a node.
    pub fn contact_id(&self, node: usize, finger: usize) -> u32 {
        self.footholds[finger].contacts[self.nodes[node].footholds[finger] as usize]
    }

    /// The grasp that a node stands for.
    pub fn state(&self, node: usize) -> GraspState {
        let contacts: Contacts = (0..self.n_fingers()).map(|finger| *self.contact(node, finger)).collect();
        GraspState::held_by_all(*self.pose(node), contacts, self.hand_joints(node))
    }

    /// Joints of all fingers at a node.
    pub fn hand_joints(&self, node: usize) -> HandJoints {
        (0..self.n_fingers()).map(|finger| self.joints(node, finger)).collect()
    }

    /// Joints of all fingers in a transfer between its ends, in the order it was proven.
    pub fn strands_of(&self, first: u32, n_between: u16) -> ArrayVec<&[f32], MAX_FINGERS> {
        let firsts = &self.strands[first as usize..first as usize + self.n_fingers()];
        firsts.iter().enumerate().map(|(finger, &first)| self.numbers_of(finger, first, n_between)).collect()
    }

    /// Joints of one finger in a motion between its ends, in the order it was proven.
    pub fn numbers_of(&self, finger: usize, first: u32, n_between: u16) -> &[f32] {
        let n = usize::from(n_between) * self.footholds[finger].n_coordinates;
        &self.ways[first as usize..first as usize + n]
    }

    /// Numbers of a motion with forces and times.
    pub fn track(&self, finger: Option<u8>, first: u32, n_between: u16) -> &[f64] {
        let n = track_length(self, finger, n_between);
        &self.tracks[first as usize..first as usize + n]
    }

    /// The ways that an edge has in [`Graph::ways`]: finger and first number of each, all of so many joint vectors. What
    /// lies outside of the tables is left out.
    fn ways_of(&self, passage: &Passage) -> (ArrayVec<(usize, u32), MAX_FINGERS>, u16) {
        match *passage {
            Passage::Transfer { n_between: NOT_STORED, .. } | Passage::Timed { .. } => (ArrayVec::new(), 0),
            Passage::Transfer { first, n_between } => {
                let strands = self.strands.get(first as usize..).unwrap_or_default();
                (strands.iter().copied().enumerate().take(self.n_fingers()).collect(), n_between)
            }
            Passage::Relocation { finger, first, n_between } => {
                ([(usize::from(finger), first)].into_iter().collect(), n_between)
            }
        }
    }

    /// The nodes at which `keep` holds with what they stand on, renumbered in the same order; edges between them stay.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Graph {
        let n_coordinates = self.footholds.iter().map(|footholds| footholds.n_coordinates);
        let mut kept = Graph { places: self.places.clone(), ..Graph::new(n_coordinates) };
        let mut new_nodes = vec![u32::MAX; self.nodes.len()];
        let mut new_contacts = vec![u32::MAX; self.contacts.len()];
        let mut new_footholds: Vec<Vec<u32>> =
            self.footholds.iter().map(|footholds| vec![u32::MAX; footholds.contacts.len()]).collect();
        for (index, node) in self.nodes.iter().enumerate().filter(|&(index, _)| keep(index)) {
            let mut renamed = Node { place: node.place, footholds: [0; MAX_FINGERS] };
            for finger in 0..self.n_fingers() {
                let old = node.footholds[finger];
                let new = &mut new_footholds[finger][old as usize];
                if *new == u32::MAX {
                    let old_contact = self.footholds[finger].contacts[old as usize] as usize;
                    if new_contacts[old_contact] == u32::MAX {
                        new_contacts[old_contact] = kept.contacts.len() as u32;
                        kept.contacts.push(self.contacts[old_contact]);
                    }
                    *new = kept.footholds[finger].contacts.len() as u32;
                    kept.footholds[finger].contacts.push(new_contacts[old_contact]);
                    kept.footholds[finger].joints.extend_from_slice(self.footholds[finger].joints_of(old));
                }
                renamed.footholds[finger] = *new;
            }
            new_nodes[index] = kept.nodes.len() as u32;
            kept.nodes.push(renamed);
        }
        let mut new_ways = BTreeMap::new();
        for edge in &self.edges {
            let (from, to) = (new_nodes[edge.from as usize], new_nodes[edge.to as usize]);
            if from == u32::MAX || to == u32::MAX {
                continue;
            }
            let (ways, n_between) = self.ways_of(&edge.passage);
            let firsts = ways.into_iter().map(|(finger, first)| {
                *new_ways.entry((finger, first, n_between)).or_insert_with(|| {
                    kept.ways.extend_from_slice(self.numbers_of(finger, first, n_between));
                    (kept.ways.len() - usize::from(n_between) * self.footholds[finger].n_coordinates) as u32
                })
            });
            let firsts: ArrayVec<u32, MAX_FINGERS> = firsts.collect();
            let passage = match edge.passage {
                Passage::Transfer { n_between, .. } => {
                    let first = kept.strands.len() as u32;
                    kept.strands.extend(firsts);
                    Passage::Transfer { first, n_between }
                }
                Passage::Relocation { finger, n_between, .. } => {
                    Passage::Relocation { finger, first: firsts[0], n_between }
                }
                Passage::Timed { finger, first, n_between } => {
                    let track = self.track(finger, first, n_between);
                    let first = kept.tracks.len() as u32;
                    kept.tracks.extend_from_slice(track);
                    Passage::Timed { finger, first, n_between }
                }
            };
            kept.edges.push(Edge { from, to, passage });
        }
        kept
    }

    /// What contradicts itself, if anything: indices out of range, motions whose ends do not fit, numbers that are not
    /// finite, poses and normals that are not of length one.
    pub fn validate(&self) -> Result<(), String> {
        self.validate_points()?;
        self.validate_nodes()?;
        for (index, edge) in self.edges.iter().enumerate() {
            self.validate_edge(edge).map_err(|problem| format!("edge {index} {problem}"))?;
        }
        if let Some(index) = self.ways.iter().position(|q| !q.is_finite()) {
            return Err(format!("joint value {index} of its motions is not finite"));
        }
        match self.tracks.iter().position(|number| !number.is_finite()) {
            Some(index) => Err(format!("number {index} of its motions with times is not finite")),
            None => Ok(()),
        }
    }

    fn validate_points(&self) -> Result<(), String> {
        let is_unit = |length: f64| (length - 1.0).abs() < 1e-9;
        for (index, place) in self.places.iter().enumerate() {
            let is_finite = place.translation.vector.iter().all(|x| x.is_finite());
            if !is_finite || !is_unit(place.rotation.coords.norm()) {
                return Err(format!("place {index} is no pose"));
            }
        }
        for (index, contact) in self.contacts.iter().enumerate() {
            let is_finite = contact.point_in_object.iter().all(|x| x.is_finite());
            if !is_finite || !is_unit(contact.normal_in_object.norm()) {
                return Err(format!("contact {index} is no point with a normal"));
            }
        }
        for (finger, footholds) in self.footholds.iter().enumerate() {
            if footholds.joints.len() != footholds.contacts.len() * footholds.n_coordinates {
                return Err(format!("finger {finger} has joints that do not fit its footholds"));
            }
            if let Some(id) = footholds.contacts.iter().position(|&contact| contact as usize >= self.contacts.len()) {
                return Err(format!("foothold {id} of finger {finger} is at a contact that does not exist"));
            }
            if footholds.joints.iter().any(|q| !q.is_finite()) {
                return Err(format!("finger {finger} has a joint that is not finite"));
            }
        }
        Ok(())
    }

    fn validate_nodes(&self) -> Result<(), String> {
        for (index, node) in self.nodes.iter().enumerate() {
            let stands = (0..self.n_fingers())
                .all(|finger| (node.footholds[finger] as usize) < self.footholds[finger].contacts.len());
            if node.place as usize >= self.places.len() || !stands {
                return Err(format!("node {index} is at a place or foothold that does not exist"));
            }
        }
        Ok(())
    }

    fn validate_edge(&self, edge: &Edge) -> Result<(), String> {
        let (from, to) = (edge.from as usize, edge.to as usize);
        if from >= self.nodes.len() || to >= self.nodes.len() || from == to {
            return Err("joins nodes that do not exist, or a node to itself".into());
        }
        let (start, end) = (&self.nodes[from], &self.nodes[to]);
        let moving = match edge.passage {
            Passage::Relocation { finger, .. } | Passage::Timed { finger: Some(finger), .. } => Some(finger),
            Passage::Transfer { .. } | Passage::Timed { finger: None, .. } => None,
        };
        match moving {
            None => {
                let rolls = matches!(edge.passage, Passage::Timed { .. });
                let same_grasp =
                    rolls || (0..self.n_fingers()).all(|f| self.contact_id(from, f) == self.contact_id(to, f));
                if !same_grasp || start.place == end.place {
                    return Err("is a transfer that changes the grasp or does not move the object".into());
                }
            }
            Some(finger) => {
                let moving = usize::from(finger);
                if moving >= self.n_fingers() || start.place != end.place {
                    return Err("is a relocation of no finger, or moves the object".into());
                }
                let one_moves =
                    (0..self.n_fingers()).all(|f| (start.footholds[f] != end.footholds[f]) == (f == moving));
                if !one_moves {
                    return Err("is a relocation of other fingers than its own".into());
                }
            }
        }
        if let Passage::Timed { finger, first, n_between } = edge.passage {
            let end = first as usize + track_length(self, finger, n_between);
            return if end <= self.tracks.len() { Ok(()) } else { Err("has a motion that does not exist".into()) };
        }
        let (ways, n_between) = self.ways_of(&edge.passage);
        let n_ways = match edge.passage {
            Passage::Transfer { n_between: NOT_STORED, .. } | Passage::Timed { .. } => 0,
            Passage::Transfer { .. } => self.n_fingers(),
            Passage::Relocation { .. } => 1,
        };
        let is_there = |&(finger, first): &(usize, u32)| {
            first as usize + usize::from(n_between) * self.footholds[finger].n_coordinates <= self.ways.len()
        };
        if ways.len() != n_ways || !ways.iter().all(is_there) {
            return Err("has a way that does not exist".into());
        }
        Ok(())
    }
}

/// A motion with contacts, forces and times as numbers: see [`super::track`].
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The finger that moves; None where all hold and the object moves.
    pub finger: Option<u8>,
    /// Waypoints between its ends.
    pub n_between: u16,
    /// The numbers.
    pub numbers: Vec<f64>,
}

/// Numbers of a contact: point, normal, force and torsion.
const CONTACT: usize = 10;
/// Numbers of what a contact transmits: force and torsion.
pub const EXERTED: usize = 4;
/// Numbers of a pose.
const POSE: usize = 7;

/// How many numbers a track has; more than any table has for one of no finger of the graph.
fn track_length(graph: &Graph, finger: Option<u8>, n_between: u16) -> usize {
    let n_waypoints = usize::from(n_between) + 2;
    let n_joints: usize = graph.footholds.iter().map(|table| table.n_coordinates).sum();
    match finger {
        None => 1 + n_waypoints * (1 + POSE + 3 * n_joints + CONTACT * graph.n_fingers()),
        Some(finger) => match graph.footholds.get(usize::from(finger)) {
            Some(own) => 1 + n_joints + EXERTED * graph.n_fingers() + n_waypoints * (1 + 2 * own.n_coordinates),
            None => usize::MAX / 2,
        },
    }
}

/// A list of numbers per key, all in one table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lists {
    firsts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// The items of `pairs` (key, item) by key, in the order given. Fewer than 2^32 of them.
    pub fn new(n_keys: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut firsts = vec![0u32; n_keys + 1];
        for (key, _) in pairs.clone() {
            firsts[key as usize + 1] += 1;
        }
        for key in 0..n_keys {
            firsts[key + 1] += firsts[key];
        }
        let mut next = firsts.clone();
        let mut items = vec![0; firsts[n_keys] as usize];
        for (key, item) in pairs {
            items[next[key as usize] as usize] = item;
            next[key as usize] += 1;
        }
        Lists { firsts, items }
    }

    /// First item of every key, with the number of items at the end; and the items.
    pub fn into_tables(self) -> (Vec<u32>, Vec<u32>) {
        (self.firsts, self.items)
    }

    /// The items of `key`.
    pub fn of(&self, key: usize) -> &[u32] {
        &self.items[self.firsts[key] as usize..self.firsts[key + 1] as usize]
    }
}

/// Grasps and motions gathered before they are numbered: see [`super::registry`].
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "a few at a time, short-lived")]
pub enum Leg {
    /// To a place, with the same contacts.
    Transfer {
        /// Index of the place.
        place: u32,
        /// Joints there.
        joints: HandJoints,
        /// Joints on the way, at equal shares of it; none where they are to be stepped again.
        between: Option<Vec<HandJoints>>,
    },
    /// To another foothold of one finger.
    Relocation {
        /// The finger.
        finger: usize,
        /// Its joints after the start, the last ones being at the contact.
        path: Vec<Coordinates>,
        /// Its contact at the end.
        contact: Contact,
    },
    /// A motion with contacts, forces and times.
    Timed {
        /// Index of the place where a transfer ends; None for a new one.
        place: Option<u32>,
        /// The grasp there.
        end: GraspState,
        /// Its numbers.
        track: Track,
    },
}

/// Contacts of a node as indices.
pub fn contact_ids(graph: &Graph, node: usize) -> ArrayVec<u32, MAX_FINGERS> {
    (0..graph.n_fingers()).map(|finger| graph.contact_id(node, finger)).collect()
}
