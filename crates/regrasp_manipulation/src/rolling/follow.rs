//! Joints with which a finger keeps a contact.

use crate::model::Model;
use regrasp_geometry::UnitVector;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings, Preference};

/// Share of the way to the preferred direction that one step of a redundant finger takes. By hand.
const PREFERENCE_WEIGHT: f64 = 1.0;

/// What is asked of the inverse kinematics of a finger that touches with `normal_in_world`.
pub fn ik_settings(model: &Model, finger: usize, normal_in_world: UnitVector) -> IkSettings {
    let preference = model.fingers[finger].ik.is_redundant().then_some(Preference {
        tip_axis_in_base: -normal_in_world,
        weight: PREFERENCE_WEIGHT,
        damping: 0.0,
    });
    IkSettings { limit_margin: model.fingers[finger].limit_margin, preference, max_step: model.settings.joint_step }
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
