//! Contact forces and joint torques along a plan.
//!
//! In a transfer they are found anew at every waypoint, as contacts, gravity and fingers move in the object's frame; in a
//! regrasp once, for the fingers that rest. Between two segments one set of forces gives way to the other linearly: both
//! balance, at one pose, and all limits are convex.

use crate::forces::held::Held;
use crate::forces::limits::{ForceModel, Unbalanced};
use crate::grasp::state::{Contacts, no_contact};
use crate::model::Model;
use crate::recording::waypoint::{contact_of, joints_of};
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::ContactModel;
use regrasp_grasp::wrench::BalancedForces;
use regrasp_plan::plan::{ForcePromises, Segment, SegmentKind, Waypoint};

/// Writes forces and torques into all waypoints; what they promise. None where the settings want none.
///
/// Errors: a moment at which there are none, and why.
pub fn add_forces(model: &Model, segments: &mut [Segment]) -> Result<Option<ForcePromises>, Unbalanced> {
    let Some(forces) = &model.forces else { return Ok(None) };
    for index in 0..segments.len() {
        let (before, rest) = segments.split_at_mut(index);
        let segment = &mut rest[0];
        match segment.kind {
            SegmentKind::Transfer => {
                let goes_on = before.last().filter(|before| before.kind == SegmentKind::Transfer);
                in_transfer(model, forces, segment, goes_on.and_then(|before| before.waypoints.last()))?;
            }
            SegmentKind::Regrasp => in_regrasp(model, forces, segment)?,
            // The tracking planner finds its own, step by step.
            SegmentKind::Tracking => {}
        }
    }
    Ok(Some(forces.promises()))
}

/// `before` is where a transfer ended that this one goes on from: forces do not change in between.
fn in_transfer(
    model: &Model,
    forces: &ForceModel,
    segment: &mut Segment,
    before: Option<&Waypoint>,
) -> Result<(), Unbalanced> {
    let mut warm: Option<BalancedForces> = None;
    for (index, waypoint) in segment.waypoints.iter_mut().enumerate() {
        let held = held(model, forces, waypoint, None);
        let found = held.forces(model, forces, warm.as_ref())?;
        write(model, &held, &found, waypoint);
        if let (0, Some(before)) = (index, before) {
            for (own, last) in waypoint.contacts.iter_mut().zip(&before.contacts) {
                (own.force_in_object, own.torsion) = (last.force_in_object, last.torsion);
            }
            waypoint.joint_torques.clone_from(&before.joint_torques);
        }
        warm = Some(found);
    }
    Ok(())
}

fn in_regrasp(model: &Model, forces: &ForceModel, segment: &mut Segment) -> Result<(), Unbalanced> {
    let moving = segment.moving_finger.as_ref();
    let moving = moving.and_then(|name| model.view.hand.finger_named(name)).map(|finger| finger.0);
    let Some(first) = segment.waypoints.first() else { return Ok(()) };
    let held = held(model, forces, first, moving);
    let found = held.forces(model, forces, None)?;
    segment.waypoints.iter_mut().for_each(|waypoint| write(model, &held, &found, waypoint));
    Ok(())
}

/// The fingers that hold at a waypoint, but for one that is about to leave.
fn held(model: &Model, forces: &ForceModel, waypoint: &Waypoint, moving: Option<usize>) -> Held {
    let mut holding = 0;
    let mut contacts = Contacts::new();
    for (finger, state) in waypoint.contacts.iter().enumerate() {
        let contact = contact_of(state).filter(|_| moving != Some(finger));
        holding |= u32::from(contact.is_some()) << finger;
        contacts.push(contact.unwrap_or_else(no_contact));
    }
    let world_from_object = Placement::from(&Pose::from(&waypoint.world_from_object));
    let joints = joints_of(model, waypoint);
    Held::new(model, forces, &world_from_object, &contacts, holding, |finger| &joints[finger])
}

/// Forces of the fingers that hold; none of one that has just landed or is about to lift.
fn write(model: &Model, held: &Held, found: &BalancedForces, waypoint: &mut Waypoint) {
    waypoint.joint_torques.clear();
    for (finger, state) in waypoint.contacts.iter_mut().enumerate() {
        let of_model = &model.fingers[finger];
        let index = held.fingers.iter().position(|&holding| holding == finger);
        if let Some(index) = index {
            waypoint.joint_torques.extend(held.torques(index, &found[index]));
        } else {
            let n_joints = of_model.ik.chain().n_coordinates();
            waypoint.joint_torques.extend(std::iter::repeat_n(0.0, n_joints));
        }
        if state.holds() {
            let exerted = index.map(|index| found[index]);
            state.force_in_object = Some(exerted.map_or([0.0; 3], |exerted| exerted.force.into()));
            let is_soft = matches!(of_model.contact, ContactModel::SoftFinger { .. });
            state.torsion = is_soft.then(|| exerted.map_or(0.0, |exerted| exerted.torsion));
        }
    }
}
