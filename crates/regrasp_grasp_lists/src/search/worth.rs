//! What a grasp is worth: margin, score, forces.

use crate::prepared::Prepared;
use arrayvec::ArrayVec;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, Vector};
use regrasp_grasp::list::Scores;
use regrasp_grasp::list::score::{centroid_term, closure_term, force_axis_term};
use regrasp_grasp::wrench::BalancedForces;
use regrasp_grasp::{Contact, Grip, closure};
use regrasp_manipulation::forces::held::Held;
use regrasp_manipulation::grasp::state::{GraspState, MAX_FINGERS};

/// Fingers that hold, in order.
pub fn holding(state: &GraspState) -> impl Iterator<Item = usize> + '_ {
    (0..state.contacts.len()).filter(|&f| state.holds(f))
}

/// The largest margin that is proven of a grasp.
pub fn margin(prepared: &Prepared, state: &GraspState) -> f64 {
    let model = prepared.model;
    let grips: ArrayVec<Grip, MAX_FINGERS> = holding(state).map(|f| model.grip(f, &state.contacts[f])).collect();
    closure::prove(&grips, &model.frame, f64::INFINITY).margin()
}

/// The terms of the score but for closure; `flatness` has the inverse curvature at the contacts of the holding fingers.
pub fn other_terms(prepared: &Prepared, state: &GraspState, flatness: &[f64]) -> Scores {
    let model = prepared.model;
    let contacts: ArrayVec<Contact, MAX_FINGERS> = holding(state).map(|f| state.contacts[f]).collect();
    let n = contacts.len().max(1) as f64;
    let axis = |f: usize| {
        let normal: Vector = state.world_from_object * state.contacts[f].normal_in_object.into_inner();
        force_axis_term(&normal, model.fingers[f].ik.tip_jacobian(&state.joints[f]))
    };
    let flat = holding(state).zip(flatness).map(|(f, flatness)| prepared.surface(f).normalised(*flatness));
    Scores {
        closure: 0.0,
        centroid: centroid_term(&contacts, &model.frame.center_of_mass, model.frame.torque_scale),
        force_axis: holding(state).map(axis).sum::<f64>() / n,
        flatness: flat.sum::<f64>() / n,
    }
}

/// All terms of the score.
pub fn terms(prepared: &Prepared, state: &GraspState, flatness: &[f64], margin: f64) -> Scores {
    Scores { closure: closure_term(margin), ..other_terms(prepared, state, flatness) }
}

/// Contact forces that hold whatever the direction of gravity.
pub fn forces(prepared: &Prepared, state: &GraspState) -> Option<BalancedForces> {
    held(prepared, &state.world_from_object, state).forces(prepared.model, prepared.forces, None).ok()
}

/// True when there are such forces.
pub fn is_balanced(prepared: &Prepared, state: &GraspState) -> bool {
    held(prepared, &state.world_from_object, state).is_balanced(prepared.model, prepared.forces)
}

/// The grasp, ready to be asked about forces.
pub fn held(prepared: &Prepared, hand_from_object: &Pose, state: &GraspState) -> Held {
    let placement = Placement::from(hand_from_object);
    Held::new(prepared.model, prepared.forces, &placement, &state.contacts, state.holding, |f| &state.joints[f])
}
