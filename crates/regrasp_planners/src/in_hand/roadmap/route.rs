//! The motions along a path in the graph.

use super::super::model::Model;
use super::super::state::{GraspState, Moment, Sequence};
use super::super::transfer::follow;
use super::super::workspace::HandJoints;
use super::GraspRoadmap;
use super::graph::{NOT_STORED, Passage};
use regrasp_geometry::Pose;
use regrasp_geometry::frame::PoseLine;

/// Largest difference between the joints that a transfer ends in and those stored, in radians or metres.
const SAME_POSTURE: f64 = 2e-6;

/// Appends the motion along edge `edge` from node `from`, which is one of its ends and the state that `way` ends in. With
/// `joins` a transfer at the end of `way` goes on where the edge is one.
///
/// None when the stored ends of a transfer do not fit each other: it was proven by another version of the kinematics.
pub fn push_motion_along(
    model: &Model,
    roadmap: &GraspRoadmap,
    (edge, from): (u32, usize),
    joins: bool,
    way: &mut Sequence,
) -> Option<()> {
    let graph = &roadmap.graph;
    let stored = &graph.edges[edge as usize];
    let (proven_from, proven_to) = (stored.from as usize, stored.to as usize);
    let is_forwards = proven_from == from;
    let to = if is_forwards { proven_to } else { proven_from };
    match stored.passage {
        Passage::Transfer { n_between: NOT_STORED, .. } => {
            let moments = transfer_again(model, &graph.state(proven_from), &graph.state(proven_to))?;
            let mut again = Sequence::at(graph.state(proven_from));
            again.push_transfer(moments);
            let mut again = if is_forwards { again } else { again.reversed() };
            push(way, again.pop_transfer()?, joins);
        }
        Passage::Transfer { first, n_between } => {
            let line = PoseLine::between(graph.pose(proven_from), graph.pose(proven_to));
            let n = usize::from(n_between) + 1;
            let moment = |(k, joints)| Moment { world_from_object: line.at(share_of(k, n)), joints };
            let end = Moment { world_from_object: *graph.pose(to), joints: graph.hand_joints(to) };
            let between = graph.moments(first, n_between).enumerate().map(moment);
            if is_forwards {
                push(way, between.chain([end]), joins);
            } else {
                push(way, between.rev().chain([end]), joins);
            }
        }
        Passage::Relocation { finger, first, n_between } => {
            let finger = usize::from(finger);
            let between = graph.way(finger, first, n_between);
            let end = [graph.joints(to, finger)];
            let path = if is_forwards { between.chain(end).collect() } else { between.rev().chain(end).collect() };
            way.push_regrasp(finger, Some(*graph.contact(to, finger)), path);
        }
    }
    Some(())
}

fn push(way: &mut Sequence, moments: impl IntoIterator<Item = Moment>, joins: bool) {
    if joins {
        way.go_on(moments);
    } else {
        way.push_transfer(moments.into_iter().collect());
    }
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
