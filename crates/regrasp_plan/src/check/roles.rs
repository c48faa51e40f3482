//! What fingers do in a segment: which one moves, which are free, which contacts are the same.

use crate::check::model::CheckedHand;
use crate::plan::{ContactState, Segment, SegmentKind};
use regrasp_geometry::{UnitVector, Vector};

/// True when finger `f` is free at every waypoint of the segment.
pub fn is_free_throughout(segment: &Segment, f: usize) -> bool {
    segment.waypoints.iter().all(|waypoint| !waypoint.contacts[f].holds())
}

/// Index of the finger that moves in a regrasp, where it names one of the hand's; none in a transfer, whatever it names.
pub fn moving_finger(model: &CheckedHand, segment: &Segment) -> Option<usize> {
    let name = segment.moving_finger.as_deref().filter(|_| segment.kind == SegmentKind::Regrasp)?;
    model.fingers.iter().position(|finger| finger.name == name)
}

/// The contact as the closure test takes it.
pub fn contact_of(state: &ContactState) -> Option<regrasp_grasp::Contact> {
    Some(regrasp_grasp::Contact {
        point_in_object: state.point_in_object?.into(),
        normal_in_object: UnitVector::new_normalize(Vector::from(state.normal_in_object?)),
    })
}

/// True when both hold at the same place with the same normal, at a fixed contact or rolling, or both are free.
pub fn contacts_agree(a: &ContactState, b: &ContactState, tolerance: f64) -> bool {
    let near = |p: Option<[f64; 3]>, q: Option<[f64; 3]>| match (p, q) {
        (Some(p), Some(q)) => (Vector::from(p) - Vector::from(q)).norm() <= tolerance,
        (None, None) => true,
        _ => false,
    };
    a.holds() == b.holds() && near(a.point_in_object, b.point_in_object) && near(a.normal_in_object, b.normal_in_object)
}
