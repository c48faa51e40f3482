//! Transfer paths: the object moves, the contacts stay on it, the fingers follow (paper 000, section 4.2.3).

use super::model::Model;
use super::state::{GraspState, Moment};
use super::workspace::{HandJoints, TipMode, Workspace, tip_target};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, UnitVector, frame, interpolate_pose};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings, Preference};

/// Share of the way to the preferred direction that one step of a redundant finger takes. By hand.
const PREFERENCE_WEIGHT: f64 = 1.0;

/// What is asked of the inverse kinematics of a finger that touches with `normal_in_world`.
pub fn ik_settings(model: &Model, finger: usize, normal_in_world: UnitVector) -> IkSettings {
    let preference = model.fingers[finger]
        .ik
        .is_redundant()
        .then_some(Preference { tip_axis_in_base: -normal_in_world, weight: PREFERENCE_WEIGHT });
    IkSettings { limit_margin: model.settings.limit_margin, preference, max_step: model.settings.joint_step }
}

/// Joints of `finger` that keep `contact` with the object at `world_from_object`, near `seed`.
#[inline]
pub fn follow_contact(
    model: &Model,
    finger: usize,
    contact: &Contact,
    world_from_object: &Placement,
    seed: &Coordinates,
) -> Option<Coordinates> {
    let normal = UnitVector::new_unchecked(world_from_object.vector(&contact.normal_in_object));
    let target = tip_target(world_from_object, contact, model.fingers[finger].tip_radius);
    model.fingers[finger].ik.solve_near(&target, seed, &ik_settings(model, finger, normal))
}

/// Number of steps from `from` to `to` of which none moves a point of the object by more than the step length.
pub fn n_steps(model: &Model, from: &Pose, to: &Pose, step: f64) -> usize {
    let length = frame::pose_distance(from, to, model.turn_length());
    ((length / step).ceil() as usize).max(1)
}

/// Moves the object from `start` towards `goal` as far as the hand can follow.
///
/// Appends the moments after the start to `moments`; returns the share of the way that was made, 1 being all of it.
pub fn transfer(workspace: &mut Workspace, start: &GraspState, goal: &Pose, moments: &mut Vec<Moment>) -> f64 {
    let model = workspace.model;
    workspace.set(&start.world_from_object, &start.joints, &start.contacts);
    let steps = n_steps(model, &start.world_from_object, goal, model.settings.step);
    let mut joints: HandJoints = start.joints.clone();
    for k in 1..=steps {
        let t = k as f64 / steps as f64;
        let pose = if k == steps { *goal } else { interpolate_pose(&start.world_from_object, goal, t) };
        let world_from_object = Placement::from(&pose);
        for finger in 0..model.n_fingers() {
            match follow_contact(model, finger, &start.contacts[finger], &world_from_object, &joints[finger]) {
                Some(solution) => joints[finger] = solution,
                None => return (k - 1) as f64 / steps as f64,
            }
        }
        if !workspace.step(&pose, &joints, TipMode::AllHold) {
            return (k - 1) as f64 / steps as f64;
        }
        moments.push(Moment { world_from_object: pose, joints: joints.clone() });
    }
    1.0
}
