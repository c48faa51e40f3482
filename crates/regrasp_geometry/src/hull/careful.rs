//! Hulls of points that defeat the usual way: many corners that nearly coincide, as at the poles of a sphere that was written
//! in single precision, or many in a plane, as a grid on a block has.
//!
//! Points are added to a tetrahedron one by one (Barber, Dobkin and Huhdanpaa 1996), and on which side of a face they lie is
//! decided exactly (Shewchuk 1997). A face in whose plane a new corner lies is replaced with those that the corner sees:
//! so no face is without area, and what is left is convex.

use super::{ConvexHull, PointTree};
use crate::Point;
use robust::{Coord3D, orient3d};
use std::collections::BTreeMap;

/// Points nearer to each other than this share of the size are one: in turn, as faces between points that are very near have
/// no normal beside rounding.
const MERGED: [f64; 3] = [1e-6, 1e-5, 1e-4];
/// A polyhedron may grow by this factor at most until it holds the points.
const GROWN: f64 = 1.01;

/// A polyhedron that holds all points and is hardly larger than their hull: the hull of the points that are left when those that
/// nearly coincide are merged, grown until it holds all. None of points that are all in one plane.
pub(super) fn hull(points: &PointTree) -> Option<ConvexHull> {
    MERGED.iter().find_map(|&share| {
        let (vertices, triangles) = exact_hull(&merged(&points.points, share * points.size()))?;
        ConvexHull::grown(vertices, triangles, points, GROWN).ok()
    })
}

/// The points without those that are nearer than `distance` to one that is kept.
fn merged(points: &[Point], distance: f64) -> Vec<Point> {
    let cell_of = |point: &Point| [point.x, point.y, point.z].map(|x| (x / distance).floor() as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<Point>> = BTreeMap::new();
    let mut kept = Vec::new();
    for point in points {
        let [x, y, z] = cell_of(point);
        let around = (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        let mut near = around.filter_map(|cell| cells.get(&cell)).flatten();
        if !near.any(|other| (other - point).norm() < distance) {
            cells.entry([x, y, z]).or_default().push(*point);
            kept.push(*point);
        }
    }
    kept
}

/// A face of the growing hull.
struct Face {
    /// Counterclockwise, seen from outside.
    corners: [usize; 3],
    /// The faces across the edges from each corner to the next.
    across: [usize; 3],
    /// Points above it that are to be added yet, each of one face only.
    above: Vec<usize>,
    is_gone: bool,
}

/// The hull that grows.
struct Growing<'a> {
    points: &'a [Point],
    faces: Vec<Face>,
}

/// Vertices and outward triangles of the hull; None of points that are all in one plane.
fn exact_hull(points: &[Point]) -> Option<(Vec<Point>, Vec<[u32; 3]>)> {
    let mut growing = Growing::tetrahedron(points)?;
    let mut todo: Vec<usize> = (0..4).collect();
    while let Some(face) = todo.pop() {
        if !growing.faces[face].is_gone
            && let Some(corner) = growing.farthest_above(face)
        {
            todo.extend(growing.add(face, corner));
        }
    }
    let faces = || growing.faces.iter().filter(|face| !face.is_gone);
    let mut used: Vec<usize> = faces().flat_map(|face| face.corners).collect();
    used.sort_unstable();
    used.dedup();
    let number = |corner: usize| used.partition_point(|&other| other < corner) as u32;
    let triangles = faces().map(|face| face.corners.map(number)).collect();
    Some((used.iter().map(|&corner| points[corner]).collect(), triangles))
}

impl<'a> Growing<'a> {
    /// Four points that are not in one plane, far from each other, and what lies above their faces.
    fn tetrahedron(points: &'a [Point]) -> Option<Self> {
        let farthest =
            |measure: &dyn Fn(usize) -> f64| (0..points.len()).max_by(|&i, &j| measure(i).total_cmp(&measure(j)));
        let a = farthest(&|i| -points[i].x)?;
        let b = farthest(&|i| (points[i] - points[a]).norm())?;
        let along = (points[b] - points[a]).try_normalize(0.0)?;
        let c = farthest(&|i| (points[i] - points[a]).cross(&along).norm())?;
        let d = farthest(&|i| height(points, [a, b, c], i).abs())?;
        let above = height(points, [a, b, c], d);
        if above == 0.0 {
            return None;
        }
        let [a, b] = if above > 0.0 { [b, a] } else { [a, b] };
        let face = |corners, across| Face { corners, across, above: Vec::new(), is_gone: false };
        let faces = vec![
            face([a, b, c], [1, 2, 3]),
            face([b, a, d], [0, 3, 2]),
            face([c, b, d], [0, 1, 3]),
            face([a, c, d], [0, 2, 1]),
        ];
        let mut growing = Growing { points, faces };
        growing.share_out((0..points.len()).collect(), 0);
        Some(growing)
    }

    /// True where a point is above the plane of a face; `or_on` counts what is in the plane.
    fn sees(&self, point: usize, face: usize, or_on: bool) -> bool {
        let height = height(self.points, self.faces[face].corners, point);
        height > 0.0 || or_on && height == 0.0
    }

    /// Gives each point to the first of the faces from `first` on that it is above; those above none are inside.
    fn share_out(&mut self, points: Vec<usize>, first: usize) {
        for point in points {
            if let Some(face) = (first..self.faces.len()).find(|&face| self.sees(point, face, false)) {
                self.faces[face].above.push(point);
            }
        }
    }

    fn farthest_above(&self, face: usize) -> Option<usize> {
        let Face { corners: [a, b, c], above, .. } = &self.faces[face];
        let [a, b, c] = [*a, *b, *c].map(|corner| self.points[corner]);
        let normal = (b - a).cross(&(c - a));
        let height = |i: usize| normal.dot(&(self.points[i] - a));
        above.iter().copied().max_by(|&i, &j| height(i).total_cmp(&height(j)))
    }

    /// Makes `corner` one of the hull's, which is above `face`: the new faces.
    fn add(&mut self, face: usize, corner: usize) -> std::ops::Range<usize> {
        // Edges around what the corner sees, each with the face beyond: by depth first, turning always the same way, they come in
        // order around it.
        let mut rim = Vec::new();
        let mut freed = Vec::new();
        self.faces[face].is_gone = true;
        let mut stack = vec![(face, 0, 3)];
        while let Some((at, side, n_left)) = stack.pop() {
            if n_left == 0 {
                freed.append(&mut self.faces[at].above);
                continue;
            }
            stack.push((at, (side + 1) % 3, n_left - 1));
            let beyond = self.faces[at].across[side];
            if self.faces[beyond].is_gone {
                continue;
            }
            if self.sees(corner, beyond, true) {
                self.faces[beyond].is_gone = true;
                let back = self.side_towards(beyond, at);
                stack.push((beyond, (back + 1) % 3, 2));
            } else {
                let corners = self.faces[at].corners;
                rim.push((corners[side], corners[(side + 1) % 3], beyond, at));
            }
        }
        let (first, n) = (self.faces.len(), rim.len());
        for (k, &(from, to, beyond, gone)) in rim.iter().enumerate() {
            let back = self.side_towards(beyond, gone);
            self.faces[beyond].across[back] = first + k;
            let across = [beyond, first + (k + 1) % n, first + (k + n - 1) % n];
            self.faces.push(Face { corners: [from, to, corner], across, above: Vec::new(), is_gone: false });
        }
        freed.retain(|&point| point != corner);
        self.share_out(freed, first);
        first..first + n
    }

    /// Which edge of `face` has `other` across.
    fn side_towards(&self, face: usize, other: usize) -> usize {
        self.faces[face].across.iter().position(|&across| across == other).unwrap_or(0)
    }
}

/// Positive above the plane through three corners that are counterclockwise seen from above, zero in it: the sign is exact.
fn height(points: &[Point], corners: [usize; 3], point: usize) -> f64 {
    let at = |i: usize| Coord3D { x: points[i].x, y: points[i].y, z: points[i].z };
    let [a, b, c] = corners.map(at);
    -orient3d(a, b, c, at(point))
}

#[cfg(test)]
mod tests {
    use super::super::quick;
    use super::*;
    use crate::Vector;
    use nalgebra::Rotation3;
    use regrasp_base::Rng;

    /// The corners of a rounded wedge in rings, as programs write them: in single precision, forty at either pole.
    fn wedge() -> Vec<Point> {
        let power = |x: f64, p: f64| x.abs().powf(p).copysign(x);
        let ring = |i: u32| {
            let (up, out) = (std::f64::consts::PI * (f64::from(i) / 20.0 - 0.5)).sin_cos();
            let (up, out) = (power(up, 0.7), power(out, 0.7));
            (0..40).map(move |j| {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(j) / 40.0).sin_cos();
                let width = 6.0 * (1.0 - 0.175 * (up + 1.0));
                let corner = [width * out * power(cosine, 0.8), 9.0 * out * power(sine, 0.8), 15.0 * up + 15.0];
                Point::from(Vector::from(corner.map(|x| f64::from(x as f32) * 1e-3)))
            })
        };
        (0..=20).flat_map(ring).collect()
    }

    /// A solid of revolution or a slab in rings, or a block with a grid on its sides: of any thickness, mostly in single precision.
    fn made_by_a_program(rng: &mut Rng) -> Vec<Point> {
        let size = 10f64.powf(rng.uniform(-2.5, -0.5));
        let thickness = 10f64.powf(rng.uniform(-2.5, 0.5));
        let n = 3 + rng.below(40);
        let mut points: Vec<Vector> = Vec::new();
        if rng.chance(0.4) {
            for k in 0..n.pow(2) {
                let [a, b] = [k % n, k / n].map(|i| i as f64 / (n - 1) as f64);
                points.extend([0.0, 1.0].map(|c| Vector::new(a, b, c)));
                points.extend([0.0, 1.0].map(|c| Vector::new(a, c, b)));
                points.extend([0.0, 1.0].map(|c| Vector::new(c, a, b)));
            }
        } else {
            let (n_rings, power) = (3 + rng.below(20), rng.uniform(0.2, 2.0));
            let is_round = rng.chance(0.5);
            for ring in 0..n_rings {
                let up = ring as f64 / (n_rings - 1) as f64;
                let out = if is_round { (std::f64::consts::PI * up).sin().abs().powf(power) } else { 1.0 - 0.5 * up };
                for j in 0..n {
                    let (sine, cosine) = (std::f64::consts::TAU * j as f64 / n as f64).sin_cos();
                    points.push(Vector::new(out * cosine, out * sine, up));
                }
            }
        }
        let angle = if rng.chance(0.5) { 0.0 } else { rng.uniform(0.0, 3.0) };
        let turn = Rotation3::new(Vector::from(rng.direction()) * angle);
        let is_single = rng.chance(0.7);
        let place = |p: Vector| {
            let p = turn * (p.component_mul(&Vector::new(1.0, 1.0, thickness)) * size);
            Point::from(if is_single { p.map(|x| f64::from(x as f32)) } else { p })
        };
        points.into_iter().map(place).collect()
    }

    fn usual(points: &[Point]) -> Result<ConvexHull, super::super::HullError> {
        let (vertices, triangles) = quick::convex_hull(points)?;
        ConvexHull::from_polyhedron(vertices, triangles, &PointTree::new(points))
    }

    /// How far the hull reaches beyond the farthest point, as a share of the size.
    fn beyond(hull: &ConvexHull, points: &[Point], direction: &Vector) -> f64 {
        let all = points.iter().map(|p| direction.dot(&p.coords)).fold(f64::NEG_INFINITY, f64::max);
        (hull.support(direction, &mut 0).coords.dot(direction) - all) / PointTree::new(points).size()
    }

    #[test]
    fn the_hull_of_corners_that_nearly_coincide_reaches_as_far_as_they_do() {
        let points = wedge();
        assert!(usual(&points).is_err(), "the usual way does it: this test needs other points");
        let hull = ConvexHull::new(&points).unwrap();
        let mut rng = Rng::keyed(4, "hull", 0);
        for _ in 0..3000 {
            let off = beyond(&hull, &points, &Vector::from(rng.direction()));
            assert!((-1e-9..1e-5).contains(&off), "{off}");
        }
    }

    /// Every one has a hull, which reaches as far as the points do.
    #[test]
    fn shapes_as_programs_write_them_have_hulls() {
        let mut rng = Rng::keyed(5, "hull", 0);
        let mut n_careful = 0;
        for k in 0..600 {
            let points = made_by_a_program(&mut rng);
            n_careful += u32::from(usual(&points).is_err());
            let tree = PointTree::new(&points);
            ConvexHull::new(&points).unwrap_or_else(|error| panic!("{k}: {error}"));
            let hull = hull(&tree).unwrap_or_else(|| panic!("{k} has none"));
            for _ in 0..20 {
                let off = beyond(&hull, &points, &Vector::from(rng.direction()));
                assert!((-1e-9..1e-4).contains(&off), "{k}: {off}");
            }
        }
        assert!(n_careful > 10, "{n_careful}");
    }

    /// The exact hull is closed, convex and holds the points, by exact tests of every point and every face.
    #[test]
    fn no_point_is_above_any_face_and_every_edge_has_two() {
        let mut rng = Rng::keyed(6, "hull", 0);
        for k in 0..150 {
            let points = made_by_a_program(&mut rng);
            let Some((vertices, triangles)) = exact_hull(&points) else { panic!("{k} has none") };
            let n_vertices = vertices.len();
            let all: Vec<Point> = vertices.into_iter().chain(points.iter().copied()).collect();
            let mut edges = std::collections::BTreeSet::new();
            for triangle in &triangles {
                let corners = triangle.map(|corner| corner as usize);
                assert!((0..all.len()).all(|point| height(&all, corners, point) <= 0.0), "{k}");
                assert!((0..3).all(|side| edges.insert([triangle[side], triangle[(side + 1) % 3]])), "{k}");
            }
            assert!(edges.iter().all(|&[from, to]| edges.contains(&[to, from])), "{k}");
            assert_eq!(n_vertices + triangles.len(), edges.len() / 2 + 2, "{k}");
        }
    }

    #[test]
    fn points_in_a_plane_have_none() {
        let flat: Vec<Point> = (0..25).map(|k| Point::new(f64::from(k % 5), f64::from(k / 5), 0.5)).collect();
        assert!(exact_hull(&flat).is_none() && exact_hull(&flat[..1]).is_none() && exact_hull(&[]).is_none());
    }
}
