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
const MAX_SWEEPS: usize = 100;
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
        let mut points = vec![start, surface.project(&side).point_in_object, end];
        // Straightened while it is too coarse, a chain slips over to another side.
        while points.len() <= COARSEST {
            points = refined(&points, &surface);
        }
        straighten(&mut points, &surface);
        if !is_even(&points) {
            // It jumped across a thin solid.
            continue;
        }
        let length = lengths_of(&points, &surface)[points.len() - 1];
        if length.is_finite() && best.as_ref().is_none_or(|(shortest, _)| length < *shortest) {
            best = Some((length, points));
        }
    }
    let (_, mut points) = best?;
    while points.len() <= PIECES {
        let finer = refined(&points, &surface);
        points = finer.clone();
        straighten(&mut points, &surface);
        if !is_even(&points) {
            points = finer;
        }
    }
    let lengths = lengths_of(&points, &surface);
    Some(Geodesic::smooth(points, lengths, Arc::new(surface)))
}

/// The chain with a point between each two.
fn refined(points: &[Point], surface: &impl SurfaceKind) -> Vec<Point> {
    let mut finer = Vec::with_capacity(2 * points.len());
    for pair in points.windows(2) {
        finer.push(pair[0]);
        finer.push(surface.project(&nalgebra::center(&pair[0], &pair[1])).point_in_object);
    }
    finer.extend(points.last());
    finer
}

/// Whether no piece is longer than twice the mean, as in a chain pulled straight.
fn is_even(points: &[Point]) -> bool {
    let pieces = || points.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    let mean = pieces().sum::<f64>() / (points.len() - 1) as f64;
    pieces().all(|piece| piece <= 2.0 * mean)
}

/// Moves each inner point towards the middle of its neighbours until that moves nothing.
fn straighten(points: &mut [Point], surface: &impl SurfaceKind) {
    let n = points.len() - 1;
    let size = (points[n] - points[0]).norm();
    // Over-relaxation of a chain of n points (Young 1954).
    let relaxation = 2.0 / (1.0 + (std::f64::consts::PI / n as f64).sin());
    for _ in 0..MAX_SWEEPS {
        let mut moved: f64 = 0.0;
        for i in 1..n {
            let middle = nalgebra::center(&points[i - 1], &points[i + 1]);
            let target = surface.project(&(points[i] + (middle - points[i]) * relaxation)).point_in_object;
            moved = moved.max((target - points[i]).norm());
            points[i] = target;
        }
        if moved < 1e-6 * size {
            break;
        }
    }
}

/// Length up to each point, along the arcs over the chords, from the turn of the normal between their ends.
fn lengths_of(points: &[Point], surface: &impl SurfaceKind) -> Vec<f64> {
    let mut length = 0.0;
    let mut lengths = vec![length];
    let mut normal = surface.project(&points[0]).normal_in_object;
    for pair in points.windows(2) {
        let next = surface.project(&pair[1]).normal_in_object;
        let half = 0.5 * normal.cross(&next).norm().atan2(normal.dot(&next));
        length += (pair[1] - pair[0]).norm() * if half < 1e-6 { 1.0 } else { half / half.sin() };
        lengths.push(length);
        normal = next;
    }
    lengths
}
