//! What is asked: start, way and goal of the object, and how the grasps are given.

use regrasp_geometry::{Point, Pose};

/// Given fingertips and contacts may be this far off the object's surface, in metres. They are moved to the nearest contact,
/// no finger farther than this; where that is not enough the scene is refused. Planner and checker go by this one number.
pub const GRASP_TOLERANCE: f64 = 5e-4;
/// A joint may turn by this much for it, in radians: as far as the tolerance is at 10 mm from its axis.
pub const GRASP_TURN_TOLERANCE: f64 = 0.05;

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

/// Kind of task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskKind {
    /// A goal pose, reached by relocating fingers (papers 000 and 004).
    InHand,
    /// A goal orientation, wherever the object then is, reached with every finger on the object (paper 003, section 3.3).
    Tracking,
}

impl TaskKind {
    /// As scene and plan files spell it.
    pub fn name(self) -> &'static str {
        match self {
            TaskKind::InHand => "in_hand",
            TaskKind::Tracking => "tracking",
        }
    }
}

/// An in-hand query, with all randomness of the scene file resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct InHandQuery {
    /// What is asked of the goal: its pose, or its orientation alone.
    pub task: TaskKind,
    /// Object pose at the start.
    pub world_from_object_start: Pose,
    /// Object poses to be passed between start and goal, in order.
    pub world_from_object_way: Vec<Pose>,
    /// Object pose at the goal. In tracking its position is that of the start, and not asked for.
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
