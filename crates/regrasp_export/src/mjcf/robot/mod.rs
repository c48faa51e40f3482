//! A MuJoCo model of a plan in which a whole robot moves.
//!
//! Every link is a body. Servos drive the independent joints; gravity on robot and carried objects is compensated, as controllers of
//! arms do. The robot and what it carries collide with everything that stands around; links of the robot do not collide with each
//! other. In a motion, a carried object is a part of what holds it. In pick and place the object is free from the first moment.

/// Where no convex part of the object may stand out.
mod clear;
/// Joints, couplings, servos and keyframes.
mod drives;
/// The object of pick and place, and what may touch it.
mod free;

use super::Mjcf;
use super::geom::{Geom, Look, Weight, is_hollowed, open_body, write_geom, write_inertial, write_mesh};
use super::inertia::{self, Inertial};
use super::model::hard_stops;
use super::names::body_name;
use super::solid::ObjectSolid;
use super::tip::own_tip;
use super::xml::{Xml, numbers};
use free::FreeObject;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape};
use regrasp_plan::robot_plan::RobotPlan;
use regrasp_robot::tip::is_same_surface;
use regrasp_robot::{Finger, LinkId, Manipulator};
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use regrasp_scene::{Holder, Scene, State};
use std::collections::BTreeSet;

const LINK_COLOR: &str = "0.7 0.71 0.74 1";
const FIXED_COLOR: &str = "0.5 0.45 0.4 1";
const OBJECT_COLOR: &str = "0.9 0.6 0.25 1";
/// Gravity, in m/s^2.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.80665];

/// A carried object, on the link that it goes with.
struct Carried<'a> {
    link: LinkId,
    link_from_object: Pose,
    name: &'a str,
    shape: &'a Shape,
    inertial: Inertial,
}

/// A geom of a link.
struct LinkGeom {
    name: String,
    placed: PlacedShape,
    /// True for shapes of links that end in a fingertip: only what `touching` names of them meets the object.
    is_tip: bool,
}

/// A body that stands around, in convex parts.
struct FixedBody {
    name: String,
    world_from_body: Pose,
    solid: ObjectSolid,
}

impl FixedBody {
    fn new(name: &str, placed: &PlacedShape) -> Self {
        let solid = ObjectSolid::of_shape(&placed.shape);
        FixedBody { name: name.to_owned(), world_from_body: placed.parent_from_shape, solid }
    }

    /// The convex parts with the names of their geoms.
    fn parts(&self) -> impl Iterator<Item = (String, &Shape)> {
        let name = |k: usize| if k == 0 { format!("fixed:{}", self.name) } else { format!("fixed:{}:{k}", self.name) };
        self.solid.parts.iter().enumerate().map(move |(k, shape)| (name(k), shape))
    }
}

struct RobotModel<'a> {
    robot: &'a Manipulator,
    carried: Vec<Carried<'a>>,
    /// The object of pick and place.
    free: Option<FreeObject<'a>>,
    /// By link: its geoms, fingertips included.
    shapes: Vec<Vec<LinkGeom>>,
    /// What stands around: obstacles, supports, objects at rest.
    fixed: Vec<FixedBody>,
    /// Joints in the order in which bodies are written.
    order: Vec<usize>,
    /// By link, its pose at the start.
    world_from_link: Vec<Pose>,
}

/// The MuJoCo model of a scene in which the robot of `plan` moves, with the waypoints as keyframes `segment_waypoint`, both from 0.
///
/// Names: bodies and joints as links and joints of the robot, servos as joints; geoms `LINK:k`; `fixed:NAME` for what stands around;
/// `object:NAME` for carried objects, and for the free object of pick and place its body, joint and geom. Further convex parts are
/// `fixed:NAME:1`, `object:NAME:1` and so on. Of every finger the site `HAND/FINGER:tip` is at the tip's centre, of every hand the
/// site `HAND:base` is the frame of its base.
///
/// Errors, in words: the plan is for another robot or names objects that the scene does not have.
pub fn robot_to_mjcf((scene, state): (&Scene, &State), plan: &RobotPlan) -> Result<Mjcf, String> {
    let of_plan = plan.robots.first().ok_or("the plan moves no robot")?;
    let robot = scene.robots.iter().position(|robot| robot.name == of_plan.name);
    let index = robot.ok_or_else(|| format!("the scene has no robot \"{}\"", of_plan.name))?;
    let robot = &scene.robots[index];
    if robot.layout.names() != of_plan.joint_names {
        return Err(format!("the plan is for another robot: its joints are {}", of_plan.joint_names.join(", ")));
    }
    let first = plan.waypoints().next().ok_or("the plan has no waypoint")?;
    let mut world_from_link = Vec::new();
    robot.link_poses(&first.joints, &mut world_from_link);
    let free = match plan.task.as_str() {
        PICK_AND_PLACE => Some(FreeObject::of((scene, index), plan)?),
        _ => None,
    };
    let mut carried = Vec::new();
    for (k, name) in plan.objects.iter().enumerate().filter(|_| free.is_none()) {
        let object = scene.object_named(name).ok_or_else(|| format!("the scene has no object \"{name}\""))?;
        let object = &scene.objects[object];
        let holder = plan.segments[0].held_by.get(name).and_then(|holders| holders.first());
        let link = holder.and_then(|holder| {
            let hand = scene.hand_named(holder).map(Holder::Hand);
            hand.or_else(|| robot.arm_named(holder).map(Holder::Arm))?.link(scene, index)
        });
        let link = link.ok_or_else(|| format!("nothing of the robot holds \"{name}\""))?;
        let link_from_object = world_from_link[link.0].inverse() * Pose::from(&first.world_from_objects[k]);
        let inertial = inertia::of_object(object);
        carried.push(Carried { link, link_from_object, name, shape: object.solid(), inertial });
    }
    let fixed = fixed_bodies(scene, state, plan);
    let shapes = shapes_of(robot);
    let mut model = RobotModel { robot, carried, free, shapes, fixed, order: Vec::new(), world_from_link };
    let mut xml = Xml::default();
    xml.open("mujoco", &[("model", scene.name.clone())]);
    model.write_settings(&mut xml, scene.gravity().in_world().map_or(GRAVITY, Into::into));
    model.write_assets(&mut xml);
    xml.open("worldbody", &[]);
    xml.leaf("light", &[("pos", "1 -1 3".into()), ("dir", "-0.3 0.3 -1".into()), ("directional", "true".into())]);
    for body in &model.fixed {
        for (name, shape) in body.parts() {
            let (look, body_from_shape) = (Look::Color(FIXED_COLOR), body.world_from_body);
            write_geom(&mut xml, &Geom { name: &name, look, body_from_shape, shape });
        }
    }
    let root = robot.robot.root;
    model.write_link(&mut xml, root, robot.world_from_root(), None);
    if let Some(free) = &model.free {
        free.write_body(&mut xml);
    }
    xml.close();
    model.write_contacts(&mut xml);
    model.write_couplings(&mut xml);
    model.write_servos(&mut xml);
    model.write_keyframes(&mut xml, plan);
    xml.close();
    Ok(Mjcf { xml: xml.finish(), notes: model.notes() })
}

/// Obstacles, supports, and objects that the plan does not move.
fn fixed_bodies(scene: &Scene, state: &State, plan: &RobotPlan) -> Vec<FixedBody> {
    let bodies = scene.obstacles.iter().chain(scene.supports.iter().map(|support| &support.body));
    let mut fixed: Vec<FixedBody> = bodies.map(|body| FixedBody::new(&body.name, &body.placed)).collect();
    for (object, pose) in scene.objects.iter().zip(&state.world_from_objects) {
        if !plan.objects.contains(&object.name) {
            let solid = ObjectSolid::of(object);
            fixed.push(FixedBody { name: object.name.clone(), world_from_body: *pose, solid });
        }
    }
    fixed
}

/// The shapes of all links, with fingertips that are no collision geometry.
fn shapes_of(robot: &Manipulator) -> Vec<Vec<LinkGeom>> {
    let name = |link: usize, k: usize| format!("{}:{k}", robot.robot.links[link].name);
    let fingers = || robot.hands.iter().flat_map(|hand| &hand.hand.fingers);
    let tips = || fingers().flat_map(|finger| finger.shapes.iter().filter(|shape| shape.is_tip));
    let tip_links: BTreeSet<LinkId> = tips().map(|shape| shape.link).collect();
    let of_link = |(l, link): (usize, &regrasp_robot::Link)| {
        let is_tip = tip_links.contains(&LinkId(l));
        let geom = |(k, placed): (usize, &PlacedShape)| LinkGeom { name: name(l, k), placed: placed.clone(), is_tip };
        link.collision.iter().enumerate().map(geom).collect::<Vec<_>>()
    };
    let mut shapes: Vec<Vec<LinkGeom>> = robot.robot.links.iter().enumerate().map(of_link).collect();
    for finger in fingers() {
        let Some(placed) = tip_in_link(robot, finger) else { continue };
        let own = &mut shapes[finger.tip.link.0];
        if own.iter().all(|geom| !is_same_surface(&geom.placed, &placed)) {
            own.push(LinkGeom { name: name(finger.tip.link.0, own.len()), placed, is_tip: true });
        }
    }
    shapes
}

/// The ball or ellipsoid of a fingertip in the frame of its link; the finger has it in the frame of the last moving body, to which the
/// link may be fixed.
fn tip_in_link(robot: &Manipulator, finger: &Finger) -> Option<PlacedShape> {
    let own = own_tip(finger)?;
    let link_from_body = robot.robot.fixed_pose_in_body(finger.tip.link).inverse();
    Some(PlacedShape { parent_from_shape: link_from_body * own.parent_from_shape, shape: own.shape })
}

impl RobotModel<'_> {
    fn write_settings(&self, xml: &mut Xml, gravity: [f64; 3]) {
        let compiler = [("angle", "radian"), ("autolimits", "true"), ("balanceinertia", "true")];
        xml.leaf("compiler", &compiler.map(|(key, value)| (key, value.to_owned())));
        let mut option = vec![
            ("timestep", "0.002".to_owned()),
            ("integrator", "implicitfast".to_owned()),
            ("gravity", numbers(gravity)),
        ];
        if self.free.is_some() {
            option.extend(free::SOLVER.map(|(key, value)| (key, value.to_owned())));
        }
        xml.leaf("option", &option);
        xml.open("visual", &[]);
        xml.leaf("global", &[("offwidth", "1280".into()), ("offheight", "960".into())]);
        xml.close();
        xml.open("default", &[]);
        // What stands around meets the robot; neither meets itself. The free object meets both, but for fingertips, whose pairs are
        // written one by one.
        let [around, links, base] = if self.free.is_some() { ["5", "6", "4"] } else { ["1", "2", "0"] };
        xml.leaf("geom", &[("contype", "2".into()), ("conaffinity", around.into())]);
        xml.leaf("joint", &hard_stops());
        for (class, meets, met_by) in [("robot", "1", links), ("base", "0", base), ("tip", "1", "2")] {
            xml.open("default", &[("class", class.into())]);
            xml.leaf("geom", &[("contype", meets.into()), ("conaffinity", met_by.into())]);
            xml.close();
        }
        if let Some(free) = &self.free {
            free::write_defaults(xml, free);
        }
        xml.close();
    }

    fn write_assets(&self, xml: &mut Xml) {
        xml.open("asset", &[]);
        if self.free.is_some() {
            let sky = [
                ("type", "skybox"),
                ("builtin", "flat"),
                ("width", "16"),
                ("height", "16"),
                ("rgb1", "1 1 1"),
                ("rgb2", "1 1 1"),
            ];
            xml.leaf("texture", &sky.map(|(key, value)| (key, value.to_owned())));
        }
        for geom in self.shapes.iter().flatten() {
            write_mesh(xml, &geom.placed.shape, &geom.name);
        }
        for (name, shape) in self.fixed.iter().flat_map(FixedBody::parts) {
            write_mesh(xml, shape, &name);
        }
        for (name, shape) in self.free.iter().flat_map(FreeObject::parts) {
            write_mesh(xml, shape, &name);
        }
        for carried in &self.carried {
            write_mesh(xml, carried.shape, &format!("object:{}", carried.name));
        }
        xml.close();
    }

    /// A link and everything that it carries. `joint` is what carries it.
    fn write_link(&mut self, xml: &mut Xml, link: LinkId, parent_from_link: &Pose, joint: Option<usize>) {
        let robot = &self.robot.robot;
        open_body(xml, body_name(robot, link), parent_from_link, Weight::Compensated);
        if let Some(id) = joint.filter(|id| robot.joints[*id].moves()) {
            self.write_joint(xml, id);
            self.order.push(id);
        }
        // What no joint moves may stand in a table.
        let moves = !self.robot.coordinates_above(link).is_empty();
        let placed = self.shapes[link.0].iter().map(|geom| &geom.placed);
        write_inertial(xml, &inertia::of_link(placed));
        for is_tip in [false, true] {
            let own = || self.shapes[link.0].iter().filter(|geom| geom.is_tip == is_tip);
            let class = match (moves, is_tip) {
                (false, _) => "base",
                (true, true) => "tip",
                (true, false) => "robot",
            };
            if own().next().is_none() {
                continue;
            }
            xml.open("frame", &[("childclass", class.into())]);
            for LinkGeom { name, placed, .. } in own() {
                let (look, body_from_shape) = (Look::Color(LINK_COLOR), placed.parent_from_shape);
                write_geom(xml, &Geom { name, look, body_from_shape, shape: &placed.shape });
            }
            xml.close();
        }
        self.write_sites(xml, link);
        for carried in self.carried.iter().filter(|carried| carried.link == link) {
            let name = format!("object:{}", carried.name);
            open_body(xml, name.clone(), &carried.link_from_object, Weight::Compensated);
            write_inertial(xml, &carried.inertial);
            xml.open("frame", &[("childclass", "robot".into())]);
            let look = Look::Color(OBJECT_COLOR);
            write_geom(xml, &Geom { name: &name, look, body_from_shape: Pose::identity(), shape: carried.shape });
            xml.close();
            xml.close();
        }
        let children: Vec<_> = robot.joints_from(link).map(|id| (id.0, robot.joints[id.0].child)).collect();
        for (id, child) in children {
            let parent_from_joint = self.robot.robot.joints[id].parent_from_joint;
            self.write_link(xml, child, &parent_from_joint, Some(id));
        }
        xml.close();
    }

    /// The frame of a hand's base, and centres of fingertips.
    fn write_sites(&self, xml: &mut Xml, link: LinkId) {
        let mut site = |name: String, at: [f64; 3]| {
            let what = [("name", name), ("pos", numbers(at)), ("size", "0.001".into()), ("rgba", "0 0 0 0".into())];
            xml.leaf("site", &what);
        };
        for hand in &self.robot.hands {
            if hand.hand.base == link {
                site(format!("{}:base", hand.name), [0.0; 3]);
            }
            for finger in hand.hand.fingers.iter().filter(|finger| finger.tip.link == link) {
                let center = self.robot.robot.fixed_pose_in_body(link).inverse() * finger.tip.center_in_body;
                site(format!("{}/{}:tip", hand.name, finger.name), center.coords.into());
            }
        }
    }

    fn notes(&self) -> Vec<String> {
        let cut = |name: &str, note: &str| format!("\"{name}\" is not convex; {note}");
        let fixed = self.fixed.iter().filter_map(|body| Some(cut(&body.name, body.solid.note.as_deref()?)));
        let free = self.free.iter().filter_map(|free| Some(cut(&free.object.name, free.solid.note.as_deref()?)));
        let hull = |name: &str| cut(name, "MuJoCo collides with its convex hull");
        let carried = self.carried.iter().filter(|carried| is_hollowed(carried.shape)).map(|c| hull(c.name));
        let links = "links have the mass of solids of 1000 kg/m^3, because robot models keep none".to_owned();
        fixed.chain(free).chain(carried).chain([links]).collect()
    }
}
