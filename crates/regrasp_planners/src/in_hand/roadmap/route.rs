//! The motions along a path in the graph.

use super::super::model::Model;
use super::super::state::{GraspState, Moment, Sequence};
use super::super::transfer::follow;
use super::super::workspace::HandJoints;
use super::GraspRoadmap;
use super::graph::{NOT_STORED, Passage};
use regrasp_geometry::{Pose, interpolate_pose};

/// Largest difference between the joints that a transfer ends in and those stored, in radians or metres.
const SAME_POSTURE: f64 = 2e-6;

/// The motion along edge `edge` from node `from`, which is one of its ends.
///
/// None when the stored ends of a transfer do not fit each other: it was proven by another version of the kinematics.
pub fn motion_along(model: &Model, roadmap: &GraspRoadmap, edge: u32, from: usize) -> Option<Sequence> {
    let graph = &roadmap.graph;
    let stored = &graph.edges[edge as usize];
    let to = stored.to as usize;
    let mut way = Sequence::at(graph.state(stored.from as usize));
    match stored.passage {
        Passage::Transfer { n_between: NOT_STORED, .. } => {
            let moments = transfer_again(model, way.start(), &graph.state(to))?;
            way.push_transfer(moments);
        }
        Passage::Transfer { first, n_between } => {
            let (start, end) = (way.start(), graph.state(to));
            let (from, to) = (start.world_from_object, end.world_from_object);
            let mut moments = Vec::with_capacity(usize::from(n_between) + 1);
            for (k, joints) in graph.moments(first, n_between).enumerate() {
                let share = share_of(k, usize::from(n_between) + 1);
                moments.push(Moment { world_from_object: interpolate_pose(&from, &to, share), joints });
            }
            moments.push(Moment { world_from_object: to, joints: end.joints });
            way.push_transfer(moments);
        }
        Passage::Relocation { finger, first, n_between } => {
            let finger = usize::from(finger);
            let mut path: Vec<_> = graph.way(finger, first, n_between).collect();
            path.push(graph.joints(to, finger));
            way.push_regrasp(finger, Some(*graph.contact(to, finger)), path);
        }
    }
    Some(if stored.from as usize == from { way } else { way.reversed() })
}

/// Share of a transfer's way that is made at moment `k` of `n`, of which the last is its end; as steps are shared out.
fn share_of(k: usize, n: usize) -> f64 {
    (k + 1) as f64 / n as f64
}

/// Joints of a transfer between its ends, if its moments are at equal shares of the way; exactly, as the poses between are
/// not stored.
pub fn evenly(start: &Pose, moments: &[Moment]) -> Option<Vec<HandJoints>> {
    let (end, between) = moments.split_last()?;
    let is_at = |(k, moment): (usize, &Moment)| {
        let pose = interpolate_pose(start, &end.world_from_object, share_of(k, moments.len()));
        pose == moment.world_from_object
    };
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
