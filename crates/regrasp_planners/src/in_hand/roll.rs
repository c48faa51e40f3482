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

/// Slip that one step may leave: a hundredth of what a segment may.
const STEP_SLIP: f64 = 0.01 * SLIP_TOLERANCE;

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

    /// The end of the step, with the object at `halfway` in its middle. None where the tip would slip or leave the surface
    /// by more than `allowed` in between: a shorter step may do.
    pub fn fine(&self, halfway: &Placement, allowed: f64) -> Result<Rolled, NoStep> {
        let mut settings = self.settings(self.model.settings.joint_step);
        let mut error = Vector::zeros();
        let mut end = self.solve(self.joints, &settings, &error).ok_or(NoStep::OutOfReach)?;
        let ik = self.model.fingers[self.finger].ik;
        // Corrections change the step by little: nothing else is to change.
        settings.preference = None;
        for correction in 0..=CORRECTIONS {
            let middle: Coordinates = self.joints.iter().zip(&end.joints).map(|(a, b)| 0.5 * (a + b)).collect();
            let (touch, object_from_link) =
                self.touch(&ik.chain().last_frame(&middle), halfway).ok_or(NoStep::TooLong)?;
            if (touch.distance - self.radius()).abs() > allowed {
                return Err(NoStep::TooLong);
            }
            let left = self.slip_over_halves(&touch.ball, &object_from_link, &end);
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

    /// Slip over both halves of the step: what the rule over the whole of it leaves out.
    fn slip_over_halves(&self, middle: &Ball, object_from_link: &Matrix3<f64>, end: &Rolled) -> Vector {
        let normal = end.contact.normal_in_object.into_inner();
        let last = Ball { center: end.contact.point_in_object + normal * self.radius(), normal };
        let link = self.model.fingers[self.finger].ik.chain().last_frame(&end.joints);
        let at_end = self.to.rotation.tr_mul(&link.rotation);
        slip(self.radius(), &self.start, middle, &turn_between(&self.object_from_link, object_from_link))
            + slip(self.radius(), middle, &last, &turn_between(object_from_link, &at_end))
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
