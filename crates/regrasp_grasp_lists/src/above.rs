//! Stable poses of the object in which a hand stays above the support: in the grasp, open, and on its whole way.

use crate::found::WayIn;
use crate::prepared::Prepared;
use crate::way::between;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::collision::support::support_value;
use regrasp_geometry::stable::Standing;
use regrasp_geometry::{Point, Vector};
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::model::Carrier;

/// Steps of the closing of the hand.
const STEPS: usize = 8;

/// Indices of the poses in which nothing of the hand comes nearer to the support than the clearance.
pub fn stays_above(prepared: &Prepared, state: &GraspState, way: &WayIn) -> Vec<usize> {
    let poses = &prepared.standing;
    (0..poses.len()).filter(|&index| is_above(prepared, state, way, &poses[index])).collect()
}

fn is_above(prepared: &Prepared, state: &GraspState, way: &WayIn, pose: &Standing) -> bool {
    let allowed = pose.height - prepared.settings.clearance;
    let hand_from_object = Placement::from(&state.world_from_object);
    let down = hand_from_object.vector(&pose.down);
    let origin = down.dot(&hand_from_object.translation);
    // Before the grasp the hand is shifted against the direction in which it comes; in between it is in between.
    let shift = -way.direction.dot(&pose.down) * prepared.settings.approach_distance;
    let (at_open, _) = lowest(prepared, &way.open, &way.open, &down);
    if at_open - origin + shift.max(0.0) > allowed {
        return false;
    }
    (0..STEPS).all(|k| {
        let joints = |k: usize| between(&way.open, &state.joints, k as f64 / STEPS as f64);
        let (here, there) = lowest(prepared, &joints(k), &joints(k + 1), &down);
        here.max(there) - origin <= allowed
    })
}

/// How far the hand reaches along `down`, a direction of the hand frame, at two postures; with what the bodies stray from
/// straight lines in between added to both.
fn lowest(prepared: &Prepared, from: &HandJoints, to: &HandJoints, down: &Vector) -> (f64, f64) {
    let model = prepared.model;
    let (mut at_from, mut at_to) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let frames = |joints: &HandJoints| -> Vec<Vec<Placement>> {
        let of_finger = |f: usize| {
            let chain = model.fingers[f].ik.chain();
            let mut frames = vec![Placement::IDENTITY; chain.joints.len()];
            chain.forward_frames(&joints[f], &mut frames);
            frames
        };
        (0..model.n_fingers()).map(of_finger).collect()
    };
    let (first, second) = (frames(from), frames(to));
    for body in &model.bodies[..model.object] {
        let reach = |carrier: &Placement| {
            let at = carrier.then(&body.carrier_from_body);
            let value = support_value(&body.shape, &at.vector_to_child(down), &mut 0);
            down.dot(&at.point(&Point::origin()).coords) + value
        };
        let (one, other) = match &body.carrier {
            Carrier::Finger { finger, link, bound } => {
                let change: Vec<f64> = from[*finger].iter().zip(&to[*finger]).map(|(a, b)| (b - a).abs()).collect();
                let stray = bound.chord_deviation(&change);
                (reach(&first[*finger][*link]) + stray, reach(&second[*finger][*link]) + stray)
            }
            _ => {
                let still = reach(&Placement::IDENTITY);
                (still, still)
            }
        };
        (at_from, at_to) = (at_from.max(one), at_to.max(other));
    }
    (at_from, at_to)
}
