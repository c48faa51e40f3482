//! Everything that can collide, and which pairs must not.

use crate::check::carried::{is_of_hand, joints_above_base, links_of_no_hand};
use crate::check::kinematics::{Path, pose_of};
use crate::check::model::CheckedHand;
use crate::check::prepared::Prepared;
use nalgebra::{Rotation3, UnitQuaternion};
use regrasp_geometry::reference::ReferenceShape;
use regrasp_geometry::{Point, Pose, Shape};
use regrasp_robot::LinkId;
use regrasp_scene::Manipulation;
use std::sync::Arc;

/// What carries an item.
#[derive(Debug, Clone)]
pub enum Carrier {
    /// A link of the hand.
    Link(Path),
    /// The object.
    Object,
    /// Nothing: it stands in the world.
    World,
}

/// Who an item belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// The finger of this index.
    Finger(usize),
    /// The palm: what no finger joint moves.
    Palm,
    /// The object.
    Object,
    /// An obstacle or a support.
    Obstacle,
    /// Another hand or another object, which rests.
    Resting,
}

impl Owner {
    /// True for what stands still all through the plan, whatever the hand does.
    pub fn stands_still(self) -> bool {
        matches!(self, Owner::Obstacle | Owner::Resting)
    }
}

/// A shape on its carrier.
pub struct Item {
    /// Name for messages.
    pub name: String,
    /// Who it belongs to.
    pub owner: Owner,
    /// Index in [`Bodies::carriers`].
    pub carrier: usize,
    /// The link, for shapes of the hand.
    link: Option<LinkId>,
    /// Number of moving joints before it.
    body_depth: usize,
    /// True for what may touch the object while the finger holds.
    pub is_tip: bool,
    /// True for the shape of an object of which the hull stands for it to all but fingertips.
    is_for_tips_only: bool,
    /// True for that hull.
    is_hull: bool,
    /// The shape.
    pub shape: Arc<ReferenceShape>,
    /// Pose of the shape in the carrier's frame.
    pub carrier_from_shape: Pose,
    /// Centre of a ball that contains the shape, in the carrier's frame.
    pub center: Point,
    /// Radius of that ball.
    pub radius: f64,
    /// How far a turn about the centre can carry a point of the shape: zero for balls.
    pub spin_radius: f64,
}

/// Two items that must not touch, or touch only as fingertip and object.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Index of the first item; a finger's, where one of the two is.
    pub a: usize,
    /// Index of the second item.
    pub b: usize,
    /// The finger whose tip it is, for a fingertip against the object.
    pub tip_of: Option<usize>,
}

/// Items and pairs of a scene.
pub struct Bodies {
    /// Carriers; the object is the first, the world the second.
    pub carriers: Vec<Carrier>,
    /// Items.
    pub items: Vec<Item>,
    /// Pairs to judge.
    pub pairs: Vec<Pair>,
    prepared: Arc<Prepared>,
    /// Fingers whose links have no collision geometry.
    bare: Vec<usize>,
}

/// Index of the object in [`Bodies::carriers`].
pub const OBJECT: usize = 0;
const WORLD: usize = 1;

impl Bodies {
    /// Reads all shapes of `scene`. Err with a message when a shape cannot be used for queries.
    pub fn new(task: &Manipulation, model: &CheckedHand) -> Result<Self, String> {
        Self::with(task, model, &Arc::default())
    }

    /// The same, with shapes that may be prepared already.
    pub fn with(task: &Manipulation, model: &CheckedHand, prepared: &Arc<Prepared>) -> Result<Self, String> {
        let mut bodies = Bodies {
            carriers: vec![Carrier::Object, Carrier::World],
            items: Vec::new(),
            pairs: Vec::new(),
            prepared: prepared.clone(),
            bare: Vec::new(),
        };
        bodies.add_hand(task, model)?;
        let object = task.object();
        bodies.add(&object.name, Owner::Object, OBJECT, &Pose::identity(), &object.shape)?;
        // Fingertips touch the shape; everything else keeps away from the hull, where there is one.
        if let Some(hull) = &object.hull {
            bodies.items.last_mut().expect("the object was just added").is_for_tips_only = true;
            bodies.add(&object.name, Owner::Object, OBJECT, &Pose::identity(), hull)?.is_hull = true;
        }
        for obstacle in &task.scene.obstacles {
            let placed = &obstacle.placed;
            bodies.add(&obstacle.name, Owner::Obstacle, WORLD, &placed.parent_from_shape, &placed.shape)?;
        }
        bodies.add_resting(task)?;
        bodies.add_pairs(task);
        Ok(bodies)
    }

    /// What is not tested because fingers have no collision geometry, in words.
    pub fn without_geometry(&self, model: &CheckedHand) -> Option<String> {
        let names: Vec<String> = self.bare.iter().map(|&f| format!("\"{}\"", model.fingers[f].name)).collect();
        let told = format!(
            "the links of {} keep clear of everything: they have no collision geometry, so no distance of theirs was measured",
            names.join(", ")
        );
        (!names.is_empty()).then_some(told)
    }

    /// Adds a shape that takes part in no pair yet.
    pub(super) fn add(
        &mut self,
        name: &str,
        owner: Owner,
        carrier: usize,
        carrier_from_shape: &Pose,
        shape: &Shape,
    ) -> Result<&mut Item, String> {
        let (center, radius) = shape.bounding_sphere();
        let reference = self.prepared.shape(shape).map_err(|error| format!("\"{name}\": {error}"))?;
        self.items.push(Item {
            name: name.to_owned(),
            owner,
            carrier,
            link: None,
            body_depth: 0,
            is_tip: false,
            is_for_tips_only: false,
            is_hull: false,
            shape: reference,
            carrier_from_shape: *carrier_from_shape,
            center: carrier_from_shape * center,
            radius,
            spin_radius: if matches!(shape, Shape::Sphere { .. }) { 0.0 } else { radius },
        });
        Ok(self.items.last_mut().expect("an item was just added"))
    }

    fn add_hand(&mut self, task: &Manipulation, model: &CheckedHand) -> Result<(), String> {
        let robot = &task.hand().robot;
        // Joints of an arm above the hand are not between bodies of the hand.
        let above = joints_above_base(task);
        for (l, link) in robot.links.iter().enumerate() {
            if !is_of_hand(task, LinkId(l)) {
                continue;
            }
            let path = Path::new(robot, LinkId(l), &model.world_from_root, &model.joint_names)?;
            // A link is a finger's when one of that finger's coordinates moves it.
            let owner = path
                .joints
                .iter()
                .flat_map(|joint| &joint.drive.terms)
                .find_map(|&(k, _)| model.fingers.iter().position(|finger| finger.coordinates.contains(&k)))
                .map_or(Owner::Palm, Owner::Finger);
            let body_depth = path.joints.len() - above;
            let tip_of = match owner {
                Owner::Finger(f) => Some(&model.fingers[f]).filter(|finger| finger.tip_link.0 == l),
                _ => None,
            };
            self.carriers.push(Carrier::Link(path));
            let carrier = self.carriers.len() - 1;
            for (element, placed) in link.collision.iter().enumerate() {
                let shape =
                    self.prepared.convex(&placed.shape).map_err(|error| format!("link \"{}\": {error}", link.name))?;
                let item = self.add(&link.name, owner, carrier, &placed.parent_from_shape, &shape)?;
                let is_tip = tip_of.is_some_and(|finger| finger.tip_has(element));
                (item.link, item.body_depth, item.is_tip) = (Some(LinkId(l)), body_depth, is_tip);
            }
        }
        let is_bare = |f: &usize| self.items.iter().all(|item| item.owner != Owner::Finger(*f));
        self.bare = (0..model.fingers.len()).filter(is_bare).collect();
        for (f, finger) in model.fingers.iter().enumerate() {
            if let Some((shape, turn)) = finger.own_shape() {
                self.carriers.push(Carrier::Link(finger.path.clone()));
                let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
                let at = Pose::from_parts(finger.center.coords.into(), turn);
                let carrier = self.carriers.len() - 1;
                let name = format!("tip of {}", finger.name);
                let item = self.add(&name, Owner::Finger(f), carrier, &at, &shape)?;
                (item.link, item.body_depth, item.is_tip) =
                    (Some(finger.tip_link), finger.path.joints.len() - above, true);
            }
        }
        Ok(())
    }

    /// What rests beside the obstacles: supports, the other hands in their postures, the other objects where they are.
    fn add_resting(&mut self, task: &Manipulation) -> Result<(), String> {
        let (scene, state) = (task.scene, task.state);
        for support in &scene.supports {
            let placed = &support.body.placed;
            self.add(&support.body.name, Owner::Obstacle, WORLD, &placed.parent_from_shape, &placed.shape)?;
        }
        for index in 0..scene.robots.len() {
            self.add_robot(task, index)?;
        }
        for (h, other) in scene.hands.iter().enumerate().filter(|(h, _)| *h != task.hand_index) {
            let (robot, joints) = (&other.hand.robot, &state.hand_joints[h]);
            let of_other = Manipulation { hand_index: h, ..*task };
            let model = CheckedHand::new(&of_other)?;
            for (l, link) in robot.links.iter().enumerate() {
                if !is_of_hand(&of_other, LinkId(l)) || is_of_carrier(task, &of_other, LinkId(l)) {
                    continue;
                }
                let path = Path::new(robot, LinkId(l), &model.world_from_root, &model.joint_names)?;
                let world_from_link = pose_of(&path.world_from_link(joints));
                let name = format!("{}/{}", other.name, link.name);
                for placed in &link.collision {
                    let shape =
                        self.prepared.convex(&placed.shape).map_err(|error| format!("link \"{name}\": {error}"))?;
                    self.add(&name, Owner::Resting, WORLD, &(world_from_link * placed.parent_from_shape), &shape)?;
                }
            }
            for finger in &model.fingers {
                let Some((shape, turn)) = finger.own_shape() else { continue };
                let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
                let at = Pose::from_parts(finger.center.coords.into(), turn);
                let at = pose_of(&finger.path.world_from_link(joints)) * at;
                self.add(&format!("{}/tip of {}", other.name, finger.name), Owner::Resting, WORLD, &at, &shape)?;
            }
        }
        for (o, other) in scene.objects.iter().enumerate().filter(|(o, _)| *o != task.object_index) {
            self.add(&other.name, Owner::Resting, WORLD, &state.world_from_objects[o], other.solid())?;
        }
        Ok(())
    }

    /// The links of a robot that are no hand's. Those that move as the manipulating hand does are in its palm.
    fn add_robot(&mut self, task: &Manipulation, index: usize) -> Result<(), String> {
        let robot = &task.scene.robots[index];
        let carries = task.placed_hand().carrier.is_some_and(|carrier| carrier.robot == index);
        for (id, world_from_link) in links_of_no_hand(task, index)? {
            if carries && is_of_hand(task, id) {
                continue;
            }
            let link = &robot.robot.links[id.0];
            let name = format!("{}/{}", robot.name, link.name);
            for placed in &link.collision {
                let shape = self.prepared.convex(&placed.shape).map_err(|error| format!("link \"{name}\": {error}"))?;
                // The arm that carries the hand is where it was built to be: the palm is not kept away from it.
                let owner = if carries { Owner::Obstacle } else { Owner::Resting };
                let at = world_from_link * placed.parent_from_shape;
                self.add(&name, owner, WORLD, &at, &shape)?.link = carries.then_some(id);
            }
        }
        Ok(())
    }

    fn add_pairs(&mut self, task: &Manipulation) {
        let moves = |&a: &usize| !self.items[a].owner.stands_still();
        for a in (0..self.items.len()).filter(moves) {
            for b in 0..self.items.len() {
                let (first, second) = (&self.items[a], &self.items[b]);
                let judged = match (first.owner, second.owner) {
                    (Owner::Finger(f), Owner::Finger(g)) if f == g => {
                        // Neighbouring bodies share a joint and always overlap there.
                        a < b && first.body_depth.abs_diff(second.body_depth) > 1
                    }
                    (Owner::Finger(_), Owner::Finger(_)) => a < b,
                    // The hand allows what one joint connects; links across a joint that is held are judged.
                    (Owner::Finger(_), Owner::Palm) => true,
                    (Owner::Finger(_) | Owner::Object, Owner::Obstacle | Owner::Resting) => true,
                    // The palm may be mounted on an obstacle, but not stand in another hand or object.
                    (Owner::Palm, Owner::Resting) => true,
                    (Owner::Finger(_), Owner::Object) | (Owner::Object, Owner::Palm) => true,
                    _ => false,
                };
                let allowed = match (first.link, second.link) {
                    (Some(p), Some(q)) => task.hand().may_touch(p, q),
                    _ => false,
                };
                // Of an object with a hull, tips ask for the shape and all others for the hull.
                let tip_on_object =
                    matches!((first.owner, second.owner), (Owner::Finger(_), Owner::Object)) && first.is_tip;
                let is_other = |item: &Item| if tip_on_object { item.is_hull } else { item.is_for_tips_only };
                if judged && !allowed && !is_other(first) && !is_other(second) {
                    let tip_of = match (first.owner, second.owner) {
                        (Owner::Finger(f), Owner::Object) if first.is_tip => Some(f),
                        _ => None,
                    };
                    self.pairs.push(Pair { a, b, tip_of });
                }
            }
        }
    }
}

/// True for a link of the robot that carries both hands, and that counts as palm of the other: it is added with the robot.
fn is_of_carrier(task: &Manipulation, of_other: &Manipulation, link: LinkId) -> bool {
    let robots = [task, of_other].map(|one| one.placed_hand().carrier.map(|carrier| carrier.robot));
    robots[0].is_some() && robots[0] == robots[1] && is_of_hand(task, link)
}
