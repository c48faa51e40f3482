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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Radii of a ring: of its middle line, and of its cross section.
    const RING: (f64, f64) = (0.06, 0.02);

    /// A ring of `2 n^2` triangles.
    fn ring(n: usize) -> Triangles {
        let angle = |k: usize| 2.0 * PI * k as f64 / n as f64;
        let vertex = |i: usize, j: usize| {
            let across = RING.0 + RING.1 * angle(j).cos();
            Point::new(across * angle(i).cos(), across * angle(i).sin(), RING.1 * angle(j).sin())
        };
        let at = |i: usize, j: usize| (i % n * n + j % n) as u32;
        let faces = |(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        let cells = || (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        Triangles {
            vertices: cells().map(|(i, j)| vertex(i, j)).collect(),
            triangles: cells().flat_map(faces).collect(),
            smooth_below: 0.5,
        }
    }

    fn volume(mesh: &Triangles) -> f64 {
        let corner = |i: u32| mesh.vertices[i as usize].coords;
        mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))) / 6.0).sum()
    }

    #[test]
    fn fewer_triangles_stay_on_the_surface_and_turned_outwards() {
        let exact = 2.0 * PI * PI * RING.0 * RING.1 * RING.1;
        let mesh = ring(300);
        assert!((volume(&mesh) / exact - 1.0).abs() < 1e-3);
        for most in [1_000, 20_000, 100_000] {
            let found = simplify(mesh.clone(), most);
            let n = found.triangles.len();
            assert!(n <= most && n > most / 3, "{n} of {most}");
            // A surface of area a has about a / (2 cell^2) triangles and more.
            let cell = (4.0 * PI * PI * RING.0 * RING.1 / n as f64 * 4.0).sqrt();
            for v in &found.vertices {
                let from_middle = (v.x.hypot(v.y) - RING.0).hypot(v.z);
                assert!((from_middle - RING.1).abs() < cell, "{v} of {most}");
            }
            assert!((volume(&found) / exact - 1.0).abs() < 0.1, "{} of {exact}", volume(&found));
            assert_eq!(simplify(mesh.clone(), most), found);
        }
        assert_eq!(simplify(mesh.clone(), mesh.triangles.len()), mesh);
    }
}
