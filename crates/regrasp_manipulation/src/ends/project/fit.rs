//! Object and joints moved as little as can be, so that fingertips touch: damped least squares (Buss 2004).

use super::Velocities;
use crate::grasp::state::HandJoints;
use crate::model::Model;
use nalgebra::{DMatrix, DVector, Translation3, UnitQuaternion};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_robot::kinematics::chain::{Chain, JointMotion};

/// Object and joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Posture {
    /// Pose of the object in the hand's frame.
    pub object: Pose,
    /// Joints of all fingers.
    pub joints: HandJoints,
}

/// Steps of the fit: gaps are nearly linear over a millimetre.
const STEPS: usize = 4;
/// Gaps below this, in metres, are closed finger by finger.
const CLOSED: f64 = 2e-5;
/// How far estimates of the object's position are off, in metres: shares the correction between object and joints. By hand.
const OBJECT_DEVIATION: f64 = 3e-4;
/// How far estimates of its orientation are off, in radians. By hand.
const OBJECT_TURN_DEVIATION: f64 = 5e-3;
/// How far joints that turn are off, in radians: encoders are better, but links give. By hand.
pub const TURN_DEVIATION: f64 = 2e-3;
/// How far joints that slide are off, in metres. By hand.
const SLIDE_DEVIATION: f64 = 2e-4;
/// Damping: gaps smaller than this, in metres, are not worth large motions.
const DAMPING: f64 = 1e-5;

/// How far coordinate `k` of a finger may be off.
pub fn deviation(chain: &Chain, k: usize) -> f64 {
    let slides =
        |joint: &&regrasp_robot::kinematics::chain::ChainJoint| joint.drive.terms.iter().any(|(term, _)| *term == k);
    match chain.joints.iter().filter(slides).any(|joint| joint.motion == JointMotion::Slide) {
        true => SLIDE_DEVIATION,
        false => TURN_DEVIATION,
    }
}

/// `pose`, shifted, and turned about its own origin.
pub fn displaced(pose: &Pose, shift: &Vector, turn: &Vector) -> Pose {
    let translation = Translation3::from(pose.translation.vector + shift);
    Pose::from_parts(translation, UnitQuaternion::from_scaled_axis(*turn) * pose.rotation)
}

/// Distance of the tip from the surface, negative inside; None deep inside.
pub fn gap_of(model: &Model, finger: usize, joints: &[f64], object: &Placement) -> Option<f64> {
    model.fingers[finger].contact_at(&model.view.object.surface, joints, object).map(|(_, gap)| gap)
}

/// A fingertip at the object.
struct AtContact {
    gap: f64,
    /// Outward normal of the object, in the hand's frame.
    normal: Vector,
    /// The point of the tip that is nearest, in the hand's frame.
    point: Point,
    /// Its velocity over those of the joints.
    jacobian: nalgebra::Matrix3xX<f64>,
}

fn at_contact(model: &Model, posture: &Posture, finger: usize) -> Option<AtContact> {
    let object = Placement::from(&posture.object);
    let (of_finger, joints) = (&model.fingers[finger], &posture.joints[finger]);
    let (contact, gap) = of_finger.contact_at(&model.view.object.surface, joints, &object)?;
    let normal = object.vector(&contact.normal_in_object);
    let chain = of_finger.ik.chain();
    let point = of_finger.ik.tip(joints) + of_finger.arm_with(joints, &normal);
    let mut frames = Vec::new();
    chain.forward(joints, &mut frames);
    Some(AtContact { gap, normal, point, jacobian: chain.jacobian(&frames, &point) })
}

/// The posture near `start` in which the fingers of `holding` touch, about so.
pub fn fit(model: &Model, start: &Posture, holding: u32) -> Posture {
    let mut posture = start.clone();
    for _ in 0..STEPS {
        let fingers = (0..model.n_fingers()).filter(|f| holding & (1 << f) != 0);
        let touching: Option<Vec<(usize, AtContact)>> =
            fingers.map(|f| at_contact(model, &posture, f).map(|at| (f, at))).collect();
        let Some(touching) = touching else { return posture };
        if touching.iter().all(|(_, at)| at.gap.abs() <= CLOSED) {
            return posture;
        }
        posture = stepped(model, &posture, &touching);
    }
    posture
}

/// One step of damped least squares with the least motion, every coordinate in units of its deviation.
fn stepped(model: &Model, posture: &Posture, touching: &[(usize, AtContact)]) -> Posture {
    let origin = Point::from(posture.object.translation.vector);
    let n_joints: usize = touching.iter().map(|(_, at)| at.jacobian.ncols()).sum();
    let mut rows = DMatrix::<f64>::zeros(touching.len(), 6 + n_joints);
    let mut gaps = DVector::<f64>::zeros(touching.len());
    let mut first = 6;
    for (row, (finger, at)) in touching.iter().enumerate() {
        let turn = (at.point - origin).cross(&at.normal);
        for k in 0..3 {
            rows[(row, k)] = -at.normal[k] * OBJECT_DEVIATION;
            rows[(row, 3 + k)] = -turn[k] * OBJECT_TURN_DEVIATION;
        }
        let chain = model.fingers[*finger].ik.chain();
        for k in 0..at.jacobian.ncols() {
            rows[(row, first + k)] = at.normal.dot(&at.jacobian.column(k)) * deviation(chain, k);
        }
        gaps[row] = -at.gap;
        first += at.jacobian.ncols();
    }
    let square = &rows * rows.transpose() + DMatrix::identity(touching.len(), touching.len()) * (DAMPING * DAMPING);
    let Some(solved) = square.cholesky().map(|factors| factors.solve(&gaps)) else { return posture.clone() };
    let step = rows.transpose() * solved;
    let shift = Vector::new(step[0], step[1], step[2]) * OBJECT_DEVIATION;
    let turn = Vector::new(step[3], step[4], step[5]) * OBJECT_TURN_DEVIATION;
    let mut next = Posture { object: displaced(&posture.object, &shift, &turn), joints: posture.joints.clone() };
    let mut first = 6;
    for (finger, at) in touching {
        let chain = model.fingers[*finger].ik.chain();
        for (k, value) in next.joints[*finger].iter_mut().enumerate() {
            let moved = *value + step[first + k] * deviation(chain, k);
            *value = moved.clamp(chain.lower[k], chain.upper[k].max(chain.lower[k]));
        }
        first += at.jacobian.ncols();
    }
    next
}

/// How fast the tip of `finger` slides over the object, in metres per second; zero where it is deep inside.
pub fn relative_velocity(model: &Model, posture: &Posture, finger: usize, velocities: &Velocities) -> f64 {
    let Some(at) = at_contact(model, posture, finger) else { return 0.0 };
    let before: usize = model.fingers[..finger].iter().map(|finger| finger.ik.chain().n_coordinates()).sum();
    let n_own = at.jacobian.ncols();
    let Some(own) = velocities.joints.get(before..before + n_own) else { return 0.0 };
    let of_tip: Vector = at.jacobian.column_iter().zip(own).map(|(column, speed)| column * *speed).sum();
    let arm = at.point - Point::from(posture.object.translation.vector);
    let relative = of_tip - (velocities.linear + velocities.angular.cross(&arm));
    (relative - at.normal * relative.dot(&at.normal)).norm()
}
