//! The surface of a cylinder about z. Faces: 0 side, 1 top, 2 bottom.

use super::geodesic::{Bend, Geodesic, Leg};
use super::{Facing, SurfaceKind, SurfacePoint, bar_operator, quadratic_roots};
use crate::frame::{Point, UnitVector, Vector};
use nalgebra::Matrix3;
use regrasp_base::Rng;
use std::f64::consts::{PI, TAU};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CylinderSurface {
    pub half_length: f64,
    pub radius: f64,
}

fn cap_normal(face: u32) -> UnitVector {
    if face == 1 { Vector::z_axis() } else { -Vector::z_axis() }
}

/// `angle` brought into `[-pi, pi]`.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

impl CylinderSurface {
    fn cap_z(&self, face: u32) -> f64 {
        if face == 1 { self.half_length } else { -self.half_length }
    }

    fn on_side(&self, angle: f64, z: f64) -> SurfacePoint {
        let (sin, cos) = angle.sin_cos();
        let point = Point::new(self.radius * cos, self.radius * sin, z);
        SurfacePoint::new(point, UnitVector::new_unchecked(Vector::new(cos, sin, 0.0)), 0)
    }

    fn rim(&self, angle: f64, face: u32) -> Point {
        self.on_side(angle, self.cap_z(face)).point_in_object
    }

    /// Length on the unrolled side between two points of the side or its rims.
    fn side_length(&self, a: &Point, b: &Point) -> f64 {
        (self.radius * wrapped(b.y.atan2(b.x) - a.y.atan2(a.x))).hypot(b.z - a.z)
    }

    fn side_leg(&self, start: Point, end: Point) -> Leg {
        let angle = wrapped(end.y.atan2(end.x) - start.y.atan2(start.x));
        let bend = Bend::Helix { radius: self.radius, angle };
        let length = (self.radius * angle).hypot(end.z - start.z);
        Leg { start, end, start_normal: Vector::x(), end_normal: Vector::x(), facet: 0, bend, length }
    }

    fn cap_leg(&self, start: Point, end: Point, face: u32) -> Leg {
        Leg::straight(start, end, cap_normal(face), face)
    }
}

impl SurfaceKind for CylinderSurface {
    fn area(&self) -> f64 {
        TAU * self.radius * (2.0 * self.half_length + self.radius)
    }

    fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        let side_share = 2.0 * self.half_length / (2.0 * self.half_length + self.radius);
        if rng.chance(side_share) {
            return self.on_side(rng.uniform(-PI, PI), rng.uniform(-self.half_length, self.half_length));
        }
        let face = if rng.chance(0.5) { 1 } else { 2 };
        let r = self.radius * rng.unit().sqrt();
        let (sin, cos) = rng.uniform(-PI, PI).sin_cos();
        SurfacePoint::new(Point::new(r * cos, r * sin, self.cap_z(face)), cap_normal(face), face)
    }

    fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint> {
        let (o, d) = (origin.coords, direction.as_ref());
        // The ray is inside both the slab and the infinite cylinder between `enter` and `leave`.
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        let (mut enter_face, mut leave_face) = (0, 0);
        let outside_side = o.xy().norm_squared() - self.radius * self.radius;
        match quadratic_roots(d.xy().norm_squared(), o.xy().dot(&d.xy()), outside_side) {
            Some(roots) => [enter, leave] = roots,
            None if outside_side > 0.0 => return None,
            None => {}
        }
        if d.z == 0.0 {
            if o.z.abs() > self.half_length {
                return None;
            }
        } else {
            let (near, far) =
                ((-self.half_length.copysign(d.z) - o.z) / d.z, (self.half_length.copysign(d.z) - o.z) / d.z);
            let (near_face, far_face) = if d.z > 0.0 { (2, 1) } else { (1, 2) };
            if near > enter {
                (enter, enter_face) = (near, near_face);
            }
            if far < leave {
                (leave, leave_face) = (far, far_face);
            }
        }
        if enter > leave || leave <= 0.0 {
            return None;
        }
        let (t, face) = if enter > 0.0 { (enter, enter_face) } else { (leave, leave_face) };
        let mut point = origin + d * t;
        if face == 0 {
            return Some(self.on_side(point.y.atan2(point.x), point.z));
        }
        point.z = self.cap_z(face);
        Some(SurfacePoint::new(point, cap_normal(face), face))
    }

    fn project(&self, point: &Point) -> SurfacePoint {
        let from_axis = point.x.hypot(point.y);
        let cap = if point.z.is_sign_negative() { 2 } else { 1 };
        if from_axis - self.radius > point.z.abs() - self.half_length {
            return self.on_side(point.y.atan2(point.x), point.z.clamp(-self.half_length, self.half_length));
        }
        let shrink = if from_axis > self.radius { self.radius / from_axis } else { 1.0 };
        let on_cap = Point::new(point.x * shrink, point.y * shrink, self.cap_z(cap));
        SurfacePoint::new(on_cap, cap_normal(cap), cap)
    }

    fn signed_distance(&self, point: &Point) -> f64 {
        let (side, cap) = (point.x.hypot(point.y) - self.radius, point.z.abs() - self.half_length);
        side.max(0.0).hypot(cap.max(0.0)) + side.max(cap).min(0.0)
    }

    fn facing(&self, at: &SurfacePoint, from: &Point) -> Option<(Facing, Point)> {
        let is_beside = from.z.abs() < self.half_length;
        let is_over = from.x.hypot(from.y) < self.radius;
        match at.facet {
            0 if is_beside => Some((Facing::Edge(Vector::z_axis()), Point::origin())),
            1 | 2 if is_over => Some((Facing::Face(cap_normal(at.facet)), at.point_in_object)),
            _ => None,
        }
    }

    fn crease_distance(&self, at: &SurfacePoint) -> f64 {
        let point = at.point_in_object;
        (point.x.hypot(point.y) - self.radius).hypot(point.z.abs() - self.half_length)
    }

    fn same_face(&self, a: &SurfacePoint, b: &SurfacePoint) -> bool {
        a.facet == b.facet
    }

    fn curvature(&self, at: &SurfacePoint) -> [f64; 2] {
        if at.facet == 0 { [1.0 / self.radius, 0.0] } else { [0.0; 2] }
    }

    fn shape_operator(&self, at: &SurfacePoint) -> Matrix3<f64> {
        if at.facet == 0 { bar_operator(&at.normal_in_object, self.radius) } else { Matrix3::zeros() }
    }

    /// The shortest of the ways over side and caps, each a straight line when unrolled; where rims are crossed is found
    /// by minimising the length over the angle of each crossing.
    fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
        let (start, end) = (a.point_in_object, b.point_in_object);
        let mut ways: Vec<Vec<Leg>> = Vec::new();
        match (a.facet, b.facet) {
            (0, 0) => {
                ways.push(vec![self.side_leg(start, end)]);
                for cap in [1, 2] {
                    let length = |angles: &[f64; 2]| {
                        let (p, q) = (self.rim(angles[0], cap), self.rim(angles[1], cap));
                        self.side_length(&start, &p) + (q - p).norm() + self.side_length(&q, &end)
                    };
                    let [p, q] = minimise(length).map(|angle| self.rim(angle, cap));
                    ways.push(vec![self.side_leg(start, p), self.cap_leg(p, q, cap), self.side_leg(q, end)]);
                }
            }
            (0, cap) => {
                let length = |angles: &[f64; 1]| {
                    let p = self.rim(angles[0], cap);
                    self.side_length(&start, &p) + (end - p).norm()
                };
                let p = self.rim(minimise(length)[0], cap);
                ways.push(vec![self.side_leg(start, p), self.cap_leg(p, end, cap)]);
            }
            (cap, 0) => {
                let length = |angles: &[f64; 1]| {
                    let p = self.rim(angles[0], cap);
                    (p - start).norm() + self.side_length(&p, &end)
                };
                let p = self.rim(minimise(length)[0], cap);
                ways.push(vec![self.cap_leg(start, p, cap), self.side_leg(p, end)]);
            }
            (cap, other) if cap == other => ways.push(vec![self.cap_leg(start, end, cap)]),
            (cap, other) => {
                let length = |angles: &[f64; 2]| {
                    let (p, q) = (self.rim(angles[0], cap), self.rim(angles[1], other));
                    (p - start).norm() + self.side_length(&p, &q) + (end - q).norm()
                };
                let angles = minimise(length);
                let (p, q) = (self.rim(angles[0], cap), self.rim(angles[1], other));
                ways.push(vec![self.cap_leg(start, p, cap), self.side_leg(p, q), self.cap_leg(q, end, other)]);
            }
        }
        let ways = ways.into_iter().map(Geodesic::of_legs);
        ways.reduce(|best, way| if way.length() < best.length() { way } else { best })
    }
}

/// Angles at which `length` is least: the best of a grid, refined by a shrinking pattern search (Hooke, Jeeves 1961).
fn minimise<const N: usize>(length: impl Fn(&[f64; N]) -> f64) -> [f64; N] {
    const GRID: usize = 24;
    let mut step = TAU / GRID as f64;
    let mut best = ([0.0; N], f64::INFINITY);
    for index in 0..GRID.pow(N as u32) {
        let mut digits = index;
        let angles = std::array::from_fn(|_| {
            let angle = (digits % GRID) as f64 * step;
            digits /= GRID;
            angle
        });
        let value = length(&angles);
        if value < best.1 {
            best = (angles, value);
        }
    }
    while step > 1e-8 {
        let center = best;
        for index in 0..3usize.pow(N as u32) {
            let mut digits = index;
            let mut angles = center.0;
            for angle in &mut angles {
                *angle += step * ((digits % 3) as f64 - 1.0);
                digits /= 3;
            }
            let value = length(&angles);
            if value < best.1 {
                best = (angles, value);
            }
        }
        if best.1 == center.1 {
            step *= 0.5;
        }
    }
    best.0
}
