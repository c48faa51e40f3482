//! A hand changes its grasp while it holds the object: it carries the object to a free place, and the in-hand planner does the rest.

use crate::context::Context;
use crate::exchange::{Places, turns};
use crate::failing::{Stage, Tally, Try};
use crate::forces;
use crate::line::is_state_free;
use crate::station::{arm_postures, with_fingers};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_base::Budget;
use regrasp_geometry::{Point, Pose};
use regrasp_manipulation::settings::PhysicsSettings;
use regrasp_plan::Plan;
use regrasp_plan::plan::{Promises, SegmentKind};
use regrasp_plan::robot_plan::{InHandPart, RobotContact, RobotSegment, RobotSegmentKind, RobotWaypoint};
use regrasp_planners::{InHandSettings, plan_in_hand};
use regrasp_scene::{GraspRequest, HandView, InHandQuery, Manipulation, State};
use std::collections::BTreeMap;

/// Orientations of the object in which a change is looked for. They differ in how the weight pulls on the fingers.
const ORIENTATIONS: usize = 3;
/// They differ by at least this angle, in radians.
const APART: f64 = 0.7;
/// Postures of the arm that are looked at for one pose.
const POSTURES: usize = 3;
/// Joints of the end may differ from those of the grasp by this much, in radians or metres: rounding. The judge allows a nanometre.
const SAME: f64 = 5e-10;
/// Beyond this no change is tried: the turn of the object in the hand, in radians, and how far it shifts, in metres. By hand: what
/// fingers do in some steps.
const LARGEST_TURN: f64 = 2.0;
const LARGEST_SHIFT: f64 = 0.06;
/// What a shift counts against a turn, in radians per metre.
const TURN_PER_METRE: f64 = 20.0;

/// A change of grasp.
#[derive(Debug, Clone)]
pub struct Change {
    /// Hand and index of the grasp before.
    pub from: [usize; 2],
    /// Hand and index of the grasp after.
    pub to: [usize; 2],
    /// Where the robot is meanwhile, with the fingers of the grasp before.
    pub at: Vec<f64>,
    /// The motion.
    pub plan: Plan,
}

/// How far the object moves in the hand from one grasp to another one, in radians. None where that is too far, where a hand cannot
/// change its grasp, or where not all fingers hold at the end.
pub fn distance(context: &Context, hand: usize, [from, to]: [usize; 2]) -> Option<f64> {
    let own = &context.hands[hand];
    let n_fingers = own.model.n_fingers();
    if from == to || !own.model.may_release || own.grasps[to].held.fingers.len() < n_fingers {
        return None;
    }
    let [a, b] = [from, to].map(|grasp| own.grasps[grasp].object_from_hand.inverse());
    let center = context.object.center_of_mass;
    let turn = a.rotation.angle_to(&b.rotation);
    let shift = (a * center - b * center).norm();
    (turn <= LARGEST_TURN && shift <= LARGEST_SHIFT).then_some(turn + TURN_PER_METRE * shift)
}

/// A change from one grasp to another one. Err with a reason.
pub fn change(
    context: &Context,
    places: &Places,
    [hand, from, to]: [usize; 3],
    tally: &mut Tally,
) -> Result<Change, &'static str> {
    let grasps = [from, to].map(|grasp| &context.hands[hand].grasps[grasp]);
    let mut reason = "out of reach";
    // Palms up first: fingers from below carry the weight while one of them is away.
    let mut ranked: Vec<(f64, UnitQuaternion<f64>)> =
        turns().into_iter().map(|turn| ((turn * grasps[0].direction).dot(&context.up()), turn)).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut tried: Vec<UnitQuaternion<f64>> = Vec::new();
    for (_, turn) in ranked {
        // About the vertical the weight pulls in the same way.
        let down = |turn: &UnitQuaternion<f64>| turn.inverse() * -context.up();
        if tried.len() >= ORIENTATIONS || tried.iter().any(|other| down(other).angle(&down(&turn)) < APART) {
            continue;
        }
        let Some((at, pose)) = places.iter().find_map(|at| free_at(context, [hand, from], at, &turn, tally)) else {
            continue;
        };
        tried.push(turn);
        let failed = |tally: &mut Tally, reason: &str| {
            let so_far = rank(reason);
            tally.keep(Stage::InHand, so_far, || Try {
                reason: reason.into(),
                world_from_object: Some(pose),
                grasps: vec![[hand, from]],
                state: Some(at.clone()),
            });
        };
        reason = nearer(reason, "that do not hold the weight");
        if grasps.iter().any(|grasp| !forces::holds(context, hand, grasp, &pose)) {
            failed(tally, reason);
            continue;
        }
        reason = nearer(reason, "without a motion in the hand");
        if let Some(plan) = search(context, [hand, from, to], (&at, &pose), tally) {
            return Ok(Change { from: [hand, from], to: [hand, to], at, plan });
        }
        failed(tally, reason);
    }
    if tried.is_empty() {
        tally.keep(Stage::InHand, 0, || Try {
            reason: reason.into(),
            world_from_object: None,
            grasps: vec![[hand, from]],
            state: None,
        });
    }
    Err(reason)
}

/// The reason that is nearer to success.
fn nearer(old: &'static str, new: &'static str) -> &'static str {
    if rank(new) > rank(old) { new } else { old }
}

/// How near to success a reason is.
fn rank(reason: &str) -> usize {
    const ORDER: [&str; 3] = ["out of reach", "that do not hold the weight", "without a motion in the hand"];
    ORDER.iter().position(|other| *other == reason).unwrap_or(0)
}

/// A free posture with the object in a grasp, its centre of mass at a point.
fn free_at(
    context: &Context,
    [hand, grasp]: [usize; 2],
    at: &Point,
    turn: &UnitQuaternion<f64>,
    tally: &mut Tally,
) -> Option<(Vec<f64>, Pose)> {
    let own = &context.hands[hand].grasps[grasp];
    let position = at.coords - turn * context.object.center_of_mass.coords;
    let pose = Pose::from_parts(Translation3::from(position), *turn);
    let closed = with_fingers(context, &context.query.start, hand, &own.closed);
    tally.work(1);
    let postures = arm_postures(context, hand, &closed, &(pose * own.object_from_hand), POSTURES)
        .map_err(|(by, words)| tally.miss(Stage::InHand, by, || words))
        .ok()?;
    let hand_from_object = own.object_from_hand.inverse();
    let model = context.model(&closed, &context.arms_and_torso, Some((hand, &hand_from_object)));
    let free = postures.into_iter().find(|state| is_state_free(context, &model, &context.fixed, state, tally))?;
    let pose = context.world_from_hand(hand, &free) * hand_from_object;
    Some((free, pose))
}

/// The scene's state with the robot in a posture and the object at a pose.
fn state_at(context: &Context, robot: &[f64], world_from_object: &Pose) -> State {
    let mut state = context.rest.clone();
    state.robot_joints[context.query.robot] = robot.to_vec();
    for (index, placed) in context.scene.hands.iter().enumerate() {
        let Some(carrier) = placed.carrier.filter(|carrier| carrier.robot == context.query.robot) else { continue };
        state.hand_joints[index] = context.robot.finger_joints(carrier.hand, robot).to_vec();
    }
    state.world_from_objects[context.query.object] = *world_from_object;
    state
}

/// The motion in the hand; None where none is found, or where it ends beside the grasp.
fn search(
    context: &Context,
    [hand, from, to]: [usize; 3],
    (at, world_from_object): (&[f64], &Pose),
    tally: &mut Tally,
) -> Option<Plan> {
    let own = &context.hands[hand];
    let [before, after] = [from, to].map(|grasp| &own.grasps[grasp]);
    let state = state_at(context, at, world_from_object);
    let manipulation =
        Manipulation { scene: context.scene, state: &state, hand_index: own.index, object_index: context.query.object };
    let view = HandView::of(&manipulation);
    let holds: Vec<bool> = (0..own.model.n_fingers()).map(|finger| before.held.fingers.contains(&finger)).collect();
    let joints = before.closed.clone();
    let start_grasp = match holds.iter().all(|holds| *holds) {
        true => GraspRequest::Joints(joints),
        false => GraspRequest::Posture { joints, holds },
    };
    let query = InHandQuery {
        name: String::new(),
        hand: own.index,
        object: context.query.object,
        world_from_object_start: *world_from_object,
        world_from_object_way: Vec::new(),
        world_from_object_goal: context.world_from_hand(hand, at) * after.object_from_hand.inverse(),
        start_grasp,
        goal_grasp: GraspRequest::Joints(after.closed.clone()),
        open_start: None,
    };
    let physics = PhysicsSettings { closure_margin: context.promises.required_margin, ..context.physics.clone() };
    let settings = InHandSettings { physics, advise: false, ..InHandSettings::default() };
    let left = context.budget.max_work.saturating_sub(tally.statistics.work);
    let budget = Budget { max_work: context.settings.in_hand_work.min(left), ..context.budget.clone() };
    match plan_in_hand(&view, &query, &settings, context.seed, &budget, &|_| {}) {
        Ok(plan) => {
            tally.work(plan.statistics.work);
            let first = plan.segments.first()?.waypoints.first()?;
            let last = plan.segments.last()?.waypoints.last()?;
            let is_same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME);
            (is_same(&first.joints, &before.closed) && is_same(&last.joints, &after.closed)).then_some(plan)
        }
        Err(failure) => {
            tally.work(failure.statistics.work.max(100));
            None
        }
    }
}

/// The segments of a change, with the robot in the posture `at`; times are those of the in-hand plan.
pub fn segments(context: &Context, change: &Change, at: &[f64]) -> Vec<RobotSegment> {
    let hand = &context.hands[change.from[0]];
    let name = context.hand_name(change.from[0]);
    let object = &context.object.name;
    let waypoint = |own: &regrasp_plan::plan::Waypoint| {
        let (mut joints, mut joint_velocities) = (at.to_vec(), vec![0.0; at.len()]);
        joints[hand.fingers.clone()].copy_from_slice(&own.joints);
        joint_velocities[hand.fingers.clone()].copy_from_slice(&own.joint_velocities);
        let contact = |(finger, contact): (&String, &regrasp_plan::plan::ContactState)| {
            Some(RobotContact {
                hand: name.to_owned(),
                finger: finger.clone(),
                object: object.clone(),
                mode: contact.mode,
                point_in_object: contact.point_in_object?,
                normal_in_object: contact.normal_in_object?,
                force_in_object: contact.force_in_object,
                torsion: contact.torsion,
            })
        };
        RobotWaypoint {
            time: own.time,
            joints,
            joint_velocities,
            world_from_objects: vec![own.world_from_object],
            contacts: change.plan.fingers.iter().zip(&own.contacts).filter_map(contact).collect(),
        }
    };
    let segment = |own: &regrasp_plan::plan::Segment| RobotSegment {
        kind: match own.kind {
            SegmentKind::Regrasp => RobotSegmentKind::Regrasp,
            SegmentKind::Transfer | SegmentKind::Tracking => RobotSegmentKind::Transfer,
        },
        held_by: BTreeMap::from([(object.clone(), vec![name.to_owned()])]),
        in_hand: Some(Box::new(InHandPart {
            moving_finger: own.moving_finger.clone(),
            joint_torques: own.waypoints.iter().map(|waypoint| waypoint.joint_torques.clone()).collect(),
        })),
        waypoints: own.waypoints.iter().map(waypoint).collect(),
    };
    change.plan.segments.iter().map(segment).collect()
}

/// What plans with these changes promise, by the name of the hand. Of several changes in one hand the least margin counts; all else is
/// the same in all.
pub fn promises<'c>(context: &Context, changes: impl Iterator<Item = &'c Change>) -> BTreeMap<String, Promises> {
    let mut found: BTreeMap<String, Promises> = BTreeMap::new();
    for change in changes {
        let own = &change.plan.promises;
        let known = found.entry(context.hand_name(change.from[0]).to_owned()).or_insert_with(|| own.clone());
        known.kept_margin = known.kept_margin.min(own.kept_margin);
        known.required_margin = known.required_margin.min(own.required_margin);
    }
    found
}
