//! Meshes from STL and OBJ, until `regrasp_geometry::import::read_mesh` is here.

use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_geometry::{Point, TriangleMesh};
use std::path::Path;

pub(crate) fn read_mesh(path: &Path, bytes: &[u8]) -> Result<TriangleMesh, InputError> {
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
