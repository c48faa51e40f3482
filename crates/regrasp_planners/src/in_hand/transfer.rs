//! Transfer paths: the object moves, the contacts stay on it, the fingers follow (paper 000, section 4.2.3).

use super::model::Model;
use super::record::CONTACT_TOLERANCE;
use super::state::{GraspState, Moment};
use super::workspace::{HandJoints, TipMode, Workspace, tip_target};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::frame::{self, PoseLine};
use regrasp_geometry::{Pose, UnitVector, interpolate_pose};
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
    workspace.set_state(start);
    follow(workspace.model, start, goal, moments, |there| {
        workspace.step(&there.world_from_object, &there.joints, TipMode::AllHold)
    })
}

/// As [`transfer`], with collisions left to `is_clear`, which is asked about each step to the moment it is given. Without
/// it the same moments come out: that is how a transfer that was proven once is carried out again.
pub fn follow(
    model: &Model,
    start: &GraspState,
    goal: &Pose,
    moments: &mut Vec<Moment>,
    mut is_clear: impl FnMut(&Moment) -> bool,
) -> f64 {
    let steps = n_steps(model, &start.world_from_object, goal, model.settings.step);
    let line = PoseLine::between(&start.world_from_object, goal);
    let shortest = 1.0 / (steps << MAX_HALVINGS) as f64;
    let mut pending: Vec<f64> = (1..=steps).rev().map(|k| k as f64 / steps as f64).collect();
    let mut made = 0.0;
    let first = Moment { world_from_object: start.world_from_object, joints: start.joints.clone() };
    moments.reserve(steps);
    let n_before = moments.len();
    while let Some(t) = pending.pop() {
        let pose = if t == 1.0 { *goal } else { line.at(t) };
        let world_from_object = Placement::from(&pose);
        let here = moments[n_before..].last().unwrap_or(&first);
        let mut joints = HandJoints::new();
        for finger in 0..model.n_fingers() {
            if !start.holds(finger) {
                // What is free stays where it is.
                joints.push(here.joints[finger].clone());
                continue;
            }
            match follow_contact(model, finger, &start.contacts[finger], &world_from_object, &here.joints[finger]) {
                Some(solution) => joints.push(solution),
                None => return made,
            }
        }
        let there = Moment { world_from_object: pose, joints };
        if !tips_stay(model, start, here, &there) {
            if t - made <= shortest {
                return made;
            }
            pending.extend([t, 0.5 * (made + t)]);
            continue;
        }
        if !is_clear(&there) {
            return made;
        }
        moments.push(there);
        made = t;
    }
    1.0
}

/// Most often that a step is halved because fingertips stray from their contacts on the way.
const MAX_HALVINGS: usize = 4;
/// Share of the contact tolerance that a tip may stray half-way; the rest is for what lies between.
const HALFWAY_SHARE: f64 = 0.7;

/// True when every tip that holds stays on its contact while the joints move linearly.
fn tips_stay(model: &Model, state: &GraspState, from: &Moment, to: &Moment) -> bool {
    let mut half: Option<Placement> = None;
    let mut halfway = || {
        *half.get_or_insert_with(|| {
            Placement::from(&interpolate_pose(&from.world_from_object, &to.world_from_object, 0.5))
        })
    };
    (0..model.n_fingers())
        .filter(|&f| state.holds(f))
        .all(|f| tip_stays(model, f, &state.contacts[f], &from.joints[f], &to.joints[f], &mut halfway))
}

/// True when the tip of `finger` stays on its contact while its joints move linearly: half-way, where it strays most.
/// `halfway` places the object there.
pub fn tip_stays(
    model: &Model,
    finger: usize,
    contact: &Contact,
    from: &Coordinates,
    to: &Coordinates,
    mut halfway: impl FnMut() -> Placement,
) -> bool {
    let allowed = HALFWAY_SHARE * CONTACT_TOLERANCE;
    let finger = &model.fingers[finger];
    let change: Coordinates = from.iter().zip(to).map(|(a, b)| b - a).collect();
    // What the joints' bound proves needs no look; the object strays as little as the shortest step of a finger.
    if finger.tip_bound.chord_deviation(&change) < 0.5 * allowed {
        return true;
    }
    let joints: Coordinates = from.iter().zip(&change).map(|(q, dq)| q + 0.5 * dq).collect();
    let target = tip_target(&halfway(), contact, finger.tip_radius);
    (finger.ik.tip(&joints) - target).norm() <= allowed
}
