//! Volume, centre of mass and mesh files, until `regrasp_geometry::mass` and `regrasp_geometry::import` are here.

use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_geometry::{Point, Shape, TriangleMesh, Vector};
use std::f64::consts::PI;
use std::path::Path;

pub(super) struct SolidProperties {
    pub volume: f64,
    pub center_of_mass: Point,
}

pub(super) fn solid_properties(shape: &Shape) -> Result<SolidProperties, String> {
    let centered = |volume: f64| Ok(SolidProperties { volume, center_of_mass: Point::origin() });
    match shape {
        Shape::Sphere { radius } => centered(4.0 / 3.0 * PI * radius.powi(3)),
        Shape::Capsule { half_length, radius } => {
            centered(PI * radius * radius * (2.0 * half_length + 4.0 / 3.0 * radius))
        }
        Shape::Cuboid { half_extents } => centered(8.0 * half_extents.product()),
        Shape::Cylinder { half_length, radius } => centered(2.0 * PI * radius * radius * half_length),
        Shape::Ellipsoid { radii } => centered(4.0 / 3.0 * PI * radii.product()),
        Shape::Convex(hull) => of_triangles(hull.vertices(), hull.triangles()),
        Shape::Mesh(mesh) => {
            let statistics = mesh.statistics();
            if statistics.open_edges > 0 || statistics.flipped_edges > 0 {
                return Err(format!(
                    "{} edges are open, {} are wound against each other",
                    statistics.open_edges, statistics.flipped_edges
                ));
            }
            of_triangles(mesh.vertices(), mesh.triangles())
        }
    }
}

/// By the divergence theorem over tetrahedra from the first vertex.
fn of_triangles(vertices: &[Point], triangles: &[[u32; 3]]) -> Result<SolidProperties, String> {
    let origin = *vertices.first().ok_or("it has no vertex")?;
    let (mut volume, mut moment) = (0.0, Vector::zeros());
    for corners in triangles {
        let [a, b, c]: [Vector; 3] = corners.map(|i| vertices[i as usize] - origin);
        let part = a.dot(&b.cross(&c)) / 6.0;
        volume += part;
        moment += (a + b + c) * (part / 4.0);
    }
    if !(volume > 0.0 && volume.is_finite()) {
        return Err(format!("its volume is {volume}"));
    }
    Ok(SolidProperties { volume, center_of_mass: origin + moment / volume })
}

pub(super) fn read_mesh(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
    let fail = |problem: String| InputError::from(Diagnostic::new("M230", Place::file(path), problem));
    let is_obj = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"));
    let (vertices, triangles) =
        if is_obj { obj(bytes) } else { stl(bytes) }.ok_or_else(|| fail("cannot be read".into()))?;
    TriangleMesh::new(vertices, triangles).map_err(|error| fail(error.to_string()))
}

type Triangles = (Vec<Point>, Vec<[u32; 3]>);

fn obj(bytes: &[u8]) -> Option<Triangles> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for line in std::str::from_utf8(bytes).ok()?.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let c: Vec<f64> = words.filter_map(|w| w.parse().ok()).collect();
                vertices.push(Point::new(*c.first()?, *c.get(1)?, *c.get(2)?));
            }
            Some("f") => {
                let index =
                    |w: &str| w.split('/').next().and_then(|i| i.parse::<u32>().ok()).and_then(|i| i.checked_sub(1));
                let corners: Vec<u32> = words.map(index).collect::<Option<_>>()?;
                for k in 2..corners.len() {
                    triangles.push([corners[0], corners[k - 1], corners[k]]);
                }
            }
            _ => {}
        }
    }
    Some((vertices, triangles))
}

fn stl(bytes: &[u8]) -> Option<Triangles> {
    let number = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
    let count = u32::from_le_bytes(number(80)?) as usize;
    if bytes.len() != 84 + 50 * count {
        return None;
    }
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for triangle in 0..count {
        for corner in 0..3 {
            let at = 84 + 50 * triangle + 12 + 12 * corner;
            let c = |k: usize| Some(f64::from(f32::from_le_bytes(number(at + 4 * k)?)));
            vertices.push(Point::new(c(0)?, c(1)?, c(2)?));
        }
        let first = 3 * triangle as u32;
        triangles.push([first, first + 1, first + 2]);
    }
    Some((vertices, triangles))
}
