//! Convex hulls with adjacency, for support queries.

use crate::frame::{Point, Vector};

/// A convex polyhedron. Every point it was built from lies inside it within `1e-9` of its size.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexHull {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    /// Neighbours of vertex `i` are `neighbours[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

/// Why points have no hull with an inside.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HullError {
    /// Fewer than four points, or all in one plane.
    #[error("the points lie in a plane, a line or a point (thickness {thickness:.3e} m), so their hull has no inside")]
    Flat {
        /// Smallest extent found.
        thickness: f64,
    },
    /// The hull algorithm answered with a polyhedron that does not contain the points.
    #[error("no valid convex hull was found ({reason})")]
    Failed {
        /// What went wrong.
        reason: String,
    },
}

/// Below this many vertices the support is found by looking at all of them.
const BRUTE_FORCE_LIMIT: usize = 24;

impl ConvexHull {
    /// The hull of `points`, verified by substitution.
    pub fn new(points: &[Point]) -> Result<Self, HullError> {
        let (vertices, triangles) = crate::reference::convex_hull(points)?;
        ConvexHull::from_polyhedron(vertices, triangles, points)
    }

    /// Takes a polyhedron with outward triangles as hull of `points`, after verifying that it is one.
    pub(crate) fn from_polyhedron(
        vertices: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        points: &[Point],
    ) -> Result<Self, HullError> {
        let n = vertices.len();
        let size = vertices.iter().map(|v| (v - vertices[0]).norm()).fold(0.0, f64::max);
        let mut adjacency = vec![Vec::new(); n];
        for corners in &triangles {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                adjacency[a as usize].push(b);
                adjacency[b as usize].push(a);
            }
            let [a, b, c] = corners.map(|i| vertices[i as usize]);
            let normal = (b - a).cross(&(c - a));
            if normal.norm() < 1e-12 * size * size {
                continue;
            }
            let normal = normal.normalize();
            let outside = points.iter().map(|p| normal.dot(&(p - a))).fold(0.0, f64::max);
            if outside > 1e-7 * size {
                return Err(HullError::Failed { reason: format!("a point lies {outside:.3e} m outside a face") });
            }
        }
        let (mut starts, mut neighbours) = (vec![0u32], Vec::new());
        for list in &mut adjacency {
            list.sort_unstable();
            list.dedup();
            neighbours.extend_from_slice(list);
            starts.push(neighbours.len() as u32);
        }
        Ok(ConvexHull { vertices, triangles, starts, neighbours })
    }

    /// The vertices, in the hull's frame.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Outward triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The vertex farthest along `direction`, found by walking the edges uphill from `hint`.
    pub fn support(&self, direction: &Vector, hint: &mut u32) -> Point {
        if self.vertices.len() <= BRUTE_FORCE_LIMIT {
            let mut best = self.vertices[0];
            let mut best_value = direction.dot(&best.coords);
            for vertex in &self.vertices[1..] {
                let value = direction.dot(&vertex.coords);
                if value > best_value {
                    (best, best_value) = (*vertex, value);
                }
            }
            return best;
        }
        let mut current = (*hint as usize).min(self.vertices.len() - 1);
        let mut current_value = direction.dot(&self.vertices[current].coords);
        loop {
            let mut next = current;
            for &neighbour in &self.neighbours[self.starts[current] as usize..self.starts[current + 1] as usize] {
                let value = direction.dot(&self.vertices[neighbour as usize].coords);
                if value > current_value {
                    (next, current_value) = (neighbour as usize, value);
                }
            }
            if next == current {
                *hint = current as u32;
                return self.vertices[current];
            }
            current = next;
        }
    }
}
