//! A ball that rolls on a surface without slipping (Sahbani 2007, sec. IV-C; Cherif 1999, table 1: rolling without sliding).
//!
//! Seen from the object. The ball's centre `c` keeps one radius from the surface, `n` is the normal at the point that it
//! touches, `w` the angular velocity of the ball relative to the object. The material points that touch have the same
//! velocity where `c' = r w x n`. Over a step that turns the ball by the rotation vector `a` the rule is
//! `c1 - c0 = r a x (n0 + n1) / |n0 + n1|`, across that direction: a midpoint rule, of second order, the same both ways.
//! Turning about the normal moves nothing.

use super::Contact;
pub use regrasp_geometry::frame::turn_between;
use regrasp_geometry::surface::{Surface, SurfacePoint};
use regrasp_geometry::{Point, UnitVector, Vector};

/// A ball that touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its centre, in the object frame.
    pub center: Point,
    /// Unit vector from the contact to the centre: the outward normal there.
    pub normal: Vector,
}

/// A ball near the surface, and the point of the surface nearest to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The ball, as if it touched.
    pub ball: Ball,
    /// The point of the surface nearest to its centre.
    pub foot: SurfacePoint,
    /// Distance of the centre from the surface, in metres.
    pub distance: f64,
}

impl Touch {
    /// The touch of a ball with its centre at `center`, in the object frame. None inside the object and on its surface.
    #[inline]
    pub fn of(surface: &Surface, center: &Point) -> Option<Self> {
        let (foot, distance) = surface.project_signed(center);
        let away = center - foot.point_in_object;
        (distance > 1e-9).then(|| Touch { ball: Ball { center: *center, normal: away / distance }, foot, distance })
    }

    /// The contact at the foot.
    pub fn contact(&self) -> Contact {
        let normal_in_object = UnitVector::new_unchecked(self.ball.normal);
        Contact { point_in_object: self.foot.point_in_object, normal_in_object }
    }
}

/// What is left of a step's motion when rolling is taken off: the slip of the ball over the object, in the object frame,
/// in metres. The ball turns by the rotation vector `turn` relative to the object.
#[inline]
pub fn slip(radius: f64, from: &Ball, to: &Ball, turn: &Vector) -> Vector {
    let between = from.normal + to.normal;
    let middle = between / between.norm();
    let left = to.center - from.center - radius * turn.cross(&middle);
    left - middle * middle.dot(&left)
}

/// Fixed-point steps of [`roll_step`]; each gains at least the factor `turn / 2`.
const MOST_ITERATIONS: usize = 60;
/// Distance from the surface, and slip, that a step leaves, in metres; where rounding stops it sooner, a hundred times as much.
const REACHED: f64 = 1e-13;

/// Where a ball of `radius` that touches at `from` touches after one step of the midpoint rule that turns it by the rotation
/// vector `turn`, in the object frame. `touch` finds the nearest point of the surface.
///
/// None where it finds none, or the step does not converge.
#[inline]
pub fn roll_step(touch: impl Fn(&Point) -> Option<Touch>, radius: f64, from: &Touch, turn: &Vector) -> Option<Touch> {
    let mut to = *from;
    let mut before = f64::INFINITY;
    for _ in 0..MOST_ITERATIONS {
        let off = slip(radius, &from.ball, &to.ball, turn) + to.ball.normal * (to.distance - radius);
        let left = off.norm();
        if left < REACHED || (left < 100.0 * REACHED && left >= before) {
            return Some(to);
        }
        before = left;
        to = touch(&(to.ball.center - off))?;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Rotation3};
    use regrasp_base::Rng;
    use regrasp_geometry::Shape;

    const RADIUS: f64 = 0.006;

    /// Most often that a step is halved.
    const MAX_HALVINGS: u32 = 20;

    /// Rolls a ball that touches at `from` by the rotation vector `turn` relative to the object, at constant angular velocity
    /// in the object frame. `touch` finds the nearest point of the surface. Steps are halved until one and two halves of it
    /// agree within `tolerance` times their share of the turn.
    fn roll(touch: &impl Fn(&Point) -> Option<Touch>, from: &Touch, turn: &Vector, tolerance: f64) -> Touch {
        roll_within(touch, from, turn, tolerance, MAX_HALVINGS)
    }

    fn roll_within(
        touch: &impl Fn(&Point) -> Option<Touch>,
        from: &Touch,
        turn: &Vector,
        tolerance: f64,
        halvings: u32,
    ) -> Touch {
        let half = turn * 0.5;
        let twice = step(touch, &step(touch, from, &half), &half);
        if (step(touch, from, turn).ball.center - twice.ball.center).norm() <= tolerance {
            return twice;
        }
        assert!(halvings > 0, "the tolerance is not reached");
        let middle = roll_within(touch, from, &half, 0.5 * tolerance, halvings - 1);
        roll_within(touch, &middle, &half, 0.5 * tolerance, halvings - 1)
    }

    fn step(touch: &impl Fn(&Point) -> Option<Touch>, from: &Touch, turn: &Vector) -> Touch {
        roll_step(touch, RADIUS, from, turn).expect("the ball is near the surface")
    }

    fn on(surface: &Surface) -> impl Fn(&Point) -> Option<Touch> + '_ {
        |center| Touch::of(surface, center)
    }

    /// A ball inside a hollow sphere about the origin: the normal at the contact points inwards, to the ball.
    fn cavity(radius: f64) -> impl Fn(&Point) -> Option<Touch> {
        let any = Surface::of(&Shape::Sphere { radius }).unwrap();
        move |center| {
            let outward = center.coords.try_normalize(1e-9)?;
            let foot = any.project(center);
            let distance = radius - center.coords.norm();
            Some(Touch { ball: Ball { center: *center, normal: -outward }, foot, distance })
        }
    }

    #[test]
    fn turns_are_those_of_rotation_matrices() {
        let mut rng = Rng::keyed(1, "turn_between", 0);
        for _ in 0..200 {
            let from = Rotation3::new(Vector::from(rng.direction()) * rng.uniform(0.0, 3.0));
            let turn = Vector::from(rng.direction()) * rng.uniform(0.0, 3.0);
            let to = Rotation3::new(turn) * from;
            assert!((turn_between(from.matrix(), to.matrix()) - turn).norm() < 1e-9);
        }
        assert_eq!(turn_between(&Matrix3::identity(), &Matrix3::identity()), Vector::zeros());
    }

    #[test]
    fn a_ball_on_a_plane_rolls_as_far_as_it_turns() {
        let surface = Surface::of(&Shape::Cuboid { half_extents: Vector::new(1.0, 1.0, 0.01) }).unwrap();
        let touch = on(&surface);
        let start = touch(&Point::new(0.1, -0.05, 0.01 + RADIUS)).unwrap();
        // Also about the normal: that moves nothing.
        let turn = Vector::new(0.7, -1.1, 2.0);
        let end = roll(&touch, &start, &turn, 1e-12);
        let expected = start.ball.center + RADIUS * turn.cross(&Vector::z());
        assert!((end.ball.center - expected).norm() < 1e-12, "{} {expected}", end.ball.center);
        assert!((end.distance - RADIUS).abs() < 1e-12);
    }

    /// On a sphere of radius `R` and a turn about an axis across the normal, the ball's centre goes round a great circle of
    /// radius `R + r` (on it) or `R - r` (in it) by the angle `turn r / (R +- r)`: relative to the object, `c' = r w x n`.
    #[test]
    fn a_ball_on_or_in_a_sphere_goes_round_a_great_circle() {
        let large = 0.032;
        let surface = Surface::of(&Shape::Sphere { radius: large }).unwrap();
        let outside = on(&surface);
        let inside = cavity(large);
        for path_radius in [large + RADIUS, large - RADIUS] {
            let touch = |p: &Point| if path_radius > large { outside(p) } else { inside(p) };
            let start = touch(&Point::new(0.0, 0.0, path_radius)).unwrap();
            for turn in [0.3, 1.5, -2.5] {
                let end = roll(&touch, &start, &(Vector::x() * turn), 1e-12);
                // w x n with w along x and n along +-z.
                let angle = turn * RADIUS / path_radius * start.ball.normal.z;
                let expected = Point::new(0.0, -path_radius * angle.sin(), path_radius * angle.cos());
                assert!(
                    (end.ball.center - expected).norm() < 1e-11,
                    "turn {turn}: {} instead of {expected}",
                    end.ball.center
                );
            }
        }
    }

    /// With an angular velocity that is not across the normal the path is none of a circle about the sphere's centre; the
    /// differential equation `c' = r w x c / |c|` is solved by a rotation about `w`: `c(t) = exp(r / (R + r) t w) c(0)`.
    #[test]
    fn a_ball_that_also_spins_goes_round_a_small_circle() {
        let large = 0.02;
        let surface = Surface::of(&Shape::Sphere { radius: large }).unwrap();
        let touch = on(&surface);
        let start = touch(&Point::from(Vector::new(0.3, -0.5, 0.9).normalize() * (large + RADIUS))).unwrap();
        let turn = Vector::new(1.0, 0.4, -0.8);
        let end = roll(&touch, &start, &turn, 1e-12);
        let expected = Rotation3::new(turn * (RADIUS / (large + RADIUS))) * start.ball.center;
        assert!((end.ball.center - expected).norm() < 1e-11);
    }

    #[test]
    fn the_error_of_the_midpoint_rule_falls_with_the_square_of_the_step() {
        let large = 0.012;
        let surface = Surface::of(&Shape::Sphere { radius: large }).unwrap();
        let touch = on(&surface);
        let start = touch(&Point::from(Vector::new(0.3, -0.5, 0.9).normalize() * (large + RADIUS))).unwrap();
        let turn = Vector::new(1.6, 0.4, -0.8);
        let expected = Rotation3::new(turn * (RADIUS / (large + RADIUS))) * start.ball.center;
        let error = |n_steps: u32| {
            let share = turn / f64::from(n_steps);
            let end = (0..n_steps).fold(start, |at, _| step(&touch, &at, &share));
            (end.ball.center - expected).norm()
        };
        let errors: Vec<f64> = [4, 8, 16, 32, 64].map(error).to_vec();
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((3.8..4.2).contains(&ratio), "{errors:?}");
        }
    }

    #[test]
    fn rolling_back_leads_back() {
        let surface = Surface::of(&Shape::Ellipsoid { radii: Vector::new(0.03, 0.02, 0.04) }).unwrap();
        let touch = on(&surface);
        let mut rng = Rng::keyed(3, "rolling back", 0);
        for _ in 0..50 {
            let start = touch(&Point::from(Vector::from(rng.direction()) * 0.1)).unwrap();
            let start = touch(&(start.foot.point_in_object + start.ball.normal * RADIUS)).unwrap();
            let turn = Vector::from(rng.direction()) * 0.2;
            let there = step(&touch, &start, &turn);
            assert!((there.distance - RADIUS).abs() < 1e-12);
            let back = step(&touch, &there, &-turn);
            assert!((back.ball.center - start.ball.center).norm() < 1e-12);
        }
    }

    /// Rolling without slipping: the material point of the ball that touches has no velocity over the object, by finite
    /// differences.
    #[test]
    fn material_points_that_touch_move_alike() {
        let surface = Surface::of(&Shape::Ellipsoid { radii: Vector::new(0.03, 0.02, 0.04) }).unwrap();
        let touch = on(&surface);
        let center = surface.project(&Point::new(0.1, 0.05, 0.03));
        let start = touch(&(center.point_in_object + center.normal_in_object.into_inner() * RADIUS)).unwrap();
        let omega = Vector::new(0.3, -0.8, 0.5);
        let h = 1e-5;
        let end = step(&touch, &start, &(omega * h));
        // The point of the ball that touches at the start, carried along by the ball.
        let arm = -start.ball.normal * RADIUS;
        let carried = end.ball.center + Rotation3::new(omega * h) * arm;
        let velocity = (carried - (start.ball.center + arm)) / h;
        assert!(velocity.norm() < 1e-6, "{velocity}");
    }
}
