//! Two jaws on antipodal points: a line through the object within the friction cones of both its ends, a sweep of approach angles
//! about it, and the opening of the jaws that fits.

use crate::frames::radical_inverse;
use crate::motors::Motors;
use crate::prepared::Prepared;
use nalgebra::{Matrix2, Rotation3, Translation3, UnitQuaternion, Vector2};
use regrasp_base::Rng;
use regrasp_geometry::frame::tangents;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::grasp::touch::{Gap, contact, gap};

/// Lines are drawn within this share of the angle of friction about the normal: the second contact needs room, too. By hand.
const CONE_SHARE: f64 = 0.8;
/// How far below the surface a line begins, in metres.
const BELOW: f64 = 1e-4;
/// Steps of bisection for the opening.
const HALVINGS: usize = 40;
/// Most steps to the contacts: most take five.
const MOST_STEPS: usize = 24;
/// A step that leaves more than this share of the gaps makes no headway. By hand.
const LEAST_HEADWAY: f64 = 0.6;
/// Differences, in metres and in units of the motor.
const DIFFERENCE: f64 = 1e-6;
/// Gaps below this touch, in metres.
const TOUCHES: f64 = 1e-9;
/// The hand may move along the line by this much, in metres: farther contacts are other ones.
const LARGEST_SHIFT: f64 = 0.01;

/// Where the hand is, and how wide.
pub struct Jaws {
    /// The object in the hand frame.
    pub hand_from_object: Pose,
    /// Position of the motor.
    pub position: f64,
}

/// Joints with the motor at `position`.
pub fn joints_at(motors: &Motors, position: f64) -> HandJoints {
    let mut joints = motors.rest().clone();
    motors.closing[0].put(&mut joints, position);
    joints
}

/// The points of both fingertips that face each other, in the hand frame.
fn facing(prepared: &Prepared, joints: &HandJoints) -> [Point; 2] {
    let models = &prepared.model.fingers;
    let centers = [0, 1].map(|f| models[f].ik.tip(&joints[f]));
    let across = (centers[1] - centers[0]).try_normalize(1e-9).unwrap_or_else(Vector::x);
    [centers[0] + models[0].arm_with(&joints[0], &-across), centers[1] + models[1].arm_with(&joints[1], &across)]
}

/// The hand about an antipodal pair; which one follows from the index of the frame. None where the line leaves the cones, or the
/// jaws are too small or too large for it.
pub fn place(prepared: &Prepared, motors: &Motors, index: u64, rng: &mut Rng) -> Option<Jaws> {
    let surface = &prepared.model.view.object.surface;
    let places = &prepared.surface(0).places;
    let first = places[(index % places.len() as u64) as usize].contact;
    let normal = first.normal_in_object;
    let friction = prepared.model.frame.friction;
    let (x, y) = tangents(&normal);
    let (turn, lean) = (rng.uniform(0.0, std::f64::consts::TAU), friction * CONE_SHARE * rng.unit().sqrt());
    let inward = -normal.into_inner() + (x.into_inner() * turn.cos() + y.into_inner() * turn.sin()) * lean;
    let inward = UnitVector::new_normalize(inward);
    let from = first.point_in_object + inward.into_inner() * BELOW;
    let exits = surface.exits(&from, &inward);
    let second = exits.get(match exits.len() {
        0 => return None,
        n => rng.below(n),
    })?;
    if second.normal_in_object.dot(&inward) < 1.0 / (1.0 + friction * friction).sqrt() {
        return None;
    }
    let width = (second.point_in_object - first.point_in_object).norm();
    let apart = |position: f64| {
        let [a, b] = facing(prepared, &joints_at(motors, position));
        (b - a).norm()
    };
    let motor = &motors.closing[0];
    if !(apart(motor.closed)..apart(motor.open)).contains(&width) {
        return None;
    }
    let (mut wide, mut narrow) = (motor.open, motor.closed);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (wide + narrow);
        if apart(middle) > width { wide = middle } else { narrow = middle }
    }
    let [a, b] = facing(prepared, &joints_at(motors, wide));
    let in_hand = (b - a).try_normalize(1e-9)?;
    let roll = std::f64::consts::TAU * radical_inverse(index + 1, 2);
    let align = Rotation3::rotation_between(&in_hand, &inward).unwrap_or_else(|| {
        Rotation3::from_axis_angle(&tangents(&UnitVector::new_unchecked(in_hand)).0, std::f64::consts::PI)
    });
    let rotation = UnitQuaternion::from_axis_angle(&inward, roll) * UnitQuaternion::from_rotation_matrix(&align);
    let middle = nalgebra::center(&first.point_in_object, &second.point_in_object);
    let shift = middle - rotation * nalgebra::center(&a, &b);
    let object_from_hand = Pose::from_parts(Translation3::from(shift), rotation);
    Some(Jaws { hand_from_object: object_from_hand.inverse(), position: wide })
}

/// The jaws closed: the hand moves along the line between the fingertips until both touch.
pub fn close(prepared: &Prepared, motors: &Motors, jaws: &Jaws) -> Option<GraspState> {
    let motor = &motors.closing[0];
    let [a, b] = facing(prepared, &joints_at(motors, jaws.position));
    let across = (b - a).try_normalize(1e-9)?;
    let pose_at = |shift: f64| Translation3::from(across * shift) * jaws.hand_from_object;
    let gaps_at = |at: &Vector2<f64>| -> [Gap; 2] {
        let (pose, joints) = (pose_at(at.x), joints_at(motors, at.y));
        [0, 1].map(|f| gap(prepared.model, f, &pose, &joints[f]))
    };
    let values = |gaps: &[Gap; 2]| Vector2::new(gaps[0].distance, gaps[1].distance);
    let slopes_at = |at: &Vector2<f64>, value: &Vector2<f64>| {
        let column = |k: usize| {
            let mut other = *at;
            other[k] += DIFFERENCE;
            (values(&gaps_at(&other)) - value) / DIFFERENCE
        };
        Matrix2::from_columns(&[column(0), column(1)])
    };
    let [low, high] = [motor.open.min(motor.closed), motor.open.max(motor.closed)];
    let mut at = Vector2::new(0.0, jaws.position);
    let mut gaps = gaps_at(&at);
    let mut slopes = slopes_at(&at, &values(&gaps));
    let mut are_fresh = true;
    for _ in 0..MOST_STEPS {
        let value = values(&gaps);
        if at.x.abs() > LARGEST_SHIFT || !(low..=high).contains(&at.y) {
            return None;
        }
        if value.amax() <= TOUCHES {
            let (pose, joints) = (pose_at(at.x), joints_at(motors, at.y));
            let held = |f: usize| contact(prepared.model, f, &pose, &joints[f], &gaps[f]);
            let contacts = [held(0)?, held(1)?];
            let fingers = (0..2).map(|f| (Some(contacts[f]), joints[f].clone()));
            return Some(GraspState::of(pose, fingers));
        }
        let step = -(slopes.try_inverse()? * value);
        at += step;
        gaps = gaps_at(&at);
        let change = values(&gaps) - value;
        if values(&gaps).amax() > LEAST_HEADWAY * value.amax() {
            // Fresh slopes that lead nowhere: there is no contact nearby.
            if are_fresh {
                return None;
            }
            slopes = slopes_at(&at, &values(&gaps));
            are_fresh = true;
        } else {
            // Broyden's update (1965): slopes that explain the last step.
            slopes += (change - slopes * step) * step.transpose() / step.norm_squared();
            are_fresh = false;
        }
    }
    None
}
