//! Fingertips that roll: the ball stays on the object's surface, and what touches does not slide.
//!
//! A tip is a ball fixed to its link. In the object frame its centre goes along `c(t)` and the link turns; the point of
//! the surface nearest to `c` is the contact and `n` the direction from there. The material point of the link that touches
//! is at `c - r n`. Rolling without slipping means that its velocity seen from the object has no part across `n`
//! (Sahbani 2007, sec. IV-C; Cherif 1999, sec. 6.2.2). Here slip is judged by segment, against what the plan promises; `slip` judges
//! it from landing to lifting, with the turn of soft fingertips about `n`.

/// How near smooth hulls are to triangles.
mod smooth_reach;
/// Where smooth hulls touch.
mod smooth_touch;

use crate::check::between::Between;
use crate::check::contact::{error_at, off_contact};
use crate::check::model::{CheckedHand, FingerModel};
use crate::check::patch::Patch;
use crate::check::step_slip::{StepSlip, torsion_radius};
use crate::check::surface::SortedShape;
use crate::check::tip_rates::{bounds_in_object, speed_in_object};
use crate::check::tip_surface::TipSurface;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, Plan, SegmentKind, Waypoint};
use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Vector};
use smooth_touch::SEEN_FROM;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

/// Pieces after which no finer sum is made; what is then unknown counts as slip.
const MOST_PIECES: usize = 128;
/// Share of the slip allowed that may stay unknown in a step. What is unknown counts as slip: of the slip allowed to a
/// segment of fifty steps it takes at most a tenth.
pub(super) const UNKNOWN_SHARE: f64 = 0.002;
/// Share of the contact tolerance by which some other place of the surface may be nearer than the one that counts as touching. Where
/// surfaces fold, hulls touch in several places: which of them does is not known better than the hull itself, whose smooth surface
/// may be 0.2 mm off it. A touch that jumped between them would count as slip of a tip that rests.
const UNKNOWN_DEPTH: f64 = 0.2;
/// Pieces of a step in which turns are measured: the error falls with their square.
const TURN_PIECES: usize = 8;
/// Motion that is too small to be divided further when it cannot be told whether the tip is on the surface, as a share
/// of the contact tolerance.
const SMALLEST_PIECE: f64 = 1e-3;

/// Configurations of a step after which it counts as not shown that the tip is on the surface; no plan of the planner needs a
/// hundredth.
const MOST_LOOKED: u64 = 100_000;

/// What rolling amounts to in a plan.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rolled {
    /// Slip of the steps in which a finger does not slide on purpose, by finger, segment and waypoint.
    pub steps: BTreeMap<(usize, usize, usize), StepSlip>,
    /// Largest slip of a finger in a segment, in metres; none when no finger rolls.
    pub max_slip: Option<f64>,
    /// Largest distance of a rolling tip from its contact at waypoints, and from the surface where that was measured
    /// between them, in metres.
    pub max_contact_error: f64,
}

/// Judges every step in which a finger rolls.
pub fn check_rolling(
    shape: &SortedShape,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) -> Rolled {
    let tolerance = plan.promises.contact_tolerance.min(settings.largest_contact_tolerance);
    let slip_tolerance = plan.promises.slip_tolerance.min(settings.largest_slip_tolerance);
    let mut rolled = Rolled::default();
    // What rolls in tracking is judged in `tracking`.
    let judged = plan.segments.iter().enumerate().filter(|(_, segment)| segment.kind != SegmentKind::Tracking);
    for (s, segment) in judged {
        for (f, finger) in model.fingers.iter().enumerate() {
            let rolls = |waypoint: &Waypoint| waypoint.contacts[f].mode == ContactMode::Rolling;
            let mut sum = 0.0;
            let mut worst = (0.0, 0);
            let mut is_off = false;
            for (w, waypoint) in segment.waypoints.iter().enumerate().filter(|(_, waypoint)| rolls(waypoint)) {
                let next = segment.waypoints.get(w + 1).filter(|next| rolls(next));
                let (mut error, mut fraction) = (error_at(finger, waypoint, f), 0.0);
                if let Some(next) = next {
                    let roll = Roll::new((f, finger), waypoint, next, shape, tolerance);
                    let (between, at) = roll.off_surface(tolerance);
                    if between > error {
                        (error, fraction) = (between, at);
                    }
                    let slip = roll.slip(UNKNOWN_SHARE * slip_tolerance);
                    rolled.steps.insert((f, s, w), roll.step_slip(finger, slip));
                    if !log.work.spend(roll.looked(), "fingertips that roll") {
                        return rolled;
                    }
                    sum += slip;
                    if slip > worst.0 {
                        worst = (slip, w);
                    }
                }
                rolled.max_contact_error = rolled.max_contact_error.max(error);
                if error > tolerance && !is_off {
                    is_off = true;
                    let at = Moment { segment: s, waypoint: w, fraction };
                    log.push(off_contact(finger, error, tolerance).when(at));
                }
            }
            if segment.waypoints.iter().any(rolls) {
                rolled.max_slip = Some(rolled.max_slip.map_or(sum, |most| most.max(sum)));
            }
            if sum > slip_tolerance {
                let message = format!(
                    "the tip of finger \"{}\" slides {sum:.3e} m over the object in this segment, most of it here",
                    finger.name
                );
                let violation = Violation::new(Kind::Slip, message).when(Moment::at(s, worst.1));
                log.push(violation.subjects([finger.name.as_str()]).amount(sum, slip_tolerance));
            }
        }
    }
    rolled
}

/// A rolling fingertip between two waypoints; the parameter runs from 0 to 1.
pub struct Roll<'a> {
    finger: &'a FingerModel,
    motion: Between<'a>,
    patch: Patch<'a>,
    /// Bound of the speed of whatever touches in the object frame.
    speed: f64,
    /// Bound of the second derivative of the centre in the object frame.
    acceleration: f64,
    /// Configurations looked at.
    looked: Cell<u64>,
    /// Normal where a smooth hull last touched: the next is near.
    last_normal: Cell<Option<Vector>>,
    /// Which planes of a smooth hull proved last that triangles of the patch are no nearer.
    proofs: RefCell<Vec<usize>>,
    /// Normals that the plan says a smooth hull touches with, where the search for others begins.
    planned: [Option<Vector>; 2],
    /// Where the surface is nearer by less than this in some other place, the hull touches in both, in metres.
    slack: f64,
    /// The tip is at least so far from what of the surface is not in the patch, in metres.
    least_gap_off_patch: f64,
}

/// A tip over the surface, in the object frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// The point of the surface nearest to the tip.
    pub foot: Point,
    /// The direction from there to the tip.
    pub normal: Vector,
    /// Distance, negative when the tip presses in.
    pub gap: f64,
}

/// Steps of the search for nearest points on an ellipsoid and a surface.
const MOST_TOUCH_STEPS: usize = 100;

impl<'a> Roll<'a> {
    /// The step of `finger`, whose index is `f`, over an object of this shape. The surface is looked at as far from the tip as it
    /// can come in this step, and `tolerance` farther.
    pub fn new(
        (f, finger): (usize, &'a FingerModel),
        from: &'a Waypoint,
        to: &'a Waypoint,
        shape: &'a SortedShape,
        tolerance: f64,
    ) -> Self {
        let motion = Between::new(from, to);
        let (speed, acceleration) = bounds_in_object(finger, &motion, from, to);
        let start = Pose::from(&from.world_from_object).inverse() * finger.center_in_world(&from.joints);
        // Feet are sought from the centre, and from inside an ellipsoid.
        let inside = match &finger.surface {
            TipSurface::Smooth(_) => SEEN_FROM,
            _ => finger.surface.curvature_radii().map_or(0.0, |[_, flattest]| 2.0 * flattest),
        };
        let mut patch = Patch::near(shape, &start, finger.radius + inside + 2.0 * tolerance + speed);
        let speed = speed_in_object(finger, &motion, from, to);
        if let TipSurface::Smooth(smooth) = &finger.surface {
            let object = Pose::from(&from.world_from_object).inverse().to_homogeneous();
            let link =
                (object * finger.path.world_from_link(&from.joints)).try_inverse().unwrap_or_else(Matrix4::zeros);
            let in_link = |point: &Point| link.transform_point(point) - finger.center;
            let far = inside + 2.0 * tolerance + speed;
            patch = patch.only(|facet| smooth_reach::may_be_near(smooth, in_link, facet, far));
        }
        Roll {
            finger,
            motion,
            patch,
            speed,
            acceleration,
            looked: Cell::new(0),
            last_normal: Cell::new(None),
            proofs: RefCell::default(),
            planned: [from, to].map(|waypoint| waypoint.contacts[f].normal_in_object.map(Vector::from)),
            slack: UNKNOWN_DEPTH * tolerance,
            least_gap_off_patch: 2.0 * tolerance,
        }
    }

    /// Configurations looked at so far.
    pub fn looked(&self) -> u64 {
        self.looked.get()
    }

    /// Before a look at the step from its beginning to its end: a smooth hull touches first where the plan says, and is followed from
    /// there. Where it nearly touches in two places, a guess from the end of the look before would lead to the other one, and its
    /// way from there to the place where it touches would count as slip.
    fn begin(&self) {
        self.last_normal.set(self.planned[0]);
    }

    fn object_from_link(&self, t: f64) -> Matrix4<f64> {
        self.looked.set(self.looked.get() + 1);
        let link = self.finger.path.world_from_link(&self.motion.joints_at(t));
        self.motion.object_at(t).inverse().to_homogeneous() * link
    }

    /// Where the tip touches, and the normal there, in the object frame.
    pub fn contact(&self, t: f64) -> Option<(Point, Vector)> {
        self.touch(&self.object_from_link(t)).map(|touch| (touch.foot, touch.normal))
    }

    /// The tip over the surface with its link at `object_from_link`.
    ///
    /// For a ball the foot is that of its centre. For an ellipsoid the foot is sought from a point inside it, below the point
    /// of the tip that faces the normal, until the normal from that foot is the same.
    fn touch(&self, object_from_link: &Matrix4<f64>) -> Option<Touch> {
        let center = object_from_link.transform_point(&self.finger.center);
        let foot = self.patch.foot(&center)?;
        let mut touch = Touch { foot, normal: (center - foot).try_normalize(1e-9)?, gap: f64::INFINITY };
        if let TipSurface::Smooth(smooth) = &self.finger.surface {
            let turn: Matrix3<f64> = object_from_link.fixed_view::<3, 3>(0, 0).into();
            let [from, to] = self.planned;
            let guesses: Vec<Vector> =
                self.last_normal.get().into_iter().chain(from).chain(to).chain([touch.normal]).collect();
            let place = smooth_touch::Place { patch: &self.patch, smooth, center, turn, proofs: &self.proofs };
            let found = place.touch(&guesses, self.slack)?;
            self.last_normal.set(Some(found.normal));
            return found.gap.is_finite().then_some(found);
        }
        let Some([sharpest, flattest]) = self.finger.surface.curvature_radii() else {
            touch.gap = (center - foot).norm() - self.finger.radius;
            return touch.gap.is_finite().then_some(touch);
        };
        let inward = 0.5 * (sharpest + flattest);
        let turn = object_from_link.fixed_view::<3, 3>(0, 0);
        for _ in 0..MOST_TOUCH_STEPS {
            let facing = object_from_link.transform_point(&self.finger.point_facing(&-turn.tr_mul(&touch.normal)));
            let inside = facing + touch.normal * inward;
            let foot = self.patch.foot(&inside)?;
            let normal = (inside - foot).try_normalize(1e-9)?;
            let settled = (normal - touch.normal).norm() < 1e-12;
            touch = Touch { foot, normal, gap: (facing - foot).dot(&normal) };
            if settled {
                return touch.gap.is_finite().then_some(touch);
            }
        }
        None
    }

    /// The gap where no touch is found: the least there can be where no surface is near, else infinite.
    fn gap_without_touch(&self) -> f64 {
        if self.patch.is_empty() { self.least_gap_off_patch } else { f64::INFINITY }
    }

    /// The largest distance of the tip from the surface, either side, and when. When it is below `tolerance`, it is so at every
    /// moment: a ball's distance changes no faster than its centre moves, and that strays from the chord of an interval `h` by
    /// at most acceleration `h^2 / 8`; an ellipsoid's no faster than any of its points moves. Where this cannot be shown, the
    /// answer is above the tolerance.
    pub fn off_surface(&self, tolerance: f64) -> (f64, f64) {
        let mut worst = (0.0, 0.0);
        let mut known = |t: f64| {
            let link = self.object_from_link(t);
            let center = link.transform_point(&self.finger.center);
            let gap = self.touch(&link).map_or(self.gap_without_touch(), |touch| touch.gap);
            if gap.abs() > worst.0 {
                worst = (gap.abs(), t);
            }
            (t, center, gap)
        };
        let mut pending = vec![(known(0.0), known(1.0))];
        while let Some((from, to)) = pending.pop() {
            if self.looked() > MOST_LOOKED {
                return (f64::INFINITY, from.0);
            }
            let span = to.0 - from.0;
            let (way, stray) = match &self.finger.surface {
                TipSurface::Ball => ((to.1 - from.1).norm(), self.acceleration * span * span / 8.0),
                TipSurface::Ellipsoid { .. } | TipSurface::Smooth(_) => (self.speed * span, 0.0),
            };
            let most = 0.5 * ((from.2 + to.2).abs() + way) + stray;
            if most <= tolerance || from.2.abs().max(to.2.abs()) > tolerance {
                continue;
            }
            if way + 2.0 * stray < SMALLEST_PIECE * tolerance {
                return (most, from.0);
            }
            let middle = known(0.5 * (from.0 + to.0));
            pending.push((middle, to));
            pending.push((from, middle));
        }
        worst
    }

    /// How far the fingertip slides over the object, in metres: the length of the integral, over the step, of the velocity
    /// of the touching point of the link, seen from the object and across the normal. What stays unknown is added: at
    /// most `unknown`, unless 128 pieces are too few for that. Infinite where no surface is near.
    pub fn slip(&self, unknown: f64) -> f64 {
        slip(self.sliding(|_| unknown))
    }

    /// The integral of which [`Roll::slip`] is the length, in the object frame, and how much may be unknown of it: no more than
    /// `allowed` says, unless 128 pieces are too few for that. None where no surface is near.
    pub fn sliding(&self, allowed: impl Fn(&Vector) -> f64) -> Option<(Vector, f64)> {
        let object_from_link = |t: f64| self.object_from_link(t);
        let touching = |link: &Matrix4<f64>| {
            let normal = self.touch(link)?.normal;
            Some((self.finger.point_facing(&-link.fixed_view::<3, 3>(0, 0).tr_mul(&normal)), normal))
        };
        let slide_in = |n_pieces| {
            self.begin();
            slide(&object_from_link, &touching, n_pieces)
        };
        integral(slide_in, allowed)
    }

    /// Slip of the step, of a round fingertip whose touching point slides so far.
    pub fn step_slip(&self, finger: &FingerModel, slide: f64) -> StepSlip {
        let torsion_radius = torsion_radius(finger);
        let twist = match torsion_radius > 0.0 {
            true => torsion_radius * self.turning().map_or(f64::INFINITY, |turning| turning.twist),
            false => 0.0,
        };
        StepSlip { slide, twist, travel: self.travel() }
    }

    /// How far the contact travels over the object, by chords of half a step; zero where no surface is near.
    pub fn travel(&self) -> f64 {
        self.begin();
        let [start, middle, end] = [0.0, 0.5, 1.0].map(|t| self.contact(t).map(|(point, _)| point));
        let chord = |a: Option<Point>, b: Option<Point>| a.zip(b).map_or(0.0, |(a, b)| (b - a).norm());
        chord(start, middle) + chord(middle, end)
    }

    /// As [`FingerModel::off_pad`] at `t`, where the object's outward normal is `normal`, in the object frame.
    pub fn off_pad(&self, t: f64, normal: &Vector) -> Option<(f64, f64)> {
        self.finger.faces_off_pad(&-self.object_from_link(t).fixed_view::<3, 3>(0, 0).tr_mul(normal))
    }

    /// Size of the link's turn over the object about `normal`, in the object frame, from the step's beginning to its end.
    pub fn turn_about(&self, normal: &Vector) -> f64 {
        turn_between(&self.object_from_link(0.0), &self.object_from_link(1.0)).dot(normal).abs()
    }

    /// How the link turns over the object; none where no surface is near.
    pub fn turning(&self) -> Option<Turning> {
        self.begin();
        let mut turning = Turning::default();
        let first = self.object_from_link(0.0);
        let mut before = first;
        for k in 0..TURN_PIECES {
            let at = |halves: usize| (2 * k + halves) as f64 / (2 * TURN_PIECES) as f64;
            let normal = self.touch(&self.object_from_link(at(1)))?.normal;
            let after = self.object_from_link(at(2));
            let turn = turn_between(&before, &after);
            let about = turn.dot(&normal);
            turning.all += turn.norm();
            turning.twist += about.abs();
            turning.roll += (turn - normal * about).norm();
            before = after;
        }
        turning.whole = turn_between(&first, &before);
        Some(turning)
    }
}

/// How the link of a fingertip turns in a step, seen from the object, in radians.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Turning {
    /// Rotation vector from the beginning to the end, in the object frame.
    pub whole: Vector,
    /// Integral of the angular speed: nothing cancels.
    pub all: f64,
    /// Integral of the angular speed about the contact's normal.
    pub twist: f64,
    /// Integral of the angular speed across it.
    pub roll: f64,
}

fn turn_between(before: &Matrix4<f64>, after: &Matrix4<f64>) -> Vector {
    let turn = after.fixed_view::<3, 3>(0, 0) * before.fixed_view::<3, 3>(0, 0).transpose();
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn)).scaled_axis()
}

/// Length of an integral with what is unknown of it; infinite without one.
fn slip(integral: Option<(Vector, f64)>) -> f64 {
    integral.map_or(f64::INFINITY, |(way, unknown)| way.norm() + unknown)
}

/// The integral that `slide_in` approximates in so many pieces, and what may be unknown of it; none where it gives none.
///
/// Sums of ever finer pieces are compared until what they extrapolate to changes by at most what is allowed, or there are
/// [`MOST_PIECES`]. The change is what is unknown.
fn integral(slide_in: impl Fn(usize) -> Option<Vector>, allowed: impl Fn(&Vector) -> f64) -> Option<(Vector, f64)> {
    // The error of the midpoint rule is a series in the square of the pieces' length: its first term cancels.
    let extrapolated = |coarse: &Vector, fine: &Vector| fine + (fine - coarse) / 3.0;
    let mut n_pieces = 2;
    let (first, mut fine) = (slide_in(1)?, slide_in(2)?);
    let mut best = extrapolated(&first, &fine);
    loop {
        n_pieces *= 2;
        let finer = slide_in(n_pieces)?;
        let better = extrapolated(&fine, &finer);
        let difference = (better - best).norm();
        if difference <= allowed(&better) || n_pieces >= MOST_PIECES {
            return difference.is_finite().then_some((better, difference));
        }
        (fine, best) = (finer, better);
    }
}

/// Which point of a link touches, in its frame, and the normal there, in the object frame, with the link where it is given.
type Touching<'a> = dyn Fn(&Matrix4<f64>) -> Option<(Point, Vector)> + 'a;

/// The integral of the sliding velocity of a tip that `object_from_link` carries from 0 to 1; none where nothing touches.
/// In each of `n_pieces` pieces the point that touches half-way is carried from the beginning of the piece to its end: the
/// midpoint rule, whose error falls with the square of the number of pieces.
fn slide(object_from_link: &dyn Fn(f64) -> Matrix4<f64>, touching: &Touching, n_pieces: usize) -> Option<Vector> {
    let mut sum = Vector::zeros();
    let mut before = object_from_link(0.0);
    for k in 0..n_pieces {
        let at = |halves: usize| (2 * k + halves) as f64 / (2 * n_pieces) as f64;
        let (middle, after) = (object_from_link(at(1)), object_from_link(at(2)));
        let (touching, normal) = touching(&middle)?;
        let way = after.transform_point(&touching) - before.transform_point(&touching);
        sum += way - normal * normal.dot(&way);
        before = after;
    }
    Some(sum)
}

#[cfg(test)]
mod folds_tests;
#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Translation3;

    const RADIUS: f64 = 0.006;
    const UNKNOWN: f64 = 1e-9;

    fn carried(center: Vector, turn: Vector) -> Matrix4<f64> {
        Translation3::from(center).to_homogeneous() * Rotation3::new(turn).to_homogeneous()
    }

    /// What touches of a ball about the link's origin, over a surface with this normal below its centre.
    fn ball_on(normal: &dyn Fn(&Point) -> Option<Vector>) -> impl Fn(&Matrix4<f64>) -> Option<(Point, Vector)> {
        |link| {
            let normal = normal(&link.transform_point(&Point::origin()))?;
            Some((Point::from(-link.fixed_view::<3, 3>(0, 0).tr_mul(&normal) * RADIUS), normal))
        }
    }

    fn slip_of(motion: &dyn Fn(f64) -> Matrix4<f64>, normal: &dyn Fn(&Point) -> Option<Vector>) -> f64 {
        slip(integral(|n_pieces| slide(motion, &ball_on(normal), n_pieces), |_| UNKNOWN))
    }

    fn up(_: &Point) -> Option<Vector> {
        Some(Vector::z())
    }

    #[test]
    fn a_ball_that_rolls_on_a_plane_slips_by_what_it_goes_too_far() {
        for (turn, too_far) in [(1.5, 0.0), (-0.4, 0.0), (0.7, 0.2e-3), (0.3, -1e-3), (0.0, 0.5e-3)] {
            let way = RADIUS * turn + too_far;
            let motion = |t: f64| carried(Vector::new(way * t, 0.0, RADIUS), Vector::y() * turn * t);
            assert!((slip_of(&motion, &up) - f64::abs(too_far)).abs() < 1e-8, "{turn} {too_far}");
        }
    }

    #[test]
    fn spinning_about_the_normal_is_no_slip_and_pivoting_is() {
        let spin = |t: f64| carried(Vector::z() * RADIUS, Vector::z() * 0.8 * t);
        assert!(slip_of(&spin, &up) < 1e-8);
        // Rolling with spin: a constant angular velocity, the centre goes with its horizontal part.
        let turn = Vector::new(0.5, -0.7, 0.9);
        let rolling = |t: f64| carried(Vector::z() * RADIUS + turn.cross(&Vector::z()) * RADIUS * t, turn * t);
        assert!(slip_of(&rolling, &up) < 1e-8);
        // The centre stands still while the ball turns: the contact slides by the arc.
        let pivot = |t: f64| carried(Vector::z() * RADIUS, Vector::y() * 0.1 * t);
        assert!((slip_of(&pivot, &up) - 0.1 * RADIUS).abs() < 1e-8);
    }

    /// On a sphere of radius `R` the ball turns `(R + r) / r` times as fast as it goes round, in one `-(R - r) / r` times.
    #[test]
    fn balls_roll_on_and_in_spheres() {
        for (sphere, side) in [(0.03, 1.0), (0.012, 1.0), (0.03, -1.0), (0.011, -1.0)] {
            let track = sphere + side * RADIUS;
            let round = 0.4;
            let away = |center: &Point| (center.coords * side).try_normalize(1e-9);
            for wrong in [0.0, 0.05, -0.2] {
                let turn = side * track / RADIUS * round + wrong;
                let motion = |t: f64| {
                    let (sine, cosine) = (round * t).sin_cos();
                    carried(Vector::new(cosine, sine, 0.0) * track, Vector::z() * turn * t)
                };
                // The slip per radian is the ball's radius; it turns with the contact frame, so its sum is a chord.
                let expected = RADIUS * f64::abs(wrong) * (0.5 * round).sin() / (0.5 * round);
                let found = slip_of(&motion, &away);
                assert!((found - expected).abs() < 2e-8, "{sphere} {side} {wrong}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_error_falls_with_the_square_of_the_pieces() {
        // A ball that rolls unevenly on a plane: nothing slides.
        let turn = |t: f64| 2.0 * t + 0.8 * (3.0 * t).sin();
        let motion = |t: f64| carried(Vector::new(RADIUS * turn(t), 0.0, RADIUS), Vector::y() * turn(t));
        let error = |n_pieces| slide(&motion, &ball_on(&up), n_pieces).unwrap().norm();
        for n_pieces in [8, 16, 32, 64] {
            let order = (error(n_pieces) / error(2 * n_pieces)).log2();
            assert!((order - 2.0).abs() < 0.15, "{n_pieces}: {order}");
        }
    }

    #[test]
    fn turns_are_those_of_their_axes() {
        let turn = Vector::new(0.3, -0.2, 0.5);
        let [start, end] = [0.0, 1.0].map(|t| carried(Vector::z(), turn * t));
        assert!((turn_between(&start, &end) - turn).norm() < 1e-12);
        // The rotation vector is that of the way from one to the other, in the fixed frame.
        let before = carried(Vector::x(), Vector::new(0.1, 0.7, -0.4));
        let after = carried(Vector::zeros(), turn) * before;
        assert!((turn_between(&before, &after) - turn).norm() < 1e-12);
    }
}
