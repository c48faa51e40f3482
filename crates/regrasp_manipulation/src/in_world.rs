//! Planners work in the hand's frame. Here what they say is carried into the world, and plans back into the hand's frame.

use crate::failure::Failure;
use crate::outline::Outline;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::Plan;
use regrasp_plan::plan::PoseData;
use regrasp_scene::HandView;

/// `plan`, made in the hand's frame, in the world, as the answer to the query of this name.
pub fn plan_in_world(view: &HandView, query: &str, plan: Plan) -> Plan {
    let plan = Plan { query: query.to_owned(), ..plan };
    match view.hand_from_world() {
        Some(_) => plan_seen_from(&view.world_from_hand, plan),
        None => plan,
    }
}

/// `plan`, which is in the world, in the hand's frame.
pub fn plan_in_hand_frame(view: &HandView, plan: &Plan) -> Plan {
    match view.hand_from_world() {
        Some(hand_from_world) => plan_seen_from(&hand_from_world, plan.clone()),
        None => plan.clone(),
    }
}

/// Every pose and direction of the plan that is not the object's, times `frame_from_plan`.
fn plan_seen_from(frame_from_plan: &Pose, mut plan: Plan) -> Plan {
    let carry = |pose: &mut PoseData| *pose = PoseData::from(&(frame_from_plan * Pose::from(&*pose)));
    carry(&mut plan.start);
    carry(&mut plan.goal);
    plan.way_poses.iter_mut().for_each(|way| carry(&mut way.world_from_object));
    if let Some(asked) = &mut plan.asked {
        carry(&mut asked.start);
        carry(&mut asked.goal);
    }
    for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
        carry(&mut waypoint.world_from_object);
    }
    if let Some(gravity) = plan.promises.forces.as_mut().and_then(|forces| forces.gravity_in_world.as_mut()) {
        *gravity = (frame_from_plan.rotation * Vector::from(*gravity)).into();
    }
    plan
}

/// `failure` of a search in the hand's frame, in the world.
pub fn failure_in_world(view: &HandView, mut failure: Failure) -> Failure {
    if view.hand_from_world().is_none() {
        return failure;
    }
    if let Some(miss) = &mut failure.nearest_miss {
        miss.world_from_object = PoseData::from(&view.world_from(&Pose::from(&miss.world_from_object)));
    }
    if let Some(outline) = &mut failure.reached {
        **outline = outline_in_world(view, (**outline).clone());
    }
    failure
}

/// The poses of `outline` in the world.
pub fn outline_in_world(view: &HandView, outline: Outline) -> Outline {
    outline.moved_by(|pose| view.world_from(pose))
}
