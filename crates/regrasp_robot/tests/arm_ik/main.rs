//! Inverse kinematics of arms: the closed form against forward kinematics and against walks along the self-motion, the numeric method
//! on arms of the shared models, and what is out of reach.

#[path = "../../../../tests/support/places.rs"]
mod places;

mod closed_form;
mod real_arms;

use regrasp_geometry::Pose;
use regrasp_geometry::frame::rotation_between;
use regrasp_robot::Chain;

/// Distance and angle between a pose and that of the last body in a posture.
fn miss(chain: &Chain, last_from_mount: &Pose, joints: &[f64], target: &Pose) -> f64 {
    let mut poses = Vec::new();
    chain.forward(joints, &mut poses);
    let reached = poses[poses.len() - 1] * last_from_mount;
    let way = (reached.translation.vector - target.translation.vector).norm();
    way.max(rotation_between(&reached, target).norm())
}

/// Largest difference of joints, whole turns apart.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let turn = std::f64::consts::TAU;
    a.iter().zip(b).map(|(a, b)| (a - b - turn * ((a - b) / turn).round()).abs()).fold(0.0, f64::max)
}
