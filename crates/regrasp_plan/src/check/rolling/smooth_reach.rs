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
/// Lower and upper bound of a triangle's distance agree, in metres.
const AGREED: f64 = 1e-9;
/// What searches on triangles leave open at most, in metres.
const ROUNDING: f64 = 1e-11;
/// Most planes that are added for a triangle.
const MOST_CUTS: usize = 40;
/// Steps of Newton's method to a point's distance, halvings of a step, the longest step and the gradient that is none.
const MOST_STEPS: usize = 60;
const MOST_HALVINGS: usize = 12;
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
    m: Vector,
    corners: [f64; 3],
}

impl Cut {
    fn new(m: Vector, reach: f64, corners: &[Vector; 3]) -> Self {
        Cut { m, corners: corners.each_ref().map(|corner| corner.dot(&m) - reach) }
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
        let mut near: Option<Vec<(Vector, f64)>> = None;
        // What is behind the plane that touches at the touch is proven: most of the patch.
        let level = self.center.coords.dot(&touch.normal) - reach - limit;
        let height = |corner: &Point| corner.coords.dot(&touch.normal);
        facets.iter().all(|facet| {
            let is_behind = height(&facet.corners[0]) + facet.reach <= level
                || facet.corners.iter().all(|corner| height(corner) <= level);
            if is_behind {
                return true;
            }
            let corners = facet.corners.each_ref().map(|corner| self.in_link(corner));
            let near = near.get_or_insert_with(|| {
                let planes = self.smooth.planes().iter().filter(|(m, _)| m.dot(&facing) > NEAR_COSINE);
                planes.copied().collect()
            });
            let is_behind = |(m, reach): &(Vector, f64)| Cut::new(*m, *reach, &corners).least() >= limit;
            near.iter().any(is_behind) || self.smooth.planes().iter().any(is_behind) || {
                let (low, _) = self.distance(&corners, limit, false);
                low >= limit
            }
        })
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
            let found = self.distance_of(corner, &cuts[0].m);
            cuts.push(self.cut(found.m, corners));
        }
        let mut best: Option<Found> = None;
        let mut low = f64::NEG_INFINITY;
        for _ in 0..MOST_CUTS {
            let (shares, least) = lowest(&cuts);
            low = least.max(low);
            let at: Vector = (0..3).map(|k| corners[k] * shares[k]).sum();
            let steepest =
                cuts.iter().max_by(|a, b| a.at(&shares).total_cmp(&b.at(&shares))).map_or(cuts[0].m, |cut| cut.m);
            let found = self.distance_of(&at, &steepest);
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

    /// Distance of a point from the hull, both in its link: by Newton's method on the direction, near `m`.
    fn distance_of(&self, at: &Vector, m: &Vector) -> Found {
        let value = |m: &Vector| {
            let point = self.smooth.point(m);
            (at.dot(m) - point.dot(m), point)
        };
        let mut m = *m;
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
            let step = newton.unwrap_or_else(|| flat(&slope).normalize() * LONGEST_STEP);
            let step = across[0] * step.x + across[1] * step.y;
            let mut share = (LONGEST_STEP / step.norm()).min(1.0);
            let mut better = None;
            for _ in 0..MOST_HALVINGS {
                let next = (m + step * share).normalize();
                let seen = value(&next);
                if seen.0 > distance {
                    better = Some((next, seen));
                    break;
                }
                share *= 0.5;
            }
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
