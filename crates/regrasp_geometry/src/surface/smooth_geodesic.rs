//! Geodesics of smooth convex surfaces: a chain of points, straightened from coarse to fine.
//!
//! A chain is straight when each inner point is the surface point nearest to the middle of its neighbours; doubling
//! the number of points each time keeps the sweeps per level few (multigrid).

use super::geodesic::Geodesic;
use super::{SurfaceKind, SurfacePoint, unit_or};
use crate::frame::{Point, Vector, tangents};
use std::sync::Arc;

/// Number of pieces of the finest chain.
const PIECES: usize = 32;
/// Sweeps per level; the coarse levels converge in fewer.
const MAX_SWEEPS: usize = 60;
/// Number of pieces of the coarsest chain that is straightened.
const COARSEST: usize = 8;

/// The shortest of the straightened chains from `a` to `b` that start on different sides of the solid.
pub(super) fn straightened(
    a: &SurfacePoint,
    b: &SurfacePoint,
    surface: impl SurfaceKind + 'static,
) -> Option<Geodesic> {
    let (start, end) = (a.point_in_object, b.point_in_object);
    let middle = nalgebra::center(&start, &end);
    let chord = end - start;
    let mut sides = vec![middle];
    if a.normal_in_object.dot(&b.normal_in_object) < 0.5 && chord.norm() > 0.0 {
        // The chord goes through the solid: there may be a shorter way on another side.
        let (u, v) = tangents(&unit_or(chord, Vector::z_axis()));
        for direction in [u.into_inner(), v.into_inner(), -u.into_inner(), -v.into_inner()] {
            sides.push(middle + direction * chord.norm());
        }
    }
    let mut best: Option<(f64, Vec<Point>)> = None;
    for side in sides {
        let (length, points) = straighten(start, end, side, &surface);
        if length.is_finite() && best.as_ref().is_none_or(|(shortest, _)| length < *shortest) {
            best = Some((length, points));
        }
    }
    let (length, points) = best?;
    Some(Geodesic::smooth(points, length, Arc::new(surface)))
}

fn straighten(start: Point, end: Point, side: Point, surface: &impl SurfaceKind) -> (f64, Vec<Point>) {
    let mut points = vec![start, surface.project(&side).point_in_object, end];
    let size = (end - start).norm().max(1e-300);
    loop {
        let n = points.len() - 1;
        // Over-relaxation of a chain of n points (Young 1954).
        let relaxation = 2.0 / (1.0 + (std::f64::consts::PI / n as f64).sin());
        // Relaxed while it is coarse, a chain slips over to another side.
        for _ in 0..if n < COARSEST { 0 } else { MAX_SWEEPS } {
            let mut moved: f64 = 0.0;
            for i in 1..n {
                let middle = nalgebra::center(&points[i - 1], &points[i + 1]);
                let target = surface.project(&(points[i] + (middle - points[i]) * relaxation)).point_in_object;
                moved = moved.max((target - points[i]).norm());
                points[i] = target;
            }
            if moved < 1e-7 * size {
                break;
            }
        }
        if n >= PIECES {
            break;
        }
        let mut finer = Vec::with_capacity(2 * n + 1);
        for pair in points.windows(2) {
            finer.push(pair[0]);
            finer.push(surface.project(&nalgebra::center(&pair[0], &pair[1])).point_in_object);
        }
        finer.push(end);
        points = finer;
    }
    // The arc over each chord, from the turn of the normal between its ends.
    let mut length = 0.0;
    let mut normal = surface.project(&start).normal_in_object;
    for pair in points.windows(2) {
        let next = surface.project(&pair[1]).normal_in_object;
        let half = 0.5 * normal.cross(&next).norm().atan2(normal.dot(&next));
        length += (pair[1] - pair[0]).norm() * if half < 1e-6 { 1.0 } else { half / half.sin() };
        normal = next;
    }
    (length, points)
}
