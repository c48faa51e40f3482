//! The robot and what stands around it.

use crate::model::cover::{LinkCover, cover, covers};
use crate::model::{ArmModel, Attached};
use crate::roadmap::Roads;
use crate::world::{Obstacle, World};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape};
use regrasp_robot::manipulator::layout::Part;
use regrasp_robot::{LinkId, Manipulator};
use regrasp_scene::{MotionQuery, Scene, State};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Covers that do not change from motion to motion.
#[derive(Debug, Clone)]
pub struct Covers {
    /// By link of the robot.
    pub links: Vec<LinkCover>,
    /// Of the objects that the robot may carry, in the frame of the object, by index in `Scene::objects`.
    pub objects: BTreeMap<usize, LinkCover>,
}

/// A query with all that planning needs of the scene.
pub struct Problem<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What is asked.
    pub query: &'a MotionQuery,
    /// The robot that moves.
    pub robot: &'a Manipulator,
    /// What rests around it.
    pub world: Arc<World>,
    covers: Arc<Covers>,
    /// What the robot carries.
    pub attached: Vec<Attached>,
    /// By carried object: its pose in the frame of its link.
    pub link_from_objects: Vec<Pose>,
    /// A graph of the robot among obstacles that rest, where one is known.
    pub roads: Option<KnownRoads<'a>>,
}

/// A graph of a robot, and what it does not know of a problem.
#[derive(Clone)]
pub struct KnownRoads<'a> {
    /// The graph.
    pub roads: &'a Roads,
    /// What rests and the graph does not know.
    pub unknown: Arc<World>,
    /// Links that are not where the graph has them, besides what is carried: by index.
    pub changed: BTreeSet<LinkId>,
}

impl<'a> Problem<'a> {
    /// All that rests in `state` and is not carried is in the way.
    pub fn new((scene, state): (&'a Scene, &State), query: &'a MotionQuery) -> Self {
        let links = covers(&scene.robots[query.robot].robot);
        let covers = Covers { links, objects: BTreeMap::new() };
        Self::in_world(scene, query, Arc::new(World::new(surroundings(scene, state, query))), &Arc::new(covers))
    }

    /// In a world that is made already, with covers that are known. Objects without one get theirs.
    pub fn in_world(scene: &'a Scene, query: &'a MotionQuery, world: Arc<World>, known: &Arc<Covers>) -> Self {
        let robot = &scene.robots[query.robot];
        let mut poses = Vec::new();
        robot.link_poses(&query.start, &mut poses);
        let (mut attached, mut link_from_objects) = (Vec::new(), Vec::new());
        for carried in &query.carried {
            let object = &scene.objects[carried.object];
            // The scene's reader refuses holders that the robot does not have.
            let Some(link) = carried.holder.link(scene, query.robot) else { continue };
            let first = carried.holder.first_link(scene, query.robot).unwrap_or(link);
            let link_from_object = poses[link.0].inverse() * carried.world_from_object;
            let placed = PlacedShape { parent_from_shape: link_from_object, shape: object.solid().clone() };
            let mut may_touch = BTreeSet::from([first]);
            let mut waiting = vec![first];
            while let Some(link) = waiting.pop() {
                let below = robot.robot.joints_from(link).map(|joint| robot.robot.joints[joint.0].child);
                waiting.extend(below.filter(|&child| may_touch.insert(child)));
            }
            let cover = match known.objects.get(&carried.object) {
                Some(of_object) => of_object.moved(&link_from_object),
                None => cover(&[placed]),
            };
            attached.push(Attached { name: object.name.clone(), link, cover, may_touch });
            link_from_objects.push(link_from_object);
        }
        Problem { scene, query, robot, world, covers: known.clone(), attached, link_from_objects, roads: None }
    }

    /// The robot with these coordinates free, all others as at the start.
    pub fn model(&self, free: &[usize]) -> ArmModel {
        ArmModel::new(self.robot, &self.covers.links, &self.attached, &self.query.start, free)
    }

    /// The robot without what it carries, with coordinates `free`, all others as in `state`.
    pub(crate) fn bare_model(&self, state: &[f64], free: &[usize]) -> ArmModel {
        ArmModel::new(self.robot, &self.covers.links, &[], state, free)
    }

    /// Sets of coordinates to plan with, in this order: those of the parts that the goals change, then those of all arms too.
    pub fn groups(&self, goals: &[Vec<f64>]) -> Vec<Vec<usize>> {
        let coordinates = &self.robot.layout.coordinates;
        let changes = |k: usize| goals.iter().any(|goal| goal[k] != self.query.start[k]);
        let changed: BTreeSet<Part> =
            (0..coordinates.len()).filter(|&k| changes(k)).map(|k| coordinates[k].part).collect();
        let is_hand = |part: Part| matches!(part, Part::Hand(_));
        let small: Vec<usize> = (0..coordinates.len())
            .filter(|&k| changes(k) || changed.contains(&coordinates[k].part) && !is_hand(coordinates[k].part))
            .collect();
        let large: Vec<usize> =
            (0..coordinates.len()).filter(|&k| changes(k) || !is_hand(coordinates[k].part)).collect();
        let mut groups = vec![small];
        if groups[0] != large {
            groups.push(large);
        }
        groups.retain(|group| !group.is_empty());
        if groups.is_empty() {
            groups.push((0..coordinates.len()).collect());
        }
        groups
    }
}

/// Everything that rests while the robot moves.
pub fn surroundings(scene: &Scene, state: &State, query: &MotionQuery) -> Vec<Obstacle> {
    let mut all = Vec::new();
    let fixed = scene.supports.iter().map(|support| &support.body).chain(&scene.obstacles);
    all.extend(fixed.map(|body| Obstacle { name: body.name.clone(), placed: body.placed.clone() }));
    for (index, object) in scene.objects.iter().enumerate() {
        if query.carried.iter().all(|carried| carried.object != index) {
            let placed =
                PlacedShape { parent_from_shape: state.world_from_objects[index], shape: object.solid().clone() };
            all.push(Obstacle { name: object.name.clone(), placed });
        }
    }
    for (index, robot) in scene.robots.iter().enumerate().filter(|(index, _)| *index != query.robot) {
        add_links(robot, &state.robot_joints[index], &mut all);
    }
    for (index, hand) in scene.hands.iter().enumerate().filter(|(_, hand)| hand.carrier.is_none()) {
        let made = Manipulator::of_hand(hand.name.clone(), hand.hand.clone(), &hand.world_from_hand);
        if let Ok(alone) = made {
            let mut joints = alone.layout.rest();
            joints.iter_mut().zip(&state.hand_joints[index]).for_each(|(joint, value)| *joint = *value);
            add_links(&alone, &joints, &mut all);
        }
    }
    all
}

fn add_links(robot: &Manipulator, joints: &[f64], all: &mut Vec<Obstacle>) {
    let mut poses = Vec::new();
    robot.link_poses(joints, &mut poses);
    for (link, pose) in robot.robot.links.iter().zip(&poses) {
        for placed in &link.collision {
            let shape: Shape = regrasp_robot::hand::convex_of(&placed.shape).unwrap_or_else(|_| placed.shape.clone());
            let placed = PlacedShape { parent_from_shape: pose * placed.parent_from_shape, shape };
            all.push(Obstacle { name: format!("{}/{}", robot.name, link.name), placed });
        }
    }
}
