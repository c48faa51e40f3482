//! Scenes and hands as JSON. Numbers that are not finite (limits of continuous joints) become null.

use regrasp::geometry::{Pose, Shape};
use regrasp::plan::plan::PoseData;
use regrasp::robot::hand::Finger;
use regrasp::robot::robot::{Joint, JointId, JointKind, Limits};
use regrasp::robot::tip::{HullSurface, TipShape};
use regrasp::robot::{ContactModel, Hand};
use regrasp::scene::{Gravity, InputFile, LoadedScene, Object, Obstacle, Query, Scene, SceneHand, Task};
use serde_json::{Value, json};
use std::path::Path;

/// A scene, its hands included.
pub fn scene(loaded: &LoadedScene, path: &Path) -> Value {
    let scene = &loaded.scene;
    let objects = scene.objects.iter().zip(&loaded.state.world_from_objects);
    let supports = scene.supports.iter().map(|support| fixed(&support.body, "world_from_support"));
    json!({
        "name": scene.name,
        "path": path.to_string_lossy(),
        "hands": scene.hands.iter().map(placed_hand).collect::<Vec<_>>(),
        "objects": objects.map(|(object, at_rest)| self::object(object, at_rest)).collect::<Vec<_>>(),
        "gravity": scene.gravity.as_ref().map(gravity),
        "supports": supports.collect::<Vec<_>>(),
        "obstacles": scene.obstacles.iter().map(|body| fixed(body, "world_from_obstacle")).collect::<Vec<_>>(),
        "tasks": loaded.tasks.iter().map(|task| self::task(scene, task)).collect::<Vec<_>>(),
        "inputs": scene.inputs.iter().map(input).collect::<Vec<_>>(),
        "notes": loaded.notes,
    })
}

/// What a task is about. A motion is about a robot: hand and object are empty.
fn task(scene: &Scene, task: &Task) -> Value {
    let is_motion = task.kind_name() == "motion";
    let hand = scene.hands.get(task.hand).filter(|_| !is_motion);
    let object = scene.objects.get(task.object).filter(|_| !is_motion);
    json!({
        "name": task.name,
        "kind": task.kind_name(),
        "hand": hand.map_or("", |hand| hand.name.as_str()),
        "object": object.map_or("", |object| object.name.as_str()),
        "robot": task.of_robot.as_ref().and_then(|query| query.robot()).map(|robot| scene.robots[robot].name.as_str()),
    })
}

/// The poses of a query.
pub fn query(query: &Query) -> Value {
    json!({
        "start": pose(query.start()),
        "way": query.way().iter().map(pose).collect::<Vec<_>>(),
        "goal": pose(query.goal()),
    })
}

/// A hand in its scene.
fn placed_hand(placed: &SceneHand) -> Value {
    let mut value = hand(&placed.hand);
    value["world_from_base"] = pose(&placed.world_from_hand);
    value["name_in_scene"] = placed.name.as_str().into();
    value
}

/// A hand by itself.
pub fn hand(hand: &Hand) -> Value {
    let mut joints = Vec::new();
    for finger in &hand.fingers {
        let chain = &finger.chain;
        for (k, name) in chain.names.iter().enumerate() {
            let of_robot = hand.robot.joint_named(name).map(|id| &hand.robot.joints[id.0]);
            let limits = of_robot.and_then(|joint| joint.limits);
            joints.push(json!({
                "name": name,
                "finger": finger.name,
                "kind": of_robot.map_or("revolute", kind),
                "lower": chain.lower[k],
                "upper": chain.upper[k],
                "velocity": limits.and_then(|limits: Limits| limits.velocity),
                "effort": limits.and_then(|limits: Limits| limits.effort),
            }));
        }
    }
    let name_of = |leader: &JointId| &hand.robot.joints[leader.0].name;
    let coupled = hand.robot.joints.iter().filter_map(|joint| {
        let coupling = joint.coupling.as_ref()?;
        let mut leaders = coupling.terms.iter().map(|(leader, multiplier)| (name_of(leader), multiplier));
        let (follows, multiplier) = leaders.next()?;
        Some(json!({
            "name": joint.name,
            "follows": follows,
            "multiplier": multiplier,
            "offset": coupling.offset,
            "others": leaders.collect::<Vec<_>>(),
        }))
    });
    json!({
        "name": hand.robot.name,
        "base_link": hand.robot.links[hand.base.0].name,
        "name_in_scene": null,
        "world_from_base": pose(&Pose::identity()),
        "joints": joints,
        "coupled_joints": coupled.collect::<Vec<_>>(),
        "fingers": hand.fingers.iter().map(|finger| self::finger(hand, finger)).collect::<Vec<_>>(),
    })
}

fn finger(hand: &Hand, finger: &Finger) -> Value {
    let torsion_radius = match finger.tip.contact {
        ContactModel::SoftFinger { torsion_radius } => Some(torsion_radius),
        ContactModel::Frictionless | ContactModel::Point => None,
    };
    let shape = match finger.tip.shape {
        TipShape::Point => "point",
        TipShape::Sphere { .. } => "sphere",
        TipShape::Ellipsoid(_) => "ellipsoid",
        TipShape::Hull { .. } => "hull",
    };
    let surface = match &finger.tip.shape {
        TipShape::Hull { surface: HullSurface::Smooth(_), .. } => "smooth_hull",
        TipShape::Hull { surface: HullSurface::Ellipsoid(_), .. } => "ellipsoid",
        _ => shape,
    };
    json!({
        "name": finger.name,
        "joint_names": finger.chain.names,
        "rest": finger.rest,
        "tip": {
            "link": hand.robot.links[finger.tip.link.0].name,
            "shape": shape,
            "surface": surface,
            "radius": finger.tip.radius(),
            "contact": finger.tip.contact.name(),
            "torsion_radius": torsion_radius,
        },
    })
}

fn kind(joint: &Joint) -> &'static str {
    match joint.kind {
        JointKind::Fixed => "fixed",
        JointKind::Revolute => "revolute",
        JointKind::Continuous => "continuous",
        JointKind::Prismatic => "prismatic",
    }
}

fn object(object: &Object, at_rest: &Pose) -> Value {
    json!({
        "name": object.name,
        "world_from_object": pose(at_rest),
        "shape": shape(&object.shape),
        "collides_as_hull": object.hull.is_some(),
        "mass": object.mass,
        "center_of_mass": <[f64; 3]>::from(object.center_of_mass.coords),
        "friction": object.friction,
        "radius": object.radius,
    })
}

fn gravity(gravity: &Gravity) -> Value {
    gravity.in_world().map_or_else(|| json!("any"), |in_world| json!(<[f64; 3]>::from(in_world)))
}

/// A body that does not move, with its pose under `key`.
fn fixed(body: &Obstacle, key: &str) -> Value {
    json!({
        "name": body.name,
        "shape": shape(&body.placed.shape),
        key: pose(&body.placed.parent_from_shape),
    })
}

fn shape(shape: &Shape) -> Value {
    let (low, high) = shape.bounds();
    json!({
        "kind": shape.kind(),
        "low": <[f64; 3]>::from(low.coords),
        "high": <[f64; 3]>::from(high.coords),
    })
}

fn input(input: &InputFile) -> Value {
    json!({ "role": input.role, "name": input.name, "path": input.path.to_string_lossy(), "sha256": input.sha256 })
}

fn pose(pose: &Pose) -> Value {
    json!(PoseData::from(pose))
}
