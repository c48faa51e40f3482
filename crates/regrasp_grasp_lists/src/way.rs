//! The way of the hand to a grasp: a straight line of the open hand, then all fingers close on a straight line in joint space.
//! No moment of it is in collision.

use crate::driven;
use crate::found::WayIn;
use crate::prepared::Prepared;
use crate::search::worth::holding;
use nalgebra::Translation3;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, Vector};
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::relocation::hover;
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Largest step of a joint while the hand opens, in radians or metres.
const JOINT_STEP: f64 = 0.08;
/// Longest step of a fingertip that leaves its contact, in metres. How deep such a tip presses in is proven at the ends of a step:
/// between them a ball of radius `r` may sink deeper by `step^2 / (8 r)`, 0.06 mm for 8 mm.
const TIP_STEP: f64 = 0.002;
/// Longest step of the hand on its line, in metres.
const LINE_STEP: f64 = 0.02;
/// Longest step of a fingertip that lifts off, in metres.
const LIFT_STEP: f64 = 0.004;
/// Directions that are tried besides the first.
const DIRECTIONS: usize = 14;
/// Directions that are turned farther than this from the first are not tried: cosine.
const LEAST_COSINE: f64 = -0.2;

/// Why there is no way in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoWay {
    /// The fingers cannot open.
    Closed,
    /// The open hand is blocked on every line.
    Blocked,
}

/// A way to the grasp `state`; with the open hand `given`, if it can be. The workspace is left anywhere.
pub fn way_in(
    prepared: &Prepared,
    workspace: &mut Workspace,
    state: &GraspState,
    given: Option<&HandJoints>,
) -> Result<WayIn, NoWay> {
    let mut opened = false;
    let directions = directions(state);
    for open in given.cloned().into_iter().chain(openings(prepared, state)) {
        if !opens(workspace, state, &open) {
            continue;
        }
        opened = true;
        if let Some(direction) =
            directions.iter().find(|direction| leaves(prepared, workspace, state, &open, direction))
        {
            return Ok(WayIn { open, direction: *direction });
        }
    }
    Err(if opened { NoWay::Blocked } else { NoWay::Closed })
}

/// True when `way` leads to the grasp.
pub fn is_free(prepared: &Prepared, workspace: &mut Workspace, state: &GraspState, way: &WayIn) -> bool {
    opens(workspace, state, &way.open) && leaves(prepared, workspace, state, &way.open, &way.direction)
}

/// Postures of the open hand: fingertips lift off along their normals, by the heights asked for; then all fingers rest.
/// Hands that close have motors that open them.
fn openings<'p>(prepared: &'p Prepared, state: &'p GraspState) -> Box<dyn Iterator<Item = HandJoints> + 'p> {
    if let Some(motors) = &prepared.motors {
        return Box::new(driven::openings(motors, &state.joints).into_iter());
    }
    let lifted = prepared.settings.open_heights.iter().filter_map(|height| lifted(prepared, state, *height));
    let rest = prepared.model.view.hand.fingers.iter().map(|finger| finger.rest.iter().copied().collect());
    Box::new(lifted.chain(std::iter::once(rest.collect())))
}

/// The posture with every fingertip that holds at `height` over its contact; None where a finger cannot.
fn lifted(prepared: &Prepared, state: &GraspState, height: f64) -> Option<HandJoints> {
    let placement = Placement::from(&state.world_from_object);
    let mut open = state.joints.clone();
    for f in holding(state) {
        let contact = state.contacts[f];
        let n_steps = (height / LIFT_STEP).ceil().max(1.0);
        for k in 1..=n_steps as usize {
            // Each step begins where the last one ended, so that the finger stays on its branch.
            let above = height * k as f64 / n_steps;
            let contact_above = regrasp_grasp::Contact {
                point_in_object: contact.point_in_object
                    + contact.normal_in_object.into_inner() * (height * (k - 1) as f64 / n_steps),
                ..contact
            };
            let step = above - height * (k - 1) as f64 / n_steps;
            open[f] = hover(prepared.model, &placement, f, &contact_above, &open[f], step)?;
        }
    }
    Some(open)
}

/// True when the hand opens without a collision; fingertips that hold press in no deeper than allowed.
fn opens(workspace: &mut Workspace, state: &GraspState, open: &HandJoints) -> bool {
    workspace.set_state(state);
    let changes =
        |f: usize| -> Coordinates { state.joints[f].iter().zip(&open[f]).map(|(from, to)| to - from).collect() };
    let turn = (0..open.len()).flat_map(changes).map(f64::abs).fold(0.0, f64::max);
    let travel = |f: usize| workspace.model.fingers[f].tip_bound.first_order(&changes(f));
    let travel = holding(state).map(travel).fold(0.0, f64::max);
    let n_steps = (turn / JOINT_STEP).max(travel / TIP_STEP).ceil().max(1.0) as usize;
    (1..=n_steps).all(|k| {
        let joints = between(&state.joints, open, k as f64 / n_steps as f64);
        workspace.step(&state.world_from_object, &joints, TipMode::AllHold)
    })
}

/// Joints at `share` of the way from one posture to another.
pub fn between(from: &HandJoints, to: &HandJoints, share: f64) -> HandJoints {
    let of_finger = |(from, to): (&Coordinates, &Coordinates)| -> Coordinates {
        // The last step ends exactly at the end.
        let at = |(a, b): (&f64, &f64)| if share >= 1.0 { *b } else { a + (b - a) * share };
        from.iter().zip(to).map(at).collect()
    };
    from.iter().zip(to).map(of_finger).collect()
}

/// True when the open hand leaves against `direction` without touching anything.
fn leaves(
    prepared: &Prepared,
    workspace: &mut Workspace,
    state: &GraspState,
    open: &HandJoints,
    direction: &Vector,
) -> bool {
    let distance = prepared.settings.approach_distance;
    if prepared.rough.line_hits(prepared.model, open, &state.world_from_object, &(direction * distance)) {
        return false;
    }
    let n_steps = (distance / LINE_STEP).ceil().max(1.0) as usize;
    workspace.set_held(&state.world_from_object, open, &state.contacts, 0);
    workspace.is_clear(TipMode::AllHold)
        && (1..=n_steps).all(|k| {
            let pose = seen_from_hand(state, direction, distance * k as f64 / n_steps as f64);
            workspace.step(&pose, open, TipMode::AllHold)
        })
}

/// The object in the hand frame while the hand is `distance` before the grasp.
pub fn seen_from_hand(state: &GraspState, direction: &Vector, distance: f64) -> Pose {
    let shift = state.world_from_object.rotation * direction * distance;
    Translation3::from(shift) * state.world_from_object
}

/// Directions in which the hand may come, in the object frame: first from its base to the contacts, then others around that.
fn directions(state: &GraspState) -> Vec<Vector> {
    let (mut sum, mut n_contacts) = (Vector::zeros(), 0.0);
    for f in holding(state) {
        sum += state.contacts[f].point_in_object.coords;
        n_contacts += 1.0;
    }
    let hand = state.world_from_object.inverse().translation.vector;
    let middle = (sum / f64::max(n_contacts, 1.0) - hand).try_normalize(1e-9).unwrap_or_else(Vector::z);
    // Out along the mean of the normals: the fingers come from there.
    let outward: Vector = holding(state).map(|f| state.contacts[f].normal_in_object.into_inner()).sum();
    let mut directions = vec![middle];
    directions.extend((-outward).try_normalize(0.3));
    let mut others: Vec<Vector> = spread().filter(|one| one.dot(&middle) > LEAST_COSINE).collect();
    others.sort_by(|a, b| b.dot(&middle).total_cmp(&a.dot(&middle)));
    directions.extend(others.into_iter().take(DIRECTIONS));
    directions
}

/// Directions spread over the sphere, by a spiral of golden angles.
fn spread() -> impl Iterator<Item = Vector> {
    const N: usize = 40;
    const GOLDEN_ANGLE: f64 = 2.399963229728653;
    (0..N).map(|k| {
        let z = 1.0 - (2 * k + 1) as f64 / N as f64;
        let (sine, cosine) = (GOLDEN_ANGLE * k as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        Vector::new(across * cosine, across * sine, z)
    })
}
