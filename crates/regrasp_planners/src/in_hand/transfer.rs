//! Transfer paths: the object moves, the fingers follow, with contacts that stay on it (paper 000, section 4.2.3) or roll
//! over it (paper 004, section IV-C).

use super::forces::balances;
use super::model::{MAX_FINGERS, Model};
use super::record::CONTACT_TOLERANCE;
use super::roll::{NoStep, RollStep};
use super::spin;
use super::state::{GraspState, Moment};
use super::workspace::{HandJoints, TipMode, Workspace};
use arrayvec::ArrayVec;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::frame::{self, PoseLine};
use regrasp_geometry::{Pose, UnitVector};
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
    model.fingers[finger].touch_near(world_from_object, contact, seed, &ik_settings(model, finger, normal))
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
    if !holds_weight(workspace, &start.moment(), start.holding) {
        return 0.0;
    }
    workspace.set_state(start);
    follow(workspace.model, start, goal, moments, |there| {
        workspace.roll_to(&there.contacts);
        workspace.step(&there.world_from_object, &there.joints, TipMode::AllHold)
            && holds_weight(workspace, there, start.holding)
    })
}

/// True when `moments` of a transfer from `start` are clear of collisions, with forces that hold the weight.
pub fn is_carried_out(workspace: &mut Workspace, start: &GraspState, moments: &[Moment]) -> bool {
    if !holds_weight(workspace, &start.moment(), start.holding) {
        return false;
    }
    workspace.set_state(start);
    moments.iter().all(|there| {
        workspace.roll_to(&there.contacts);
        workspace.step(&there.world_from_object, &there.joints, TipMode::AllHold)
            && holds_weight(workspace, there, start.holding)
    })
}

fn holds_weight(workspace: &mut Workspace, there: &Moment, holding: u32) -> bool {
    balances(workspace, &there.world_from_object, &there.joints, &there.contacts, holding)
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
    if spin::is_restricted(model, start.holding) {
        return spin::pursue(model, start, goal, moments, is_clear);
    }
    let steps = n_steps(model, &start.world_from_object, goal, model.settings.step);
    let line = PoseLine::between(&start.world_from_object, goal);
    let shortest = 1.0 / (steps << MAX_HALVINGS) as f64;
    let mut pending: Vec<f64> = (1..=steps).rev().map(|k| k as f64 / steps as f64).collect();
    let mut made = 0.0;
    let first = start.moment();
    moments.reserve(steps);
    let n_before = moments.len();
    while let Some(t) = pending.pop() {
        let pose = if t == 1.0 { *goal } else { line.at(t) };
        let here = moments[n_before..].last().unwrap_or(&first);
        let there = match step(model, start, here, &pose) {
            Ok(there) => there,
            Err(NoStep::TooLong) if t - made > shortest => {
                pending.extend([t, 0.5 * (made + t)]);
                continue;
            }
            Err(_) => return made,
        };
        if !is_clear(&there) {
            return made;
        }
        moments.push(there);
        made = t;
    }
    1.0
}

/// Turns about contact normals in a step, in radians, of each finger that restricts the object's motion.
pub type Spins = ArrayVec<f64, { 2 * MAX_FINGERS }>;

/// One step of the object to `pose`, with fingers that follow; the ones that hold are closed there.
fn step(model: &Model, start: &GraspState, here: &Moment, pose: &Pose) -> Result<Moment, NoStep> {
    let there = step_joints(model, start.holding, here, pose)?.0;
    if is_closed(model, &there, start.holding) { Ok(there) } else { Err(NoStep::OutOfReach) }
}

/// True unless contacts that roll no longer hold the object.
pub fn is_closed(model: &Model, there: &Moment, holding: u32) -> bool {
    !model.any_rolls() || model.closure_margin(&there.contacts, holding) >= model.settings.closure_margin
}

/// One step of the object to `pose`, with fingers of `holding` that follow, and how they turn about their normals.
pub fn step_joints(model: &Model, holding: u32, here: &Moment, pose: &Pose) -> Result<(Moment, Spins), NoStep> {
    let (from, to) = (Placement::from(&here.world_from_object), Placement::from(pose));
    let line = PoseLine::between(&here.world_from_object, pose);
    let between = |t: f64| Placement::from(&line.at(t));
    let mut joints = HandJoints::new();
    let mut contacts = here.contacts.clone();
    let mut halfway = here.contacts.clone();
    let mut spins = Spins::new();
    for finger in 0..model.n_fingers() {
        let own = &here.joints[finger];
        joints.push(if holding & (1 << finger) == 0 {
            // What is free stays where it is.
            own.clone()
        } else if model.rolls(finger) {
            let rolled =
                RollStep::new(model, finger, &contacts[finger], own, &from, &to).fine(between, HALFWAY_ALLOWED)?;
            if !rolled.keeps_off_edges(model) {
                return Err(NoStep::OutOfReach);
            }
            if model.restricts_motion(finger) {
                spins.push(rolled.spin);
            }
            contacts[finger] = rolled.contact;
            halfway[finger] = rolled.halfway.unwrap_or(rolled.contact);
            rolled.joints
        } else {
            let there = follow_contact(model, finger, &contacts[finger], &to, own).ok_or(NoStep::OutOfReach)?;
            if !tip_stays(model, finger, &contacts[finger], own, &there, || between(0.5)) {
                return Err(NoStep::TooLong);
            }
            there
        });
    }
    // Contacts travel between waypoints too, and the grasp closes there as well: a shorter step may do.
    if model.any_rolls() && model.closure_margin(&halfway, holding) < model.settings.closure_margin {
        return Err(NoStep::TooLong);
    }
    Ok((Moment { world_from_object: *pose, joints, contacts }, spins))
}

/// Most often that a step is halved because fingertips stray from their contacts on the way.
const MAX_HALVINGS: usize = 4;
/// How far a tip may stray from its contact half-way, in metres: a share of the tolerance; the rest is for what lies between.
const HALFWAY_ALLOWED: f64 = 0.7 * CONTACT_TOLERANCE;

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
    let finger = &model.fingers[finger];
    let change: Coordinates = from.iter().zip(to).map(|(a, b)| b - a).collect();
    // What the joints' bound proves needs no look; the object strays as little as the shortest step of a finger.
    if finger.ellipsoid.is_none() && finger.tip_bound.chord_deviation(&change) < 0.5 * HALFWAY_ALLOWED {
        return true;
    }
    let joints: Coordinates = from.iter().zip(&change).map(|(q, dq)| q + 0.5 * dq).collect();
    let target = finger.center_touching(&halfway(), contact, &joints);
    (finger.ik.tip(&joints) - target).norm() <= HALFWAY_ALLOWED
}
