//! The motions along a path in the graph.

use super::super::link::reversed;
use super::super::model::Model;
use super::super::state::{GraspState, Motion, Step};
use super::super::transfer::follow;
use super::GraspRoadmap;
use super::graph::Passage;

/// Largest difference between the joints that a transfer ends in and those stored, in radians or metres.
const SAME_POSTURE: f64 = 2e-6;

/// The motion along edge `edge` from node `from`, which is one of its ends.
///
/// None when the stored ends of a transfer do not fit each other: it was proven by another version of the kinematics.
pub fn motion_along(model: &Model, roadmap: &GraspRoadmap, edge: u32, from: usize) -> Option<Step> {
    let stored = &roadmap.graph.edges[edge as usize];
    let (start, end) = (roadmap.graph.state(stored.from as usize), roadmap.graph.state(stored.to as usize));
    let motion = match stored.passage {
        Passage::Transfer => transfer_again(model, &start, &end)?,
        Passage::Relocation { finger, first, n_between } => {
            let finger = usize::from(finger);
            let mut path: Vec<_> = roadmap.graph.way(finger, first, n_between).collect();
            path.push(end.joints[finger].clone());
            Motion::Regrasp { finger, path }
        }
    };
    let step = Step { motion, end };
    if stored.from as usize == from { Some(step) } else { reversed(&start, &[step]).pop() }
}

/// The moments of a proven transfer, without proving them again.
fn transfer_again(model: &Model, start: &GraspState, end: &GraspState) -> Option<Motion> {
    let mut moments = Vec::new();
    let share = follow(model, start, &end.world_from_object, &mut moments, |_| true);
    let last = moments.last_mut()?;
    let fits = last
        .joints
        .iter()
        .zip(&end.joints)
        .all(|(a, b)| a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() < SAME_POSTURE));
    if share < 1.0 || !fits {
        return None;
    }
    last.joints.clone_from(&end.joints);
    Some(Motion::Transfer(moments))
}
