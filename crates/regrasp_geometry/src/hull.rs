//! Convex hulls with adjacency, for support queries.

/// Of points that defeat the usual way.
mod careful;
/// As parry computes it.
mod quick;

pub use quick::convex_hull;

use crate::frame::{Point, Vector};

/// A convex polyhedron. Every point it was built from lies inside it within `1e-7` of its size.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexHull {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    /// Neighbours of vertex `i` are `neighbours[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    /// Center and radius of a ball that contains it.
    ball: (Point, f64),
    /// A vertex to start from for every direction; see [`guess_cell`]. Empty where all vertices are looked at.
    guesses: Vec<u32>,
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

/// Cells along each side of the six faces of a cube of directions.
const GUESS_CELLS: usize = 8;

/// Up to this many points [`ConvexHull::new`] is exact.
const EXACT_UP_TO: usize = 20_000;

/// Directions in which [`ConvexHull::around`] looks for extreme points.
const N_DIRECTIONS: usize = 1500;

impl ConvexHull {
    /// The hull of `points`, verified by substitution. Of more than 20,000 points, which take the exact algorithm minutes, that
    /// of [`ConvexHull::around`].
    pub fn new(points: &[Point]) -> Result<Self, HullError> {
        if points.len() <= EXACT_UP_TO { ConvexHull::exact(points) } else { ConvexHull::around(points) }
    }

    /// The hull itself, whatever the number of points.
    fn exact(points: &[Point]) -> Result<Self, HullError> {
        let tree = PointTree::new(points);
        let hull =
            quick::convex_hull(points).and_then(|(v, triangles)| ConvexHull::from_polyhedron(v, triangles, &tree));
        match hull {
            Err(HullError::Failed { .. }) => hull.or_else(|error| careful::hull(&tree).ok_or(error)),
            _ => hull,
        }
    }

    /// A polyhedron of a few thousand corners that contains all `points` and is hardly larger than their hull: the hull
    /// of the points that are extreme in `N_DIRECTIONS` directions, grown about its middle until it holds the rest.
    ///
    /// In `n` points this takes O(n log n), and support queries do not depend on `n`. Round shapes of many points are
    /// exceeded by at most about a seventh of a percent of their size, polyhedra of few corners by a rounding error.
    pub fn around(points: &[Point]) -> Result<Self, HullError> {
        let tree = PointTree::new(points);
        let extent = tree.nodes[0].high - tree.nodes[0].low;
        if extent.min() < 1e-9 {
            return Err(HullError::Flat { thickness: extent.min() });
        }
        let middle = Point::from((tree.nodes[0].low.coords + tree.nodes[0].high.coords) / 2.0);
        let farthest = |direction: Vector| tree.farthest(&direction, &middle, f64::NEG_INFINITY).1;
        let mut extreme: Vec<usize> =
            (0..N_DIRECTIONS).map(|i| farthest(spiral_direction(i, N_DIRECTIONS).component_div(&extent))).collect();
        extreme.sort_unstable();
        extreme.dedup();
        let extreme: Vec<Point> = extreme.into_iter().map(|i| tree.points[i]).collect();
        let (vertices, triangles) = quick::convex_hull(&extreme)?;
        ConvexHull::grown(vertices, triangles, &tree, f64::INFINITY)
    }

    /// A polyhedron with outward triangles, grown about its middle until it holds `points`: by no more than this factor.
    fn grown(
        mut vertices: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        points: &PointTree,
        most: f64,
    ) -> Result<Self, HullError> {
        let size = points.size();
        let center = Point::from(vertices.iter().map(|v| v.coords).sum::<Vector>() / vertices.len() as f64);
        let mut scale: f64 = 1.0;
        for corners in &triangles {
            let Some((a, normal)) = face(&vertices, corners, size) else { continue };
            let offset = normal.dot(&(a - center));
            if offset.is_nan() || offset <= 0.0 {
                return Err(HullError::Failed { reason: "its middle lies outside a face".into() });
            }
            scale = scale.max(points.farthest(&normal, &center, offset).0 / offset);
        }
        if scale > most {
            return Err(HullError::Failed { reason: format!("it had to grow by a factor of {scale}") });
        }
        vertices.iter_mut().for_each(|v| *v = center + (*v - center) * (scale * (1.0 + 1e-9)));
        ConvexHull::from_polyhedron(vertices, triangles, points)
    }

    /// Takes a polyhedron with outward triangles as hull of `points`, after verifying that it is one.
    pub(crate) fn from_polyhedron(
        vertices: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        points: &PointTree,
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
            let Some((a, normal)) = face(&vertices, corners, size) else { continue };
            let (outside, _) = points.farthest(&normal, &a, 0.0);
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
        let ball = ball_of(&vertices);
        let mut hull = ConvexHull { vertices, triangles, starts, neighbours, ball, guesses: Vec::new() };
        hull.set_guesses();
        Ok(hull)
    }

    /// The same polyhedron with every corner moved by one rigid motion, `place`.
    pub fn moved(&self, place: impl Fn(&Point) -> Point) -> Self {
        let vertices: Vec<Point> = self.vertices.iter().map(place).collect();
        let mut moved = ConvexHull { ball: ball_of(&vertices), vertices, ..self.clone() };
        moved.set_guesses();
        moved
    }

    /// Looks up the vertices to start from.
    fn set_guesses(&mut self) {
        if self.vertices.len() <= BRUTE_FORCE_LIMIT {
            return;
        }
        let mut vertex = 0;
        let farthest = |direction: Vector| {
            self.support(&direction, &mut vertex);
            vertex
        };
        self.guesses = guess_directions().map(farthest).collect();
    }

    /// The vertices, in the hull's frame.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Center and radius of a ball that contains it, in the hull's frame.
    pub fn ball(&self) -> (Point, f64) {
        self.ball
    }

    /// Outward triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The vertex farthest along `direction`, found by walking the edges uphill: from a vertex in a table, or from `hint`, the answer
    /// to an earlier direction (or any number), where that is higher.
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
        let value_at = |vertex: usize| direction.dot(&self.vertices[vertex].coords);
        let mut current = self.guesses.get(guess_cell(direction)).map_or(0, |&guess| guess as usize);
        let mut current_value = value_at(current);
        // An answer to another direction is better where that was near.
        if (*hint as usize) < self.vertices.len() && value_at(*hint as usize) > current_value {
            (current, current_value) = (*hint as usize, value_at(*hint as usize));
        }
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

/// Which cell of a cube `direction` goes through: its face (largest component and the sign of that), then rows and columns of cells.
#[inline]
fn guess_cell(direction: &Vector) -> usize {
    let axis = direction.iamax();
    let largest = direction[axis].abs();
    // A direction of length zero, or of no number, gets some cell: any vertex is as good.
    let cell = |value: f64| ((value / largest + 1.0) * (GUESS_CELLS as f64 / 2.0)) as usize;
    let [row, column] = [1, 2].map(|k| cell(direction[(axis + k) % 3]).min(GUESS_CELLS - 1));
    ((2 * axis + usize::from(direction[axis] > 0.0)) * GUESS_CELLS + row) * GUESS_CELLS + column
}

/// The directions through the middles of the cells, in the order of [`guess_cell`].
fn guess_directions() -> impl Iterator<Item = Vector> {
    let middle = |k: usize| (2 * k + 1) as f64 / GUESS_CELLS as f64 - 1.0;
    (0..6 * GUESS_CELLS * GUESS_CELLS).map(move |i| {
        let (face, row, column) = (i / (GUESS_CELLS * GUESS_CELLS), i / GUESS_CELLS % GUESS_CELLS, i % GUESS_CELLS);
        let axis = face / 2;
        let mut direction = Vector::zeros();
        direction[axis] = if face % 2 == 1 { 1.0 } else { -1.0 };
        direction[(axis + 1) % 3] = middle(row);
        direction[(axis + 2) % 3] = middle(column);
        direction
    })
}

/// Center and radius of a ball that contains the points, about the middle of their bounds. Panics where there are none.
pub(crate) fn ball_of(points: &[Point]) -> (Point, f64) {
    let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let center = nalgebra::center(&low, &high);
    (center, points.iter().map(|p| (p - center).norm()).fold(0.0, f64::max))
}

/// A corner and the unit normal of a triangle; None when it has no area beside `size` squared.
fn face(vertices: &[Point], corners: &[u32; 3], size: f64) -> Option<(Point, Vector)> {
    let [a, b, c] = corners.map(|i| vertices[i as usize]);
    let normal = (b - a).cross(&(c - a));
    (normal.norm() >= 1e-12 * size * size).then(|| (a, normal.normalize()))
}

/// Direction `i` of `n` spread evenly (Fibonacci lattice; Gonzalez 2010).
fn spiral_direction(i: usize, n: usize) -> Vector {
    let z = 1.0 - (2 * i + 1) as f64 / n as f64;
    let angle = i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let flat = (1.0 - z * z).sqrt();
    Vector::new(flat * angle.cos(), flat * angle.sin(), z)
}

/// Points in a tree of boxes, to find the farthest along a direction without looking at all.
#[derive(Debug)]
pub(crate) struct PointTree {
    nodes: Vec<PointNode>,
    points: Vec<Point>,
}

#[derive(Debug, Clone, Copy)]
struct PointNode {
    low: Point,
    high: Point,
    first: usize,
    count: usize,
    /// The right child, the left one being the next node; 0 for leaves.
    right: usize,
}

impl PointTree {
    /// Points per leaf at most.
    const LEAF: usize = 16;

    pub fn new(points: &[Point]) -> Self {
        let mut tree = PointTree { nodes: Vec::new(), points: Vec::new() };
        let mut points = points.to_vec();
        tree.add(&mut points, 0);
        tree.points = points;
        tree
    }

    /// Length of the diagonal of the box around all points.
    fn size(&self) -> f64 {
        (self.nodes[0].high - self.nodes[0].low).norm()
    }

    fn add(&mut self, points: &mut [Point], first: usize) {
        let start = points.first().copied().unwrap_or_else(Point::origin);
        let (low, high) = points.iter().fold((start, start), |(low, high), p| (low.inf(p), high.sup(p)));
        let node = self.nodes.len();
        self.nodes.push(PointNode { low, high, first, count: points.len(), right: 0 });
        if points.len() > PointTree::LEAF {
            let axis = (high - low).imax();
            let middle = points.len() / 2;
            points.select_nth_unstable_by(middle, |p, q| p[axis].total_cmp(&q[axis]));
            let (left, right) = points.split_at_mut(middle);
            self.add(left, first);
            self.nodes[node].right = self.nodes.len();
            self.add(right, first + middle);
        }
    }

    /// Largest `direction . (p - from)` over the points, and the place of that point, where it is above `least`;
    /// else `least` and place 0.
    ///
    /// Bounds of boxes are computed as values of points are, so rounding never hides a point.
    pub fn farthest(&self, direction: &Vector, from: &Point, least: f64) -> (f64, usize) {
        let bound = |node: &PointNode| {
            let corner =
                Point::from(Vector::from_fn(|k, _| if direction[k] >= 0.0 { node.high[k] } else { node.low[k] }));
            direction.dot(&(corner - from))
        };
        let mut best = (least, 0);
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            if bound(node) <= best.0 {
                continue;
            }
            if node.right == 0 {
                for (i, p) in self.points.iter().enumerate().skip(node.first).take(node.count) {
                    let value = direction.dot(&(p - from));
                    if value > best.0 {
                        best = (value, i);
                    }
                }
                continue;
            }
            let (left, right) = (index + 1, node.right);
            let left_first = bound(&self.nodes[left]) >= bound(&self.nodes[right]);
            stack.extend(if left_first { [right, left] } else { [left, right] });
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    fn cloud(n: usize, index: u64) -> Vec<Point> {
        let mut rng = Rng::keyed(7, "hull", index);
        let radii = Vector::new(0.05, 0.03, 0.01);
        (0..n).map(|_| Point::from(Vector::from(rng.direction()).component_mul(&radii) * rng.unit().sqrt())).collect()
    }

    #[test]
    fn the_farthest_point_is_that_of_looking_at_all() {
        let mut rng = Rng::keyed(1, "hull", 0);
        for (index, n) in [1, 2, 16, 17, 40, 500, 3000].into_iter().enumerate() {
            let points = cloud(n, index as u64);
            let tree = PointTree::new(&points);
            for _ in 0..200 {
                let (direction, from) = (Vector::from(rng.direction()), points[rng.below(n)]);
                let (value, place) = tree.farthest(&direction, &from, f64::NEG_INFINITY);
                let all = points.iter().map(|p| direction.dot(&(p - from))).fold(f64::NEG_INFINITY, f64::max);
                assert_eq!(value, all);
                assert_eq!(direction.dot(&(tree.points[place] - from)), all);
                assert_eq!(tree.farthest(&direction, &from, 1.0), (1.0, 0));
            }
        }
    }

    #[test]
    fn a_hull_around_contains_all_points_and_is_hardly_larger() {
        let mut rng = Rng::keyed(2, "hull", 0);
        for (index, n) in [10, 300, 20_000].into_iter().enumerate() {
            let points = cloud(n, 10 + index as u64);
            let (exact, around) = (ConvexHull::exact(&points).unwrap(), ConvexHull::around(&points).unwrap());
            for _ in 0..500 {
                let direction = Vector::from(rng.direction());
                let (mut hint, mut other) = (0, 0);
                let inner = direction.dot(&exact.support(&direction, &mut hint).coords);
                let outer = direction.dot(&around.support(&direction, &mut other).coords);
                assert!(outer >= inner - 1e-12, "{n} points: {outer} {inner}");
                assert!(outer <= inner + 0.03 * inner.abs(), "{n} points: {outer} {inner}");
            }
        }
        let flat: Vec<Point> = cloud(100, 20).into_iter().map(|p| Point::new(p.x, p.y, 0.0)).collect();
        assert!(matches!(ConvexHull::around(&flat), Err(HullError::Flat { .. })));
    }

    #[test]
    fn the_support_is_the_farthest_vertex_with_any_hint() {
        let mut rng = Rng::keyed(3, "hull", 0);
        let turned = |p: &Point| Point::new(p.y + 0.3, p.z - 0.1, p.x);
        for (index, n) in [100, 300, 5000].into_iter().enumerate() {
            let hull = ConvexHull::new(&cloud(n, 40 + index as u64)).unwrap();
            assert!(hull.vertices().len() > BRUTE_FORCE_LIMIT);
            for hull in [hull.moved(turned), hull] {
                for (cell, direction) in guess_directions().enumerate() {
                    assert_eq!(guess_cell(&direction), cell);
                }
                for k in 0..600 {
                    let axis = Vector::ith(k % 3, if k % 2 == 0 { 1.0 } else { -1.0 });
                    let direction =
                        if k < 6 { axis } else { Vector::from(rng.direction()) * 10f64.powi(k as i32 % 40 - 20) };
                    let all =
                        hull.vertices().iter().map(|v| direction.dot(&v.coords)).fold(f64::NEG_INFINITY, f64::max);
                    for start in [u32::MAX, 0, rng.below(hull.vertices().len()) as u32] {
                        let mut hint = start;
                        let found = hull.support(&direction, &mut hint);
                        assert!(
                            (direction.dot(&found.coords) - all).abs() <= 1e-14 * direction.norm(),
                            "{direction} {start}"
                        );
                        assert_eq!(hull.vertices()[hint as usize], found);
                    }
                }
            }
        }
    }

    #[test]
    fn a_direction_that_is_none_gets_some_vertex() {
        let hull = ConvexHull::new(&cloud(300, 50)).unwrap();
        for odd in [Vector::zeros(), Vector::repeat(f64::NAN), Vector::repeat(f64::INFINITY)] {
            assert!(hull.vertices().contains(&hull.support(&odd, &mut 0)));
        }
    }

    #[test]
    fn the_hull_of_a_million_points_takes_seconds() {
        let mut rng = Rng::keyed(7, "hull", 0);
        let points: Vec<Point> = (0..1_000_000).map(|_| Point::from(Vector::from(rng.direction()) * 0.05)).collect();
        let started = std::time::Instant::now();
        let hull = ConvexHull::new(&points).unwrap();
        assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
        assert!(hull.vertices().len() <= N_DIRECTIONS);
        let size = hull.vertices().iter().map(|v| v.coords.norm()).fold(0.0, f64::max);
        assert!(size < 0.05 * 1.01, "{size}");
    }

    #[test]
    fn a_polyhedron_that_leaves_a_point_out_is_no_hull() {
        let points = cloud(400, 30);
        let hull = ConvexHull::new(&points).unwrap();
        let mut more = points.clone();
        more.push(Point::new(0.0, 0.0, 0.02));
        let tree = PointTree::new(&more);
        let refused = ConvexHull::from_polyhedron(hull.vertices().to_vec(), hull.triangles().to_vec(), &tree);
        assert!(matches!(refused, Err(HullError::Failed { .. })));
    }
}
