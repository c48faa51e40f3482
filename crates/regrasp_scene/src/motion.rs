//! Motions of whole robots: from joints to joints, or to poses of wrists.

use crate::scene::Scene;
use regrasp_geometry::Pose;
use regrasp_robot::LinkId;

/// The task of a [`MotionQuery`], as scene and plan files spell it.
pub const MOTION: &str = "motion";

/// What holds an object while a robot moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holder {
    /// A hand of the robot, by its index in `Scene::hands`: the object goes with the hand's base.
    Hand(usize),
    /// An arm without a hand, by its index in `Manipulator::arms`: the object goes with the mount link.
    Arm(usize),
}

impl Holder {
    /// The link that the object goes with: the base of the hand, or the mount link of the arm. `robot` is the index of the robot in
    /// [`Scene::robots`]. None where the robot does not carry the hand.
    pub fn link(self, scene: &Scene, robot: usize) -> Option<LinkId> {
        match self {
            Holder::Hand(hand) => {
                let carrier = scene.hands[hand].carrier.filter(|carrier| carrier.robot == robot)?;
                Some(scene.robots[robot].hands[carrier.hand].hand.base)
            }
            Holder::Arm(arm) => Some(scene.robots[robot].arms[arm].mount),
        }
    }

    /// The first link of what holds: this link and every link below it may touch the object.
    pub fn first_link(self, scene: &Scene, robot: usize) -> Option<LinkId> {
        match self {
            Holder::Hand(hand) => {
                let carrier = scene.hands[hand].carrier.filter(|carrier| carrier.robot == robot)?;
                Some(scene.robots[robot].hands[carrier.hand].top)
            }
            Holder::Arm(arm) => Some(scene.robots[robot].arms[arm].mount),
        }
    }

    /// The name of the hand or arm, as `held_by` in plans says it.
    pub fn name(self, scene: &Scene, robot: usize) -> &str {
        match self {
            Holder::Hand(hand) => &scene.hands[hand].name,
            Holder::Arm(arm) => &scene.robots[robot].arms[arm].name,
        }
    }
}

/// An object that is held all through a motion. It goes with its holder as if it were a part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CarriedObject {
    /// The object, by its index in `Scene::objects`.
    pub object: usize,
    /// What holds it.
    pub holder: Holder,
    /// Where it is in the world while the robot is at the start.
    pub world_from_object: Pose,
}

/// A pose that an arm's mount link has to reach.
#[derive(Debug, Clone, PartialEq)]
pub struct WristGoal {
    /// The arm, by its index in `Manipulator::arms`.
    pub arm: usize,
    /// Pose of its mount link in the world.
    pub world_from_mount: Pose,
}

/// Where a robot has to go.
#[derive(Debug, Clone, PartialEq)]
pub enum MotionGoal {
    /// To these values of all coordinates, in the order of the layout.
    Joints(Vec<f64>),
    /// Until the mount links of one or several arms have these poses. Coordinates that move none of these links end where they start.
    Wrists(Vec<WristGoal>),
}

/// A motion of one robot. Everything else rests, but for the objects that it carries.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionQuery {
    /// Name of the task in the scene file; empty where the file has only one.
    pub name: String,
    /// The robot, by its index in `Scene::robots`.
    pub robot: usize,
    /// Values of all coordinates at the start, in the order of the robot's layout.
    pub start: Vec<f64>,
    /// Where the robot has to go.
    pub goal: MotionGoal,
    /// Objects that the robot holds all the way.
    pub carried: Vec<CarriedObject>,
}

impl MotionQuery {
    /// Which coordinates the goal leaves open: those that move one of the wrists asked for. None of them where joints are asked for.
    pub fn open_coordinates(&self, scene: &Scene) -> Vec<bool> {
        let robot = &scene.robots[self.robot];
        let mut is_open = vec![false; robot.layout.len()];
        if let MotionGoal::Wrists(wrists) = &self.goal {
            for wrist in wrists {
                robot.coordinates_above(robot.arms[wrist.arm].mount).into_iter().for_each(|k| is_open[k] = true);
            }
        }
        is_open
    }
}
