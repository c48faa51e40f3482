//! A smooth, strictly convex surface near a convex polyhedron: what a fingertip that is a mesh rolls on.
//!
//! With the origin inside and `v_i` corners of the polyhedron, moved a little along their rays, the support function is
//!
//! ```text
//! s_i = max(0, v_i . n)      k(n) = (sum s_i^p)^(1/p)      h(n) = k(n) + r
//! ```
//!
//! for a unit normal `n`: a smoothed maximum, with a small ball of radius `r` on top. It is convex for any `v_i`, because each
//! `s_i` is convex and not negative. With the shares `a_i = (s_i / k)^p`, which add up to one, and `u_i = v_i k / s_i`, the point
//! with the normal `n` is `sum a_i u_i + r n`. Its radii of curvature are those of `(p - 1) / k` times the covariance of the
//! `u_i`, plus `r`. All `u_i` lie in the plane `n . u = k`.

use super::{Pad, spiral};
use nalgebra::{Matrix2, Matrix3, Matrix3x2};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::{ConvexHull, Point, UnitVector, Vector};
use wide::f64x4;

mod table;

use table::{Block, LANES, MOST_BLOCKS, NormalTable, along, in_blocks, largest_of, splat};

/// The exponent `p`. Larger ones follow corners more closely, and are less even between them.
const EXPONENT: i32 = 200;
/// Points with a smaller share of the largest `s_i` do not count: `0.88^200` is 8e-12.
const LISTED_SHARE: f64 = 0.88;
/// What is listed and has a smaller share yet, or is behind the centre, counts as if it had this one: `0.5^200` is 6e-61.
const LEAST_SHARE: f64 = 0.5;
/// In the fit, powers below this do not count.
const LEAST_POWER: f64 = 1e-11;
/// Most corners that are kept.
pub const MOST_POINTS: usize = LANES * MOST_BLOCKS;
/// Corners are added until none is missed by more than this, in metres.
const MISSED: f64 = 4e-6;
/// Directions in which the surface is fitted, and others in which it is measured.
const FITTED: usize = 4000;
const MEASURED: usize = 9001;
/// Rounds of the fit.
const FIT_ROUNDS: usize = 14;
/// Radius of the ball on top, in metres, and as a share of the distance from the centre to the nearest face.
const ROUNDING: f64 = 0.4e-3;
const ROUNDING_SHARE: f64 = 0.05;
/// Radius that is left of it at least, as a share.
const LEAST_ROUNDING: f64 = 0.3;

/// The surface, about its centre.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothHull {
    points: Vec<Vector>,
    rounding: f64,
    reach: f64,
    table: NormalTable,
}

/// The point of the surface that has a normal, and how the surface bends there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// The point, from the centre.
    pub point: Vector,
    /// Second derivative of the support function: how the point moves when the normal turns. Its eigenvalues across the normal
    /// are the radii of curvature, in metres; along the normal it is zero.
    pub radii: Matrix3<f64>,
}

impl SmoothHull {
    /// The surface near `hull`, whose origin lies inside, and its largest distance from it over the pad, in metres: the
    /// difference of the support functions. None where the origin is not inside.
    pub fn near(hull: &ConvexHull, pad: Option<&Pad>) -> Option<(Self, f64)> {
        let depth = depth_of_origin(hull)?;
        let rounding = ROUNDING.min(ROUNDING_SHARE * depth);
        let mut hint = 0;
        let mut target = |n: Vector| {
            let corner = hull.support(&n, &mut hint).coords;
            Target { normal: n, corner, support: corner.dot(&n), counts: pad.is_none_or(|pad| pad.holds(&n)) }
        };
        let targets: Vec<Target> = spiral(FITTED).map(&mut target).collect();
        let points = in_blocks(choose(&targets));
        let mut surface = SmoothHull { table: NormalTable::new(&points, LISTED_SHARE), points, rounding, reach: 0.0 };
        for _ in 0..FIT_ROUNDS {
            surface.fit(&targets);
        }
        surface.table = NormalTable::new(&surface.points, LISTED_SHARE);
        let measured: Vec<Target> = spiral(MEASURED).map(&mut target).filter(|target| target.counts).collect();
        let off = |surface: &Self| {
            let apart = measured.iter().map(|target| surface.support(&target.normal) - target.support);
            apart.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), off| (low.min(off), high.max(off)))
        };
        // As far outside as inside.
        let (low, high) = off(&surface);
        surface.rounding = (rounding - 0.5 * (low + high)).max(LEAST_ROUNDING * rounding);
        let (low, high) = off(&surface);
        surface.reach = spiral(FITTED).map(|n| surface.point(&n).norm()).fold(0.0, f64::max);
        Some((surface, high.abs().max(low.abs())))
    }

    /// Moves the points along their rays, each by the mean of what is missing in the directions in which it counts.
    fn fit(&mut self, targets: &[Target]) {
        let mut sums = vec![(0.0, 0.0); self.points.len()];
        let mut shares = Vec::new();
        for target in targets {
            let smoothed = self.shares(&target.normal, &mut shares);
            let missing = ((target.support - self.rounding) / smoothed).ln();
            for &(i, share) in &shares {
                sums[i].0 += share * missing;
                sums[i].1 += share;
            }
        }
        for (point, (missing, weight)) in self.points.iter_mut().zip(sums).filter(|(_, (_, weight))| *weight > 1e-9) {
            *point *= (missing / weight).exp();
        }
        self.table.set_points(&self.points);
    }

    /// The shares of the points towards `n`, by index, and the smoothed maximum.
    fn shares(&self, n: &Vector, shares: &mut Vec<(usize, f64)>) -> f64 {
        shares.clear();
        let (largest, sum) = powers(self.table.near(n), n, |block, _, _, powers| {
            let shares_of_block = powers.to_array().into_iter().enumerate().filter(|(_, power)| *power > LEAST_POWER);
            shares.extend(shares_of_block.map(|(lane, power)| (block * LANES + lane, power)));
        });
        shares.iter_mut().for_each(|(_, share)| *share /= sum);
        largest * root(sum)
    }

    /// The support function: how far the surface reaches towards the unit vector `n`.
    pub fn support(&self, n: &Vector) -> f64 {
        let (largest, sum) = powers(self.table.near(n), n, |_, _, _, _| ());
        largest * root(sum) + self.rounding
    }

    /// The point with the outward normal `n`, a unit vector, from the centre.
    #[inline]
    pub fn point(&self, n: &Vector) -> Vector {
        let mut weighted = [f64x4::ZERO; 3];
        let (largest, sum) = powers(self.table.near(n), n, |_, points, inverse, power| {
            let weight = power * inverse;
            weighted.iter_mut().zip(points).for_each(|(sum, part)| *sum += *part * weight);
        });
        Vector::from(weighted.map(total)) * (largest * root(sum) / sum) + n * self.rounding
    }

    /// The point with the outward normal `n`, a unit vector, and the curvature there.
    pub fn bend(&self, n: &Vector) -> Bend {
        // How far the points of the plane in which all lie are from where `n` meets it, along two directions in it.
        let (x, y) = tangents(&UnitVector::new_unchecked(*n));
        let directions = [splat(&x), splat(&y)];
        let mut means = [f64x4::ZERO; 2];
        let (mut xx, mut xy, mut yy) = (f64x4::ZERO, f64x4::ZERO, f64x4::ZERO);
        let (largest, sum) = powers(self.table.near(n), n, |_, points, inverse, power| {
            let [along_x, along_y] = [along(points, &directions[0]) * inverse, along(points, &directions[1]) * inverse];
            let (weighted_x, weighted_y) = (along_x * power, along_y * power);
            means[0] += weighted_x;
            means[1] += weighted_y;
            xx += weighted_x * along_x;
            xy += weighted_x * along_y;
            yy += weighted_y * along_y;
        });
        let smoothed = largest * root(sum);
        let [mean_x, mean_y] = means.map(|mean| total(mean) / sum);
        let [xx, xy, yy] = [xx, xy, yy].map(|square| total(square) / sum);
        let flatness = f64::from(EXPONENT - 1) * smoothed;
        let radii =
            Matrix2::new(xx - mean_x * mean_x, xy - mean_x * mean_y, xy - mean_x * mean_y, yy - mean_y * mean_y)
                * flatness
                + Matrix2::identity() * self.rounding;
        let plane = Matrix3x2::from_columns(&[x.into_inner(), y.into_inner()]);
        Bend {
            point: (n + x.as_ref() * mean_x + y.as_ref() * mean_y) * smoothed + n * self.rounding,
            radii: plane * radii * plane.transpose(),
        }
    }

    /// Largest distance of a point of the surface from the centre.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Smallest radius of curvature that is sure: that of the ball on top.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// The points `v_i`.
    pub fn points(&self) -> &[Vector] {
        &self.points
    }

    /// The exponent `p`.
    pub fn exponent(&self) -> i32 {
        EXPONENT
    }
}

/// Calls `each` with every four points: the number of their block, themselves, `1 / s_i`, and `(s_i / max s)^p`. The largest `s_i`,
/// and the sum of the powers.
///
/// Nothing is multiplied and added at once, so that results are the same on every machine.
#[inline]
fn powers<'a>(
    blocks: impl Iterator<Item = (usize, &'a Block)> + Clone,
    n: &Vector,
    mut each: impl FnMut(usize, &Block, f64x4, f64x4),
) -> (f64, f64) {
    let n = splat(n);
    let most = blocks.clone().fold(f64x4::ZERO, |most, (_, points)| most.fast_max(along(points, &n)));
    let largest = largest_of(most);
    let (least, scale) = (f64x4::splat(LEAST_SHARE * largest), f64x4::splat(1.0 / largest));
    let mut sum = f64x4::ZERO;
    for (block, points) in blocks {
        let s = along(points, &n).fast_max(least);
        let power = power(s * scale);
        sum += power;
        each(block, points, f64x4::ONE / s, power);
    }
    (largest, total(sum))
}

/// The sum of four numbers, in an order that is the same on every machine.
#[inline]
fn total(lanes: f64x4) -> f64 {
    let [a, b, c, d] = lanes.to_array();
    (a + b) + (c + d)
}

/// `q^200`, the same on every machine.
#[inline]
fn power(q: f64x4) -> f64x4 {
    let q2 = q * q;
    let q4 = q2 * q2;
    let q8 = q4 * q4;
    let q16 = q8 * q8;
    let q32 = q16 * q16;
    let q64 = q32 * q32;
    q64 * q64 * q64 * q8
}

/// The `p`-th root of a sum from 1 to [`MOST_POINTS`]: by the series of the exponential, whose rest is below 1e-14 there.
#[inline]
fn root(sum: f64) -> f64 {
    let x = sum.ln() / f64::from(EXPONENT);
    1.0 + x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0)))))
}

/// What the surface is to be in one direction.
struct Target {
    normal: Vector,
    corner: Vector,
    support: f64,
    /// False outside the pad.
    counts: bool,
}

/// Corners that reach about as far as all of them in all directions: first where the pad is, then elsewhere.
fn choose(targets: &[Target]) -> Vec<Vector> {
    let mut chosen: Vec<Vector> = Vec::new();
    let mut missed: Vec<f64> = targets.iter().map(|target| target.support).collect();
    while chosen.len() < MOST_POINTS {
        let worst = |counts: bool| {
            let of_kind = (0..targets.len()).filter(|&k| !counts || targets[k].counts);
            of_kind.max_by(|&a, &b| missed[a].total_cmp(&missed[b])).filter(|&k| missed[k] > MISSED)
        };
        let Some(k) = worst(true).or_else(|| worst(false)) else { break };
        let corner = targets[k].corner;
        for (missed, target) in missed.iter_mut().zip(targets) {
            *missed = missed.min(target.support - corner.dot(&target.normal));
        }
        chosen.push(corner);
    }
    chosen
}

/// Distance from the origin to the nearest face; None where it is not inside.
pub fn depth_of_origin(hull: &ConvexHull) -> Option<f64> {
    let corner = |k: u32| hull.vertices()[k as usize];
    let mut depth = f64::INFINITY;
    for &[a, b, c] in hull.triangles() {
        let [a, b, c]: [Point; 3] = [corner(a), corner(b), corner(c)];
        if let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-18) {
            depth = depth.min(normal.dot(&a.coords));
        }
    }
    (depth > 0.0 && depth.is_finite()).then_some(depth)
}

#[cfg(test)]
mod tests;
