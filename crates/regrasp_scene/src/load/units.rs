//! Mistakes that show only when hand, object and task are seen together: units (reliability R15), reach, contacts.

use super::numbers::{list, shown};
use super::task::{StartOrientation, Task};
use crate::goal::Goal;
use crate::object::Object;
use crate::query::{GRASP_TOLERANCE, GraspRequest};
use crate::scene::SceneHand;
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::{Point, Pose};
use regrasp_robot::Hand;

/// Hand and object may differ in size by this factor (reliability R15).
const MAX_SIZE_RATIO: f64 = 20.0;

/// Reports a hand and an object that cannot both be in metres (`M201`).
pub(super) fn check_sizes(hand: &Hand, object: &Object, entry: &Entry, found: &mut Found) {
    let (low, high) = object.shape.bounds();
    let (hand_size, object_size) = (size_of(hand), (high - low).max());
    let ratio = hand_size / object_size;
    if (1.0 / MAX_SIZE_RATIO..=MAX_SIZE_RATIO).contains(&ratio) {
        return;
    }
    // Powers of ten only: the factor that was forgotten, not the one that would make it fit.
    let scale = 10f64.powi(if ratio > 1.0 { 3 } else { -3 });
    let diagnostic = entry
        .error(
            "M201",
            found,
            format!("is {object_size:.4} m large, the hand {} m: one of them is in another unit", shown(hand_size, 4)),
        )
        .expected(format!("sizes that differ by a factor of at most {MAX_SIZE_RATIO}"))
        .fix(format!("lengths are in metres; a mesh in another unit takes scale = {scale}"));
    found.diagnostics.push(diagnostic);
}

/// Reports positions of start, way and goal that no finger can reach whatever its joints do (`P302`).
pub(super) fn check_reach(hand: &SceneHand, object: &Object, task: &Task, root: &mut Table, found: &mut Found) {
    let query = task.query(0);
    let object_reach = object.shape.reach_from(&Point::origin());
    let slack = task.position_within * 2.0;
    let is_goal_fixed = matches!(task.goal, Goal::Pose(_))
        || (task.start_orientation == StartOrientation::Given && task.open_start.is_none());
    let mut poses = if task.open_start.is_some() { Vec::new() } else { vec![("start", *query.start())] };
    poses.extend(query.way().iter().take(task.way.len()).map(|pose| ("way", *pose)));
    poses.push(("goal", *query.goal()));
    for (key, pose) in poses {
        if key != "start" && !is_goal_fixed {
            continue;
        }
        let Some((distance, reach)) = beyond_reach(hand, &pose, object_reach + slack) else { continue };
        // Without a start the object stands where the scene has it.
        let instead = if key == "start" { "object" } else { key };
        let Some(entry) = root.optional(key).or_else(|| root.optional(instead)) else { continue };
        let p = pose.translation.vector;
        let mut diagnostic = entry
            .error("P302", found, format!("position {} is {} m from the hand", list(p), shown(distance, 3)))
            .expected(format!("at most {reach:.3} m, the reach of its fingers and the size of the object"));
        if distance / 1000.0 < reach {
            diagnostic =
                diagnostic.fix(format!("positions are in metres: {} if these were millimetres", list(p / 1000.0)));
        }
        found.diagnostics.push(diagnostic);
        // One cause: the goal follows the start.
        return;
    }
}

/// Reports given contacts that do not lie on the object's surface (`P304`), with distance and side.
pub(super) fn check_contacts(hand: &Hand, object: &Object, task: &Task, root: &mut Table, found: &mut Found) {
    for (key, grasp) in [("start", &task.start_grasp), ("goal", &task.goal_grasp)] {
        let GraspRequest::Contacts(points) = grasp else { continue };
        let Some(entry) = root.optional(key) else { continue };
        for (finger, point) in hand.fingers.iter().zip(points) {
            let distance = object.surface.signed_distance(point);
            if distance.abs() <= GRASP_TOLERANCE {
                continue;
            }
            let side = if distance > 0.0 { "outside" } else { "inside" };
            let nearest = object.surface.project(point).point_in_object;
            let problem = format!(
                "contact of finger \"{}\" is {:.2} mm {side} the object's surface",
                finger.name,
                distance.abs() * 1000.0
            );
            let diagnostic = entry
                .error("P304", found, problem)
                .expected(format!("a point of the surface within {} mm", GRASP_TOLERANCE * 1000.0))
                .fix(format!("the nearest point is [{:.6}, {:.6}, {:.6}]", nearest.x, nearest.y, nearest.z));
            found.diagnostics.push(diagnostic);
        }
    }
}

/// Distance of the object from the nearest finger base, and the reach, when no finger can touch the object there.
fn beyond_reach(placed: &SceneHand, pose: &Pose, object_reach: f64) -> Option<(f64, f64)> {
    let hand = &placed.hand;
    let position = placed.world_from_hand.inverse_transform_point(&Point::from(pose.translation.vector));
    let mut nearest: Option<(f64, f64)> = None;
    for finger in &hand.fingers {
        let Some(first) = finger.chain.joints.first() else { continue };
        let base = Point::from(first.parent_from_joint.translation.vector);
        let reach = finger_reach(finger) + object_reach;
        let distance = (position - base).norm();
        if distance <= reach {
            return None;
        }
        if nearest.is_none_or(|(other, _)| distance < other) {
            nearest = Some((distance, reach));
        }
    }
    nearest
}

/// Upper bound of the distance of the tip's contact from the first joint, whatever the joints do, in metres.
fn finger_reach(finger: &regrasp_robot::Finger) -> f64 {
    let chain = &finger.chain;
    let links: f64 = chain.joints.iter().skip(1).map(|joint| joint.parent_from_joint.translation.vector.norm()).sum();
    let slides: f64 = chain
        .joints
        .iter()
        .filter(|joint| joint.motion == regrasp_robot::JointMotion::Slide)
        .map(|joint| {
            let [lower, upper] = joint.range([&chain.lower, &chain.upper]);
            lower.abs().max(upper.abs())
        })
        .sum();
    links + slides + finger.tip.center_in_body.coords.norm() + finger.tip.radius()
}

/// Largest distance between two of: finger bases, fingertips at rest, palm shapes that move with the base; in metres.
pub(super) fn size_of(hand: &Hand) -> f64 {
    let to_base = hand.robot.moving_joints_to(hand.base);
    let moves_with_base = |link| hand.robot.moving_joints_to(link).starts_with(&to_base);
    let mut points = Vec::new();
    for finger in &hand.fingers {
        points.extend(finger.chain.joints.first().map(|joint| Point::from(joint.parent_from_joint.translation.vector)));
        points.push(finger.chain.tip(&finger.rest, &finger.tip.center_in_body));
    }
    for shape in hand.palm.iter().filter(|shape| moves_with_base(shape.link)) {
        let (low, high) = shape.placed.shape.bounds();
        points.extend([low, high].map(|corner| shape.placed.parent_from_shape * corner));
    }
    let pairs = points.iter().flat_map(|a| points.iter().map(move |b| (a - b).norm()));
    pairs.fold(0.0, f64::max)
}
