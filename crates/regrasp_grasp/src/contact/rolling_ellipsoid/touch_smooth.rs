//! Where a smooth convex tip touches, when its curvature changes from that of a rim to that of a flat face within degrees.
//!
//! A guess of the normal `n` says which point of the tip faces the object. From a little inside the tip, behind that point, the
//! nearest point of the object gives another normal. Where both agree the tip touches.
//!
//! Where the object is made of flat faces, the normal is sought with which the tip would touch the face, edge or corner that is
//! nearest now, as if there were no other. Mostly that is where it touches; else what is nearest then is the next guess. A ball is touched
//! with the normal with which its centre would be, the side of a cylinder with that of its axis. Where
//! that does not bring the normals nearer to each other, and on other curved objects, Newton's method finds the touch: the tip's radii
//! of curvature say how the point moves over the tip when the normal turns, and two nudges how the nearest point of the object
//! moves, on faces, edges and corners alike.

/// The touch of a face, edge or corner alone.
mod alone;

use super::{Stance, Touch};
use nalgebra::{Matrix2, Vector2};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::surface::{Surface, SurfacePoint};
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_robot::tip::smooth_hull::SmoothHull;

/// How far inside the tip the object is seen from, in metres: deeper than a tip presses in.
const INNER: f64 = 1e-3;
/// Steps of Newton's method, and how often a step is halved.
const MOST_STEPS: usize = 40;
const MOST_HALVINGS: usize = 10;
/// How often a step towards the touch of what is nearest alone is halved.
const HALVINGS_ALONE: usize = 3;
/// Longest step, in radians.
const LONGEST_STEP: f64 = 0.4;
/// Nudges of the point that the object is seen from, in metres.
const NUDGE: f64 = 1e-7;
/// Difference of the normals at which they agree; where rounding stops it sooner, a hundred times as much.
const AGREED: f64 = 1e-12;
/// A step that leaves less than this share of the difference needs no new slopes after it.
const ENOUGH_GAINED: f64 = 0.3;

/// The object as it is seen from a tip whose touching point has a normal.
struct Seen {
    normal: Vector,
    /// From where it is seen.
    from: Point,
    foot: SurfacePoint,
    /// Normal of the object that is seen, less that of the tip.
    off: Vector,
}

/// The touch of `tip` at `stance`, whose normal is the first guess; None inside the object, and where guesses do not settle.
/// `near` is a point of the surface near by, where one is known.
pub(super) fn touch(surface: &Surface, tip: &SmoothHull, stance: &Stance, near: Option<&Point>) -> Option<Touch> {
    let turn = stance.object_from_link;
    let see = |normal: Vector, known: Option<&Point>| -> Option<Seen> {
        let from = stance.center + turn * tip.point(&-turn.tr_mul(&normal)) + normal * INNER;
        let (foot, distance) = match known {
            Some(known) => surface.project_signed_from(&from, known),
            None => surface.project_signed(&from),
        };
        let off = (distance > 1e-9).then(|| (from - foot.point_in_object) / distance - normal)?;
        Some(Seen { normal, from, foot, off })
    };
    let mut now = see(stance.normal, near)?;
    let mut slope: Option<Slope> = None;
    for _ in 0..MOST_STEPS {
        let left = now.off.norm();
        if left < AGREED {
            return Some(touch_of(stance, &now));
        }
        if slope.is_none()
            && let Some(next) = nearer_alone(surface, tip, stance, &now, &see)
        {
            now = next;
            continue;
        }
        let known = slope.take();
        let is_known = known.is_some();
        let mut from = match known {
            Some(known) => known,
            None => Slope::at(surface, tip, stance, &now)?,
        };
        let step = from.step(&now.off)?;
        let mut share = (LONGEST_STEP / step.norm()).min(1.0);
        let halvings = if is_known { 1 } else { MOST_HALVINGS };
        let better = (0..halvings).find_map(|_| {
            let next = see((now.normal + step * share).normalize(), Some(&now.foot.point_in_object));
            share *= 0.5;
            next.filter(|next| next.off.norm() < left)
        });
        match better {
            Some(next) => {
                // Where a step gains much, the slopes are good enough for the next, once they agree with it.
                if next.off.norm() < ENOUGH_GAINED * left {
                    from.learn(&(next.normal - now.normal), &(now.off - next.off));
                    slope = Some(from);
                }
                now = next;
            }
            None if left < 100.0 * AGREED => return Some(touch_of(stance, &now)),
            None if is_known => {}
            None => return None,
        }
    }
    None
}

/// What is seen with the normal with which the tip would touch what is nearest alone, or part of the way there, where the normals
/// agree better then.
fn nearer_alone(
    surface: &Surface,
    tip: &SmoothHull,
    stance: &Stance,
    now: &Seen,
    see: &impl Fn(Vector, Option<&Point>) -> Option<Seen>,
) -> Option<Seen> {
    let (facing, place) = surface.facing(&now.foot, &now.from)?;
    let normal = alone::normal(tip, &Stance { normal: now.normal, ..*stance }, &facing, &place)?;
    let step = normal - now.normal;
    let mut share = (LONGEST_STEP / step.norm()).min(1.0);
    (0..HALVINGS_ALONE).find_map(|_| {
        let next = see((now.normal + step * share).normalize(), Some(&now.foot.point_in_object));
        share *= 0.5;
        next.filter(|next| next.off.norm() < now.off.norm())
    })
}

fn touch_of(stance: &Stance, seen: &Seen) -> Touch {
    let gap = (seen.from - seen.foot.point_in_object).dot(&seen.normal) - INNER;
    Touch { stance: Stance { normal: seen.normal, ..*stance }, foot: seen.foot, gap }
}

/// How the difference of the normals falls when the tip's normal turns, in two directions across a normal.
struct Slope {
    across: [Vector; 2],
    falls: Matrix2<f64>,
}

impl Slope {
    /// By the tip's curvature and nudges of the object.
    fn at(surface: &Surface, tip: &SmoothHull, stance: &Stance, now: &Seen) -> Option<Self> {
        let (x, y) = tangents(&UnitVector::new_unchecked(now.normal));
        let across = [x.into_inner(), y.into_inner()];
        let flat = |v: &Vector| Vector2::new(across[0].dot(v), across[1].dot(v));
        let turn = stance.object_from_link;
        let radii = tip.bend(&-turn.tr_mul(&now.normal)).radii;
        // How the place from which the object is seen moves with the normal, and how the normal seen moves with that place.
        let place = |t: &Vector| t * INNER - turn * (radii * turn.tr_mul(t));
        let places = Matrix2::from_columns(&across.map(|t| flat(&place(&t))));
        let seen = |t: &Vector| {
            let from = now.from + t * NUDGE;
            let (foot, distance) = surface.project_signed_from(&from, &now.foot.point_in_object);
            (distance > 1e-9).then(|| flat(&((from - foot.point_in_object) / distance - now.normal - now.off)) / NUDGE)
        };
        let normals = Matrix2::from_columns(&[seen(&across[0])?, seen(&across[1])?]);
        Some(Slope { across, falls: Matrix2::identity() - normals * places })
    }

    fn flat(&self, v: &Vector) -> Vector2<f64> {
        Vector2::new(self.across[0].dot(v), self.across[1].dot(v))
    }

    /// The turn of the normal after which both normals would agree, to first order.
    fn step(&self, off: &Vector) -> Option<Vector> {
        let step = self.falls.try_inverse()? * self.flat(off);
        let step = self.across[0] * step.x + self.across[1] * step.y;
        (step.norm() > 0.0 && step.norm().is_finite()).then_some(step)
    }

    /// Takes note of a turn and of how much the difference fell (Broyden 1965).
    fn learn(&mut self, turn: &Vector, fell: &Vector) {
        let (turn, fell) = (self.flat(turn), self.flat(fell));
        let square = turn.norm_squared();
        if square > 0.0 {
            self.falls += (fell - self.falls * turn) * turn.transpose() / square;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use regrasp_base::Rng;
    use regrasp_geometry::{ConvexHull, Shape};
    use regrasp_robot::tip::smooth_hull::SmoothHull;

    /// A bar with flat faces and a rounded end.
    fn bar() -> SmoothHull {
        let mut points = Vec::new();
        for k in 0..25 {
            let (up, out) = (std::f64::consts::PI * f64::from(k) / 24.0).sin_cos();
            points.extend([-0.010, 0.010].map(|x| Point::new(x, 0.012 * out, 0.012 * up)));
        }
        points.extend(
            (0..4).map(|k| Point::new(f64::from(k % 2) * 0.02 - 0.01, f64::from(k / 2) * 0.024 - 0.012, -0.015)),
        );
        SmoothHull::near(&ConvexHull::new(&points).unwrap(), None).unwrap().0
    }

    /// How far a shape reaches towards a direction.
    type Reach = Box<dyn Fn(&Vector) -> f64>;

    fn stance(rng: &mut Rng, distance: f64) -> Stance {
        let turn = Rotation3::new(Vector::from(rng.direction()) * rng.uniform(0.0, 3.0));
        let towards = Vector::from(rng.direction());
        Stance { center: Point::from(towards * distance), object_from_link: *turn.matrix(), normal: towards }
    }

    /// The nearest points of two convex bodies, by another way: no plane is wider between the two than the one across the
    /// normal, whichever way it is turned.
    #[test]
    fn gaps_are_what_separating_planes_say() {
        let tip = bar();
        let cuboid = Vector::new(0.03, 0.02, 0.025);
        let mut rng = Rng::keyed(5, "corners", 0);
        let corners: Vec<Point> =
            (0..300).map(|_| Point::from(Vector::from(rng.direction()).component_mul(&cuboid))).collect();
        let stone = Shape::Convex(ConvexHull::new(&corners).unwrap().into());
        let shapes: [(Shape, Reach); 4] = [
            (Shape::Sphere { radius: 0.032 }, Box::new(|n: &Vector| 0.032 * n.norm())),
            (Shape::Cuboid { half_extents: cuboid }, Box::new(move |n: &Vector| n.abs().dot(&cuboid))),
            (
                Shape::Cylinder { half_length: 0.035, radius: 0.02 },
                Box::new(|n: &Vector| 0.035 * n.z.abs() + 0.02 * n.xy().norm()),
            ),
            (stone, Box::new(move |n: &Vector| corners.iter().map(|p| p.coords.dot(n)).fold(0.0, f64::max))),
        ];
        let mut rng = Rng::keyed(5, "gaps", 0);
        for (shape, reach) in &shapes {
            let surface = Surface::of(shape).unwrap();
            let mut missed = 0;
            for _ in 0..400 {
                let mut stance = stance(&mut rng, 0.06);
                let apart = |n: &Vector, stance: &Stance| {
                    stance.center.coords.dot(n) - tip.support(&-stance.object_from_link.tr_mul(n)) - reach(n)
                };
                let Some(far) = touch(&surface, &tip, &stance, None) else {
                    missed += 1;
                    continue;
                };
                // The same, pressed in by a fifth of a millimetre.
                stance.center -= far.stance.normal * (far.gap + 0.2e-3);
                for touch in [Some(far), touch(&surface, &tip, &Stance { normal: far.stance.normal, ..stance }, None)] {
                    let Some(touch) = touch else {
                        missed += 1;
                        continue;
                    };
                    let at = touch.stance;
                    assert!(
                        (apart(&at.normal, &at) - touch.gap).abs() < 1e-10,
                        "{} {}",
                        apart(&at.normal, &at),
                        touch.gap
                    );
                    for _ in 0..30 {
                        let aside = (at.normal + Vector::from(rng.direction()) * 0.02).normalize();
                        assert!(apart(&aside, &at) <= touch.gap + 1e-12);
                    }
                    let touching = at.center + at.arm(regrasp_robot::tip::CurvedTip::Smooth(&tip));
                    let way = touching - touch.foot.point_in_object;
                    assert!((way - at.normal * touch.gap).norm() < 1e-9, "{way}");
                }
            }
            assert!(missed <= 8, "{shape:?}: {missed}");
        }
    }
}
