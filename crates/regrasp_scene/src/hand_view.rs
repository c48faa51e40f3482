//! The scene as one hand sees it: what it holds, what is in its way, and which way things fall, all in the hand's own frame.

use crate::gravity::Gravity;
use crate::limits::Limits;
use crate::manipulation::Manipulation;
use crate::object::Object;
use crate::scene::{InputFile, Obstacle};
use regrasp_geometry::Pose;
use regrasp_robot::Hand;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// One hand and the object that it manipulates, with everything else of the scene as obstacles. All poses are in the hand's frame.
///
/// In-hand planners plan in a view: they need not know where the hand stands, nor what else moves.
#[derive(Debug, Clone)]
pub struct HandView<'a> {
    /// Index of the hand in `Scene::hands`.
    pub hand_index: usize,
    /// Index of the object in `Scene::objects`.
    pub object_index: usize,
    /// The hand's name in the scene.
    pub hand_name: &'a str,
    /// The hand.
    pub hand: &'a Hand,
    /// As [`crate::SceneHand::held_joints`].
    pub held_joints: BTreeMap<String, f64>,
    /// Where the hand's base stands in the world.
    pub world_from_hand: Pose,
    /// As [`crate::SceneHand::reach`].
    pub reach: Option<f64>,
    /// The object.
    pub object: &'a Object,
    /// Obstacles of the scene, then its supports, the links of robots that are no hand's, the other hands in their postures and the
    /// other objects where they are.
    pub obstacles: Cow<'a, [Obstacle]>,
    /// So many of the first obstacles may stand beside the palm: obstacles and supports of the scene, which a hand may be mounted on,
    /// and the robot that carries it. The palm keeps away from the others.
    pub n_beside_palm: usize,
    /// Gravity, in the hand's frame.
    pub gravity: Gravity,
    /// What a plan may ask of hand and object.
    pub limits: Limits,
    /// The files that the scene was read from.
    pub inputs: &'a [InputFile],
}

impl<'a> HandView<'a> {
    /// What the hand of `manipulation` sees.
    pub fn of(manipulation: &Manipulation<'a>) -> Self {
        let Manipulation { scene, hand_index, object_index, .. } = *manipulation;
        let own = manipulation.placed_hand();
        let others = manipulation.bystanders();
        let of_robot = if own.carrier.is_some() { manipulation.robot_bodies().len() } else { 0 };
        let obstacles = match others.is_empty() {
            true => Cow::Borrowed(scene.obstacles.as_slice()),
            false => Cow::Owned(scene.obstacles.iter().cloned().chain(others).collect()),
        };
        let mut view = HandView {
            hand_index,
            object_index,
            hand_name: &own.name,
            hand: &own.hand,
            held_joints: own.held_joints(),
            world_from_hand: manipulation.world_from_hand(),
            reach: own.reach,
            object: manipulation.object(),
            obstacles,
            n_beside_palm: scene.obstacles.len() + scene.supports.len() + of_robot,
            gravity: scene.gravity(),
            limits: scene.limits,
            inputs: &scene.inputs,
        };
        // Where the frames are the same every number stays as it is, to the last bit.
        if let Some(hand_from_world) = view.hand_from_world() {
            for obstacle in view.obstacles.to_mut() {
                obstacle.placed.parent_from_shape = hand_from_world * obstacle.placed.parent_from_shape;
            }
            if let Gravity::Direction(down) = view.gravity {
                view.gravity = Gravity::Direction(hand_from_world.rotation * down);
            }
        }
        view
    }

    /// The pose of the world in the hand's frame; none where the two frames are the same.
    pub fn hand_from_world(&self) -> Option<Pose> {
        (self.world_from_hand != Pose::identity()).then(|| self.world_from_hand.inverse())
    }

    /// A pose of the world in the hand's frame.
    pub fn hand_from(&self, world_from_body: &Pose) -> Pose {
        self.hand_from_world().map_or(*world_from_body, |hand_from_world| hand_from_world * world_from_body)
    }

    /// A pose of the hand's frame in the world.
    pub fn world_from(&self, hand_from_body: &Pose) -> Pose {
        match self.hand_from_world() {
            Some(_) => self.world_from_hand * hand_from_body,
            None => *hand_from_body,
        }
    }
}
