//! Names of what stands in the model. Every geom, body, joint, site, sensor and equality has one of its own.
//!
//! In a scene of one hand and one object, links, joints and fingers keep their names, and the object is `object`. In all other
//! scenes the name of the hand or the object and a slash come first: `right/palm`, `box/object`.

use super::solid::ObjectSolid;
use super::tip::{own_tip, tip_name};
use regrasp_geometry::shape::PlacedShape;
use regrasp_robot::tip::is_same_surface;
use regrasp_robot::{Hand, JointId, LinkId, Robot};
use regrasp_scene::{Manipulation, Obstacle, Scene};
use std::slice;

/// Names of a hand.
pub(super) struct HandNames {
    /// What stands before every name: nothing, or the hand's name and a slash.
    prefix: String,
    /// Geoms of `Finger::shapes`.
    pub fingers: Vec<Vec<String>>,
    /// Of each finger, the geoms that touch the object when it holds.
    pub touching: Vec<Vec<String>>,
    /// Geoms of `Hand::palm`.
    pub palm: Vec<String>,
}

/// Names of an object.
pub(super) struct ObjectNames {
    /// What its sensors begin with.
    pub sensor: String,
    /// Its body and its free joint.
    pub body: String,
    /// Its geoms, one for each convex part.
    pub geoms: Vec<String>,
    /// The equality that holds it where it starts.
    pub pin: String,
}

/// Names of everything in the model.
pub(super) struct Names {
    /// Of the hands, in the order of the scene.
    pub hands: Vec<HandNames>,
    /// Of the objects, in the order of the scene.
    pub objects: Vec<ObjectNames>,
    /// Geoms of the supports.
    pub supports: Vec<String>,
    /// Geoms of the obstacles.
    pub obstacles: Vec<String>,
    /// Geoms of the links of robots that belong to no hand.
    pub links: Vec<String>,
}

impl Names {
    /// The names of everything in `scene`, of which the objects have these `solids`; `links` are those of robots that belong to no
    /// hand.
    pub fn of(scene: &Scene, solids: &[ObjectSolid], links: &[Obstacle]) -> Self {
        let has_one_of_each = scene.hands.len() == 1 && scene.objects.len() == 1;
        let prefix = |name: &str| if has_one_of_each { String::new() } else { format!("{name}/") };
        let hands: Vec<HandNames> =
            scene.hands.iter().map(|placed| HandNames::of(&placed.hand, prefix(&placed.name))).collect();
        let object = |name: &str, solid: &ObjectSolid| {
            let prefix = prefix(name);
            let mut body = format!("{prefix}object");
            while scene.hands.iter().zip(&hands).any(|(placed, names)| names.uses(&placed.hand, &body)) {
                body.push('_');
            }
            let sensor = format!("{prefix}object");
            let part = |k: usize| if k == 0 { sensor.clone() } else { format!("{sensor}:{k}") };
            let geoms = (0..solid.parts.len()).map(part).collect();
            ObjectNames { sensor, body, geoms, pin: format!("{prefix}pin") }
        };
        Names {
            objects: scene.objects.iter().zip(solids).map(|(each, solid)| object(&each.name, solid)).collect(),
            supports: scene.supports.iter().map(|support| format!("support:{}", support.body.name)).collect(),
            obstacles: scene.obstacles.iter().map(|obstacle| format!("obstacle:{}", obstacle.name)).collect(),
            links: links.iter().enumerate().map(|(index, link)| format!("link:{}:{index}", link.name)).collect(),
            hands,
        }
    }

    /// The geoms of each of `HandView::obstacles` of `task`, in that order; two shapes that are written as one geom have the same
    /// name.
    pub fn around(&self, task: &Manipulation) -> Vec<&[String]> {
        let fixed = self.obstacles.iter().chain(&self.supports).chain(&self.links);
        let mut names: Vec<&[String]> = fixed.map(slice::from_ref).collect();
        for (index, placed) in task.scene.hands.iter().enumerate().filter(|(index, _)| *index != task.hand_index) {
            let own = &self.hands[index];
            names.extend(own.palm.iter().map(slice::from_ref));
            for (f, finger) in placed.hand.fingers.iter().enumerate() {
                names.extend(own.fingers[f].iter().map(slice::from_ref));
                if finger.tip.own_shape().is_some() {
                    names.extend(own.touching[f].iter().map(slice::from_ref));
                }
            }
        }
        let others = self.objects.iter().enumerate().filter(|(index, _)| *index != task.object_index);
        names.extend(others.map(|(_, names)| names.geoms.as_slice()));
        names
    }
}

/// The body of a link that keeps its name. MuJoCo has a body of its own that is called `world`, as the root link of many a URDF is.
pub(super) fn body_name(robot: &Robot, link: LinkId) -> String {
    let mut name = robot.links[link.0].name.clone();
    if name == "world" {
        while robot.link_named(&name).is_some() {
            name.push('_');
        }
    }
    name
}

impl HandNames {
    fn of(hand: &Hand, prefix: String) -> Self {
        let mut used = vec![0; hand.robot.links.len()];
        let mut name_of = |link: LinkId| {
            used[link.0] += 1;
            format!("{prefix}{}:{}", hand.robot.links[link.0].name, used[link.0] - 1)
        };
        let palm = hand.palm.iter().map(|shape| name_of(shape.link)).collect();
        let (mut fingers, mut touching) = (Vec::new(), Vec::new());
        for finger in &hand.fingers {
            let own = own_tip(finger);
            let is_own = |placed: &PlacedShape| own.as_ref().is_some_and(|own| is_same_surface(placed, own));
            let tip = format!("{prefix}{}", tip_name(finger));
            let of_finger: Vec<String> = finger
                .shapes
                .iter()
                .map(|shape| if is_own(&shape.placed) { tip.clone() } else { name_of(shape.link) })
                .collect();
            touching.push(match own {
                Some(_) => vec![tip],
                None => {
                    let tips = finger.shapes.iter().zip(&of_finger).filter(|(shape, _)| shape.is_tip);
                    tips.map(|(_, name)| name.clone()).collect()
                }
            });
            fingers.push(of_finger);
        }
        HandNames { prefix, fingers, touching, palm }
    }

    /// The name in the model of what the hand calls `name`.
    pub fn named(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }

    /// The body of a link.
    pub fn link(&self, hand: &Hand, link: LinkId) -> String {
        match self.prefix.is_empty() {
            true => body_name(&hand.robot, link),
            false => self.named(&hand.robot.links[link.0].name),
        }
    }

    /// A joint, and its motor or servo.
    pub fn joint(&self, hand: &Hand, joint: JointId) -> String {
        self.named(&hand.robot.joints[joint.0].name)
    }

    /// All geoms.
    pub fn geoms(&self) -> impl Iterator<Item = &str> {
        self.palm.iter().chain(self.fingers.iter().flatten()).chain(self.touching.iter().flatten()).map(String::as_str)
    }

    /// True where a link or a joint has this name.
    fn uses(&self, hand: &Hand, name: &str) -> bool {
        let own = name.strip_prefix(&self.prefix);
        own.is_some_and(|name| hand.robot.link_named(name).is_some() || hand.robot.joint_named(name).is_some())
    }
}
