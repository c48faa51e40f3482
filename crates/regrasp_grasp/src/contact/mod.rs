//! Contacts of fingertips on the object.

/// Point contact with Coulomb friction: the exact second-order cone.
pub mod friction_cone;

use regrasp_geometry::{Point, UnitVector};

/// A contact on the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Where, in the object frame.
    pub point_in_object: Point,
    /// Outward normal of the object there, in the object frame.
    pub normal_in_object: UnitVector,
}
