//! Random shortcuts over a sequence of motions: one transfer and one regrasp, in either order, in place of many
//! (paper 000, section 4.2.1, last step; in-hand-notes, section 3).

use super::candidates::Candidate;
use super::combine::{Choice, ClosureTable};
use super::regrasp::{Tried, regrasp};
use super::search::{Search, Stop};
use super::state::{GraspState, Motion, Step};
use super::transfer::{follow_contact, transfer};
use super::workspace::HandJoints;
use regrasp_base::{Interrupt, Rng};
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;

/// Joints nearer than this count as the same posture, in radians or metres.
const SAME_POSTURE: f64 = 1e-6;

/// Fraction of the usual iterations of RRT-Connect for relocations that others can stand in for.
const CASUAL: usize = 8;

/// What a sequence costs: relocations first, then transfers.
fn cost(steps: &[Step]) -> (usize, usize) {
    let n_transfers = steps.iter().filter(|step| matches!(step.motion, Motion::Transfer(_))).count();
    (steps.len() - n_transfers, n_transfers)
}

/// Tries `settings.shortcuts` random shortcuts on `steps` from `start`. `end_is_free` when any grasp will do at the end.
///
/// A plan that is already there is never given up: the caller's limits only end the shortening.
pub fn shorten(search: &mut Search, start: &GraspState, steps: &mut Vec<Step>, end_is_free: bool) {
    for _ in 0..search.model().settings.shortcuts {
        if steps.len() < 2 {
            return;
        }
        if let Err(Stop::Budget(interrupt)) = search.check() {
            search.cut_by_time |= interrupt != Interrupt::WorkSpent;
            return;
        }
        let first = search.rng.below(steps.len() - 1);
        let last = if end_is_free && search.rng.chance(0.3) {
            steps.len() - 1
        } else {
            first + 1 + search.rng.below(steps.len() - first - 1)
        };
        let from = if first == 0 { start.clone() } else { steps[first - 1].end.clone() };
        let free = end_is_free && last + 1 == steps.len();
        let old = cost(&steps[first..=last]);
        if let Some(detour) = direct(search, &from, &steps[last].end.clone(), free, old) {
            steps.splice(first..=last, detour);
        }
    }
}

/// A cheaper way from `from` to `to` (to its pose only, when `free`), if one of the direct ones is feasible.
fn direct(
    search: &mut Search,
    from: &GraspState,
    to: &GraspState,
    free: bool,
    old: (usize, usize),
) -> Option<Vec<Step>> {
    let n_changed = from.contacts.iter().zip(&to.contacts).filter(|(a, b)| a != b).count();
    let moves = search.distance(&from.world_from_object, &to.world_from_object) > 0.0;
    if free
        && old > (0, usize::from(moves))
        && let Some(step) = whole_transfer(search, from, &to.world_from_object)
    {
        return Some(vec![step]);
    }
    if (n_changed, usize::from(moves)) >= old {
        return None;
    }
    let mut rng = Rng::child(&search.rng, "shortcut", 0);
    search.rng.bits();
    transfer_regrasp(search, from, to, free, &mut rng).or_else(|| regrasp_transfer(search, from, to, free, &mut rng))
}

/// A transfer that arrives, or nothing.
pub fn whole_transfer(search: &mut Search, from: &GraspState, goal: &Pose) -> Option<Step> {
    let mut moments = Vec::new();
    if transfer(&mut search.workspace, from, goal, &mut moments) < 1.0 {
        return None;
    }
    let joints = moments.last()?.joints.clone();
    let end = GraspState { world_from_object: *goal, contacts: from.contacts.clone(), joints };
    Some(Step { motion: Motion::Transfer(moments), end })
}

/// Transfer with the first grasp, then change to the second (paper 000, algorithm 2).
pub fn transfer_regrasp(
    search: &mut Search,
    from: &GraspState,
    to: &GraspState,
    free: bool,
    rng: &mut Rng,
) -> Option<Vec<Step>> {
    let mut steps = Vec::new();
    let mut state = from.clone();
    if search.distance(&from.world_from_object, &to.world_from_object) > 0.0 {
        let mut step = whole_transfer(search, from, &to.world_from_object)?;
        settle_postures(&mut step, to);
        state = step.end.clone();
        steps.push(step);
    }
    steps.extend(change_grasp(search, &state, to, free, rng)?);
    Some(steps)
}

/// Change to the second grasp, then transfer (paper 000, section 4.3).
pub fn regrasp_transfer(
    search: &mut Search,
    from: &GraspState,
    to: &GraspState,
    free: bool,
    rng: &mut Rng,
) -> Option<Vec<Step>> {
    let model = search.model();
    let before = Placement::from(&from.world_from_object);
    let mut joints = HandJoints::new();
    for finger in 0..model.n_fingers() {
        joints.push(if from.contacts[finger] == to.contacts[finger] {
            from.joints[finger].clone()
        } else {
            follow_contact(model, finger, &to.contacts[finger], &before, &to.joints[finger])?
        });
    }
    let middle = GraspState { world_from_object: from.world_from_object, contacts: to.contacts.clone(), joints };
    let mut steps = change_grasp(search, from, &middle, false, rng)?;
    let last = steps.last().map_or(from, |step| &step.end).clone();
    if search.distance(&from.world_from_object, &to.world_from_object) > 0.0 {
        let mut step = whole_transfer(search, &last, &to.world_from_object)?;
        if !free && !settle_postures(&mut step, to) {
            return None;
        }
        steps.push(step);
    }
    Some(steps)
}

/// Ends a transfer in exactly the postures of `to` where it is there already but for rounding; true if everywhere.
fn settle_postures(step: &mut Step, to: &GraspState) -> bool {
    let mut all = true;
    for (joints, wanted) in step.end.joints.iter_mut().zip(&to.joints) {
        let is_there = joints.iter().zip(wanted).all(|(a, b)| (a - b).abs() < SAME_POSTURE);
        if is_there {
            joints.clone_from(wanted);
        }
        all &= is_there;
    }
    if let Motion::Transfer(moments) = &mut step.motion
        && let Some(last) = moments.last_mut()
    {
        last.joints.clone_from(&step.end.joints);
    }
    all
}

/// Relocations that turn the grasp of `state` into that of `to`, the object standing still.
pub fn change_grasp(
    search: &mut Search,
    state: &GraspState,
    to: &GraspState,
    free: bool,
    rng: &mut Rng,
) -> Option<Vec<Step>> {
    let model = search.model();
    let mut options = Vec::with_capacity(model.n_fingers());
    let mut goal = Choice::new();
    for finger in 0..model.n_fingers() {
        let mut of_finger =
            vec![Candidate { contact: state.contacts[finger], joints: state.joints[finger].clone(), follow: 1.0 }];
        let same_posture =
            state.joints[finger].iter().zip(&to.joints[finger]).all(|(a, b)| (a - b).abs() < SAME_POSTURE);
        let moves = state.contacts[finger] != to.contacts[finger] || (!free && !same_posture);
        if moves {
            of_finger.push(Candidate { contact: to.contacts[finger], joints: to.joints[finger].clone(), follow: 1.0 });
        }
        goal.push(usize::from(moves));
        options.push(of_finger);
    }
    let mut table = ClosureTable::new(model, &options);
    if !table.is_closed(&goal, (1 << model.n_fingers()) - 1) {
        return None;
    }
    // One of many ways to the same end: not worth a long search for a finger's way.
    search.workspace.rrt_iterations = model.settings.rrt_iterations / CASUAL;
    let steps = regrasp(&mut search.workspace, state, &options, &goal, &mut table, &mut Tried::default(), rng);
    search.workspace.rrt_iterations = model.settings.rrt_iterations;
    steps
}
