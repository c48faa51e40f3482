//! The search for a separating direction: the distance algorithm of Gilbert, Johnson and Keerthi (1988), with the
//! termination bounds of van den Bergen (1999). Its answer is a direction, whose gap is then evaluated.

use super::placement::Placement;
use super::support::{core_radius, core_support};
use crate::frame::{Point, Vector};
use crate::shape::Shape;

/// Answer to a distance question.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Separation {
    /// The shapes are apart by at least this much, in metres; the direction found proves it.
    SeparatedBy(f64),
    /// The shapes are closer than was asked for: touching, penetrating, or just too near.
    TooNear,
    /// The search ended without a proof either way. Counts as collision.
    Unresolved,
}

/// Iterations after which the search gives up. Smooth pairs need the most, about 20 at 1e-9.
const MAX_ITERATIONS: usize = 48;

/// Share of the true distance at which a bound is good enough: a rough direction soon fails when the shapes move.
const NEARLY_EXACT: f64 = 0.98;

/// A shape at its place in a frame that both shapes of a query share.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    /// The shape.
    pub shape: &'a Shape,
    /// Its place.
    pub at: &'a Placement,
}

/// Looks for a direction along which the placed convex shapes are apart by at least `required`.
///
/// `direction` is where to start (from `first` to `second`, any length) and receives the best unit direction found. The search
/// goes on past `required` until the bound is `enough` or within a fiftieth of the true distance.
pub fn separation(
    first: Placed,
    second: Placed,
    required: f64,
    enough: f64,
    direction: &mut Vector,
    hints: &mut [u32; 2],
) -> Separation {
    let (Placed { shape: a, at: parent_from_a }, Placed { shape: b, at: parent_from_b }) = (first, second);
    if !(direction.norm_squared() > 1e-30) {
        *direction = parent_from_b.translation - parent_from_a.translation;
    }
    let [hint_a, hint_b] = hints;
    search(
        |v| parent_from_a.point(&core_support(a, &parent_from_a.vector_to_child(v), hint_a)),
        |v| parent_from_b.point(&core_support(b, &parent_from_b.vector_to_child(v), hint_b)),
        core_radius(a) + core_radius(b),
        required,
        enough,
        direction,
    )
}

/// [`separation`] of a placed convex shape from the hull of a few points of the same parent, with `direction` to start from.
pub fn separation_from_points(
    a: &Shape,
    parent_from_a: &Placement,
    points: &[Point],
    required: f64,
    mut direction: Vector,
) -> Separation {
    let mut hint = 0;
    search(
        |v| parent_from_a.point(&core_support(a, &parent_from_a.vector_to_child(v), &mut hint)),
        |v| {
            let farther = |best: Point, p: &Point| if v.dot(&(p - best)) > 0.0 { *p } else { best };
            points[1..].iter().fold(points[0], farther)
        },
        core_radius(a),
        required,
        required,
        &mut direction,
    )
}

/// The search itself, over the support points of two cores grown by `radii` together.
#[inline]
fn search(
    mut support_a: impl FnMut(&Vector) -> Point,
    mut support_b: impl FnMut(&Vector) -> Point,
    radii: f64,
    required: f64,
    enough: f64,
    direction: &mut Vector,
) -> Separation {
    let mut simplex = Simplex::default();
    // v is the point of the core difference B - A nearest to the origin found so far; it points from a to b.
    let mut v = if direction.norm_squared() > 1e-30 { *direction } else { Vector::x() };
    let mut best = f64::NEG_INFINITY;
    let mut is_distance = false;
    for _ in 0..MAX_ITERATIONS {
        let norm = v.norm();
        if !norm.is_finite() {
            return Separation::Unresolved;
        }
        let w = support_b(&-v) - support_a(&v);
        let lower = v.dot(&w) / norm - radii;
        if lower > best {
            best = lower;
            *direction = v / norm;
        }
        let upper = if is_distance { norm - radii } else { f64::INFINITY };
        if best >= required && (best >= enough || best >= NEARLY_EXACT * upper) {
            return Separation::SeparatedBy(best);
        }
        if upper < required {
            return Separation::TooNear;
        }
        // No progress left: the bound is as good as it gets.
        if is_distance && upper - lower <= 1e-12 * (1.0 + norm) {
            break;
        }
        if simplex.contains(&w) {
            break;
        }
        simplex.push(w);
        match simplex.nearest_to_origin() {
            Some(nearest) if nearest.norm_squared() > 1e-24 => v = nearest,
            // The origin lies in the core difference: the cores overlap.
            _ => return Separation::TooNear,
        }
        is_distance = true;
    }
    if best >= required { Separation::SeparatedBy(best) } else { Separation::Unresolved }
}

/// Up to four points whose hull is searched for its point nearest to the origin.
#[derive(Debug, Default)]
struct Simplex {
    points: [Vector; 4],
    n_points: usize,
}

impl Simplex {
    fn push(&mut self, point: Vector) {
        self.points[self.n_points] = point;
        self.n_points += 1;
    }

    fn contains(&self, point: &Vector) -> bool {
        self.points[..self.n_points].iter().any(|p| (p - point).norm_squared() < 1e-26)
    }

    fn keep(&mut self, which: &[usize]) {
        let old = self.points;
        for (slot, &i) in which.iter().enumerate() {
            self.points[slot] = old[i];
        }
        self.n_points = which.len();
    }

    /// The point of the hull nearest to the origin; points that do not support it are dropped. None inside.
    fn nearest_to_origin(&mut self) -> Option<Vector> {
        match self.n_points {
            1 => Some(self.points[0]),
            2 => Some(self.nearest_of(&[0, 1])),
            3 => Some(self.nearest_of(&[0, 1, 2])),
            _ => self.nearest_of_tetrahedron(),
        }
    }

    fn nearest_of(&mut self, which: &[usize]) -> Vector {
        let (nearest, kept, n_kept) = match *which {
            [i, j] => nearest_on_segment(&self.points, i, j),
            [i, j, k] => nearest_on_triangle(&self.points, i, j, k),
            _ => unreachable!("segments and triangles only"),
        };
        self.keep(&kept[..n_kept]);
        nearest
    }

    fn nearest_of_tetrahedron(&mut self) -> Option<Vector> {
        let p = self.points;
        let volume = (p[1] - p[0]).dot(&(p[2] - p[0]).cross(&(p[3] - p[0])));
        let mut best: Option<(f64, Vector, [usize; 3], usize)> = None;
        let mut inside = true;
        for [i, j, k, opposite] in [[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 3, 1], [1, 2, 3, 0]] {
            let normal = (p[j] - p[i]).cross(&(p[k] - p[i]));
            let origin_side = -normal.dot(&p[i]);
            let opposite_side = normal.dot(&(p[opposite] - p[i]));
            // A flat tetrahedron has no inside: all of its faces are candidates.
            if origin_side * opposite_side > 0.0 && volume.abs() > 1e-30 {
                continue;
            }
            inside = false;
            let (nearest, kept, n_kept) = nearest_on_triangle(&p, i, j, k);
            let distance = nearest.norm_squared();
            if best.as_ref().is_none_or(|(least, ..)| distance < *least) {
                best = Some((distance, nearest, kept, n_kept));
            }
        }
        if inside {
            return None;
        }
        let (_, nearest, kept, n_kept) = best?;
        self.keep(&kept[..n_kept]);
        Some(nearest)
    }
}

/// Nearest point of a segment to the origin, and the end points it lies between.
fn nearest_on_segment(p: &[Vector; 4], i: usize, j: usize) -> (Vector, [usize; 3], usize) {
    let edge = p[j] - p[i];
    let along = -p[i].dot(&edge);
    let length = edge.norm_squared();
    if along <= 0.0 || length == 0.0 {
        (p[i], [i, 0, 0], 1)
    } else if along >= length {
        (p[j], [j, 0, 0], 1)
    } else {
        (p[i] + edge * (along / length), [i, j, 0], 2)
    }
}

/// Nearest point of a triangle to the origin (Ericson 2005, section 5.1.5), and the corners it lies between.
fn nearest_on_triangle(p: &[Vector; 4], i: usize, j: usize, k: usize) -> (Vector, [usize; 3], usize) {
    let (a, b, c) = (p[i], p[j], p[k]);
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(&a), -ac.dot(&a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, [i, 0, 0], 1);
    }
    let (d3, d4) = (-ab.dot(&b), -ac.dot(&b));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, [j, 0, 0], 1);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), [i, j, 0], 2);
    }
    let (d5, d6) = (-ab.dot(&c), -ac.dot(&c));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, [k, 0, 0], 1);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), [i, k, 0], 2);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), [j, k, 0], 2);
    }
    let total = va + vb + vc;
    if !(total > 0.0) {
        // A sliver: its longest edge stands for it.
        let longest = [(i, j), (i, k), (j, k)]
            .into_iter()
            .max_by(|x, y| (p[x.0] - p[x.1]).norm_squared().total_cmp(&(p[y.0] - p[y.1]).norm_squared()))
            .unwrap_or((i, j));
        return nearest_on_segment(p, longest.0, longest.1);
    }
    (a + ab * (vb / total) + ac * (vc / total), [i, j, k], 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::support::gap_along;
    use crate::frame::Pose;
    use crate::hull::ConvexHull;
    use regrasp_base::Rng;
    use std::sync::Arc;

    fn random_placement(rng: &mut Rng, spread: f64) -> Placement {
        let [x, y, z, w] = rng.quat_xyzw();
        let position = Vector::from(rng.direction()) * rng.uniform(0.0, spread);
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        Placement::from(&Pose::from_parts(position.into(), rotation))
    }

    fn distance(a: &Shape, at_a: &Placement, b: &Shape, at_b: &Placement) -> Separation {
        let mut direction = Vector::zeros();
        separation(
            Placed { shape: a, at: at_a },
            Placed { shape: b, at: at_b },
            1e-9,
            f64::INFINITY,
            &mut direction,
            &mut [0; 2],
        )
    }

    fn random_shape(rng: &mut Rng) -> Shape {
        let mut size = || rng.uniform(0.005, 0.04);
        let (p, q, r) = (size(), size(), size());
        match rng.below(6) {
            0 => Shape::Sphere { radius: p },
            1 => Shape::Capsule { half_length: p, radius: q },
            2 => Shape::Cuboid { half_extents: Vector::new(p, q, r) },
            3 => Shape::Cylinder { half_length: p, radius: q },
            4 => Shape::Ellipsoid { radii: Vector::new(p, q, r) },
            _ => {
                let points: Vec<_> = (0..40).map(|_| (Vector::from(rng.direction()) * p).into()).collect();
                Shape::Convex(Arc::new(ConvexHull::new(&points).unwrap()))
            }
        }
    }

    /// The largest gap over many directions, refined by local search: a lower bound of the distance that needs no GJK.
    fn brute_force_gap(a: &Shape, at_a: &Placement, b: &Shape, at_b: &Placement, rng: &mut Rng) -> f64 {
        let gap = |u: &Vector| gap_along(u, a, at_a, b, at_b, &mut [0; 2]);
        let mut best = Vector::x();
        let mut best_gap = gap(&best);
        for _ in 0..300 {
            let u = Vector::from(rng.direction());
            let value = gap(&u);
            if value > best_gap {
                (best, best_gap) = (u, value);
            }
        }
        let mut radius = 0.3;
        while radius > 1e-8 {
            let mut improved = false;
            // Gaps have ridges, along which few random steps lead up.
            for _ in 0..100 {
                let u = (best + Vector::from(rng.direction()) * radius).normalize();
                let value = gap(&u);
                if value > best_gap {
                    (best, best_gap, improved) = (u, value, true);
                }
            }
            if !improved {
                radius *= 0.75;
            }
        }
        best_gap
    }

    #[test]
    fn agrees_with_a_search_over_directions() {
        let mut rng = Rng::keyed(11, "gjk", 0);
        let (mut n_apart, mut n_near) = (0, 0);
        for _ in 0..400 {
            let (a, b) = (random_shape(&mut rng), random_shape(&mut rng));
            let (at_a, at_b) = (random_placement(&mut rng, 0.02), random_placement(&mut rng, 0.09));
            let reference = brute_force_gap(&a, &at_a, &b, &at_b, &mut rng);
            match distance(&a, &at_a, &b, &at_b) {
                Separation::SeparatedBy(d) => {
                    n_apart += 1;
                    assert!(d >= 0.97 * reference - 1e-7, "{a:?} {b:?}: {d} against {reference}");
                    assert!(d <= reference + 1e-6 + 2e-3 * reference, "{a:?} {b:?}: {d} against {reference}");
                }
                Separation::TooNear => {
                    n_near += 1;
                    assert!(reference < 1e-6, "{a:?} {b:?}: gap {reference} not found");
                }
                Separation::Unresolved => assert!(reference < 1e-6, "unresolved at gap {reference}"),
            }
        }
        assert!(n_apart > 100 && n_near > 50, "{n_apart} {n_near}");
    }

    #[test]
    fn closed_forms_of_spheres_and_capsules() {
        let mut rng = Rng::keyed(12, "gjk", 0);
        for _ in 0..2000 {
            let sphere = Shape::Sphere { radius: 0.01 };
            let capsule = Shape::Capsule { half_length: 0.03, radius: 0.007 };
            let (at_sphere, at_capsule) = (random_placement(&mut rng, 0.08), random_placement(&mut rng, 0.02));
            let center = at_capsule.point_to_child(&at_sphere.translation.into());
            let on_axis = Vector::new(0.0, 0.0, center.z.clamp(-0.03, 0.03));
            let exact = (center.coords - on_axis).norm() - 0.017;
            let mut direction = Vector::zeros();
            let answer = separation(
                Placed { shape: &sphere, at: &at_sphere },
                Placed { shape: &capsule, at: &at_capsule },
                1e-9,
                exact - 1e-10,
                &mut direction,
                &mut [0; 2],
            );
            match answer {
                Separation::SeparatedBy(d) => assert!(d <= exact + 1e-12 && d >= 0.97 * exact),
                _ => assert!(exact < 2e-9, "{answer:?} at {exact}"),
            }
        }
    }

    #[test]
    fn parallel_faces_and_shared_planes_are_resolved() {
        let cube = Shape::Cuboid { half_extents: Vector::repeat(0.01) };
        for gap in [1e-12, 1e-9, 1e-6, 1e-3] {
            let at_b =
                Placement { rotation: nalgebra::Matrix3::identity(), translation: Vector::new(0.02 + gap, 0.0, 0.0) };
            match distance(&cube, &Placement::IDENTITY, &cube, &at_b) {
                Separation::SeparatedBy(d) => assert!((d - gap).abs() <= 1e-15),
                other => assert!(gap <= 1e-9, "{other:?} at {gap}"),
            }
        }
    }
}
