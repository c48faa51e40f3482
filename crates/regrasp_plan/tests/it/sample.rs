//! A four-finger hand, a sphere, and a plan that is good by construction: built by code, with closed-form inverse
//! kinematics written here and nowhere else.

use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_plan::check::{CheckSettings, Level, Report, ViolationKind, check};
use regrasp_plan::plan::{FORMAT, FORMAT_VERSION, MotionLimits, PlanInput, PoseData, Promises, Statistics, WayPose};
use regrasp_plan::{ContactMode, ContactState, Plan, Segment, SegmentKind, Waypoint};
use regrasp_robot::hand::PalmShape;
use regrasp_robot::{
    Chain, ChainJoint, Coupling, Finger, FingerShape, Hand, Joint, JointId, JointKind, JointMotion, Limits, Link,
    LinkId, Robot, Tip, TipShape,
};
use regrasp_scene::scene::InputFile;
use regrasp_scene::{GraspRequest, InHandQuery, Manipulation, Object, Query, Scene, SceneHand, State, TrackingQuery};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

pub const N_FINGERS: usize = 4;
const BASE_RADIUS: f64 = 0.045;
const PROXIMAL: f64 = 0.058;
const DISTAL: f64 = 0.050;
pub const TIP_RADIUS: f64 = 0.005;
pub const OBJECT_RADIUS: f64 = 0.032;
const LIMITS: [(f64, f64); 3] = [(-35.0, 35.0), (-75.0, 60.0), (5.0, 115.0)];

/// Where finger `f` begins: x inward, z along the outstretched finger.
fn hand_from_finger(f: usize) -> Pose {
    let angle = std::f64::consts::FRAC_PI_2 * f as f64;
    let position = Vector::new(BASE_RADIUS * angle.cos(), BASE_RADIUS * angle.sin(), 0.0);
    let turn = UnitQuaternion::from_axis_angle(&Vector::z_axis(), angle + std::f64::consts::PI);
    Pose::from_parts(Translation3::from(position), turn)
}

fn up(z: f64) -> Pose {
    Pose::translation(0.0, 0.0, z)
}

pub fn world_from_hand() -> Pose {
    Pose::new(Vector::new(0.1, -0.2, 0.3), Vector::new(0.2, -0.1, 0.4))
}

fn robot() -> Robot {
    let palm = PlacedShape {
        parent_from_shape: up(-0.02),
        shape: Shape::Cuboid { half_extents: Vector::new(0.05, 0.05, 0.01) },
    };
    let mut robot = Robot {
        name: "sample".into(),
        links: vec![Link {
            name: "palm".into(),
            collision: vec![palm],
            visual: Vec::new(),
            collision_from_visuals: false,
            parent_joint: None,
        }],
        joints: Vec::new(),
        root: LinkId(0),
    };
    let capsule = |length: f64, radius: f64| PlacedShape {
        parent_from_shape: up(0.5 * length),
        shape: Shape::Capsule { half_length: 0.5 * length, radius },
    };
    for f in 0..N_FINGERS {
        let parts = [
            (hand_from_finger(f), Vector::x_axis(), JointKind::Revolute, vec![]),
            (up(0.0), Vector::y_axis(), JointKind::Revolute, vec![capsule(PROXIMAL, 0.007)]),
            (up(PROXIMAL), Vector::y_axis(), JointKind::Revolute, vec![capsule(DISTAL, 0.004)]),
            (
                up(DISTAL),
                Vector::x_axis(),
                JointKind::Fixed,
                vec![PlacedShape { parent_from_shape: Pose::identity(), shape: Shape::Sphere { radius: TIP_RADIUS } }],
            ),
        ];
        let mut parent = LinkId(0);
        for (j, (parent_from_joint, axis, kind, collision)) in parts.into_iter().enumerate() {
            let child = LinkId(robot.links.len());
            let limits = LIMITS.get(j).map(|(low, high)| Limits {
                lower: low.to_radians(),
                upper: high.to_radians(),
                velocity: Some(3.0),
                effort: Some(1.0),
            });
            let joint = JointId(robot.joints.len());
            let name = format!("f{f}_l{j}");
            robot.links.push(Link {
                name,
                collision,
                visual: Vec::new(),
                collision_from_visuals: false,
                parent_joint: Some(joint),
            });
            robot.joints.push(Joint {
                name: format!("f{f}_j{j}"),
                kind,
                parent,
                child,
                parent_from_joint,
                axis,
                limits,
                coupling: None,
            });
            parent = child;
        }
    }
    robot
}

fn hand() -> Hand {
    let robot = robot();
    let fingers = (0..N_FINGERS)
        .map(|f| {
            let link = |j: usize| LinkId(1 + 4 * f + j);
            let joints = (0..3)
                .map(|j| {
                    let joint = &robot.joints[4 * f + j];
                    ChainJoint {
                        parent_from_joint: joint.parent_from_joint,
                        axis: joint.axis,
                        motion: JointMotion::Turn,
                        drive: Coupling::independent(j),
                    }
                })
                .collect();
            let mut shapes = Vec::new();
            for j in 0..4 {
                for placed in &robot.links[link(j).0].collision {
                    let body_from_link = if j == 3 { up(DISTAL) } else { Pose::identity() };
                    let parent_from_shape = body_from_link * placed.parent_from_shape;
                    let placed = PlacedShape { parent_from_shape, shape: placed.shape.clone() };
                    shapes.push(FingerShape { body: j.min(2), link: link(j), placed, is_tip: j == 3 });
                }
            }
            let chain = Chain::new(
                joints,
                (0..3).map(|j| format!("f{f}_j{j}")).collect(),
                LIMITS.iter().map(|(low, _)| low.to_radians()).collect(),
                LIMITS.iter().map(|(_, high)| high.to_radians()).collect(),
            );
            let tip = Tip {
                link: link(3),
                shape: TipShape::Sphere { radius: TIP_RADIUS },
                center_in_body: Point::new(0.0, 0.0, DISTAL),
                pad: None,
                contact: regrasp_robot::ContactModel::Point,
            };
            Finger::new(format!("f{f}"), chain, tip, shapes, vec![0.0, -0.3, 1.0])
        })
        .collect();
    let mut allowed_pairs = std::collections::BTreeSet::new();
    for f in 0..N_FINGERS {
        let link = |j: usize| LinkId(1 + 4 * f + j);
        for (a, b) in
            [(LinkId(0), link(0)), (link(0), link(1)), (link(1), link(2)), (link(2), link(3)), (LinkId(0), link(1))]
        {
            allowed_pairs.insert((a, b));
        }
    }
    let palm = robot.links[0].collision.iter().map(|p| PalmShape { link: LinkId(0), placed: p.clone() }).collect();
    let without_geometry = BTreeSet::new();
    let (ties, held) = (Vec::new(), Vec::new());
    Hand { robot: Arc::new(robot), base: LinkId(0), fingers, palm, allowed_pairs, ties, held, without_geometry }
}

/// The object: a sphere whose centre of mass is its centre.
fn object() -> Object {
    let shape = Shape::Sphere { radius: OBJECT_RADIUS };
    Object {
        hull: None,
        name: "ball".into(),
        surface: surface_of(&shape),
        radius: OBJECT_RADIUS,
        mesh_body: None,
        shape,
        mass: 0.1,
        center_of_mass: Point::origin(),
        friction: 0.8,
        edge_distance: 0.0,
        crease_angle: regrasp_geometry::surface::DEFAULT_CREASE_ANGLE,
    }
}

fn surface_of(shape: &Shape) -> regrasp_geometry::Surface {
    regrasp_geometry::Surface::of(shape).expect("a sphere has a surface")
}

pub fn scene() -> Scene {
    Scene {
        gravity: None,
        // The sample counts on all of its friction.
        limits: regrasp_scene::Limits { friction_margin: Some(1.0), ..Default::default() },
        grasp_files: Vec::new(),
        name: "sample".into(),
        robots: Vec::new(),
        hands: vec![SceneHand {
            name: "hand".into(),
            hand: hand(),
            world_from_hand: world_from_hand(),
            carrier: None,
            reach: None,
        }],
        objects: vec![object()],
        supports: Vec::new(),
        obstacles: Vec::new(),
        inputs: ["scene", "urdf"]
            .map(|role| InputFile {
                role: role.into(),
                name: format!("sample.{role}"),
                path: format!("sample.{role}").into(),
                sha256: regrasp_base::files::sha256(role.as_bytes()),
            })
            .to_vec(),
    }
}

/// The hand at rest and the object of `scene`; where an object is, plans say themselves.
pub fn state(scene: &Scene) -> State {
    State::at_rest(scene, vec![Pose::identity(); scene.objects.len()])
}

/// Runs `ask` on the one hand and the one object of `scene`.
pub fn with_task<T>(scene: &Scene, ask: impl FnOnce(&Manipulation) -> T) -> T {
    ask(&Manipulation::first(scene, &state(scene)))
}

/// Joints of finger `f` that bring its tip's centre to `center_in_hand`.
fn finger_joints(f: usize, center_in_hand: &Point) -> [f64; 3] {
    let p = hand_from_finger(f).inverse() * center_in_hand;
    let h = p.y.hypot(p.z);
    let cosine = (p.x * p.x + h * h - PROXIMAL * PROXIMAL - DISTAL * DISTAL) / (2.0 * PROXIMAL * DISTAL);
    assert!(cosine.abs() < 1.0, "finger {f} cannot reach {center_in_hand}");
    let bend = cosine.acos();
    let lean = p.x.atan2(h) - (DISTAL * bend.sin()).atan2(PROXIMAL + DISTAL * bend.cos());
    [(-p.y).atan2(p.z), lean, bend]
}

/// Where the tip of finger `f` stands.
pub fn hand_from_tip(f: usize, joints: &[f64; 3]) -> Pose {
    let turned = |axis: Vector, angle: f64| Pose::rotation(axis * angle);
    let first = hand_from_finger(f) * turned(Vector::x(), joints[0]) * turned(Vector::y(), joints[1]);
    first * up(PROXIMAL) * turned(Vector::y(), joints[2]) * up(DISTAL)
}

/// Origin and direction of the joints' axes of finger `f`, and its tip's centre, in the hand frame.
pub fn finger_axes(f: usize, joints: &[f64; 3]) -> ([(Point, Vector); 3], Point) {
    let base = hand_from_finger(f);
    let lean = base * Pose::rotation(Vector::x() * joints[0]);
    let bend = lean * Pose::rotation(Vector::y() * joints[1]) * up(PROXIMAL);
    let axis = |frame: &Pose, axis: Vector| (frame * Point::origin(), frame * axis);
    let axes = [axis(&base, Vector::x()), axis(&lean, Vector::y()), axis(&bend, Vector::y())];
    (axes, hand_from_tip(f, joints) * Point::origin())
}

/// Contacts by direction from the centre of the sphere, in the object frame.
pub type Grasp = [Vector; N_FINGERS];

pub fn waypoint(hand_from_object: &Pose, grasp: &Grasp, lifted: Option<(usize, Vector)>) -> Waypoint {
    let mut joints = Vec::new();
    let mut contacts = Vec::new();
    for f in 0..N_FINGERS {
        let free = lifted.filter(|(finger, _)| *finger == f);
        let direction = grasp[f].normalize();
        let center = free.map_or(direction * (OBJECT_RADIUS + TIP_RADIUS), |(_, center)| center);
        joints.extend(finger_joints(f, &(hand_from_object * Point::from(center))));
        contacts.push(match free {
            Some(_) => ContactState::FREE,
            None => ContactState::at(ContactMode::Fixed, (direction * OBJECT_RADIUS).into(), direction.into()),
        });
    }
    Waypoint {
        time: 0.0,
        joint_velocities: vec![0.0; joints.len()],
        joint_torques: Vec::new(),
        joints,
        world_from_object: PoseData::from(&(world_from_hand() * hand_from_object)),
        contacts,
    }
}

fn transfer(from: &Pose, turn: &Vector, shift: &Vector, grasp: &Grasp, n_steps: usize) -> (Segment, Pose) {
    transfer_with(from, turn, shift, grasp, None, n_steps)
}

/// A transfer in which the tip of one finger may be free, at a place beside the object that moves with it.
fn transfer_with(
    from: &Pose,
    turn: &Vector,
    shift: &Vector,
    grasp: &Grasp,
    lifted: Option<(usize, Vector)>,
    n_steps: usize,
) -> (Segment, Pose) {
    let pose_at = |t: f64| {
        let rotation = UnitQuaternion::from_scaled_axis(turn * t) * from.rotation;
        Pose::from_parts(Translation3::from(from.translation.vector + shift * t), rotation)
    };
    let waypoints = (0..=n_steps).map(|k| waypoint(&pose_at(k as f64 / n_steps as f64), grasp, lifted)).collect();
    (Segment::transfer(waypoints), pose_at(1.0))
}

pub fn regrasp(pose: &Pose, grasp: &Grasp, finger: usize, to: Vector, lift: f64) -> (Segment, Grasp) {
    let (from, to) = (grasp[finger].normalize(), to.normalize());
    let mut after = *grasp;
    after[finger] = to;
    let touch = OBJECT_RADIUS + TIP_RADIUS;
    let mut waypoints = vec![waypoint(pose, grasp, None)];
    let n_steps = 6;
    let mut free = |center: Vector| waypoints.push(waypoint(pose, grasp, Some((finger, center))));
    (1..=n_steps).for_each(|k| free(from * (touch + lift * k as f64 / n_steps as f64)));
    let n_slide = 1 + (from.angle(&to) * (touch + lift) / 0.002) as usize;
    for k in 1..=n_slide {
        let t = k as f64 / n_slide as f64;
        free((from * (1.0 - t) + to * t).normalize() * (touch + lift));
    }
    (1..n_steps).for_each(|k| free(to * (touch + lift * (1.0 - k as f64 / n_steps as f64))));
    waypoints.push(waypoint(pose, &after, None));
    let moving_finger = Some(format!("f{finger}"));
    (Segment { kind: SegmentKind::Regrasp, moving_finger, ..Segment::transfer(waypoints) }, after)
}

pub fn around(azimuth_deg: f64, elevation_deg: f64) -> Vector {
    let (a, e) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    Vector::new(a.cos() * e.cos(), a.sin() * e.cos(), e.sin())
}

/// Azimuths and elevations of the contacts at the start, in degrees.
pub const START_GRASP: [(f64, f64); N_FINGERS] = [(5.0, -5.0), (80.0, 6.0), (178.0, -4.0), (272.0, 3.0)];

/// Transfer, relocation of two fingers, transfer.
pub fn plan(scene: &Scene) -> Plan {
    let start = Pose::translation(0.0, 0.0, 0.078);
    let grasp = START_GRASP.map(|(a, e)| around(a, e));
    let (first, pose) = transfer(&start, &Vector::new(0.02, 0.03, 0.2), &Vector::new(0.001, -0.001, 0.002), &grasp, 10);
    let (second, grasp) = regrasp(&pose, &grasp, 1, around(65.0, 2.0), 0.004);
    let (third, grasp) = regrasp(&pose, &grasp, 3, around(255.0, -6.0), 0.002);
    let (fourth, goal) = transfer(&pose, &Vector::new(-0.05, 0.0, 0.15), &Vector::new(0.0, 0.002, -0.002), &grasp, 8);
    plan_of(scene, &start, &goal, vec![first, second, third, fourth])
}

pub fn plan_of(scene: &Scene, start: &Pose, goal: &Pose, segments: Vec<Segment>) -> Plan {
    let joint_names = scene.hands[0].hand.joint_names();
    let mut plan = Plan {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        tool: "test".into(),
        task: "in_hand".into(),
        query: String::new(),
        hand: scene.hands[0].name.clone(),
        object: scene.objects[0].name.clone(),
        method: "by hand".into(),
        seed: 0,
        settings: serde_json::json!({"lift": 0.004}),
        inputs: scene
            .inputs
            .iter()
            .map(|file| PlanInput { role: file.role.clone(), name: file.name.clone(), sha256: file.sha256.clone() })
            .collect(),
        promises: Promises {
            contact_tolerance: 0.1e-3,
            friction: 0.8,
            required_margin: 0.005,
            kept_margin: 0.005,
            torque_scale: OBJECT_RADIUS,
            friction_margin: 1.0,
            slip_tolerance: 1e-4,
            tracking: None,
            motion: MotionLimits {
                largest_speed: 0.04,
                joint_velocities: vec![2.0; joint_names.len()],
                joint_accelerations: vec![20.0; joint_names.len()],
            },
            forces: None,
        },
        joint_names,
        held_joints: BTreeMap::new(),
        fingers: (0..N_FINGERS).map(|f| format!("f{f}")).collect(),
        start: PoseData::from(&(world_from_hand() * start)),
        asked: None,
        way_poses: Vec::new(),
        goal: PoseData::from(&(world_from_hand() * goal)),
        segments,
        statistics: Statistics::default(),
    };
    for segment in &mut plan.segments {
        segment.held_by = vec![plan.hand.clone()];
    }
    let mut now = 0.0;
    for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
        waypoint.time = now;
        now += 0.2;
    }
    plan.statistics.transfers = 2;
    plan.statistics.relocations = 2;
    plan
}

/// A finger lifts off and stays free while the others turn the object, goes to another free posture, and lands.
pub fn plan_with_free_finger(scene: &Scene) -> Plan {
    let start = Pose::translation(0.0, 0.0, 0.078);
    let grasp = START_GRASP.map(|(a, e)| around(a, e));
    let finger = 1;
    let (away, touch) = (0.008, OBJECT_RADIUS + TIP_RADIUS);
    let (whole, _) = regrasp(&start, &grasp, finger, around(70.0, 2.0), away);
    // A relocation lifts in six steps.
    let highest = 6;
    let part = |waypoints: &[Waypoint]| Segment { waypoints: waypoints.to_vec(), ..whole.clone() };
    let lift = part(&whole.waypoints[..=highest]);
    let hover = grasp[finger].normalize() * (touch + away);
    let (turn, shift) = (Vector::new(0.02, 0.03, 0.15), Vector::new(0.001, -0.001, 0.002));
    let (held, pose) = transfer_with(&start, &turn, &shift, &grasp, Some((finger, hover)), 10);
    let free_at = |t: f64| waypoint(&pose, &grasp, Some((finger, hover * (1.0 + 0.05 * t))));
    let higher = Segment { waypoints: (0..=4).map(|k| free_at(f64::from(k) / 4.0)).collect(), ..whole.clone() };
    let (back, landed) = regrasp(&pose, &grasp, finger, around(70.0, 2.0), away);
    let mut waypoints = vec![free_at(1.0)];
    waypoints.extend_from_slice(&back.waypoints[highest..]);
    let land = Segment { waypoints, ..back };
    let (last, goal) = transfer(&pose, &Vector::new(-0.05, 0.0, 0.1), &Vector::new(0.0, 0.002, -0.002), &landed, 8);
    plan_of(scene, &start, &goal, vec![lift, held, higher, land, last])
}

/// With soft fingertips, of which two hold the sphere.
pub fn soft_scene() -> Scene {
    let mut scene = scene();
    for finger in &mut scene.hands[0].hand.fingers {
        finger.tip.contact = regrasp_robot::ContactModel::SoftFinger { torsion_radius: 0.005 };
    }
    scene
}

/// A finger lifts off, another one relocates while it is away, it lands, the object turns. For [`soft_scene`].
pub fn plan_with_two_away(scene: &Scene) -> Plan {
    let start = Pose::translation(0.0, 0.0, 0.078);
    let grasp = START_GRASP.map(|(a, e)| around(a, e));
    let (resting, away) = (1, 0.008);
    let (mut lift, _) = regrasp(&start, &grasp, resting, around(70.0, 2.0), away);
    let highest = 6;
    lift.waypoints.truncate(highest + 1);
    let hover = lift.waypoints[highest].clone();
    let (mut other, grasp) = regrasp(&start, &grasp, 3, around(255.0, -6.0), 0.002);
    for waypoint in &mut other.waypoints {
        let joints = 3 * resting..3 * (resting + 1);
        waypoint.joints[joints.clone()].copy_from_slice(&hover.joints[joints]);
        waypoint.contacts[resting] = hover.contacts[resting];
    }
    let (mut land, grasp) = regrasp(&start, &grasp, resting, around(70.0, 2.0), away);
    land.waypoints.drain(..highest);
    let (last, goal) = transfer(&start, &Vector::new(-0.05, 0.0, 0.1), &Vector::new(0.0, 0.002, -0.002), &grasp, 8);
    plan_of(scene, &start, &goal, vec![lift, other, land, last])
}

/// As [`plan`], with poses to be passed: within the first transfer, at its end, and within the last one.
pub fn plan_with_way(scene: &Scene) -> Plan {
    let mut plan = plan(scene);
    plan.way_poses = [(0, 5), (0, 10), (3, 4)]
        .map(|(segment, waypoint)| {
            let world_from_object = plan.segments[segment].waypoints[waypoint].world_from_object;
            WayPose { world_from_object, segment, waypoint }
        })
        .to_vec();
    plan
}

/// The query that [`plan`] answers.
pub fn query(plan: &Plan) -> Query {
    if plan.task != regrasp_scene::query::TRACKING {
        return in_hand_query(plan).into();
    }
    let InHandQuery {
        name,
        hand,
        object,
        world_from_object_start,
        world_from_object_goal,
        start_grasp,
        goal_grasp,
        ..
    } = in_hand_query(plan);
    TrackingQuery { name, hand, object, world_from_object_start, world_from_object_goal, start_grasp, goal_grasp }
        .into()
}

/// The query that [`plan`] answers, if it is an in-hand plan.
pub fn in_hand_query(plan: &Plan) -> InHandQuery {
    InHandQuery {
        name: plan.query.clone(),
        hand: 0,
        object: 0,
        world_from_object_start: Pose::from(&plan.start),
        world_from_object_way: plan.way_poses.iter().map(|pose| Pose::from(&pose.world_from_object)).collect(),
        world_from_object_goal: Pose::from(&plan.goal),
        start_grasp: GraspRequest::Automatic,
        goal_grasp: GraspRequest::Automatic,
        open_start: None,
    }
}

/// What the checker says of the geometry, and of the forces where there are any, of `plan` as an answer to its own query.
pub fn judge(scene: &Scene, plan: &Plan) -> Report {
    judge_for(Level::Geometry, scene, plan)
}

/// What the checker says of `plan` at this level.
pub fn judge_for(level: Level, scene: &Scene, plan: &Plan) -> Report {
    check((scene, &state(scene)), Some(&query(plan)), plan, &CheckSettings { level, ..CheckSettings::default() })
}

/// The kinds of violations, each once.
pub fn kinds(report: &Report) -> Vec<ViolationKind> {
    let kinds: BTreeSet<_> = report.violations.iter().map(|violation| violation.kind).collect();
    kinds.into_iter().collect()
}
