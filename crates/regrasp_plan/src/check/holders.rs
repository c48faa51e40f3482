//! Whose plan it is, and who holds the object: found from the contacts, never taken from the plan's word.

use crate::check::Log;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::plan::{Plan, Segment};
use regrasp_scene::{Manipulation, Query, Scene, State};

/// The hand and the object that the plan is about: those of the query where there is one, else those that the plan names.
///
/// Err with a violation: the plan names others than the query, or some that the scene does not have.
pub fn manipulation<'a>(
    scene: &'a Scene,
    state: &'a State,
    query: Option<&Query>,
    plan: &Plan,
) -> Result<Manipulation<'a>, Violation> {
    let wrong = |what: &str, known: &[&str]| {
        let message = format!("the plan's {what} is not the one asked for: {}", known.join(", "));
        Violation::new(Kind::WrongScene, message)
    };
    let hands: Vec<&str> = scene.hands.iter().map(|hand| hand.name.as_str()).collect();
    let objects: Vec<&str> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    let Some(query) = query else {
        let hand_index = scene.hand_named(&plan.hand).ok_or_else(|| wrong("hand", &hands))?;
        let object_index = object_of(scene, plan).ok_or_else(|| wrong("object", &objects))?;
        return Ok(Manipulation { scene, state, hand_index, object_index });
    };
    if query.is_of_robot() {
        return Err(wrong("task", &[query.task()]));
    }
    let task = Manipulation::of(scene, state, query);
    if plan.query != query.name() {
        return Err(wrong("query", &[query.name()]));
    }
    if plan.hand != hands[task.hand_index] {
        return Err(wrong("hand", &[hands[task.hand_index]]));
    }
    if object_of(scene, plan) != Some(task.object_index) {
        return Err(wrong("object", &[objects[task.object_index]]));
    }
    Ok(task)
}

/// The object that the plan names. Plans of version 2 name none: the only one, then.
fn object_of(scene: &Scene, plan: &Plan) -> Option<usize> {
    match (plan.object.as_str(), scene.objects.len()) {
        ("", 1) => Some(0),
        (name, _) => scene.object_named(name),
    }
}

/// Who holds the object in every segment: the hand, where some finger of it touches the object at every waypoint. The plan has to
/// say the same, and somebody has to hold it.
pub fn check_holders(plan: &Plan, log: &mut Log) {
    for (s, segment) in plan.segments.iter().enumerate() {
        let found: Vec<&str> = if is_held(segment) { vec![&plan.hand] } else { Vec::new() };
        let message = if segment.held_by != found {
            format!(
                "the plan says that the object is held by [{}]; by its contacts it is held by [{}]",
                segment.held_by.join(", "),
                found.join(", ")
            )
        } else if found.is_empty() {
            "nobody holds the object: at some waypoint no finger touches it".to_owned()
        } else {
            continue;
        };
        log.push(Violation::new(Kind::WrongHolder, message).when(Moment::at(s, 0)).subjects([plan.object.as_str()]));
    }
}

/// True where at every waypoint some finger touches the object.
fn is_held(segment: &Segment) -> bool {
    segment.waypoints.iter().all(|waypoint| waypoint.contacts.iter().any(crate::plan::ContactState::holds))
}
