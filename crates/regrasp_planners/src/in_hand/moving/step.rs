//! One step of the object, with fingers that follow.

use arrayvec::ArrayVec;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::frame::PoseLine;
use regrasp_geometry::{Point, Pose, frame};
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::state::{HandJoints, MAX_FINGERS, Moment};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::rolling::follow::follow_contact;
use regrasp_manipulation::rolling::step::{NoStep, RollStep};
use regrasp_manipulation::tolerances::CONTACT_TOLERANCE;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Number of steps from `from` to `to` of which none moves a point of the object by more than the step length.
pub fn n_steps(model: &Model, from: &Pose, to: &Pose, step: f64) -> usize {
    let length = frame::pose_distance(from, to, model.turn_length());
    ((length / step).ceil() as usize).max(1)
}

/// Turns about contact normals in a step, in radians, of each finger that restricts the object's motion.
pub type Spins = ArrayVec<f64, { 2 * MAX_FINGERS }>;

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
            if !rolled.keeps_off_edges(model, &contacts[finger]) {
                return Err(NoStep::OutOfReach);
            }
            if model.restricts_motion(finger) {
                spins.push(rolled.spin);
            }
            let ends = [contacts[finger].point_in_object, rolled.contact.point_in_object];
            if !travels_evenly(ends, rolled.halfway.as_ref()) {
                return Err(NoStep::TooLong);
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

/// Longest way of a contact over the object in one step, in metres, and how far it may be half-way from the middle between its ends.
const TRAVEL: (f64, f64) = (8e-3, 1e-3);

/// True unless a contact sweeps too far over the object in a step. Forces change evenly from one waypoint to the next: where a flat pad tips
/// over, and its contact goes from one rim to the other within a degree or two, they balance at both ends and not between.
fn travels_evenly([from, to]: [Point; 2], halfway: Option<&Contact>) -> bool {
    let (longest, uneven) = TRAVEL;
    let is_near = |halfway: &Contact| (halfway.point_in_object - nalgebra::center(&from, &to)).norm() <= uneven;
    (to - from).norm() <= longest && halfway.is_none_or(is_near)
}

/// How far a tip may stray from its contact half-way, in metres: a share of the tolerance; the rest is for what lies between.
pub const HALFWAY_ALLOWED: f64 = 0.7 * CONTACT_TOLERANCE;

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
    if finger.curved.is_none() && finger.tip_bound.chord_deviation(&change) < 0.5 * HALFWAY_ALLOWED {
        return true;
    }
    let joints: Coordinates = from.iter().zip(&change).map(|(q, dq)| q + 0.5 * dq).collect();
    let target = finger.center_touching(&halfway(), contact, &joints);
    (finger.ik.tip(&joints) - target).norm() <= HALFWAY_ALLOWED
}
