//! Grasps of other tools become a list: their contacts are found by closing the hand, and what this tool would not find, as it does not
//! hold, hits something or has no way in, is dropped.

use crate::found::{Found, Reason};
use crate::prepared::Prepared;
use crate::search::frame::accept;
use crate::search::worth::{self, holding};
use crate::settings::GraspSettings;
use crate::{Failure, FailureKind, above, driven, record, view_of, whole_hand};
use rayon::prelude::*;
use regrasp_geometry::Pose;
use regrasp_grasp::list::{ForeignGrasp, ForeignGrasps, GraspList, GraspStatistics};
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::grasp::touch::touch_on_way;
use regrasp_manipulation::model::Model;
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_robot::{Hand, JointId};
use regrasp_scene::Object;
use std::collections::BTreeMap;

/// A grasp that is not kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dropped {
    /// Its name.
    pub name: String,
    /// Why, in words.
    pub reason: String,
}

/// What became of the grasps of another tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Those that are kept, best score first.
    pub list: GraspList,
    /// The others, in their order.
    pub dropped: Vec<Dropped>,
}

/// Makes a list of `foreign`. The same on any number of threads.
///
/// Errors: a joint or link that the hand does not have, a joint without a position, hands and objects that no list is made of.
pub fn import_grasps(
    hand: &Hand,
    object: &Object,
    foreign: &ForeignGrasps,
    settings: &GraspSettings,
) -> Result<Imported, Failure> {
    settings.validate().map_err(|problem| Failure::of_settings(&problem))?;
    let refused = |problem: String, advice: &str| Failure::bare(FailureKind::Impossible, problem, advice);
    let whole = whole_hand::whole_hand(hand)
        .map_err(|problem| refused(problem, "give the link a collision shape with an inside"))?;
    let view = view_of(&whole, object);
    Failure::refuse_many_fingers(&view)?;
    let model = Model::new(&view, &settings.physics());
    let prepared = Prepared::new(&model, settings, 0)?;
    let link_from_base = link_from_base(&whole, &foreign.hand_link)
        .map_err(|problem| refused(problem, "gripper_frame_link is the hand's base link, or one fixed to it"))?;
    let read = |grasp: &ForeignGrasp| -> Result<Given, String> {
        let of = |what, joints| {
            by_name(&whole, joints).map_err(|problem| format!("grasp \"{}\": {what}: {problem}", grasp.name))
        };
        let joints = of("cspace_position", &grasp.joints)?;
        let open = grasp.open_joints.as_ref().map(|open| of("pregrasp_cspace_position", open)).transpose()?;
        Ok(Given { hand_from_object: (Pose::from(&grasp.object_from_link) * link_from_base).inverse(), joints, open })
    };
    let given: Result<Vec<Given>, String> = foreign.grasps.iter().map(read).collect();
    let given = given.map_err(|problem| refused(problem, "joints are named as in the hand's robot file"))?;
    let threads = rayon::ThreadPoolBuilder::new()
        .num_threads(settings.n_threads.max(1))
        .build()
        .map_err(|error| refused(format!("no threads: {error}"), "ask for fewer threads"))?;
    let judge = |(index, given): (usize, &Given)| judge(&prepared, index as u64, given);
    let results: Vec<Result<Found, Reason>> = threads.install(|| given.par_iter().enumerate().map(judge).collect());
    let names: Vec<&str> = whole.fingers.iter().map(|finger| finger.name.as_str()).collect();
    let (mut found, mut dropped, mut rejected) = (Vec::new(), Vec::new(), BTreeMap::<String, u64>::new());
    for (result, grasp) in results.into_iter().zip(&foreign.grasps) {
        match result {
            Ok(one) => found.push(one),
            Err(reason) => {
                let reason = reason.in_words(&names);
                *rejected.entry(reason.clone()).or_default() += 1;
                dropped.push(Dropped { name: grasp.name.clone(), reason });
            }
        }
    }
    found.sort_by(|a: &Found, b| b.score.total_cmp(&a.score).then(a.frame.cmp(&b.frame)));
    let n_given = foreign.grasps.len() as u64;
    let statistics = GraspStatistics {
        frames: n_given,
        frames_tried: n_given,
        rejected,
        found: found.len() as u64,
        ..GraspStatistics::default()
    };
    Ok(Imported { list: record::list(&prepared, statistics, &found), dropped })
}

/// A grasp in the terms of the hand.
struct Given {
    hand_from_object: Pose,
    joints: HandJoints,
    open: Option<HandJoints>,
}

/// The grasp complete, or why it is none.
fn judge(prepared: &Prepared, index: u64, given: &Given) -> Result<Found, Reason> {
    let mut workspace = Workspace::new(prepared.model);
    workspace.place_object(&given.hand_from_object);
    if !workspace.palm_is_clear() {
        return Err(Reason::Palm);
    }
    let open = given.open.clone().unwrap_or_else(|| match &prepared.motors {
        Some(motors) => motors.opened(&given.joints, 1.0),
        None => prepared.model.view.hand.fingers.iter().map(|finger| finger.rest.iter().copied().collect()).collect(),
    });
    let fingers = (0..open.len()).map(|f| {
        let touch = touch_on_way(prepared.model, f, &given.hand_from_object, &open[f], &given.joints[f]);
        touch.map_or((None, given.joints[f].clone()), |(contact, joints)| (Some(contact), joints))
    });
    let state = GraspState::of(given.hand_from_object, fingers);
    if holding(&state).count() < prepared.least_contacts() {
        return Err(Reason::TooFewContacts);
    }
    workspace.set_state(&state);
    if !workspace.is_clear(TipMode::AllHold) {
        return Err(Reason::Fingers);
    }
    let margin = worth::margin(prepared, &state);
    if margin < prepared.settings.margin {
        return Err(Reason::NotClosed);
    }
    let flatness = driven::flatness(prepared, &state);
    let mut found = accept(prepared, &mut workspace, index, state, (&flatness, margin), given.open.as_ref())?;
    found.stable_poses = above::stays_above(prepared, &found.state, &found.way);
    Ok(found)
}

/// Joints finger by finger. What follows joints of other fingers goes where these put it.
fn by_name(hand: &Hand, joints: &BTreeMap<String, f64>) -> Result<HandJoints, String> {
    let known = hand.joint_names();
    if let Some(name) = joints.keys().find(|name| !known.contains(name) && hand.robot.joint_named(name).is_none()) {
        return Err(format!("the hand has no joint \"{name}\"; it has {}", known.join(", ")));
    }
    let position = |name: &str| -> Result<f64, String> {
        let tie = hand.ties.iter().find(|tie| hand.robot.joints[tie.follower.0].name == name);
        if let Some(tie) = tie {
            let mut sum = tie.coupling.offset;
            for (leader, factor) in &tie.coupling.terms {
                let leader: JointId = *leader;
                sum += factor * joints.get(&hand.robot.joints[leader.0].name).ok_or("a joint is missing")?;
            }
            return Ok(sum);
        }
        joints.get(name).copied().ok_or_else(|| format!("joint \"{name}\" has no position"))
    };
    hand.fingers.iter().map(|finger| finger.chain.names.iter().map(|name| position(name)).collect()).collect()
}

/// The hand's base seen from a link that is fixed to it.
fn link_from_base(hand: &Hand, name: &str) -> Result<Pose, String> {
    let robot = &hand.robot;
    let base = &robot.links[hand.base.0].name;
    let Some(link) = robot.links.iter().position(|link| link.name == name) else {
        return Err(format!("the hand has no link \"{name}\"; its base link is \"{base}\""));
    };
    let path = |link: regrasp_robot::LinkId| robot.joints_to(link);
    let (to_link, to_base) = (path(regrasp_robot::LinkId(link)), path(hand.base));
    let n_shared = to_link.iter().zip(&to_base).take_while(|(a, b)| a == b).count();
    let along = |joints: &[JointId]| -> Option<Pose> {
        joints.iter().try_fold(Pose::identity(), |pose, joint| {
            let joint = &robot.joints[joint.0];
            (!joint.moves()).then(|| pose * joint.parent_from_joint)
        })
    };
    match (along(&to_link[n_shared..]), along(&to_base[n_shared..])) {
        (Some(link), Some(base)) => Ok(link.inverse() * base),
        _ => Err(format!("link \"{name}\" moves against the base link \"{base}\"")),
    }
}
