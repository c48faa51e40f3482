//! Which query a plan is judged against.

use crate::plan::Plan;
use regrasp_geometry::Pose;
use regrasp_scene::{GraspRequest, InHandQuery, Query, Scene, Task};

/// The query that `plan` answers in `scene`: the one that the plan says it was asked, where it says one, else that of `task` for
/// the plan's seed.
///
/// A plan that brings its query says from where and to where, no more: hand and object are those of `task`, limits, friction and
/// masses those of the scene. Whoever has asked something else gives that to [`crate::check::check`] instead.
pub fn query_of(scene: &Scene, task: &Task, plan: &Plan) -> Query {
    let Some(asked) = plan.asked.as_ref().filter(|_| task.motion.is_none()) else { return task.query(plan.seed) };
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
