//! Meshes of fewer triangles, so that a page stays small: vertices that share a cell of a grid become one.
//!
//! Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes (1993).

use super::tessellate::Triangles;
use regrasp_geometry::{Point, Vector};
use std::collections::{BTreeMap, BTreeSet};

/// Cells grow by this factor until few enough triangles are left.
const GROWTH: f64 = 1.15;

/// `mesh` with at most `most` triangles; as it is when it has no more. No vertex moves by more than a cell's diagonal.
pub fn simplify(mesh: Triangles, most: usize) -> Triangles {
    if mesh.triangles.len() <= most {
        return mesh;
    }
    let (low, high) =
        mesh.vertices.iter().fold((mesh.vertices[0], mesh.vertices[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    // A surface over n by n cells has some 4 n^2 triangles.
    let mut cell = (high - low).max() / (most as f64 / 4.0).sqrt() / 2.0;
    loop {
        let found = clustered(&mesh, &low, cell);
        if found.triangles.len() <= most {
            return found;
        }
        cell *= GROWTH;
    }
}

/// The mesh with the vertices of each cell at their mean; triangles within two cells vanish.
fn clustered(mesh: &Triangles, low: &Point, cell: f64) -> Triangles {
    let mut cells: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let mut sums: Vec<(Vector, f64)> = Vec::new();
    let names: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|vertex| {
            let key = std::array::from_fn(|k| ((vertex[k] - low[k]) / cell).floor() as i64);
            let name = *cells.entry(key).or_insert_with(|| {
                sums.push((Vector::zeros(), 0.0));
                sums.len() as u32 - 1
            });
            let sum = &mut sums[name as usize];
            *sum = (sum.0 + vertex.coords, sum.1 + 1.0);
            name
        })
        .collect();
    let mut seen = BTreeSet::new();
    let mut triangles = Vec::new();
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|i| names[i as usize]);
        if a == b || b == c || c == a {
            continue;
        }
        // Rotated so that the smallest comes first: the same triangle is the same key, its other side is not.
        let turned = if a < b && a < c {
            [a, b, c]
        } else if b < c {
            [b, c, a]
        } else {
            [c, a, b]
        };
        if seen.insert(turned) {
            triangles.push(turned);
        }
    }
    let vertices = sums.iter().map(|(sum, n)| Point::from(sum / *n)).collect();
    Triangles { vertices, triangles, smooth_below: mesh.smooth_below }
}
