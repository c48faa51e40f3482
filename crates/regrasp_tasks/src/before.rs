//! What is refused before any search.

use crate::context::{Context, motion_of};
use crate::failing::{Tally, refused};
use crate::forces;
use crate::miss::{out_of_reach, with_posture};
use crate::placements::{Place, TOUCHING, is_apart};
use crate::station::arm_postures;
use regrasp_arms::Problem;
use regrasp_geometry::{Point, Pose};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::robot_miss::{Meeting, MetBody, MetKind};
use regrasp_plan::plan::PoseData;
use regrasp_robot::JointKind;
use std::sync::Arc;

/// Refuses a start or goal in collision, off every support or out of reach, and an object that is too heavy.
pub fn refuse(context: &Context, tally: &mut Tally) -> Result<(), Failure> {
    let query = context.query;
    let ends = [
        ("start", FailureKind::StartInvalid, &query.world_from_object_start, &query.start),
        ("goal", FailureKind::GoalInvalid, &query.world_from_object_goal, &query.end),
    ];
    for (name, kind, pose, posture) in ends {
        refuse_place(context, name, kind, (pose, posture))?;
        refuse_posture(context, name, kind, (posture, pose))?;
    }
    for (name, kind, pose, posture) in ends {
        refuse_reach(context, name, kind, pose, tally)?;
        let any =
            |hand: usize| context.hands[hand].grasps.iter().any(|grasp| forces::holds(context, hand, grasp, pose));
        if !(0..context.hands.len()).any(any) {
            let message = format!(
                "{name}: \"{}\" weighs {} kg, and no grasp of the lists holds that with normal forces of at most {} N, friction {} over {}, and \
                 the torques of the fingers",
                context.object.name,
                context.object.mass,
                context.promises.normal_force[1],
                context.object.friction,
                context.promises.friction_margin,
            );
            let advice = "make lists with a larger normal force, with stronger fingers or for a lighter object";
            let failure = refused(FailureKind::Impossible, message, advice);
            return Err(with_posture(failure, format!("{name}: too heavy"), (posture, pose), None));
        }
    }
    Ok(())
}

/// The object overlaps something, or touches no support.
fn refuse_place(
    context: &Context,
    name: &str,
    kind: FailureKind,
    (pose, posture): (&Pose, &[f64]),
) -> Result<(), Failure> {
    let object = &context.object.name;
    let mut others = context.scene.supports.len()..context.fixed.obstacles.len();
    if let Some(other) = others.find(|&other| !is_apart(context, pose, other, 0.0)) {
        let message = format!("{name}: \"{object}\" overlaps \"{}\"", context.fixed.obstacles[other].name);
        let failure = refused(kind, message, "move one of the two");
        let body = |name: &str, kind| MetBody { name: name.to_owned(), kind };
        let bodies = [body(object, MetKind::Carried), body(&context.fixed.obstacles[other].name, MetKind::Resting)];
        let meeting = Some(Meeting { bodies, overlap: None });
        return Err(with_posture(failure, format!("{name}: overlap"), (posture, pose), meeting));
    }
    if Place::new(context, pose).is_none() {
        let names: Vec<String> =
            context.scene.supports.iter().map(|support| format!("\"{}\"", support.body.name)).collect();
        let message = format!(
            "{name}: \"{object}\" touches no support within {} mm; the supports are {}",
            1e3 * TOUCHING,
            if names.is_empty() { "none".to_owned() } else { names.join(", ") }
        );
        let failure = refused(kind, message, "put the object onto a support");
        return Err(with_posture(failure, format!("{name}: no support"), (posture, pose), None));
    }
    Ok(())
}

/// The robot collides.
fn refuse_posture(
    context: &Context,
    name: &str,
    kind: FailureKind,
    (posture, pose): (&[f64], &Pose),
) -> Result<(), Failure> {
    let world = Arc::new(context.with_object(pose));
    let query = motion_of(context.query, posture.to_vec(), posture.to_vec());
    let problem = Problem::in_world(context.scene, &query, world, &context.covers);
    problem.refuse_start(&context.motion).map_err(|failure| {
        let what = failure.message.trim_start_matches("the start ").to_owned();
        let whose = if name == "start" { "the robot's posture at the start" } else { "the robot's posture at the end" };
        let mut found = refused(kind, format!("{name}: {whose} {what}"), &failure.advice);
        found.robot_miss = failure.robot_miss;
        if let Some(miss) = &mut found.robot_miss {
            miss.reason = format!("{name}: in collision");
            miss.world_from_object = Some(PoseData::from(pose));
        }
        found
    })
}

/// No arm gets there with any grasp, whatever the common joints do.
fn refuse_reach(
    context: &Context,
    name: &str,
    kind: FailureKind,
    pose: &Pose,
    tally: &mut Tally,
) -> Result<(), Failure> {
    let mut nearest: Option<(f64, String, [usize; 2])> = None;
    for (hand, own) in context.hands.iter().enumerate() {
        let (origin, reach) = reach(context, hand);
        let has_common = !context.common_above(hand).is_empty();
        for (index, grasp) in own.grasps.iter().enumerate() {
            tally.work(1);
            let world_from_hand = pose * grasp.object_from_hand;
            let mount = (world_from_hand * own.hand_from_mount).translation.vector;
            let by = (mount - origin.coords).norm() - reach;
            let missed = if by > 0.0 {
                let length = if by < 5e-4 { "less than 0.001".to_owned() } else { format!("{by:.3}") };
                (by, format!("the wrist of the hand \"{}\" would be {length} m too far", context.hand_name(hand)))
            } else if has_common {
                return Ok(());
            } else {
                match arm_postures(context, hand, &context.query.start, &world_from_hand, 1) {
                    Ok(_) => return Ok(()),
                    Err(missed) => missed,
                }
            };
            if nearest.as_ref().is_none_or(|nearest| missed.0 < nearest.0) {
                nearest = Some((missed.0, missed.1, [hand, index]));
            }
        }
    }
    let why = nearest.as_ref().map_or_else(String::new, |(_, why, _)| format!(" (nearest: {why})"));
    let message = format!("{name}: \"{}\" is out of reach of every arm{why}", context.object.name);
    let failure = refused(kind, message, "move the object nearer to the robot");
    Err(match nearest {
        Some((_, _, grasp)) => out_of_reach(context, failure, format!("{name}: out of reach"), (pose, grasp)),
        None => failure,
    })
}

/// Where the first joint above a hand is, and how far from it the mount link can be.
fn reach(context: &Context, hand: usize) -> (Point, f64) {
    let robot = &context.robot.robot;
    let mount = context.robot.arms[context.hands[hand].arm].mount;
    let mut poses = Vec::new();
    context.robot.link_poses(&context.query.start, &mut poses);
    let (mut origin, mut length) = (None, 0.0);
    for id in robot.joints_to(mount) {
        let joint = &robot.joints[id.0];
        if origin.is_some() {
            length += joint.parent_from_joint.translation.vector.norm();
        } else if joint.moves() {
            origin = Some(Point::from((poses[joint.parent.0] * joint.parent_from_joint).translation.vector));
        }
        if joint.moves() && joint.kind == JointKind::Prismatic {
            length += joint.limits.map_or(f64::INFINITY, |limits| limits.lower.abs().max(limits.upper.abs()));
        }
    }
    (origin.unwrap_or_else(|| poses[mount.0].translation.vector.into()), length + 1e-9)
}
