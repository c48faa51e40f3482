//! What is asked: start, way and goal of an object, and how the grasps are given.

use crate::goal::{Goal, poses_from};
use crate::motion::{MOTION, MotionQuery};
use crate::pick_and_place::{PICK_AND_PLACE, PickAndPlaceQuery};
use nalgebra::UnitQuaternion;
use regrasp_geometry::{Point, Pose, Vector};
use std::sync::LazyLock;

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
    /// As `Joints`, with fingers that are free: they do not touch, and stand as given. At the start only.
    Posture {
        /// Joint positions of all fingers, in the order of `Hand::joint_names`.
        joints: Vec<f64>,
        /// For every finger, whether it holds.
        holds: Vec<bool>,
    },
    /// One contact point per finger, in the object frame; joints follow.
    Contacts(Vec<Point>),
}

/// The name of each kind of task, as scene and plan files spell it.
pub const IN_HAND: &str = "in_hand";
/// See [`IN_HAND`].
pub const TRACKING: &str = "tracking";

/// A start pose that the planner chooses, and what the other poses are once it has (`position = "auto"` in a scene file).
#[derive(Debug, Clone, PartialEq)]
pub struct StartChoice {
    /// Orientation at the start; None where the planner chooses it too.
    pub rotation: Option<UnitQuaternion<f64>>,
    /// Poses on the way.
    pub way: Vec<Goal>,
    /// The goal.
    pub goal: Goal,
}

/// A goal pose of one object, reached in one hand by relocating fingers (Saut 2011; Sahbani 2007). All poses are in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct InHandQuery {
    /// Name of the task in the scene file; empty where the file has only one.
    pub name: String,
    /// The hand, by its index in `Scene::hands`.
    pub hand: usize,
    /// The object, by its index in `Scene::objects`.
    pub object: usize,
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
    /// Where it is Some the planner chooses the start pose, and the poses above are what comes of a start at the world's origin.
    pub open_start: Option<StartChoice>,
}

impl InHandQuery {
    /// The same query with `start` as the chosen start pose; itself where the start was given.
    #[must_use]
    pub fn started_at(&self, start: &Pose) -> Self {
        let Some(choice) = &self.open_start else { return self.clone() };
        let rotation = choice.rotation.unwrap_or(start.rotation);
        let start = Pose::from_parts(start.translation, rotation);
        let (way, goal) = poses_from(&start, &choice.way, &choice.goal);
        InHandQuery {
            world_from_object_start: start,
            world_from_object_way: way,
            world_from_object_goal: goal,
            open_start: None,
            ..self.clone()
        }
    }

    /// All poses asked for, from start to goal; a leg leads from each to the next.
    pub fn poses(&self) -> Vec<Pose> {
        let mut poses = vec![self.world_from_object_start];
        poses.extend(&self.world_from_object_way);
        poses.push(self.world_from_object_goal);
        poses
    }

    /// True where the object has nowhere to go: what is asked is whether it can be held where it is.
    pub fn stays(&self) -> bool {
        let start = &self.world_from_object_start;
        self.world_from_object_way.iter().chain([&self.world_from_object_goal]).all(|pose| pose == start)
    }

    /// What asks only whether the object can be held at the start: it is the goal too.
    #[must_use]
    pub fn held(&self) -> Self {
        let stays = Goal::Turn { axis: Vector::z_axis(), angle: 0.0, shift: Vector::zeros() };
        let open =
            |choice: &StartChoice| StartChoice { rotation: choice.rotation, way: Vec::new(), goal: stays.clone() };
        InHandQuery {
            world_from_object_way: Vec::new(),
            world_from_object_goal: self.world_from_object_start,
            goal_grasp: GraspRequest::Automatic,
            open_start: self.open_start.as_ref().map(open),
            ..self.clone()
        }
    }

    /// The same query seen from another frame: every pose becomes `frame_from_world` times itself.
    #[must_use]
    pub fn seen_from(&self, frame_from_world: &Pose) -> Self {
        let seen = |pose: &Pose| frame_from_world * pose;
        InHandQuery {
            world_from_object_start: seen(&self.world_from_object_start),
            world_from_object_way: self.world_from_object_way.iter().map(seen).collect(),
            world_from_object_goal: seen(&self.world_from_object_goal),
            ..self.clone()
        }
    }
}

/// A goal orientation of one object, wherever the object then is, reached with every finger of one hand on it (Cherif & Gupta
/// 1999, sec. 3.3). All poses are in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackingQuery {
    /// Name of the task in the scene file; empty where the file has only one.
    pub name: String,
    /// The hand, by its index in `Scene::hands`.
    pub hand: usize,
    /// The object, by its index in `Scene::objects`.
    pub object: usize,
    /// Object pose at the start.
    pub world_from_object_start: Pose,
    /// Object pose at the goal. Its position is that of the start, and not asked for.
    pub world_from_object_goal: Pose,
    /// Grasp at the start.
    pub start_grasp: GraspRequest,
    /// Grasp at the goal. The planner of tracking cannot be asked for one.
    pub goal_grasp: GraspRequest,
}

impl TrackingQuery {
    /// The same query seen from another frame: every pose becomes `frame_from_world` times itself.
    #[must_use]
    pub fn seen_from(&self, frame_from_world: &Pose) -> Self {
        TrackingQuery {
            world_from_object_start: frame_from_world * self.world_from_object_start,
            world_from_object_goal: frame_from_world * self.world_from_object_goal,
            ..self.clone()
        }
    }
}

/// What is asked of a scene, with all randomness of its file resolved: one variant per task.
#[derive(Debug, Clone, PartialEq)]
pub enum Query {
    /// See [`InHandQuery`].
    InHand(InHandQuery),
    /// See [`TrackingQuery`].
    Tracking(TrackingQuery),
    /// See [`MotionQuery`]. It asks no hand to move an object: what this type says about hand, object and their poses is then empty
    /// (index 0, the world's origin, a grasp that the planner chooses).
    Motion(MotionQuery),
    /// See [`PickAndPlaceQuery`]. It names no hand (index 0), and leaves all grasps to the planner.
    PickAndPlace(PickAndPlaceQuery),
}

/// The pose of an object that is not asked about.
static NO_POSE: LazyLock<Pose> = LazyLock::new(Pose::identity);

impl From<InHandQuery> for Query {
    fn from(query: InHandQuery) -> Self {
        Query::InHand(query)
    }
}

impl From<MotionQuery> for Query {
    fn from(query: MotionQuery) -> Self {
        Query::Motion(query)
    }
}

impl From<PickAndPlaceQuery> for Query {
    fn from(query: PickAndPlaceQuery) -> Self {
        Query::PickAndPlace(query)
    }
}

impl From<TrackingQuery> for Query {
    fn from(query: TrackingQuery) -> Self {
        Query::Tracking(query)
    }
}

impl Query {
    /// Name of its task, as scene and plan files spell it.
    pub fn task(&self) -> &'static str {
        match self {
            Query::InHand(_) => IN_HAND,
            Query::Tracking(_) => TRACKING,
            Query::Motion(_) => MOTION,
            Query::PickAndPlace(_) => PICK_AND_PLACE,
        }
    }

    /// The query with `start` as the start pose where the planner chooses that; itself otherwise.
    #[must_use]
    pub fn started_at(&self, start: &Pose) -> Self {
        match self {
            Query::InHand(query) => Query::InHand(query.started_at(start)),
            Query::Tracking(_) | Query::Motion(_) | Query::PickAndPlace(_) => self.clone(),
        }
    }

    /// What asks only whether the object can be held at the start; None for tracking, which needs a given start grasp anyway.
    pub fn held(&self) -> Option<Self> {
        self.as_in_hand().map(|query| Query::InHand(query.held()))
    }

    /// True where the planner chooses the start pose.
    pub fn has_open_start(&self) -> bool {
        self.as_in_hand().is_some_and(|query| query.open_start.is_some())
    }

    /// The in-hand query, if it is one.
    pub fn as_in_hand(&self) -> Option<&InHandQuery> {
        match self {
            Query::InHand(query) => Some(query),
            Query::Tracking(_) | Query::Motion(_) | Query::PickAndPlace(_) => None,
        }
    }

    /// The tracking query, if it is one.
    pub fn as_tracking(&self) -> Option<&TrackingQuery> {
        match self {
            Query::Tracking(query) => Some(query),
            Query::InHand(_) | Query::Motion(_) | Query::PickAndPlace(_) => None,
        }
    }

    /// The motion query, if it is one.
    pub fn as_motion(&self) -> Option<&MotionQuery> {
        match self {
            Query::Motion(query) => Some(query),
            Query::InHand(_) | Query::Tracking(_) | Query::PickAndPlace(_) => None,
        }
    }

    /// The query of pick and place, if it is one.
    pub fn as_pick_and_place(&self) -> Option<&PickAndPlaceQuery> {
        match self {
            Query::PickAndPlace(query) => Some(query),
            Query::InHand(_) | Query::Tracking(_) | Query::Motion(_) => None,
        }
    }

    /// The robot that is asked to move, by its index in `Scene::robots`. None where hands stand still.
    pub fn robot(&self) -> Option<usize> {
        match self {
            Query::Motion(query) => Some(query.robot),
            Query::PickAndPlace(query) => Some(query.robot),
            Query::InHand(_) | Query::Tracking(_) => None,
        }
    }

    /// True where the robot moves, and a plan is one of whole robots.
    pub fn is_of_robot(&self) -> bool {
        matches!(self, Query::Motion(_) | Query::PickAndPlace(_))
    }

    /// Name of the task in the scene file; empty where the file has only one.
    pub fn name(&self) -> &str {
        match self {
            Query::InHand(query) => &query.name,
            Query::Tracking(query) => &query.name,
            Query::Motion(query) => &query.name,
            Query::PickAndPlace(query) => &query.name,
        }
    }

    /// The hand that is asked, by its index in `Scene::hands`.
    pub fn hand(&self) -> usize {
        match self {
            Query::InHand(query) => query.hand,
            Query::Tracking(query) => query.hand,
            Query::Motion(_) | Query::PickAndPlace(_) => 0,
        }
    }

    /// The object that is asked about, by its index in `Scene::objects`.
    pub fn object(&self) -> usize {
        match self {
            Query::InHand(query) => query.object,
            Query::Tracking(query) => query.object,
            Query::Motion(_) => 0,
            Query::PickAndPlace(query) => query.object,
        }
    }

    /// Object pose at the start.
    pub fn start(&self) -> &Pose {
        match self {
            Query::InHand(query) => &query.world_from_object_start,
            Query::Tracking(query) => &query.world_from_object_start,
            Query::PickAndPlace(query) => &query.world_from_object_start,
            Query::Motion(_) => &NO_POSE,
        }
    }

    /// Object poses to be passed between start and goal, in order.
    pub fn way(&self) -> &[Pose] {
        match self {
            Query::InHand(query) => &query.world_from_object_way,
            Query::Tracking(_) | Query::Motion(_) | Query::PickAndPlace(_) => &[],
        }
    }

    /// Object pose at the goal; of tracking only its orientation is asked for.
    pub fn goal(&self) -> &Pose {
        match self {
            Query::InHand(query) => &query.world_from_object_goal,
            Query::Tracking(query) => &query.world_from_object_goal,
            Query::PickAndPlace(query) => &query.world_from_object_goal,
            Query::Motion(_) => &NO_POSE,
        }
    }

    /// Grasp at the start.
    pub fn start_grasp(&self) -> &GraspRequest {
        match self {
            Query::InHand(query) => &query.start_grasp,
            Query::Tracking(query) => &query.start_grasp,
            Query::Motion(_) | Query::PickAndPlace(_) => &GraspRequest::Automatic,
        }
    }

    /// Grasp at the goal.
    pub fn goal_grasp(&self) -> &GraspRequest {
        match self {
            Query::InHand(query) => &query.goal_grasp,
            Query::Tracking(query) => &query.goal_grasp,
            Query::Motion(_) | Query::PickAndPlace(_) => &GraspRequest::Automatic,
        }
    }
}
