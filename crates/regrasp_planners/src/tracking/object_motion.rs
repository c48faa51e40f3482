//! How the object moves on fingertips that rest (Cherif 1999, eq. 8 and 9): they stay in contact, on one of them it rolls without
//! sliding, and of its turn the components that are left free are given.
//!
//! With three resting fingertips one component is free, with two of them two. A step is solved to the end, by Newton's method with
//! the Jacobian of its beginning: distances of the balls from the surface, slip by the rule of `contact::rolling`.

use crate::tracking::grasp::{PerFinger, TrackingGrasp};
use nalgebra::{Matrix6, Rotation3, Vector6};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{UnitVector, Vector, frame};
use regrasp_grasp::contact::rolling::{Touch, slip, turn_between};
use regrasp_manipulation::model::Model;

/// Rows of the Jacobian smaller than this share of the largest pivot: the resting fingers do not tell how the object moves.
const DEGENERATE: f64 = 1e-3;
/// Steps of Newton's method.
const MOST_STEPS: usize = 12;
/// Distance from the surface, and slip, that a step may leave, in metres.
const REACHED: f64 = 1e-13;
/// What is left must at least be below this, in metres: where the surface bends, rounding stops the method.
const CLOSE_ENOUGH: f64 = 1e-11;

/// The object on fingertips that rest.
pub struct ObjectMotion<'a> {
    model: &'a Model<'a>,
    grasp: &'a TrackingGrasp,
    /// Fingers that rest.
    resting: &'a [usize],
    /// The one of them that it rolls on.
    rolling: usize,
    /// Tangents of the contact there, in the object frame.
    tangents: [Vector; 2],
    /// Of contact rows, slip rows, and rows of the components of the turn that are given.
    inverse: Matrix6<f64>,
    /// World axes about which the turn is given.
    given: arrayvec::ArrayVec<usize, 3>,
}

impl<'a> ObjectMotion<'a> {
    /// Of the fingers `resting`, of which the object rolls on `rolling`; of its turn the largest components of `wanted`, in the
    /// world, are given. None where that tells no motion.
    pub fn new(
        model: &'a Model<'a>,
        grasp: &'a TrackingGrasp,
        resting: &'a [usize],
        rolling: usize,
        wanted: &Vector,
    ) -> Option<Self> {
        let normal = UnitVector::new_unchecked(grasp.touches[rolling].ball.normal);
        let (x, y) = frame::tangents(&normal);
        let tangents = [x.into_inner(), y.into_inner()];
        let object = &grasp.world_from_object;
        // Lengths in units of the object's size, so that the six columns are of a kind.
        let size = model.frame.torque_scale;
        let mut rows: arrayvec::ArrayVec<[f64; 6], 6> = arrayvec::ArrayVec::new();
        let mut along = |finger: usize, direction: &Vector| {
            let contact = object.vector(&grasp.touches[finger].foot.point_in_object.coords);
            let (direction, moment) = (object.vector(direction), contact.cross(&object.vector(direction)) / size);
            rows.push([-direction.x, -direction.y, -direction.z, -moment.x, -moment.y, -moment.z]);
        };
        for &finger in resting {
            along(finger, &grasp.touches[finger].ball.normal);
        }
        tangents.iter().for_each(|tangent| along(rolling, tangent));
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| wanted[b].abs().total_cmp(&wanted[a].abs()));
        let n_given = 6usize.checked_sub(rows.len())?;
        // Cherif 1999 fixes the largest component, and another where that tells nothing.
        let choices: &[&[usize]] = match n_given {
            1 => &[&[0], &[1], &[2]],
            2 => &[&[0, 1], &[0, 2], &[1, 2]],
            3 => &[&[0, 1, 2]],
            _ => return None,
        };
        for choice in choices {
            let mut jacobian = Matrix6::zeros();
            for (row, entries) in rows.iter().enumerate() {
                jacobian.row_mut(row).copy_from_slice(entries);
            }
            let given: arrayvec::ArrayVec<usize, 3> = choice.iter().map(|&place| order[place]).collect();
            for (k, axis) in given.iter().enumerate() {
                jacobian[(rows.len() + k, 3 + axis)] = 1.0;
            }
            let lu = jacobian.lu();
            let pivots = lu.u().diagonal().abs();
            if pivots.min() > DEGENERATE * pivots.max()
                && let Some(inverse) = lu.try_inverse()
            {
                return Some(ObjectMotion { model, grasp, resting, rolling, tangents, inverse, given });
            }
        }
        None
    }

    /// The motion to first order of which the given components of the turn are those of `wanted`: of the object's origin, and its
    /// turn, both in the world.
    pub fn twist(&self, wanted: &Vector) -> (Vector, Vector) {
        let size = self.model.frame.torque_scale;
        let mut right = Vector6::zeros();
        for (k, &axis) in self.given.iter().enumerate() {
            right[6 - self.given.len() + k] = wanted[axis] * size;
        }
        let solution = self.inverse * right;
        let turn = Vector::new(solution[3], solution[4], solution[5]) / size;
        (Vector::new(solution[0], solution[1], solution[2]), turn)
    }

    /// The object at the end of a step in which the given components of its turn, in the world, are those of `turn`, and where
    /// the resting fingertips then touch. None where there is no such step.
    pub fn step(&self, turn: &Vector) -> Option<(Placement, PerFinger<Touch>)> {
        let size = self.model.frame.torque_scale;
        let from = &self.grasp.world_from_object;
        let n = self.resting.len();
        let mut solution = Vector6::zeros();
        let mut before = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let angle = Vector::new(solution[3], solution[4], solution[5]) / size;
            let rotation = Rotation3::new(angle).into_inner() * from.rotation;
            let shift = Vector::new(solution[0], solution[1], solution[2]);
            let object = Placement { rotation, translation: from.translation + shift };
            let mut residual = Vector6::zeros();
            let mut touches = PerFinger::new();
            for (row, &finger) in self.resting.iter().enumerate() {
                let of_model = &self.model.fingers[finger];
                let center = self.grasp.world_from_link[finger].point(of_model.ik.center_in_body());
                let touch = Touch::of(&self.model.view.object.surface, &object.point_to_child(&center))?;
                residual[row] = touch.distance - of_model.tip_radius;
                if finger == self.rolling {
                    let start = &self.grasp.touches[finger];
                    let turned = turn_between(&from.rotation.transpose(), &object.rotation.transpose());
                    let slipped = slip(of_model.tip_radius, &start.ball, &touch.ball, &turned);
                    residual[n] = slipped.dot(&self.tangents[0]);
                    residual[n + 1] = slipped.dot(&self.tangents[1]);
                }
                touches.push(touch);
            }
            for (k, &axis) in self.given.iter().enumerate() {
                residual[6 - self.given.len() + k] = (angle[axis] - turn[axis]) * size;
            }
            let left = residual.amax();
            if left < REACHED || (left < CLOSE_ENOUGH && left >= 0.5 * before) {
                return Some((object, touches));
            }
            before = left;
            solution -= self.inverse * residual;
            if !solution.iter().all(|x| x.abs() < size) {
                return None;
            }
        }
        None
    }
}
