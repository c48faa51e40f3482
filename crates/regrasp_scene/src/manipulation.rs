//! One hand that manipulates one object, among everything else of a scene.

use crate::object::Object;
use crate::query::Query;
use crate::scene::{Obstacle, Scene, SceneHand};
use crate::state::State;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::MeshBody;
use regrasp_geometry::shape::PlacedShape;
use regrasp_robot::{Hand, LinkId, Manipulator, Part};

/// One hand and the object that it manipulates. All else of the scene rests in `state`.
#[derive(Debug, Clone, Copy)]
pub struct Manipulation<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Where the other hands and objects rest.
    pub state: &'a State,
    /// Index of the hand in [`Scene::hands`].
    pub hand_index: usize,
    /// Index of the object in [`Scene::objects`].
    pub object_index: usize,
}

impl<'a> Manipulation<'a> {
    /// What `query` asks for.
    pub fn of(scene: &'a Scene, state: &'a State, query: &Query) -> Self {
        Manipulation { scene, state, hand_index: query.hand(), object_index: query.object() }
    }

    /// The first object in the first hand: of most scenes there is no other.
    pub fn first(scene: &'a Scene, state: &'a State) -> Self {
        Manipulation { scene, state, hand_index: 0, object_index: 0 }
    }

    /// The hand, in its own frame.
    pub fn hand(&self) -> &'a Hand {
        &self.placed_hand().hand
    }

    /// The hand with its place in the scene.
    pub fn placed_hand(&self) -> &'a SceneHand {
        &self.scene.hands[self.hand_index]
    }

    /// Where the hand's base stands in the world.
    pub fn world_from_hand(&self) -> Pose {
        self.state.world_from_hand(self.scene, self.hand_index)
    }

    /// The object.
    pub fn object(&self) -> &'a Object {
        &self.scene.objects[self.object_index]
    }

    /// What rests and is no obstacle of the scene: supports, arms, the other hands in their postures, the other objects. In the
    /// world.
    pub fn bystanders(&self) -> Vec<Obstacle> {
        let mut bodies: Vec<Obstacle> = self.scene.supports.iter().map(|support| support.body.clone()).collect();
        bodies.extend(self.robot_bodies());
        let others = self.scene.hands.iter().enumerate().filter(|(index, _)| *index != self.hand_index);
        bodies.extend(others.flat_map(|(index, other)| {
            let world_from_hand = self.state.world_from_hand(self.scene, index);
            let is_own = |link| self.is_palm_of_both(other, link);
            bodies_of_hand(other, &world_from_hand, &self.state.hand_joints[index], is_own)
        }));
        let others = self.scene.objects.iter().enumerate().filter(|(index, _)| *index != self.object_index);
        bodies.extend(others.map(|(index, other)| Obstacle {
            name: other.name.clone(),
            placed: PlacedShape {
                parent_from_shape: self.state.world_from_objects[index],
                shape: other.solid().clone(),
            },
            mesh_body: if other.hull.is_some() { MeshBody::of(other.solid()) } else { other.mesh_body.clone() },
        }));
        bodies
    }

    /// True for a link of the robot that carries both hands, and that moves with the hand: it is in its own palm.
    fn is_palm_of_both(&self, other: &SceneHand, link: LinkId) -> bool {
        let robots = [self.placed_hand(), other].map(|placed| placed.carrier.map(|carrier| carrier.robot));
        robots[0].is_some() && robots[0] == robots[1] && is_of_hand(self.scene, self.hand_index, link)
    }

    /// The links of robots that belong to no hand, but for those that count as palm of the hand. In the world.
    pub fn robot_bodies(&self) -> Vec<Obstacle> {
        let mut bodies = Vec::new();
        (0..self.scene.robots.len()).for_each(|robot| self.add_robot(robot, &mut bodies));
        bodies
    }

    /// Adds the links of a robot that belong to no hand, but for those that count as palm of the hand.
    fn add_robot(&self, index: usize, bodies: &mut Vec<Obstacle>) {
        let robot = &self.scene.robots[index];
        let own = self.placed_hand().carrier.filter(|carrier| carrier.robot == index);
        let mut world_from_link = Vec::new();
        robot.link_poses(&self.state.joints_of_robot(self.scene, index), &mut world_from_link);
        let arms = robot.arms.iter().flat_map(|arm| &arm.shapes);
        for shape in robot.common.shapes.iter().chain(arms) {
            if own.is_some_and(|own| is_rigid_with_hand(robot, own.hand, shape.link)) {
                continue;
            }
            let parent_from_shape = world_from_link[shape.link.0] * shape.placed.parent_from_shape;
            bodies.push(Obstacle {
                name: format!("{}/{}", robot.name, robot.robot.links[shape.link.0].name),
                placed: PlacedShape { parent_from_shape, shape: shape.placed.shape.clone() },
                mesh_body: None,
            });
        }
    }
}

/// Whether a link of the tree that a hand is made from moves with the hand: it is below the hand's first link, or of the robot
/// that carries it and with no moving joint between it and the hand's base. Of a hand that stands by itself all links do.
pub fn is_of_hand(scene: &Scene, hand: usize, link: LinkId) -> bool {
    let Some(carrier) = scene.hands[hand].carrier else { return true };
    let robot = &scene.robots[carrier.robot];
    match robot.part_of(link) {
        Part::Hand(owner) => owner == carrier.hand,
        Part::Arm(_) | Part::Common => is_rigid_with_hand(robot, carrier.hand, link),
    }
}

/// True when no moving joint lies between `link` and the base of a hand: such a link of an arm counts as part of the palm.
pub(crate) fn is_rigid_with_hand(robot: &Manipulator, hand: usize, link: LinkId) -> bool {
    robot.robot.moving_joints_to(link) == robot.robot.moving_joints_to(robot.hands[hand].hand.base)
}

/// The collision shapes of a hand in a posture, placed in the world, but for links of its palm that `leave_out` names.
fn bodies_of_hand(
    other: &SceneHand,
    world_from_hand: &Pose,
    joints: &[f64],
    leave_out: impl Fn(LinkId) -> bool,
) -> Vec<Obstacle> {
    let hand = &other.hand;
    let link_name = |link: LinkId| hand.robot.links[link.0].name.clone();
    let palm = hand.palm.iter().filter(|palm| !leave_out(palm.link));
    let mut parts: Vec<(String, PlacedShape)> = palm.map(|palm| (link_name(palm.link), palm.placed.clone())).collect();
    let mut first = 0;
    for finger in &hand.fingers {
        let end = first + finger.chain.n_coordinates();
        let mut hand_from_body = Vec::new();
        finger.chain.forward(&joints[first..end], &mut hand_from_body);
        first = end;
        let placed_by = |body: usize, placed: &PlacedShape| PlacedShape {
            parent_from_shape: hand_from_body[body] * placed.parent_from_shape,
            shape: placed.shape.clone(),
        };
        let shapes = finger.shapes.iter();
        parts.extend(shapes.map(|shape| (link_name(shape.link), placed_by(shape.body, &shape.placed))));
        if let Some(own) = finger.tip.own_shape() {
            parts.push((format!("tip of {}", finger.name), placed_by(finger.chain.joints.len() - 1, &own)));
        }
    }
    let in_world = |(link, placed): (String, PlacedShape)| Obstacle {
        name: format!("{}/{link}", other.name),
        placed: PlacedShape { parent_from_shape: world_from_hand * placed.parent_from_shape, ..placed },
        mesh_body: None,
    };
    parts.into_iter().map(in_world).collect()
}
