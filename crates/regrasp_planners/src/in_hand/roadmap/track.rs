//! Motions with contacts, contact forces and times as numbers: what a plan needs of them, so that an answer has nothing to compute.
//!
//! A track has the smallest closure margin, then its waypoints, both ends included. A waypoint of a transfer is time, object pose,
//! joints, their velocities and torques, then point, normal, force and torsion of every contact. In a relocation all but one finger
//! rest: the torques of all joints and the forces and torsions of all contacts stand once before the waypoints, and a waypoint is time, joints and
//! velocities of the finger that moves.

use crate::in_hand::roadmap::graph::{EXERTED, Footholds, Graph, Leg, Passage, Track};
use regrasp_geometry::{Point, Pose, UnitVector, Vector, pose_from};
use regrasp_grasp::{Contact, ContactModel};
use regrasp_manipulation::forces::limits::Unbalanced;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence, Step};
use regrasp_manipulation::grasp::state::{Contacts, HandJoints, Moment, no_contact};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::recording::pieces::Piece;
use regrasp_manipulation::recording::recorder::{Joins, Recorder, moving, resting};
use regrasp_plan::plan::{ContactState, PoseData, Segment, SegmentKind, Waypoint};
use std::ops::Range;

/// The motions of `way` with forces and times, each by itself.
///
/// Errors: a moment at which no contact forces balance the weight.
pub fn pieces_of(model: &Model, way: &Sequence) -> Result<Vec<Piece>, Unbalanced> {
    let piece = |index: usize| {
        let mut recorder = Recorder::at(model, way.state_before(index), Joins::Nothing);
        recorder.sequence(&way.part(index..index + 1));
        recorder.into_piece()
    };
    (0..way.steps().len()).map(piece).collect()
}

/// The motions of `way`, whose `pieces` are given, as a graph keeps them; `place_of` says which place a transfer leads to, None for
/// a new one. None where a finger is free, a transfer ends where it begins, or a motion has too many waypoints: such motions are not kept.
pub fn legs_of_pieces(
    fingers: &[Footholds],
    way: &Sequence,
    pieces: &[Piece],
    place_of: impl Fn(&Pose) -> Option<u32>,
) -> Option<Vec<Leg>> {
    let is_held = way.start().is_held_by_all() && way.steps().iter().all(|step| step.end().is_held_by_all());
    let moves = |(index, step): (usize, &Step)| {
        let is_transfer = matches!(step.motion(), Motion::Transfer(_));
        !is_transfer || way.state_before(index).world_from_object != step.end().world_from_object
    };
    if !is_held || !way.steps().iter().enumerate().all(moves) || pieces.len() != way.steps().len() {
        return None;
    }
    let leg = |(step, piece): (&Step, &Piece)| {
        let finger = match step.motion() {
            Motion::Transfer(_) => None,
            Motion::Regrasp { finger, .. } => Some(*finger),
        };
        let place = place_of(&step.end().world_from_object);
        Some(Leg::Timed { place, end: step.end().clone(), track: track_of(fingers, finger, piece)? })
    };
    way.steps().iter().zip(pieces).map(leg).collect()
}

/// The numbers of a piece of one motion.
fn track_of(fingers: &[Footholds], finger: Option<usize>, piece: &Piece) -> Option<Track> {
    let [segment] = piece.segments.as_slice() else { return None };
    let n_between = u16::try_from(segment.waypoints.len().checked_sub(2)?).ok()?;
    let mut numbers = vec![piece.kept_margin];
    let exerted = |contact: &ContactState| {
        contact.force_in_object.unwrap_or_default().into_iter().chain([contact.torsion.unwrap_or(0.0)])
    };
    let torques = |waypoint: &Waypoint| {
        let n_joints = waypoint.joints.len();
        let known = waypoint.joint_torques.clone();
        known.into_iter().chain(std::iter::repeat(0.0)).take(n_joints).collect::<Vec<f64>>()
    };
    match finger {
        None => {
            for waypoint in &segment.waypoints {
                numbers.push(waypoint.time);
                numbers.extend(waypoint.world_from_object.numbers());
                numbers.extend(waypoint.joints.iter().chain(&waypoint.joint_velocities));
                numbers.extend(torques(waypoint));
                for contact in &waypoint.contacts {
                    numbers.extend(contact.point_in_object?.into_iter().chain(contact.normal_in_object?));
                    numbers.extend(exerted(contact));
                }
            }
        }
        Some(finger) => {
            let first = segment.waypoints.first()?;
            numbers.extend(torques(first));
            first.contacts.iter().for_each(|contact| numbers.extend(exerted(contact)));
            let own = joints_of(fingers, finger);
            for waypoint in &segment.waypoints {
                numbers.push(waypoint.time);
                numbers.extend(waypoint.joints[own.clone()].iter().chain(&waypoint.joint_velocities[own.clone()]));
            }
        }
    }
    Some(Track { finger: finger.map(|finger| finger as u8), n_between, numbers })
}

/// Which joints of the hand a finger has.
fn joints_of(fingers: &[Footholds], finger: usize) -> Range<usize> {
    let first = fingers[..finger].iter().map(|table| table.n_coordinates).sum();
    first..first + fingers[finger].n_coordinates
}

/// Numbers read one after the other.
struct Numbers<'n>(&'n [f64]);

impl<'n> Numbers<'n> {
    fn next(&mut self, n: usize) -> &'n [f64] {
        let (taken, rest) = self.0.split_at(n);
        self.0 = rest;
        taken
    }

    fn one(&mut self) -> f64 {
        self.next(1)[0]
    }

    fn three(&mut self) -> [f64; 3] {
        let [x, y, z] = self.next(3) else { unreachable!("three were asked for") };
        [*x, *y, *z]
    }

    fn pose(&mut self) -> PoseData {
        let position = self.three();
        let [x, y, z, w] = self.next(4) else { unreachable!("four were asked for") };
        PoseData { position, quat_xyzw: [*x, *y, *z, *w] }
    }
}

/// A timed edge, as it is gone from one of its ends.
pub struct TimedEdge<'g> {
    graph: &'g Graph,
    numbers: &'g [f64],
    finger: Option<u8>,
    n_waypoints: usize,
    /// Nodes in the order in which the motion was proven.
    ends: [usize; 2],
    is_forwards: bool,
}

impl<'g> TimedEdge<'g> {
    /// Edge `edge` gone from node `from`, which is one of its ends. None for edges without forces and times.
    pub fn along(graph: &'g Graph, edge: u32, from: usize) -> Option<Self> {
        let edge = &graph.edges[edge as usize];
        let Passage::Timed { finger, first, n_between } = edge.passage else { return None };
        Some(TimedEdge {
            graph,
            numbers: graph.track(finger, first, n_between),
            finger,
            n_waypoints: usize::from(n_between) + 2,
            ends: [edge.from as usize, edge.to as usize],
            is_forwards: edge.from as usize == from,
        })
    }

    /// Node that it leads to.
    fn to(&self) -> usize {
        self.ends[usize::from(self.is_forwards)]
    }

    /// The motion as a piece of a plan.
    pub fn piece(&self, model: &Model) -> Piece {
        let mut numbers = Numbers(self.numbers);
        let kept_margin = numbers.one();
        let segment = match self.finger {
            None => self.transfer(model, &mut numbers),
            Some(finger) => self.relocation(model, usize::from(finger), &mut numbers),
        };
        let piece = Piece { segments: vec![segment], kept_margin };
        if self.is_forwards { piece } else { piece.reversed() }
    }

    fn transfer(&self, model: &Model, numbers: &mut Numbers) -> Segment {
        let n_joints = model.view.hand.n_joints();
        let modes = moving(model, &self.contacts_at(self.ends[0]), model.all_fingers());
        let waypoint = |_| {
            let (time, world_from_object) = (numbers.one(), numbers.pose());
            let [joints, joint_velocities, torques] = [(); 3].map(|()| numbers.next(n_joints));
            let contacts = modes.iter().enumerate().map(|(finger, state)| {
                let (point, normal) = (numbers.three(), numbers.three());
                exerting(model, finger, ContactState::at(state.mode, point, normal), numbers)
            });
            Waypoint {
                time,
                joints: joints.to_vec(),
                joint_velocities: joint_velocities.to_vec(),
                contacts: contacts.collect(),
                joint_torques: if model.forces.is_some() { torques.to_vec() } else { Vec::new() },
                world_from_object,
            }
        };
        Segment::transfer((0..self.n_waypoints).map(waypoint).collect())
    }

    fn relocation(&self, model: &Model, finger: usize, numbers: &mut Numbers) -> Segment {
        let (start, own) = (self.ends[0], joints_of(&self.graph.footholds, finger));
        let torques = numbers.next(model.view.hand.n_joints());
        let exerted = numbers.next(EXERTED * model.n_fingers());
        let with_forces = |contacts: &Contacts, holding: u32| -> Vec<ContactState> {
            let mut exerted = Numbers(exerted);
            let states = resting(contacts, holding).into_iter().enumerate();
            states.map(|(finger, state)| exerting(model, finger, state, &mut exerted)).collect()
        };
        let all = model.all_fingers();
        let before = self.contacts_at(start);
        let mut between = before.clone();
        between[finger] = no_contact();
        let [first, away, last] = [
            with_forces(&before, all),
            with_forces(&between, all & !(1 << finger)),
            with_forces(&self.contacts_at(self.ends[1]), all),
        ];
        let here: Vec<f64> = self.graph.hand_joints(start).iter().flatten().copied().collect();
        let world_from_object = PoseData::from(self.graph.pose(start));
        let waypoint = |index| {
            let time = numbers.one();
            let (mut joints, mut joint_velocities) = (here.clone(), vec![0.0; here.len()]);
            joints[own.clone()].copy_from_slice(numbers.next(own.len()));
            joint_velocities[own.clone()].copy_from_slice(numbers.next(own.len()));
            let contacts = match index {
                0 => first.clone(),
                last_one if last_one + 1 == self.n_waypoints => last.clone(),
                _ => away.clone(),
            };
            let joint_torques = if model.forces.is_some() { torques.to_vec() } else { Vec::new() };
            Waypoint { time, joints, joint_velocities, joint_torques, world_from_object, contacts }
        };
        let waypoints = (0..self.n_waypoints).map(waypoint).collect();
        let moving_finger = Some(model.view.hand.fingers[finger].name.clone());
        Segment { kind: SegmentKind::Regrasp, moving_finger, ..Segment::transfer(waypoints) }
    }

    fn contacts_at(&self, node: usize) -> Contacts {
        (0..self.graph.n_fingers()).map(|finger| *self.graph.contact(node, finger)).collect()
    }

    /// Appends the motion to a sequence that ends where it begins.
    pub fn push_to(&self, model: &Model, way: &mut Sequence) {
        let to = self.to();
        let waypoints = self.piece(model).segments.remove(0).waypoints;
        let hand_joints = |waypoint: &Waypoint| -> HandJoints {
            (0..model.n_fingers())
                .map(|f| waypoint.joints[joints_of(&self.graph.footholds, f)].iter().copied().collect())
                .collect()
        };
        let between = &waypoints[1..waypoints.len() - 1];
        let end = self.graph.state(to);
        match self.finger.map(usize::from) {
            None => {
                let moment = |waypoint: &Waypoint| Moment {
                    world_from_object: pose_from(
                        waypoint.world_from_object.position,
                        waypoint.world_from_object.quat_xyzw,
                    ),
                    joints: hand_joints(waypoint),
                    contacts: waypoint.contacts.iter().map(contact_of).collect(),
                };
                way.push_transfer(between.iter().map(moment).chain([end.moment()]).collect());
            }
            Some(finger) => {
                let own = |waypoint: &Waypoint| {
                    waypoint.joints[joints_of(&self.graph.footholds, finger)].iter().copied().collect()
                };
                let path = between.iter().map(own).chain([end.joints[finger].clone()]).collect();
                way.push_regrasp(finger, Some(end.contacts[finger]), path);
            }
        }
    }
}

fn contact_of(state: &ContactState) -> Contact {
    let [point, normal] = [state.point_in_object, state.normal_in_object].map(Option::unwrap_or_default);
    Contact { point_in_object: Point::from(point), normal_in_object: UnitVector::new_unchecked(Vector::from(normal)) }
}

/// `state` with the next force and torsion of `numbers`, as far as it has one.
fn exerting(model: &Model, finger: usize, state: ContactState, numbers: &mut Numbers) -> ContactState {
    let (force, torsion) = (numbers.three(), numbers.one());
    if !state.holds() || model.forces.is_none() {
        return state;
    }
    let is_soft = matches!(model.fingers[finger].contact, ContactModel::SoftFinger { .. });
    ContactState { force_in_object: Some(force), torsion: is_soft.then_some(torsion), ..state }
}
