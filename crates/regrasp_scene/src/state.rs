//! What moves in a scene: where joints and objects are.

use crate::scene::Scene;
use regrasp_geometry::Pose;
use regrasp_robot::manipulator::layout::Part;

/// One moment of a scene. The scene itself does not change.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Joint positions of every robot, in the order of its layout, in radians or metres. Those of fingers are taken from
    /// `hand_joints`.
    pub robot_joints: Vec<Vec<f64>>,
    /// Joint positions of every hand, in the order of `Hand::joint_names`, in radians or metres.
    pub hand_joints: Vec<Vec<f64>>,
    /// Pose of every object in the world.
    pub world_from_objects: Vec<Pose>,
}

impl State {
    /// All robots and hands in their rest postures, the objects at `world_from_objects`.
    pub fn at_rest(scene: &Scene, world_from_objects: Vec<Pose>) -> Self {
        let rest = |hand: &regrasp_robot::Hand| hand.fingers.iter().flat_map(|f| f.rest.iter().copied()).collect();
        State {
            robot_joints: scene.robots.iter().map(|robot| robot.layout.rest()).collect(),
            hand_joints: scene.hands.iter().map(|hand| rest(&hand.hand)).collect(),
            world_from_objects,
        }
    }

    /// The whole joint vector of a robot, by its index in [`Scene::robots`]: its own joints and those of the hands that it carries.
    pub fn joints_of_robot(&self, scene: &Scene, robot: usize) -> Vec<f64> {
        let mut joints = self.robot_joints[robot].clone();
        let layout = &scene.robots[robot].layout;
        for (placed, own) in scene.hands.iter().zip(&self.hand_joints) {
            if let Some(carrier) = placed.carrier.filter(|carrier| carrier.robot == robot) {
                let first = layout.range(Part::Hand(carrier.hand)).start;
                joints[first..first + own.len()].copy_from_slice(own);
            }
        }
        joints
    }

    /// Where the base of a hand stands in the world, by the hand's index in [`Scene::hands`].
    pub fn world_from_hand(&self, scene: &Scene, hand: usize) -> Pose {
        let placed = &scene.hands[hand];
        placed.carrier.map_or(placed.world_from_hand, |carrier| {
            let joints = self.joints_of_robot(scene, carrier.robot);
            scene.robots[carrier.robot].world_from_hand(carrier.hand, &joints)
        })
    }
}
