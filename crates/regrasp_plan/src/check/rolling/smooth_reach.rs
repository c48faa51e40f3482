//! How near a smooth hull is to triangles: proofs that none is nearer than so far, and the nearest of all.
//!
//! The distance of a point `q` from a convex body is the largest of `q . m - h(m)` over the unit vectors `m`, where `h` is how
//! far the body reaches; inside it is negative. So every plane that touches the body bounds it from below, and it is convex in
//! `q`. On a triangle, its least value is sought with such planes (Kelley 1960): the least of what they say is a lower bound, and
//! the distance of the point where they say it an upper one, with another plane.

use super::smooth_touch::Place;
use crate::check::patch::{Facet, Patch};
use crate::check::rolling::Touch;
use crate::check::tip_surface::Smooth;
use nalgebra::{Matrix2, Vector2};
use regrasp_geometry::{Point, Vector};

/// Directions near that of a touch are within this angle's cosine: they prove most.
const NEAR_COSINE: f64 = 0.9;
/// A plane in so many is enough to tell what is far away.
const COARSE: usize = 64;
/// Stands for the plane of a triangle of which none is known yet.
const NO_PROOF: usize = usize::MAX;
/// Lower and upper bound of a triangle's distance agree, in metres.
const AGREED: f64 = 1e-9;
/// What searches on triangles leave open at most, in metres.
const ROUNDING: f64 = 1e-11;
/// Most planes that are added for a triangle.
const MOST_CUTS: usize = 40;
/// Steps of Newton's method to a point's distance, halvings of a step, the longest step and the gradient that is none.
const MOST_STEPS: usize = 60;
const MOST_HALVINGS: i32 = 16;
const LONGEST_STEP: f64 = 0.3;
const FLAT: f64 = 1e-13;
/// Halvings of a range in the search on a triangle.
const HALVINGS: usize = 45;

/// True unless it is sure that all of `facet` is farther than `far` from the hull. `in_link` says where its link sees points, from the
/// hull's centre.
pub fn may_be_near(smooth: &Smooth, in_link: impl Fn(&Point) -> Vector, facet: &Facet, far: f64) -> bool {
    let corner = in_link(&facet.corners[0]);
    !smooth.planes().iter().step_by(COARSE).any(|(m, reach)| corner.dot(m) - reach - facet.reach > far)
}

/// A plane that touches the hull: where it is for the three corners of a triangle.
#[derive(Debug, Clone, Copy)]
struct Cut {
    corners: [f64; 3],
}

impl Cut {
    fn new(m: Vector, reach: f64, corners: &[Vector; 3]) -> Self {
        Cut { corners: corners.each_ref().map(|corner| corner.dot(&m) - reach) }
    }

    /// No point of the triangle is nearer.
    fn least(&self) -> f64 {
        self.corners.iter().copied().fold(f64::INFINITY, f64::min)
    }

    fn at(&self, shares: &[f64; 3]) -> f64 {
        (0..3).map(|k| self.corners[k] * shares[k]).sum()
    }
}

impl Place<'_> {
    /// A point as the hull's link sees it from the hull's centre.
    fn in_link(&self, point: &Point) -> Vector {
        self.turn.tr_mul(&(point - self.center))
    }

    /// True when it is proven that no triangle of the patch comes nearer to the hull than `limit`, which may be negative.
    pub(super) fn is_nothing_nearer(&self, touch: &Touch, limit: f64) -> bool {
        let Patch::Triangles(facets) = self.patch else { return true };
        let facing = -self.turn.tr_mul(&touch.normal);
        let reach = self.smooth.point(&facing).dot(&facing);
        let mut near: Option<Vec<usize>> = None;
        let planes = self.smooth.planes();
        // What is behind the plane that touches at the touch is proven: most of the patch.
        let level = self.center.coords.dot(&touch.normal) - reach - limit;
        let height = |corner: &Point| corner.coords.dot(&touch.normal);
        let mut known = self.proofs.borrow_mut();
        known.resize(facets.len(), NO_PROOF);
        let mut last = NO_PROOF;
        facets.iter().zip(known.iter_mut()).all(|(facet, known)| {
            let is_behind = height(&facet.corners[0]) + facet.reach <= level
                || facet.corners.iter().all(|corner| height(corner) <= level);
            // What proved a triangle where the hull was a moment ago, or its neighbour here, mostly does so again.
            if is_behind || self.is_behind(*known, facet, limit) {
                return true;
            }
            if self.is_behind(last, facet, limit) {
                *known = last;
                return true;
            }
            let corners = facet.corners.each_ref().map(|corner| self.in_link(corner));
            let near = near.get_or_insert_with(|| {
                (0..planes.len()).filter(|&index| planes[index].0.dot(&facing) > NEAR_COSINE).collect()
            });
            let is_behind = |index: &usize| {
                let (m, reach) = planes[*index];
                Cut::new(m, reach, &corners).least() >= limit
            };
            match near.iter().copied().find(is_behind).or_else(|| (0..planes.len()).find(is_behind)) {
                Some(index) => {
                    (*known, last) = (index, index);
                    true
                }
                None => self.distance(&corners, limit, false).0 >= limit,
            }
        })
    }

    /// True when the plane of that index proves that `facet` comes no nearer than `limit`.
    fn is_behind(&self, index: usize, facet: &Facet, limit: f64) -> bool {
        let Some((m, reach)) = self.smooth.planes().get(index) else { return false };
        let m = self.turn * m;
        let level = self.center.coords.dot(&m) + reach + limit;
        facet.corners.iter().all(|corner| corner.coords.dot(&m) >= level)
    }

    /// The nearest point of all triangles of the patch; none without triangles.
    pub(super) fn nearest(&self) -> Option<Touch> {
        let Patch::Triangles(facets) = self.patch else { return None };
        let mut bounds: Vec<(f64, [Vector; 3])> = facets
            .iter()
            .map(|facet| {
                let corners = facet.corners.each_ref().map(|corner| self.in_link(corner));
                (self.best_cut(&corners).least(), corners)
            })
            .collect();
        bounds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<Found> = None;
        for (bound, corners) in &bounds {
            let limit = best.as_ref().map_or(f64::INFINITY, |best| best.distance);
            if *bound >= limit {
                break;
            }
            let (_, found) = self.distance(corners, limit, true);
            if found.distance < limit {
                best = Some(found);
            }
        }
        let best = best?;
        let foot = self.center + self.turn * best.at;
        Some(Touch { foot, normal: -(self.turn * best.m), gap: best.distance })
    }

    /// The plane that proves most of a triangle.
    fn best_cut(&self, corners: &[Vector; 3]) -> Cut {
        let cuts = self.smooth.planes().iter().map(|(m, reach)| Cut::new(*m, *reach, corners));
        cuts.max_by(|a, b| a.least().total_cmp(&b.least())).expect("a hull has planes")
    }

    /// Lower bound of the least distance of a triangle, in the hull's link, and the nearest point that was found. The search ends
    /// where both agree, and where all of the triangle is beyond `limit`; also where some is before it, unless it is to be `exact`.
    fn distance(&self, corners: &[Vector; 3], limit: f64, exact: bool) -> (f64, Found) {
        let mut cuts = vec![self.best_cut(corners)];
        // The planes of the corners keep the first steps from going astray.
        for corner in corners {
            let found = self.distance_of(corner);
            cuts.push(self.cut(found.m, corners));
        }
        let mut best: Option<Found> = None;
        let mut low = f64::NEG_INFINITY;
        for _ in 0..MOST_CUTS {
            let (shares, least) = lowest(&cuts);
            low = least.max(low);
            let at: Vector = (0..3).map(|k| corners[k] * shares[k]).sum();
            let found = self.distance_of(&at);
            let m = found.m;
            if best.as_ref().is_none_or(|best| found.distance < best.distance) {
                best = Some(found);
            }
            let high = best.as_ref().map_or(f64::INFINITY, |best| best.distance);
            if high - low < AGREED || low >= limit || (high < limit && !exact) {
                break;
            }
            cuts.push(self.cut(m, corners));
        }
        (low, best.expect("a point was looked at"))
    }

    fn cut(&self, m: Vector, corners: &[Vector; 3]) -> Cut {
        Cut::new(m, self.smooth.point(&m).dot(&m), corners)
    }

    /// Distance of a point from the hull, both in its link: by Newton's method on the direction. Inside the hull there may be several
    /// directions that nothing near them beats, so the search begins with the best of many.
    fn distance_of(&self, at: &Vector) -> Found {
        let value = |m: &Vector| {
            let point = self.smooth.point(m);
            (at.dot(m) - point.dot(m), point)
        };
        let beyond = |(m, reach): &(Vector, f64)| at.dot(m) - reach;
        let first = self.smooth.planes().iter().max_by(|a, b| beyond(a).total_cmp(&beyond(b)));
        let mut m = first.expect("a hull has planes").0;
        let (mut distance, mut point) = value(&m);
        for _ in 0..MOST_STEPS {
            let away = at - point;
            let slope = away - m * m.dot(&away);
            if slope.norm() < FLAT {
                break;
            }
            let aside = if m.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
            let x = m.cross(&aside).normalize();
            let across = [x, m.cross(&x)];
            let radii = self.smooth.radii(&m);
            let flat = |v: &Vector| Vector2::new(v.dot(&across[0]), v.dot(&across[1]));
            let bend = Matrix2::from_columns(&across.map(|t| flat(&(radii * t + t * distance))));
            let newton =
                bend.try_inverse().map(|inverse| inverse * flat(&slope)).filter(|step| step.dot(&flat(&slope)) > 0.0);
            // Deep inside, where the hull bends more than it is deep, Newton's method may lead astray: then straight up.
            let straight = flat(&slope).normalize() * LONGEST_STEP;
            let better = newton.into_iter().chain([straight]).find_map(|step| {
                let step = across[0] * step.x + across[1] * step.y;
                let longest = (LONGEST_STEP / step.norm()).min(1.0);
                let shares = (0..MOST_HALVINGS).map(|halvings| longest * 0.5f64.powi(halvings));
                shares
                    .map(|share| (m + step * share).normalize())
                    .map(|next| (next, value(&next)))
                    .find(|(_, seen)| seen.0 > distance)
            });
            let Some((next, seen)) = better else { break };
            m = next;
            (distance, point) = seen;
        }
        Found { at: *at, m, distance }
    }
}

/// A point near the hull, in its link, from its centre.
struct Found {
    at: Vector,
    /// Outward normal of the hull at its nearest point.
    m: Vector,
    distance: f64,
}

/// Where on a triangle the largest of all planes is least, as shares of the corners, and how large it is there, less what the search
/// leaves open. Such a maximum is convex along lines: nested searches find it.
fn lowest(cuts: &[Cut]) -> ([f64; 3], f64) {
    let shares = |u: f64, v: f64| [1.0 - u - v * (1.0 - u), u, v * (1.0 - u)];
    let value = |shares: &[f64; 3]| cuts.iter().map(|cut| cut.at(shares)).fold(f64::NEG_INFINITY, f64::max);
    let inner = |u: f64| narrow(|v| value(&shares(u, v)));
    let (u, _) = narrow(|u| inner(u).1);
    let (v, least) = inner(u);
    (shares(u, v), least - ROUNDING)
}

/// Where a convex function is least on `[0, 1]`, and its value there: by golden sections.
fn narrow(value: impl Fn(f64) -> f64) -> (f64, f64) {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (0.0, 1.0);
    let mut inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let mut seen = inner.map(&value);
    for _ in 0..HALVINGS {
        if seen[0] <= seen[1] {
            high = inner[1];
            inner = [high - GOLDEN * (high - low), inner[0]];
            seen = [value(inner[0]), seen[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + GOLDEN * (high - low)];
            seen = [seen[1], value(inner[1])];
        }
    }
    let ends = [0.0, 1.0].map(|at| (at, value(at)));
    let middle = if seen[0] <= seen[1] { (inner[0], seen[0]) } else { (inner[1], seen[1]) };
    ends.into_iter().fold(middle, |best, end| if end.1 < best.1 { end } else { best })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::check::surface::SortedShape;
    use crate::check::tip_surface::spread;
    use nalgebra::Rotation3;
    use regrasp_base::Rng;
    use regrasp_geometry::{ConvexHull, Shape, TriangleMesh};
    use regrasp_robot::tip::smooth_hull::SmoothHull;
    use std::cell::RefCell;
    use std::sync::Arc;

    /// A bar with flat faces, sharp rims and a rounded end.
    pub fn bar() -> Smooth {
        let mut points = Vec::new();
        for k in 0..25 {
            let (up, out) = (std::f64::consts::PI * f64::from(k) / 24.0).sin_cos();
            points.extend([-0.010, 0.010].map(|x| Point::new(x, 0.012 * out, 0.012 * up)));
        }
        points.extend(
            (0..4).map(|k| Point::new(f64::from(k % 2) * 0.02 - 0.01, f64::from(k / 2) * 0.024 - 0.012, -0.015)),
        );
        let hull = Arc::new(ConvexHull::new(&points).unwrap());
        Smooth::of(&SmoothHull::near(&hull, None).unwrap().0, &hull, None)
    }

    /// Deeper than the hull's rims are round, a point is as near to two sides of a rim: what is found may be a little deeper than what is
    /// there, which rejects.
    const DEEP: f64 = -0.3e-3;
    const CELL: f64 = 1.0e-3;
    const N_CELLS: u32 = 40;

    /// A sheet of small triangles that folds everywhere, as scans do, over a hill.
    pub fn folded(rng: &mut Rng, folds: f64) -> TriangleMesh {
        let half = 0.5 * f64::from(N_CELLS) * CELL;
        let mut vertices = Vec::new();
        for i in 0..=N_CELLS {
            for j in 0..=N_CELLS {
                let at = [i, j].map(|k| f64::from(k) * CELL - half + rng.uniform(-0.3, 0.3) * CELL);
                let hill = (0.04f64.powi(2) - at[0] * at[0] - at[1] * at[1]).sqrt() - 0.04;
                vertices.push(Point::new(at[0], at[1], hill + rng.uniform(-folds, folds)));
            }
        }
        let corner = |i: u32, j: u32| i * (N_CELLS + 1) + j;
        let cells = (0..N_CELLS).flat_map(|i| (0..N_CELLS).map(move |j| (i, j)));
        let triangles = cells.flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        TriangleMesh::new(vertices, triangles.collect()).unwrap()
    }

    /// Distance of a point from the hull: the farthest that it is beyond any of many planes.
    fn brute_distance(planes: &[(Vector, f64)], at: &Vector) -> f64 {
        planes.iter().map(|(m, reach)| at.dot(m) - reach).fold(f64::NEG_INFINITY, f64::max)
    }

    fn many_planes(smooth: &Smooth) -> Vec<(Vector, f64)> {
        spread(40_000).map(|m| (m, smooth.point(&m).dot(&m))).collect()
    }

    /// The nearest of all triangles is as near as the nearest of many points on them, whichever guess the search begins with; and what
    /// touches is a touch: the tip's point is the gap off the foot, along the normal.
    #[test]
    fn touches_on_folds_are_where_the_surface_is_nearest() {
        let tip = bar();
        let planes = many_planes(&tip);
        let mut rng = Rng::keyed(1, "folds", 0);
        let (mut n_lost, mut n_wrong) = (0, 0);
        for k in 0..60 {
            let mesh = folded(&mut rng, [0.02e-3, 0.1e-3, 0.3e-3][k % 3]);
            let triangles: Vec<[Point; 3]> = (0..mesh.triangles().len()).map(|i| mesh.corners(i)).collect();
            let sorted = SortedShape::of(&Shape::Mesh(Arc::new(mesh)));
            let turn = *Rotation3::new(Vector::from(rng.direction()) * rng.uniform(0.0, 3.0)).matrix();
            let facing = -turn.tr_mul(&Vector::z());
            let aside = Vector::new(rng.uniform(-3e-3, 3e-3), rng.uniform(-3e-3, 3e-3), rng.uniform(-0.6e-3, 0.2e-3));
            let center = Point::from(aside - turn * tip.point(&facing));
            let in_link = |point: &Point| turn.tr_mul(&(point - center));
            let patch = Patch::near(&sorted, &center, 0.03).only(|facet| may_be_near(&tip, in_link, facet, 2e-3));
            let proofs = RefCell::default();
            let place = Place { patch: &patch, smooth: &tip, center, turn, proofs: &proofs };

            let sampled = nearest_of_samples(&triangles, &planes, in_link);
            let nearest = place.nearest().unwrap();
            let deeper = if sampled < DEEP { 5e-5 } else { 8e-6 };
            assert!(nearest.gap < sampled + 8e-6 && nearest.gap > sampled - deeper, "{} {sampled}", nearest.gap);
            for _ in 0..4 {
                let guess = (Vector::z() + Vector::from(rng.direction()) * 0.4).normalize();
                let touch = place.touch(&[guess], 1e-5).unwrap();
                assert!(touch.gap < nearest.gap + 1e-5 + 1e-9, "{} {}", touch.gap, nearest.gap);
                let facing = center + turn * tip.point(&-turn.tr_mul(&touch.normal));
                let off = facing - touch.foot - touch.normal * touch.gap;
                assert!(off.norm() < 1e-5 || touch.gap < DEEP, "{off} {}", touch.gap);
                match place.settle(&guess) {
                    None => n_lost += 1,
                    Some(found) if found.gap > nearest.gap + 1e-4 => n_wrong += 1,
                    Some(_) => {}
                }
            }
        }
        // Guesses alone do not tell: this is what the proof is for.
        assert!(n_lost >= 10 && n_wrong >= 10, "{n_lost} {n_wrong}");
    }

    /// Least distance of points on triangles: of a coarse grid first, then of a fine one where that is near.
    fn nearest_of_samples(
        triangles: &[[Point; 3]],
        planes: &[(Vector, f64)],
        in_link: impl Fn(&Point) -> Vector,
    ) -> f64 {
        let coarse: Vec<(Vector, f64)> = planes.iter().step_by(40).copied().collect();
        let mut near: Vec<(f64, &[Point; 3])> = triangles
            .iter()
            .map(|corners| {
                let middle = in_link(&Point::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0));
                (brute_distance(&coarse, &middle), corners)
            })
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut least = f64::INFINITY;
        for (bound, corners) in near {
            // No point is farther than 1.5 mm from the middle.
            if bound - 1.5e-3 > least {
                break;
            }
            let n = 24;
            for i in 0..=n {
                for j in 0..=n - i {
                    let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(n));
                    let at = in_link(&(corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v));
                    if brute_distance(&coarse, &at) < least {
                        least = least.min(brute_distance(planes, &at));
                    }
                }
            }
        }
        least
    }

    #[test]
    fn radii_are_how_points_move() {
        let tip = bar();
        let mut rng = Rng::keyed(2, "folds", 0);
        for _ in 0..200 {
            let n = Vector::from(rng.direction());
            let along = n.cross(&Vector::from(rng.direction())).normalize();
            let step = 1e-6;
            let at = |by: f64| tip.point(&(n + along * by).normalize());
            let moved = (at(step) - at(-step)) / (2.0 * step);
            let told = tip.radii(&n) * along;
            assert!((moved - told).norm() < 1e-4 * told.norm() + 1e-7, "{moved} {told}");
        }
    }

    #[test]
    fn planes_of_a_triangle_are_lowest_where_points_say() {
        let mut rng = Rng::keyed(3, "folds", 0);
        for _ in 0..40 {
            let n_cuts = 1 + (rng.uniform(0.0, 8.0) as usize);
            let cut = |rng: &mut Rng| Cut { corners: std::array::from_fn(|_| rng.uniform(-1.0, 1.0)) };
            let cuts: Vec<Cut> = (0..n_cuts).map(|_| cut(&mut rng)).collect();
            let (shares, least) = lowest(&cuts);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12 && shares.iter().all(|share| *share > -1e-12));
            let n = 60;
            for i in 0..=n {
                for j in 0..=n - i {
                    let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(n));
                    let largest = cuts.iter().map(|cut| cut.at(&[1.0 - u - v, u, v])).fold(f64::NEG_INFINITY, f64::max);
                    assert!(largest >= least - 1e-7, "{largest} {least}");
                }
            }
        }
    }
}
