//! What a plan of pick and place is about: robot, hands, object, gravity.

use crate::check::model::FingerModel;
use crate::check::prepared::Prepared;
use crate::check::robots::question::Question;
use crate::check::violation::{Violation, ViolationKind as Kind};
use crate::robot_plan::{HoldingPromises, RobotPlan};
use regrasp_geometry::Vector;
use regrasp_robot::{LinkId, Manipulator, Part};
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use regrasp_scene::{Object, PickAndPlaceQuery, Scene};
use std::ops::Range;

/// A hand of the robot.
pub struct TaskHand {
    /// Its name in the scene.
    pub name: String,
    /// Its index in `Manipulator::hands`.
    pub index: usize,
    /// The body of the link whose frame is the hand's.
    pub body: usize,
    /// Its own joints, in the joint vector.
    pub joints: Range<usize>,
    /// Coordinates that move its base.
    pub above: Vec<usize>,
    /// Its fingers. Their paths begin at the world, and their joint vector is the robot's.
    pub fingers: Vec<FingerModel>,
}

/// A plan's robot, its hands and the object.
pub struct Task<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The robot; it carries nothing all through the plan.
    pub question: Question<'a>,
    /// Index of the object in `Scene::objects`.
    pub object_index: usize,
    /// The object.
    pub object: &'a Object,
    /// Gravity, in the world.
    pub gravity: Vector,
    /// Hands of the robot, in the order of the scene.
    pub hands: Vec<TaskHand>,
    /// What the plan promises of holding.
    pub promises: HoldingPromises,
}

impl<'a> Task<'a> {
    /// Err with a violation: the plan is of another task, robot, hand or object than the scene or the query, or promises nothing of
    /// holding; gravity has no direction.
    pub fn new(scene: &'a Scene, query: Option<&PickAndPlaceQuery>, plan: &RobotPlan) -> Result<Self, Violation> {
        let wrong = |message: String| Violation::new(Kind::WrongScene, message);
        let asked = query.map(|query| (query.robot, query.name.as_str()));
        let question = Question::of_task(PICK_AND_PLACE, scene, asked, plan)?;
        let Some(gravity) = scene.gravity().in_world() else {
            return Err(wrong("an object stands on supports only under gravity of one direction".into()));
        };
        let [name] = plan.objects.as_slice() else {
            return Err(wrong(format!(
                "the plan moves {} objects; a task of pick and place has one",
                plan.objects.len()
            )));
        };
        let object_index = scene.object_named(name);
        let Some(object_index) = object_index.filter(|index| query.is_none_or(|query| query.object == *index)) else {
            return Err(wrong(format!("the plan's object \"{name}\" is not the one asked for")));
        };
        let hands = hands_of(scene, &question).map_err(wrong)?;
        let is_named = plan.hands.len() == hands.len()
            && plan.hands.iter().zip(&hands).all(|(named, hand)| {
                let fingers = hand.fingers.iter().map(|finger| &finger.name);
                named.name == hand.name && named.fingers.iter().eq(fingers)
            });
        if !is_named {
            let names: Vec<&str> = hands.iter().map(|hand| hand.name.as_str()).collect();
            return Err(wrong(format!("the plan does not name the robot's hands {names:?} with all their fingers")));
        }
        let Some(promises) = plan.promises.holding.clone() else {
            let message = "the plan does not say with which tolerance, friction and margin hands hold";
            return Err(Violation::new(Kind::PromiseBroken, message).subjects(["holding"]));
        };
        let object = &scene.objects[object_index];
        Ok(Task { scene, question, object_index, object, gravity, hands, promises })
    }

    /// Largest distance of a fingertip from its contact.
    pub fn contact_tolerance(&self, largest: f64) -> f64 {
        self.promises.contact_tolerance.min(largest)
    }

    /// Index of the hand called `name`.
    pub fn hand_named(&self, name: &str) -> Option<usize> {
        self.hands.iter().position(|hand| hand.name == name)
    }

    /// Index of the support called `name`.
    pub fn support_named(&self, name: &str) -> Option<usize> {
        self.scene.supports.iter().position(|support| support.body.name == name)
    }

    /// The unit vector against gravity.
    pub fn up(&self) -> Vector {
        -self.gravity.normalize()
    }
}

fn hands_of(scene: &Scene, question: &Question) -> Result<Vec<TaskHand>, String> {
    let robot: &Manipulator = question.robot;
    let names = &question.joint_names;
    let at_rest = robot.layout.rest();
    let prepared = Prepared::default();
    let mut hands = Vec::new();
    for placed in &scene.hands {
        let Some(carrier) = placed.carrier.filter(|carrier| carrier.robot == question.index) else { continue };
        let hand = &robot.hands[carrier.hand].hand;
        let joints = robot.layout.range(Part::Hand(carrier.hand));
        let mut first = joints.start;
        let mut fingers = Vec::new();
        for finger in &hand.fingers {
            let own = first..first + finger.chain.n_coordinates();
            first = own.end;
            let root = (robot.world_from_root(), names.as_slice());
            fingers.push(FingerModel::new(&robot.robot, (finger, &prepared), root, own, &at_rest)?);
        }
        let body = question.tree.link(hand.base).0;
        let above = coordinates_above(question, hand.base);
        hands.push(TaskHand { name: placed.name.clone(), index: carrier.hand, body, joints, above, fingers });
    }
    Ok(hands)
}

/// Coordinates that move a link.
fn coordinates_above(question: &Question, link: LinkId) -> Vec<usize> {
    let (body, _) = *question.tree.link(link);
    let bodies = question.tree.chain(body).into_iter().filter_map(|body| question.tree.body(body));
    let mut found: Vec<usize> = bodies.flat_map(|body| body.drive.terms.iter().map(|(k, _)| *k)).collect();
    found.sort_unstable();
    found.dedup();
    found
}
