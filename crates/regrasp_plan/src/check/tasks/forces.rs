//! Contact forces of the hands that hold.
//!
//! At every waypoint of a segment in which hands hold, every contact has a force in its cone (with the friction that the plan counts on) and in
//! the promised range, and no joint of a finger needs more torque than the robot allows.
//!
//! - Where the object rests and no support holds it, forces and weight balance within `force_tolerance` and `moment_tolerance`, at
//!   waypoints and therefore on the straight lines between them.
//! - Where a support holds it too, what is missing is what a support can give: it pushes, with friction at most that of the object, at a
//!   point inside what touches. Such forces are a convex cone, so that the lines between waypoints keep it too.
//! - Where a hand carries it, forces and weight give the centre of mass its acceleration, within `force_tolerance`. Accelerations jump at
//!   waypoints: any between the one before and the one after will do, and at both ends of a segment, where everything is at rest, also
//!   any between zero and the one inside. Moments may leave what turns the object itself, of those accelerations.
//! - Between waypoints of a carry forces are interpolated on straight lines. What they leave of the motion's forces and moments (those that
//!   turn the object included) is at most the share `MOST_CORRECTION` of the sum of normal forces (moments over the torque scale), and
//!   the contacts take it: the least-norm correction of their forces stays in the cones of the object's own friction, pushes, and keeps
//!   the scene's limit of normal forces and the torques of the robot. So there are forces at these moments that do exactly what the motion
//!   asks for. Steps are looked at in `PIECES` pieces.
//!
//! The weight of the fingers, and friction in their joints, are left out.

use crate::check::closure::{HeldBody, grasp_map, right_inverse};
use crate::check::kinematics::DrivenAxis;
use crate::check::level::Level;
use crate::check::robots::motion::RobotStep;
use crate::check::tasks::contacts::{contact_of, finger_of, held_body};
use crate::check::tasks::holders::Phase;
use crate::check::tasks::motion::BodyMotion;
use crate::check::tasks::rest::{Hold, hold_at};
use crate::check::tasks::room::Room;
use crate::check::tasks::standing::{foot_of, inside};
use crate::check::tasks::task::Task;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log, Report};
use crate::robot_plan::{RobotPlan, RobotSegment, RobotWaypoint};
use nalgebra::{DVector, Matrix3};
use regrasp_geometry::frame::tangents;
use regrasp_geometry::mass::solid_properties;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::{Contact, ContactModel, Grip};

/// Pieces in which a step of a carry is looked at.
pub const PIECES: usize = 8;
/// What forces may leave between waypoints of a carry, as a share of the sum of all normal forces.
pub const MOST_CORRECTION: f64 = 0.2;
/// Torques may be above their limits by this share: rounding.
const TORQUE_ROUNDING: f64 = 1e-6;

/// What one finger exerts on the object, in the object frame.
#[derive(Debug, Clone)]
struct Exerted {
    /// Index in [`Task::hands`].
    hand: usize,
    finger: usize,
    contact: Contact,
    force: Vector,
    torsion: f64,
}

impl Exerted {
    fn pressing(&self) -> f64 {
        -self.force.dot(&self.contact.normal_in_object)
    }

    fn tangential(&self) -> Vector {
        self.force + self.contact.normal_in_object.into_inner() * self.pressing()
    }
}

/// Force and moment about the centre of mass, in the world.
#[derive(Debug, Clone, Copy)]
struct Wrench {
    force: Vector,
    moment: Vector,
}

/// What a motion asks for.
#[derive(Debug, Clone, Copy)]
struct Demand {
    /// Force of all contacts, in the world: what accelerates the centre of mass, less the weight.
    force: Vector,
    /// Moment that turns the object itself, in the world.
    turning: Vector,
}

/// Judges forces of the whole plan.
pub fn check_forces(
    (task, room): (&Task, &Room),
    (phases, holds): (&[Phase], &[Hold]),
    plan: &RobotPlan,
    settings: &CheckSettings,
    (log, report): (&mut Log, &mut Report),
) {
    let body = held_body(task);
    let judge = Judge { task, room, body, inertia: inertia_of(task), settings };
    for (s, (phase, segment)) in phases.iter().zip(&plan.segments).enumerate() {
        // Those of a transfer or regrasp are judged with it (`in_hand`).
        if phase.hands().next().is_none() || phase.kind.is_in_hand() {
            continue;
        }
        let mut known: Vec<Option<Vec<Exerted>>> = Vec::new();
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let at = Moment::at(s, w);
            let exerted = judge.exerted(waypoint, at, log);
            if let Some(exerted) = &exerted {
                for one in exerted {
                    judge.check_contact(one, at, log);
                }
                judge.check_torques(waypoint.joints.as_slice(), &waypoint_pose(waypoint), exerted, at, log);
            }
            known.push(exerted);
        }
        let hold = phase.carrier().and_then(|hand| hold_at(holds, hand, s));
        match hold {
            Some(hold) => judge.check_carry(hold, segment, &known, s, (log, report)),
            None => {
                for (w, (waypoint, exerted)) in segment.waypoints.iter().zip(&known).enumerate() {
                    let Some(exerted) = exerted else { continue };
                    judge.check_rest(phase, waypoint, exerted, Moment::at(s, w), (log, report));
                }
            }
        }
    }
}

fn waypoint_pose(waypoint: &RobotWaypoint) -> Pose {
    Pose::from(&waypoint.world_from_objects[0])
}

/// Inertia about the centre of mass, in the object frame: of an even solid, or of a ball around the object where it is none.
fn inertia_of(task: &Task) -> Matrix3<f64> {
    let object = task.object;
    match solid_properties(object.solid()) {
        Ok(solid) if solid.volume > 0.0 => solid.inertia_per_density * (object.mass / solid.volume),
        _ => Matrix3::identity() * (object.mass * object.radius * object.radius),
    }
}

struct Judge<'a> {
    task: &'a Task<'a>,
    room: &'a Room<'a>,
    body: HeldBody,
    inertia: Matrix3<f64>,
    settings: &'a CheckSettings,
}

impl Judge<'_> {
    /// What every finger exerts; none, and a violation, where a force is missing.
    fn exerted(&self, waypoint: &RobotWaypoint, at: Moment, log: &mut Log) -> Option<Vec<Exerted>> {
        let mut exerted = Vec::new();
        for contact in &waypoint.contacts {
            let hand = self.task.hand_named(&contact.hand)?;
            let finger = finger_of(&self.task.hands[hand], contact)?;
            let Some(force) = contact.force_in_object else {
                let message = format!("finger \"{}/{}\" holds without a force", contact.hand, contact.finger);
                let violation = Violation::new(Kind::ForceMissing, message).when(at).from_level(Level::Forces);
                log.push(violation.subjects([contact.hand.as_str(), contact.finger.as_str()]));
                return None;
            };
            exerted.push(Exerted {
                hand,
                finger,
                contact: contact_of(contact),
                force: Vector::from(force),
                torsion: contact.torsion.unwrap_or(0.0),
            });
        }
        Some(exerted)
    }

    fn names<'a>(&'a self, one: &Exerted) -> [&'a str; 2] {
        let hand = &self.task.hands[one.hand];
        [hand.name.as_str(), hand.fingers[one.finger].name.as_str()]
    }

    fn model(&self, one: &Exerted) -> ContactModel {
        self.task.hands[one.hand].fingers[one.finger].contact
    }

    /// Length of tangential force and torsion over torsion radius; infinite for what is not transmitted.
    fn across(&self, one: &Exerted) -> f64 {
        let tangential = one.tangential().norm();
        match self.model(one) {
            ContactModel::SoftFinger { torsion_radius } => tangential.hypot(one.torsion / torsion_radius),
            _ if one.torsion == 0.0 => tangential,
            _ => f64::INFINITY,
        }
    }

    fn room(&self, one: &Exerted, friction: f64) -> f64 {
        if self.model(one) == ContactModel::Frictionless { 0.0 } else { friction * one.pressing() }
    }

    fn check_contact(&self, one: &Exerted, at: Moment, log: &mut Log) {
        let tolerance = self.settings.force_tolerance;
        let [hand, finger] = self.names(one);
        let mut report = |kind: Kind, message: String, amount: f64, limit: f64| {
            log.push(Violation::new(kind, message).when(at).subjects([hand, finger]).amount(amount, limit));
        };
        let (across, room) = (self.across(one), self.room(one, self.body.friction));
        if !(across <= room + tolerance) {
            let message = format!(
                "finger \"{hand}/{finger}\" exerts {across:.4e} N across the normal (torsion over its radius counted), {room:.4e} N are left by friction"
            );
            report(Kind::ForceOutsideCone, message, across, room);
        }
        let pressing = one.pressing();
        let [least, largest] = self.task.promises.normal_force;
        if !(pressing >= least - tolerance && pressing <= largest + tolerance) {
            let message =
                format!("finger \"{hand}/{finger}\" presses with {pressing:.6} N, not {least} to {largest} N");
            report(Kind::NormalForceOutOfRange, message, pressing, if pressing < least { least } else { largest });
        }
    }

    /// Work of the contact forces per unit of every coordinate of the fingers, against the robot's limits. True where they are kept.
    fn check_torques(&self, joints: &[f64], pose: &Pose, exerted: &[Exerted], at: Moment, log: &mut Log) -> bool {
        let mut work = vec![0.0; joints.len()];
        for one in exerted {
            let hand = &self.task.hands[one.hand];
            let finger = &hand.fingers[one.finger];
            let normal = one.contact.normal_in_object.into_inner();
            let point = finger.touching_in_world(joints, &(pose * normal));
            let (force, couple) = (pose * one.force, pose * (normal * one.torsion));
            let of_hand = |axis: &DrivenAxis| hand.joints.contains(&axis.coordinate);
            for axis in finger.path.axes(joints).iter().filter(|axis| of_hand(axis)) {
                work[axis.coordinate] += axis.work(&force, &point, &couple);
            }
        }
        let robot = self.task.question.robot;
        let mut is_kept = true;
        for (k, torque) in work.into_iter().enumerate().filter(|(_, torque)| *torque != 0.0) {
            let joint = &robot.robot.joints[robot.layout.coordinates[k].joint.0];
            let Some(effort) = joint.limits.and_then(|limits| limits.effort) else { continue };
            if !(torque.abs() <= effort * (1.0 + TORQUE_ROUNDING)) {
                is_kept = false;
                let name = joint.name.as_str();
                let message =
                    format!("joint \"{name}\" needs torque {:.4}, the robot allows {effort:.4}", torque.abs());
                log.push(
                    Violation::new(Kind::TorqueLimit, message).when(at).subjects([name]).amount(torque.abs(), effort),
                );
            }
        }
        is_kept
    }

    /// Sum of all contact forces, and of moments about the centre of mass, in the world.
    fn sum(&self, exerted: &[Exerted], pose: &Pose) -> Wrench {
        let mut sum = Wrench { force: Vector::zeros(), moment: Vector::zeros() };
        for one in exerted {
            sum.force += one.force;
            sum.moment += (one.contact.point_in_object - self.task.object.center_of_mass).cross(&one.force);
            sum.moment += one.contact.normal_in_object.into_inner() * one.torsion;
        }
        Wrench { force: pose * sum.force, moment: pose * sum.moment }
    }

    fn weight(&self) -> Vector {
        self.task.gravity * self.task.object.mass
    }

    fn unbalanced(&self, (force, moment): (f64, f64), what: &str, at: Moment, (log, report): (&mut Log, &mut Report)) {
        report.max_force_residual = Some(report.max_force_residual.map_or(force, |most| most.max(force)));
        report.max_moment_residual = Some(report.max_moment_residual.map_or(moment, |most| most.max(moment)));
        let CheckSettings { force_tolerance, moment_tolerance, .. } = *self.settings;
        if !(force <= force_tolerance && moment <= moment_tolerance) {
            let message = format!("{what} leave {force:.3e} N and {moment:.3e} N m");
            let violation = Violation::new(Kind::ForceUnbalanced, message).when(at).subjects(["object"]);
            log.push(match force <= force_tolerance {
                false => violation.amount(force, force_tolerance),
                true => violation.amount(moment, moment_tolerance),
            });
        }
    }

    fn check_rest(
        &self,
        phase: &Phase,
        waypoint: &RobotWaypoint,
        exerted: &[Exerted],
        at: Moment,
        (log, report): (&mut Log, &mut Report),
    ) {
        let pose = waypoint_pose(waypoint);
        let sum = self.sum(exerted, &pose);
        let missing = Wrench { force: -(sum.force + self.weight()), moment: -sum.moment };
        match phase.supports().next() {
            None => {
                let left = (missing.force.norm(), missing.moment.norm());
                self.unbalanced(left, "forces and weight", at, (log, report));
            }
            Some(support) => {
                if let Some(fault) = self.beyond_support(support, &pose, &missing) {
                    let name = self.task.scene.supports[support].body.name.as_str();
                    let message = format!("\"{name}\" cannot give what forces and weight leave: {fault}");
                    log.push(Violation::new(Kind::ForceUnbalanced, message).when(at).subjects(["object", name]));
                }
            }
        }
    }

    /// Why a support cannot give a wrench to an object that stands on it; none where it can.
    fn beyond_support(&self, support: usize, pose: &Pose, needed: &Wrench) -> Option<String> {
        let CheckSettings { force_tolerance, moment_tolerance, .. } = *self.settings;
        let plane = self.room.plane();
        let touching = self.room.touching(support, pose);
        let center = pose * self.task.object.center_of_mass;
        let foot = foot_of(&center, &touching, plane);
        let pushing = needed.force.dot(&plane.up);
        let along = needed.force - plane.up * pushing;
        if pushing <= force_tolerance {
            let (force, moment) = (needed.force.norm(), needed.moment.norm());
            let is_nothing = pushing >= -force_tolerance && force <= 2.0 * force_tolerance;
            // A push too small to be told from none turns as little.
            let reach = self.task.object.radius * 2.0 * force_tolerance;
            return (!(is_nothing && moment <= moment_tolerance + reach))
                .then(|| format!("a pull of {:.3e} N, with a moment of {moment:.3e} N m", -pushing));
        }
        let friction = self.task.object.friction * pushing + force_tolerance;
        if !(along.norm() <= friction) {
            return Some(format!("{:.3e} N along its top, friction gives {friction:.3e} N", along.norm()));
        }
        // Where it pushes: d from the foot of the centre of mass, which is r = foot - center away. The moment of its force about
        // the centre is (r + d) x force; across `up` that is r x along + d x up pushing.
        let arm = foot - center;
        let across = needed.moment - arm.cross(&along);
        let d = plane.up.cross(&(across - plane.up * across.dot(&plane.up))) / pushing;
        let place = foot + d;
        let room = inside(&touching, &place, plane);
        let slack = moment_tolerance / pushing + 1e-6;
        if !(room >= -slack) {
            return Some(format!("a push {:.2} mm beside what touches", -1e3 * room));
        }
        let spin = (across - d.cross(&along)).dot(&plane.up);
        let reach = touching.iter().map(|p| (p - place).norm()).fold(0.0, f64::max);
        let most = self.task.object.friction * pushing * reach + moment_tolerance;
        (!(spin.abs() <= most)).then(|| format!("a moment of {spin:.3e} N m about its normal"))
    }

    /// What a motion asks for at a moment of a step.
    fn demand(&self, hold: &Hold, step: &RobotStep, u: f64) -> (Pose, Demand) {
        let motion = BodyMotion::of(&self.task.question.tree, self.task.hands[hold.hand].body, step, u);
        let frame = motion.frame.then(&hold.body_from_object);
        let center = frame.point(&self.task.object.center_of_mass);
        let inertia = frame.rotation * self.inertia * frame.rotation.transpose();
        let turning = inertia * motion.spin_rate + motion.spin.cross(&(inertia * motion.spin));
        let force = motion.acceleration_of(&center) * self.task.object.mass - self.weight();
        (frame.pose(), Demand { force, turning })
    }

    fn check_carry(
        &self,
        hold: &Hold,
        segment: &RobotSegment,
        known: &[Option<Vec<Exerted>>],
        s: usize,
        (log, report): (&mut Log, &mut Report),
    ) {
        let steps: Vec<RobotStep> =
            segment.waypoints.windows(2).map(|pair| RobotStep::new(&pair[0], &pair[1])).collect();
        let still = Demand { force: -self.weight(), turning: Vector::zeros() };
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let Some(exerted) = &known[w] else { continue };
            let before = w.checked_sub(1).map_or(still, |before| self.demand(hold, &steps[before], 1.0).1);
            let after = steps.get(w).map_or(still, |step| self.demand(hold, step, 0.0).1);
            let sum = self.sum(exerted, &waypoint_pose(waypoint));
            let force = distance_to_segment(&sum.force, &before.force, &after.force);
            let turning = before.turning.norm().max(after.turning.norm());
            let moment = (sum.moment.norm() - turning).max(0.0);
            let what = "forces, weight and what accelerates the object";
            self.unbalanced((force, moment), what, Moment::at(s, w), (log, report));
        }
        for (w, step) in steps.iter().enumerate() {
            let (Some(from), Some(to)) = (&known[w], &known[w + 1]) else { continue };
            if !log.work.spend(PIECES as u64, "forces between waypoints") {
                return;
            }
            for piece in 0..=PIECES {
                let u = piece as f64 / PIECES as f64;
                let at = Moment { segment: s, waypoint: w, fraction: u.min(1.0 - 1e-9) };
                let (pose, demand) = self.demand(hold, step, u);
                let exerted = between(from, to, u);
                let share = self.check_corrected(&exerted, &pose, &demand, (step, u), (at, log));
                let Some(share) = share else { break };
                report.max_half_way_imbalance =
                    Some(report.max_half_way_imbalance.map_or(share, |most| most.max(share)));
            }
        }
    }

    /// Judges that the contacts take what their forces leave; None where they do not, else its share of all normal forces.
    fn check_corrected(
        &self,
        exerted: &[Exerted],
        pose: &Pose,
        demand: &Demand,
        (step, u): (&RobotStep, f64),
        (at, log): (Moment, &mut Log),
    ) -> Option<f64> {
        let sum = self.sum(exerted, pose);
        let (force, moment) = (demand.force - sum.force, demand.turning - sum.moment);
        let pressing: f64 = exerted.iter().map(Exerted::pressing).sum();
        let share = force.norm().hypot(moment.norm() / self.body.torque_scale) / pressing.max(1e-9);
        let mut report = |kind: Kind, message: String, (amount, limit): (f64, f64)| {
            log.push(Violation::new(kind, message).when(at).subjects(["object"]).amount(amount, limit));
            None
        };
        if !(share <= MOST_CORRECTION) {
            let message = format!(
                "between waypoints forces, weight and inertia leave {:.3e} N and {:.3e} N m",
                force.norm(),
                moment.norm()
            );
            return report(Kind::ForceUnbalanced, message, (share, MOST_CORRECTION));
        }
        let grip = |one: &Exerted| Grip { contact: one.contact, model: self.model(one) };
        let grips: Vec<Grip> = exerted.iter().map(grip).collect();
        let (map, cones) = grasp_map(&grips, &self.body);
        let Some(inverse) = right_inverse(&map) else {
            return report(Kind::ForceUnbalanced, "the contacts cannot balance every force".into(), (f64::NAN, 0.0));
        };
        let (force, moment) = (pose.rotation.inverse() * force, pose.rotation.inverse() * moment);
        let moment = moment / self.body.torque_scale;
        let needed = DVector::from_iterator(6, force.iter().chain(moment.iter()).copied());
        let answer = inverse * needed;
        let (tolerance, most) = (self.settings.force_tolerance, self.task.scene.limits.normal_force);
        let mut corrected = exerted.to_vec();
        for (one, cone) in corrected.iter_mut().zip(&cones) {
            let normal = one.contact.normal_in_object;
            let (x, y) = tangents(&normal);
            let coordinates = answer.rows(cone.start, cone.len());
            one.force -= normal.into_inner() * coordinates[0];
            if cone.len() >= 3 {
                one.force += x.into_inner() * coordinates[1] + y.into_inner() * coordinates[2];
            }
            if let (4, ContactModel::SoftFinger { torsion_radius }) = (cone.len(), self.model(one)) {
                one.torsion += torsion_radius * coordinates[3];
            }
            let [hand, finger] = self.names(one);
            let (across, pressing) = (self.across(one), one.pressing());
            let room = self.room(one, self.task.object.friction);
            if !(across <= room + tolerance) {
                let message = format!(
                    "between waypoints finger \"{hand}/{finger}\" has to exert {across:.4e} N across the normal, friction gives {room:.4e} N"
                );
                return report(Kind::ForceOutsideCone, message, (across, room));
            }
            if !(pressing >= -tolerance && pressing <= most + tolerance) {
                let message = format!(
                    "between waypoints finger \"{hand}/{finger}\" has to press with {pressing:.4} N, not 0 to {most} N"
                );
                return report(Kind::NormalForceOutOfRange, message, (pressing, most));
            }
        }
        let mut joints = Vec::new();
        step.joints_at(u, &mut joints);
        self.check_torques(&joints, pose, &corrected, at, log).then_some(share)
    }
}

/// Distance of a point from the line between two others.
fn distance_to_segment(point: &Vector, from: &Vector, to: &Vector) -> f64 {
    let [point, from, to] = [point, from, to].map(|v| Point::from(*v));
    if (to - from).norm_squared() == 0.0 {
        return (point - from).norm();
    }
    crate::check::surface::distance_to_edge(&point, &from, &to)
}

/// Forces on the straight line from one waypoint to the next; of contacts that only one has, those of the first.
fn between(from: &[Exerted], to: &[Exerted], u: f64) -> Vec<Exerted> {
    let of = |one: &Exerted| {
        let other = to.iter().find(|other| (other.hand, other.finger) == (one.hand, one.finger)).unwrap_or(one);
        let force = one.force * (1.0 - u) + other.force * u;
        Exerted { force, torsion: one.torsion * (1.0 - u) + other.torsion * u, ..one.clone() }
    };
    from.iter().map(of).collect()
}
