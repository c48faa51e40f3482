//! Shapes, poses and masses as MJCF elements.

use super::inertia::Inertial;
use super::xml::{Xml, numbers};
use regrasp_geometry::mass::solid_properties;
use regrasp_geometry::{ConvexHull, Point, Pose, Shape};
use std::sync::Arc;

/// A mesh whose hull has this much more volume is not convex for a note.
pub(super) const CONVEX_WITHIN: f64 = 0.01;
/// The pattern of objects: turning shows on a pattern only.
pub(super) const OBJECT_MATERIAL: &str = "object";

/// A geom to be written.
pub(super) struct Geom<'a> {
    pub name: &'a str,
    pub look: Look<'a>,
    pub body_from_shape: Pose,
    pub shape: &'a Shape,
}

/// How a geom looks.
pub(super) enum Look<'a> {
    /// In one colour.
    Color(&'a str),
    /// As an object.
    Checkers,
}

pub(super) fn write_geom(xml: &mut Xml, geom: &Geom) {
    let (kind, size) = match geom.shape {
        Shape::Sphere { radius } => ("sphere", vec![*radius]),
        Shape::Capsule { half_length, radius } => ("capsule", vec![*radius, *half_length]),
        Shape::Cylinder { half_length, radius } => ("cylinder", vec![*radius, *half_length]),
        Shape::Cuboid { half_extents } => ("box", half_extents.iter().copied().collect()),
        Shape::Ellipsoid { radii } => ("ellipsoid", radii.iter().copied().collect()),
        Shape::Convex(_) | Shape::Mesh(_) => ("mesh", Vec::new()),
    };
    let [pos, quat] = place(&geom.body_from_shape);
    let mut attributes = vec![("name", geom.name.to_owned()), ("type", kind.to_owned()), pos, quat];
    attributes.push(if kind == "mesh" { ("mesh", geom.name.to_owned()) } else { ("size", numbers(size)) });
    attributes.push(match geom.look {
        Look::Color(color) => ("rgba", color.to_owned()),
        Look::Checkers => ("material", OBJECT_MATERIAL.to_owned()),
    });
    xml.leaf("geom", &attributes);
}

/// The mesh of a geom, for shapes that need one.
pub(super) fn write_mesh(xml: &mut Xml, shape: &Shape, name: &str) {
    let vertices: Vec<Point> = match shape {
        Shape::Convex(hull) => hull.vertices().to_vec(),
        // MuJoCo collides with the hull whatever it is given.
        Shape::Mesh(mesh) => match ConvexHull::new(mesh.vertices()) {
            Ok(hull) => hull.vertices().to_vec(),
            Err(_) => mesh.vertices().to_vec(),
        },
        _ => return,
    };
    let coordinates = vertices.iter().flat_map(|vertex| [vertex.x, vertex.y, vertex.z]);
    xml.leaf("mesh", &[("name", name.to_owned()), ("inertia", "convex".into()), ("vertex", numbers(coordinates))]);
}

/// The shape that MuJoCo collides with.
pub(super) fn as_collided(shape: &Shape) -> Shape {
    match shape {
        Shape::Mesh(mesh) => {
            ConvexHull::new(mesh.vertices()).map_or_else(|_| shape.clone(), |hull| Shape::Convex(Arc::new(hull)))
        }
        _ => shape.clone(),
    }
}

/// True where the shape that MuJoCo collides with is clearly larger.
pub(super) fn is_hollowed(shape: &Shape) -> bool {
    let Shape::Mesh(mesh) = shape else { return false };
    let (Ok(solid), Ok(hull)) = (solid_properties(shape), ConvexHull::new(mesh.vertices())) else { return true };
    solid_properties(&Shape::Convex(Arc::new(hull)))
        .is_ok_and(|hull| hull.volume > solid.volume * (1.0 + CONVEX_WITHIN))
}

/// Whether gravity acts on a body.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Weight {
    /// It does.
    Falls,
    /// It is compensated.
    Compensated,
}

pub(super) fn open_body(xml: &mut Xml, name: String, parent_from_body: &Pose, weight: Weight) {
    let [pos, quat] = place(parent_from_body);
    let mut attributes = vec![("name", name), pos, quat];
    if weight == Weight::Compensated {
        attributes.push(("gravcomp", "1".into()));
    }
    xml.open("body", &attributes);
}

pub(super) fn write_inertial(xml: &mut Xml, inertial: &Inertial) {
    let m = &inertial.inertia;
    xml.leaf(
        "inertial",
        &[
            ("pos", numbers(inertial.center.iter().copied())),
            ("mass", numbers([inertial.mass])),
            ("fullinertia", numbers([m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(0, 1)], m[(0, 2)], m[(1, 2)]])),
        ],
    );
}

/// Position and orientation; MuJoCo's quaternions are w x y z.
fn place(pose: &Pose) -> [(&'static str, String); 2] {
    let q = pose.rotation.coords;
    [("pos", numbers(pose.translation.vector.iter().copied())), ("quat", numbers([q.w, q.x, q.y, q.z]))]
}
