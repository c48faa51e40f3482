//! Everything that can collide with a robot or what it carries, and which pairs must not.

use crate::check::kinematics::{Path, pose_of, world_from_root};
use crate::check::robots::question::{Carried, Question};
use crate::check::robots::tree::{Frame, Tree};
use regrasp_geometry::reference::ReferenceShape;
use regrasp_geometry::{Point, Pose, Shape};
use regrasp_robot::hand::convex_of;
use regrasp_robot::{Hand, LinkId, Manipulator, MountedHand, Robot, Tip, TipShape};
use regrasp_scene::{Scene, State};

/// Who an item belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// A link of the robot.
    Link(LinkId),
    /// An object that the robot carries, by its index in [`Question::carried`].
    Carried(usize),
    /// What stands still, whatever the robot does.
    Still,
}

/// A shape on a body of the robot, or in the world.
pub struct Item {
    /// Name for messages.
    pub name: String,
    /// Who it belongs to.
    pub owner: Owner,
    /// The body of the robot that carries it; the first one also for what stands in the world.
    pub body: usize,
    /// The shape.
    pub shape: ReferenceShape,
    /// Pose of the shape in the body's frame, or in the world.
    pub frame: Frame,
    /// Centre of a ball that contains the shape, in the same frame.
    pub center: Point,
    /// Radius of that ball.
    pub radius: f64,
    /// How far a turn about the centre can carry a point of the shape: zero for balls.
    pub spin_radius: f64,
    /// True for what stands in the world at present: its frame is the world's.
    pub stands: bool,
    /// The hand, by its index in `Manipulator::hands`, and the finger whose tip it is.
    pub tip_of: Option<(usize, usize)>,
    /// The support that it is, by its index in `Scene::supports`.
    pub support: Option<usize>,
    /// True for the shape of an object of which the hull stands for it to all but fingertips.
    pub is_for_tips_only: bool,
    /// True for that hull.
    pub is_hull: bool,
    /// True for a fingertip that is no collision geometry of its link.
    pub is_own_tip: bool,
}

/// Two items that must not touch.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Index of the first item.
    pub a: usize,
    /// Index of the second item.
    pub b: usize,
    /// Joints between the first item and the body that both stand on.
    pub joints_a: usize,
    /// The same of the second one.
    pub joints_b: usize,
    /// They must stay farther apart than this, in metres.
    pub floor: f64,
}

/// Items and pairs of a question.
pub struct Items {
    /// Items.
    pub items: Vec<Item>,
    /// Pairs to judge.
    pub pairs: Vec<Pair>,
}

/// What pairs have to keep, in metres.
#[derive(Debug, Clone, Copy)]
pub struct Floors {
    /// Of nearly all pairs.
    pub apart: f64,
    /// Of a carried object and what holds it.
    pub held: f64,
}

impl Items {
    /// Reads all shapes. Err with a message when a shape cannot be used for queries.
    pub fn new((scene, state): (&Scene, &State), question: &Question, floors: Floors) -> Result<Self, String> {
        let mut items = Items { items: Vec::new(), pairs: Vec::new() };
        items.add_robot(question.robot, &question.tree)?;
        for (index, carried) in question.carried.iter().enumerate() {
            let object = &scene.objects[carried.object];
            let owner = Owner::Carried(index);
            items.add(&object.name, owner, carried.body, carried.body_from_object, object.solid())?;
        }
        let moved: Vec<usize> = question.carried.iter().map(|carried| carried.object).collect();
        items.add_world((scene, state), question, &moved)?;
        items.add_pairs(&question.tree, |first, second| floor_of(first, second, question, floors));
        Ok(items)
    }

    /// All shapes of a task that moves one object: it is [`Owner::Carried`] with index 0, stands in the world, and is in no pair until
    /// [`Items::add_pairs`] makes those. Err as [`Items::new`].
    pub fn of_object((scene, state): (&Scene, &State), question: &Question, object: usize) -> Result<Self, String> {
        let mut items = Items { items: Vec::new(), pairs: Vec::new() };
        items.add_robot(question.robot, &question.tree)?;
        let moved = &scene.objects[object];
        let at = Frame::of(&Pose::identity());
        items.add(&moved.name, Owner::Carried(0), 0, at, &moved.shape)?;
        if let Some(hull) = &moved.hull {
            items.items.last_mut().expect("an item was just added").is_for_tips_only = true;
            items.add(&moved.name, Owner::Carried(0), 0, at, hull)?;
            items.items.last_mut().expect("an item was just added").is_hull = true;
        }
        items.add_world((scene, state), question, &[object])?;
        Ok(items)
    }

    /// Puts the object of [`Items::of_object`] on a body of the robot, or into the world where that is none.
    pub fn put_object(&mut self, body: Option<usize>, frame: Frame) {
        for item in self.items.iter_mut().filter(|item| item.owner == Owner::Carried(0)) {
            let center = item.frame.inverse_point(&item.center);
            (item.stands, item.body) = (body.is_none(), body.unwrap_or(0));
            (item.frame, item.center) = (frame, frame.point(&center));
        }
    }

    /// What stands: obstacles, supports, objects but those moved, robots and hands but those of the question.
    fn add_world(
        &mut self,
        (scene, state): (&Scene, &State),
        question: &Question,
        moved: &[usize],
    ) -> Result<(), String> {
        for body in &scene.obstacles {
            self.add_still(&body.name, &body.placed.parent_from_shape, &body.placed.shape)?;
        }
        for (index, support) in scene.supports.iter().enumerate() {
            let body = &support.body;
            self.add_still(&body.name, &body.placed.parent_from_shape, &body.placed.shape)?;
            self.items.last_mut().expect("an item was just added").support = Some(index);
        }
        for (index, object) in scene.objects.iter().enumerate().filter(|(index, _)| !moved.contains(index)) {
            self.add_still(&object.name, &state.world_from_objects[index], object.solid())?;
        }
        for (index, other) in scene.robots.iter().enumerate().filter(|(index, _)| *index != question.index) {
            self.add_still_robot(other, &state.joints_of_robot(scene, index))?;
        }
        for (index, placed) in scene.hands.iter().enumerate().filter(|(_, placed)| placed.carrier.is_none()) {
            self.add_still_hand(&placed.name, &placed.hand, &placed.world_from_hand, &state.hand_joints[index])?;
        }
        Ok(())
    }

    fn add(&mut self, name: &str, owner: Owner, body: usize, frame: Frame, shape: &Shape) -> Result<(), String> {
        let (center, radius) = shape.bounding_sphere();
        let reference = ReferenceShape::new(shape).map_err(|error| format!("\"{name}\": {error}"))?;
        self.items.push(Item {
            name: name.to_owned(),
            owner,
            body,
            shape: reference,
            frame,
            center: frame.point(&center),
            radius,
            spin_radius: if matches!(shape, Shape::Sphere { .. }) { 0.0 } else { radius },
            stands: owner == Owner::Still,
            tip_of: None,
            support: None,
            is_for_tips_only: false,
            is_hull: false,
            is_own_tip: false,
        });
        Ok(())
    }

    fn add_still(&mut self, name: &str, world_from_shape: &Pose, shape: &Shape) -> Result<(), String> {
        self.add(name, Owner::Still, 0, Frame::of(world_from_shape), shape)
    }

    /// The links of the robot that moves, with fingertips that are no collision geometry.
    fn add_robot(&mut self, robot: &Manipulator, tree: &Tree) -> Result<(), String> {
        for (l, link) in robot.robot.links.iter().enumerate() {
            let (body, body_from_link) = *tree.link(LinkId(l));
            for (element, placed) in link.collision.iter().enumerate() {
                let shape = convex_of(&placed.shape).map_err(|error| format!("link \"{}\": {error}", link.name))?;
                let frame = body_from_link.then(&Frame::of(&placed.parent_from_shape));
                self.add(&link.name, Owner::Link(LinkId(l)), body, frame, &shape)?;
                self.items.last_mut().expect("an item was just added").tip_of = tip_at(robot, LinkId(l), element);
            }
        }
        for (h, hand) in robot.hands.iter().enumerate() {
            for (f, finger) in hand.hand.fingers.iter().enumerate() {
                let Some(own) = finger.tip.own_shape() else { continue };
                // The frame of the finger's last moving body is that of the link which its joint carries.
                let (body, _) = *tree.link(finger.tip.link);
                let name = format!("{}/tip of {}", hand.name, finger.name);
                let frame = Frame::of(&own.parent_from_shape);
                self.add(&name, Owner::Link(finger.tip.link), body, frame, &own.shape)?;
                let item = self.items.last_mut().expect("an item was just added");
                (item.is_own_tip, item.tip_of) = (true, Some((h, f)));
            }
        }
        Ok(())
    }

    /// A robot that rests.
    fn add_still_robot(&mut self, robot: &Manipulator, joints: &[f64]) -> Result<(), String> {
        let first = self.items.len();
        let tree = Tree::of(robot, &robot.layout.names())?;
        self.add_robot(robot, &tree)?;
        let (mut frames, mut axes) = (Vec::new(), Vec::new());
        tree.frames(joints, &mut frames, &mut axes);
        for item in &mut self.items[first..] {
            let body = &frames[item.body];
            (item.frame, item.center) = (body.then(&item.frame), body.point(&item.center));
            (item.owner, item.body, item.name) = (Owner::Still, 0, format!("{}/{}", robot.name, item.name));
            (item.stands, item.tip_of) = (true, None);
        }
        Ok(())
    }

    /// A hand that stands by itself and rests.
    fn add_still_hand(&mut self, name: &str, hand: &Hand, stands: &Pose, joints: &[f64]) -> Result<(), String> {
        let root = world_from_root(hand, stands)?;
        let names = hand.joint_names();
        let at = |robot: &Robot, link: LinkId| -> Result<Pose, String> {
            Ok(pose_of(&Path::new(robot, link, &root, &names)?.world_from_link(joints)))
        };
        for (l, link) in hand.robot.links.iter().enumerate() {
            let world_from_link = at(&hand.robot, LinkId(l))?;
            for placed in &link.collision {
                let shape = convex_of(&placed.shape).map_err(|error| format!("link \"{}\": {error}", link.name))?;
                let name = format!("{name}/{}", link.name);
                self.add_still(&name, &(world_from_link * placed.parent_from_shape), &shape)?;
            }
        }
        for finger in &hand.fingers {
            if let Some(own) = finger.tip.own_shape() {
                let mut path = Path::new(&hand.robot, finger.tip.link, &root, &names)?;
                path.last_from_link = nalgebra::Matrix4::identity();
                let at = pose_of(&path.world_from_link(joints)) * own.parent_from_shape;
                self.add_still(&format!("{name}/tip of {}", finger.name), &at, &own.shape)?;
            }
        }
        Ok(())
    }

    /// Pairs of items, each with what `floor` says that it has to keep; those of which it says nothing are not judged.
    ///
    /// Links that no joint moves are not judged against what stands still.
    pub fn add_pairs(&mut self, tree: &Tree, floor: impl Fn(&Item, &Item) -> Option<f64>) {
        let n_moving = self.items.iter().take_while(|item| item.owner != Owner::Still).count();
        let chains: Vec<Vec<usize>> = (0..tree.n_bodies()).map(|body| tree.chain(body)).collect();
        // By two bodies: joints between each and the last body that they share.
        let joints = |up: &Vec<usize>, down: &Vec<usize>| {
            let shared = up.iter().rev().zip(down.iter().rev()).take_while(|(p, q)| p == q).count();
            (up.len() - shared, down.len() - shared)
        };
        let table: Vec<Vec<(usize, usize)>> =
            chains.iter().map(|up| chains.iter().map(|down| joints(up, down)).collect()).collect();
        for a in 0..n_moving {
            for b in a + 1..self.items.len() {
                let (first, second) = (&self.items[a], &self.items[b]);
                let Some(floor) = floor(first, second) else { continue };
                let (joints_a, joints_b) = table[first.body][second.body];
                // What stands still and what no joint moves never meet: nothing that a plan does changes it.
                let is_carried = matches!(first.owner, Owner::Carried(_));
                if second.owner == Owner::Still && joints_a == 0 && !is_carried {
                    continue;
                }
                self.pairs.push(Pair { a, b, joints_a, joints_b, floor });
            }
        }
    }
}

/// The fingertip that an element of a link's collision geometry is.
fn tip_at(robot: &Manipulator, link: LinkId, element: usize) -> Option<(usize, usize)> {
    let is_part = |tip: &Tip| match &tip.shape {
        TipShape::Hull { elements, .. } => elements.is_empty() || elements.contains(&element),
        _ => true,
    };
    let of_hand = |hand: &MountedHand| {
        hand.hand.fingers.iter().position(|finger| finger.tip.link == link && is_part(&finger.tip))
    };
    robot.hands.iter().enumerate().find_map(|(h, hand)| Some((h, of_hand(hand)?)))
}

/// Whether two links of a robot are judged against each other. Fingertips have shapes of their own, which overlap those of the links
/// that they stand on.
pub fn are_judged(first: &Item, second: &Item, question: &Question) -> bool {
    let (Owner::Link(p), Owner::Link(q)) = (first.owner, second.owner) else { return true };
    let (is_tip, near) = (first.is_own_tip || second.is_own_tip, question.tree.body(first.body.max(second.body)));
    let is_near = first.body == second.body || near.is_some_and(|body| body.parent == first.body.min(second.body));
    !(question.robot.may_touch(p, q) || is_tip && is_near)
}

/// What two items have to keep; none where they may touch.
fn floor_of(first: &Item, second: &Item, question: &Question, floors: Floors) -> Option<f64> {
    let held = |carried: &Carried, link: LinkId| match carried.is_held_by(question.robot, link) {
        true => floors.held,
        false => floors.apart,
    };
    match (first.owner, second.owner) {
        (Owner::Link(_), Owner::Link(_)) => are_judged(first, second, question).then_some(floors.apart),
        (Owner::Link(link), Owner::Carried(index)) | (Owner::Carried(index), Owner::Link(link)) => {
            Some(held(&question.carried[index], link))
        }
        _ => Some(floors.apart),
    }
}
