//! A MuJoCo model of a plan in which a whole robot moves.
//!
//! Every link is a body. Servos drive the independent joints; gravity on robot and carried objects is compensated, as controllers of
//! arms do. The robot and what it carries collide with everything that stands around; links of the robot do not collide with each
//! other. A carried object is a part of what holds it.

use super::Mjcf;
use super::geom::{Geom, Look, Weight, is_hollowed, open_body, write_geom, write_inertial, write_mesh};
use super::inertia::{self, Inertial};
use super::xml::{Xml, numbers};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape};
use regrasp_plan::robot_plan::RobotPlan;
use regrasp_robot::{Coupling, JointKind, LinkId, Manipulator};
use regrasp_scene::{Holder, Scene, State};

const LINK_COLOR: &str = "0.7 0.71 0.74 1";
const FIXED_COLOR: &str = "0.5 0.45 0.4 1";
const OBJECT_COLOR: &str = "0.9 0.6 0.25 1";
/// Natural frequency of servos, in rad/s: that of stiff position controllers of arms. Damping is critical.
const SERVO_FREQUENCY: f64 = 60.0;
/// Share of the inertia about a joint that its drive adds, and the least that a drive has, in kg m^2 or kg.
const DRIVE_SHARE: f64 = 0.2;
const LEAST_DRIVE: f64 = 2e-3;
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

struct RobotModel<'a> {
    robot: &'a Manipulator,
    scene: &'a Scene,
    state: &'a State,
    carried: Vec<Carried<'a>>,
    /// By link: shapes with the names of their geoms, fingertips included.
    shapes: Vec<Vec<(String, PlacedShape)>>,
    /// Joints in the order in which bodies are written.
    order: Vec<usize>,
    /// By link, its pose at the start.
    world_from_link: Vec<Pose>,
}

/// The MuJoCo model of a scene in which the robot of `plan` moves, with the waypoints as keyframes `segment_waypoint`, both from 0.
///
/// Names: bodies and joints as links and joints of the robot, servos as joints; geoms `LINK:k`; `fixed:NAME` for what stands around;
/// `object:NAME` for carried objects.
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
    let mut carried = Vec::new();
    for (k, name) in plan.objects.iter().enumerate() {
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
    let mut model =
        RobotModel { robot, scene, state, carried, shapes: shapes_of(robot), order: Vec::new(), world_from_link };
    let mut xml = Xml::default();
    xml.open("mujoco", &[("model", scene.name.clone())]);
    write_settings(&mut xml, scene.gravity().in_world().map_or(GRAVITY, Into::into));
    model.write_assets(&mut xml);
    xml.open("worldbody", &[]);
    xml.leaf("light", &[("pos", "1 -1 3".into()), ("dir", "-0.3 0.3 -1".into()), ("directional", "true".into())]);
    for (name, placed) in model.fixed() {
        let (look, body_from_shape) = (Look::Color(FIXED_COLOR), placed.parent_from_shape);
        write_geom(&mut xml, &Geom { name: &name, look, body_from_shape, shape: &placed.shape });
    }
    let root = robot.robot.root;
    model.write_link(&mut xml, root, robot.world_from_root(), None);
    xml.close();
    model.write_couplings(&mut xml);
    model.write_servos(&mut xml);
    model.write_keyframes(&mut xml, plan);
    xml.close();
    Ok(Mjcf { xml: xml.finish(), notes: model.notes() })
}

fn write_settings(xml: &mut Xml, gravity: [f64; 3]) {
    let compiler = [("angle", "radian"), ("autolimits", "true"), ("balanceinertia", "true")];
    xml.leaf("compiler", &compiler.map(|(key, value)| (key, value.to_owned())));
    let option =
        [("timestep", "0.002".to_owned()), ("integrator", "implicitfast".to_owned()), ("gravity", numbers(gravity))];
    xml.leaf("option", &option);
    xml.open("visual", &[]);
    xml.leaf("global", &[("offwidth", "1280".into()), ("offheight", "960".into())]);
    xml.close();
    xml.open("default", &[]);
    // What stands around meets the robot; neither meets itself.
    xml.leaf("geom", &[("contype", "2".into()), ("conaffinity", "1".into())]);
    xml.open("default", &[("class", "robot".into())]);
    xml.leaf("geom", &[("contype", "1".into()), ("conaffinity", "2".into())]);
    xml.close();
    xml.open("default", &[("class", "base".into())]);
    xml.leaf("geom", &[("contype", "0".into()), ("conaffinity", "0".into())]);
    xml.close();
    xml.close();
}

/// The shapes of all links, with fingertips that are no collision geometry.
fn shapes_of(robot: &Manipulator) -> Vec<Vec<(String, PlacedShape)>> {
    let name = |link: usize, k: usize| format!("{}:{k}", robot.robot.links[link].name);
    let of_link = |(l, link): (usize, &regrasp_robot::Link)| {
        link.collision.iter().enumerate().map(|(k, placed)| (name(l, k), placed.clone())).collect::<Vec<_>>()
    };
    let mut shapes: Vec<Vec<_>> = robot.robot.links.iter().enumerate().map(of_link).collect();
    for hand in &robot.hands {
        for finger in &hand.hand.fingers {
            let Some(own) = finger.tip.own_shape() else { continue };
            // The tip stands in the frame of the last moving body; the link may be fixed to it.
            let link = finger.tip.link;
            let link_from_body = robot.robot.fixed_pose_in_body(link).inverse();
            let placed = PlacedShape { parent_from_shape: link_from_body * own.parent_from_shape, shape: own.shape };
            let k = shapes[link.0].len();
            shapes[link.0].push((name(link.0, k), placed));
        }
    }
    shapes
}

impl RobotModel<'_> {
    /// What stands around: obstacles, supports, objects at rest.
    fn fixed(&self) -> Vec<(String, PlacedShape)> {
        let bodies = self.scene.obstacles.iter().chain(self.scene.supports.iter().map(|support| &support.body));
        let mut fixed: Vec<_> = bodies.map(|body| (format!("fixed:{}", body.name), body.placed.clone())).collect();
        for (object, pose) in self.scene.objects.iter().zip(&self.state.world_from_objects) {
            if self.carried.iter().all(|carried| carried.name != object.name) {
                let placed = PlacedShape { parent_from_shape: *pose, shape: object.solid().clone() };
                fixed.push((format!("fixed:{}", object.name), placed));
            }
        }
        fixed
    }

    fn write_assets(&self, xml: &mut Xml) {
        xml.open("asset", &[]);
        for (name, placed) in self.shapes.iter().flatten() {
            write_mesh(xml, &placed.shape, name);
        }
        for (name, placed) in self.fixed() {
            write_mesh(xml, &placed.shape, &name);
        }
        for carried in &self.carried {
            write_mesh(xml, carried.shape, &format!("object:{}", carried.name));
        }
        xml.close();
    }

    /// A link and everything that it carries. `joint` is what carries it.
    fn write_link(&mut self, xml: &mut Xml, link: LinkId, parent_from_link: &Pose, joint: Option<usize>) {
        let robot = &self.robot.robot;
        open_body(xml, robot.links[link.0].name.clone(), parent_from_link, Weight::Compensated);
        if let Some(id) = joint.filter(|id| robot.joints[*id].moves()) {
            self.write_joint(xml, id);
            self.order.push(id);
        }
        // What no joint moves may stand in a table.
        let moves = !self.robot.coordinates_above(link).is_empty();
        let placed = self.shapes[link.0].iter().map(|(_, placed)| placed);
        write_inertial(xml, &inertia::of_link(placed));
        let class = if moves { "robot" } else { "base" };
        xml.open("frame", &[("childclass", class.into())]);
        for (name, placed) in &self.shapes[link.0] {
            let (look, body_from_shape) = (Look::Color(LINK_COLOR), placed.parent_from_shape);
            write_geom(xml, &Geom { name, look, body_from_shape, shape: &placed.shape });
        }
        xml.close();
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

    fn write_joint(&self, xml: &mut Xml, id: usize) {
        let joint = &self.robot.robot.joints[id];
        let kind = if joint.kind == JointKind::Prismatic { "slide" } else { "hinge" };
        let drive = self.drive_inertia(id);
        let mut attributes = vec![
            ("name", joint.name.clone()),
            ("type", kind.to_owned()),
            ("axis", numbers(joint.axis.iter().copied())),
            ("armature", numbers([drive])),
        ];
        // Followers are held by their coupling, which leaders' limits respect.
        if let Some(limits) = joint.limits.filter(|limits| limits.lower < limits.upper && joint.coupling.is_none())
            && joint.kind != JointKind::Continuous
        {
            attributes.push(("range", numbers([limits.lower, limits.upper])));
        }
        xml.leaf("joint", &attributes);
    }

    /// Inertia about a joint of all that it carries, at the start, in kg m^2; of a sliding joint the mass.
    fn carried_inertia(&self, id: usize) -> f64 {
        let (robot, joint) = (&self.robot.robot, &self.robot.robot.joints[id]);
        let frame = self.world_from_link[joint.child.0];
        let axis = frame.rotation * joint.axis.into_inner();
        let is_carried = |link: LinkId| link == joint.child || robot.joints_to(link).iter().any(|other| other.0 == id);
        let mut sum = 0.0;
        let mut add = |world_from_body: &Pose, inertial: &Inertial| {
            if joint.kind == JointKind::Prismatic {
                sum += inertial.mass;
                return;
            }
            let arm = axis.cross(&(world_from_body * inertial.center - frame * regrasp_geometry::Point::origin()));
            let own = world_from_body.rotation.inverse() * axis;
            sum += inertial.mass * arm.norm_squared() + own.dot(&(inertial.inertia * own));
        };
        for (link, shapes) in self.shapes.iter().enumerate().filter(|(link, _)| is_carried(LinkId(*link))) {
            add(&self.world_from_link[link], &inertia::of_link(shapes.iter().map(|(_, placed)| placed)));
        }
        for carried in self.carried.iter().filter(|carried| is_carried(carried.link)) {
            add(&(self.world_from_link[carried.link.0] * carried.link_from_object), &carried.inertial);
        }
        sum
    }

    /// What the drive of a joint adds to it.
    fn drive_inertia(&self, id: usize) -> f64 {
        (DRIVE_SHARE * self.carried_inertia(id)).max(LEAST_DRIVE)
    }

    fn couplings(&self) -> impl Iterator<Item = (usize, &Coupling)> {
        let joints = &self.robot.robot.joints;
        self.order.iter().filter_map(|&id| Some((id, joints[id].coupling.as_ref()?)))
    }

    fn write_couplings(&self, xml: &mut Xml) {
        let name = |id: usize| self.robot.robot.joints[id].name.clone();
        let several = || self.couplings().filter(|(_, coupling)| coupling.single().is_none());
        if several().next().is_some() {
            xml.open("tendon", &[]);
            for (follower, coupling) in several() {
                xml.open("fixed", &[("name", format!("{}:leaders", name(follower)))]);
                xml.leaf("joint", &[("joint", name(follower)), ("coef", "1".into())]);
                for (leader, multiplier) in &coupling.terms {
                    xml.leaf("joint", &[("joint", name(leader.0)), ("coef", numbers([-multiplier]))]);
                }
                xml.close();
            }
            xml.close();
        }
        xml.open("equality", &[]);
        let stiff = [("solref", "0.004 1".to_owned()), ("solimp", "0.99 0.999 0.0001".to_owned())];
        for (follower, coupling) in self.couplings() {
            match coupling.single() {
                Some((leader, multiplier)) => {
                    let polynomial = numbers([coupling.offset, multiplier, 0.0, 0.0, 0.0]);
                    let what = [("joint1", name(follower)), ("joint2", name(leader.0)), ("polycoef", polynomial)];
                    xml.leaf("joint", &[&what[..], &stiff].concat());
                }
                None => {
                    let polynomial = numbers([coupling.offset, 0.0, 0.0, 0.0, 0.0]);
                    let what = [("tendon1", format!("{}:leaders", name(follower))), ("polycoef", polynomial)];
                    xml.leaf("tendon", &[&what[..], &stiff].concat());
                }
            }
        }
        xml.close();
    }

    /// A servo per independent joint, in the order of the joint vector.
    fn write_servos(&self, xml: &mut Xml) {
        xml.open("actuator", &[]);
        for coordinate in &self.robot.layout.coordinates {
            let id = coordinate.joint.0;
            let inertia = self.carried_inertia(id) + self.drive_inertia(id);
            xml.leaf(
                "position",
                &[
                    ("name", coordinate.name.clone()),
                    ("joint", coordinate.name.clone()),
                    ("kp", numbers([inertia * SERVO_FREQUENCY * SERVO_FREQUENCY])),
                    ("kv", numbers([2.0 * inertia * SERVO_FREQUENCY])),
                ],
            );
        }
        xml.close();
    }

    fn write_keyframes(&self, xml: &mut Xml, plan: &RobotPlan) {
        let (robot, layout) = (&self.robot.robot, &self.robot.layout);
        xml.open("keyframe", &[]);
        for (s, segment) in plan.segments.iter().enumerate() {
            for (w, waypoint) in segment.waypoints.iter().enumerate() {
                let position =
                    |id: usize| layout.drive_of(robot, id).map_or(0.0, |d| d.position(|k| waypoint.joints[k]));
                xml.leaf(
                    "key",
                    &[
                        ("name", format!("{s}_{w}")),
                        ("time", numbers([waypoint.time])),
                        ("qpos", numbers(self.order.iter().map(|&id| position(id)))),
                        ("ctrl", numbers(waypoint.joints.iter().copied())),
                    ],
                );
            }
        }
        xml.close();
    }

    fn notes(&self) -> Vec<String> {
        let convex = |name: &str| format!("\"{name}\" is not convex; MuJoCo collides with its convex hull");
        let fixed = self.fixed();
        let hollow = fixed.iter().filter(|(_, placed)| is_hollowed(&placed.shape)).map(|(name, _)| convex(name));
        let carried = self.carried.iter().filter(|carried| is_hollowed(carried.shape)).map(|c| convex(c.name));
        let links = "links have the mass of solids of 1000 kg/m^3, because robot models keep none".to_owned();
        hollow.chain(carried).chain([links]).collect()
    }
}
