//! What plans cost, and what no plan can cost less than.

use crate::in_hand::recording::record::kept_margin;
use crate::settings::CostWeights;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, frame};
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::sequence::{Motion, Sequence};
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::model::Model;
use regrasp_plan::plan::PlanFigures;
use regrasp_robot::kinematics::finger_ik::{Coordinates, IkSettings};

/// The figures of a sequence of motions that its cost is made of.
pub fn figures(model: &Model, weights: &CostWeights, way: &Sequence) -> PlanFigures {
    let mut figures =
        PlanFigures { relocations: 0, transfers: 0, object_path: 0.0, joint_path: 0.0, kept_margin: 0.0, cost: 0.0 };
    for (index, step) in way.steps().iter().enumerate() {
        let before = way.state_before(index);
        match step.motion() {
            Motion::Transfer(moments) => {
                figures.transfers += 1;
                let (mut pose, mut joints) = (&before.world_from_object, &before.joints);
                for moment in moments {
                    figures.object_path += frame::pose_distance(pose, &moment.world_from_object, model.turn_length());
                    figures.joint_path += hand_path(joints, &moment.joints);
                    (pose, joints) = (&moment.world_from_object, &moment.joints);
                }
            }
            Motion::Regrasp { finger, path } => {
                figures.relocations += u64::from(step.end().holds(*finger));
                let mut joints = &before.joints[*finger];
                for next in path {
                    figures.joint_path += joint_path(joints, next);
                    joints = next;
                }
            }
        }
    }
    figures.kept_margin = kept_margin(model, way);
    figures.cost = cost(model, weights, &figures);
    figures
}

/// Sum of the changes of a finger's joints, in radians or metres.
pub fn joint_path(from: &Coordinates, to: &Coordinates) -> f64 {
    from.iter().zip(to).map(|(a, b)| (b - a).abs()).sum()
}

fn hand_path(from: &HandJoints, to: &HandJoints) -> f64 {
    from.iter().zip(to).map(|(a, b)| joint_path(a, b)).sum()
}

fn cost(model: &Model, weights: &CostWeights, figures: &PlanFigures) -> f64 {
    let CostWeights { relocation, object_path, joint_path, margin: _ } = *weights;
    relocation * figures.relocations as f64
        + object_path * figures.object_path
        + joint_path * figures.joint_path
        + margin_cost(model, weights, figures.kept_margin)
}

/// What a plan pays for the closure margin that it keeps.
pub fn margin_cost(model: &Model, weights: &CostWeights, kept_margin: f64) -> f64 {
    match model.settings.closure_margin {
        // Without a margin asked for there is none to be kept.
        0.0 => 0.0,
        required => weights.margin * required / kept_margin.max(required),
    }
}

/// What no plan from `start` through `poses` costs less than; `start` and `goal` are the grasps given at the ends.
///
/// The object goes at least the straight way from pose to pose ([`frame::pose_distance`] is a metric), and a finger whose
/// contact at the start is not the one asked for at the goal, or out of its reach at some later pose, changes it at
/// least once. Nothing is said of joints and margins.
pub fn lower_bound(
    model: &Model,
    weights: &CostWeights,
    poses: &[Pose],
    start: Option<&GraspState>,
    goal: Option<&GraspState>,
) -> f64 {
    let straight: f64 =
        poses.windows(2).map(|pair| frame::pose_distance(&pair[0], &pair[1], model.turn_length())).sum();
    let must_move = |finger: usize| {
        // A contact that rolls may come to where it is asked for.
        if model.rolls(finger) {
            return false;
        }
        let contacts = [start, goal].map(|state| state.and_then(|state| state.contact(finger)));
        let is_out_of_reach = |pose: &Pose| {
            let mut given = contacts.iter().flatten();
            given.any(|contact| cannot_reach(model, finger, contact, &Placement::from(pose)))
        };
        matches!(contacts, [Some(first), Some(last)] if first != last) || poses.iter().any(is_out_of_reach)
    };
    let n_relocations = (0..model.n_fingers()).filter(|&finger| must_move(finger)).count();
    weights.relocation * n_relocations as f64 + weights.object_path * straight
}

/// True when no joints of `finger` within its limits reach `contact`. Only a closed form proves that.
pub fn cannot_reach(model: &Model, finger: usize, contact: &Contact, world_from_object: &Placement) -> bool {
    model.fingers[finger].cannot_touch(world_from_object, contact, &IkSettings::default())
}
