//! A path on a surface, walked at constant speed.

use super::{SurfaceKind, SurfacePoint, unit_or};
use crate::frame::{Point, UnitVector, Vector};
use std::sync::Arc;

/// A shortest path on a surface; it does not borrow the surface.
#[derive(Debug, Clone)]
pub struct Geodesic {
    length: f64,
    path: Path,
}

#[derive(Debug, Clone)]
enum Path {
    /// From `from`, turning towards `tangent` (both of length one), by `angle`.
    GreatCircle { radius: f64, from: Vector, tangent: Vector, angle: f64 },
    /// Pieces one after the other; never empty.
    Legs(Vec<Leg>),
    /// Points of a smooth surface, at least two, with the length up to each. Between them the chord is projected.
    Smooth { points: Vec<Point>, lengths: Vec<f64>, surface: Arc<dyn SurfaceKind> },
}

/// A piece of a path, within one face.
#[derive(Debug, Clone)]
pub(super) struct Leg {
    pub start: Point,
    pub end: Point,
    /// Normals at both ends, interpolated linearly in between; need not be of length one.
    pub start_normal: Vector,
    pub end_normal: Vector,
    pub facet: u32,
    pub bend: Bend,
    pub length: f64,
}

/// Form of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Bend {
    Straight,
    /// On a cylinder about z with this radius, turning by this angle from the start.
    Helix {
        radius: f64,
        angle: f64,
    },
}

impl Leg {
    pub fn straight(start: Point, end: Point, normal: UnitVector, facet: u32) -> Self {
        let normal = normal.into_inner();
        let length = (end - start).norm();
        Leg { start, end, start_normal: normal, end_normal: normal, facet, bend: Bend::Straight, length }
    }

    fn at(&self, t: f64) -> SurfacePoint {
        match self.bend {
            Bend::Straight => {
                let normal = self.start_normal.lerp(&self.end_normal, t);
                let normal = unit_or(normal, unit_or(self.start_normal, Vector::z_axis()));
                SurfacePoint::new(self.start + (self.end - self.start) * t, normal, self.facet)
            }
            Bend::Helix { radius, angle } => {
                let (sin, cos) = (self.start.y.atan2(self.start.x) + t * angle).sin_cos();
                let z = self.start.z + t * (self.end.z - self.start.z);
                let normal = UnitVector::new_unchecked(Vector::new(cos, sin, 0.0));
                SurfacePoint::new(Point::new(radius * cos, radius * sin, z), normal, self.facet)
            }
        }
    }
}

impl Geodesic {
    /// None when the two directions are opposite (within 1e-9 rad), so that every great circle is as short.
    pub(super) fn great_circle(radius: f64, a: &Vector, b: &Vector) -> Option<Self> {
        let (from, to) = (a.normalize(), b.normalize());
        let across = to - from * from.dot(&to);
        let sine = from.cross(&to).norm();
        let angle = sine.atan2(from.dot(&to));
        if std::f64::consts::PI - angle < 1e-9 {
            return None;
        }
        let tangent = across.try_normalize(1e-300).unwrap_or_else(Vector::zeros);
        Some(Geodesic { length: radius * angle, path: Path::GreatCircle { radius, from, tangent, angle } })
    }

    pub(super) fn of_legs(legs: Vec<Leg>) -> Self {
        assert!(!legs.is_empty(), "a geodesic has at least one leg");
        Geodesic { length: legs.iter().map(|leg| leg.length).sum(), path: Path::Legs(legs) }
    }

    pub(super) fn smooth(points: Vec<Point>, lengths: Vec<f64>, surface: Arc<dyn SurfaceKind>) -> Self {
        assert!(points.len() >= 2 && points.len() == lengths.len(), "a geodesic has two ends");
        let length = lengths[lengths.len() - 1];
        Geodesic { length, path: Path::Smooth { points, lengths, surface } }
    }

    /// Length along the surface, in m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The point after a share `t` of the length, `t` in `[0, 1]`.
    pub fn at(&self, t: f64) -> SurfacePoint {
        let t = t.clamp(0.0, 1.0);
        match &self.path {
            Path::GreatCircle { radius, from, tangent, angle } => {
                let (sin, cos) = (t * angle).sin_cos();
                let normal = UnitVector::new_normalize(from * cos + tangent * sin);
                SurfacePoint::new(Point::from(normal.as_ref() * *radius), normal, 0)
            }
            Path::Legs(legs) => {
                let mut left = t * self.length;
                let last = legs.len() - 1;
                for leg in &legs[..last] {
                    if left <= leg.length && leg.length > 0.0 {
                        return leg.at(left / leg.length);
                    }
                    left -= leg.length;
                }
                let leg = &legs[last];
                leg.at(if leg.length > 0.0 { (left / leg.length).clamp(0.0, 1.0) } else { 1.0 })
            }
            Path::Smooth { points, lengths, surface } => {
                let along = t * self.length;
                let i = lengths.partition_point(|&length| length <= along).clamp(1, points.len() - 1) - 1;
                let piece = lengths[i + 1] - lengths[i];
                let share = if piece > 0.0 { ((along - lengths[i]) / piece).min(1.0) } else { 1.0 };
                surface.project(&(points[i] + (points[i + 1] - points[i]) * share))
            }
        }
    }

    /// Corners of the path: points where it changes face, with both ends; for smooth paths a fine polyline.
    pub fn corners(&self) -> Vec<Point> {
        match &self.path {
            Path::GreatCircle { .. } => (0..=32).map(|i| self.at(f64::from(i) / 32.0).point_in_object).collect(),
            Path::Legs(legs) => legs.iter().map(|leg| leg.start).chain(legs.last().map(|leg| leg.end)).collect(),
            Path::Smooth { points, .. } => points.clone(),
        }
    }
}
