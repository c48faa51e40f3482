//! Surfaces one can sample by area, walk by geodesics, and ask for normals, curvature and creases.

use crate::frame::{Point, UnitVector};

/// A point of an object's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position, in the object frame.
    pub point_in_object: Point,
    /// Outward unit normal, in the object frame.
    pub normal_in_object: UnitVector,
    /// Face of a primitive or triangle of a mesh that the point lies on.
    pub facet: u32,
}

/// The surface of a shape.
#[derive(Debug, Clone)]
pub struct Surface {}
