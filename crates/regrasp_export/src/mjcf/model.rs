//! The model as an MJCF document.

mod pairs;

use super::Mjcf;
use super::geom::{Geom, Look, OBJECT_MATERIAL, is_hollowed, write_geom, write_mesh};
use super::hand::{Drive, ModelHand};
use super::names::Names;
use super::object::{Hold, ModelObject, hold_at_rest};
use super::solid::ObjectSolid;
use super::xml::{Xml, numbers};
use regrasp_geometry::{Pose, Vector, pose_from};
use regrasp_plan::Plan;
use regrasp_scene::{Manipulation, Obstacle};

/// Gravity where the plan says nothing, in m/s^2: along -z of the world.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];
const OBSTACLE_COLOR: &str = "0.5 0.45 0.4 1";
const SUPPORT_COLOR: &str = "0.62 0.58 0.5 1";
const ROBOT_COLOR: &str = "0.7 0.71 0.74 1";

/// Everything that stands in the model.
pub(super) struct MjcfModel<'a> {
    pub task: &'a Manipulation<'a>,
    pub names: &'a Names,
    /// Links of robots that belong to no hand, where they rest.
    links: &'a [Obstacle],
    pub hands: Vec<ModelHand<'a>>,
    pub objects: Vec<ModelObject<'a>>,
}

/// The model in which the objects of the scene have these `solids`.
pub(super) fn write(task: &Manipulation, plan: &Plan, solids: &[ObjectSolid]) -> Mjcf {
    let scene = task.scene;
    let links = task.robot_bodies();
    let names = Names::of(scene, solids, &links);
    let gravity = plan.promises.forces.as_ref().map_or(Some(GRAVITY), |forces| forces.gravity_in_world);
    let gravity = gravity.unwrap_or(GRAVITY);
    let model = MjcfModel::new(task, plan, (&names, solids, &links), &Vector::from(gravity));
    let mut xml = Xml::default();
    xml.open("mujoco", &[("model", scene.name.clone())]);
    write_settings(&mut xml, gravity);
    model.write_assets(&mut xml);
    model.write_bodies(&mut xml);
    pairs::write(&mut xml, &model);
    model.write_couplings(&mut xml);
    model.write_drives_and_sensors(&mut xml);
    model.write_keyframes(&mut xml, plan);
    xml.close();
    Mjcf { xml: xml.finish(), notes: model.notes() }
}

/// Solver, contacts and joints: physics notes, sections 1 and 2.
fn write_settings(xml: &mut Xml, gravity: [f64; 3]) {
    xml.leaf(
        "compiler",
        &[("angle", "radian".into()), ("autolimits", "true".into()), ("balanceinertia", "true".into())],
    );
    xml.leaf(
        "option",
        &[
            ("timestep", "0.002".into()),
            ("integrator", "implicitfast".into()),
            ("cone", "elliptic".into()),
            ("impratio", "10".into()),
            ("noslip_iterations", "60".into()),
            ("gravity", numbers(gravity)),
        ],
    );
    xml.open("visual", &[]);
    xml.leaf("global", &[("offwidth", "1280".into()), ("offheight", "960".into())]);
    xml.leaf("headlight", &[("ambient", "0.4 0.4 0.4".into()), ("diffuse", "0.5 0.5 0.5".into())]);
    xml.close();
    xml.open("default", &[]);
    // What touches what is said by pairs alone.
    xml.leaf("geom", &[("contype", "0".into()), ("conaffinity", "0".into())]);
    xml.leaf("joint", &[&[("armature", "0.0002".into()), ("damping", "0.005".into())], &hard_stops()[..]].concat());
    xml.leaf("pair", &[("solref", "0.005 1".into()), ("solimp", "0.95 0.99 0.0005".into())]);
    xml.open("default", &[("class", "unplanned".into())]);
    xml.leaf("pair", &[("condim", "3".into())]);
    xml.close();
    xml.open("default", &[("class", "slide".into())]);
    // By hand: what the turning joints' values are at the end of a finger of 0.1 m.
    xml.leaf("joint", &[("armature", "0.02".into()), ("damping", "0.5".into())]);
    xml.close();
    xml.close();
}

/// How joints stop at their limits. With MuJoCo's own values a finger's light links give: one that pressed on an object with 15 N was 0.1 rad
/// beyond its stop. With these the same force moves it by less than a milliradian.
pub fn hard_stops() -> [(&'static str, String); 2] {
    [("solreflimit", "0.004 1".into()), ("solimplimit", "0.99 0.999 0.0001".into())]
}

impl<'a> MjcfModel<'a> {
    fn new(
        task: &'a Manipulation<'a>,
        plan: &Plan,
        (names, solids, links): (&'a Names, &'a [ObjectSolid], &'a [Obstacle]),
        gravity: &Vector,
    ) -> Self {
        let scene = task.scene;
        let hands = scene.hands.iter().zip(&names.hands).enumerate();
        let hands = hands.map(|(index, (placed, names))| {
            let drive = if index == task.hand_index { Drive::Motors } else { Drive::Servos };
            ModelHand::new(placed, task.state.world_from_hand(scene, index), names, drive)
        });
        let start = &plan.segments[0].waypoints[0].world_from_object;
        let objects = scene.objects.iter().zip(&names.objects).zip(&task.state.world_from_objects).enumerate();
        let objects = objects.map(|(index, ((object, names), at_rest))| {
            let (world_from_object, hold) = if index == task.object_index {
                (pose_from(start.position, start.quat_xyzw), Hold::Fingers)
            } else {
                (*at_rest, hold_at_rest(object, at_rest, &scene.supports, gravity))
            };
            ModelObject { object, names, solid: &solids[index], world_from_object, hold }
        });
        MjcfModel { task, names, links, hands: hands.collect(), objects: objects.collect() }
    }

    /// Obstacles, supports, then links of robots, each with the name of its geom and its colour.
    fn fixed(&self) -> impl Iterator<Item = (&'a Obstacle, &'a str, &'static str)> {
        let MjcfModel { task, names, links, .. } = *self;
        let obstacles = task.scene.obstacles.iter().zip(&names.obstacles);
        let obstacles = obstacles.map(|(body, name)| (body, name.as_str(), OBSTACLE_COLOR));
        let supports = task.scene.supports.iter().zip(&names.supports);
        let links = links.iter().zip(&names.links).map(|(body, name)| (body, name.as_str(), ROBOT_COLOR));
        obstacles.chain(supports.map(|(support, name)| (&support.body, name.as_str(), SUPPORT_COLOR))).chain(links)
    }

    fn write_assets(&self, xml: &mut Xml) {
        xml.open("asset", &[]);
        let texture = |kind: &str, pattern: &str, colors: [&str; 2]| {
            let side = if kind == "cube" { "64" } else { "16" };
            let texture = [("type", kind.to_owned()), ("builtin", pattern.to_owned()), ("width", side.to_owned())];
            let colors = [("height", side.to_owned()), ("rgb1", colors[0].to_owned()), ("rgb2", colors[1].to_owned())];
            [&texture[..], &colors[..]].concat()
        };
        xml.leaf("texture", &texture("skybox", "flat", ["1 1 1", "1 1 1"]));
        let checkers = texture("cube", "checker", ["0.95 0.8 0.35", "0.75 0.45 0.15"]);
        xml.leaf("texture", &[&[("name", OBJECT_MATERIAL.to_owned())], &checkers[..]].concat());
        xml.leaf("material", &[("name", OBJECT_MATERIAL.into()), ("texture", OBJECT_MATERIAL.into())]);
        for hand in &self.hands {
            hand.write_meshes(xml);
        }
        for (body, name, _) in self.fixed() {
            write_mesh(xml, &body.placed.shape, name);
        }
        for object in &self.objects {
            let parts = object.solid.parts.iter().zip(&object.names.geoms);
            parts.for_each(|(shape, name)| write_mesh(xml, shape, name));
        }
        xml.close();
    }

    fn write_bodies(&self, xml: &mut Xml) {
        xml.open("worldbody", &[]);
        xml.leaf(
            "light",
            &[("pos", "0.3 -0.3 1".into()), ("dir", "-0.3 0.3 -1".into()), ("directional", "true".into())],
        );
        for (body, name, color) in self.fixed() {
            let (body_from_shape, shape) = (body.placed.parent_from_shape, &body.placed.shape);
            write_geom(xml, &Geom { name, look: Look::Color(color), body_from_shape, shape });
        }
        for hand in &self.hands {
            hand.write_bodies(xml);
        }
        for object in &self.objects {
            object.write_body(xml);
        }
        xml.close();
    }

    /// Joints that follow others, and the pins of the objects.
    fn write_couplings(&self, xml: &mut Xml) {
        if self.hands.iter().any(|hand| !hand.sums().is_empty()) {
            xml.open("tendon", &[]);
            for hand in &self.hands {
                hand.write_sums(xml);
            }
            xml.close();
        }
        xml.open("equality", &[]);
        for hand in &self.hands {
            hand.write_couplings(xml);
        }
        for object in &self.objects {
            object.write_pin(xml);
        }
        xml.close();
    }

    fn write_drives_and_sensors(&self, xml: &mut Xml) {
        xml.open("actuator", &[]);
        for hand in &self.hands {
            hand.write_drives(xml);
        }
        xml.close();
        xml.open("sensor", &[]);
        for hand in &self.hands {
            hand.write_sensors(xml);
        }
        for object in &self.objects {
            object.write_sensors(xml);
        }
        xml.close();
    }

    /// A keyframe for every waypoint. What the plan does not move is where the scene has it.
    fn write_keyframes(&self, xml: &mut Xml, plan: &Plan) {
        let state = self.task.state;
        let is_moved = |index: usize| index == self.task.hand_index;
        xml.open("keyframe", &[]);
        for (s, segment) in plan.segments.iter().enumerate() {
            for (w, waypoint) in segment.waypoints.iter().enumerate() {
                let of_hand = |index: usize| if is_moved(index) { &waypoint.joints } else { &state.hand_joints[index] };
                let mut qpos: Vec<f64> = Vec::new();
                for (index, hand) in self.hands.iter().enumerate() {
                    qpos.extend(hand.positions(of_hand(index)));
                }
                for (index, object) in self.objects.iter().enumerate() {
                    let now = &waypoint.world_from_object;
                    let (position, [x, y, z, w_last]) = match index == self.task.object_index {
                        true => (now.position, now.quat_xyzw),
                        false => coordinates(&object.world_from_object),
                    };
                    qpos.extend(position.iter().chain(&[w_last, x, y, z]));
                }
                let mut attributes =
                    vec![("name", format!("{s}_{w}")), ("time", numbers([waypoint.time])), ("qpos", numbers(qpos))];
                let has_forces = !waypoint.joint_torques.is_empty();
                if has_forces || self.hands.len() > 1 {
                    let rest = vec![0.0; plan.joint_names.len()];
                    let torques = if has_forces { &waypoint.joint_torques } else { &rest };
                    let commands = |index: usize| if is_moved(index) { torques } else { &state.hand_joints[index] };
                    let commands = (0..self.hands.len()).flat_map(commands);
                    attributes.push(("ctrl", numbers(commands.copied())));
                }
                xml.leaf("key", &attributes);
            }
        }
        xml.close();
    }

    fn notes(&self) -> Vec<String> {
        let moved = &self.objects[self.task.object_index];
        let others = || self.objects.iter().filter(|object| object.hold != Hold::Fingers);
        let cut = std::iter::once(moved).chain(others()).filter_map(|object| {
            let note = object.solid.note.as_ref()?;
            Some(format!("\"{}\" is not convex; {note}", object.object.name))
        });
        let fixed = self.fixed().filter(|(body, _, _)| is_hollowed(&body.placed.shape));
        let hollowed =
            fixed.map(|(body, _, _)| format!("\"{}\" is not convex; MuJoCo collides with its convex hull", body.name));
        let pinned = others().filter(|object| object.hold == Hold::Pin).map(|object| {
            let (name, pin) = (&object.object.name, &object.names.pin);
            format!("\"{name}\" stands on no support; the weld \"{pin}\" holds it where the scene has it")
        });
        cut.chain(hollowed).chain(pinned).collect()
    }
}

fn coordinates(pose: &Pose) -> ([f64; 3], [f64; 4]) {
    (pose.translation.vector.into(), pose.rotation.coords.into())
}
