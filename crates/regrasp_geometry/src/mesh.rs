//! Triangle meshes as read, validated, with their statistics.

use crate::frame::{Point, Vector};
use std::collections::BTreeMap;

/// A triangle mesh with finite vertices, indices in range and no triangle of zero area.
#[derive(Debug, Clone, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    statistics: MeshStatistics,
}

/// What a mesh is like, and what was dropped when it was built.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct MeshStatistics {
    /// Triangles of zero area that were dropped.
    pub zero_area_dropped: usize,
    /// Vertices at the same position that were merged into another.
    pub vertices_merged: usize,
    /// Edges with one triangle: the mesh has holes when there are any.
    pub open_edges: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles are wound against each other.
    pub flipped_edges: usize,
}

impl MeshStatistics {
    /// True when every edge has exactly two triangles, wound alike.
    pub fn is_watertight(&self) -> bool {
        self.open_edges == 0 && self.non_manifold_edges == 0 && self.flipped_edges == 0
    }
}

/// Why triangles do not make a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A vertex has a NaN or an infinite coordinate.
    #[error("{count} vertices have NaN or infinite coordinates, the first is vertex {first}")]
    NotFinite {
        /// Index of the first such vertex.
        first: usize,
        /// How many there are.
        count: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {index}, but there are only {n_vertices}")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex index it names.
        index: u32,
        /// How many vertices there are.
        n_vertices: usize,
    },
    /// Nothing is left once triangles of zero area are dropped.
    #[error("no triangle with an area is left ({dropped} of zero area were dropped)")]
    Empty {
        /// How many triangles of zero area were dropped.
        dropped: usize,
    },
}

impl TriangleMesh {
    /// Merges vertices at the same position, drops triangles of zero area and counts both.
    pub fn new(vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let is_bad = |v: &Point| v.coords.iter().any(|c| !c.is_finite());
        if let Some(first) = vertices.iter().position(is_bad) {
            return Err(MeshError::NotFinite { first, count: vertices.iter().filter(|v| is_bad(v)).count() });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
                return Err(MeshError::IndexOutOfRange { triangle, index, n_vertices: vertices.len() });
            }
        }
        let mut statistics = MeshStatistics::default();
        let (vertices, merged_from) = merge_equal(vertices, &mut statistics.vertices_merged);
        let mut kept = Vec::with_capacity(triangles.len());
        for corners in triangles {
            let corners = corners.map(|i| merged_from[i as usize]);
            let [a, b, c] = corners.map(|i| vertices[i as usize]);
            let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
            if (b - a).cross(&(c - a)).norm() <= 1e-14 * longest || longest == 0.0 {
                statistics.zero_area_dropped += 1;
            } else {
                kept.push(corners);
            }
        }
        if kept.is_empty() {
            return Err(MeshError::Empty { dropped: statistics.zero_area_dropped });
        }
        count_edges(&kept, &mut statistics);
        Ok(TriangleMesh { vertices, triangles: kept, statistics })
    }

    /// The vertices, in the mesh frame.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Vertex indices of each triangle, counter-clockwise seen from outside where the mesh has an outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The three corners of triangle `index`.
    pub fn corners(&self, index: usize) -> [Point; 3] {
        self.triangles[index].map(|i| self.vertices[i as usize])
    }

    /// Counts of holes, duplicates and flipped edges.
    pub fn statistics(&self) -> &MeshStatistics {
        &self.statistics
    }

    /// Lowest and highest coordinates.
    pub fn bounds(&self) -> (Point, Point) {
        let mut low = self.vertices[0];
        let mut high = low;
        for corners in &self.triangles {
            for &i in corners {
                low = low.inf(&self.vertices[i as usize]);
                high = high.sup(&self.vertices[i as usize]);
            }
        }
        (low, high)
    }

    /// Signed volume by the divergence theorem, in m^3; negative when the triangles are wound inside out.
    pub fn signed_volume(&self) -> f64 {
        let origin = self.vertices[0];
        self.triangles
            .iter()
            .map(|corners| {
                let [a, b, c]: [Vector; 3] = corners.map(|i| self.vertices[i as usize] - origin);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// The same mesh with every triangle wound the other way.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        for corners in &mut self.triangles {
            corners.swap(1, 2);
        }
        self
    }

    /// The same mesh under `p -> scale * p` (component-wise); a mirroring scale flips the winding back.
    pub fn scaled(&self, scale: Vector) -> Result<Self, MeshError> {
        let vertices = self.vertices.iter().map(|v| Point::from(v.coords.component_mul(&scale))).collect();
        let mesh = TriangleMesh::new(vertices, self.triangles.clone())?;
        let mirrored = scale.x * scale.y * scale.z < 0.0;
        Ok(if mirrored { mesh.flipped() } else { mesh })
    }
}

/// Vertices without duplicates, and for each old vertex the index of the one that stands for it.
fn merge_equal(vertices: Vec<Point>, n_merged: &mut usize) -> (Vec<Point>, Vec<u32>) {
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    let key = |i: u32| {
        let v = &vertices[i as usize];
        // +0.0 turns -0.0 into 0.0, so that the two compare equal.
        [(v.x + 0.0).to_bits(), (v.y + 0.0).to_bits(), (v.z + 0.0).to_bits()]
    };
    order.sort_unstable_by_key(|&i| (key(i), i));
    let mut stands_for = vec![0u32; vertices.len()];
    for pair in 0..order.len() {
        let i = order[pair];
        let same = pair > 0 && key(order[pair - 1]) == key(i);
        stands_for[i as usize] = if same { stands_for[order[pair - 1] as usize] } else { i };
    }
    let mut new_index = vec![u32::MAX; vertices.len()];
    let mut kept = Vec::new();
    for i in 0..vertices.len() {
        if stands_for[i] as usize == i {
            new_index[i] = kept.len() as u32;
            kept.push(vertices[i]);
        } else {
            *n_merged += 1;
        }
    }
    let merged_from = stands_for.iter().map(|&i| new_index[i as usize]).collect();
    (kept, merged_from)
}

fn count_edges(triangles: &[[u32; 3]], statistics: &mut MeshStatistics) {
    // Per undirected edge: how often it is walked upwards and downwards.
    let mut walks: BTreeMap<(u32, u32), [usize; 2]> = BTreeMap::new();
    for corners in triangles {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            walks.entry((a.min(b), a.max(b))).or_default()[usize::from(a > b)] += 1;
        }
    }
    for [up, down] in walks.values() {
        match up + down {
            1 => statistics.open_edges += 1,
            2 if *up != 1 => statistics.flipped_edges += 1,
            2 => {}
            _ => statistics.non_manifold_edges += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> (Vec<Point>, Vec<[u32; 3]>) {
        let vertices =
            vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(0.0, 1.0, 0.0), Point::new(0.0, 0.0, 1.0)];
        (vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    }

    #[test]
    fn a_tetrahedron_is_watertight_and_has_its_volume() {
        let (vertices, triangles) = tetrahedron();
        let mesh = TriangleMesh::new(vertices, triangles).unwrap();
        assert!(mesh.statistics().is_watertight());
        assert!((mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-15);
        assert!((mesh.scaled(Vector::new(-1.0, 2.0, 1.0)).unwrap().signed_volume() - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn holes_flips_duplicates_and_slivers_are_counted() {
        let (mut vertices, mut triangles) = tetrahedron();
        triangles.pop();
        let open = TriangleMesh::new(vertices.clone(), triangles.clone()).unwrap();
        assert_eq!(open.statistics().open_edges, 3);
        triangles.push([1, 3, 2]);
        vertices.push(Point::new(1.0, 0.0, -0.0));
        triangles.push([0, 1, 4]);
        let flipped = TriangleMesh::new(vertices, triangles).unwrap();
        assert_eq!(flipped.statistics().flipped_edges, 3);
        assert_eq!(flipped.statistics().vertices_merged, 1);
        assert_eq!(flipped.statistics().zero_area_dropped, 1);
    }

    #[test]
    fn bad_numbers_are_refused() {
        let (mut vertices, triangles) = tetrahedron();
        assert!(matches!(
            TriangleMesh::new(vertices.clone(), vec![[0, 1, 9]]),
            Err(MeshError::IndexOutOfRange { triangle: 0, index: 9, n_vertices: 4 })
        ));
        vertices[2].y = f64::NAN;
        assert!(matches!(TriangleMesh::new(vertices, triangles), Err(MeshError::NotFinite { first: 2, count: 1 })));
    }
}
