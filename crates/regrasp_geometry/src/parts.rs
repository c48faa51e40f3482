//! Solids in convex parts, for programs that collide convex shapes only.
//!
//! The surface is cut by planes, one cut after the other, and every piece is replaced by its convex hull. Each cut is the one of some
//! candidates across the axes of the mesh that takes most volume off the hulls. All corners of a part lie on the surface or inside, so
//! that a part leaves the surface only where the surface curves inwards. Where something has to stay clear there, a second round cuts
//! along the surface.

use crate::collision::MeshTree;
use crate::frame::{Point, UnitVector, Vector, tangents};
use crate::hull::{ConvexHull, HullError, convex_hull};
use crate::mass::solid_properties;
use crate::mesh::TriangleMesh;
use crate::shape::Shape;
use crate::surface::nearest_on_triangle;
use nalgebra::Matrix3;
use std::sync::Arc;

/// Positions of cuts tried along each axis of a piece.
const POSITIONS: usize = 15;
/// Most places with points that should be clear at which cuts of a piece are tried.
const PLACES: usize = 6;
/// Directions along the surface in which cuts are tried at such a place.
const DIRECTIONS: usize = 4;
/// Corners from which on candidates are compared by some of the corners only.
const MANY_CORNERS: usize = 500;
/// Where cuts beside the surface pass, from the surface to the ball that should be clear, as a share of that way.
const NEAR: f64 = 0.3;
/// Least volume that a cut takes off a part that covers what should be clear, as a share of the part's, where it clears nothing. By hand.
const LEAST_FOR_CLEAR: f64 = 0.01;
/// No part has less volume, as a share of the solid's.
const SLIVER: f64 = 1e-9;

/// How finely a solid is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartSettings {
    /// Most parts.
    pub max_parts: usize,
    /// Volume by which all parts together may exceed the solid, as a share of the solid's.
    pub excess: f64,
    /// Least volume that a cut takes off, as a share of the solid's.
    pub least_gain: f64,
}

impl PartSettings {
    /// At most so many parts, which exceed the solid by so much, in cuts that take off a thousandth each.
    pub fn new(max_parts: usize, excess: f64) -> Self {
        PartSettings { max_parts, excess, least_gain: 1e-3 }
    }
}

/// A ball beside a solid that no part should reach into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clear {
    /// Its centre.
    pub center: Point,
    /// Its radius, in metres: less than the way to the surface.
    pub radius: f64,
    /// The nearest point of the surface to its centre. A cut between the two, across the way, leaves the solid nearby on one side.
    pub nearest: Point,
}

/// A solid in convex parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// The parts.
    pub hulls: Vec<ConvexHull>,
    /// Volume by which they exceed the solid, as a share of the solid's.
    pub excess: f64,
    /// How many of the balls that should be clear a part reaches into nevertheless.
    pub covered: usize,
}

/// What lies between some cuts.
struct Body {
    /// The surface of the solid there.
    triangles: Vec<[Point; 3]>,
    /// The body is where `normal . x >= at`.
    cuts: Vec<(Vector, f64)>,
    /// Where three cuts meet inside the solid.
    inside: Vec<Point>,
}

/// A body and its hull.
struct Piece {
    body: Body,
    hull: ConvexHull,
    volume: f64,
}

/// Across a direction, at a height along it.
#[derive(Debug, Clone, Copy)]
struct Cut {
    normal: Vector,
    at: f64,
    /// The volume that it takes off.
    gain: f64,
}

/// Convex parts of the solid that `mesh` bounds. None where the mesh is no closed solid, or a hull fails.
pub fn convex_parts(mesh: &TriangleMesh, settings: &PartSettings) -> Option<Parts> {
    convex_parts_clear_of(mesh, settings, &[])
}

/// As [`convex_parts`]. Afterwards parts that cover one of the points `clear` are cut on, up to twice as many parts, while that helps.
pub fn convex_parts_clear_of(mesh: &TriangleMesh, settings: &PartSettings, clear: &[Clear]) -> Option<Parts> {
    let solid = solid_properties(&Shape::Mesh(Arc::new(mesh.clone()))).ok()?.volume;
    let triangles: Vec<[Point; 3]> = (0..mesh.triangles().len()).map(|index| mesh.corners(index)).collect();
    let tree = MeshTree::new(mesh);
    let whole = Piece::new(Body { triangles, cuts: Vec::new(), inside: Vec::new() }).ok()??;
    let mut pieces = by_volume(&tree, whole, (settings, solid))?;
    let covered = leave_clear(&tree, &mut pieces, (2 * settings.max_parts, solid), clear);
    let excess = pieces.iter().map(|piece| piece.volume).sum::<f64>() / solid - 1.0;
    Some(Parts { hulls: pieces.into_iter().map(|piece| piece.hull).collect(), excess, covered })
}

/// The first round: cuts that take most volume off.
fn by_volume(tree: &MeshTree, whole: Piece, (settings, solid): (&PartSettings, f64)) -> Option<Vec<Piece>> {
    let mut pieces = vec![(best_cut(tree, &whole.body), whole)];
    loop {
        let excess = pieces.iter().map(|(_, piece)| piece.volume).sum::<f64>() / solid - 1.0;
        if pieces.len() >= settings.max_parts || excess <= settings.excess {
            break;
        }
        let gain = |k: usize| pieces[k].0.map_or(0.0, |cut| cut.gain);
        let worth = (0..pieces.len()).filter(|&k| gain(k) > settings.least_gain * solid);
        let Some(best) = worth.max_by(|&a, &b| gain(a).total_cmp(&gain(b))) else { break };
        let cut = pieces[best].0.take()?;
        let [Ok(Some(below)), Ok(Some(above))] = divide(tree, &pieces[best].1.body, &cut).map(Piece::new) else {
            continue;
        };
        pieces[best] = (best_cut(tree, &below.body), below);
        pieces.push((best_cut(tree, &above.body), above));
    }
    Some(pieces.into_iter().map(|(_, piece)| piece).collect())
}

/// The second round: cuts that uncover points. Returns how many points stay covered.
fn leave_clear(tree: &MeshTree, pieces: &mut Vec<Piece>, (max_parts, solid): (usize, f64), clear: &[Clear]) -> usize {
    let covered_by = |piece: &Piece| {
        clear
            .iter()
            .filter(|ball| ball.is_reached(piece.hull.vertices(), piece.hull.triangles()))
            .copied()
            .collect::<Vec<Clear>>()
    };
    // The worst first: the number of parts is limited.
    let mut waiting: Vec<(Vec<Clear>, usize)> = pieces.iter().map(covered_by).zip(0..).collect();
    let mut left = 0;
    while let Some(worst) = (0..waiting.len()).max_by_key(|&i| (waiting[i].0.len(), i)) {
        let (covered, k) = waiting.swap_remove(worst);
        if covered.is_empty() {
            break;
        }
        let cuts = if pieces.len() < max_parts { clearing_cuts(tree, &pieces[k], &covered) } else { Vec::new() };
        let is_piece = |piece: &Piece| piece.volume > SLIVER * solid;
        let sides = cuts.iter().find_map(|cut| match divide(tree, &pieces[k].body, cut).map(Piece::new) {
            [Ok(Some(below)), Ok(Some(above))] => (is_piece(&below) && is_piece(&above)).then_some([below, above]),
            _ => None,
        });
        let Some([below, above]) = sides else {
            left += covered.len();
            continue;
        };
        waiting.extend([(covered_by(&below), k), (covered_by(&above), pieces.len())]);
        pieces[k] = below;
        pieces.push(above);
    }
    left
}

impl Piece {
    /// None where it is flat.
    fn new(body: Body) -> Result<Option<Self>, HullError> {
        let hull = match ConvexHull::new(&corners(&body, 1)) {
            Ok(hull) => hull,
            Err(HullError::Flat { .. }) => return Ok(None),
            Err(failed) => return Err(failed),
        };
        let Some(volume) = volume_of(&hull) else { return Ok(None) };
        Ok(Some(Piece { body, hull, volume }))
    }
}

impl Clear {
    /// True where a polyhedron with outward triangles reaches into the ball.
    fn is_reached(&self, vertices: &[Point], triangles: &[[u32; 3]]) -> bool {
        let faces = || triangles.iter().map(|triangle| triangle.map(|k| vertices[k as usize]));
        let mut inside = true;
        for [a, b, c] in faces() {
            let normal = (b - a).cross(&(c - a));
            let height = normal.dot(&(self.center - a));
            if height > self.radius * normal.norm() {
                return false;
            }
            inside &= height <= 0.0;
        }
        inside || faces().any(|face| (nearest_on_triangle(&face, &self.center).0 - self.center).norm() < self.radius)
    }
}

fn corners(body: &Body, stride: usize) -> Vec<Point> {
    let mut points: Vec<Point> = body.triangles.iter().flatten().copied().collect();
    let key = |a: &Point, b: &Point| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z));
    points.sort_by(key);
    points.dedup();
    points.into_iter().step_by(stride).chain(body.inside.iter().copied()).collect()
}

fn volume_of(hull: &ConvexHull) -> Option<f64> {
    solid_properties(&Shape::Convex(Arc::new(hull.clone()))).ok().map(|solid| solid.volume)
}

/// The volume that outward triangles enclose.
fn enclosed(vertices: &[Point], triangles: &[[u32; 3]]) -> f64 {
    let Some(origin) = vertices.first() else { return 0.0 };
    let corner = |k: u32| vertices[k as usize] - origin;
    triangles.iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))) / 6.0).sum()
}

/// Stride through the corners with which candidates are compared.
fn stride_of(triangles: &[[Point; 3]]) -> usize {
    (3 * triangles.len()).div_ceil(6 * MANY_CORNERS).max(1)
}

/// The cut of a piece after which the two hulls have least volume, of some at equal distances across the axes.
fn best_cut(tree: &MeshTree, body: &Body) -> Option<Cut> {
    let stride = stride_of(&body.triangles);
    let rough = |body: &Body| {
        let (vertices, faces) = convex_hull(&corners(body, stride)).ok()?;
        Some(enclosed(&vertices, &faces))
    };
    let whole = rough(body)?;
    let mut best: Option<Cut> = None;
    for axis in 0..3 {
        let along = || body.triangles.iter().flatten().map(|corner| corner[axis]);
        let (low, high) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        for k in 1..=POSITIONS {
            let at = low + (high - low) * k as f64 / (POSITIONS + 1) as f64;
            let cut = Cut { normal: Vector::ith(axis, 1.0), at, gain: 0.0 };
            let [below, above] = divide(tree, body, &cut);
            let (Some(a), Some(b)) = (rough(&below), rough(&above)) else { continue };
            let gain = whole - a - b;
            if best.is_none_or(|known| gain > known.gain) {
                best = Some(Cut { gain, ..cut });
            }
        }
    }
    best
}

/// Cuts of a piece that clear something or take much off, that which takes off most first.
fn clearing_cuts(tree: &MeshTree, piece: &Piece, covered: &[Clear]) -> Vec<Cut> {
    let stride = stride_of(&piece.body.triangles);
    let mut found: Vec<(usize, Cut)> = Vec::new();
    for place in covered.iter().step_by(covered.len().div_ceil(PLACES).max(1)) {
        let Some((outward, way)) = UnitVector::try_new_and_get(place.center - place.nearest, 0.0) else { continue };
        let between = place.nearest + NEAR * (way - place.radius) * outward.into_inner();
        let (x, y) = tangents(&outward);
        let turned = |k: usize| {
            let (sin, cos) = (std::f64::consts::PI * k as f64 / DIRECTIONS as f64).sin_cos();
            cos * x.into_inner() + sin * y.into_inner()
        };
        let normals = (0..DIRECTIONS).map(turned).chain([outward.into_inner()]);
        for normal in normals.chain((0..3).map(|axis| Vector::ith(axis, 1.0))) {
            let cut = Cut { normal, at: normal.dot(&between.coords), gain: 0.0 };
            let sides = divide(tree, &piece.body, &cut).map(|side| convex_hull(&corners(&side, stride)));
            let [Ok(below), Ok(above)] = sides else { continue };
            let hulls = [below, above];
            let is_covered = |ball: &&Clear| hulls.iter().any(|(corners, faces)| ball.is_reached(corners, faces));
            let n_covered = covered.iter().filter(is_covered).count();
            let gain = piece.volume - hulls.iter().map(|(corners, faces)| enclosed(corners, faces)).sum::<f64>();
            if n_covered < covered.len() || gain > LEAST_FOR_CLEAR * piece.volume {
                found.push((n_covered, Cut { gain, ..cut }));
            }
        }
    }
    found.sort_by(|(n, a), (m, b)| b.gain.total_cmp(&a.gain).then(n.cmp(m)));
    found.into_iter().map(|(_, cut)| cut).collect()
}

/// The parts of a body on either side of a cut.
fn divide(solid: &MeshTree, body: &Body, cut: &Cut) -> [Body; 2] {
    let fresh = corners_inside(solid, body, cut);
    [-1.0, 1.0].map(|sign| {
        let height = |corner: &Point| sign * (corner.coords.dot(&cut.normal) - cut.at);
        let mut triangles = Vec::new();
        body.triangles.iter().for_each(|triangle| clip(triangle, height, &mut triangles));
        let mut inside: Vec<Point> = body.inside.iter().copied().filter(|corner| height(corner) >= 0.0).collect();
        inside.extend(&fresh);
        let mut cuts = body.cuts.clone();
        cuts.push((sign * cut.normal, sign * cut.at));
        Body { triangles, cuts, inside }
    })
}

/// Corners inside the solid that a cut makes with two of the cuts before.
fn corners_inside(solid: &MeshTree, body: &Body, cut: &Cut) -> Vec<Point> {
    let mut found = Vec::new();
    for (k, (a, at_a)) in body.cuts.iter().enumerate() {
        for (b, at_b) in &body.cuts[..k] {
            let Some(inverse) =
                Matrix3::from_rows(&[a.transpose(), b.transpose(), cut.normal.transpose()]).try_inverse()
            else {
                continue;
            };
            let corner = Point::from(inverse * Vector::new(*at_a, *at_b, cut.at));
            let is_within = |(normal, at): &(Vector, f64)| normal.dot(&corner.coords) >= at - 1e-9;
            if body.cuts.iter().all(is_within) && solid.holds(&corner) {
                found.push(corner);
            }
        }
    }
    found
}

/// Adds the part of a triangle where `height` is not negative, in triangles (Sutherland and Hodgman 1974).
fn clip(triangle: &[Point; 3], height: impl Fn(&Point) -> f64, side: &mut Vec<[Point; 3]>) {
    let mut polygon: Vec<Point> = Vec::with_capacity(4);
    for k in 0..3 {
        let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
        let (a, b) = (height(&from), height(&to));
        if a >= 0.0 {
            polygon.push(from);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            let way: Vector = to - from;
            polygon.push(from + way * (a / (a - b)));
        }
    }
    side.extend((2..polygon.len()).map(|k| [polygon[0], polygon[k - 1], polygon[k]]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use std::f64::consts::TAU;

    /// A solid of revolution about z through (radius, z), closed at both ends.
    fn turned(profile: &[(f64, f64)], n: usize) -> TriangleMesh {
        let mut vertices = Vec::new();
        for &(radius, z) in profile {
            let at = |k: usize| TAU * k as f64 / n as f64;
            vertices.extend((0..n).map(|k| Point::new(radius * at(k).cos(), radius * at(k).sin(), z)));
        }
        let (bottom, top) = (vertices.len() as u32, vertices.len() as u32 + 1);
        vertices.push(Point::new(0.0, 0.0, profile[0].1));
        vertices.push(Point::new(0.0, 0.0, profile[profile.len() - 1].1));
        let n32 = n as u32;
        let mut triangles = Vec::new();
        for ring in 0..profile.len() as u32 - 1 {
            for k in 0..n32 {
                let (a, b) = (ring * n32 + k, ring * n32 + (k + 1) % n32);
                triangles.extend([[a, b, b + n32], [a, b + n32, a + n32]]);
            }
        }
        let last = (profile.len() as u32 - 1) * n32;
        for k in 0..n32 {
            triangles.extend([[bottom, (k + 1) % n32, k], [top, last + k, last + (k + 1) % n32]]);
        }
        TriangleMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn a_stepped_shaft_is_two_parts_that_fill_it() {
        let shaft = turned(&[(0.024, 0.0), (0.024, 0.03), (0.009, 0.03), (0.009, 0.05)], 24);
        let parts = convex_parts(&shaft, &PartSettings::new(8, 0.02)).unwrap();
        assert!(parts.excess < 0.02, "{}", parts.excess);
        assert!((2..=4).contains(&parts.hulls.len()), "{}", parts.hulls.len());
        let whole = ConvexHull::new(shaft.vertices()).unwrap();
        assert!(volume_of(&whole).unwrap() > 1.2 * shaft.signed_volume());
    }

    /// A groove of a thousandth of the volume, which volume alone would leave filled; and the same with its axis across none of the
    /// mesh's.
    #[test]
    fn parts_leave_free_what_should_be_clear() {
        let shaft =
            turned(&[(0.03, 0.0), (0.03, 0.05), (0.0295, 0.0505), (0.0295, 0.0515), (0.03, 0.052), (0.03, 0.1)], 48);
        let settings = PartSettings::new(8, 0.02);
        for turn in [UnitQuaternion::identity(), UnitQuaternion::from_euler_angles(0.7, 0.5, 0.3)] {
            // Many points in one plane, all but for rounding, have no hull.
            let rough = |(k, corner): (usize, &Point)| turn * corner + 1e-6 * Vector::ith(k % 3, (k as f64).sin());
            let vertices = shaft.vertices().iter().enumerate().map(rough).collect();
            let shaft = TriangleMesh::new(vertices, shaft.triangles().to_vec()).unwrap();
            let clear = [Clear {
                center: turn * Point::new(0.0298, 0.0, 0.051),
                radius: 1e-4,
                nearest: turn * Point::new(0.0295, 0.0, 0.051),
            }];
            let covered =
                |parts: &Parts| parts.hulls.iter().any(|hull| clear[0].is_reached(hull.vertices(), hull.triangles()));
            assert!(covered(&convex_parts(&shaft, &settings).unwrap()));
            let parts = convex_parts_clear_of(&shaft, &settings, &clear).unwrap();
            assert!(!covered(&parts) && parts.covered == 0, "{} covered", parts.covered);
            assert!(parts.hulls.len() <= 16, "{} parts", parts.hulls.len());
        }
    }

    #[test]
    fn parts_of_an_hourglass_fill_it_and_hardly_more() {
        let profile: Vec<(f64, f64)> =
            (0..=12).map(|k| (f64::from(k) - 6.0) / 6.0).map(|t| (0.01 + 0.02 * t * t, 0.04 * t)).collect();
        let glass = turned(&profile, 24);
        let whole = volume_of(&ConvexHull::new(glass.vertices()).unwrap()).unwrap() / glass.signed_volume() - 1.0;
        let parts = convex_parts(&glass, &PartSettings::new(16, 0.05)).unwrap();
        assert!(
            whole > 1.0 && (0.0..0.05).contains(&parts.excess),
            "{whole}: {} in {}",
            parts.excess,
            parts.hulls.len()
        );
    }

    /// Two cuts across different axes leave a corner inside the solid.
    #[test]
    fn parts_reach_the_corners_of_cuts_inside_the_solid() {
        let cube = ConvexHull::new(
            &(0..8).map(|k| Point::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect::<Vec<_>>(),
        );
        let cube = cube.unwrap();
        let mesh = TriangleMesh::new(cube.vertices().to_vec(), cube.triangles().to_vec()).unwrap();
        let triangles = (0..12).map(|k| mesh.corners(k)).collect();
        let mut pieces = vec![Body { triangles, cuts: Vec::new(), inside: Vec::new() }];
        let tree = MeshTree::new(&mesh);
        for axis in 0..3 {
            let cut = Cut { normal: Vector::ith(axis, 1.0), at: 0.4, gain: 0.0 };
            pieces = pieces.iter().flat_map(|piece| divide(&tree, piece, &cut)).collect();
        }
        let volumes: Vec<f64> =
            pieces.iter().map(|piece| volume_of(&ConvexHull::new(&corners(piece, 1)).unwrap()).unwrap()).collect();
        assert!(volumes.len() == 8 && (volumes.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{volumes:?}");
    }

    #[test]
    fn every_point_of_the_solid_is_in_a_part_and_a_convex_solid_is_one() {
        let drop = turned(&[(0.002, 0.0), (0.02, 0.02), (0.024, 0.03), (0.02, 0.04), (0.009, 0.05), (0.009, 0.07)], 16);
        let parts = convex_parts(&drop, &PartSettings::new(12, 0.01)).unwrap();
        for index in 0..drop.triangles().len() {
            let [a, b, c] = drop.corners(index);
            let middle = a + ((b - a) + (c - a)) / 3.0;
            for point in [a, middle] {
                let depth = |hull: &ConvexHull| {
                    // Slivers between corners in a line have no direction.
                    let outward = |t: &[u32; 3]| {
                        let [p, q, r] = t.map(|k| hull.vertices()[k as usize]);
                        let normal = (q - p).cross(&(r - p)).try_normalize(1e-12)?;
                        Some(normal.dot(&(point - p)))
                    };
                    hull.triangles().iter().filter_map(outward).fold(f64::NEG_INFINITY, f64::max)
                };
                let nearest = parts.hulls.iter().map(depth).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-6, "{point} is {nearest} m outside of all parts");
            }
        }
        let rod = turned(&[(0.01, 0.0), (0.01, 0.05)], 16);
        assert_eq!(convex_parts(&rod, &PartSettings::new(12, 0.01)).unwrap().hulls.len(), 1);
    }
}
