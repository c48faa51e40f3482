//! Straight ways of a hand, and proofs that motions are free.

use crate::context::Context;
use crate::failing::Tally;
use crate::timing::Smooth;
use regrasp_arms::model::ArmModel;
use regrasp_arms::motion::{ColliderSettings, Track};
use regrasp_arms::times::{TimedPath, TimedPoint};
use regrasp_arms::{Collider, World};
use regrasp_geometry::{Pose, Vector};
use regrasp_robot::manipulator::layout::Part;

/// Steps of a straight way in time.
pub const LINE_STEPS: usize = 16;

/// The way of a hand from the state `from` along `way`, without turning. None where the arm does not follow.
pub fn straight(context: &Context, hand: usize, from: &[f64], way: &Vector) -> Option<Smooth> {
    let own = &context.hands[hand];
    let n_steps = (way.norm() / context.settings.line_step).ceil().max(2.0) as usize;
    let mut poses = Vec::new();
    context.robot.link_poses(from, &mut poses);
    let base = poses[context.robot.arms[own.arm].base.0];
    let mount = poses[context.robot.arms[own.arm].mount.0];
    let mut states = vec![from.to_vec()];
    for step in 1..=n_steps {
        let shift = nalgebra::Translation3::from(way * (step as f64 / n_steps as f64));
        let base_from_mount: Pose = base.inverse() * (shift * mount);
        let last = &states[step - 1];
        let joints = own.ik.follow(&base_from_mount, &last[own.arm_joints.clone()])?;
        let mut state = last.clone();
        let is_jump = joints.iter().zip(&state[own.arm_joints.clone()]).any(|(a, b)| (a - b).abs() > MOST_CHANGE);
        if is_jump {
            return None;
        }
        state[own.arm_joints.clone()].copy_from_slice(&joints);
        states.push(state);
    }
    Some(Smooth::through(states))
}

/// Largest change of a joint in one step of a straight way, in radians or metres: more is a singularity.
const MOST_CHANGE: f64 = 0.25;

/// True where a robot keeps the clearance in a state.
pub fn is_state_free(context: &Context, model: &ArmModel, world: &World, state: &[f64], tally: &mut Tally) -> bool {
    are_states_free(context, model, world, std::slice::from_ref(&state.to_vec()), tally)[0]
}

/// The same for each of some states.
pub fn are_states_free(
    context: &Context,
    model: &ArmModel,
    world: &World,
    states: &[Vec<f64>],
    tally: &mut Tally,
) -> Vec<bool> {
    let all: Vec<Vec<f64>> = states.iter().map(|state| model.configuration_of(state)).collect();
    let mut collider = collider(context, model, world);
    let mut free = collider.are_free(&all);
    free.iter_mut().zip(&all).for_each(|(is_free, at)| *is_free &= model.is_within_limits(at, 1e-9));
    count(&collider, tally);
    free
}

/// True where a robot keeps the clearance at every moment of a motion.
pub fn is_motion_free(
    context: &Context,
    model: &ArmModel,
    world: &World,
    timed: &TimedPath,
    tally: &mut Tally,
) -> bool {
    let mut collider = collider(context, model, world);
    let is_free = is_free(&mut collider, timed);
    count(&collider, tally);
    is_free
}

/// The same for the open hand on its way to a grasp of its list: the list has proved that the hand does not hit the object, so that only
/// the rest of the robot is tested against that. Plans are tested in full.
pub fn is_way_free(
    context: &Context,
    (model, hand): (&ArmModel, usize),
    world_from_object: &Pose,
    timed: &TimedPath,
    tally: &mut Tally,
) -> bool {
    let alone = World::default().with(&context.alone, world_from_object);
    let mut tests = way_colliders(context, (model, hand), &alone);
    let is_free = tests.iter_mut().all(|test| is_free(test, timed));
    tests.iter().for_each(|test| count(test, tally));
    is_free
}

/// The tests of such a way: what the arm moves against what rests and the robot; all of it but the hand against the object, which is all
/// of `alone`.
pub fn way_colliders<'c>(
    context: &'c Context,
    (model, hand): (&'c ArmModel, usize),
    alone: &'c World,
) -> [Collider<'c>; 2] {
    let mounted = Part::Hand(context.hands[hand].mounted);
    // All else rests, where it was free.
    let arm: Vec<usize> = (0..model.dimension())
        .filter(|&k| context.hands[hand].arm_joints.contains(&model.coordinates[k].index))
        .collect();
    let moves = |body: usize| model.is_moved_by(body, &arm);
    let mut robot = collider(context, model, &context.fixed);
    robot.only(moves, |[a, b]| moves(a) || moves(b));
    let mut others = collider(context, model, alone);
    others.only(|body| moves(body) && context.robot.part_of(model.bodies[body].link) != mounted, |_| false);
    [robot, others]
}

/// The same where what is carried may touch what stands in `world` but not in `without`.
pub fn is_lift_free(
    context: &Context,
    model: &ArmModel,
    [world, without]: [&World; 2],
    timed: &TimedPath,
    tally: &mut Tally,
) -> bool {
    let mut tests = lift_colliders(context, model, [world, without]);
    let is_free = tests.iter_mut().all(|test| is_free(test, timed));
    tests.iter().for_each(|test| count(test, tally));
    is_free
}

/// The tests of such a motion: the robot in `world`, and what it carries in `without`.
pub fn lift_colliders<'c>(
    context: &Context,
    model: &'c ArmModel,
    [world, without]: [&'c World; 2],
) -> [Collider<'c>; 2] {
    let is_carried = |body: usize| model.bodies[body].attached.is_some();
    let mut robot = collider(context, model, world);
    robot.only(|body| !is_carried(body), |_| true);
    let mut object = collider(context, model, without);
    object.only(is_carried, |_| false);
    [robot, object]
}

fn is_free(collider: &mut Collider, timed: &TimedPath) -> bool {
    let model = collider.model;
    let own = |values: &[f64]| model.configuration_of(values);
    let track = |pair: &[TimedPoint]| {
        let velocities = [0, 1].map(|end| own(&pair[end].velocities));
        let ends = [0, 1].map(|end| own(&pair[end].joints));
        Track::cubic(&ends[0], &ends[1], [&velocities[0], &velocities[1]], pair[1].time - pair[0].time)
    };
    let tracks: Vec<Track> = timed.points.windows(2).map(track).collect();
    tracks.iter().all(|track| keeps_limits(model, track)) && collider.are_certified_free(&tracks)
}

/// True where a cubic stays within all limits: it lies in the hull of its Bernstein coefficients.
fn keeps_limits(model: &ArmModel, track: &Track) -> bool {
    let control = |k: usize| -> Vec<f64> {
        let of = |c: &[f64; 4]| match k {
            0 => c[0],
            1 => c[0] + c[1] / 3.0,
            2 => c[0] + (2.0 * c[1] + c[2]) / 3.0,
            _ => c[0] + c[1] + c[2] + c[3],
        };
        track.coefficients.iter().map(of).collect()
    };
    (0..4).all(|k| model.is_within_limits(&control(k), 1e-9))
}

/// Tests of a robot in a world, with the clearance that the task keeps.
pub fn collider<'c>(context: &Context, model: &'c ArmModel, world: &'c World) -> Collider<'c> {
    let settings = ColliderSettings { clearance: context.settings.clearance, ..ColliderSettings::default() };
    Collider::new(model, world, settings)
}

/// Counts the work of a test.
pub fn count(collider: &Collider, tally: &mut Tally) {
    tally.work(8 * collider.counts.blocks + collider.counts.exact);
}
