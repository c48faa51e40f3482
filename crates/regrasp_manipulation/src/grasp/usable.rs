//! Whether a finger can make use of a contact.

use crate::relocation::{Foothold, lift_is_within_reach};
use crate::workspace::{TipMode, Workspace};
use regrasp_geometry::collision::Placement;
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// True when `finger`, which touches `contact` with `joints`, can be lifted again and is clear of everything but the other fingers; the
/// workspace has the object in place, and the finger is left there.
pub(super) fn is_usable(
    workspace: &mut Workspace,
    finger: usize,
    contact: &Contact,
    joints: &Coordinates,
    world_from_object: &Placement,
) -> bool {
    let foothold = Foothold { contact: Some(contact), joints };
    if !lift_is_within_reach(workspace.model, world_from_object, finger, &foothold) {
        return false;
    }
    workspace.set_finger(finger, joints);
    let normal_in_world = world_from_object.vector(&contact.normal_in_object);
    let is_clear = workspace.finger_alone_is_clear(finger, TipMode::Near { finger, normal_in_world });
    let blocked_by = workspace.blocking_pair.filter(|_| !is_clear);
    workspace.tried.add(finger, blocked_by);
    is_clear
}
