//! A hand on its way to a grasp, in the object frame, and whether it meets something.

use crate::way::between;
use nalgebra::Translation3;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::collision::gjk::{Placed, Separation, separation};
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_grasp::list::ListedGrasp;
use regrasp_manipulation::grasp::state::HandJoints;
use regrasp_manipulation::model::{Carrier, Model};
use regrasp_robot::Hand;

/// Bodies keep this distance, in metres.
const CLEARANCE: f64 = 2e-4;
/// Halvings of a motion after which what is not decided counts as a collision.
const MOST_HALVINGS: u32 = 12;

/// A convex body at its place in the object frame.
#[derive(Debug, Clone)]
pub struct Standing<'a> {
    shape: &'a Shape,
    at: Placement,
    center: Point,
    radius: f64,
}

impl<'a> Standing<'a> {
    /// A shape that is convex, or is taken as its hull.
    pub fn new(shape: &'a Shape, at: Placement) -> Self {
        let (center, radius) = shape.bounding_sphere();
        Standing { shape, center: at.point(&center), at, radius }
    }
}

/// The way of a hand to a grasp: from 0 to 1 the open hand comes on its line, from 1 to 2 it closes.
pub struct Way<'a> {
    model: &'a Model<'a>,
    object_from_hand: Pose,
    line: Vector,
    open: HandJoints,
    closed: HandJoints,
}

impl<'a> Way<'a> {
    /// The way to a grasp of a list.
    pub fn new(hand: &Hand, model: &'a Model<'a>, grasp: &ListedGrasp) -> Self {
        let split = |flat: &[f64]| -> HandJoints {
            let mut rest = flat.iter().copied();
            hand.fingers.iter().map(|finger| rest.by_ref().take(finger.chain.n_coordinates()).collect()).collect()
        };
        Way {
            model,
            object_from_hand: Pose::from(&grasp.object_from_hand),
            line: Vector::from(grasp.approach.direction_in_object) * grasp.approach.distance,
            open: split(&grasp.open_joints),
            closed: split(&grasp.joints),
        }
    }

    /// All bodies of the hand at `moment`.
    pub fn bodies(&self, moment: f64) -> Vec<Standing<'a>> {
        let base = Placement::from(&(Translation3::from(self.line * (moment - 1.0).min(0.0)) * self.object_from_hand));
        let joints = between(&self.open, &self.closed, (moment - 1.0).max(0.0));
        let mut frames: Vec<Vec<Placement>> = Vec::with_capacity(joints.len());
        for (finger, own) in self.model.fingers.iter().zip(&joints) {
            let chain = finger.ik.chain();
            let mut of_finger = vec![Placement::IDENTITY; chain.joints.len()];
            chain.forward_frames(own, &mut of_finger);
            frames.push(of_finger);
        }
        let place = |body: &'a regrasp_manipulation::model::Body| {
            let carrier = match &body.carrier {
                Carrier::Finger { finger, link, .. } => base.then(&frames[*finger][*link]),
                _ => base,
            };
            let at = carrier.then(&body.carrier_from_body);
            Standing { shape: &body.shape, center: at.point(&body.center), radius: body.radius, at }
        };
        self.model.bodies[..self.model.object].iter().map(place).collect()
    }

    /// How far a body moves at most between two moments of one part of the way.
    fn motion(&self, body: usize, from: f64, to: f64) -> f64 {
        if to <= 1.0 {
            return self.line.norm() * (to - from);
        }
        match &self.model.bodies[body].carrier {
            Carrier::Finger { finger, bound, .. } => {
                let change: Vec<f64> = self.open[*finger]
                    .iter()
                    .zip(&self.closed[*finger])
                    .map(|(a, b)| (b - a).abs() * (to - from))
                    .collect();
                bound.first_order(&change)
            }
            _ => 0.0,
        }
    }

    /// True when the hand meets none of `others` on its whole way.
    pub fn avoids(&self, others: &[Standing]) -> bool {
        let n_bodies = self.model.object;
        let all: Vec<(usize, usize)> =
            (0..n_bodies).flat_map(|body| (0..others.len()).map(move |other| (body, other))).collect();
        [(0.0, 1.0), (1.0, 2.0)]
            .into_iter()
            .all(|(from, to)| self.avoids_between(others, &all, [from, to], MOST_HALVINGS))
    }

    fn avoids_between(
        &self,
        others: &[Standing],
        pairs: &[(usize, usize)],
        [from, to]: [f64; 2],
        halvings: u32,
    ) -> bool {
        let middle = 0.5 * (from + to);
        let bodies = self.bodies(middle);
        let mut left = Vec::new();
        for &(body, other) in pairs {
            let moves = self.motion(body, from, to) * 0.5;
            match apart(&bodies[body], &others[other], CLEARANCE + moves) {
                true => {}
                false if halvings > 0 && apart(&bodies[body], &others[other], CLEARANCE) => left.push((body, other)),
                false => return false,
            }
        }
        left.is_empty()
            || (self.avoids_between(others, &left, [from, middle], halvings - 1)
                && self.avoids_between(others, &left, [middle, to], halvings - 1))
    }
}

/// True when all of some bodies are apart from all others.
pub fn are_apart(some: &[Standing], others: &[Standing]) -> bool {
    some.iter().all(|one| others.iter().all(|other| apart(one, other, CLEARANCE)))
}

/// True when two bodies are at least `required` apart: by their balls, else by a direction that separates them.
fn apart(one: &Standing, other: &Standing, required: f64) -> bool {
    if (one.center - other.center).norm() - one.radius - other.radius >= required {
        return true;
    }
    let (a, b) = (Placed { shape: one.shape, at: &one.at }, Placed { shape: other.shape, at: &other.at });
    let mut direction = other.center - one.center;
    matches!(separation(a, b, required, required, &mut direction, &mut [0; 2]), Separation::SeparatedBy(_))
}
