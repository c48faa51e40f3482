//! One frame: contacts finger by finger, closure, forces, way in (Saut 2010, sec. IV-A.2 and IV-A.3).

use super::combine::{Choice, Options, choices};
use super::contacts::footholds;
use super::worth;
use crate::driven;
use crate::found::{Found, Reason};
use crate::prepared::Prepared;
use crate::way::{self, NoWay};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Choices of contacts that are tried in a frame.
const CHOICES_TRIED: usize = 6;

/// A frame without a grasp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Miss {
    /// Why.
    pub reason: Reason,
    /// The largest margin seen.
    pub margin: f64,
    /// The first finger that reached no contact.
    pub out_of_reach: Option<usize>,
}

/// The grasp of frame `index`, or why there is none. The answer does not depend on what the workspace did before.
pub fn try_frame(prepared: &Prepared, workspace: &mut Workspace, index: u64) -> Result<Found, Miss> {
    let object_from_hand = prepared.object_from_hand(index);
    let hand_from_object = object_from_hand.inverse();
    let mut rng = Rng::keyed(prepared.seed, "grasp frame", index);
    let mut miss = Miss { reason: Reason::Palm, margin: 0.0, out_of_reach: None };
    if let Some(motors) = &prepared.motors {
        let closed = driven::close_in_frame(prepared, motors, workspace, index, &mut rng);
        let (state, margin) = closed.map_err(|(reason, margin)| Miss { reason, margin, ..miss })?;
        let flatness = driven::flatness(prepared, &state);
        return accept(prepared, workspace, index, state, (&flatness, margin), None).map_err(|reason| Miss {
            reason,
            margin,
            ..miss
        });
    }
    workspace.place_object(&hand_from_object);
    if !workspace.palm_is_clear() {
        return Err(miss);
    }
    let model = prepared.model;
    let n_fingers = model.n_fingers();
    let mut options: Options = (0..n_fingers).map(|_| Default::default()).collect();
    let mut may_be_free = vec![false; n_fingers];
    let mut opposed = None;
    let mut n_touching = 0;
    for (done, &finger) in prepared.order.iter().enumerate() {
        options[finger] = footholds(prepared, workspace, finger, &hand_from_object, opposed.as_ref(), &mut rng);
        // No stable grasp without the first finger (Saut 2010, sec. IV-A.2).
        if options[finger].is_empty() && done == 0 {
            return Err(Miss { reason: Reason::TooFewContacts, out_of_reach: Some(finger), ..miss });
        }
        may_be_free[finger] = rests(prepared, workspace, finger);
        if options[finger].is_empty() {
            miss.out_of_reach = miss.out_of_reach.or(Some(finger));
            if !may_be_free[finger] {
                return Err(Miss { reason: Reason::FreeFinger(finger), ..miss });
            }
        } else {
            opposed = opposed.or(options[finger].first().map(|foothold| foothold.place));
            n_touching += 1;
        }
        let n_left = n_fingers - done - 1;
        if n_touching + n_left < prepared.least_contacts() {
            return Err(Miss { reason: Reason::TooFewContacts, ..miss });
        }
    }
    let (found, best) = choices(prepared, &options, &may_be_free);
    miss.margin = best;
    if found.is_empty() {
        return Err(Miss { reason: Reason::NotClosed, ..miss });
    }
    let mut clear = Clear::new(&options);
    let mut reason = Reason::Fingers;
    for choice in found.iter().take(CHOICES_TRIED) {
        if !clear.of_each_other(prepared, workspace, &options, choice) {
            continue;
        }
        let state = state_of(prepared, &hand_from_object, &options, choice);
        workspace.set_state(&state);
        if !workspace.is_clear(TipMode::AllHold) {
            reason = reason.max(Reason::Fingers);
            continue;
        }
        let flatness: Vec<f64> =
            (0..n_fingers).filter_map(|f| choice.chosen[f].map(|k| options[f][k].place.flatness)).collect();
        match accept(prepared, workspace, index, state, (&flatness, choice.margin), None) {
            Ok(grasp) => return Ok(grasp),
            Err(why) => reason = reason.max(why),
        }
    }
    Err(Miss { reason, ..miss })
}

/// True when a finger has room in its rest posture, whatever the others do.
fn rests(prepared: &Prepared, workspace: &mut Workspace, finger: usize) -> bool {
    let rest = rest_of(prepared, finger);
    workspace.set_finger(finger, &rest);
    let clearance = prepared.model.free_clearance();
    workspace.finger_alone_is_clear(finger, TipMode::Away { finger, clearance })
}

fn rest_of(prepared: &Prepared, finger: usize) -> Coordinates {
    prepared.model.view.hand.fingers[finger].rest.iter().copied().collect()
}

/// Which postures of two fingers are clear of each other, asked once.
struct Clear {
    n_options: Vec<usize>,
    known: Vec<Option<bool>>,
}

impl Clear {
    fn new(options: &Options) -> Self {
        let n_options: Vec<usize> = options.iter().map(|of_finger| of_finger.len() + 1).collect();
        let n: usize = n_options.iter().sum();
        Clear { known: vec![None; n * n], n_options }
    }

    fn of_each_other(
        &mut self,
        prepared: &Prepared,
        workspace: &mut Workspace,
        options: &Options,
        choice: &Choice,
    ) -> bool {
        let total: usize = self.n_options.iter().sum();
        let slot = |f: usize| -> usize {
            let first: usize = self.n_options[..f].iter().sum();
            first + choice.chosen[f].unwrap_or(self.n_options[f] - 1)
        };
        let slots: Vec<usize> = (0..choice.chosen.len()).map(slot).collect();
        for f in 0..slots.len() {
            for g in f + 1..slots.len() {
                let index = slots[f] * total + slots[g];
                let is_clear = self.known[index].unwrap_or_else(|| {
                    let (first, second) =
                        (joints_of(prepared, options, choice, f), joints_of(prepared, options, choice, g));
                    workspace.fingers_are_clear((f, &first), (g, &second))
                });
                self.known[index] = Some(is_clear);
                if !is_clear {
                    return false;
                }
            }
        }
        true
    }
}

fn joints_of(prepared: &Prepared, options: &Options, choice: &Choice, finger: usize) -> Coordinates {
    choice.chosen[finger].map_or_else(|| rest_of(prepared, finger), |k| options[finger][k].joints.clone())
}

/// The hand at the contacts of a choice.
fn state_of(prepared: &Prepared, hand_from_object: &Pose, options: &Options, choice: &Choice) -> GraspState {
    let finger = |f: usize| {
        let contact = choice.chosen[f].map(|k| options[f][k].place.contact);
        (contact, joints_of(prepared, options, choice, f))
    };
    GraspState::of(*hand_from_object, (0..choice.chosen.len()).map(finger))
}

/// The grasp `state`, which hits nothing, with all that belongs to it; `flatness` has the inverse curvature at its contacts, beside the
/// margin. `open` is the open hand to be tried first.
pub fn accept(
    prepared: &Prepared,
    workspace: &mut Workspace,
    frame: u64,
    state: GraspState,
    (flatness, margin): (&[f64], f64),
    open: Option<&HandJoints>,
) -> Result<Found, Reason> {
    let forces = worth::forces(prepared, &state).ok_or(Reason::Forces)?;
    let way = way::way_in(prepared, workspace, &state, open).map_err(|why| match why {
        NoWay::Closed => Reason::NotOpened,
        NoWay::Blocked => Reason::NoWayIn,
    })?;
    let scores = worth::terms(prepared, &state, flatness, margin);
    let score = scores.mean(&prepared.settings.weights);
    Ok(Found { frame, state, margin, margin_before: None, scores, score, forces, way, stable_poses: Vec::new() })
}
