//! Fingers close along their couplings until their tips touch. A motor stops when the first of its fingertips touches.

use crate::motors::{Motor, Motors};
use crate::prepared::Prepared;
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::grasp::touch::{Gap, contact, first_touch, gap};

/// Gaps below this touch, in metres.
const TOUCHES: f64 = 1e-10;
/// Shortest step of a fingertip that is still away, in metres.
const LEAST_STEP: f64 = 1e-4;
/// Most steps of a motor: fingers of a tenth of a metre take some thirty.
const MOST_STEPS: usize = 4_000;

/// The hand, open in `shape`, after all motors have closed. None where a fingertip is in the object from the beginning, or touches
/// where it may not.
pub fn close(prepared: &Prepared, motors: &Motors, hand_from_object: &Pose, shape: &HandJoints) -> Option<GraspState> {
    let mut joints = shape.clone();
    let n = joints.len();
    let mut touching = vec![false; n];
    for motor in &motors.closing {
        let Some(fingers) = turn(prepared, motor, hand_from_object, &mut joints)? else { continue };
        fingers.into_iter().for_each(|finger| touching[finger] = true);
    }
    let mut of_fingers = Vec::with_capacity(n);
    for finger in 0..n {
        let mut held = None;
        if touching[finger] {
            let gap = gap(prepared.model, finger, hand_from_object, &joints[finger]);
            held = Some(contact(prepared.model, finger, hand_from_object, &joints[finger], &gap)?);
        }
        of_fingers.push((held, joints[finger].clone()));
    }
    Some(GraspState::of(*hand_from_object, of_fingers.into_iter()))
}

/// Turns a motor until a fingertip touches; which do. Some(None) where none ever does: its fingers are left open. None where one
/// touches from the beginning.
fn turn(
    prepared: &Prepared,
    motor: &Motor,
    hand_from_object: &Pose,
    joints: &mut HandJoints,
) -> Option<Option<Vec<usize>>> {
    let mut fingers: Vec<usize> = motor.driven.iter().map(|driven| driven.finger).collect();
    fingers.sort_unstable();
    fingers.dedup();
    // How fast fingertips can move at most, in metres per unit of the motor.
    let speed = |finger: usize| {
        let model = &prepared.model.fingers[finger];
        let change = motor.change_of(finger, joints[finger].len());
        model.tip_bound.first_order(&change)
            + if model.curved.is_some() { model.tip_radius * change.iter().map(|x| x.abs()).sum::<f64>() } else { 0.0 }
    };
    let speeds: Vec<f64> = fingers.iter().map(|f| speed(*f).max(1e-9)).collect();
    let (range, mut share) = (motor.closed - motor.open, 0.0);
    let at = |share: f64, joints: &mut HandJoints| -> Vec<Gap> {
        motor.put(joints, motor.open + range * share);
        fingers.iter().map(|&f| gap(prepared.model, f, hand_from_object, &joints[f])).collect()
    };
    let (mut before, mut gaps) = (0.0, at(0.0, joints));
    if gaps.iter().any(|gap| gap.distance <= 0.0) {
        return None;
    }
    for _ in 0..MOST_STEPS {
        if share >= 1.0 {
            motor.put(joints, motor.open);
            return Some(None);
        }
        let steps = gaps.iter().zip(&speeds).map(|(gap, speed)| gap.distance.max(LEAST_STEP) / (speed * range.abs()));
        before = share;
        share = (share + steps.fold(f64::INFINITY, f64::min)).min(1.0);
        gaps = at(share, joints);
        if gaps.iter().any(|gap| gap.distance <= 0.0) {
            break;
        }
    }
    let least = |share: f64| {
        let mut trial = joints.clone();
        at(share, &mut trial).iter().map(|gap| gap.distance).fold(f64::INFINITY, f64::min)
    };
    let touch = first_touch([before, share], least);
    let gaps = at(touch, joints);
    let touching = fingers.iter().zip(&gaps).filter(|(_, gap)| gap.distance.abs() <= TOUCHES).map(|(f, _)| *f);
    Some(Some(touching.collect()))
}
