//! Support functions of convex shapes.
//!
//! A shape is seen as a core grown by a radius: a sphere is a point, a capsule a segment. That makes GJK exact on the
//! rounded shapes that hands are full of.

use super::placement::Placement;
use crate::frame::{Point, Vector};
use crate::shape::Shape;

/// Radius by which the core of `shape` is grown.
#[inline]
pub fn core_radius(shape: &Shape) -> f64 {
    match shape {
        Shape::Sphere { radius } | Shape::Capsule { radius, .. } => *radius,
        _ => 0.0,
    }
}

/// Farthest point of the core of `shape` along `direction`, both in the shape's frame.
///
/// Panics on a mesh, which has no core; see [`super::mesh_tree`].
#[inline]
pub fn core_support(shape: &Shape, direction: &Vector, hint: &mut u32) -> Point {
    match shape {
        Shape::Sphere { .. } => Point::origin(),
        Shape::Capsule { half_length, .. } => Point::new(0.0, 0.0, half_length.copysign(direction.z)),
        Shape::Cuboid { half_extents: h } => {
            Point::new(h.x.copysign(direction.x), h.y.copysign(direction.y), h.z.copysign(direction.z))
        }
        Shape::Cylinder { half_length, radius } => {
            let flat = direction.x.hypot(direction.y);
            let scale = if flat > 0.0 { radius / flat } else { 0.0 };
            // The quotient overflows when the direction is within 1e-300 of the axis.
            let [x, y] = match scale.is_finite() {
                true => [direction.x * scale, direction.y * scale],
                false => [direction.x / flat * radius, direction.y / flat * radius],
            };
            Point::new(x, y, half_length.copysign(direction.z))
        }
        Shape::Ellipsoid { radii } => {
            let scaled = direction.component_mul(radii);
            let norm = scaled.norm();
            if norm > 0.0 { Point::from(scaled.component_mul(radii) / norm) } else { Point::origin() }
        }
        Shape::Convex(hull) => hull.support(direction, hint),
        Shape::Mesh(_) => panic!("a mesh has no support function; use its MeshTree"),
    }
}

/// Largest value of `direction . x` over the shape, with `direction` a unit vector in the shape's frame.
#[inline]
pub fn support_value(shape: &Shape, direction: &Vector, hint: &mut u32) -> f64 {
    match shape {
        Shape::Sphere { radius } => *radius,
        Shape::Capsule { half_length, radius } => half_length * direction.z.abs() + radius,
        Shape::Cuboid { half_extents } => half_extents.dot(&direction.abs()),
        Shape::Cylinder { half_length, radius } => {
            half_length * direction.z.abs() + radius * (direction.x * direction.x + direction.y * direction.y).sqrt()
        }
        Shape::Ellipsoid { radii } => direction.component_mul(radii).norm(),
        Shape::Convex(hull) => direction.dot(&hull.support(direction, hint).coords),
        Shape::Mesh(mesh) => mesh.vertices().iter().map(|v| direction.dot(&v.coords)).fold(f64::NEG_INFINITY, f64::max),
    }
}

/// Gap between two placed shapes along the unit `direction` (in their common parent), which points from `a` to `b`.
///
/// Where it is positive the shapes are at least that far apart. Where it is `-d`, they penetrate by at most `d`.
#[inline]
pub fn gap_along(
    direction: &Vector,
    a: &Shape,
    parent_from_a: &Placement,
    b: &Shape,
    parent_from_b: &Placement,
    hints: &mut [u32; 2],
) -> f64 {
    let in_a = parent_from_a.vector_to_child(direction);
    let in_b = parent_from_b.vector_to_child(&-direction);
    direction.dot(&(parent_from_b.translation - parent_from_a.translation))
        - support_value(a, &in_a, &mut hints[0])
        - support_value(b, &in_b, &mut hints[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_support_of_a_cylinder_is_on_its_rim_however_near_its_axis_the_direction_is() {
        let shape = Shape::Cylinder { half_length: 0.005, radius: 0.055 };
        for tiny in [1e-3, 1e-200, 1e-300, 1e-310, 5e-324] {
            let found = core_support(&shape, &Vector::new(0.0, -tiny, 1.0), &mut 0);
            assert!((found - Point::new(0.0, -0.055, 0.005)).norm() < 1e-12, "{tiny}: {found}");
        }
    }
}
