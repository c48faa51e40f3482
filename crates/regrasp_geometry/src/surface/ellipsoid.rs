//! The surface of an ellipsoid about the origin with half axes along x, y, z. One face, number 0.
//!
//! Nearest point: Eberly 2013, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid", with the root
//! variable measured from its pole so that points near the mid-plane lose no digits. Area: Carlson 1995,
//! "Numerical computation of real or complex elliptic integrals".

use super::geodesic::Geodesic;
use super::smooth_geodesic::straightened;
use super::{SurfaceKind, SurfacePoint, across, quadratic_roots};
use crate::frame::{Point, UnitVector, Vector};
use nalgebra::Matrix3;
use regrasp_base::Rng;
use std::f64::consts::PI;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EllipsoidSurface {
    pub radii: Vector,
}

impl EllipsoidSurface {
    /// The surface point in direction of `point`, which must not be the origin.
    fn radially(&self, point: &Vector) -> SurfacePoint {
        let on_surface = point / point.component_div(&self.radii).norm();
        let gradient = on_surface.component_div(&self.radii.component_mul(&self.radii));
        SurfacePoint::new(Point::from(on_surface), UnitVector::new_normalize(gradient), 0)
    }

    /// Nearest surface point, for a point with no negative coordinate.
    fn nearest_in_octant(&self, point: &Vector) -> Vector {
        let shortest = self.radii.imin();
        let e = self.radii[shortest];
        let z = point.component_div(&self.radii);
        let r = self.radii.map(|radius| (radius / e).powi(2));
        // The nearest point is r_i y_i / (u + r_i - 1), where u solves g(u) = sum (r_i z_i / (u + r_i - 1))^2 - 1 = 0.
        let gap = r.map(|ratio| (ratio - 1.0).max(0.0));
        let term = |i: usize, u: f64| if z[i] == 0.0 { 0.0 } else { r[i] * z[i] / (u + gap[i]) };
        let g = |u: f64| (0..3).map(|i| term(i, u).powi(2)).sum::<f64>() - 1.0;
        if z[shortest] == 0.0 && g(0.0) < 0.0 {
            let mut nearest = Vector::from_fn(|i, _| if z[i] == 0.0 { 0.0 } else { r[i] * point[i] / gap[i] });
            nearest[shortest] = 0.0;
            nearest[shortest] = e * (1.0 - nearest.component_div(&self.radii).norm_squared()).max(0.0).sqrt();
            return nearest;
        }
        // g falls and is convex, and every term alone makes it positive here: Newton climbs to the root from below.
        let mut u = (0..3).map(|i| r[i] * z[i] - gap[i]).fold(0.0, f64::max);
        if u == 0.0 {
            u = f64::MIN_POSITIVE;
        }
        for _ in 0..200 {
            let slope: f64 = (0..3).map(|i| if z[i] == 0.0 { 0.0 } else { term(i, u).powi(2) / (u + gap[i]) }).sum();
            let next = u + g(u) / (2.0 * slope);
            // No longer rising: converged to rounding.
            if next <= u || next.is_nan() {
                break;
            }
            u = next;
        }
        Vector::from_fn(|i, _| if z[i] == 0.0 { 0.0 } else { r[i] * point[i] / (u + gap[i]) })
    }
}

impl SurfaceKind for EllipsoidSurface {
    fn area(&self) -> f64 {
        // 4 pi R_G(a^2 b^2, a^2 c^2, b^2 c^2), with the arguments in falling order and scaled by the largest.
        let [a, b, c] = self.radii.into();
        let mut q = [a * a * b * b, a * a * c * c, b * b * c * c];
        q.sort_unstable_by(|x, y| y.total_cmp(x));
        let scale = q[0];
        let [x, z, y] = q.map(|value| value / scale);
        // R_G with z the middle one, so that no term is negative.
        let rg = 0.5 * (z * carlson_rf(x, y, z) - (x - z) * (y - z) * carlson_rd(x, y, z) / 3.0 + (x * y / z).sqrt());
        4.0 * PI * rg * scale.sqrt()
    }

    fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        // Area per solid angle of the unit ball is proportional to |R^-1 u|.
        let highest = 1.0 / self.radii.min();
        loop {
            let u = Vector::from(rng.direction());
            if rng.unit() * highest < u.component_div(&self.radii).norm() {
                return self.radially(&u.component_mul(&self.radii));
            }
        }
    }

    fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint> {
        let (o, d) = (origin.coords.component_div(&self.radii), direction.component_div(&self.radii));
        let roots = quadratic_roots(d.norm_squared(), o.dot(&d), o.norm_squared() - 1.0)?;
        let t = *roots.iter().find(|&&t| t > 0.0)?;
        Some(self.radially(&(origin.coords + direction.as_ref() * t)))
    }

    fn project(&self, point: &Point) -> SurfacePoint {
        let nearest = self.nearest_in_octant(&point.coords.abs());
        self.radially(&nearest.zip_map(&point.coords, f64::copysign))
    }

    fn signed_distance(&self, point: &Point) -> f64 {
        let distance = (point - self.project(point).point_in_object).norm();
        distance.copysign(point.coords.component_div(&self.radii).norm_squared() - 1.0)
    }

    fn crease_distance(&self, _at: &SurfacePoint) -> f64 {
        f64::INFINITY
    }

    fn same_face(&self, _a: &SurfacePoint, _b: &SurfacePoint) -> bool {
        true
    }

    /// Do Carmo 1976, section 3-3: Gauss and mean curvature of a quadric.
    fn curvature(&self, at: &SurfacePoint) -> [f64; 2] {
        let squares = self.radii.component_mul(&self.radii);
        let point = at.point_in_object.coords;
        let h = point.component_div(&squares).norm();
        let product = squares.x * squares.y * squares.z;
        let gauss = 1.0 / (product * h.powi(4));
        let mean = (squares.sum() - point.norm_squared()) / (2.0 * product * h.powi(3));
        let spread = (mean * mean - gauss).max(0.0).sqrt();
        [mean + spread, gauss / (mean + spread)]
    }

    fn shape_operator(&self, at: &SurfacePoint) -> Matrix3<f64> {
        let inverse_squares = self.radii.map(|radius| 1.0 / (radius * radius));
        let steepness = at.point_in_object.coords.component_mul(&inverse_squares).norm();
        let across = across(&at.normal_in_object);
        across * Matrix3::from_diagonal(&inverse_squares) * across / steepness
    }

    fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
        straightened(a, b, *self)
    }
}

/// Carlson's symmetric integral of the first kind, by duplication.
fn carlson_rf(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    loop {
        let mean = (x + y + z) / 3.0;
        let [dx, dy, dz] = [x, y, z].map(|v| 1.0 - v / mean);
        if dx.abs().max(dy.abs()).max(dz.abs()) < 2e-3 {
            let (e2, e3) = (dx * dy - dz * dz, dx * dy * dz);
            return (1.0 + (e2 / 24.0 - 0.1 - 3.0 * e3 / 44.0) * e2 + e3 / 14.0) / mean.sqrt();
        }
        let lambda = (x * y).sqrt() + (x * z).sqrt() + (y * z).sqrt();
        (x, y, z) = ((x + lambda) / 4.0, (y + lambda) / 4.0, (z + lambda) / 4.0);
    }
}

/// Carlson's symmetric integral of the second kind, by duplication.
fn carlson_rd(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    let (mut sum, mut factor) = (0.0, 1.0);
    loop {
        let mean = (x + y + 3.0 * z) / 5.0;
        let [dx, dy, dz] = [x, y, z].map(|v| 1.0 - v / mean);
        if dx.abs().max(dy.abs()).max(dz.abs()) < 1e-3 {
            let (ea, eb) = (dx * dy, dz * dz);
            let (ec, ed, ee) = (ea - eb, ea - 6.0 * eb, ea - 6.0 * eb + 2.0 * (ea - eb));
            let series = 1.0
                + ed * (-3.0 / 14.0 + 9.0 / 88.0 * ed - 4.5 / 26.0 * dz * ee)
                + dz * (ee / 6.0 + dz * (-9.0 / 22.0 * ec + 3.0 / 26.0 * dz * ea));
            return 3.0 * sum + factor * series / (mean * mean.sqrt());
        }
        let lambda = (x * y).sqrt() + (x * z).sqrt() + (y * z).sqrt();
        sum += factor / (z.sqrt() * (z + lambda));
        factor /= 4.0;
        (x, y, z) = ((x + lambda) / 4.0, (y + lambda) / 4.0, (z + lambda) / 4.0);
    }
}
