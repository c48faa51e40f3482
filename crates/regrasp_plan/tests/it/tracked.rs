//! Tracking plans made by closed forms, in the hand of four free fingertips: a ball that spins on one of them, a box that
//! rolls on one, and a fingertip that goes over the edge of a box. Relative velocities are derivatives of the closed forms;
//! friction of what slides is put in as its law says, and the other forces are the nearest to a squeeze that balance. The
//! checker looks at poses only.

use crate::sample;
use nalgebra::{DMatrix, DVector, Rotation3, Translation3, UnitQuaternion};
use regrasp_geometry::surface::DEFAULT_CREASE_ANGLE;
use regrasp_geometry::{Point, Pose, Shape, Surface, TriangleMesh, Vector};
use regrasp_plan::plan::{ForcePromises, MotionLimits, PoseData, TrackingPromises};
use regrasp_plan::{ContactMode, ContactState, Plan, Segment, SegmentKind, Waypoint};
use regrasp_robot::ContactModel;
use regrasp_robot::import::{LoadOptions, load_hand};
use regrasp_scene::{Object, Scene};
use std::path::Path;
use std::sync::Arc;

const NAMES: [&str; 4] = ["a", "b", "c", "d"];
pub const RADII: [f64; 4] = [0.04, 0.035, 0.03, 0.02];
/// Where the sliding joints of the hand are all zero, in the hand.
const BASES: [[f64; 3]; 4] = [[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]];
/// Radius of the ball, and half the side of the box.
pub const SIZE: f64 = 0.06;
pub const FRICTION: f64 = 0.7;
/// Of soft fingertips.
const TORSION_RADIUS: f64 = 0.02;
const GRAVITY_IN_WORLD: [f64; 3] = [0.0, 0.0, -9.80665];
/// Time of a step; the first and the last of a segment take twice as long.
const STEP: f64 = 0.1;
/// Normal forces wished for: of fingers that hold a ball or a box that moves and of those that hold a box at whose edge
/// another one is, and of those that slide.
pub const SQUEEZE: [f64; 4] = [8.0; 4];
const SQUEEZE_BESIDE: [f64; 4] = [1.5, 4.0, 12.0, 12.0];
const DRAG: f64 = 0.7;
/// How far a finger that slides goes from that, where one that holds goes by one; one that presses less goes less far.
const GIVE: f64 = 0.1;
/// Over how much of a step derivatives are taken.
const SMALL: f64 = 1e-4;

fn scene(shape: Shape) -> Scene {
    let mut scene = sample::scene();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/hands/four_fingertips/hand.toml");
    let hand = load_hand(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).hand;
    scene.hands[0].hand = hand;
    scene.objects[0] = Object {
        hull: None,
        name: "object".into(),
        surface: Surface::of(&shape).unwrap(),
        radius: shape.reach_from(&Point::origin()),
        mesh_body: None,
        shape,
        mass: 0.3,
        center_of_mass: Point::origin(),
        friction: FRICTION,
        edge_distance: 0.002,
        crease_angle: DEFAULT_CREASE_ANGLE,
    };
    scene.hands[0].reach = Some(0.1);
    scene
}

/// With soft fingertips: the friction of what slides turns the ball about the two contacts that hold.
pub fn ball_scene() -> Scene {
    let mut scene = scene(Shape::Sphere { radius: SIZE });
    for finger in &mut scene.hands[0].hand.fingers {
        finger.tip.contact = ContactModel::SoftFinger { torsion_radius: TORSION_RADIUS };
    }
    scene
}

pub fn box_scene() -> Scene {
    scene(Shape::Cuboid { half_extents: Vector::repeat(SIZE) })
}

/// The box as twelve triangles.
pub fn mesh_scene() -> Scene {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { SIZE } else { -SIZE };
        Point::new(side(0), side(1), side(2))
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    scene(Shape::Mesh(Arc::new(TriangleMesh::new((0..8).map(corner).collect(), triangles).unwrap())))
}

/// A pose for every share of the way.
pub type Course<'a> = Box<dyn Fn(f64) -> Pose + 'a>;

/// What happens in a segment, in the hand's frame.
pub struct Motion<'a> {
    pub moving: usize,
    pub rolling: usize,
    pub modes: [ContactMode; 4],
    pub object: Course<'a>,
    pub tips: [Course<'a>; 4],
    pub n_steps: usize,
}

fn turned(vector: Vector) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(vector)
}

pub fn pose(position: Vector, rotation: UnitQuaternion<f64>) -> Pose {
    Pose::from_parts(Translation3::from(position), rotation)
}

fn resting<'a>(pose: Pose) -> Course<'a> {
    Box::new(move |_| pose)
}

/// The nearest point of the object, and the direction from there; both in the object frame.
fn touched(shape: &Shape, center: &Vector) -> (Vector, Vector) {
    let foot = match shape {
        Shape::Sphere { radius } => center.normalize() * *radius,
        _ => center.map(|x| x.clamp(-SIZE, SIZE)),
    };
    (foot, (center - foot).normalize())
}

/// Velocity of the tip's touching point and angular velocity of the tip at a share `t`, per share, seen from the object.
fn relative_motion(shape: &Shape, motion: &Motion, f: usize, t: f64) -> (Vector, Vector) {
    let seen = |t: f64| (motion.object)(t).inverse() * (motion.tips[f])(t);
    let h = SMALL / motion.n_steps as f64;
    let (before, after) = (seen(t - h), seen(t + h));
    let velocity = (after.translation.vector - before.translation.vector) / (2.0 * h);
    let turn = (after.rotation * before.rotation.inverse()).scaled_axis() / (2.0 * h);
    let (_, normal) = touched(shape, &seen(t).translation.vector);
    (velocity - turn.cross(&(normal * RADII[f])), turn)
}

fn joints_at(tips: &[Course; 4], t: f64) -> Vec<f64> {
    let of_finger = |f: usize| {
        let tip = (tips[f])(t);
        let slides = tip.translation.vector - Vector::from(BASES[f]);
        let (roll, pitch, yaw) = tip.rotation.euler_angles();
        [slides.x, slides.y, slides.z, yaw, pitch, roll]
    };
    (0..4).flat_map(of_finger).collect()
}

fn waypoint(scene: &Scene, motion: &Motion, w: usize) -> Waypoint {
    let t = w as f64 / motion.n_steps as f64;
    let object = (motion.object)(t);
    let shape = &scene.objects[0].shape;
    // Means of the step to come, by its middle; of the last, that of the one before.
    let step = w.min(motion.n_steps - 1);
    let middle = (step as f64 + 0.5) / motion.n_steps as f64;
    let per_second = 1.0 / (motion.n_steps as f64 * span(step, motion.n_steps));
    let contacts = (0..4).map(|f| {
        let tip = (motion.tips[f])(t);
        let (point, normal) = touched(shape, &(object.inverse() * Point::from(tip.translation.vector)).coords);
        let (velocity, turn) = relative_motion(shape, motion, f, middle);
        let still = |vector: Vector, is_still: bool| Some(if is_still { [0.0; 3] } else { vector.into() });
        let mode = motion.modes[f];
        ContactState {
            point_in_tip: Some((tip.inverse() * (object * Point::from(point))).into()),
            relative_velocity_in_object: still(velocity * per_second, !mode.slides()),
            relative_turn_in_object: still(
                turn * per_second,
                matches!(mode, ContactMode::Fixed | ContactMode::PureSliding),
            ),
            ..ContactState::at(mode, point.into(), normal.into())
        }
    });
    let joints = joints_at(&motion.tips, t);
    Waypoint {
        time: 0.0,
        joint_velocities: vec![0.0; joints.len()],
        joint_torques: Vec::new(),
        joints,
        world_from_object: PoseData::from(&(sample::world_from_hand() * object)),
        contacts: contacts.collect(),
    }
}

fn span(step: usize, n_steps: usize) -> f64 {
    if step == 0 || step + 1 == n_steps { 2.0 * STEP } else { STEP }
}

pub fn segment(scene: &Scene, motion: &Motion, squeeze: &[f64; 4]) -> Segment {
    let mut waypoints: Vec<Waypoint> = (0..=motion.n_steps).map(|w| waypoint(scene, motion, w)).collect();
    for waypoint in &mut waypoints {
        add_forces(scene, waypoint, squeeze, None);
    }
    let name = |f: usize| Some(NAMES[f].to_owned());
    let (moving_finger, rolling_finger) = (name(motion.moving), name(motion.rolling));
    Segment { kind: SegmentKind::Tracking, moving_finger, rolling_finger, ..Segment::transfer(waypoints) }
}

/// The forces nearest to the squeeze that balance, friction of what slides given; and torques by virtual work.
/// Finger `idle` touches, if at all, without a force.
pub fn add_forces(scene: &Scene, waypoint: &mut Waypoint, squeeze: &[f64; 4], idle: Option<usize>) {
    let hand_from_object = sample::world_from_hand().inverse() * Pose::from(&waypoint.world_from_object);
    let down = Pose::from(&waypoint.world_from_object).rotation.inverse() * Vector::from(GRAVITY_IN_WORLD);
    // Force of a unit, and moment about its contact.
    let mut columns: Vec<(usize, Vector, Vector)> = Vec::new();
    let mut wished: Vec<f64> = Vec::new();
    let held = |(f, contact): &(usize, &ContactState)| contact.holds() && idle != Some(*f);
    for (f, contact) in waypoint.contacts.iter().enumerate().filter(held) {
        let normal = Vector::from(contact.normal_in_object.unwrap());
        if contact.mode.slides() {
            let velocity = Vector::from(contact.relative_velocity_in_object.unwrap());
            let along = (velocity - normal * normal.dot(&velocity)).try_normalize(1e-12).unwrap_or_default();
            columns.push((f, along * FRICTION - normal, Vector::zeros()));
            wished.push(DRAG);
        } else {
            columns.extend((0..3).map(|k| (f, Vector::ith(k, 1.0), Vector::zeros())));
            wished.extend((normal * -squeeze[f]).iter());
            if let ContactModel::SoftFinger { torsion_radius } = scene.hands[0].hand.fingers[f].tip.contact {
                columns.push((f, Vector::zeros(), normal * torsion_radius));
                wished.push(0.0);
            }
        }
    }
    let mut map = DMatrix::<f64>::zeros(6, columns.len());
    for (k, (f, column, moment)) in columns.iter().enumerate() {
        let point = Vector::from(waypoint.contacts[*f].point_in_object.unwrap());
        map.fixed_view_mut::<3, 1>(0, k).copy_from(column);
        map.fixed_view_mut::<3, 1>(3, k).copy_from(&(point.cross(column) + moment));
    }
    let gives = |f: usize| if waypoint.contacts[f].mode.slides() { GIVE } else { squeeze[f] / SQUEEZE[f] };
    let gives = DVector::from_iterator(columns.len(), columns.iter().map(|(f, ..)| gives(*f)));
    let mut load = DVector::zeros(6);
    load.rows_mut(0, 3).copy_from(&(-down * scene.objects[0].mass));
    let wished = DVector::from_vec(wished);
    let missing = load - &map * &wished;
    let given = (map * DMatrix::from_diagonal(&gives)).svd(true, true).solve(&missing, 1e-12).unwrap();
    let sizes = wished + given.component_mul(&gives);
    waypoint.joint_torques = vec![0.0; waypoint.joints.len()];
    for f in 0..4 {
        let contact = &mut waypoint.contacts[f];
        if !contact.holds() {
            continue;
        }
        let normal = Vector::from(contact.normal_in_object.unwrap());
        let (mut force, mut moment) = (Vector::zeros(), Vector::zeros());
        for (k, (_, of_force, of_moment)) in columns.iter().enumerate().filter(|(_, (g, ..))| *g == f) {
            force += of_force * sizes[k];
            moment += of_moment * sizes[k];
        }
        contact.force_in_object = Some(force.into());
        contact.torsion = (moment != Vector::zeros()).then(|| normal.dot(&moment));
        let force = hand_from_object.rotation * force;
        let arm = hand_from_object.rotation * normal * -RADII[f];
        let moment = arm.cross(&force) + hand_from_object.rotation * moment;
        let [yaw, pitch] = [3, 4].map(|k| waypoint.joints[6 * f + k]);
        let turn = Rotation3::from_axis_angle(&Vector::z_axis(), yaw);
        let both = turn * Rotation3::from_axis_angle(&Vector::y_axis(), pitch);
        let axes = [Vector::z(), turn * Vector::y(), both * Vector::x()];
        for k in 0..3 {
            waypoint.joint_torques[6 * f + k] = force[k];
            waypoint.joint_torques[6 * f + 3 + k] = axes[k].dot(&moment);
        }
    }
}

/// Times and velocities of all segments, and what the plan promises.
pub fn plan_of(scene: &mut Scene, segments: Vec<Segment>) -> Plan {
    for (f, finger) in scene.hands[0].hand.fingers.iter_mut().enumerate() {
        finger.rest = segments[0].waypoints[0].joints[6 * f..6 * f + 6].to_vec();
    }
    let mut plan = sample::plan_of(scene, &Pose::identity(), &Pose::identity(), segments);
    let mut now = 0.0;
    for segment in &mut plan.segments {
        let n_steps = segment.waypoints.len() - 1;
        for w in 0..=n_steps {
            segment.waypoints[w].time = now;
            now += if w == n_steps { STEP } else { span(w, n_steps) };
        }
        for w in 1..n_steps {
            let mean = |w: usize, k: usize| {
                let (a, b) = (&segment.waypoints[w], &segment.waypoints[w + 1]);
                (b.joints[k] - a.joints[k]) / (b.time - a.time)
            };
            let velocity = |k: usize| {
                let (before, after) = (mean(w - 1, k), mean(w, k));
                if before * after > 0.0 { 2.0 * before * after / (before + after) } else { 0.0 }
            };
            segment.waypoints[w].joint_velocities = (0..plan.joint_names.len()).map(velocity).collect();
        }
    }
    let ends = [plan.segments.first().unwrap().waypoints.first(), plan.segments.last().unwrap().waypoints.last()];
    let [start, end] = ends.map(|waypoint| waypoint.unwrap().world_from_object);
    let n_joints = plan.joint_names.len();
    plan.task = "tracking".into();
    plan.fingers = NAMES.map(str::to_owned).to_vec();
    plan.start = start;
    // A hundredth of a radian beyond where the object gets, and somewhere else.
    let goal = Pose::from(&end);
    plan.goal =
        PoseData::from(&pose(Pose::from(&start).translation.vector, goal.rotation * turned(Vector::x() * 0.01)));
    plan.promises.friction = FRICTION;
    (plan.promises.required_margin, plan.promises.kept_margin) = (0.0, 0.0);
    plan.promises.torque_scale = scene.objects[0].radius;
    plan.promises.tracking = Some(TrackingPromises { goal_tolerance: 0.02, sliding_friction: FRICTION });
    plan.promises.motion = MotionLimits {
        largest_speed: 0.1,
        joint_velocities: [0.1, 0.1, 0.1, 1.0, 1.0, 1.0].repeat(4),
        joint_accelerations: [1.0, 1.0, 1.0, 10.0, 10.0, 10.0].repeat(4),
    };
    plan.promises.forces = Some(ForcePromises {
        mass: scene.objects[0].mass,
        gravity_in_world: Some(GRAVITY_IN_WORLD),
        normal_force: [0.1, 30.0],
        joint_torques: [50.0, 50.0, 50.0, 5.0, 5.0, 5.0].repeat(4).into_iter().map(Some).collect(),
    });
    assert_eq!(n_joints, 24);
    plan
}

/// How a moving fingertip goes over the ball, seen from the ball: its centre about one axis, its link about another.
#[derive(Clone, Copy)]
pub struct Round {
    pub mode: ContactMode,
    pub center: Vector,
    pub link: Vector,
}

/// Directions of the contacts on the ball at the start. The ball spins about that of `b`.
pub fn ball_grasp() -> [Vector; 4] {
    [
        sample::around(0.0, 62.0),
        Vector::new(0.1, -0.05, -1.0).normalize(),
        sample::around(100.0, 5.0),
        sample::around(260.0, -3.0),
    ]
}

/// A ball that spins on a resting fingertip, and between times rests, while the moving one does everything that it may.
pub fn ball_plan(scene: &mut Scene) -> Plan {
    let mut tips: [Pose; 4] = std::array::from_fn(|f| {
        let center = ball_grasp()[f] * (SIZE + RADII[f]);
        pose(center, UnitQuaternion::identity())
    });
    let mut object = Pose::identity();
    let mut segments = Vec::new();
    let spin = ball_grasp()[1];
    let rolls = (SIZE + RADII[0]) / RADII[0];
    use ContactMode::{Fixed, PureRolling, PureSliding, Rolling, Sliding, Twisting};
    // Of the moving finger, how far the ball turns, and the axes of both, for the direction in which the finger then is.
    type Axes = fn(Vector) -> Vector;
    let across: Axes = |n| n.cross(&Vector::z()).normalize() * 0.08;
    let aside: Axes = |n| n.cross(&Vector::x()).normalize() * 0.06;
    let slanted: Axes = |n| n.cross(&Vector::z()).normalize() * 0.06 + n * 0.05;
    let none: Axes = |_| Vector::zeros();
    let cases: [(ContactMode, f64, Axes, f64, Vector); 8] = [
        (Fixed, 0.1, none, 0.0, Vector::zeros()),
        (PureRolling, 0.0, across, rolls, Vector::zeros()),
        (Rolling, -0.12, slanted, rolls, Vector::zeros()),
        (PureSliding, 0.0, aside, 0.0, Vector::zeros()),
        (Sliding, 0.0, aside, -0.5, Vector::new(0.05, 0.0, 0.1)),
        (Twisting, 0.1, none, 0.0, Vector::zeros()),
        (PureRolling, 0.1, aside, rolls, Vector::zeros()),
        (Fixed, -0.1, none, 0.0, Vector::zeros()),
    ];
    for (mode, turn, axes, share, own) in cases {
        let seen = object.inverse() * tips[0];
        let direction = seen.translation.vector.normalize();
        let center = axes(direction);
        let own = if mode == Twisting { direction * 0.15 } else { own };
        let round = Round { mode, center, link: center * share + own };
        let start = object;
        let motion = spinning(&start, spin, turn, &tips, &round);
        segments.push(segment(scene, &motion, &SQUEEZE));
        let (end, tip) = ((motion.object)(1.0), (motion.tips[0])(1.0));
        drop(motion);
        (object, tips[0]) = (end, tip);
    }
    plan_of(scene, segments)
}

pub fn spinning(start: &Pose, spin: Vector, turn: f64, tips: &[Pose; 4], round: &Round) -> Motion<'static> {
    let (start, spin, round) = (*start, spin, *round);
    let object = move |t: f64| turned(spin * (turn * t)) * start;
    let seen = start.inverse() * tips[0];
    let carried = move |t: f64| {
        let center = turned(round.center * t) * seen.translation.vector;
        object(t) * pose(center, turned(round.link * t) * seen.rotation)
    };
    use ContactMode::{Fixed, Sliding, Twisting};
    let [_, b, c, d] = *tips;
    let others = if turn == 0.0 { [Fixed; 3] } else { [Twisting, Sliding, Sliding] };
    Motion {
        moving: 0,
        rolling: 1,
        modes: [round.mode, others[0], others[1], others[2]],
        object: Box::new(object),
        tips: [Box::new(carried), resting(b), resting(c), resting(d)],
        n_steps: 10,
    }
}

/// The ball spins, one of those that slid goes elsewhere through the air, all four carry the ball on, and it spins again.
pub fn gaiting_plan(scene: &mut Scene) -> Plan {
    let mut tips: [Pose; 4] =
        std::array::from_fn(|f| pose(ball_grasp()[f] * (SIZE + RADII[f]), UnitQuaternion::identity()));
    let (mut object, spin) = (Pose::identity(), ball_grasp()[1]);
    let mut segments = Vec::new();
    let carried = Round { mode: ContactMode::Fixed, center: Vector::zeros(), link: Vector::zeros() };
    let first = spinning(&object, spin, 0.1, &tips, &carried);
    segments.push(segment(scene, &first, &SQUEEZE));
    let (end, tip) = ((first.object)(1.0), (first.tips[0])(1.0));
    drop(first);
    (object, tips[0]) = (end, tip);
    // Off by 5 mm, aside by a fifth of a radian, and back.
    let (relocated, there) = (2, tips[2]);
    let around = move |t: f64| {
        let lift = 0.005 * (4.0 * t).min(4.0 * (1.0 - t)).min(1.0);
        let direction =
            turned(Vector::z() * (0.2 * (2.0 * t - 0.5).clamp(0.0, 1.0))) * there.translation.vector.normalize();
        pose(direction * (SIZE + RADII[2] + lift), there.rotation)
    };
    let [a, b, _, d] = tips;
    let relocation = Motion {
        moving: relocated,
        rolling: 1,
        modes: [ContactMode::Fixed; 4],
        object: resting(object),
        tips: [resting(a), resting(b), Box::new(around), resting(d)],
        n_steps: 24,
    };
    segments.push(untracked(scene, segment(scene, &relocation, &SQUEEZE), SegmentKind::Regrasp));
    tips[2] = (relocation.tips[2])(1.0);
    drop(relocation);
    let seen = [a, b, tips[2], d].map(|tip| object.inverse() * tip);
    let start = object;
    let course =
        move |t: f64| pose(Vector::new(0.002, -0.003, 0.001) * t, turned(Vector::new(0.02, -0.05, 0.03) * t)) * start;
    let together = |f: usize| -> Course { Box::new(move |t: f64| course(t) * seen[f]) };
    let transfer = Motion {
        moving: 0,
        rolling: 1,
        modes: [ContactMode::Fixed; 4],
        object: Box::new(course),
        tips: [together(0), together(1), together(2), together(3)],
        n_steps: 10,
    };
    segments.push(untracked(scene, segment(scene, &transfer, &SQUEEZE), SegmentKind::Transfer));
    let again = course(1.0);
    let tips = seen.map(|tip| again * tip);
    // The ball's centre is elsewhere now, and it spins about the contact with the same finger.
    let center = again.translation.vector;
    let shifted = tips.map(|tip| pose(tip.translation.vector - center, tip.rotation));
    let start = pose(Vector::zeros(), again.rotation);
    let place = pose(center, UnitQuaternion::identity());
    let axis = shifted[1].translation.vector.normalize();
    let last = spinning(&start, axis, 0.08, &shifted, &carried);
    let spin = last;
    let moved = move |course: Course<'static>| -> Course<'static> { Box::new(move |t: f64| place * course(t)) };
    let last = Motion { object: moved(spin.object), tips: spin.tips.map(moved), ..spin };
    segments.push(segment(scene, &last, &SQUEEZE));
    let mut plan = plan_of(scene, segments);
    (plan.promises.required_margin, plan.promises.kept_margin) = (0.005, 0.005);
    plan
}

/// A segment of another kind: the finger that relocates is free on its way and exerts nothing at its ends.
fn untracked(scene: &Scene, mut segment: Segment, kind: SegmentKind) -> Segment {
    let moving = segment.moving_finger.take().filter(|_| kind == SegmentKind::Regrasp);
    let idle = moving.as_ref().and_then(|name| NAMES.iter().position(|other| other == name));
    (segment.kind, segment.moving_finger, segment.rolling_finger) = (kind, moving, None);
    let last = segment.waypoints.len() - 1;
    for (w, waypoint) in segment.waypoints.iter_mut().enumerate() {
        for (f, contact) in waypoint.contacts.iter_mut().enumerate() {
            contact.point_in_tip = None;
            (contact.relative_velocity_in_object, contact.relative_turn_in_object) = (None, None);
            if idle == Some(f) && w > 0 && w < last {
                *contact = ContactState::FREE;
            }
        }
        add_forces(scene, waypoint, &SQUEEZE, idle);
    }
    segment
}

/// A box that rolls over a resting ball beneath it; two rest beside it, and it slides between them. The one on top is
/// carried, and then rolls on it.
pub fn box_plan(scene: &mut Scene) -> Plan {
    let normals = [Vector::z(), -Vector::z(), Vector::x(), -Vector::x()];
    let feet = [[0.005, -0.004], [0.0, 0.0], [0.01, 0.012], [-0.012, 0.01]];
    let mut tips: [Pose; 4] = std::array::from_fn(|f| {
        let [u, v] = feet[f];
        let beside = if f < 2 { Vector::new(u, v, 0.0) } else { Vector::new(0.0, u, v) };
        pose(normals[f] * (SIZE + RADII[f]) + beside, UnitQuaternion::identity())
    });
    let mut segments = Vec::new();
    let mut rolled = 0.0;
    use ContactMode::{Fixed, PureRolling, Rolling, Sliding};
    for (mode, turn, way) in [
        (Fixed, 0.15, Vector::zeros()),
        (PureRolling, -0.2, Vector::new(0.1, 0.2, 0.0)),
        (Rolling, 0.2, Vector::new(-0.15, 0.1, 0.2)),
    ] {
        let below = tips[1].translation.vector;
        let (from, start_tip) = (rolled, tips[0]);
        // About the x axis: the contact goes as far on the face as on the ball.
        let object = move |t: f64| {
            let angle = from + turn * t;
            let rotation = turned(Vector::x() * angle);
            let contact = Vector::new(0.0, -RADII[1] * angle, -SIZE);
            pose(below + rotation * (Vector::z() * RADII[1] - contact), rotation)
        };
        let seen = object(0.0).inverse() * start_tip;
        let carried = move |t: f64| {
            let center = seen.translation.vector + way.cross(&Vector::z()) * (RADII[0] * t);
            object(t) * pose(center, turned(way * t) * seen.rotation)
        };
        let motion = Motion {
            moving: 0,
            rolling: 1,
            modes: [mode, PureRolling, Sliding, Sliding],
            object: Box::new(object),
            tips: [Box::new(carried), resting(tips[1]), resting(tips[2]), resting(tips[3])],
            n_steps: 12,
        };
        segments.push(segment(scene, &motion, &SQUEEZE));
        let tip = (motion.tips[0])(1.0);
        drop(motion);
        tips[0] = tip;
        rolled += turn;
    }
    plan_of(scene, segments)
}

/// Where a tip's centre is that has gone `way` from the middle of the top of the box over the edge at +y, and how far its
/// normal has turned.
fn over_the_edge(way: f64, radius: f64) -> (Vector, f64) {
    let round = radius * std::f64::consts::FRAC_PI_2;
    let top = way.min(SIZE);
    let angle = ((way - SIZE) / radius).clamp(0.0, std::f64::consts::FRAC_PI_2);
    let down = (way - SIZE - round).max(0.0);
    (Vector::new(0.0, top + radius * angle.sin(), SIZE + radius * angle.cos() - down), angle)
}

/// A fingertip rolls from the top of a resting box over its edge and down its side, and slides back.
pub fn edge_plan(scene: &mut Scene) -> Plan {
    let normals = [Vector::z(), -Vector::z(), Vector::x(), -Vector::x()];
    let others: [Pose; 4] = std::array::from_fn(|f| pose(normals[f] * (SIZE + RADII[f]), UnitQuaternion::identity()));
    let radius = RADII[0];
    let (first, last) = (SIZE - 0.018, SIZE + radius * std::f64::consts::FRAC_PI_2 + 0.015);
    use ContactMode::{Fixed, PureRolling, PureSliding};
    let turn = |way: f64| turned(-Vector::x() * ((way - first) / radius));
    let rolls = move |t: f64| {
        let way = first + (last - first) * t;
        pose(over_the_edge(way, radius).0, turn(way))
    };
    let slides = move |t: f64| pose(over_the_edge(last + (first - last) * t, radius).0, turn(last));
    let courses: [(ContactMode, Course); 2] = [(PureRolling, Box::new(rolls)), (PureSliding, Box::new(slides))];
    let segments = courses.into_iter().map(|(mode, course)| {
        let motion = Motion {
            moving: 0,
            rolling: 1,
            modes: [mode, Fixed, Fixed, Fixed],
            object: resting(Pose::identity()),
            tips: [course, resting(others[1]), resting(others[2]), resting(others[3])],
            n_steps: 36,
        };
        segment(scene, &motion, &SQUEEZE_BESIDE)
    });
    let segments = segments.collect();
    plan_of(scene, segments)
}
