//! Grasps of hands whose fingers close: kinds `closing` and `gripper`. Such fingers have too few joints to reach a contact that
//! is chosen beforehand. They move along their coupling until their tips touch.

/// Fingers that close one after the other, motor by motor.
mod closing;
/// Two jaws on antipodal points.
mod gripper;

use crate::found::Reason;
use crate::motors::Motors;
use crate::prepared::Prepared;
use crate::search::worth::{self, holding};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::list::GraspKind;
use regrasp_grasp::list::score::inverse_curvature;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::workspace::{TipMode, Workspace};

/// The grasp that the closed hand makes in frame `index`, with its margin. Errors: why there is none, and the margin seen.
pub fn close_in_frame(
    prepared: &Prepared,
    motors: &Motors,
    workspace: &mut Workspace,
    index: u64,
    rng: &mut Rng,
) -> Result<(GraspState, f64), (Reason, f64)> {
    let fail = |reason| (reason, 0.0);
    let state = match prepared.settings.kind {
        GraspKind::Gripper => {
            let jaws = gripper::place(prepared, motors, index, rng).ok_or(fail(Reason::TooFewContacts))?;
            let joints = gripper::joints_at(motors, jaws.position);
            refuse_rough_hits(prepared, &joints, &jaws.hand_from_object).map_err(fail)?;
            workspace.place_object(&jaws.hand_from_object);
            if !workspace.palm_is_clear() {
                return Err(fail(Reason::Palm));
            }
            gripper::close(prepared, motors, &jaws)
        }
        _ => {
            let hand_from_object = prepared.object_from_hand(index).inverse();
            let shape = motors.drawn_shape(rng);
            refuse_rough_hits(prepared, &shape, &hand_from_object).map_err(fail)?;
            workspace.place_object(&hand_from_object);
            if !workspace.palm_is_clear() {
                return Err(fail(Reason::Palm));
            }
            closing::close(prepared, motors, &hand_from_object, &shape)
        }
    };
    let state = state.filter(|state| holding(state).count() >= prepared.least_contacts());
    let state = state.ok_or(fail(Reason::TooFewContacts))?;
    let margin = worth::margin(prepared, &state);
    if margin < prepared.settings.margin {
        return Err((Reason::NotClosed, margin));
    }
    workspace.set_state(&state);
    if !workspace.is_clear(TipMode::AllHold) {
        return Err((Reason::Fingers, margin));
    }
    Ok((state, margin))
}

/// Refuses a hand of which palm or fingers surely are in the object before it closes.
fn refuse_rough_hits(prepared: &Prepared, joints: &HandJoints, hand_from_object: &Pose) -> Result<(), Reason> {
    let object_from_hand = Placement::from(&hand_from_object.inverse());
    if prepared.rough.palm_hits(&object_from_hand) {
        return Err(Reason::Palm);
    }
    let hits = |finger: usize| prepared.rough.finger_hits(prepared.model, finger, &joints[finger], &object_from_hand);
    if (0..joints.len()).any(hits) { Err(Reason::Fingers) } else { Ok(()) }
}

/// The hand of `state` with the object at another pose, closed anew; with the fingers that held before.
pub fn close_again(
    prepared: &Prepared,
    motors: &Motors,
    state: &GraspState,
    hand_from_object: &Pose,
) -> Option<GraspState> {
    let again = match prepared.settings.kind {
        GraspKind::Gripper => {
            let jaws =
                gripper::Jaws { hand_from_object: *hand_from_object, position: motors.position(0, &state.joints) };
            gripper::close(prepared, motors, &jaws)?
        }
        _ => closing::close(prepared, motors, hand_from_object, &motors.opened(&state.joints, 1.0))?,
    };
    (again.holding == state.holding).then_some(again)
}

/// Inverse curvature at the contacts of the holding fingers.
pub fn flatness(prepared: &Prepared, state: &GraspState) -> Vec<f64> {
    let surface = &prepared.model.view.object.surface;
    let at = |f: usize| {
        let at = surface.project(&state.contacts[f].point_in_object);
        inverse_curvature(surface.curvature(&at), prepared.model.fingers[f].tip_radius)
    };
    holding(state).map(at).collect()
}

/// Shares of the way to the open end at which the hand is open: tried in this order. By hand.
const OPENINGS: [f64; 4] = [0.5, 1.0, 0.25, 0.1];

/// Postures of the open hand.
pub fn openings(motors: &Motors, joints: &HandJoints) -> Vec<HandJoints> {
    OPENINGS.iter().map(|share| motors.opened(joints, *share)).collect()
}
