//! The surface of a ball about the origin. One face, number 0.

use super::geodesic::Geodesic;
use super::{Facing, SurfaceKind, SurfacePoint, across, quadratic_roots, unit_or};
use crate::frame::{Point, UnitVector, Vector};
use nalgebra::Matrix3;
use regrasp_base::Rng;
use std::f64::consts::PI;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SphereSurface {
    pub radius: f64,
}

impl SphereSurface {
    fn along(&self, direction: UnitVector) -> SurfacePoint {
        SurfacePoint::new(Point::from(direction.as_ref() * self.radius), direction, 0)
    }
}

impl SurfaceKind for SphereSurface {
    fn area(&self) -> f64 {
        4.0 * PI * self.radius * self.radius
    }

    fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        self.along(UnitVector::new_normalize(Vector::from(rng.direction())))
    }

    fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint> {
        let o = origin.coords;
        let roots = quadratic_roots(1.0, o.dot(direction), o.norm_squared() - self.radius * self.radius)?;
        let t = *roots.iter().find(|&&t| t > 0.0)?;
        Some(self.along(unit_or(o + direction.as_ref() * t, Vector::x_axis())))
    }

    fn project(&self, point: &Point) -> SurfacePoint {
        self.along(unit_or(point.coords, Vector::x_axis()))
    }

    fn signed_distance(&self, point: &Point) -> f64 {
        point.coords.norm() - self.radius
    }

    fn facing(&self, _at: &SurfacePoint, _from: &Point) -> Option<(Facing, Point)> {
        Some((Facing::Corner, Point::origin()))
    }

    fn crease_distance(&self, _at: &SurfacePoint) -> f64 {
        f64::INFINITY
    }

    fn same_face(&self, _a: &SurfacePoint, _b: &SurfacePoint) -> bool {
        true
    }

    fn curvature(&self, _at: &SurfacePoint) -> [f64; 2] {
        [1.0 / self.radius; 2]
    }

    fn shape_operator(&self, at: &SurfacePoint) -> Matrix3<f64> {
        across(&at.normal_in_object) / self.radius
    }

    fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
        Geodesic::great_circle(self.radius, &a.point_in_object.coords, &b.point_in_object.coords)
    }
}
