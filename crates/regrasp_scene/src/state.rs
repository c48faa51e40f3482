//! What moves in a scene: where joints and objects are, and who holds what.

use crate::scene::Scene;
use regrasp_geometry::Pose;

/// Who holds an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Holder {
    /// A hand, by its index in [`Scene::hands`].
    Hand(usize),
    /// A support, by its index in [`Scene::supports`].
    Support(usize),
}

/// One moment of a scene. The scene itself does not change.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Joint positions of every hand, in the order of `Hand::joint_names`, in radians or metres.
    pub hand_joints: Vec<Vec<f64>>,
    /// Pose of every object in the world.
    pub world_from_objects: Vec<Pose>,
    /// Who holds each object. Empty for an object that rests where it is and that nothing is said of.
    pub held_by: Vec<Vec<Holder>>,
}

impl State {
    /// All hands in their rest postures, the objects at `world_from_objects`, held by nobody.
    pub fn at_rest(scene: &Scene, world_from_objects: Vec<Pose>) -> Self {
        let rest = |hand: &regrasp_robot::Hand| hand.fingers.iter().flat_map(|f| f.rest.iter().copied()).collect();
        State {
            hand_joints: scene.hands.iter().map(|hand| rest(&hand.hand)).collect(),
            held_by: vec![Vec::new(); world_from_objects.len()],
            world_from_objects,
        }
    }
}
