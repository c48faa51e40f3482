//! Leaving out far obstacles against testing all of them in turn: the same answers and the same bits of everything known.

use crate::ends::blocked::object_blocked_by;
use crate::grasp::state::{Contacts, HandJoints};
use crate::model::{Body, Carrier, Model};
use crate::settings::PhysicsSettings;
use crate::workspace::{TipMode, Workspace};
use regrasp_base::Rng;
use regrasp_geometry::collision::{Ball, MeshBody};
use regrasp_geometry::reference::{Clearance, ReferenceShape, distance};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, TriangleMesh, Vector, pose_from};
use regrasp_grasp::Contact;
use regrasp_robot::import::LoadOptions;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use regrasp_scene::{LoadedScene, Obstacle, load_scene};
use std::path::Path;
use std::sync::Arc;

/// Middle of where hand, object and obstacles are.
const MIDDLE: Vector = Vector::new(0.0, 0.0, 0.1);

/// A shell of eight triangles with a hole in it: not convex, not closed.
fn open_shell(size: f64) -> Shape {
    let corner = |k: usize| Vector::from_fn(|axis, _| if k >> axis & 1 == 1 { size } else { -size });
    let vertices = (0..8).map(|k| Point::from(corner(k))).collect();
    let sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]];
    Shape::Mesh(Arc::new(TriangleMesh::new(vertices, sides.to_vec()).unwrap()))
}

fn random_shape(size: f64, rng: &mut Rng) -> Shape {
    let mut part = || size * rng.uniform(0.3, 1.0);
    let (p, q, r) = (part(), part(), part());
    match rng.below(6) {
        0 => Shape::Sphere { radius: p },
        1 => Shape::Capsule { half_length: p, radius: q },
        2 => Shape::Cuboid { half_extents: Vector::new(p, q, r) },
        3 => Shape::Cylinder { half_length: p, radius: q },
        4 => Shape::Ellipsoid { radii: Vector::new(p, q, r) },
        _ => open_shell(p),
    }
}

/// Specks, obstacles of the size of a finger, and some as large as a house, whose surface comes near the middle.
fn random_obstacle(index: usize, rng: &mut Rng) -> Obstacle {
    let size = match rng.below(8) {
        0 => 1e-5,
        1 => 5.0,
        _ => rng.uniform(0.003, 0.02),
    };
    let shape = random_shape(size, rng);
    let away = rng.uniform(0.06, 0.25) + if size > 1.0 { shape.bounding_sphere().1 } else { 0.0 };
    obstacle(index, shape, MIDDLE + Vector::from(rng.direction()) * away, rng)
}

fn obstacle(index: usize, shape: Shape, position: Vector, rng: &mut Rng) -> Obstacle {
    let parent_from_shape = pose_from(position.into(), rng.quat_xyzw());
    Obstacle {
        name: format!("obstacle {index}"),
        mesh_body: MeshBody::of(&shape),
        placed: PlacedShape { parent_from_shape, shape },
    }
}

fn scene_with(n_obstacles: usize, rng: &mut Rng) -> LoadedScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/box_90x.toml");
    let mut loaded = load_scene(&path, &LoadOptions::default()).unwrap();
    loaded.scene.obstacles = (0..n_obstacles).map(|index| random_obstacle(index, rng)).collect();
    loaded
}

/// Makes a workspace test every pair with every obstacle, in turn, as if all of them were near.
fn look_at_all(workspace: &mut Workspace) {
    let n = workspace.model.view.obstacles.len();
    let everywhere = |index| Ball { center: Point::origin(), radius: f64::INFINITY, index };
    for around in &mut workspace.nearby.around {
        around.near = (0..n as u32).map(everywhere).collect();
        around.others = f64::INFINITY;
    }
}

fn changed(joints: &HandJoints, size: f64, rng: &mut Rng) -> HandJoints {
    joints.iter().map(|finger| finger.iter().map(|joint| joint + size * rng.uniform(-1.0, 1.0)).collect()).collect()
}

fn changed_pose(pose: &Pose, size: f64, rng: &mut Rng) -> Pose {
    let shift = Vector::from(rng.direction()) * (size * rng.unit());
    let turn = Vector::from(rng.direction()) * (10.0 * size * rng.unit());
    Pose::from_parts(
        (pose.translation.vector + shift).into(),
        nalgebra::UnitQuaternion::from_scaled_axis(turn) * pose.rotation,
    )
}

/// Something asked of a workspace.
enum Question {
    Set(Pose, Box<HandJoints>, u32),
    PlaceObject(Pose),
    SetFinger(usize, Coordinates),
    IsClear(TipMode),
    FingerIsClear(usize, TipMode),
    FingerAloneIsClear(usize, TipMode),
    FingersAreClear(Box<[(usize, Coordinates); 2]>),
    Step(Pose, Box<HandJoints>),
    StepFinger(usize, Coordinates, TipMode),
    Slide(Pose, Box<(HandJoints, Contacts)>),
}

fn ask(workspace: &mut Workspace, question: &Question, contacts: &Contacts) -> bool {
    match question {
        Question::Set(pose, joints, holding) => {
            workspace.set_held(pose, joints, contacts, *holding);
            true
        }
        Question::PlaceObject(pose) => {
            workspace.place_object(pose);
            true
        }
        Question::SetFinger(finger, joints) => {
            workspace.set_finger(*finger, joints);
            true
        }
        Question::IsClear(mode) => workspace.is_clear(*mode),
        Question::FingerIsClear(finger, mode) => workspace.finger_is_clear(*finger, *mode),
        Question::FingerAloneIsClear(finger, mode) => workspace.finger_alone_is_clear(*finger, *mode),
        Question::FingersAreClear(two) => {
            let [a, b] = &**two;
            workspace.fingers_are_clear((a.0, &a.1), (b.0, &b.1))
        }
        Question::Step(pose, joints) => workspace.step(pose, joints, TipMode::AllHold),
        Question::StepFinger(finger, joints, mode) => workspace.step_finger(*finger, joints, *mode),
        Question::Slide(pose, there) => workspace.slide(pose, &there.0, &there.1),
    }
}

fn random_question(workspace: &Workspace, home: (&Pose, &HandJoints), contacts: &Contacts, rng: &mut Rng) -> Question {
    let n = home.1.len();
    let now = &workspace.now;
    let finger = rng.below(n);
    let mode = match rng.below(3) {
        0 => TipMode::AllHold,
        1 => TipMode::Near { finger, normal_in_world: Vector::z() },
        _ => TipMode::Away { finger, clearance: 0.002 },
    };
    let leap = changed(home.1, 0.5, rng);
    let step = changed(&now.joints, 0.04, rng);
    let pose_step = changed_pose(&now.world_from_object, 0.004, rng);
    let pose_leap = changed_pose(home.0, 0.03, rng);
    match rng.below(20) {
        0 => Question::Set(pose_leap, Box::new(leap), 0),
        1 => Question::PlaceObject(pose_leap),
        2 => Question::SetFinger(finger, leap[finger].clone()),
        3 => Question::IsClear(mode),
        4 => Question::FingerIsClear(finger, mode),
        5 => Question::FingerAloneIsClear(finger, mode),
        6 => {
            let other = (finger + 1) % n;
            Question::FingersAreClear(Box::new([(finger, leap[finger].clone()), (other, leap[other].clone())]))
        }
        7..=9 => Question::Slide(pose_step, Box::new((step, contacts.clone()))),
        10..=14 => Question::StepFinger(finger, step[finger].clone(), mode),
        _ => Question::Step(pose_step, Box::new(step)),
    }
}

/// Every pair with an obstacle that `culled` knows something of is known as well, bit for bit, to `all`.
fn assert_known_alike(culled: &Workspace, all: &Workspace, with_slack: bool) {
    let n_own = culled.model.pairs.len();
    let bits = |v: &Vector| [v.x, v.y, v.z].map(f64::to_bits);
    for k in 0..culled.pairs.len() {
        let pair = culled.pairs[k];
        let other = all.pairs.iter().position(|known| *known == pair).expect("all pairs are known");
        assert_eq!(bits(&culled.directions[k]), bits(&all.directions[other]), "{pair:?}");
        assert_eq!(culled.hints[k], all.hints[other], "{pair:?}");
        if with_slack || k < n_own {
            assert_eq!(culled.slack[k].to_bits(), all.slack[other].to_bits(), "{pair:?}");
        }
    }
    // A pair that was left to the balls was never searched for a direction.
    for (pair, direction) in all.pairs.iter().zip(&all.directions).skip(n_own) {
        assert!(*direction == Vector::zeros() || culled.pairs.contains(pair), "{pair:?} was needed");
    }
}

/// What the questions of a scene met: clear answers, and others for which an obstacle was to blame.
#[derive(Debug, Default)]
struct Met {
    n_clear: usize,
    n_blocked: usize,
    n_exact: usize,
}

fn compare(n_obstacles: usize, n_questions: usize, index: u64, met: &mut Met) -> Vec<(bool, u64)> {
    let mut rng = Rng::keyed(7, "nearby", index);
    let loaded = scene_with(n_obstacles, &mut rng);
    let view = loaded.view();
    let model = Model::new(&view, &PhysicsSettings::default());
    let joints: HandJoints = view.hand.fingers.iter().map(|f| f.rest.iter().copied().collect()).collect();
    let contact = Contact { point_in_object: Point::origin(), normal_in_object: Vector::z_axis() };
    let contacts: Contacts = joints.iter().map(|_| contact).collect();
    let home = Pose::translation(0.0, 0.0, 0.16);
    let (mut culled, mut all) = (Workspace::new(&model), Workspace::new(&model));
    let bodies = reference_bodies(&model.bodies);
    let mut answers = Vec::new();
    for k in 0..n_questions {
        let question = match k {
            0 => Question::Set(home, Box::new(joints.clone()), 0),
            _ => random_question(&culled, (&home, &joints), &contacts, &mut rng),
        };
        look_at_all(&mut all);
        let answer = ask(&mut culled, &question, &contacts);
        assert_eq!(answer, ask(&mut all, &question, &contacts), "question {k}");
        assert_eq!((culled.work, culled.blocking_pair), (all.work, all.blocking_pair), "question {k}");
        assert_eq!(culled.now.placements, all.now.placements);
        answers.push((answer, culled.work));
        let is_test = !matches!(question, Question::Set(..) | Question::PlaceObject(_) | Question::SetFinger(..));
        met.n_clear += usize::from(is_test && answer);
        met.n_blocked += usize::from(!answer && culled.blocking_pair.is_some_and(|pair| pair.b > model.object));
        if matches!(question, Question::Step(..) | Question::Slide(..) | Question::IsClear(_)) && answer {
            met.n_exact += 1;
            assert_apart(&model, &culled, &bodies);
        }
        if k % 50 == 49 {
            assert_known_alike(&culled, &all, false);
        }
    }
    // Once more with all obstacles: what was put off is worked out, and must be what the other one has.
    culled.set(&home, &joints, &contacts);
    all.set(&home, &joints, &contacts);
    for _ in 0..20 {
        let slide = (changed_pose(&home, 0.002, &mut rng), changed(&joints, 0.02, &mut rng));
        look_at_all(&mut all);
        assert_eq!(culled.slide(&slide.0, &slide.1, &contacts), all.slide(&slide.0, &slide.1, &contacts));
    }
    look_at_all(&mut culled);
    let mode = TipMode::AllHold;
    let is_clear = culled.is_clear(mode);
    assert_eq!(is_clear, all.is_clear(mode));
    assert_known_alike(&culled, &all, is_clear);
    answers
}

fn reference_bodies(bodies: &[Body]) -> Vec<Option<ReferenceShape>> {
    // What stands for a mesh is its hull; the triangles are tested elsewhere.
    bodies.iter().map(|body| body.tree.is_none().then(|| ReferenceShape::new(&body.shape).unwrap())).collect()
}

/// By parry, over all moving bodies and all obstacles: nothing is nearer than the clearance.
fn assert_apart(model: &Model, workspace: &Workspace, shapes: &[Option<ReferenceShape>]) {
    let clearance = model.settings.clearance;
    for a in (0..model.first_obstacle()).filter(|&a| !matches!(model.bodies[a].carrier, Carrier::World)) {
        for b in model.first_obstacle()..model.bodies.len() {
            let (Some(shape_a), Some(shape_b)) = (&shapes[a], &shapes[b]) else { continue };
            let at = [a, b].map(|body| workspace.now.at(model, body).to_pose());
            match distance(shape_a, &at[0], shape_b, &at[1], 0.01) {
                Clearance::SeparatedBy(d) => assert!(d >= clearance - 1e-8, "{d}: {a} and {b}"),
                answer => panic!("{answer:?}: {} and {}", model.bodies[a].name, model.bodies[b].name),
            }
        }
    }
}

#[test]
fn leaving_out_far_obstacles_changes_no_bit() {
    let mut met = Met::default();
    for (index, n_obstacles) in [1, 3, 10, 30, 30, 60, 100, 300].into_iter().enumerate() {
        compare(n_obstacles, 2000, index as u64, &mut met);
    }
    assert!(met.n_clear > 1000 && met.n_blocked > 1000 && met.n_exact > 100, "{met:?}");
}

#[test]
fn the_first_obstacle_in_the_way_of_the_object_is_named() {
    let (mut n_free, mut n_blocked) = (0, 0);
    for (index, n_obstacles) in [1, 10, 40].into_iter().enumerate() {
        let mut rng = Rng::keyed(9, "nearby", index as u64);
        let loaded = scene_with(n_obstacles, &mut rng);
        let view = loaded.view();
        let model = Model::new(&view, &PhysicsSettings::default());
        let shapes = reference_bodies(&model.bodies);
        let object = shapes[model.object].as_ref().unwrap();
        for _ in 0..300 {
            let pose = changed_pose(&Pose::translation(0.0, 0.0, 0.12), 0.15, &mut rng);
            let blocked_by = object_blocked_by(&model, &pose).map(|body| body.name.as_str());
            let gap = |body: usize| {
                let other = shapes[body].as_ref()?;
                Some(match distance(object, &pose, other, &model.bodies[body].carrier_from_body.to_pose(), 0.01) {
                    Clearance::SeparatedBy(gap) => gap,
                    _ => 0.0,
                })
            };
            let clearance = model.settings.clearance;
            let bodies =
                || (0..model.bodies.len()).filter(|&body| matches!(model.bodies[body].carrier, Carrier::World));
            let before = bodies().take_while(|&body| Some(model.bodies[body].name.as_str()) != blocked_by);
            for body in before {
                assert!(gap(body).is_none_or(|gap| gap >= clearance - 1e-8), "{}", model.bodies[body].name);
                n_free += 1;
            }
            if let Some(name) = blocked_by {
                let body = bodies().find(|&body| model.bodies[body].name == name).unwrap();
                assert!(gap(body).is_none_or(|gap| gap <= clearance + 1e-6), "{name}");
                n_blocked += usize::from(body > model.object);
            }
        }
    }
    assert!(n_free > 1000 && n_blocked > 100, "{n_free} {n_blocked}");
}

#[test]
fn the_same_questions_have_the_same_answers() {
    assert_eq!(compare(50, 200, 99, &mut Met::default()), compare(50, 200, 99, &mut Met::default()));
}

/// Balls just out of reach, exactly at it, and just within: of every body where it rests, by a rounding error and by more.
#[test]
fn obstacles_that_touch_the_clearance_are_judged_as_by_testing_all() {
    let mut rng = Rng::keyed(8, "nearby", 0);
    let mut n_blocked = 0;
    let bare = scene_with(0, &mut rng);
    let settings = PhysicsSettings::default();
    let view = bare.view();
    let model = Model::new(&view, &settings);
    let mut workspace = Workspace::new(&model);
    let joints: HandJoints = view.hand.fingers.iter().map(|f| f.rest.iter().copied().collect()).collect();
    let contacts = Contacts::new();
    let home = Pose::translation(0.0, 0.0, 0.16);
    workspace.set_held(&home, &joints, &contacts, 0);
    for k in 0..200 {
        let body = rng.below(model.bodies.len());
        let Body { center, radius, carrier, .. } = &model.bodies[body];
        if matches!(carrier, Carrier::World) {
            continue;
        }
        let size = 10f64.powf(rng.uniform(-6.0, 1.0));
        let off = [-1e-3, -1e-9, -1e-16, 0.0, 1e-16, 1e-9, 1e-3][k % 7];
        let away = radius + size + settings.clearance + off;
        let position = workspace.now.at(&model, body).point(center).coords + Vector::from(rng.direction()) * away;
        let mut loaded = bare.clone();
        loaded.scene.obstacles = vec![obstacle(0, Shape::Sphere { radius: size }, position, &mut rng)];
        let view = loaded.view();
        let model = Model::new(&view, &settings);
        let (mut culled, mut all) = (Workspace::new(&model), Workspace::new(&model));
        look_at_all(&mut all);
        for workspace in [&mut culled, &mut all] {
            workspace.set_held(&home, &joints, &contacts, 0);
        }
        for finger in 0..joints.len() {
            let answer = culled.finger_is_clear(finger, TipMode::AllHold);
            assert_eq!(answer, all.finger_is_clear(finger, TipMode::AllHold));
            n_blocked += usize::from(!answer);
        }
        assert_eq!(culled.is_clear(TipMode::AllHold), all.is_clear(TipMode::AllHold));
        assert_eq!(culled.blocking_pair, all.blocking_pair);
    }
    assert!(n_blocked > 5, "{n_blocked}");
}
