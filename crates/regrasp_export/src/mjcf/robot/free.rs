//! The object of pick and place, free from the first moment, and what may touch it.
//!
//! Links, supports and obstacles touch it by the bits of their classes, fingertips by pairs with the friction of their contact
//! models. A round fingertip touches it with its ball, as the plan means it, and everything else with the shapes of its link.

use super::{RobotModel, clear, tip_in_link};
use crate::mjcf::geom::{Geom, Look, Weight, open_body, write_geom, write_inertial};
use crate::mjcf::inertia;
use crate::mjcf::solid::ObjectSolid;
use crate::mjcf::tip::{POINT_TORSION, ROLLING, friction_of};
use crate::mjcf::xml::{Xml, numbers};
use regrasp_geometry::{Pose, Shape};
use regrasp_plan::robot_plan::RobotPlan;
use regrasp_robot::Finger;
use regrasp_robot::tip::is_same_surface;
use regrasp_scene::{Object, Scene};

const OBJECT_COLOR: &str = "0.9 0.6 0.25 1";
/// Solver and contacts as in replays of one hand (`docs/reference/replay.md`).
pub(super) const SOLVER: [(&str, &str); 3] = [("cone", "elliptic"), ("impratio", "10"), ("noslip_iterations", "60")];
const STIFF: [(&str, &str); 2] = [("solref", "0.005 1"), ("solimp", "0.95 0.99 0.0005")];

/// The object that the plan moves.
pub(super) struct FreeObject<'a> {
    pub object: &'a Object,
    pub solid: ObjectSolid,
    world_from_object: Pose,
}

/// Classes of its geoms and of its contacts with fingertips.
pub(super) fn write_defaults(xml: &mut Xml, free: &FreeObject) {
    let stiff = STIFF.map(|(key, value)| (key, value.to_owned()));
    xml.leaf("pair", &stiff);
    xml.open("default", &[("class", "object".into())]);
    let bits = [("contype", "4".into()), ("conaffinity", "0".into()), ("priority", "1".into()), ("condim", "3".into())];
    let friction = [("friction", numbers([free.object.friction, POINT_TORSION, ROLLING]))];
    xml.leaf("geom", &[&bits[..], &friction[..], &stiff[..]].concat());
    xml.close();
}

impl<'a> FreeObject<'a> {
    /// The only object of `plan`, where its first waypoint has it.
    pub fn of((scene, robot): (&'a Scene, usize), plan: &RobotPlan) -> Result<Self, String> {
        let [name] = plan.objects.as_slice() else {
            return Err(format!("the plan moves {} objects; plans of pick and place move one", plan.objects.len()));
        };
        let index = scene.object_named(name).ok_or_else(|| format!("the scene has no object \"{name}\""))?;
        let known = |hand: &str| scene.robots[robot].hands.iter().any(|own| own.name == hand);
        if let Some(hand) = plan.hands.iter().find(|hand| !known(&hand.name)) {
            return Err(format!("the robot has no hand \"{}\"", hand.name));
        }
        let first = plan.waypoints().next().and_then(|waypoint| waypoint.world_from_objects.first());
        let world_from_object = Pose::from(first.ok_or("the plan does not say where the object is")?);
        let object = &scene.objects[index];
        let solid = ObjectSolid::finely(object, &clear::for_hands(&scene.robots[robot], object, plan));
        Ok(FreeObject { object, solid, world_from_object })
    }

    /// Its convex parts with the names of their geoms.
    pub fn parts(&self) -> impl Iterator<Item = (String, &Shape)> {
        let name = &self.object.name;
        let name = move |k: usize| if k == 0 { format!("object:{name}") } else { format!("object:{name}:{k}") };
        self.solid.parts.iter().enumerate().map(move |(k, shape)| (name(k), shape))
    }

    pub fn write_body(&self, xml: &mut Xml) {
        let name = format!("object:{}", self.object.name);
        open_body(xml, name.clone(), &self.world_from_object, Weight::Falls);
        xml.leaf("freejoint", &[("name", name)]);
        write_inertial(xml, &inertia::of_object(self.object));
        xml.open("frame", &[("childclass", "object".into())]);
        for (name, shape) in self.parts() {
            let look = Look::Color(OBJECT_COLOR);
            write_geom(xml, &Geom { name: &name, look, body_from_shape: Pose::identity(), shape });
        }
        xml.close();
        xml.close();
    }
}

impl RobotModel<'_> {
    /// Fingertips with the free object.
    pub(super) fn write_contacts(&self, xml: &mut Xml) {
        let Some(free) = &self.free else { return };
        xml.open("contact", &[]);
        for finger in self.robot.hands.iter().flat_map(|hand| &hand.hand.fingers) {
            let (condim, coefficients) = friction_of(finger, free.object.friction);
            for tip in self.touching(finger) {
                for (part, _) in free.parts() {
                    let pair = [
                        ("geom1", tip.to_owned()),
                        ("geom2", part),
                        ("condim", condim.to_string()),
                        ("friction", numbers(coefficients)),
                    ];
                    xml.leaf("pair", &pair);
                }
            }
        }
        xml.close();
    }

    /// Geoms with which a finger holds: the ball of its tip, or the shapes of its tip link.
    fn touching(&self, finger: &Finger) -> Vec<&str> {
        let own = tip_in_link(self.robot, finger);
        let links =
            || finger.shapes.iter().filter(|shape| shape.is_tip).map(|shape| shape.link).chain([finger.tip.link]);
        let mut names: Vec<&str> = Vec::new();
        for geom in links().flat_map(|link| &self.shapes[link.0]).filter(|geom| geom.is_tip) {
            let touches = own.as_ref().is_none_or(|own| is_same_surface(&geom.placed, own));
            if touches && !names.contains(&geom.name.as_str()) {
                names.push(&geom.name);
            }
        }
        names
    }
}
