//! The motions along a path in the graph.

use super::super::model::Model;
use super::super::state::{GraspState, Moment, Sequence};
use super::super::transfer::follow;
use super::GraspRoadmap;
use super::graph::Passage;

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
        Passage::Transfer => {
            let moments = transfer_again(model, way.start(), &graph.state(to))?;
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

/// The moments of a proven transfer, without proving them again.
fn transfer_again(model: &Model, start: &GraspState, end: &GraspState) -> Option<Vec<Moment>> {
    let mut moments = Vec::new();
    let share = follow(model, start, &end.world_from_object, &mut moments, |_| true);
    let last = moments.last_mut()?;
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() < SAME_POSTURE);
    let fits = last.joints.iter().zip(&end.joints).all(|(a, b)| near(a, b));
    if share < 1.0 || !fits {
        return None;
    }
    // The last step was proven to just these joints.
    last.joints.clone_from(&end.joints);
    Some(moments)
}
