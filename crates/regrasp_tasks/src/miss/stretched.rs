//! Arms stretched towards what is out of their reach.

use crate::context::Context;
use crate::line::collider;
use regrasp_geometry::Point;

/// Rounds over all joints. The step shrinks in each, so that the last ones are below a milliradian. By hand.
const ROUNDS: usize = 40;
const SHRINK: f64 = 0.83;
/// Joints turn at most this far at once, in radians or metres.
const LARGEST: f64 = 1.6;
/// Continuous joints are kept within this.
const TURN: f64 = std::f64::consts::PI;

/// The state in which the wrist of a hand comes near a point, and where the wrist is then. Joints of the arm and of what carries it move
/// one at a time, in ever smaller steps, where that brings the wrist nearer and nothing meets; what meets is not looked at where something
/// does at the beginning. The object is left out.
pub fn stretched(context: &Context, hand: usize, from: &[f64], wanted: &Point) -> (Vec<f64>, Point) {
    let own = &context.hands[hand];
    let mount = context.robot.arms[own.arm].mount.0;
    let mut poses = Vec::new();
    let mut wrist = |state: &[f64]| {
        context.robot.link_poses(state, &mut poses);
        Point::from(poses[mount].translation.vector)
    };
    let joints: Vec<usize> = own.arm_joints.clone().chain(context.common_above(hand)).collect();
    let model = context.model(from, &context.arms_and_torso, None);
    let mut test = collider(context, &model, &context.fixed);
    let begins_free = test.contact(&model.configuration_of(from)).is_none();
    let mut may_be = |state: &[f64]| {
        context.robot.layout.within_limits(state, 0.0)
            && (!begins_free || test.contact(&model.configuration_of(state)).is_none())
    };
    let mut state = from.to_vec();
    let mut least = (wrist(&state) - wanted).norm();
    let mut step = LARGEST;
    for _ in 0..ROUNDS {
        for &k in &joints {
            let limits = &context.robot.layout.coordinates[k];
            let (lower, upper) = (limits.lower.max(-TURN), limits.upper.min(TURN));
            let here = state[k];
            for shift in [step, -step, 0.4 * step, -0.4 * step] {
                let before = state[k];
                state[k] = (here + shift).clamp(lower, upper);
                let far = (wrist(&state) - wanted).norm();
                match far < least && may_be(&state) {
                    true => least = far,
                    false => state[k] = before,
                }
            }
        }
        step *= SHRINK;
    }
    let at = wrist(&state);
    (state, at)
}
