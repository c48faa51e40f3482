//! The surface of a box about the origin. Face `2 k` is at `+half_extents[k]`, face `2 k + 1` at `-half_extents[k]`.

use super::geodesic::{Geodesic, Leg};
use super::{Facing, SurfaceKind, SurfacePoint};
use crate::frame::{Point, UnitVector, Vector};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion};
use regrasp_base::Rng;
use std::f64::consts::FRAC_PI_2;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CuboidSurface {
    pub half_extents: Vector,
}

/// Longest sequence of faces a shortest path is sought over. Six faces are all there are, and no shortest path
/// leaves a face and comes back to it.
const MAX_FACES: usize = 6;

/// Outward normal of `face`.
fn face_normal(face: u32) -> UnitVector {
    let mut normal = Vector::zeros();
    normal[face as usize / 2] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    UnitVector::new_unchecked(normal)
}

impl CuboidSurface {
    /// Area of the pair of faces across axis `k`.
    fn pair_area(&self, k: usize) -> f64 {
        8.0 * self.half_extents[(k + 1) % 3] * self.half_extents[(k + 2) % 3]
    }

    /// Signed coordinate of the plane of `face` along its axis.
    fn offset(&self, face: u32) -> f64 {
        let h = self.half_extents[face as usize / 2];
        if face.is_multiple_of(2) { h } else { -h }
    }

    /// `face_from_next`: turns the neighbour `next` about the common edge into the plane of `face`.
    fn rolled(&self, face: u32, next: u32) -> Isometry3<f64> {
        let (n, m) = (face_normal(face), face_normal(next));
        let mut hinge = Point::origin();
        hinge[face as usize / 2] = self.offset(face);
        hinge[next as usize / 2] = self.offset(next);
        let axis = UnitVector::new_normalize(m.cross(&n));
        let rotation = UnitQuaternion::from_axis_angle(&axis, FRAC_PI_2);
        Isometry3::from_parts(Translation3::from(hinge.coords - rotation * hinge.coords), rotation)
    }

    /// Tries every way of unrolling that starts with `faces`, whose last one is turned by `start_from_last` into the
    /// plane of the first.
    fn unroll(
        &self,
        a: &Point,
        b: &SurfacePoint,
        faces: &mut Vec<(u32, Isometry3<f64>)>,
        shortest: &mut f64,
        best: &mut Vec<(Point, u32)>,
    ) {
        let Some(&(last, start_from_last)) = faces.last() else { return };
        if last == b.facet {
            let target = start_from_last * b.point_in_object;
            let length = (target - a).norm();
            if length < *shortest
                && let Some(path) = self.straight_path(a, &target, faces)
            {
                *shortest = length;
                *best = path;
            }
            return;
        }
        if faces.len() == MAX_FACES {
            return;
        }
        for next in 0..6 {
            if next / 2 == last / 2 || faces.iter().any(|(face, _)| *face == next) {
                continue;
            }
            faces.push((next, start_from_last * self.rolled(last, next)));
            self.unroll(a, b, faces, shortest, best);
            faces.pop();
        }
    }

    /// Where the straight line to `target` crosses the edges between `faces`, with the face entered there; None when it
    /// misses one.
    fn straight_path(&self, a: &Point, target: &Point, faces: &[(u32, Isometry3<f64>)]) -> Option<Vec<(Point, u32)>> {
        let mut path = Vec::with_capacity(faces.len());
        let mut passed = 0.0;
        for pair in faces.windows(2) {
            let ((face, start_from_face), (next, _)) = (pair[0], pair[1]);
            let (from, to) =
                (start_from_face.inverse_transform_point(a), start_from_face.inverse_transform_point(target));
            let k = next as usize / 2;
            let t = (self.offset(next) - from[k]) / (to[k] - from[k]);
            if !(t >= passed - 1e-12 && t <= 1.0 + 1e-12) {
                return None;
            }
            let crossing = from + (to - from) * t;
            let along = 3 - k - face as usize / 2;
            if crossing[along].abs() > self.half_extents[along] * (1.0 + 1e-12) {
                return None;
            }
            path.push((crossing, next));
            passed = t;
        }
        Some(path)
    }
}

impl SurfaceKind for CuboidSurface {
    fn area(&self) -> f64 {
        (0..3).map(|k| self.pair_area(k)).sum()
    }

    fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        let mut at = rng.unit() * self.area();
        let mut k = 0;
        while k < 2 && at >= self.pair_area(k) {
            at -= self.pair_area(k);
            k += 1;
        }
        let face = 2 * k as u32 + u32::from(rng.chance(0.5));
        let h = self.half_extents;
        let mut point = Point::origin();
        for axis in 0..3 {
            point[axis] = if axis == k { self.offset(face) } else { rng.uniform(-h[axis], h[axis]) };
        }
        SurfacePoint::new(point, face_normal(face), face)
    }

    fn cast_ray(&self, origin: &Point, direction: &UnitVector) -> Option<SurfacePoint> {
        // Slabs: the ray is inside all three between `enter` and `leave`.
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        let (mut enter_face, mut leave_face) = (0, 0);
        for k in 0..3 {
            let (o, d, h) = (origin[k], direction[k], self.half_extents[k]);
            if d == 0.0 {
                if o.abs() > h {
                    return None;
                }
                continue;
            }
            let (near, far) = ((-h.copysign(d) - o) / d, (h.copysign(d) - o) / d);
            let far_face = 2 * k as u32 + u32::from(d < 0.0);
            if near > enter {
                (enter, enter_face) = (near, far_face ^ 1);
            }
            if far < leave {
                (leave, leave_face) = (far, far_face);
            }
        }
        if enter > leave || leave <= 0.0 {
            return None;
        }
        let (t, face) = if enter > 0.0 { (enter, enter_face) } else { (leave, leave_face) };
        let mut point = origin + direction.as_ref() * t;
        point[face as usize / 2] = self.offset(face);
        Some(SurfacePoint::new(point, face_normal(face), face))
    }

    fn project(&self, point: &Point) -> SurfacePoint {
        let h = self.half_extents;
        let excess = |k: usize| point[k].abs() - h[k];
        let k = (1..3).fold(0, |best, k| if excess(k) > excess(best) { k } else { best });
        let face = 2 * k as u32 + u32::from(point[k].is_sign_negative());
        let mut on_surface = Point::from(point.coords.sup(&-h).inf(&h));
        on_surface[k] = self.offset(face);
        SurfacePoint::new(on_surface, face_normal(face), face)
    }

    fn signed_distance(&self, point: &Point) -> f64 {
        let excess = point.coords.abs() - self.half_extents;
        excess.sup(&Vector::zeros()).norm() + excess.max().min(0.0)
    }

    fn facing(&self, at: &SurfacePoint, from: &Point) -> Option<(Facing, Point)> {
        let is_beyond = |k: &usize| from[*k].abs() > self.half_extents[*k];
        let facing = match (0..3).filter(is_beyond).count() {
            1 => Some(Facing::Face(face_normal(at.facet))),
            2 => (0..3).find(|k| !is_beyond(k)).map(|along| Facing::Edge(Vector::ith_axis(along))),
            3 => Some(Facing::Corner),
            _ => None,
        };
        facing.map(|facing| (facing, at.point_in_object))
    }

    fn crease_distance(&self, at: &SurfacePoint) -> f64 {
        let k = at.facet as usize / 2;
        let room = |axis: usize| (self.half_extents[axis] - at.point_in_object[axis].abs()).max(0.0);
        room((k + 1) % 3).min(room((k + 2) % 3))
    }

    fn same_face(&self, a: &SurfacePoint, b: &SurfacePoint) -> bool {
        a.facet == b.facet
    }

    fn curvature(&self, _at: &SurfacePoint) -> [f64; 2] {
        [0.0; 2]
    }

    fn shape_operator(&self, _at: &SurfacePoint) -> Matrix3<f64> {
        Matrix3::zeros()
    }

    /// The shortest straight line over all ways of unrolling the box.
    fn geodesic(&self, a: &SurfacePoint, b: &SurfacePoint) -> Option<Geodesic> {
        let mut shortest = f64::INFINITY;
        let mut crossings = Vec::new();
        let mut faces = vec![(a.facet, Isometry3::identity())];
        self.unroll(&a.point_in_object, b, &mut faces, &mut shortest, &mut crossings);
        if !shortest.is_finite() {
            return None;
        }
        let mut legs = Vec::with_capacity(crossings.len() + 1);
        let (mut start, mut face) = (a.point_in_object, a.facet);
        for (crossing, next) in crossings {
            legs.push(Leg::straight(start, crossing, face_normal(face), face));
            (start, face) = (crossing, next);
        }
        legs.push(Leg::straight(start, b.point_in_object, face_normal(face), face));
        Some(Geodesic::of_legs(legs))
    }
}
