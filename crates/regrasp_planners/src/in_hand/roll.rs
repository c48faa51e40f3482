//! Fingertips that roll on the object while it moves (paper 004, section IV-C).
//!
//! The tip is a ball that is part of the last link, so it turns as the link does, and the contact travels on both surfaces.
//! Joints are sought that leave no slip over a step, by the rule of `regrasp_grasp::contact::rolling`.

use super::model::Model;
use super::record::SLIP_TOLERANCE;
use super::transfer::ik_settings;
use nalgebra::Matrix3;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::surface::SurfacePoint;
use regrasp_geometry::{UnitVector, Vector};
use regrasp_grasp::Contact;
use regrasp_grasp::contact::rolling::{Ball, Touch, slip, turn_between};
use regrasp_robot::kinematics::body_frame::BodyFrame;
use regrasp_robot::kinematics::finger_ik::{Asked, Coordinates, IkSettings, Preference};

/// Slip that one step may leave: segments have up to some hundred steps, and parts of a step hide some of it.
const STEP_SLIP: f64 = 0.002 * SLIP_TOLERANCE;

/// Parts of a step over which slip is summed: on meshes the ball tips over edges between triangles. By measurement on
/// allegro/apple_x, where two parts leave 62 um over a segment.
const PARTS: usize = 2;
const PARTS_ON_MESH: usize = 6;

/// Share of the way to the preferred direction that one step of a redundant finger takes: less than where contacts are
/// fixed, as the tip rolls with it.
const PREFERENCE_WEIGHT: f64 = 0.2;

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
}

impl Rolled {
    /// True where the contact keeps the distance from edges that the scene asks for.
    pub fn keeps_off_edges(&self, model: &Model) -> bool {
        let object = &model.scene.object;
        object.surface.crease_distance(&self.foot) >= object.edge_distance
    }
}

/// The step that a rolling fingertip makes while the object moves from `from` to `to`, both world from object.
#[derive(Debug, Clone, Copy)]
pub struct RollStep<'a> {
    model: &'a Model<'a>,
    finger: usize,
    start: Ball,
    /// Rotation of the last link in the object frame at the start.
    object_from_link: Matrix3<f64>,
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
        let normal = contact.normal_in_object.into_inner();
        let start = Ball { center: contact.point_in_object + normal * model.fingers[finger].tip_radius, normal };
        let link = model.fingers[finger].ik.chain().last_frame(joints);
        RollStep { model, finger, start, object_from_link: from.rotation.tr_mul(&link.rotation), joints, to }
    }

    fn radius(&self) -> f64 {
        self.model.fingers[self.finger].tip_radius
    }

    /// What is asked of the joints; a redundant finger may also turn towards the inward normal.
    fn settings(&self, max_step: f64) -> IkSettings {
        let normal = UnitVector::new_unchecked(self.to.vector(&self.start.normal));
        let settings = ik_settings(self.model, self.finger, normal);
        let preference = settings.preference.map(|preference| Preference { weight: PREFERENCE_WEIGHT, ..preference });
        IkSettings { preference, max_step, ..settings }
    }

    /// Where the ball is, and how far it has turned relative to the object, with the link at `link`.
    fn touch(&self, link: &BodyFrame, object: &Placement) -> Option<(Touch, Matrix3<f64>)> {
        let center = object.point_to_child(&link.point(self.model.fingers[self.finger].ik.center_in_body()));
        let touch = Touch::of(&self.model.scene.object.surface, &center)?;
        Some((touch, object.rotation.tr_mul(&link.rotation)))
    }

    /// Joints without slip at the end of the step, by the midpoint rule, less what is known of its error.
    fn solve(&self, near: &Coordinates, settings: &IkSettings, error: &Vector) -> Option<Rolled> {
        let radius = self.radius();
        let mut end = None;
        let asked = |link: &BodyFrame| {
            let (touch, object_from_link) = self.touch(link, self.to)?;
            let turn = turn_between(&self.object_from_link, &object_from_link);
            let normal = touch.ball.normal;
            let slipped = slip(radius, &self.start, &touch.ball, &turn) + error;
            let off = slipped - normal * normal.dot(&slipped) + normal * (touch.distance - radius);
            end = Some(touch);
            Some(Asked { error: -self.to.vector(&off), arm: -self.to.vector(&(normal * radius)) })
        };
        let joints = self.model.fingers[self.finger].ik.follow(near, settings, asked)?;
        end.map(|touch: Touch| Rolled { contact: touch.contact(), foot: touch.foot, joints })
    }

    /// The end of a long step, for looking ahead: no look at what happens half-way.
    pub fn coarse(&self, max_step: f64) -> Option<Rolled> {
        self.solve(self.joints, &self.settings(max_step), &Vector::zeros())
    }

    /// The end of the step; `between` places the object at a share of it. The tip may leave the surface by `allowed` on the
    /// way.
    pub fn fine(&self, between: impl Fn(f64) -> Placement, allowed: f64) -> Result<Rolled, NoStep> {
        let mut settings = self.settings(self.model.settings.joint_step);
        let mut error = Vector::zeros();
        let mut end = self.solve(self.joints, &settings, &error).ok_or(NoStep::OutOfReach)?;
        // Corrections change the step by little: nothing else is to change.
        settings.preference = None;
        for correction in 0..=CORRECTIONS {
            let left = self.slip_over_parts(&end, &between, allowed).ok_or(NoStep::TooLong)?;
            if left.norm() <= STEP_SLIP {
                return Ok(end);
            }
            if correction < CORRECTIONS {
                error += left;
                end = self.solve(&end.joints, &settings, &error).ok_or(NoStep::OutOfReach)?;
            }
        }
        Err(NoStep::TooLong)
    }

    /// Slip over parts of the step, while the joints move linearly: what the rule over the whole of it leaves out. None where
    /// the tip is farther from the surface than `allowed`, or deeper, at the end of a part.
    fn slip_over_parts(&self, end: &Rolled, between: &impl Fn(f64) -> Placement, allowed: f64) -> Option<Vector> {
        let radius = self.radius();
        let n_parts = if self.model.scene.object.surface.mesh().is_some() { PARTS_ON_MESH } else { PARTS };
        let chain = self.model.fingers[self.finger].ik.chain();
        let (mut ball, mut object_from_link) = (self.start, self.object_from_link);
        let mut sum = Vector::zeros();
        for k in 1..n_parts {
            let t = k as f64 / n_parts as f64;
            let joints: Coordinates = self.joints.iter().zip(&end.joints).map(|(a, b)| a + t * (b - a)).collect();
            let (touch, turned) = self.touch(&chain.last_frame(&joints), &between(t))?;
            if (touch.distance - radius).abs() > allowed {
                return None;
            }
            sum += slip(radius, &ball, &touch.ball, &turn_between(&object_from_link, &turned));
            (ball, object_from_link) = (touch.ball, turned);
        }
        let normal = end.contact.normal_in_object.into_inner();
        let last = Ball { center: end.contact.point_in_object + normal * radius, normal };
        let turned = self.to.rotation.tr_mul(&chain.last_frame(&end.joints).rotation);
        Some(sum + slip(radius, &ball, &last, &turn_between(&object_from_link, &turned)))
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

#[cfg(test)]
mod tests;
