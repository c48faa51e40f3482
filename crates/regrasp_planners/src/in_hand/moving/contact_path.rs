//! How a contact moves over the object on a path in GS_n.
//!
//! On an object that is star-shaped about its centre of mass the direction from there turns by a great circle (Saut 2011, sec.
//! 4.2.2: star-shaped objects); on others the contact follows a geodesic (Sahbani 2007, sec. IV-B). A central projection costs far
//! less than a geodesic of an ellipsoid or a mesh, which is iterated, and most paths fail.

use regrasp_geometry::surface::{Geodesic, SurfacePoint};
use regrasp_geometry::{Point, Surface, UnitVector, Vector};

/// Pieces of a projected great circle whose lengths are measured.
const PIECES: usize = 24;
/// A chord may be this much shorter than its halves, relatively.
const CUT: f64 = 1e-3;
/// How often a piece is halved, at most.
const HALVINGS: u32 = 5;
/// How far the ray through a contact may leave the object from it, in metres: elsewhere the object is not star-shaped.
const SAME_POINT: f64 = 1e-6;
/// Directions nearer to opposite than this, in radians, have no shortest way between them.
const OPPOSITE: f64 = 1e-6;

/// A path on the object's surface, at constant speed; of a projected great circle only from piece to piece.
#[derive(Debug, Clone)]
pub enum ContactPath {
    /// A great circle about a centre, projected.
    Central(Central),
    /// A geodesic.
    Geodesic(Geodesic),
}

/// A great circle of directions about a point that sees all of the path.
#[derive(Debug, Clone)]
pub struct Central {
    center: Point,
    from: Vector,
    across: Vector,
    angle: f64,
    /// Lengths of the projection up to the end of each piece, the first 0.
    lengths: Vec<f64>,
}

impl ContactPath {
    /// From `a` to `b`, about `center` if it sees both; None where there is no shortest way.
    pub fn between(surface: &Surface, center: &Point, a: &SurfacePoint, b: &SurfacePoint) -> Option<Self> {
        // On a plane face of a shape with a closed form the geodesic is a straight line, and costs as little.
        let is_plane = a.normal_in_object == b.normal_in_object && surface.same_face(a, b) && surface.mesh().is_none();
        if is_plane && surface.curvature(a) == [0.0; 2] {
            return surface.geodesic(a, b).map(ContactPath::Geodesic);
        }
        if let Some(central) = Central::between(surface, center, &a.point_in_object, &b.point_in_object) {
            return Some(ContactPath::Central(central));
        }
        surface.geodesic(a, b).map(ContactPath::Geodesic)
    }

    /// Length along the surface, in metres.
    pub fn length(&self) -> f64 {
        match self {
            ContactPath::Central(central) => central.lengths[PIECES],
            ContactPath::Geodesic(geodesic) => geodesic.length(),
        }
    }

    /// The point after a share `t` of the length; None where the surface has a gap.
    pub fn at(&self, surface: &Surface, t: f64) -> Option<SurfacePoint> {
        match self {
            ContactPath::Central(central) => central.at(surface, t),
            ContactPath::Geodesic(geodesic) => Some(geodesic.at(t)),
        }
    }
}

impl Central {
    fn between(surface: &Surface, center: &Point, a: &Point, b: &Point) -> Option<Self> {
        let (from, to) = ((a - center).try_normalize(1e-9)?, (b - center).try_normalize(1e-9)?);
        let angle = from.angle(&to);
        if angle > std::f64::consts::PI - OPPOSITE {
            return None;
        }
        let across = (to - from * from.dot(&to)).try_normalize(1e-12).unwrap_or_else(Vector::zeros);
        let mut central = Central { center: *center, from, across, angle, lengths: vec![0.0; PIECES + 1] };
        let mut before: Option<Point> = None;
        for piece in 0..=PIECES {
            let point = central.towards(surface, piece as f64 / PIECES as f64)?.point_in_object;
            if let Some(before) = before {
                let shares = [piece - 1, piece].map(|k| k as f64 / PIECES as f64);
                let length = central.length_of(surface, shares, [&before, &point], HALVINGS)?;
                central.lengths[piece] = central.lengths[piece - 1] + length;
            } else if (point - a).norm() > SAME_POINT {
                return None;
            }
            before = Some(point);
        }
        before.is_some_and(|last| (last - b).norm() <= SAME_POINT).then_some(central)
    }

    /// Length of the projection between two shares of the angle, where it is at `ends`. A chord cuts corners short: a piece is halved
    /// until its halves are no longer than the chord, or `halvings` times.
    fn length_of(&self, surface: &Surface, shares: [f64; 2], ends: [&Point; 2], halvings: u32) -> Option<f64> {
        let chord = (ends[1] - ends[0]).norm();
        let share = 0.5 * (shares[0] + shares[1]);
        let middle = self.towards(surface, share)?.point_in_object;
        let halves = (middle - ends[0]).norm() + (ends[1] - middle).norm();
        if halvings == 0 || halves <= chord * (1.0 + CUT) {
            return Some(halves);
        }
        let first = self.length_of(surface, [shares[0], share], [ends[0], &middle], halvings - 1)?;
        let second = self.length_of(surface, [share, shares[1]], [&middle, ends[1]], halvings - 1)?;
        Some(first + second)
    }

    /// The point seen after a share `share` of the angle.
    fn towards(&self, surface: &Surface, share: f64) -> Option<SurfacePoint> {
        let (sine, cosine) = (share * self.angle).sin_cos();
        surface.cast_ray(&self.center, &UnitVector::new_normalize(self.from * cosine + self.across * sine))
    }

    fn at(&self, surface: &Surface, t: f64) -> Option<SurfacePoint> {
        let wanted = t.clamp(0.0, 1.0) * self.lengths[PIECES];
        let piece = self.lengths[1..PIECES].partition_point(|&length| length < wanted);
        let (start, end) = (self.lengths[piece], self.lengths[piece + 1]);
        let within = if end > start { (wanted - start) / (end - start) } else { 0.0 };
        self.towards(surface, (piece as f64 + within) / PIECES as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;
    use regrasp_geometry::Shape;

    #[test]
    fn paths_go_from_end_to_end_on_the_surface() {
        let shapes = [
            Shape::Sphere { radius: 0.03 },
            Shape::Cuboid { half_extents: Vector::new(0.025, 0.02, 0.04) },
            Shape::Cylinder { half_length: 0.07, radius: 0.007 },
            Shape::Ellipsoid { radii: Vector::new(0.025, 0.02, 0.03) },
        ];
        let mut rng = Rng::keyed(5, "contact_path", 0);
        for shape in shapes {
            let surface = Surface::of(&shape).unwrap();
            for _ in 0..50 {
                let (a, b) = (surface.sample(&mut rng), surface.sample(&mut rng));
                let Some(path) = ContactPath::between(&surface, &Point::origin(), &a, &b) else { continue };
                let at = |t: f64| path.at(&surface, t).unwrap().point_in_object;
                assert!((at(0.0) - a.point_in_object).norm() < 1e-6 && (at(1.0) - b.point_in_object).norm() < 1e-6);
                let shortest = surface.geodesic(&a, &b).map_or(0.0, |geodesic| geodesic.length());
                assert!(path.length() >= 0.98 * shortest, "{shape:?}");
                for k in 0..100 {
                    assert!(surface.signed_distance(&at(f64::from(k) / 100.0)).abs() < 1e-9);
                }
            }
        }
    }
}
