//! What a waypoint says when it is read back.

use crate::grasp::state::HandJoints;
use crate::model::Model;
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_plan::plan::{ContactState, Waypoint};

/// The contact that is written down; None for a finger that is free.
pub fn contact_of(state: &ContactState) -> Option<Contact> {
    let (point, normal) = (state.point_in_object?, state.normal_in_object?);
    let normal_in_object = UnitVector::new_unchecked(Vector::from(normal));
    Some(Contact { point_in_object: Point::from(point), normal_in_object })
}

/// Joints of all fingers at a waypoint.
pub fn joints_of(model: &Model, waypoint: &Waypoint) -> HandJoints {
    let mut rest = waypoint.joints.as_slice();
    model
        .fingers
        .iter()
        .map(|finger| {
            let (own, others) = rest.split_at(finger.ik.chain().n_coordinates().min(rest.len()));
            rest = others;
            own.iter().copied().collect()
        })
        .collect()
}
