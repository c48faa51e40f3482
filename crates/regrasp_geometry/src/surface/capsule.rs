//! The surface of a capsule about z. Faces: 0 side, 1 top cap, 2 bottom cap; they join without a crease.

use super::geodesic::Geodesic;
use super::smooth_geodesic::straightened;
use super::{Facing, SurfaceKind, SurfacePoint, across, bar_operator, quadratic_roots, unit_or};
use crate::frame::{Point, UnitVector, Vector};
use nalgebra::Matrix3;
use regrasp_base::Rng;
use std::f64::consts::{PI, TAU};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CapsuleSurface {
    pub half_length: f64,
    pub radius: f64,
}

impl CapsuleSurface {
    /// Nearest point of the axis' segment.
    fn core(&self, point: &Point) -> Point {
        Point::new(0.0, 0.0, point.z.clamp(-self.half_length, self.half_length))
    }

    fn facet(&self, point: &Point) -> u32 {
        if point.z > self.half_length {
            1
        } else if point.z < -self.half_length {
            2
        } else {
            0
        }
    }
}

impl SurfaceKind for CapsuleSurface {
    fn area(&self) -> f64 {
        4.0 * PI * self.radius * (self.half_length + self.radius)
    }

    fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        if rng.unit() * (self.half_length + self.radius) < self.half_length {
            let (sin, cos) = rng.uniform(0.0, TAU).sin_cos();
            let z = rng.uniform(-self.half_length, self.half_length);
            let point = Point::new(self.radius * cos, self.radius * sin, z);
            return SurfacePoint::new(point, UnitVector::new_normalize(Vector::new(cos, sin, 0.0)), 0);
        }
        let normal = UnitVector::new_normalize(Vector::from(rng.direction()));
        let center = Point::new(0.0, 0.0, self.half_length.copysign(normal.z));
        SurfacePoint::new(center + normal.as_ref() * self.radius, normal, if normal.z > 0.0 { 1 } else { 2 })
    }

    fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint> {
        let (o, d) = (origin.coords, direction.as_ref());
        let mut first = f64::INFINITY;
        let mut take = |roots: Option<[f64; 2]>, low: f64, high: f64| {
            for t in roots.into_iter().flatten() {
                let z = o.z + t * d.z;
                if t > 0.0 && t < first && low <= z && z <= high {
                    first = t;
                }
            }
        };
        let r2 = self.radius * self.radius;
        let side = quadratic_roots(d.xy().norm_squared(), o.xy().dot(&d.xy()), o.xy().norm_squared() - r2);
        take(side, -self.half_length, self.half_length);
        for (sign, low, high) in [(1.0, self.half_length, f64::INFINITY), (-1.0, f64::NEG_INFINITY, -self.half_length)]
        {
            let from_center = o - Vector::new(0.0, 0.0, sign * self.half_length);
            take(quadratic_roots(1.0, from_center.dot(d), from_center.norm_squared() - r2), low, high);
        }
        first.is_finite().then(|| self.project(&(origin + d * first)))
    }

    fn project(&self, point: &Point) -> SurfacePoint {
        let core = self.core(point);
        let normal = unit_or(point - core, Vector::x_axis());
        let on_surface = core + normal.as_ref() * self.radius;
        SurfacePoint::new(on_surface, normal, self.facet(&on_surface))
    }

    fn signed_distance(&self, point: &Point) -> f64 {
        (point - self.core(point)).norm() - self.radius
    }

    fn facing(&self, at: &SurfacePoint, from: &Point) -> Option<(Facing, Point)> {
        Some(match from.z.abs() < self.half_length {
            true => (Facing::Edge(Vector::z_axis()), Point::origin()),
            false => (Facing::Corner, self.core(&at.point_in_object)),
        })
    }

    fn crease_distance(&self, _at: &SurfacePoint) -> f64 {
        f64::INFINITY
    }

    fn same_face(&self, _a: &SurfacePoint, _b: &SurfacePoint) -> bool {
        true
    }

    fn curvature(&self, at: &SurfacePoint) -> [f64; 2] {
        let k = 1.0 / self.radius;
        if at.point_in_object.z.abs() > self.half_length { [k, k] } else { [k, 0.0] }
    }

    fn shape_operator(&self, at: &SurfacePoint) -> Matrix3<f64> {
        if at.point_in_object.z.abs() > self.half_length {
            across(&at.normal_in_object) / self.radius
        } else {
            bar_operator(&at.normal_in_object, self.radius)
        }
    }

    fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
        straightened(a, b, *self)
    }
}
