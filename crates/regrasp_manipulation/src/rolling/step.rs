//! Fingertips that roll on the object while it moves (Sahbani 2007, sec. IV-C).
//!
//! The tip is a ball or an ellipsoid that is part of the last link, so it turns as the link does, and the contact travels on
//! both surfaces. Joints are sought that leave no slip over a step, by the rules of `regrasp_grasp::contact::rolling` and
//! `rolling_ellipsoid`.

use crate::model::{FingerModel, Model};
use crate::rolling::follow::ik_settings;
use crate::tolerances::SLIP_TOLERANCE;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::frame::tangents;
use regrasp_geometry::surface::{Surface, SurfacePoint};
use regrasp_geometry::{Point, UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_grasp::contact::rolling::{Ball, Touch, slip, turn_between};
use regrasp_grasp::contact::rolling_ellipsoid;
use regrasp_grasp::contact::rolling_ellipsoid::Stance;
use regrasp_robot::kinematics::body_frame::BodyFrame;
use regrasp_robot::kinematics::finger_ik::{Asked, AskedTurn, Coordinates, IkSettings, Preference};
use regrasp_robot::tip::CurvedTip;

/// Slip that one step may leave: segments have up to some hundred steps, and parts of a step hide some of it.
const STEP_SLIP: f64 = 0.002 * SLIP_TOLERANCE;

/// Turn about the normal that one step of a soft fingertip may leave, in radians.
pub const STEP_SPIN: f64 = 2e-5;

/// Parts of a step over which slip is summed: on meshes the ball tips over edges between triangles. By measurement on
/// allegro/apple_x, where two parts leave 62 um over a segment.
const PARTS: usize = 2;
const PARTS_ON_MESH: usize = 6;
/// Parts at most where they are halved until the sum settles, and the change, as a share of the slip allowed, at which it has:
/// the next change is a quarter of it.
const MOST_PARTS: usize = 32;
const SETTLED: f64 = 1.0;

/// How much deeper than where it touches a tip may lie in the object elsewhere, in metres: where it is deeper, nobody knows which of
/// the two places holds.
const DEEPER: f64 = 8e-5;
/// Tilts of the normal, in two directions across it, from which other touches are sought.
const ASIDE: [(f64, f64); 8] =
    [(0.06, 0.0), (-0.06, 0.0), (0.0, 0.06), (0.0, -0.06), (0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2)];

/// Share of the way to the preferred direction that one step of a redundant finger takes: less than where contacts are
/// fixed, as the tip rolls with it.
const PREFERENCE_WEIGHT: f64 = 0.2;
/// What joints' ways for that direction cost. Undamped, a finger whose tip hardly turns towards it swings a joint to and fro by 0.3 rad a
/// step. Measured on 105 motions of an Allegro hand: undamped 86 are solved, with 0.1 90 and transfers reverse often, with 1 95 and none
/// does. Shorter ways by a bound as a share of the way to the contact solve as many, but contacts wander to the sides of the tips: replays
/// lose twice as many.
const PREFERENCE_DAMPING: f64 = 1.0;

/// How far off the end of a coarse step may be, in metres: little beside what a finger reaches, which is all that is asked there.
const COARSE: f64 = 1e-5;

/// Corrections of a step by the slip seen over its halves.
const CORRECTIONS: usize = 3;

/// A fingertip on the object.
#[derive(Debug, Clone)]
pub struct Rolled {
    /// Its contact.
    pub contact: Contact,
    /// The same point, as the surface knows it.
    pub foot: SurfacePoint,
    /// Joints of the finger.
    pub joints: Coordinates,
    /// Turn of the tip over the object about the normal, in radians; of soft fingertips only.
    pub spin: f64,
    /// Contact halfway, where a fine step looked at it.
    pub halfway: Option<Contact>,
}

impl Rolled {
    /// True where the contact keeps off edges after a roll from `before`, as [`Model::may_roll`] says.
    pub fn keeps_off_edges(&self, model: &Model, before: &Contact) -> bool {
        model.may_roll(before, &self.foot)
    }
}

/// A fingertip near the surface, seen from the object.
#[derive(Debug, Clone, Copy)]
struct Touching {
    stance: Stance,
    foot: SurfacePoint,
    /// Distance of the tip from the surface, negative when it presses in.
    gap: f64,
}

impl Touching {
    fn near(&self) -> Near {
        Near { normal: self.stance.normal, foot: Some(self.foot.point_in_object) }
    }

    fn contact(&self) -> Contact {
        let normal_in_object = UnitVector::new_unchecked(self.stance.normal);
        Contact { point_in_object: self.foot.point_in_object, normal_in_object }
    }
}

/// Where a touch is sought.
#[derive(Debug, Clone, Copy)]
struct Near {
    /// A guess of its normal, in the object frame.
    normal: Vector,
    /// A point of the surface near by, where one is known.
    foot: Option<Point>,
}

/// What is left of a motion when rolling is taken off.
#[derive(Debug, Clone, Copy, Default)]
struct Slipped {
    /// Contact halfway, where it was looked at.
    halfway: Option<Contact>,
    /// How far the tip slid over the object, in the object frame.
    way: Vector,
    /// How far it turned about the normal, in radians; of soft fingertips only.
    spin: f64,
}

/// The step that a rolling fingertip makes while the object moves from `from` to `to`, both world from object.
#[derive(Debug, Clone, Copy)]
pub struct RollStep<'a> {
    model: &'a Model<'a>,
    finger: usize,
    start: Stance,
    /// Where it touches at the start.
    foot: Point,
    joints: &'a Coordinates,
    to: &'a Placement,
}

impl<'a> RollStep<'a> {
    /// The step of `finger`, which touches at `contact` with `joints`.
    pub fn new(
        model: &'a Model<'a>,
        finger: usize,
        contact: &Contact,
        joints: &'a Coordinates,
        from: &Placement,
        to: &'a Placement,
    ) -> Self {
        let of_hand = &model.fingers[finger];
        let normal = contact.normal_in_object.into_inner();
        let link = of_hand.ik.chain().last_frame(joints);
        let object_from_link = from.rotation.tr_mul(&link.rotation);
        let center = match of_hand.curved {
            None => contact.point_in_object + normal * of_hand.tip_radius,
            Some(_) => from.point_to_child(&link.point(of_hand.ik.center_in_body())),
        };
        RollStep {
            model,
            finger,
            start: Stance { center, object_from_link, normal },
            foot: contact.point_in_object,
            joints,
            to,
        }
    }

    /// What is asked of the joints; a redundant finger may also turn towards the inward normal.
    fn settings(&self, max_step: f64) -> IkSettings {
        let normal = UnitVector::new_unchecked(self.to.vector(&self.start.normal));
        let settings = ik_settings(self.model, self.finger, normal);
        let preference = settings.preference.map(|preference| Preference {
            weight: PREFERENCE_WEIGHT,
            damping: PREFERENCE_DAMPING,
            ..preference
        });
        IkSettings { preference, max_step, ..settings }
    }

    /// Where the tip is, with the link at `link` and the object at `object`; where it may be nearly flat, near where it touched
    /// last.
    fn touch(&self, link: &BodyFrame, object: &Placement, last: &Near) -> Option<Touching> {
        let finger = &self.model.fingers[self.finger];
        let start = Near { normal: self.start.normal, foot: None };
        let near = if matches!(finger.curved, Some(CurvedTip::Smooth(_))) { last } else { &start };
        finger.touch(&self.model.view.object.surface, link, object, near)
    }

    /// Where it touches at the start.
    fn first(&self) -> Near {
        Near { normal: self.start.normal, foot: Some(self.foot) }
    }

    /// Turn of the tip over the object about the normal from one stance to the other.
    fn spin(&self, from: &Stance, to: &Stance) -> f64 {
        if !self.model.resists_spin(self.finger) {
            return 0.0;
        }
        turn_between(&from.object_from_link, &to.object_from_link).dot(&(from.normal + to.normal).normalize())
    }

    fn slip(&self, from: &Stance, to: &Stance) -> Vector {
        let finger = &self.model.fingers[self.finger];
        match finger.curved {
            Some(tip) => rolling_ellipsoid::slip(tip, from, to),
            None => {
                let turn = turn_between(&from.object_from_link, &to.object_from_link);
                let ball = |at: &Stance| Ball { center: at.center, normal: at.normal };
                slip(finger.tip_radius, &ball(from), &ball(to), &turn)
            }
        }
    }

    /// Joints without slip at the end of the step, by the midpoint rule, less what is known of its error. Soft fingertips
    /// with a joint to spare also turn along with the object. The end may be off by `tolerance`, in metres, or by
    /// what the inverse kinematics allow where that is more.
    fn solve(&self, near: &Coordinates, (settings, tolerance): (&IkSettings, f64), error: &Slipped) -> Option<Rolled> {
        let finger = &self.model.fingers[self.finger];
        let turns_along = self.model.resists_spin(self.finger) && finger.ik.is_redundant();
        let mut end: Option<Touching> = None;
        let first = self.first();
        let asked = |link: &BodyFrame| {
            let touch = self.touch(link, self.to, &end.as_ref().map_or(first, Touching::near))?;
            let normal = touch.stance.normal;
            let slipped = self.slip(&self.start, &touch.stance) + error.way;
            let mut off = slipped - normal * normal.dot(&slipped) + normal * touch.gap;
            if off.norm() < tolerance {
                off = Vector::zeros();
            }
            end = Some(touch);
            let arm = match finger.curved {
                None => -self.to.vector(&(normal * finger.tip_radius)),
                Some(_) => finger.arm(link, &self.to.vector(&normal)),
            };
            let turn = turns_along.then(|| AskedTurn {
                axis: self.to.vector(&normal),
                left: -self.spin(&self.start, &touch.stance) - error.spin,
            });
            Some(Asked { error: -self.to.vector(&off), arm, travel: None, turn })
        };
        let joints = finger.ik.follow(near, settings, asked)?;
        let end = end.filter(|end: &Touching| {
            finger.pad.is_none_or(|pad| pad.holds(&-end.stance.object_from_link.tr_mul(&end.stance.normal)))
        })?;
        let spin = self.spin(&self.start, &end.stance);
        Some(Rolled { contact: end.contact(), foot: end.foot, joints, spin, halfway: None })
    }

    /// The end of a long step, for looking ahead: no look at what happens half-way.
    pub fn coarse(&self, max_step: f64) -> Option<Rolled> {
        self.solve(self.joints, (&self.settings(max_step), COARSE), &Slipped::default())
    }

    /// The end of the step; `between` places the object at a share of it. The tip may leave the surface by `allowed` on the
    /// way.
    pub fn fine(&self, between: impl Fn(f64) -> Placement, allowed: f64) -> Result<Rolled, NoStep> {
        let mut settings = self.settings(self.model.settings.joint_step);
        let is_soft = self.model.resists_spin(self.finger);
        let turns_along = is_soft && self.model.fingers[self.finger].ik.is_redundant();
        let mut error = Slipped::default();
        let mut end = self.solve(self.joints, (&settings, 0.0), &error).ok_or(NoStep::OutOfReach)?;
        // Corrections change the step by little: nothing else is to change.
        settings.preference = None;
        for correction in 0..=CORRECTIONS {
            let left = self.slip_over_parts(&end, &between, allowed).ok_or(NoStep::TooLong)?;
            if left.way.norm() <= STEP_SLIP && (!turns_along || left.spin.abs() <= STEP_SPIN) {
                if self.is_deeper_elsewhere(&end) {
                    return Err(NoStep::OutOfReach);
                }
                return Ok(Rolled { spin: left.spin, halfway: left.halfway, ..end });
            }
            if correction < CORRECTIONS {
                error.way += left.way;
                error.spin += left.spin;
                end = self.solve(&end.joints, (&settings, 0.0), &error).ok_or(NoStep::OutOfReach)?;
            }
        }
        Err(NoStep::TooLong)
    }

    /// True where a tip that may be nearly flat, on a mesh that may have dents, is found to lie deeper in the object at another
    /// place than where it touches: its other touches are sought from normals aside.
    fn is_deeper_elsewhere(&self, end: &Rolled) -> bool {
        let finger = &self.model.fingers[self.finger];
        let surface = &self.model.view.object.surface;
        if surface.mesh().is_none() || !matches!(finger.curved, Some(CurvedTip::Smooth(_))) {
            return false;
        }
        let normal = end.contact.normal_in_object;
        let link = finger.ik.chain().last_frame(&end.joints);
        let (x, y) = tangents(&normal);
        ASIDE.iter().any(|&(along_x, along_y)| {
            let normal = (normal.as_ref() + x.as_ref() * along_x + y.as_ref() * along_y).normalize();
            let near = Near { normal, foot: Some(end.foot.point_in_object) };
            self.touch(&link, self.to, &near).is_some_and(|touch| touch.gap < -DEEPER)
        })
    }

    /// Slip over parts of the step, while the joints move linearly: what the rule over the whole of it leaves out. None where
    /// the tip is farther from the surface than `allowed`, or deeper, or touches outside its pad, at the end of a part.
    ///
    /// Where the tip may be nearly flat the parts are halved until the sum settles: contacts sweep over such faces.
    fn slip_over_parts(&self, end: &Rolled, between: &impl Fn(f64) -> Placement, allowed: f64) -> Option<Slipped> {
        let usual = if self.model.view.object.surface.mesh().is_some() { PARTS_ON_MESH } else { PARTS };
        let mut touches = Vec::new();
        let mut sum = self.slip_over(end, between, allowed, (usual, &mut touches))?;
        if !matches!(self.model.fingers[self.finger].curved, Some(CurvedTip::Smooth(_))) {
            return Some(sum);
        }
        let mut n_parts = usual;
        while n_parts < MOST_PARTS {
            n_parts *= 2;
            let finer = self.slip_over(end, between, allowed, (n_parts, &mut touches))?;
            let change = finer.way - sum.way;
            sum = finer;
            if change.norm() <= SETTLED * STEP_SLIP {
                return Some(sum);
            }
        }
        None
    }

    /// The same over so many parts, an even number. `touches` are those between half as many parts, if any, then between these.
    fn slip_over(
        &self,
        end: &Rolled,
        between: &impl Fn(f64) -> Placement,
        allowed: f64,
        (n_parts, touches): (usize, &mut Vec<Touching>),
    ) -> Option<Slipped> {
        let finger = &self.model.fingers[self.finger];
        let chain = finger.ik.chain();
        let (mut before, mut last_near) = (self.start, self.first());
        let mut halfway = None;
        let mut sum = Slipped::default();
        let mut add = |from: &Stance, to: &Stance| {
            sum.way += self.slip(from, to);
            sum.spin += self.spin(from, to);
        };
        let coarser = std::mem::take(touches);
        for k in 1..n_parts {
            let known = if k % 2 == 0 { coarser.get(k / 2 - 1) } else { None };
            let t = k as f64 / n_parts as f64;
            let touch = match known {
                Some(touch) => *touch,
                None => {
                    let joints: Coordinates =
                        self.joints.iter().zip(&end.joints).map(|(a, b)| a + t * (b - a)).collect();
                    self.touch(&chain.last_frame(&joints), &between(t), &last_near)?
                }
            };
            let facing = -touch.stance.object_from_link.tr_mul(&touch.stance.normal);
            if touch.gap.abs() > allowed || finger.pad.is_some_and(|pad| !pad.holds(&facing)) {
                return None;
            }
            if 2 * k == n_parts {
                halfway = Some(touch.contact());
            }
            add(&before, &touch.stance);
            (before, last_near) = (touch.stance, touch.near());
            touches.push(touch);
        }
        let last = RollStep::new(self.model, self.finger, &end.contact, &end.joints, self.to, self.to).start;
        add(&before, &last);
        Some(Slipped { halfway, ..sum })
    }
}

impl FingerModel<'_> {
    /// Where the tip is over the object's surface, with the link at `link` and the object at `object`; the touch of tips that are
    /// no balls is sought near `last`.
    #[inline]
    fn touch(&self, surface: &Surface, link: &BodyFrame, object: &Placement, last: &Near) -> Option<Touching> {
        let center = object.point_to_child(&link.point(self.ik.center_in_body()));
        let object_from_link = object.rotation.tr_mul(&link.rotation);
        match self.curved {
            None => {
                let touch = Touch::of(surface, &center)?;
                let stance = Stance { center, object_from_link, normal: touch.ball.normal };
                Some(Touching { stance, foot: touch.foot, gap: touch.distance - self.tip_radius })
            }
            Some(tip) => {
                let stance = Stance { center, object_from_link, normal: last.normal };
                let touch = rolling_ellipsoid::Touch::near(surface, tip, &stance, last.foot.as_ref())?;
                Some(Touching { stance: touch.stance, foot: touch.foot, gap: touch.gap })
            }
        }
    }

    /// The contact that the tip has as it stands, on its own surface, and its distance from the object's, negative inside.
    pub fn contact_at(&self, surface: &Surface, joints: &[f64], object: &Placement) -> Option<(Contact, f64)> {
        let link = self.ik.chain().last_frame(joints);
        let center = object.point_to_child(&link.point(self.ik.center_in_body()));
        let (foot, distance) = surface.project_signed(&center);
        let away = UnitVector::try_new(center - foot.point_in_object, 1e-6).filter(|_| self.tip_radius > 0.0);
        let normal_in_object = away.unwrap_or(foot.normal_in_object);
        if self.curved.is_none() {
            let point_in_object = center - normal_in_object.into_inner() * self.tip_radius;
            return Some((Contact { point_in_object, normal_in_object }, distance - self.tip_radius));
        }
        let near = Near { normal: normal_in_object.into_inner(), foot: Some(foot.point_in_object) };
        let touching = self.touch(surface, &link, object, &near)?;
        let mut contact = touching.contact();
        contact.point_in_object += touching.stance.normal * touching.gap;
        Some((contact, touching.gap))
    }
}

/// Why a step is not made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoStep {
    /// The finger cannot follow.
    OutOfReach,
    /// It slips, or leaves the surface, on the way: a shorter step may do.
    TooLong,
}
