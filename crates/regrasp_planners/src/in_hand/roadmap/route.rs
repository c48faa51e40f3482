//! The motions along a path in the graph.

use crate::in_hand::moving::transfer::follow;
use crate::in_hand::roadmap::graph::{Graph, NOT_STORED, Passage};
use arrayvec::ArrayVec;
use regrasp_geometry::Pose;
use regrasp_geometry::frame::PoseLine;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints, MAX_FINGERS, Moment};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::recording::recorder::Recorder;

/// Largest difference between the joints that a transfer ends in and those stored, in radians or metres.
const SAME_POSTURE: f64 = 2e-6;

/// The motion along an edge in the direction it is gone, with what is stored of it.
pub struct Passing<'g> {
    graph: &'g Graph,
    /// Node that it leads to.
    to: usize,
    is_forwards: bool,
    motion: Stored<'g>,
}

enum Stored<'g> {
    /// The object moves along a line; joints of every finger between the ends, for so many moments.
    Transfer(PoseLine, ArrayVec<&'g [f32], MAX_FINGERS>, usize),
    /// The object moves; all moments after the start.
    Again(Vec<Moment>),
    /// One finger moves; its joints between the ends.
    Relocation(usize, &'g [f32]),
}

impl<'g> Passing<'g> {
    /// Along edge `edge` from node `from`, which is one of its ends.
    ///
    /// None when the stored ends of a transfer do not fit each other: it was proven by another version of the kinematics. None for motions
    /// with forces and times, which a graph of contacts that stay does not have.
    pub fn along(model: &Model, graph: &'g Graph, edge: u32, from: usize) -> Option<Self> {
        let edge = &graph.edges[edge as usize];
        let (proven_from, proven_to) = (edge.from as usize, edge.to as usize);
        let is_forwards = proven_from == from;
        let motion = match edge.passage {
            Passage::Transfer { n_between: NOT_STORED, .. } => {
                let mut again = Sequence::at(graph.state(proven_from));
                again.push_transfer(transfer_again(model, again.start(), &graph.state(proven_to))?);
                let mut again = if is_forwards { again } else { again.reversed() };
                Stored::Again(again.pop_transfer()?)
            }
            Passage::Transfer { first, n_between } => {
                let line = PoseLine::between(graph.pose(proven_from), graph.pose(proven_to));
                Stored::Transfer(line, graph.strands_of(first, n_between), usize::from(n_between))
            }
            Passage::Relocation { finger, first, n_between } => {
                let finger = usize::from(finger);
                Stored::Relocation(finger, graph.numbers_of(finger, first, n_between))
            }
            Passage::Timed { .. } => return None,
        };
        Some(Passing { graph, to: if is_forwards { proven_to } else { proven_from }, is_forwards, motion })
    }

    /// `n` moments in the order they are passed.
    fn order(&self, n: usize) -> impl Iterator<Item = usize> + use<> {
        let is_forwards = self.is_forwards;
        (0..n).map(move |k| if is_forwards { k } else { n - 1 - k })
    }

    /// Appends it to a sequence that ends where it begins.
    pub fn push_to(self, way: &mut Sequence) {
        let (graph, to) = (self.graph, self.to);
        match &self.motion {
            Stored::Transfer(line, strands, n) => {
                let joints = |k: usize| -> HandJoints {
                    let tables = strands.iter().zip(&graph.footholds);
                    tables.map(|(strand, table)| numbers_at(strand, table.n_coordinates, k).collect()).collect()
                };
                let contacts = way.end().contacts.clone();
                let moment = |k| Moment {
                    world_from_object: line.at(share_of(k, n + 1)),
                    joints: joints(k),
                    contacts: contacts.clone(),
                };
                let end = Moment {
                    world_from_object: *graph.pose(to),
                    joints: graph.hand_joints(to),
                    contacts: contacts.clone(),
                };
                way.push_transfer(self.order(*n).map(moment).chain([end]).collect());
            }
            Stored::Again(moments) => way.push_transfer(moments.clone()),
            Stored::Relocation(finger, strand) => {
                let stride = graph.footholds[*finger].n_coordinates;
                let between = self.order(strand.len() / stride).map(|k| numbers_at(strand, stride, k).collect());
                let path = between.chain([graph.joints(to, *finger)]).collect();
                way.push_regrasp(*finger, Some(*graph.contact(to, *finger)), path);
            }
        }
    }

    /// Records it after what leads to where it begins: the same as of a sequence.
    pub fn record_to(self, recorder: &mut Recorder) {
        let (graph, to) = (self.graph, self.to);
        match &self.motion {
            Stored::Transfer(line, strands, n) => {
                recorder.begin_transfer(n + 1);
                for k in self.order(*n) {
                    let tables = strands.iter().zip(&graph.footholds);
                    let joints = tables.flat_map(|(strand, table)| numbers_at(strand, table.n_coordinates, k));
                    recorder.moment(&line.at(share_of(k, n + 1)), joints);
                }
                let at_end = (0..graph.n_fingers()).flat_map(|finger| graph.joints_of(to, finger).iter().copied());
                recorder.moment(graph.pose(to), at_end);
            }
            Stored::Again(moments) => recorder.transfer(moments),
            Stored::Relocation(finger, strand) => {
                let stride = graph.footholds[*finger].n_coordinates;
                let n = strand.len() / stride;
                recorder.begin_regrasp(*finger, Some(graph.contact(to, *finger)), n + 1);
                for k in self.order(n) {
                    recorder.finger_at(*finger, numbers_at(strand, stride, k));
                }
                recorder.finger_at(*finger, graph.joints_of(to, *finger).iter().copied());
                recorder.end_regrasp();
            }
        }
    }
}

/// The joint vector `k` of a way.
fn numbers_at(strand: &[f32], stride: usize, k: usize) -> impl Iterator<Item = f64> {
    strand[k * stride..(k + 1) * stride].iter().map(|&q| f64::from(q))
}

/// Share of a transfer's way that is made at moment `k` of `n`, of which the last is its end; as steps are shared out.
fn share_of(k: usize, n: usize) -> f64 {
    (k + 1) as f64 / n as f64
}

/// Joints of a transfer between its ends, if its moments are at equal shares of the way; exactly, as the poses between are
/// not stored.
pub fn evenly(start: &Pose, moments: &[Moment]) -> Option<Vec<HandJoints>> {
    let (end, between) = moments.split_last()?;
    let line = PoseLine::between(start, &end.world_from_object);
    let is_at = |(k, moment): (usize, &Moment)| line.at(share_of(k, moments.len())) == moment.world_from_object;
    let is_even = between.iter().enumerate().all(is_at);
    is_even.then(|| between.iter().map(|moment| moment.joints.clone()).collect())
}

/// True when two postures differ by no more than what solvers leave.
pub fn same_posture(a: &HandJoints, b: &HandJoints) -> bool {
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() < SAME_POSTURE);
    a.iter().zip(b).all(|(a, b)| near(a, b))
}

/// The moments of a proven transfer, without proving them again.
fn transfer_again(model: &Model, start: &GraspState, end: &GraspState) -> Option<Vec<Moment>> {
    let mut moments = Vec::new();
    let share = follow(model, start, &end.world_from_object, &mut moments, |_| true);
    let last = moments.last_mut()?;
    if share < 1.0 || !same_posture(&last.joints, &end.joints) {
        return None;
    }
    // The last step was proven to just these joints.
    last.joints.clone_from(&end.joints);
    Some(moments)
}
