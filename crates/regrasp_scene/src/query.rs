//! What is asked: start, way and goal of the object, and how the grasps are given.

use regrasp_geometry::{Point, Pose};

/// How the grasp at the start or at the goal is given.
#[derive(Debug, Clone, PartialEq)]
pub enum GraspRequest {
    /// The planner chooses.
    Automatic,
    /// Joint positions of all fingers, in the order of `Hand::joint_names`; contacts follow.
    Joints(Vec<f64>),
    /// One contact point per finger, in the object frame; joints follow.
    Contacts(Vec<Point>),
}

/// An in-hand query, with all randomness of the scene file resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct InHandQuery {
    /// Object pose at the start.
    pub world_from_object_start: Pose,
    /// Object poses to be passed between start and goal, in order.
    pub world_from_object_way: Vec<Pose>,
    /// Object pose at the goal.
    pub world_from_object_goal: Pose,
    /// Grasp at the start.
    pub start_grasp: GraspRequest,
    /// Grasp at the goal.
    pub goal_grasp: GraspRequest,
}

impl InHandQuery {
    /// All poses asked for, from start to goal; a leg leads from each to the next.
    pub fn poses(&self) -> Vec<Pose> {
        let mut poses = vec![self.world_from_object_start];
        poses.extend(&self.world_from_object_way);
        poses.push(self.world_from_object_goal);
        poses
    }
}
