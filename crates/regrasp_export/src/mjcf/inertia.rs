//! Masses of links and objects, from their shapes: robot models keep none.

use nalgebra::Matrix3;
use regrasp_geometry::mass::solid_properties;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{ConvexHull, Point, Shape, Vector};
use regrasp_scene::Object;
use std::sync::Arc;

/// Density of links, in kg/m^3. Little depends on it: gravity on the hand is compensated, motion is slow, and the inertia of
/// the drives (`armature`) is more.
const LINK_DENSITY: f64 = 1000.0;
/// Least mass of a link, in kilograms; also that of links without shapes.
const LEAST_LINK_MASS: f64 = 0.005;
/// Principal inertia of a link without shapes, in kg m^2: that of a ball of 5 g and 10 mm radius.
const LEAST_LINK_INERTIA: f64 = 2e-7;

/// Mass properties in the frame of a body.
pub(super) struct Inertial {
    /// In kilograms.
    pub mass: f64,
    /// Centre of mass.
    pub center: Point,
    /// Inertia about the centre of mass, axes as the body's.
    pub inertia: Matrix3<f64>,
}

/// Mass properties of a link with these shapes of even density; where they overlap it counts twice.
pub(super) fn of_link<'a>(shapes: impl Iterator<Item = &'a PlacedShape>) -> Inertial {
    let parts: Vec<Inertial> = shapes.filter_map(|placed| of_shape(placed, LINK_DENSITY)).collect();
    let mass: f64 = parts.iter().map(|part| part.mass).sum();
    if !(mass > 0.0) {
        let inertia = Matrix3::identity() * LEAST_LINK_INERTIA;
        return Inertial { mass: LEAST_LINK_MASS, center: Point::origin(), inertia };
    }
    let center = Point::from(parts.iter().map(|part| part.center.coords * part.mass).sum::<Vector>() / mass);
    let mut inertia = Matrix3::identity() * LEAST_LINK_INERTIA;
    for part in &parts {
        let arm = part.center - center;
        inertia += part.inertia + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * part.mass;
    }
    let scale = (LEAST_LINK_MASS / mass).max(1.0);
    Inertial { mass: mass * scale, center, inertia: inertia * scale }
}

fn of_shape(placed: &PlacedShape, density: f64) -> Option<Inertial> {
    let solid = solid_properties(&placed.shape).ok()?;
    let turn = placed.parent_from_shape.rotation.to_rotation_matrix();
    Some(Inertial {
        mass: density * solid.volume,
        center: placed.parent_from_shape * solid.center_of_mass,
        inertia: turn.matrix() * solid.inertia_per_density * turn.matrix().transpose() * density,
    })
}

/// Mass and centre of mass of `object`, with the inertia of an even solid of its shape (of its hull, for an open mesh).
pub(super) fn of_object(object: &Object) -> Inertial {
    let solid = solid_properties(object.solid()).or_else(|error| match &object.shape {
        Shape::Mesh(mesh) => match ConvexHull::new(mesh.vertices()) {
            Ok(hull) => solid_properties(&Shape::Convex(Arc::new(hull))),
            Err(_) => Err(error),
        },
        _ => Err(error),
    });
    let inertia = match solid {
        Ok(solid) => solid.inertia_per_density * (object.mass / solid.volume),
        // A flat sheet: a ball that reaches as far.
        Err(_) => Matrix3::identity() * (0.4 * object.mass * object.radius * object.radius),
    };
    Inertial { mass: object.mass, center: object.center_of_mass, inertia }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_geometry::pose_from;

    #[test]
    fn two_halves_weigh_and_turn_like_the_whole() {
        let half = |z: f64| PlacedShape {
            parent_from_shape: pose_from([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]),
            shape: Shape::Cuboid { half_extents: Vector::new(0.02, 0.03, 0.02) },
        };
        let whole = PlacedShape {
            parent_from_shape: pose_from([0.0, 0.0, 0.02], [0.0, 0.0, 0.0, 1.0]),
            shape: Shape::Cuboid { half_extents: Vector::new(0.02, 0.03, 0.04) },
        };
        let (two, one) = (of_link([half(0.0), half(0.04)].iter()), of_link([whole].iter()));
        assert!((two.mass - one.mass).abs() < 1e-12 && (two.center - one.center).norm() < 1e-12);
        assert!((two.inertia - one.inertia).norm() < 1e-12 * one.inertia.norm().max(1.0));
    }
}
