//! Triangle meshes as read, validated, with their statistics.

use crate::frame::{Point, Vector};
use std::collections::{BTreeMap, BTreeSet};

/// Corners along rims that are this share of the mesh's size apart are one: files have six to nine digits.
const WELD: f64 = 1e-6;

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
    /// Vertices of a mesh that was not closed that were merged into another nearby, within rounding errors of files.
    pub vertices_welded: usize,
    /// Triangles of a mesh that was not closed that were there before, and were dropped.
    pub duplicates_dropped: usize,
    /// Edges with one triangle: the mesh has holes when there are any.
    pub open_edges: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles are wound against each other.
    pub flipped_edges: usize,
    /// Edges that triangles walk more often one way than the other.
    pub unbalanced_edges: usize,
}

impl MeshStatistics {
    /// True when every edge has exactly two triangles, wound alike.
    pub fn is_watertight(&self) -> bool {
        self.open_edges == 0 && self.non_manifold_edges == 0 && self.flipped_edges == 0
    }

    /// True when the triangles bound a solid: every edge is walked as often one way as the other. Two parts may share an edge.
    pub fn is_closed(&self) -> bool {
        self.unbalanced_edges == 0
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
    /// Merges vertices at the same position, drops triangles of zero area and counts both. Where the triangles do not bound a solid, corners
    /// along their rims that are a millionth of the mesh's size apart or less are merged too, and triangles that are there twice are kept
    /// once, if that leaves fewer unbalanced edges.
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
            if has_no_area(&(b - a), &(c - a), &(c - b)) {
                statistics.zero_area_dropped += 1;
            } else {
                kept.push(corners);
            }
        }
        if kept.is_empty() {
            return Err(MeshError::Empty { dropped: statistics.zero_area_dropped });
        }
        count_edges(&kept, &mut statistics);
        let mesh = TriangleMesh { vertices, triangles: kept, statistics };
        if mesh.statistics.is_closed() {
            return Ok(mesh);
        }
        let welded = mesh.welded();
        let is_better = |other: &TriangleMesh| other.statistics.unbalanced_edges < mesh.statistics.unbalanced_edges;
        Ok(welded.filter(is_better).unwrap_or(mesh))
    }

    /// With corners along the rims that are next to each other merged, and without triangles that are there twice. None where neither is.
    fn welded(&self) -> Option<Self> {
        let mut statistics = MeshStatistics {
            zero_area_dropped: self.statistics.zero_area_dropped,
            vertices_merged: self.statistics.vertices_merged,
            ..MeshStatistics::default()
        };
        let mut on_rim: Vec<u32> = rims(&self.triangles).into_iter().flatten().collect();
        on_rim.sort_unstable();
        on_rim.dedup();
        let (low, high) = self.bounds();
        let near = WELD * (high - low).amax();
        // Meshes of sizes that no file has: distances in them are no numbers any more.
        if !(1e-200..1e200).contains(&near) {
            return None;
        }
        let mut stands_for: Vec<u32> = (0..self.vertices.len() as u32).collect();
        // The corners that stand for others, by cell of a grid whose cells are as large as what is near.
        let mut in_cell: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
        for corner in on_rim {
            let at = self.vertices[corner as usize];
            let cell = <[i64; 3]>::from(((at - low) / near).map(|x| x.floor() as i64));
            let around = (0..27i64).map(|k| [cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1]);
            let nearest = around
                .filter_map(|cell| in_cell.get(&cell))
                .flatten()
                .map(|&other| ((self.vertices[other as usize] - at).norm(), other))
                .filter(|(distance, _)| *distance <= near)
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            match nearest {
                Some((_, other)) => {
                    stands_for[corner as usize] = other;
                    statistics.vertices_welded += 1;
                }
                None => in_cell.entry(cell).or_default().push(corner),
            }
        }
        let mut seen = BTreeSet::new();
        let mut kept = Vec::with_capacity(self.triangles.len());
        for corners in &self.triangles {
            let corners = corners.map(|i| stands_for[i as usize]);
            let [a, b, c] = corners.map(|i| self.vertices[i as usize]);
            // From the lowest corner on, wound as it is.
            let lowest = (0..3).min_by_key(|&k| corners[k]).unwrap_or(0);
            if has_no_area(&(b - a), &(c - a), &(c - b)) {
                statistics.zero_area_dropped += 1;
            } else if seen.insert([0, 1, 2].map(|k| corners[(lowest + k) % 3])) {
                kept.push(corners);
            } else {
                statistics.duplicates_dropped += 1;
            }
        }
        if kept.is_empty() || kept.len() == self.triangles.len() && statistics.vertices_welded == 0 {
            return None;
        }
        count_edges(&kept, &mut statistics);
        Some(TriangleMesh { vertices: self.vertices.clone(), triangles: kept, statistics })
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
        if scale == Vector::repeat(1.0) {
            return Ok(self.clone());
        }
        let vertices = self.vertices.iter().map(|v| Point::from(v.coords.component_mul(&scale))).collect();
        let mesh = TriangleMesh::new(vertices, self.triangles.clone())?;
        let mirrored = scale.x * scale.y * scale.z < 0.0;
        Ok(if mirrored { mesh.flipped() } else { mesh })
    }
}

/// True when the triangle with these edges has no area beside the square of its longest edge.
fn has_no_area(ab: &Vector, ac: &Vector, bc: &Vector) -> bool {
    let longest = ab.norm_squared().max(ac.norm_squared()).max(bc.norm_squared());
    // Where squares overflow or underflow, the triangle is looked at in units of its own size.
    if !(1e-200..1e200).contains(&longest) {
        let size = ab.amax().max(ac.amax()).max(bc.amax());
        if size == 0.0 || !size.is_finite() {
            return true;
        }
        let [ab, ac, bc] = [ab, ac, bc].map(|edge| edge / size);
        let longest = ab.norm_squared().max(ac.norm_squared()).max(bc.norm_squared());
        return ab.cross(&ac).norm() <= 1e-14 * longest;
    }
    ab.cross(ac).norm() <= 1e-14 * longest
}

/// Vertices without duplicates, and for each old vertex the index of the one that stands for it: the first.
fn merge_equal(vertices: Vec<Point>, n_merged: &mut usize) -> (Vec<Point>, Vec<u32>) {
    let key = |i: u32| {
        let v = &vertices[i as usize];
        // +0.0 turns -0.0 into 0.0, so that the two compare equal.
        [(v.x + 0.0).to_bits(), (v.y + 0.0).to_bits(), (v.z + 0.0).to_bits()]
    };
    // Equal vertices share a bucket; few others do.
    let n_bits = vertices.len().next_power_of_two().trailing_zeros().max(1);
    let bucket = |i: usize| (scattered(key(i as u32)) >> (64 - n_bits)) as u32;
    let (mut order, starts) = by_bucket(vertices.len(), 1 << n_bits, bucket);
    let mut stands_for: Vec<u32> = (0..vertices.len() as u32).collect();
    for range in starts.windows(2) {
        let members = &mut order[range[0] as usize..range[1] as usize];
        if members.len() < 2 {
            continue;
        }
        members.sort_unstable_by_key(|&i| (key(i), i));
        for same in members.chunk_by(|&i, &j| key(i) == key(j)) {
            same.iter().for_each(|&i| stands_for[i as usize] = same[0]);
        }
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

/// A number that differs in its leading bits for keys that differ anywhere (the finaliser of MurmurHash3).
fn scattered(key: [u64; 3]) -> u64 {
    key.iter().fold(0, |mixed: u64, &word| {
        let x = (mixed ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        let x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        x ^ (x >> 33)
    })
}

/// The numbers `0..n` by bucket, in order within each, and where each bucket starts (counting sort).
fn by_bucket(n: usize, n_buckets: usize, bucket: impl Fn(usize) -> u32) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; n_buckets + 1];
    for i in 0..n {
        starts[bucket(i) as usize + 1] += 1;
    }
    for k in 0..n_buckets {
        starts[k + 1] += starts[k];
    }
    let mut next = starts.clone();
    let mut order = vec![0u32; n];
    for i in 0..n {
        let place = &mut next[bucket(i) as usize];
        order[*place as usize] = i as u32;
        *place += 1;
    }
    (order, starts)
}

/// One side of an undirected edge: the triangle that has it, and which of its edges it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct EdgeSide {
    ends: [u32; 2],
    /// Three times the triangle, plus the corner that the edge starts at.
    side: u32,
}

impl EdgeSide {
    pub(crate) fn triangle(&self) -> usize {
        self.side as usize / 3
    }

    /// The edge goes from this corner of the triangle to the next.
    pub(crate) fn corner(&self) -> usize {
        self.side as usize % 3
    }

    /// Its two vertices, the lower one first.
    pub(crate) fn ends(&self) -> [u32; 2] {
        self.ends
    }

    pub(crate) fn same_edge(&self, other: &EdgeSide) -> bool {
        self.ends == other.ends
    }
}

/// Edges that triangles walk more often one way than the other, from and to, as often as that is so: the rims of holes, against
/// the winding of what would close them.
pub(crate) fn rims(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut rims = Vec::new();
    for sides in edge_sides(triangles).chunk_by(EdgeSide::same_edge) {
        let [low, high] = sides[0].ends;
        let n_up = sides.iter().filter(|side| triangles[side.triangle()][side.corner()] == low).count();
        let n_down = sides.len() - n_up;
        rims.extend(std::iter::repeat_n([low, high], n_up.saturating_sub(n_down)));
        rims.extend(std::iter::repeat_n([high, low], n_down.saturating_sub(n_up)));
    }
    rims
}

/// Sides of all edges by their ends (the lower vertex first), then by triangle and corner.
pub(crate) fn edge_sides(triangles: &[[u32; 3]]) -> Vec<EdgeSide> {
    let n_vertices = triangles.iter().flatten().max().map_or(0, |&last| last as usize + 1);
    let ends_of = |side: usize| {
        let (corners, k) = (triangles[side / 3], side % 3);
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        [a.min(b), a.max(b)]
    };
    let (order, starts) = by_bucket(3 * triangles.len(), n_vertices, |side| ends_of(side)[0]);
    let mut sides: Vec<EdgeSide> =
        order.into_iter().map(|side| EdgeSide { ends: ends_of(side as usize), side }).collect();
    for range in starts.windows(2) {
        sides[range[0] as usize..range[1] as usize].sort_unstable();
    }
    sides
}

fn count_edges(triangles: &[[u32; 3]], statistics: &mut MeshStatistics) {
    for sides in edge_sides(triangles).chunk_by(EdgeSide::same_edge) {
        // How often the edge is walked from its lower to its higher vertex.
        let n_up = sides.iter().filter(|side| triangles[side.triangle()][side.corner()] == side.ends[0]).count();
        statistics.unbalanced_edges += usize::from(2 * n_up != sides.len());
        match sides.len() {
            1 => statistics.open_edges += 1,
            2 if n_up != 1 => statistics.flipped_edges += 1,
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
    fn seams_whose_corners_differ_by_rounding_are_closed() {
        let (vertices, triangles) = tetrahedron();
        for (noise, is_closed) in [(1e-17, true), (1e-9, true), (1e-7, true), (1e-4, false)] {
            // Every triangle with corners of its own.
            let apart = |k: usize| {
                vertices[triangles[k / 3][k % 3] as usize] + Vector::new(1.0, -2.0, 0.5) * noise * (k / 3) as f64
            };
            let own: Vec<Point> = (0..12).map(apart).collect();
            let mesh = TriangleMesh::new(own, (0..4).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()).unwrap();
            assert_eq!(mesh.statistics().is_closed(), is_closed, "{noise}");
            assert_eq!(mesh.statistics().open_edges == 0, is_closed);
            assert!((mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-3);
        }
        // A triangle that is there twice, and one of them from another corner on.
        let twice = [triangles.clone(), vec![[1, 3, 0], [1, 2, 3]]].concat();
        let mesh = TriangleMesh::new(vertices.clone(), twice).unwrap();
        assert!(mesh.statistics().is_watertight());
        assert_eq!((mesh.statistics().duplicates_dropped, mesh.triangles().len()), (2, 4));
        // Open meshes of any size are read.
        for size in [1e-300, 1e-160, 1e160, 1e300] {
            let open = TriangleMesh::new(vertices.iter().map(|v| v * size).collect(), triangles[1..].to_vec()).unwrap();
            assert_eq!(open.statistics().open_edges, 3, "{size}");
        }
        // A hole stays one, and a closed mesh whose corners are near each other stays as it is.
        let open = TriangleMesh::new(vertices.clone(), triangles[1..].to_vec()).unwrap();
        assert_eq!((open.statistics().open_edges, open.statistics().vertices_welded), (3, 0));
        let mut thin = vertices.clone();
        thin[3] = Point::new(0.0, 0.0, 1e-8);
        assert_eq!(TriangleMesh::new(thin, triangles).unwrap().statistics().vertices_welded, 0);
    }

    #[test]
    fn triangles_keep_their_area_in_any_unit() {
        for size in [1e-200, 1e-160, 1e-3, 1e3, 1e160, 1e200] {
            let (vertices, mut triangles) = tetrahedron();
            let vertices: Vec<Point> = vertices.into_iter().map(|p| p * size).collect();
            triangles.push([0, 1, 1]);
            let mesh = TriangleMesh::new(vertices, triangles).unwrap();
            assert_eq!((mesh.triangles().len(), mesh.statistics().zero_area_dropped), (4, 1), "{size}");
            let back = mesh.scaled(Vector::repeat(0.05 / size)).unwrap();
            assert!((back.signed_volume() / (0.05f64.powi(3) / 6.0) - 1.0).abs() < 1e-12, "{size}");
        }
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

    #[test]
    fn sides_and_merged_vertices_are_those_of_maps() {
        use regrasp_base::Rng;
        use std::collections::BTreeMap;
        let mut rng = Rng::keyed(1, "mesh", 0);
        for n in [4, 30, 700] {
            // On a coarse grid about zero many vertices fall together, some as 0.0 and -0.0.
            let coordinate =
                |rng: &mut Rng| (rng.uniform(-3.0, 3.0) as i32 as f64) * 0.5 * if rng.chance(0.5) { 1.0 } else { -1.0 };
            let points: Vec<Point> =
                (0..n).map(|_| Point::new(coordinate(&mut rng), coordinate(&mut rng), coordinate(&mut rng))).collect();
            let mut n_merged = 0;
            let (kept, merged_from) = merge_equal(points.clone(), &mut n_merged);
            let mut expected: Vec<Point> = Vec::new();
            for (i, p) in points.iter().enumerate() {
                let place = expected.iter().position(|q| q == p).unwrap_or_else(|| {
                    expected.push(*p);
                    expected.len() - 1
                });
                assert_eq!(merged_from[i] as usize, place);
            }
            assert_eq!((&kept, n_merged), (&expected, n - expected.len()));

            let mut corner = || rng.below(n) as u32;
            let triangles: Vec<[u32; 3]> = (0..4 * n).map(|_| [corner(), corner(), corner()]).collect();
            let mut walks: BTreeMap<[u32; 2], Vec<(usize, usize)>> = BTreeMap::new();
            for (i, corners) in triangles.iter().enumerate() {
                for k in 0..3 {
                    let (a, b) = (corners[k], corners[(k + 1) % 3]);
                    walks.entry([a.min(b), a.max(b)]).or_default().push((i, k));
                }
            }
            let sides = edge_sides(&triangles);
            let runs = sides.chunk_by(EdgeSide::same_edge);
            let found: BTreeMap<_, _> = runs
                .map(|run| (run[0].ends, run.iter().map(|side| (side.triangle(), side.corner())).collect::<Vec<_>>()))
                .collect();
            assert_eq!(found, walks);
            assert!(sides.is_sorted());
        }
    }
}
