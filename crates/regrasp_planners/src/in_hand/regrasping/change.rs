//! One transfer and one change of grasp, in either order.

use crate::in_hand::attempt::patience::Patience;
use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::pool::Pool;
use crate::in_hand::moving::transfer::transfer;
use crate::in_hand::regrasping::regrasp::{ChangeGoal, Tried, regrasp, regrasp_over};
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints, Moment};
use regrasp_manipulation::rolling::follow::follow_contact;
use regrasp_manipulation::workspace::{TipMode, Workspace};

/// Joints nearer than this differ by what solvers leave: they are set on each other, in radians or metres.
pub const SAME_POSTURE: f64 = 1e-6;

/// Other contacts per finger over which one grasp is changed into another.
const OTHERS: usize = 3;

/// Relocations tried for such a change.
const RELOCATIONS: usize = 24;

/// Fraction of the usual iterations of RRT-Connect for relocations that others can stand in for.
pub const CASUAL: usize = 8;

/// What is asked of the end of a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// Exactly the state: pose, contacts and joints.
    Exact,
    /// The object's pose and closed fingers, whatever their postures.
    AnyPosture,
}

/// Iterations of RRT-Connect that the next way of a finger is worth where others can stand in for it.
pub fn patience_now(search: &Search) -> usize {
    let casual = search.model().settings.rrt_iterations / CASUAL;
    search.patience.as_ref().map_or(casual, Patience::iterations)
}

/// A transfer that arrives, or nothing.
pub fn whole_transfer(search: &mut Search, from: &GraspState, goal: &Pose) -> Option<Sequence> {
    let mut moments = Vec::new();
    if transfer(&mut search.workspace, from, goal, &mut moments) < 1.0 {
        return None;
    }
    let mut way = Sequence::at(from.clone());
    way.push_transfer(moments);
    Some(way)
}

/// Transfer with the first grasp, then change to the second (Saut 2011, algorithm 2).
pub fn transfer_regrasp(
    search: &mut Search,
    from: &GraspState,
    to: &GraspState,
    arrival: Arrival,
    rng: &mut Rng,
) -> Option<Sequence> {
    let way = if from.world_from_object == to.world_from_object {
        Sequence::at(from.clone())
    } else {
        whole_transfer(search, from, &to.world_from_object)?
    };
    change_grasp(search, &way, to, arrival, rng)
}

/// Change to the second grasp, then transfer (Saut 2011, sec. 4.3); where fingertips roll, to the contacts from which they
/// roll into those of the second grasp. None where the object has nowhere to go: that is
/// [`transfer_regrasp`].
pub fn regrasp_transfer(
    search: &mut Search,
    from: &GraspState,
    to: &GraspState,
    arrival: Arrival,
    rng: &mut Rng,
) -> Option<Sequence> {
    if from.world_from_object == to.world_from_object {
        return None;
    }
    let model = search.model();
    if model.any_rolls() {
        // Where the contacts have to be before the object moves, only the way back says.
        let back = whole_transfer(search, to, &from.world_from_object)?;
        let change = change_grasp(search, &Sequence::at(from.clone()), back.end(), Arrival::Exact, rng)?;
        return change.then(back.reversed());
    }
    let before = Placement::from(&from.world_from_object);
    let mut joints = HandJoints::new();
    for finger in 0..model.n_fingers() {
        joints.push(match to.contact(finger) {
            // What is free stays where it is while the object moves.
            None => to.joints[finger].clone(),
            contact if contact == from.contact(finger) => from.joints[finger].clone(),
            Some(contact) => follow_contact(model, finger, &contact, &before, &to.joints[finger])?,
        });
    }
    let middle = GraspState { world_from_object: from.world_from_object, joints, ..to.clone() };
    let change = change_grasp(search, &Sequence::at(from.clone()), &middle, Arrival::Exact, rng)?;
    let mut way = change.then(whole_transfer(search, &middle, &to.world_from_object)?)?;
    if arrival == Arrival::Exact {
        way = settle(&mut search.workspace, way, to)?;
    }
    (arrival == Arrival::AnyPosture || way.end() == to).then_some(way)
}

/// The joints at `state`, those of `wanted` where a finger has the same contact and is there but for rounding.
fn settled_joints(state: &GraspState, wanted: &GraspState) -> HandJoints {
    let mut joints = state.joints.clone();
    for (finger, own) in joints.iter_mut().enumerate() {
        let there = &wanted.joints[finger];
        let is_there = own.iter().zip(there).all(|(a, b)| (a - b).abs() < SAME_POSTURE);
        if is_there && state.contact(finger) == wanted.contact(finger) {
            own.clone_from(there);
        }
    }
    joints
}

/// Ends `way` in exactly the postures of `wanted`, which has the same object pose, wherever a finger is there but for
/// rounding. Its last transfer then ends there, in a step that is tested again; without one the fingers make that step by
/// themselves.
fn settle(workspace: &mut Workspace, mut way: Sequence, wanted: &GraspState) -> Option<Sequence> {
    let joints = settled_joints(way.end(), wanted);
    if joints == way.end().joints {
        return Some(way);
    }
    let world_from_object = way.end().world_from_object;
    let mut moments = way.pop_transfer().unwrap_or_default();
    moments.pop();
    let (pose, before) =
        moments.last().map_or((&way.end().world_from_object, &way.end().joints), |m| (&m.world_from_object, &m.joints));
    workspace.set_held(pose, before, &way.end().contacts, way.end().holding);
    if !workspace.step(&world_from_object, &joints, TipMode::AllHold) {
        return None;
    }
    moments.push(Moment { world_from_object, joints, contacts: way.end().contacts.clone() });
    way.push_transfer(moments);
    Some(way)
}

/// `way`, then relocations that turn the grasp in which it ends into that of `to`, the object standing still.
pub fn change_grasp(
    search: &mut Search,
    way: &Sequence,
    to: &GraspState,
    arrival: Arrival,
    rng: &mut Rng,
) -> Option<Sequence> {
    change(search, way, to, arrival, rng, None)
}

/// As [`change_grasp`] with exact arrival; where two postures of each finger are not enough, over others of `pool`, which is
/// at the pose that `way` ends at.
pub fn change_grasp_over(
    search: &mut Search,
    way: &Sequence,
    to: &GraspState,
    pool: &mut Pool,
    rng: &mut Rng,
) -> Option<Sequence> {
    change(search, way, to, Arrival::Exact, rng, Some(pool))
}

fn change(
    search: &mut Search,
    way: &Sequence,
    to: &GraspState,
    arrival: Arrival,
    rng: &mut Rng,
    pool: Option<&mut Pool>,
) -> Option<Sequence> {
    let model = search.model();
    let is_exact = arrival == Arrival::Exact;
    let joints = if is_exact { settled_joints(way.end(), to) } else { way.end().joints.clone() };
    let mut options = Vec::with_capacity(model.n_fingers());
    let mut goal = Choice::new();
    for (finger, own) in joints.into_iter().enumerate() {
        let contact = way.end().contact(finger);
        let moves = contact != to.contact(finger) || (is_exact && own != to.joints[finger]);
        let mut of_finger = vec![Candidate { contact, joints: own, follow: 1.0 }];
        if moves {
            of_finger.push(Candidate::present(to, finger));
        }
        goal.push(usize::from(moves));
        options.push(of_finger);
    }
    let mut table = ClosureTable::new(model, &options);
    if !table.is_closed(&goal, (1 << model.n_fingers()) - 1) {
        return None;
    }
    let way = if is_exact { settle(&mut search.workspace, way.clone(), to)? } else { way.clone() };
    // One of many ways to the same end: mostly not worth a long search for a finger's way.
    let n_runs = search.workspace.rrt_runs.all;
    search.workspace.rrt_iterations = patience_now(search);
    let tried = &mut Tried::default();
    let mut change = regrasp(&mut search.workspace, way.end(), &options, &goal, &mut table, tried, rng);
    if let (None, Some(pool)) = (&change, pool) {
        for (finger, of_finger) in options.iter_mut().enumerate() {
            of_finger.extend(pool.any(search, finger, OTHERS));
        }
        let mut table = ClosureTable::new(model, &options);
        let goal = ChangeGoal {
            is_there: |choice: &Choice| *choice == goal,
            // A finger that is not at its goal has to move once at least.
            n_away: |choice: &Choice| choice.iter().zip(&goal).filter(|(a, b)| a != b).count() as f64,
        };
        change = regrasp_over(&mut search.workspace, way.end(), &options, &goal, &mut table, RELOCATIONS, rng);
    }
    search.workspace.rrt_iterations = model.settings.rrt_iterations;
    if let Some(patience) = search.patience.as_mut().filter(|_| search.workspace.rrt_runs.all > n_runs) {
        patience.look_taken();
    }
    let way = way.then(change?)?;
    (!is_exact || way.end() == to).then_some(way)
}
