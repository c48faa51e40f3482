//! An ellipsoid that rolls on a surface without slipping: as `rolling`, for tips whose centre is not equally far from every
//! point that can touch.
//!
//! Where it touches is found by iteration: a ball inside the ellipsoid at the point with the normal guessed has the nearest
//! point of the surface along the next guess. Over a step the material point that touches half-way, `p` in the link, is
//! carried without slip: `T1 p - T0 p` has no part across the normal half-way. A midpoint rule, of second order, the same
//! both ways.

/// Where smooth hulls touch.
mod touch_smooth;

use super::Contact;
use nalgebra::Matrix3;
use regrasp_geometry::surface::{Surface, SurfacePoint};
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_robot::tip::{CurvedTip, TipEllipsoid};

/// How a tip stands and which way it touches, seen from the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// Its centre, in the object frame.
    pub center: Point,
    /// Rotation of the frame in which the tip is given, in the object frame.
    pub object_from_link: Matrix3<f64>,
    /// Outward normal of the object where they touch, in the object frame.
    pub normal: Vector,
}

impl Stance {
    /// The touching point of the tip as seen from its centre, in the object frame.
    pub fn arm<'a>(&self, tip: impl Into<CurvedTip<'a>>) -> Vector {
        self.object_from_link * tip.into().arm(&-self.object_from_link.tr_mul(&self.normal))
    }
}

/// A tip near the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// How it stands, with the normal of the nearest points.
    pub stance: Stance,
    /// The point of the surface nearest to it.
    pub foot: SurfacePoint,
    /// Distance between them, negative when they overlap, in metres.
    pub gap: f64,
}

/// Guesses of the normal. On convex surfaces each is nearer by at least `(flattest - sharpest) / (flattest + sharpest)`.
const MAX_GUESSES: usize = 60;

impl Touch {
    /// The touch of a tip at `stance`, whose normal is the first guess. None inside the object, and where guesses do not
    /// settle: in hollows narrower than the tip is curved.
    pub fn of<'a>(surface: &Surface, tip: impl Into<CurvedTip<'a>>, stance: &Stance) -> Option<Self> {
        Touch::near(surface, tip, stance, None)
    }

    /// The same, faster where a point of the surface near the touch is known.
    pub fn near<'a>(
        surface: &Surface,
        tip: impl Into<CurvedTip<'a>>,
        stance: &Stance,
        known: Option<&Point>,
    ) -> Option<Self> {
        match tip.into() {
            CurvedTip::Ellipsoid(tip) => Touch::of_ellipsoid(surface, tip, stance, known),
            CurvedTip::Smooth(tip) => touch_smooth::touch(surface, tip, stance, known),
        }
    }

    fn of_ellipsoid(surface: &Surface, tip: &TipEllipsoid, stance: &Stance, known: Option<&Point>) -> Option<Self> {
        let inner = 0.5 * (tip.flattest() + tip.sharpest());
        let mut stance = *stance;
        let mut known = known.copied();
        for _ in 0..MAX_GUESSES {
            let touching = stance.center + stance.arm(tip);
            let middle = touching + stance.normal * inner;
            let (foot, distance) = match known {
                Some(known) => surface.project_signed_from(&middle, &known),
                None => surface.project_signed(&middle),
            };
            if !(distance > 1e-9) {
                return None;
            }
            known = Some(foot.point_in_object);
            let normal = (middle - foot.point_in_object) / distance;
            let change = (normal - stance.normal).norm();
            stance.normal = normal;
            if change < 1e-13 {
                let gap = (stance.center + stance.arm(tip) - foot.point_in_object).dot(&normal);
                return Some(Touch { stance, foot, gap });
            }
        }
        None
    }

    /// The contact at the foot.
    pub fn contact(&self) -> Contact {
        let normal_in_object = UnitVector::new_unchecked(self.stance.normal);
        Contact { point_in_object: self.foot.point_in_object, normal_in_object }
    }
}

/// What is left of a step's motion when rolling is taken off: the slip of the tip over the object, in the object frame, in
/// metres.
pub fn slip<'a>(tip: impl Into<CurvedTip<'a>>, from: &Stance, to: &Stance) -> Vector {
    let tip = tip.into();
    let half_way = from.object_from_link.tr_mul(&from.normal) + to.object_from_link.tr_mul(&to.normal);
    let touching = tip.arm(&-half_way.normalize());
    let way = to.center + to.object_from_link * touching - (from.center + from.object_from_link * touching);
    let middle = (from.normal + to.normal).normalize();
    way - middle * middle.dot(&way)
}

#[cfg(test)]
mod tests {
    use super::super::rolling;
    use super::*;
    use nalgebra::{Rotation3, UnitQuaternion};
    use regrasp_base::Rng;
    use regrasp_geometry::Shape;

    /// One step of the midpoint rule: the ellipsoid turned by `turn` in the object frame.
    fn step(surface: &Surface, tip: &TipEllipsoid, from: &Touch, turn: &Vector) -> Touch {
        let object_from_link = Rotation3::new(*turn).matrix() * from.stance.object_from_link;
        let mut to = Touch::of(surface, tip, &Stance { object_from_link, ..from.stance }).unwrap();
        for _ in 0..200 {
            let off = slip(tip, &from.stance, &to.stance) + to.stance.normal * to.gap;
            if off.norm() < 1e-14 {
                return to;
            }
            to = Touch::of(surface, tip, &Stance { center: to.stance.center - off, ..to.stance }).unwrap();
        }
        panic!("the step does not converge");
    }

    fn start(surface: &Surface, tip: &TipEllipsoid, towards: &Vector, object_from_link: Matrix3<f64>) -> Touch {
        let foot = surface.project(&Point::from(*towards));
        let normal = foot.normal_in_object.into_inner();
        let stance = Stance { center: Point::origin(), object_from_link, normal };
        let center = foot.point_in_object - stance.arm(tip);
        let touch = Touch::of(surface, tip, &Stance { center, ..stance }).unwrap();
        assert!(touch.gap.abs() < 1e-12, "{}", touch.gap);
        touch
    }

    fn plane() -> Surface {
        Surface::of(&Shape::Cuboid { half_extents: Vector::new(1.0, 1.0, 0.01) }).unwrap()
    }

    /// About a principal axis an ellipsoid rolls on a plane as its section does: as far as the arc of an ellipse that the
    /// normal has passed, in a straight line. The arc is summed from chords.
    #[test]
    fn on_a_plane_it_goes_as_far_as_the_arc_that_touched() {
        let (a, b) = (0.009, 0.006);
        let tip = TipEllipsoid::new(Vector::new(a, 0.007, b), UnitQuaternion::identity());
        let surface = plane();
        let begin = start(&surface, &tip, &Vector::new(0.0, 0.0, 0.1), Matrix3::identity());
        for angle in [0.4, 1.3] {
            let n_steps = 400;
            let end = (0..n_steps)
                .fold(begin, |at, _| step(&surface, &tip, &at, &(Vector::y() * angle / f64::from(n_steps))));
            // The point of the ellipse with the outward normal (sin u, cos u) below.
            let at = |u: f64| {
                let h = ((a * u.sin()).powi(2) + (b * u.cos()).powi(2)).sqrt();
                nalgebra::Vector2::new(a * a * u.sin() / h, b * b * u.cos() / h)
            };
            let n = 20_000;
            let arc: f64 = (0..n)
                .map(|k| (at(angle * f64::from(k + 1) / f64::from(n)) - at(angle * f64::from(k) / f64::from(n))).norm())
                .sum();
            let way = end.foot.point_in_object - begin.foot.point_in_object;
            assert!((way - Vector::x() * arc).norm() < 2e-8, "{way} {arc}");
        }
    }

    #[test]
    fn a_ball_rolls_as_balls_do() {
        let ball = TipEllipsoid::new(Vector::repeat(0.006), UnitQuaternion::identity());
        let surface = Surface::of(&Shape::Ellipsoid { radii: Vector::new(0.03, 0.02, 0.04) }).unwrap();
        let begin = start(&surface, &ball, &Vector::new(0.1, 0.05, -0.04), Matrix3::identity());
        let turn = Vector::new(0.5, -0.8, 0.6);
        let difference = |n_steps: u32| {
            let share = turn / f64::from(n_steps);
            let mut round = rolling::Touch::of(&surface, &begin.stance.center).unwrap();
            let mut general = begin;
            for _ in 0..n_steps {
                let from = round.ball;
                for _ in 0..100 {
                    let off =
                        rolling::slip(0.006, &from, &round.ball, &share) + round.ball.normal * (round.distance - 0.006);
                    round = rolling::Touch::of(&surface, &(round.ball.center - off)).unwrap();
                }
                general = step(&surface, &ball, &general, &share);
            }
            (round.ball.center - general.stance.center).norm()
        };
        // Two rules of second order for the same motion.
        let ratio = difference(10) / difference(20);
        assert!((3.6..4.4).contains(&ratio), "{ratio}");
    }

    #[test]
    fn the_error_falls_with_the_square_of_the_step() {
        let tip =
            TipEllipsoid::new(Vector::new(0.009, 0.007, 0.006), UnitQuaternion::from_euler_angles(0.4, 0.2, -0.7));
        let surface = Surface::of(&Shape::Ellipsoid { radii: Vector::new(0.03, 0.02, 0.04) }).unwrap();
        let begin = start(&surface, &tip, &Vector::new(0.1, 0.05, -0.04), Matrix3::identity());
        let turn = Vector::new(1.0, -0.6, 0.5);
        let end = |n_steps: u32| {
            let share = turn / f64::from(n_steps);
            (0..n_steps).fold(begin, |at, _| step(&surface, &tip, &at, &share)).stance.center
        };
        let exact = end(1024);
        let errors: Vec<f64> = [8, 16, 32, 64].map(|n| (end(n) - exact).norm()).to_vec();
        for pair in errors.windows(2) {
            assert!((3.6..4.4).contains(&(pair[0] / pair[1])), "{errors:?}");
        }
        assert!(errors[0] > 1e-8);
    }

    /// The nearest points of two convex bodies, by another way: the gap is the largest over all directions of how far the
    /// two are apart along it.
    #[test]
    fn gaps_are_what_separating_planes_say() {
        let tip =
            TipEllipsoid::new(Vector::new(0.009, 0.007, 0.006), UnitQuaternion::from_euler_angles(0.4, 0.2, -0.7));
        let radii = Vector::new(0.03, 0.02, 0.04);
        let object = TipEllipsoid::new(radii, UnitQuaternion::identity());
        let surface = Surface::of(&Shape::Ellipsoid { radii }).unwrap();
        let mut rng = Rng::keyed(5, "gaps", 0);
        for _ in 0..100 {
            let turn = Rotation3::new(Vector::from(rng.direction()) * rng.uniform(0.0, 3.0));
            let center = Point::from(Vector::from(rng.direction()) * rng.uniform(0.045, 0.07));
            let guess = (center - surface.project(&center).point_in_object).normalize();
            let stance = Stance { center, object_from_link: *turn.matrix(), normal: guess };
            let Some(touch) = Touch::of(&surface, &tip, &stance) else { panic!("no touch") };
            let apart = |n: &Vector| {
                let lowest = Stance { normal: *n, ..stance }.arm(&tip).dot(n) + center.coords.dot(n);
                lowest - object.arm(n).dot(n)
            };
            assert!((apart(&touch.stance.normal) - touch.gap).abs() < 1e-10);
            for _ in 0..50 {
                let aside = (touch.stance.normal + Vector::from(rng.direction()) * 0.05).normalize();
                assert!(apart(&aside) <= touch.gap + 1e-12);
            }
        }
    }
}
