//! Poses and collision geometry of a URDF.

use super::Meshes;
use crate::import::xml::{Named, Reader, child, children};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_base::diagnostic::number;
use regrasp_base::{Diagnostic, InputError};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, TriangleMesh, Vector};
use roxmltree::Node;
use std::collections::BTreeSet;
use std::sync::Arc;

/// How remarks begin about geometry that was left out.
pub(crate) const DROPPED: &str = "collision geometry dropped";
/// Tags of geometry that are read.
pub(super) const SHAPES: [&str; 5] = ["box", "cylinder", "sphere", "capsule", "mesh"];
/// Greater lengths are nonsense in any unit, in metres; they would turn sums into infinity.
const MAX_LENGTH: f64 = 1e6;

/// The pose in the `<origin>` of `node`; the identity where there is none.
///
/// `rpy` is roll, pitch, yaw about the fixed axes: `R = Rz(yaw) Ry(pitch) Rx(roll)`.
pub(super) fn read_origin(reader: &mut Reader, node: Node, element: Named) -> Option<Pose> {
    let Some(origin) = child(node, "origin") else { return Some(Pose::identity()) };
    let xyz = reader.numbers(origin, "xyz", Some([0.0; 3]), element);
    let rpy = reader.numbers(origin, "rpy", Some([0.0; 3]), element);
    let ([x, y, z], [roll, pitch, yaw]) = (xyz?, rpy?);
    if let Some(far) = [x, y, z].into_iter().find(|length| length.abs() > MAX_LENGTH) {
        refuse_length(reader, origin, "xyz", far, element);
        return None;
    }
    Some(Pose::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
}

/// The elements that the collision geometry of the link at `node` is made of: its collisions, or where it has none and `from_visuals` names it,
/// its visuals.
pub(super) fn elements<'a, 'i>(node: Node<'a, 'i>, from_visuals: &BTreeSet<String>) -> Vec<Node<'a, 'i>> {
    let collisions: Vec<Node> = children(node, "collision").collect();
    let is_named = || node.attribute("name").is_some_and(|name| from_visuals.contains(name));
    if collisions.is_empty() && is_named() { children(node, "visual").collect() } else { collisions }
}

/// The geometry of `elements` of a link, collisions or visuals; problems go to the reader.
pub(super) fn read_collisions(
    reader: &mut Reader,
    elements: &[Node],
    link: &str,
    meshes: &mut Meshes,
) -> Vec<PlacedShape> {
    let element = ("link", link);
    let mut placed = Vec::new();
    for &collision in elements {
        let tag = collision.tag_name().name();
        let known: &[&str] =
            if tag == "visual" { &["origin", "geometry", "material"] } else { &["origin", "geometry"] };
        reader.note_misspelt_children(collision, known, element);
        let parent_from_shape = read_origin(reader, collision, element);
        let shape = match child(collision, "geometry") {
            Some(geometry) => read_shape(reader, geometry, element, meshes),
            None => {
                let place = reader.place(collision);
                let problem = format!("<{tag}> has no <geometry>");
                drop_or_refuse(reader, collision, element, Diagnostic::new("U150", place, problem).into());
                None
            }
        };
        if let (Some(parent_from_shape), Some(shape)) = (parent_from_shape, shape) {
            placed.push(PlacedShape { parent_from_shape, shape });
        }
    }
    placed
}

/// The shape in a `<geometry>`.
fn read_shape(reader: &mut Reader, geometry: Node, element: Named, meshes: &mut Meshes) -> Option<Shape> {
    let known = geometry.children().find(|c| c.is_element() && SHAPES.contains(&c.tag_name().name()));
    let Some(node) = known else {
        let seen: Vec<String> =
            geometry.children().filter(Node::is_element).map(|c| format!("<{}>", c.tag_name().name())).collect();
        let problem = match seen.as_slice() {
            [] => "<geometry> is empty".to_owned(),
            seen => format!("<geometry> has only {}, which is not known", seen.join(", ")),
        };
        let place = reader.place(geometry);
        let diagnostic =
            Diagnostic::new("U150", place, problem).expected("one of <box>, <cylinder>, <sphere>, <capsule>, <mesh>");
        drop_or_refuse(reader, geometry, element, diagnostic.into());
        return None;
    };
    match node.tag_name().name() {
        "mesh" => read_mesh(reader, node, element, meshes),
        _ => read_primitive(reader, node, element),
    }
}

/// The shape of `node`, a box, ball, capsule or cylinder.
pub(super) fn read_primitive(reader: &mut Reader, node: Node, element: Named) -> Option<Shape> {
    match node.tag_name().name() {
        "box" => {
            let size = reader.numbers::<3>(node, "size", None, element)?;
            for length in size {
                checked_length(reader, node, "size", length, element)?;
            }
            Some(Shape::Cuboid { half_extents: Vector::from(size) / 2.0 })
        }
        "sphere" => Some(Shape::Sphere { radius: positive(reader, node, "radius", element)? }),
        round => {
            let radius = positive(reader, node, "radius", element);
            let half_length = positive(reader, node, "length", element).map(|length| length / 2.0);
            let (radius, half_length) = (radius?, half_length?);
            Some(match round {
                "capsule" => Shape::Capsule { half_length, radius },
                _ => Shape::Cylinder { half_length, radius },
            })
        }
    }
}

fn positive(reader: &mut Reader, node: Node, name: &str, element: Named) -> Option<f64> {
    let [value] = reader.numbers::<1>(node, name, None, element)?;
    checked_length(reader, node, name, value, element)
}

fn checked_length(reader: &mut Reader, node: Node, name: &str, value: f64, element: Named) -> Option<f64> {
    if value > 0.0 && value <= MAX_LENGTH {
        return Some(value);
    }
    refuse_length(reader, node, name, value, element);
    None
}

fn refuse_length(reader: &mut Reader, node: Node, name: &str, value: f64, element: Named) {
    let expected =
        if value.abs() > MAX_LENGTH { "metres, and not millions of them" } else { "a length above 0, in metres" };
    let (tag, place) = (node.tag_name().name(), reader.attribute_place(node, name));
    reader.found.push(
        Diagnostic::new("U151", place, format!("{name} of <{tag}> is {}", number(value)))
            .element(element.0, element.1)
            .expected(expected),
    );
}

fn read_mesh(reader: &mut Reader, node: Node, element: Named, meshes: &mut Meshes) -> Option<Shape> {
    let scale = reader.numbers(node, "scale", Some([1.0; 3]), element);
    let scale = scale.and_then(|scale| {
        if scale.iter().all(|s| *s != 0.0) {
            return Some(Vector::from(scale));
        }
        let place = reader.attribute_place(node, "scale");
        let seen = node.attribute("scale").unwrap_or_default();
        reader.found.push(
            Diagnostic::new("U152", place, format!("scale of <mesh> is \"{seen}\""))
                .element(element.0, element.1)
                .expected("three factors that are not 0"),
        );
        None
    });
    // An empty name is the resolver's to refuse.
    let name = match node.attribute("filename") {
        Some(name) => name,
        None => reader.required(node, "filename", element)?,
    };
    let place = reader.attribute_place(node, "filename");
    let found = meshes.get(name, reader.file, place.clone(), reader);
    let scale = scale?;
    let scaled = found.and_then(|mesh| {
        if scale == Vector::repeat(1.0) {
            return Ok(mesh);
        }
        let scaled: Result<TriangleMesh, _> = mesh.scaled(scale);
        scaled.map(Arc::new).map_err(|error| {
            Diagnostic::new("U152", place, format!("\"{name}\" cannot be scaled by {scale:?}: {error}")).into()
        })
    });
    match scaled {
        Ok(mesh) => {
            if scale.x * scale.y * scale.z < 0.0 {
                reader.note(
                    node,
                    element,
                    format!("\"{name}\" is mirrored by its scale; its triangles are turned back"),
                );
            }
            Some(Shape::Mesh(mesh))
        }
        Err(error) => {
            drop_or_refuse(reader, node, element, error);
            None
        }
    }
}

/// Reports `error`, or drops the geometry with a note when the reader is lenient.
fn drop_or_refuse(reader: &mut Reader, node: Node, element: Named, error: InputError) {
    if reader.lenient {
        let causes: Vec<&str> = error.diagnostics.iter().map(|d| d.problem.as_str()).collect();
        reader.note(node, element, format!("{DROPPED}: {}", causes.join("; ")));
        return;
    }
    for diagnostic in error.diagnostics {
        let named = diagnostic.element.is_empty();
        reader.found.push(if named { diagnostic.element(element.0, element.1) } else { diagnostic });
    }
}
