//! Which query a plan is judged against.

use crate::check::violation::{Violation, ViolationKind};
use crate::check::{CheckSettings, Log};
use crate::plan::Plan;
use regrasp_geometry::Pose;
use regrasp_scene::{GraspRequest, InHandQuery, Query, Scene, Task};
use serde::{Deserialize, Serialize};

/// Whether a plan may bring the query that it answers, as plans of sessions do. Such a plan answers any question: its own. Only
/// who knows that question can allow it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OwnQuery {
    /// The plan answers the scene file's query, or it is rejected.
    #[default]
    Refused,
    /// The plan may begin and end where it says that it was asked to.
    Allowed,
}

/// Rejects a plan that brings its query where that is not allowed.
pub(super) fn check_own_query(plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    if plan.asked.is_some() && settings.own_query == OwnQuery::Refused {
        let message = "the plan answers a query that it brings itself, not that of the scene file: judge it against the query \
                       that was asked, or allow its own (--own-query)";
        log.push(Violation::new(ViolationKind::WrongScene, message).subjects(["asked"]));
    }
}

/// The query that `plan` answers in `scene`: the one that the plan says it was asked, where it says one, else that of `task` for
/// the plan's seed.
///
/// A plan that brings its query says from where and to where, no more: hand and object are those of `task`, limits, friction and
/// masses those of the scene. Whoever has asked something else gives that to [`crate::check::check`] instead.
pub fn query_of(scene: &Scene, task: &Task, plan: &Plan) -> Query {
    let Some(asked) = plan.asked.as_ref().filter(|_| task.of_robot.is_none()) else { return task.query(plan.seed) };
    let fingers = scene.hands.get(task.hand).map_or(&[][..], |placed| placed.hand.fingers.as_slice());
    let holds = fingers.iter().map(|finger| !asked.free.contains(&finger.name)).collect();
    Query::InHand(InHandQuery {
        name: task.name.clone(),
        hand: task.hand,
        object: task.object,
        world_from_object_start: Pose::from(&asked.start),
        world_from_object_way: Vec::new(),
        world_from_object_goal: Pose::from(&asked.goal),
        start_grasp: GraspRequest::Posture { joints: asked.joints.clone(), holds },
        goal_grasp: GraspRequest::Automatic,
        open_start: None,
    })
}
