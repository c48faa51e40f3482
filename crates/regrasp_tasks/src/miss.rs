//! The nearest miss as a posture: what failed is looked at again, and now with the question what meets what.
//!
//! Searches only count. All that costs time is done here, once, where no plan was found.

/// Two bodies that meet, in a posture or on the way from it.
mod meeting;
/// Arms stretched towards what is out of their reach.
mod stretched;

use crate::context::Context;
use crate::exchange::{HANDS_TOUCH, Places};
use crate::failing::{Stage, Tally, Try};
use crate::station::{arm_postures, with_fingers};
use meeting::first_meeting;
use regrasp_geometry::Pose;
use regrasp_manipulation::failure::Failure;
use regrasp_manipulation::robot_miss::{ExchangeOutcome, Meeting, RobotMiss, TriedExchange, WantedHand};
use regrasp_plan::plan::PoseData;
use std::collections::BTreeMap;
use stretched::stretched;

/// Poses of the object at which an exchange is looked at again, where it fails wherever the object is.
const POSES: usize = 32;
/// What counts for a hand out of reach, in metres of overlap: no posture is worse than one that collides.
const OUT_OF_REACH: f64 = 10.0;
/// What counts where no meeting was found, or its depth is unknown, in metres of overlap.
const UNKNOWN: f64 = 1.0;

/// Where the object was, and the robot.
pub struct Seen {
    world_from_object: Pose,
    state: Vec<f64>,
    wanted: Vec<WantedHand>,
}

/// The failure with the nearest of the tries that were kept at the stage that it names. Least is what overlaps least.
pub fn with_nearest(
    mut failure: Failure,
    context: &Context,
    tally: &Tally,
    exchange: &BTreeMap<[usize; 2], Places>,
) -> Failure {
    let stage = tally.failing_stages()[0];
    let mut nearest: Option<(f64, RobotMiss)> = None;
    for tried in tally.telling_tries(stage) {
        let found = look_again(context, (stage, tried), exchange);
        if nearest.as_ref().is_none_or(|nearest| found.0 < nearest.0) {
            nearest = Some(found);
        }
    }
    if let Some((_, mut miss)) = nearest {
        miss.exchanges = tried_exchanges(context, tally.telling_tries(stage), exchange);
        failure.robot_miss = Some(Box::new(miss));
    }
    failure
}

/// Places of exchanges. Where hands touch in all pairs of grasps, or in nearly all, those are the best places for such a pair.
fn tried_exchanges(context: &Context, tries: &[Try], exchange: &BTreeMap<[usize; 2], Places>) -> Vec<TriedExchange> {
    let touching = tries.iter().find(|tried| tried.reason == HANDS_TOUCH);
    let Some(pair) = touching.and_then(|tried| <[[usize; 2]; 2]>::try_from(tried.grasps.as_slice()).ok()) else {
        let of_two = exchange.iter().filter(|(hands, _)| hands[0] != hands[1]);
        return of_two.flat_map(|(_, places)| places.tried()).collect();
    };
    let places = Places::new(context, pair.map(|[hand, _]| hand));
    let outcome = ExchangeOutcome::HandsTouch;
    places.iter().map(|at| TriedExchange { position: at.coords.into(), outcome }).collect()
}

/// How bad a try is, and what is wrong with it.
fn look_again(
    context: &Context,
    (stage, tried): (Stage, &Try),
    exchange: &BTreeMap<[usize; 2], Places>,
) -> (f64, RobotMiss) {
    let seen = match (&tried.state, tried.world_from_object) {
        (Some(state), Some(pose)) => Seen { world_from_object: pose, state: state.clone(), wanted: Vec::new() },
        (_, Some(pose)) => seen_at(context, &pose, &tried.grasps),
        (_, None) => seen_anywhere(context, tried, exchange),
    };
    let reason = format!("{}: {}", stage.name(), tried.reason);
    // A hand that is out of reach is missing there; what it would meet says nothing.
    let found = match seen.wanted.is_empty() {
        true => first_meeting(context, (stage, tried), &seen),
        false => None,
    };
    let far: f64 = seen.wanted.iter().map(missing).sum();
    let depth = |meeting: &Meeting| meeting.overlap.map_or(UNKNOWN, |overlap| overlap.max(0.0));
    let by = match seen.wanted.is_empty() {
        true => found.as_ref().map_or(UNKNOWN, |(_, _, meeting)| depth(meeting)),
        false => OUT_OF_REACH + far,
    };
    let miss = match found {
        Some((state, pose, meeting)) => RobotMiss {
            world_from_object: Some(PoseData::from(&pose)),
            meeting: Some(meeting),
            ..RobotMiss::at(reason, state)
        },
        None => RobotMiss {
            world_from_object: Some(PoseData::from(&seen.world_from_object)),
            wanted: seen.wanted,
            ..RobotMiss::at(reason, seen.state)
        },
    };
    (by, miss)
}

/// How far the wrist is from where it should be, in metres.
fn missing(wanted: &WantedHand) -> f64 {
    let [from, to] = wanted.wrist;
    (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt()
}

/// Hands at the object at a pose: in postures of their arms, else stretched towards it.
pub fn seen_at(context: &Context, world_from_object: &Pose, grasps: &[[usize; 2]]) -> Seen {
    let mut state = context.query.start.clone();
    let mut wanted = Vec::new();
    for &[hand, grasp] in grasps {
        let own = &context.hands[hand].grasps[grasp];
        state = with_fingers(context, &state, hand, &own.closed);
        let world_from_hand = world_from_object * own.object_from_hand;
        match arm_postures(context, hand, &state, &world_from_hand, 1) {
            Ok(postures) => state = postures.into_iter().next().unwrap_or(state),
            Err(_) => {
                let mount = world_from_hand * context.hands[hand].hand_from_mount;
                let (reached, at) = stretched(context, hand, &state, &mount.translation.vector.into());
                state = reached;
                wanted.push(WantedHand {
                    hand: context.hand_name(hand).to_owned(),
                    world_from_hand: PoseData::from(&world_from_hand),
                    joints: own.closed.clone(),
                    wrist: [at.coords.into(), mount.translation.vector.into()],
                });
            }
        }
    }
    Seen { world_from_object: *world_from_object, state, wanted }
}

/// The same where the object may be anywhere: the first of the best places of the exchange that all arms reach.
fn seen_anywhere(context: &Context, tried: &Try, exchange: &BTreeMap<[usize; 2], Places>) -> Seen {
    let (Some(first), Some(last)) = (tried.grasps.first(), tried.grasps.last()) else {
        return seen_at(context, &context.query.world_from_object_start, &[]);
    };
    let pair = [*first, *last];
    let hands = pair.map(|[hand, _]| hand);
    let made;
    let places = match exchange.get(&hands) {
        Some(places) => places,
        None => {
            made = Places::new(context, hands);
            &made
        }
    };
    let mut nearest: Option<(f64, Seen)> = None;
    for pose in places.poses(context, pair).take(POSES) {
        let seen = seen_at(context, &pose, &tried.grasps);
        let far: f64 = seen.wanted.iter().map(missing).sum();
        if seen.wanted.is_empty() {
            return seen;
        }
        if nearest.as_ref().is_none_or(|nearest| far < nearest.0) {
            nearest = Some((far, seen));
        }
    }
    let start = || seen_at(context, &context.query.world_from_object_start, &tried.grasps);
    nearest.map_or_else(start, |(_, seen)| seen)
}

/// A failure before any search, with a posture and the object's pose.
pub fn with_posture(
    mut failure: Failure,
    reason: String,
    (joints, world_from_object): (&[f64], &Pose),
    meeting: Option<Meeting>,
) -> Failure {
    let miss = RobotMiss {
        world_from_object: Some(PoseData::from(world_from_object)),
        meeting,
        ..RobotMiss::at(reason, joints.to_vec())
    };
    failure.robot_miss = Some(Box::new(miss));
    failure
}

/// A failure before any search: the hand of the nearest grasp is out of reach.
pub fn out_of_reach(
    context: &Context,
    mut failure: Failure,
    reason: String,
    (world_from_object, grasp): (&Pose, [usize; 2]),
) -> Failure {
    let Seen { state, wanted, .. } = seen_at(context, world_from_object, &[grasp]);
    let miss = RobotMiss {
        world_from_object: Some(PoseData::from(world_from_object)),
        wanted,
        ..RobotMiss::at(reason, state)
    };
    failure.robot_miss = Some(Box::new(miss));
    failure
}
