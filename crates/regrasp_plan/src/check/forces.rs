//! Contact forces and joint torques, by substitution, as `docs/reference/plan-format.md` (forces) asks.
//!
//! Forces are those of the fingers on the object, in the object frame; moments are about its centre of mass. Tolerances are
//! fields of `CheckSettings`. At every waypoint
//!
//! - forces and weight add up to zero within `force_tolerance`, their moments and torsions within `moment_tolerance`;
//! - the force of a holding finger is in the exact cone of its contact model (`CONVENTIONS.md`) with the friction of
//!   `closure::Body::of`, and its normal part in the promised range, both within `force_tolerance`; the moving finger of a
//!   regrasp exerts nothing, within the first two tolerances;
//! - in tracking, a fingertip that slides has friction of the scene's coefficient times the normal force along its relative
//!   velocity in the plan (which `tracking` holds against the poses), within the share `sliding_force_tolerance`, and no
//!   torsion;
//! - every joint's torque is the work of force and torsion per unit of its coordinate, within the share `torque_tolerance` of
//!   the largest that this work could be, and at most the promised one;
//! - without a direction of gravity there is room for the weight in each (`any_gravity`).
//!
//! Half-way to the next waypoint, at the pose between and with contacts where tips then touch, what is left (torques over
//! the object's radius) is at most the share `half_way_imbalance` of the sum of all normal forces. Where a contact travels far
//! from one waypoint to the next, as under a flat pad that tips over, this is looked at in seven moments between.
//!
//! Between two segments pose and contacts stay and forces change linearly: what balances at both ends balances in between,
//! and cones, largest normal forces and torque limits are convex, so that the ends are all that has to be looked at.
//!
//! Mass, gravity and torque limits of the plan are held against scene and robot.

use crate::check::between::Between;
use crate::check::closure::HeldBody;
use crate::check::kinematics::DrivenAxis;
use crate::check::model::{CheckedHand, FingerModel};
use crate::check::roles::{contact_of, moving_finger};
use crate::check::rolling::Roll;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactState, ForcePromises, Plan, Segment, Waypoint};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::ContactModel;
use regrasp_scene::{Manipulation, Object};

/// Standard gravity, in metres per second squared (CGPM 1901).
pub(super) const GRAVITY: f64 = 9.80665;
/// The promised gravity may be this far from the scene's, and its length from [`GRAVITY`], in metres per second squared:
/// rounding of a direction.
const GRAVITY_TOLERANCE: f64 = 1e-6;
/// Masses, gravities and limits may be off by this much, relatively: rounding.
const ROUNDING: f64 = 1e-9;
/// Torques may be this far off whatever the forces, in newton metres: rounding.
const TORQUE_ROUNDING: f64 = 1e-9;
/// Friction of what slides may be this far off whatever its size, in newtons: rounding.
const SLIDING_ROUNDING: f64 = 1e-12;

/// How well forces balance: the largest residuals of the plan.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Balance {
    /// Of forces at waypoints, in newtons.
    pub force: f64,
    /// Of moments at waypoints, in newton metres.
    pub moment: f64,
    /// Half-way between waypoints, and where contacts travel far at more moments, torques over the torque scale, as a share
    /// of the sum of all normal forces.
    pub half_way: f64,
    /// Of the friction of sliding fingertips, as a share of friction times normal force; none when no finger slides.
    pub sliding: Option<f64>,
}

/// What one finger exerts at one waypoint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exerted {
    pub(super) finger: usize,
    pub(super) point: Point,
    pub(super) normal: Vector,
    pub(super) force: Vector,
    pub(super) torsion: f64,
    /// Where a fingertip slides, seen from the object and across the normal, a unit vector or zero.
    pub(super) slides: Option<Vector>,
}

impl Exerted {
    pub(super) fn pressing(&self) -> f64 {
        -self.force.dot(&self.normal)
    }

    fn tangential(&self) -> f64 {
        (self.force + self.normal * self.pressing()).norm()
    }
}

/// Judges forces and torques of the whole plan; none when it promises no forces, and has none.
pub fn check_forces(
    task: &Manipulation,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) -> Option<Balance> {
    let object = task.object();
    let Some(promises) = &plan.promises.forces else {
        check_absent(plan, log);
        return None;
    };
    check_promises(task, model, promises, log);
    if plan.promises.tracking.is_some() && promises.gravity_in_world.is_none() {
        let message = "gravity of any direction in tracking: friction of what slides has but one";
        log.push(Violation::new(Kind::PromiseBroken, message).subjects(["gravity_in_world"]));
    }
    let judge = Judge { object, body: HeldBody::of(object, plan), model, plan, promises, settings };
    let mut balance = Balance::default();
    for (s, segment) in plan.segments.iter().enumerate() {
        let moving = moving_finger(model, segment);
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let at = Moment::at(s, w);
            let Some(exerted) = judge.exerted(waypoint, at, log) else { continue };
            let (force, moment) = judge.check_balance(waypoint, &exerted, at, log);
            (balance.force, balance.moment) = (balance.force.max(force), balance.moment.max(moment));
            for one in &exerted {
                judge.check_contact(one, moving, at, log);
                if let Some(direction) = one.slides {
                    let full = judge.sliding_friction(&model.fingers[one.finger]) * one.pressing();
                    let share = judge.sliding_error(one, &direction, full) / full.abs().max(SLIDING_ROUNDING);
                    balance.sliding = Some(balance.sliding.map_or(share, |most| most.max(share)));
                }
            }
            judge.check_torques(waypoint, &exerted, at, log);
            if promises.gravity_in_world.is_none() {
                let held: Vec<Exerted> = exerted.into_iter().filter(|one| moving != Some(one.finger)).collect();
                judge.check_room(waypoint, &held, at, log);
            }
        }
        for w in 1..segment.waypoints.len() {
            let half_way = judge.check_between(segment, Moment::at(s, w - 1), log);
            balance.half_way = balance.half_way.max(half_way);
        }
    }
    Some(balance)
}

/// No forces are promised, so there are none.
fn check_absent(plan: &Plan, log: &mut Log) {
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let loaded = |contact: &ContactState| contact.force_in_object.is_some() || contact.torsion.is_some();
            if !waypoint.joint_torques.is_empty() || waypoint.contacts.iter().any(loaded) {
                let message = "forces or torques in a plan that promises none";
                log.push(Violation::new(Kind::ForceMissing, message).when(Moment::at(s, w)));
            }
        }
    }
}

/// Mass, gravity and limits against scene and robot.
pub(super) fn check_promises(task: &Manipulation, model: &CheckedHand, promises: &ForcePromises, log: &mut Log) {
    let object = task.object();
    let mut broken = |name: &str, amount: f64, limit: f64, message: String| {
        log.push(Violation::new(Kind::PromiseBroken, message).subjects([name]).amount(amount, limit));
    };
    if (promises.mass - object.mass).abs() > ROUNDING * object.mass {
        let message = format!("mass {} kg, the scene's object has {} kg", promises.mass, object.mass);
        broken("mass", promises.mass, object.mass, message);
    }
    let promised = promises.gravity_in_world.map(Vector::from);
    let asked = task.scene.gravity().in_world().map(|gravity| gravity.normalize() * GRAVITY);
    let agree = match (promised, asked) {
        (Some(promised), Some(asked)) => (promised - asked).norm() <= GRAVITY_TOLERANCE,
        (promised, asked) => promised.is_none() && asked.is_none(),
    };
    if !agree {
        let message = format!("gravity {}, judged is under {}", in_words(promised), in_words(asked));
        broken("gravity_in_world", f64::NAN, f64::NAN, message);
    }
    if let Some(gravity) = promises.gravity_in_world.map(|gravity| Vector::from(gravity).norm())
        && (gravity - GRAVITY).abs() > GRAVITY_TOLERANCE
    {
        broken("gravity_in_world", gravity, GRAVITY, format!("gravity of {gravity} m/s^2 instead of {GRAVITY}"));
    }
    let [least, largest] = promises.normal_force;
    if !(least >= 0.0 && least <= largest) {
        broken("normal_force", least, largest, format!("normal forces from {least} N to {largest} N"));
    }
    for drive in &model.drives {
        let (Some(coordinate), Some(effort)) = (drive.own_coordinate(), drive.effort) else { continue };
        let promised = promises.joint_torques[coordinate].unwrap_or(f64::INFINITY);
        if promised > effort * (1.0 + ROUNDING) {
            let message = format!("torque {promised} of joint \"{}\", the robot allows {effort}", drive.name);
            broken("joint_torques", promised, effort, message);
        }
    }
    for limit in promises.joint_torques.iter().flatten().filter(|limit| **limit < 0.0) {
        broken("joint_torques", *limit, 0.0, format!("a torque limit of {limit}"));
    }
}

fn in_words(gravity_in_world: Option<Vector>) -> String {
    gravity_in_world.map_or("that of any direction".into(), |g| format!("[{:.4}, {:.4}, {:.4}] m/s^2", g.x, g.y, g.z))
}

/// What everything is judged by.
pub(super) struct Judge<'a> {
    pub(super) object: &'a Object,
    pub(super) body: HeldBody,
    pub(super) model: &'a CheckedHand,
    pub(super) plan: &'a Plan,
    pub(super) promises: &'a ForcePromises,
    pub(super) settings: &'a CheckSettings,
}

impl Judge<'_> {
    /// What every holding finger exerts; none, and a violation, when a force or torque is missing.
    pub(super) fn exerted(&self, waypoint: &Waypoint, at: Moment, log: &mut Log) -> Option<Vec<Exerted>> {
        let mut missing = |what: String| {
            log.push(Violation::new(Kind::ForceMissing, what).when(at));
            None
        };
        if waypoint.joint_torques.len() != self.plan.joint_names.len() {
            return missing(format!("{} joint torques", waypoint.joint_torques.len()));
        }
        let mut exerted = Vec::new();
        for (finger, state) in waypoint.contacts.iter().enumerate() {
            let Some(contact) = contact_of(state) else { continue };
            let Some(force) = state.force_in_object else {
                return missing(format!("finger \"{}\" holds without a force", self.model.fingers[finger].name));
            };
            exerted.push(Exerted {
                finger,
                point: contact.point_in_object,
                normal: contact.normal_in_object.into_inner(),
                force: Vector::from(force),
                torsion: state.torsion.unwrap_or(0.0),
                slides: sliding_direction(state, &contact.normal_in_object),
            });
        }
        Some(exerted)
    }

    /// The object's weight, in the object frame.
    fn weight(&self, world_from_object: &Pose) -> Vector {
        let gravity = self.promises.gravity_in_world.map_or(Vector::zeros(), Vector::from);
        world_from_object.rotation.inverse() * gravity * self.promises.mass
    }

    /// Force, and moment about the centre of mass, that are left when everything is added up.
    fn residual(&self, world_from_object: &Pose, exerted: &[Exerted]) -> (Vector, Vector) {
        let mut sum = (self.weight(world_from_object), Vector::zeros());
        for one in exerted {
            sum.0 += one.force;
            sum.1 += (one.point - self.object.center_of_mass).cross(&one.force) + one.normal * one.torsion;
        }
        sum
    }

    pub(super) fn check_balance(
        &self,
        waypoint: &Waypoint,
        exerted: &[Exerted],
        at: Moment,
        log: &mut Log,
    ) -> (f64, f64) {
        let (force, moment) = self.residual(&Pose::from(&waypoint.world_from_object), exerted);
        let (force, moment) = (force.norm(), moment.norm());
        let CheckSettings { force_tolerance, moment_tolerance, .. } = *self.settings;
        if force > force_tolerance || moment > moment_tolerance {
            let message = format!("forces and weight leave {force:.3e} N and {moment:.3e} N m");
            let violation = Violation::new(Kind::ForceUnbalanced, message).when(at).subjects(["object"]);
            log.push(match force > force_tolerance {
                true => violation.amount(force, force_tolerance),
                false => violation.amount(moment, moment_tolerance),
            });
        }
        (force, moment)
    }

    /// The cone of the finger's contact model, and the range of its normal force.
    pub(super) fn check_contact(&self, one: &Exerted, moving: Option<usize>, at: Moment, log: &mut Log) {
        let finger = &self.model.fingers[one.finger];
        let tolerance = self.settings.force_tolerance;
        let mut report = |kind: Kind, message: String, amount: f64, limit: f64| {
            let violation = Violation::new(kind, message).when(at).subjects([finger.name.as_str()]);
            log.push(violation.amount(amount, limit));
        };
        if moving == Some(one.finger) {
            let size = one.force.norm();
            if size > tolerance || one.torsion.abs() > self.settings.moment_tolerance {
                let message = format!("moving finger \"{}\" presses with {size:.3e} N", finger.name);
                report(Kind::MovingFingerPresses, message, size, tolerance);
            }
            return;
        }
        let pressing = one.pressing();
        let across = self.across(one);
        if let Some(direction) = one.slides {
            let full = self.sliding_friction(finger) * pressing;
            let error = self.sliding_error(one, &direction, full);
            let limit = self.settings.sliding_force_tolerance * full.abs() + SLIDING_ROUNDING;
            if error > limit {
                let message = format!(
                    "finger \"{}\" slides with a force {error:.4e} N off friction of {full:.4e} N along its way",
                    finger.name
                );
                report(Kind::SlidingForceWrong, message, error, limit);
            }
        }
        let room = if finger.contact == ContactModel::Frictionless { 0.0 } else { self.body.friction * pressing };
        if one.slides.is_none() && across > room + tolerance {
            let message = format!(
                "finger \"{}\" exerts {across:.4e} N across the normal (torsion over its radius counted), {room:.4e} N are left by friction",
                finger.name
            );
            report(Kind::ForceOutsideCone, message, across, room);
        }
        let [least, largest] = self.promises.normal_force;
        if pressing < least - tolerance || pressing > largest + tolerance {
            let message =
                format!("finger \"{}\" presses with {pressing:.6} N, not {least} to {largest} N", finger.name);
            report(Kind::NormalForceOutOfRange, message, pressing, if pressing < least { least } else { largest });
        }
    }

    /// The friction coefficient of a fingertip that slides: the scene's, as friction then has its full size.
    fn sliding_friction(&self, finger: &FingerModel) -> f64 {
        if finger.contact == ContactModel::Frictionless { 0.0 } else { self.object.friction }
    }

    /// Length of what a force across the normal has beside friction of the size `full` along `direction`; a torsion, of
    /// which none is left where friction has its full size, counts too.
    fn sliding_error(&self, one: &Exerted, direction: &Vector, full: f64) -> f64 {
        let tangential = one.force + one.normal * one.pressing();
        let torsion = match self.torsion_radius(one) {
            _ if one.torsion == 0.0 => 0.0,
            0.0 => f64::INFINITY,
            radius => one.torsion / radius,
        };
        (tangential - direction * full).norm().hypot(torsion)
    }

    /// The torsion radius of a soft finger; zero where no torsion is transmitted.
    pub(super) fn torsion_radius(&self, one: &Exerted) -> f64 {
        match self.model.fingers[one.finger].contact {
            ContactModel::SoftFinger { torsion_radius } if self.body.friction > 0.0 => torsion_radius,
            _ => 0.0,
        }
    }

    /// Length of tangential force and torsion over torsion radius; infinite for torsion that is not transmitted.
    pub(super) fn across(&self, one: &Exerted) -> f64 {
        match self.torsion_radius(one) {
            _ if one.torsion == 0.0 => one.tangential(),
            0.0 => f64::INFINITY,
            radius => one.tangential().hypot(one.torsion / radius),
        }
    }

    /// As [`torques_of`], for another force and couple at the contact of `one`.
    pub(super) fn torques(
        &self,
        waypoint: &Waypoint,
        one: &Exerted,
        force: &Vector,
        couple: &Vector,
    ) -> Vec<JointWork> {
        torques_of(&self.model.fingers[one.finger], waypoint, &one.normal, force, couple)
    }

    /// Torques by virtual work: a coordinate's is the work of force and torsion per unit of it, over all joints that it
    /// drives. Joints of free fingers make none.
    pub(super) fn check_torques(&self, waypoint: &Waypoint, exerted: &[Exerted], at: Moment, log: &mut Log) {
        let mut expected = vec![0.0; waypoint.joint_torques.len()];
        let mut tolerance = vec![TORQUE_ROUNDING; expected.len()];
        for one in exerted {
            let couple = one.normal * one.torsion;
            for work in self.torques(waypoint, one, &one.force, &couple) {
                expected[work.coordinate] += work.torque;
                tolerance[work.coordinate] += self.settings.torque_tolerance * work.size;
            }
        }
        for (k, name) in self.plan.joint_names.iter().enumerate() {
            let torque = waypoint.joint_torques[k];
            let error = (torque - expected[k]).abs();
            if error > tolerance[k] {
                let message = format!("joint \"{name}\" has torque {torque:.6e}, its forces need {:.6e}", expected[k]);
                let violation = Violation::new(Kind::TorqueWrong, message).when(at);
                log.push(violation.subjects([name.as_str()]).amount(error, tolerance[k]));
            }
            let limit = self.promises.joint_torques[k].unwrap_or(f64::INFINITY);
            if torque.abs() > limit * (1.0 + ROUNDING) + TORQUE_ROUNDING {
                let message = format!("joint \"{name}\" needs torque {torque:.4}, {limit:.4} is allowed");
                let violation = Violation::new(Kind::TorqueLimit, message).when(at);
                log.push(violation.subjects([name.as_str()]).amount(torque.abs(), limit));
            }
        }
    }

    /// What is left between a waypoint and the next, as a share of the sum of all normal forces: half-way, and at more moments where
    /// contacts travel far.
    fn check_between(&self, segment: &Segment, at: Moment, log: &mut Log) -> f64 {
        let (from, to) = (&segment.waypoints[at.waypoint], &segment.waypoints[at.waypoint + 1]);
        let motion = Between::new(from, to);
        let travel =
            |(before, after)| Some((contact_of(after)?.point_in_object - contact_of(before)?.point_in_object).norm());
        let travels_far = from.contacts.iter().zip(&to.contacts).filter_map(travel).any(|travel| travel > FAR_TRAVEL);
        let shares: &[f64] = if travels_far { &[0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875] } else { &[0.5] };
        shares.iter().map(|&share| self.check_when(&motion, (from, to), share, at, log)).fold(0.0, f64::max)
    }

    /// What is left when `share` of the way from a waypoint to the next is made.
    fn check_when(
        &self,
        motion: &Between,
        (from, to): (&Waypoint, &Waypoint),
        share: f64,
        at: Moment,
        log: &mut Log,
    ) -> f64 {
        let moment_between = motion.when(share);
        let mut exerted = Vec::new();
        for (f, (before, after)) in from.contacts.iter().zip(&to.contacts).enumerate() {
            let (Some(first), Some(second)) = (contact_of(before), contact_of(after)) else { continue };
            let mix = |a: Option<[f64; 3]>, b: Option<[f64; 3]>| Some(Vector::from(a?).lerp(&Vector::from(b?), share));
            let Some(force) = mix(before.force_in_object, after.force_in_object) else { return 0.0 };
            let torsion = (1.0 - share) * before.torsion.unwrap_or(0.0) + share * after.torsion.unwrap_or(0.0);
            let (point, normal) = if first == second {
                (first.point_in_object, first.normal_in_object.into_inner())
            } else {
                let tolerance = self.plan.promises.contact_tolerance;
                let roll = Roll::new((f, &self.model.fingers[f]), from, to, &self.model.shape, tolerance);
                let Some(contact) = roll.contact(moment_between) else { continue };
                contact
            };
            exerted.push(Exerted { finger: f, point, normal, force, torsion, slides: None });
        }
        let pressing: f64 = exerted.iter().map(Exerted::pressing).sum();
        let (force, moment) = self.residual(&motion.object_at(moment_between), &exerted);
        // Fingers that do not press leave room for no imbalance, and nothing is divided by zero.
        let left = force.norm().hypot(moment.norm() / self.object.radius) / pressing.max(1e-9);
        let limit = self.settings.half_way_imbalance;
        if left > limit {
            let when = if share == 0.5 { "half-way".to_owned() } else { format!("{share} of the way") };
            let message = format!(
                "{when} to the next waypoint forces and weight leave {:.3e} N and {:.3e} N m",
                force.norm(),
                moment.norm()
            );
            let violation =
                Violation::new(Kind::ForceUnbalanced, message).when(Moment { fraction: moment_between, ..at });
            log.push(violation.subjects(["object"]).amount(left, limit));
        }
        left
    }
}

/// Way of a contact over the object from one waypoint to the next, in metres, from which on it is looked at in more
/// moments than half-way. A flat pad that tips over sweeps over its whole width between two of them.
const FAR_TRAVEL: f64 = 2e-3;

/// Where a fingertip slides by its relative velocity, across `normal`: a unit vector, or zero without one; none in modes
/// that do not slide.
fn sliding_direction(state: &ContactState, normal: &Vector) -> Option<Vector> {
    let velocity = state.relative_velocity_in_object.map_or(Vector::zeros(), Vector::from);
    let across = velocity - normal * normal.dot(&velocity);
    state.mode.slides().then(|| across.try_normalize(0.0).unwrap_or_else(Vector::zeros))
}

/// Work of a joint against a force and a couple of its finger's tip, per unit of the coordinate that drives it.
pub struct JointWork {
    /// Index of the coordinate in the joint vector.
    pub coordinate: usize,
    /// The work, in newton metres, or newtons of a sliding joint.
    pub torque: f64,
    /// The largest that the work of so great a force and couple could be: force times the largest lever arm, and the couple.
    pub size: f64,
}

/// The work of every joint of `finger` when its tip exerts `force` and `couple` where the object's outward normal is
/// `normal`, all three in the object frame. The force acts where the tip touches, one radius from its centre: that is the
/// contact within the contact tolerance.
pub fn torques_of(
    finger: &FingerModel,
    waypoint: &Waypoint,
    normal: &Vector,
    force: &Vector,
    couple: &Vector,
) -> Vec<JointWork> {
    let world_from_object = Pose::from(&waypoint.world_from_object);
    let point = finger.touching_in_world(&waypoint.joints, &(world_from_object * normal));
    let (force, couple) = (world_from_object * force, world_from_object * couple);
    let axes = finger.path.axes(&waypoint.joints);
    let arm = axes.iter().map(|axis| (point - axis.origin).norm()).fold(0.0, f64::max);
    let work = |axis: &DrivenAxis| {
        let size = if axis.slides { force.norm() } else { force.norm() * arm + couple.norm() };
        let torque = axis.work(&force, &point, &couple);
        JointWork { coordinate: axis.coordinate, torque, size: size * axis.multiplier.abs() }
    };
    axes.iter().map(work).collect()
}
