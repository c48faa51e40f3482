//! Transfer paths: the object moves, the fingers follow, with contacts that stay on it (Saut 2011, sec. 4.2.3) or roll
//! over it (Sahbani 2007, sec. IV-C).

use crate::in_hand::moving::spin;
use crate::in_hand::moving::step::{is_closed, n_steps, step_joints};
use regrasp_geometry::Pose;
use regrasp_geometry::frame::PoseLine;
use regrasp_manipulation::forces::held::balances;
use regrasp_manipulation::grasp::state::{GraspState, Moment};
use regrasp_manipulation::model::Model;
use regrasp_manipulation::rolling::step::NoStep;
use regrasp_manipulation::workspace::{TipMode, Workspace};

/// Moves the object from `start` towards `goal` as far as the hand can follow.
///
/// Appends the moments after the start to `moments`; returns the share of the way that was made, 1 being all of it.
pub fn transfer(workspace: &mut Workspace, start: &GraspState, goal: &Pose, moments: &mut Vec<Moment>) -> f64 {
    if !holds_weight(workspace, &start.moment(), start.holding) {
        return 0.0;
    }
    workspace.set_state(start);
    follow(workspace.model, start, goal, moments, |there| {
        workspace.roll_to(&there.contacts);
        workspace.step(&there.world_from_object, &there.joints, TipMode::AllHold)
            && holds_weight(workspace, there, start.holding)
    })
}

/// True when `moments` of a transfer from `start` are clear of collisions, with forces that hold the weight.
pub fn is_carried_out(workspace: &mut Workspace, start: &GraspState, moments: &[Moment]) -> bool {
    if !holds_weight(workspace, &start.moment(), start.holding) {
        return false;
    }
    workspace.set_state(start);
    moments.iter().all(|there| {
        workspace.roll_to(&there.contacts);
        workspace.step(&there.world_from_object, &there.joints, TipMode::AllHold)
            && holds_weight(workspace, there, start.holding)
    })
}

fn holds_weight(workspace: &mut Workspace, there: &Moment, holding: u32) -> bool {
    balances(workspace, &there.world_from_object, &there.joints, &there.contacts, holding)
}

/// As [`transfer`], with collisions left to `is_clear`, which is asked about each step to the moment it is given. Without
/// it the same moments come out: that is how a transfer that was proven once is carried out again. A finger that reaches no points follows
/// nowhere.
pub fn follow(
    model: &Model,
    start: &GraspState,
    goal: &Pose,
    moments: &mut Vec<Moment>,
    mut is_clear: impl FnMut(&Moment) -> bool,
) -> f64 {
    if model.closing_fingers() & start.holding != 0 && start.world_from_object != *goal {
        return 0.0;
    }
    if spin::is_restricted(model, start.holding) {
        return spin::pursue(model, start, goal, moments, is_clear);
    }
    let steps = n_steps(model, &start.world_from_object, goal, model.settings.step);
    let line = PoseLine::between(&start.world_from_object, goal);
    let shortest = 1.0 / (steps << MAX_HALVINGS) as f64;
    let mut pending: Vec<f64> = (1..=steps).rev().map(|k| k as f64 / steps as f64).collect();
    let mut made = 0.0;
    let first = start.moment();
    moments.reserve(steps);
    let n_before = moments.len();
    while let Some(t) = pending.pop() {
        let pose = if t == 1.0 { *goal } else { line.at(t) };
        let here = moments[n_before..].last().unwrap_or(&first);
        let there = match step(model, start, here, &pose) {
            Ok(there) => there,
            Err(NoStep::TooLong) if t - made > shortest => {
                pending.extend([t, 0.5 * (made + t)]);
                continue;
            }
            Err(_) => return made,
        };
        if !is_clear(&there) {
            return made;
        }
        moments.push(there);
        made = t;
    }
    1.0
}

/// One step of the object to `pose`, with fingers that follow; the ones that hold are closed there.
fn step(model: &Model, start: &GraspState, here: &Moment, pose: &Pose) -> Result<Moment, NoStep> {
    let there = step_joints(model, start.holding, here, pose)?.0;
    if is_closed(model, &there, start.holding) { Ok(there) } else { Err(NoStep::OutOfReach) }
}

/// Most often that a step is halved because fingertips stray from their contacts on the way.
const MAX_HALVINGS: usize = 4;
