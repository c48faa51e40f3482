//! The part of a relocation in which the fingertip is in the air: after it has left its contact, before it comes down to another.

use crate::model::Model;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::ops::RangeInclusive;

/// A contact with the line that the tip's centre leaves it along.
#[derive(Debug)]
pub struct End {
    /// Where the tip's centre is in contact.
    foot: Point,
    /// Outward normal of the contact, in the hand's frame.
    pub normal: Vector,
    /// How far from the line it may be, per height: a finger that cannot go straight up leaves at a slant.
    slant: f64,
}

impl End {
    /// `joints` are those of the contact.
    pub fn new(model: &Model, finger: usize, pose: &Pose, contact: &Contact, joints: &Coordinates) -> Self {
        let placement = Placement::from(pose);
        let normal: Vector = placement.vector(&contact.normal_in_object);
        let foot = placement.point(&contact.point_in_object) - model.fingers[finger].arm_with(joints, &normal);
        let slant = if model.fingers[finger].closes() { LARGEST_SLANT } else { 0.0 };
        End { foot, normal, slant }
    }

    /// How far the centre of a tip is above where it is in contact, in metres.
    pub fn height(&self, tip: &Point) -> f64 {
        (tip - self.foot).dot(&self.normal)
    }

    /// True when the centre of a tip is over the contact: straight, or as slanted as it may be.
    fn is_under(&self, tip: &Point) -> bool {
        let arm = tip - self.foot;
        let height = self.height(tip);
        (arm - self.normal * height).norm() < STRAIGHT + self.slant * height.max(0.0) && height > -STRAIGHT
    }
}

/// The ends of a relocation, where they are contacts.
pub fn ends_of(
    model: &Model,
    finger: usize,
    pose: &Pose,
    contacts: [Option<&Contact>; 2],
    path: &[Coordinates],
) -> [Option<End>; 2] {
    let [first, last] = [path.first(), path.last()];
    let end = |contact: Option<&Contact>, joints: Option<&Coordinates>| {
        contact.zip(joints).map(|(contact, joints)| End::new(model, finger, pose, contact, joints))
    };
    [end(contacts[0], first), end(contacts[1], last)]
}

/// From the last joints of `path` that are straight over the contact at its start to the first that are straight over the one at its end. A
/// path that begins or ends free does so in the air. The first is not before the last where the tip stays over both.
pub fn in_air(model: &Model, finger: usize, ends: &[Option<End>; 2], path: &[Coordinates]) -> RangeInclusive<usize> {
    let is_over = |end: &Option<End>, joints: &Coordinates| {
        end.as_ref().is_some_and(|end| end.is_under(&model.fingers[finger].ik.tip(joints)))
    };
    let n_up = path.iter().take_while(|joints| is_over(&ends[0], joints)).count();
    let n_down = path.iter().rev().take_while(|joints| is_over(&ends[1], joints)).count();
    n_up.saturating_sub(1)..=path.len().saturating_sub(n_down.max(1))
}

/// Slant that checks allow a lift: the tangent of 60 degrees.
const LARGEST_SLANT: f64 = 1.732;

/// Distance from the normal that still counts as on it, in metres: far above what solvers leave.
const STRAIGHT: f64 = 1e-5;
