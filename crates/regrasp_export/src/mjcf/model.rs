//! The model as an MJCF document.

mod object;
mod pairs;

use super::Mjcf;
use super::inertia::{self, Inertial};
use super::xml::{Xml, numbers};
use nalgebra::UnitQuaternion;
use object::{ObjectShape, is_hollowed, object_names};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{ConvexHull, Point, Pose, Shape, pose_from};
use regrasp_plan::Plan;
use regrasp_robot::tip::is_same_surface;
use regrasp_robot::{Coupling, Finger, Hand, Joint, JointId, JointKind, LinkId, Motion, TipShape};
use regrasp_scene::{HandView, Manipulation, Obstacle};

/// Gravity where the plan says nothing, in m/s^2: along -z of the world.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];
/// Radius of the ball that stands for a sharp tip, in metres: its surface is this far from the point, no more than a
/// plan may promise.
const POINT_RADIUS: f64 = 0.0005;
const PALM_COLOR: &str = "0.55 0.56 0.6 1";
const OBSTACLE_COLOR: &str = "0.5 0.45 0.4 1";
const OBJECT_MATERIAL: &str = "object";
/// Fingers in turn.
const FINGER_COLORS: [&str; 6] =
    ["0.3 0.5 0.8 1", "0.8 0.35 0.3 1", "0.35 0.7 0.4 1", "0.65 0.4 0.75 1", "0.3 0.7 0.75 1", "0.85 0.55 0.25 1"];

/// Names of the geoms.
pub(super) struct GeomNames {
    /// Of `Finger::shapes`.
    pub fingers: Vec<Vec<String>>,
    /// Of each finger, those that touch the object when it holds.
    pub touching: Vec<Vec<String>>,
    /// Of `Hand::palm`.
    pub palm: Vec<String>,
    /// Of obstacles and everything else that rests.
    pub obstacles: Vec<String>,
    /// Of the object: one for each of its convex parts.
    pub object: Vec<String>,
}

/// A geom to be written.
struct Geom<'a> {
    name: &'a str,
    look: Look<'a>,
    body_from_shape: Pose,
    shape: &'a Shape,
}

/// How a geom looks.
enum Look<'a> {
    /// In one colour.
    Color(&'a str),
    /// As the object.
    Checkers,
}

/// The ball or ellipsoid of a tip.
struct OwnTip {
    name: String,
    placed: PlacedShape,
}

pub(super) fn write(task: &Manipulation, plan: &Plan) -> Mjcf {
    let (scene, hand) = (task.scene, task.hand());
    let fixed: Vec<Obstacle> = scene.obstacles.iter().cloned().chain(task.bystanders()).collect();
    let moving: Vec<Vec<JointId>> = hand.fingers.iter().map(|finger| moving_joints(hand, finger)).collect();
    let shape = ObjectShape::of(task.object());
    let names = geom_names(hand, &fixed, &shape);
    let object = unique("object", hand);
    let mut xml = Xml::default();
    xml.open("mujoco", &[("model", scene.name.clone())]);
    write_settings(&mut xml, plan);
    write_meshes(&mut xml, task, (&shape, &fixed), &names);
    xml.open("worldbody", &[]);
    xml.leaf("light", &[("pos", "0.3 -0.3 1".into()), ("dir", "-0.3 0.3 -1".into()), ("directional", "true".into())]);
    for (obstacle, name) in fixed.iter().zip(&names.obstacles) {
        let body_from_shape = obstacle.placed.parent_from_shape;
        write_geom(
            &mut xml,
            &Geom { name, look: Look::Color(OBSTACLE_COLOR), body_from_shape, shape: &obstacle.placed.shape },
        );
    }
    write_hand(&mut xml, task, &moving, &names);
    write_object(&mut xml, task, plan, (&shape, &names), &object);
    xml.close();
    pairs::write(&mut xml, &HandView::of(task), &names);
    write_sums(&mut xml, hand, &moving);
    write_equalities(&mut xml, hand, &moving, &object);
    write_actuators(&mut xml, hand, &moving);
    write_sensors(&mut xml, hand, &object);
    write_keyframes(&mut xml, hand, plan);
    xml.close();
    Mjcf { xml: xml.finish(), notes: notes(task, &shape, &fixed) }
}

fn notes(task: &Manipulation, object: &ObjectShape, fixed: &[Obstacle]) -> Vec<String> {
    let of_object = object.note.as_ref().map(|note| format!("\"{}\" is not convex; {note}", task.object().name));
    let shapes = fixed.iter().map(|obstacle| (obstacle.name.as_str(), &obstacle.placed.shape));
    let of_obstacles = shapes
        .filter(|(_, shape)| is_hollowed(shape))
        .map(|(name, _)| format!("\"{name}\" is not convex; MuJoCo collides with its convex hull"));
    of_object.into_iter().chain(of_obstacles).collect()
}

/// Joints of the chain of `finger`, base first, as the robot names them.
fn moving_joints(hand: &Hand, finger: &Finger) -> Vec<JointId> {
    let joints = hand.robot.joints_to(finger.tip.link);
    let moving: Vec<JointId> =
        joints.into_iter().filter(|id| hand.robot.joints[id.0].kind != JointKind::Fixed).collect();
    // Joints between root and base are none of the finger's.
    moving[moving.len() - finger.chain.joints.len()..].to_vec()
}

fn unique(name: &str, hand: &Hand) -> String {
    let mut name = name.to_owned();
    while hand.robot.link_named(&name).is_some() || hand.robot.joint_named(&name).is_some() {
        name.push('_');
    }
    name
}

fn geom_names(hand: &Hand, fixed: &[Obstacle], object: &ObjectShape) -> GeomNames {
    let mut used = vec![0; hand.robot.links.len()];
    let mut name_of = |link: LinkId| {
        used[link.0] += 1;
        format!("{}:{}", hand.robot.links[link.0].name, used[link.0] - 1)
    };
    let palm = hand.palm.iter().map(|shape| name_of(shape.link)).collect();
    let (mut fingers, mut touching) = (Vec::new(), Vec::new());
    for finger in &hand.fingers {
        let own = own_tip(finger);
        let is_own = |placed: &PlacedShape| own.as_ref().is_some_and(|own| is_same_surface(placed, &own.placed));
        let of_finger: Vec<String> = finger
            .shapes
            .iter()
            .map(|shape| if is_own(&shape.placed) { tip_name(finger) } else { name_of(shape.link) })
            .collect();
        touching.push(match own {
            Some(own) => vec![own.name],
            None => {
                let tips = finger.shapes.iter().zip(&of_finger).filter(|(shape, _)| shape.is_tip);
                tips.map(|(_, name)| name.clone()).collect()
            }
        });
        fingers.push(of_finger);
    }
    GeomNames {
        fingers,
        touching,
        palm,
        obstacles: fixed.iter().map(|obstacle| format!("obstacle:{}", obstacle.name)).collect(),
        object: object_names(object),
    }
}

fn tip_name(finger: &Finger) -> String {
    format!("{}:tip", finger.name)
}

/// A small ball for a sharp tip; None for hulls, which are the link's collision geometry.
fn own_tip(finger: &Finger) -> Option<OwnTip> {
    let placed = match finger.tip.shape {
        TipShape::Point => PlacedShape {
            parent_from_shape: Pose::from_parts(finger.tip.center_in_body.coords.into(), UnitQuaternion::identity()),
            shape: Shape::Sphere { radius: POINT_RADIUS },
        },
        TipShape::Sphere { .. } | TipShape::Ellipsoid(_) | TipShape::Hull { .. } => finger.tip.own_shape()?,
    };
    Some(OwnTip { name: tip_name(finger), placed })
}

/// Solver, contacts and joints: physics notes, sections 1 and 2.
fn write_settings(xml: &mut Xml, plan: &Plan) {
    let gravity = plan.promises.forces.as_ref().map_or(Some(GRAVITY), |forces| forces.gravity_in_world);
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
            ("gravity", numbers(gravity.unwrap_or(GRAVITY))),
        ],
    );
    xml.open("visual", &[]);
    xml.leaf("global", &[("offwidth", "1280".into()), ("offheight", "960".into())]);
    xml.leaf("headlight", &[("ambient", "0.4 0.4 0.4".into()), ("diffuse", "0.5 0.5 0.5".into())]);
    xml.close();
    xml.open("default", &[]);
    // What touches what is said by pairs alone.
    xml.leaf("geom", &[("contype", "0".into()), ("conaffinity", "0".into())]);
    xml.leaf("joint", &[("armature", "0.0002".into()), ("damping", "0.005".into())]);
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

fn write_meshes(xml: &mut Xml, task: &Manipulation, (object, fixed): (&ObjectShape, &[Obstacle]), names: &GeomNames) {
    let hand = task.hand();
    let fingers = hand
        .fingers
        .iter()
        .zip(&names.fingers)
        .flat_map(|(finger, names)| finger.shapes.iter().map(|shape| &shape.placed.shape).zip(names));
    let palm = hand.palm.iter().map(|shape| &shape.placed.shape).zip(&names.palm);
    let obstacles = fixed.iter().map(|obstacle| &obstacle.placed.shape).zip(&names.obstacles);
    let object = object.parts.iter().zip(&names.object);
    xml.open("asset", &[]);
    let texture = |kind: &str, pattern: &str, colors: [&str; 2]| {
        let side = if kind == "cube" { "64" } else { "16" };
        let texture = [("type", kind.to_owned()), ("builtin", pattern.to_owned()), ("width", side.to_owned())];
        let colors = [("height", side.to_owned()), ("rgb1", colors[0].to_owned()), ("rgb2", colors[1].to_owned())];
        [&texture[..], &colors[..]].concat()
    };
    xml.leaf("texture", &texture("skybox", "flat", ["1 1 1", "1 1 1"]));
    // Turning shows on a pattern only.
    let checkers = texture("cube", "checker", ["0.95 0.8 0.35", "0.75 0.45 0.15"]);
    xml.leaf("texture", &[&[("name", OBJECT_MATERIAL.to_owned())], &checkers[..]].concat());
    xml.leaf("material", &[("name", OBJECT_MATERIAL.into()), ("texture", OBJECT_MATERIAL.into())]);
    for (shape, name) in palm.chain(fingers).chain(obstacles).chain(object) {
        let vertices: Vec<Point> = match shape {
            Shape::Convex(hull) => hull.vertices().to_vec(),
            // MuJoCo collides with the hull whatever it is given.
            Shape::Mesh(mesh) => match ConvexHull::new(mesh.vertices()) {
                Ok(hull) => hull.vertices().to_vec(),
                Err(_) => mesh.vertices().to_vec(),
            },
            _ => continue,
        };
        let coordinates = vertices.iter().flat_map(|vertex| [vertex.x, vertex.y, vertex.z]);
        xml.leaf("mesh", &[("name", name.clone()), ("inertia", "convex".into()), ("vertex", numbers(coordinates))]);
    }
    xml.close();
}

fn write_hand(xml: &mut Xml, task: &Manipulation, moving: &[Vec<JointId>], names: &GeomNames) {
    let hand = task.hand();
    let link_name = |link: LinkId| hand.robot.links[link.0].name.clone();
    open_body(xml, link_name(hand.base), &task.world_from_hand(), false);
    for (palm, name) in hand.palm.iter().zip(&names.palm) {
        let body_from_shape = palm.placed.parent_from_shape;
        write_geom(xml, &Geom { name, look: Look::Color(PALM_COLOR), body_from_shape, shape: &palm.placed.shape });
    }
    for (index, finger) in hand.fingers.iter().enumerate() {
        let color = FINGER_COLORS[index % FINGER_COLORS.len()];
        let mut parent = Pose::identity();
        for (body, (joint, &id)) in finger.chain.joints.iter().zip(&moving[index]).enumerate() {
            let as_read = &hand.robot.joints[id.0];
            open_body(xml, link_name(as_read.child), &(parent * joint.parent_from_joint), true);
            parent = Pose::identity();
            write_joint(xml, hand, finger, body, id);
            let on_body = || finger.shapes.iter().zip(&names.fingers[index]).filter(|(shape, _)| shape.body == body);
            write_inertial(xml, &inertia::of_link(on_body().map(|(shape, _)| &shape.placed)));
            for (shape, name) in on_body() {
                let body_from_shape = shape.placed.parent_from_shape;
                write_geom(xml, &Geom { name, look: Look::Color(color), body_from_shape, shape: &shape.placed.shape });
            }
        }
        write_tip(xml, finger, &names.fingers[index], color);
        for _ in &finger.chain.joints {
            xml.close();
        }
    }
    xml.close();
}

fn open_body(xml: &mut Xml, name: String, parent_from_body: &Pose, is_moving: bool) {
    let [pos, quat] = place(parent_from_body);
    let mut attributes = vec![("name", name), pos, quat];
    if is_moving {
        attributes.push(("gravcomp", "1".into()));
    }
    xml.open("body", &attributes);
}

fn write_joint(xml: &mut Xml, hand: &Hand, finger: &Finger, body: usize, id: JointId) {
    let (joint, as_read) = (&finger.chain.joints[body], &hand.robot.joints[id.0]);
    let mut attributes = vec![("name", as_read.name.clone()), ("axis", numbers(joint.axis.iter().copied()))];
    match joint.motion {
        Motion::Turn => attributes.push(("type", "hinge".into())),
        Motion::Slide => attributes.extend([("type", "slide".into()), ("class", "slide".into())]),
    }
    let limits = match (&as_read.coupling, joint.drive.single()) {
        // The coupling holds a follower within its limits, which the leader's already respect.
        (Some(_), Some(_)) => None,
        (Some(_), None) => as_read.limits.map(|limits| (limits.lower, limits.upper)),
        (None, single) => single.map(|(k, _)| (finger.chain.lower[k], finger.chain.upper[k])),
    };
    if let Some((lower, upper)) =
        limits.filter(|(lower, upper)| lower.is_finite() && upper.is_finite() && lower < upper)
    {
        attributes.push(("range", numbers([lower, upper])));
    }
    xml.leaf("joint", &attributes);
}

fn write_inertial(xml: &mut Xml, inertial: &Inertial) {
    let m = &inertial.inertia;
    xml.leaf(
        "inertial",
        &[
            ("pos", numbers(inertial.center.iter().copied())),
            ("mass", numbers([inertial.mass])),
            ("fullinertia", numbers([m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(0, 1)], m[(0, 2)], m[(1, 2)]])),
        ],
    );
}

fn write_tip(xml: &mut Xml, finger: &Finger, names: &[String], color: &str) {
    let center = finger.tip.center_in_body;
    let own = own_tip(finger);
    if let Some(OwnTip { name, placed }) = own.as_ref().filter(|own| !names.contains(&own.name)) {
        let body_from_shape = placed.parent_from_shape;
        write_geom(xml, &Geom { name, look: Look::Color(color), body_from_shape, shape: &placed.shape });
    }
    // Every contact of the tip lies in its site, so that the touch sensor sees it.
    let reach = match own {
        Some(own) => 1.5 * own.placed.shape.reach_from(&Point::origin()) + 0.001,
        None => {
            let tips = finger.shapes.iter().filter(|shape| shape.is_tip);
            tips.map(|shape| shape.placed.shape.reach_from(&(shape.placed.parent_from_shape.inverse() * center)))
                .fold(0.001, f64::max)
        }
    };
    xml.leaf(
        "site",
        &[
            ("name", tip_name(finger)),
            ("pos", numbers(center.iter().copied())),
            ("size", numbers([reach])),
            ("rgba", "0 0 0 0".into()),
        ],
    );
}

fn write_object(
    xml: &mut Xml,
    task: &Manipulation,
    plan: &Plan,
    (shape, names): (&ObjectShape, &GeomNames),
    body: &str,
) {
    let start = &plan.segments[0].waypoints[0].world_from_object;
    open_body(xml, body.to_owned(), &pose_from(start.position, start.quat_xyzw), false);
    xml.leaf("freejoint", &[("name", body.to_owned())]);
    write_inertial(xml, &inertia::of_object(task.object()));
    for (shape, name) in shape.parts.iter().zip(&names.object) {
        write_geom(xml, &Geom { name, look: Look::Checkers, body_from_shape: Pose::identity(), shape });
    }
    xml.close();
}

fn write_geom(xml: &mut Xml, geom: &Geom) {
    let (kind, size) = match geom.shape {
        Shape::Sphere { radius } => ("sphere", vec![*radius]),
        Shape::Capsule { half_length, radius } => ("capsule", vec![*radius, *half_length]),
        Shape::Cylinder { half_length, radius } => ("cylinder", vec![*radius, *half_length]),
        Shape::Cuboid { half_extents } => ("box", half_extents.iter().copied().collect()),
        Shape::Ellipsoid { radii } => ("ellipsoid", radii.iter().copied().collect()),
        Shape::Convex(_) | Shape::Mesh(_) => ("mesh", Vec::new()),
    };
    let [pos, quat] = place(&geom.body_from_shape);
    let mut attributes = vec![("name", geom.name.to_owned()), ("type", kind.to_owned()), pos, quat];
    attributes.push(if kind == "mesh" { ("mesh", geom.name.to_owned()) } else { ("size", numbers(size)) });
    attributes.push(match geom.look {
        Look::Color(color) => ("rgba", color.to_owned()),
        Look::Checkers => ("material", OBJECT_MATERIAL.to_owned()),
    });
    xml.leaf("geom", &attributes);
}

/// Position and orientation; MuJoCo's quaternions are w x y z.
fn place(pose: &Pose) -> [(&'static str, String); 2] {
    let q = pose.rotation.coords;
    [("pos", numbers(pose.translation.vector.iter().copied())), ("quat", numbers([q.w, q.x, q.y, q.z]))]
}

/// A tendon for each joint that follows several others: its length is the joint's position less the leaders' share.
fn write_sums(xml: &mut Xml, hand: &Hand, moving: &[Vec<JointId>]) {
    let sums: Vec<(&Joint, &Coupling)> = moving
        .iter()
        .flatten()
        .map(|id| &hand.robot.joints[id.0])
        .filter_map(|joint| Some((joint, joint.coupling.as_ref().filter(|coupling| coupling.single().is_none())?)))
        .collect();
    if sums.is_empty() {
        return;
    }
    xml.open("tendon", &[]);
    for (joint, coupling) in sums {
        xml.open("fixed", &[("name", sum_name(joint))]);
        xml.leaf("joint", &[("joint", joint.name.clone()), ("coef", "1".into())]);
        for (leader, multiplier) in &coupling.terms {
            let name = hand.robot.joints[leader.0].name.clone();
            xml.leaf("joint", &[("joint", name), ("coef", numbers([-multiplier]))]);
        }
        xml.close();
    }
    xml.close();
}

fn sum_name(follower: &Joint) -> String {
    format!("{}:leaders", follower.name)
}

/// Followers, and the pin that can hold the object where it starts.
fn write_equalities(xml: &mut Xml, hand: &Hand, moving: &[Vec<JointId>], object: &str) {
    xml.open("equality", &[]);
    for (finger, ids) in hand.fingers.iter().zip(moving) {
        for (joint, id) in finger.chain.joints.iter().zip(ids) {
            let as_read = &hand.robot.joints[id.0];
            let Some(coupling) = &as_read.coupling else { continue };
            let stiff = [("solref", "0.004 1".to_owned()), ("solimp", "0.99 0.999 0.0001".to_owned())];
            let offset = joint.drive.offset;
            match coupling.single() {
                Some((leader, multiplier)) => {
                    let what = [
                        ("joint1", as_read.name.clone()),
                        ("joint2", hand.robot.joints[leader.0].name.clone()),
                        ("polycoef", numbers([offset, multiplier, 0.0, 0.0, 0.0])),
                    ];
                    xml.leaf("joint", &[&what[..], &stiff].concat());
                }
                None => {
                    let what = [("tendon1", sum_name(as_read)), ("polycoef", numbers([offset, 0.0, 0.0, 0.0, 0.0]))];
                    xml.leaf("tendon", &[&what[..], &stiff].concat());
                }
            }
        }
    }
    xml.leaf(
        "weld",
        &[
            ("name", "pin".into()),
            ("body1", object.to_owned()),
            ("active", "false".into()),
            ("solref", "0.004 1".into()),
            ("solimp", "0.99 0.999 0.0001".into()),
        ],
    );
    xml.close();
}

/// A motor per independent joint, in the order of the plan's joints.
fn write_actuators(xml: &mut Xml, hand: &Hand, moving: &[Vec<JointId>]) {
    xml.open("actuator", &[]);
    for id in moving.iter().flatten() {
        let joint = &hand.robot.joints[id.0];
        if joint.coupling.is_some() {
            continue;
        }
        let mut attributes = vec![("name", joint.name.clone()), ("joint", joint.name.clone())];
        if let Some(effort) = joint.limits.and_then(|limits| limits.effort).filter(|&effort| effort > 0.0) {
            attributes.push(("forcerange", numbers([-effort, effort])));
        }
        xml.leaf("motor", &attributes);
    }
    xml.close();
}

/// Velocities of fingertips and object in the world, and the sum of normal forces on each tip.
fn write_sensors(xml: &mut Xml, hand: &Hand, object: &str) {
    xml.open("sensor", &[]);
    for finger in &hand.fingers {
        let site = tip_name(finger);
        for (kind, what) in [("framelinvel", "linear_velocity"), ("frameangvel", "angular_velocity")] {
            let name = format!("{}:{what}", finger.name);
            xml.leaf(kind, &[("name", name), ("objtype", "site".into()), ("objname", site.clone())]);
        }
        xml.leaf("touch", &[("name", format!("{}:normal_force", finger.name)), ("site", site)]);
    }
    for (kind, what) in [("framelinvel", "linear_velocity"), ("frameangvel", "angular_velocity")] {
        let name = format!("object:{what}");
        xml.leaf(kind, &[("name", name), ("objtype", "xbody".into()), ("objname", object.to_owned())]);
    }
    xml.close();
}

fn write_keyframes(xml: &mut Xml, hand: &Hand, plan: &Plan) {
    xml.open("keyframe", &[]);
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let mut qpos = Vec::new();
            let mut first = 0;
            for finger in &hand.fingers {
                let coordinates = &waypoint.joints[first..first + finger.chain.n_coordinates()];
                qpos.extend(finger.chain.joints.iter().map(|joint| joint.position(coordinates)));
                first += finger.chain.n_coordinates();
            }
            let pose = &waypoint.world_from_object;
            let [x, y, z, w_last] = pose.quat_xyzw;
            qpos.extend(pose.position.iter().chain(&[w_last, x, y, z]));
            let mut attributes =
                vec![("name", format!("{s}_{w}")), ("time", numbers([waypoint.time])), ("qpos", numbers(qpos))];
            if !waypoint.joint_torques.is_empty() {
                attributes.push(("ctrl", numbers(waypoint.joint_torques.iter().copied())));
            }
            xml.leaf("key", &attributes);
        }
    }
    xml.close();
}
