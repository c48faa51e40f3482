//! Tasks of kind `pick_and_place`, and the lists of grasps that objects name.

use super::files::Files;
use super::motion::{Bodies, posture, robot_of};
use super::named::which;
use super::standing::Ground;
use super::task::pose_or_turn;
use crate::pick_and_place::{GraspFile, PickAndPlaceQuery};
use crate::scene::SceneHand;
use regrasp_base::toml_table::{Entry, Found, Table, suggestion};

/// Reads `robot`, `object`, `start`, `goal` and `end` of a task.
///
/// Errors: names that the scene does not have (`S120`), joints outside their limits (`P303`), a robot that carries no hand (`S106`), a
/// turn beyond half a turn (`S107`), an object that does not stand (`P306`) or stands in something (`P307`).
pub(super) fn pick_and_place(
    table: &mut Table,
    name: String,
    bodies: &Bodies,
    found: &mut Found,
) -> Option<PickAndPlaceQuery> {
    let [goal, start, end, set_down] = ["goal", "start", "end", "set_down"].map(|key| table.optional(key));
    let set_down = set_down.and_then(|entry| entry.boolean(found)).unwrap_or(false);
    let objects: Vec<&str> = bodies.objects.iter().map(|(object, _)| object.name.as_str()).collect();
    let object = which(table, "object", &objects, found);
    let (index, robot) = robot_of(table, bodies, found)?;
    if bodies.hands.iter().all(|hand| hand.carrier.is_none_or(|carrier| carrier.robot != index)) {
        let problem = format!("asks robot \"{}\" to take an object, and it carries no hand", robot.name);
        let diagnostic = table.error("S106", found, problem);
        found.diagnostics.push(diagnostic.fix("name a hand file in [[arms]] of the robot file"));
        return None;
    }
    let start = match start {
        Some(entry) => posture(&entry, robot, robot.layout.rest(), found),
        None => Some(robot.layout.rest()),
    };
    let end = match end {
        Some(entry) => posture(&entry, robot, start.clone().unwrap_or_else(|| robot.layout.rest()), found),
        None => start.clone(),
    };
    let Some(goal) = goal else {
        let fix =
            "add goal = { position = [x, y, z] }, or { turn = { axis = \"z\", angle_deg = 90 }, move = [x, y, z] }";
        let diagnostic = table.error("S102", found, "has no `goal`").fix(fix);
        found.diagnostics.push(diagnostic);
        return None;
    };
    let mut inside = goal.table(found)?;
    let asked = pose_or_turn(&mut inside, found);
    inside.finish(found);
    let (object, asked) = (object?, asked?);
    if asked.n_legs() > 1 {
        let diagnostic = goal.error("S107", found, "turns by more than 180 degrees, which is no single pose");
        found.diagnostics.push(diagnostic.expected("a turn of at most 180 degrees as seen from the start"));
        return None;
    }
    let ground = Ground::of(bodies, object, set_down);
    let world_from_object_start = ground.stand("start", &bodies.objects[object].1, &table.span, found);
    let seen_from = world_from_object_start.unwrap_or(bodies.objects[object].1);
    let world_from_object_goal = crate::goal::poses_from(&seen_from, &[], &asked).1;
    let world_from_object_goal = ground.stand("goal", &world_from_object_goal, &goal.span, found);
    let (world_from_object_start, world_from_object_goal) = (world_from_object_start?, world_from_object_goal?);
    Some(PickAndPlaceQuery {
        name,
        robot: index,
        object,
        world_from_object_start,
        world_from_object_goal,
        start: start?,
        end: end?,
    })
}

/// Reads `grasps = { HAND = "grasps.json" }` of an object. Every file that is named has to be there.
///
/// Errors: a hand that the scene does not have or that no robot carries (`S120`), a file that is not found (`S110`).
pub(super) fn grasp_files(
    entry: &Entry,
    object: usize,
    hands: &[SceneHand],
    files: &mut Files,
    found: &mut Found,
) -> Option<Vec<GraspFile>> {
    let mut named = Vec::new();
    for (name, value) in entry.table(found)?.all() {
        let Some(hand) = hands.iter().position(|hand| hand.name == name) else {
            let known = || hands.iter().map(|hand| hand.name.as_str());
            let problem = format!("is not a hand of the scene{}", suggestion(name, known()));
            let diagnostic = value.error("S120", found, problem).expected(known().collect::<Vec<_>>().join(", "));
            found.diagnostics.push(diagnostic);
            continue;
        };
        if hands[hand].carrier.is_none() {
            let carried = hands.iter().filter(|hand| hand.carrier.is_some()).map(|hand| hand.name.as_str());
            let diagnostic = value
                .error("S120", found, "is a hand that no robot carries")
                .expected(format!("a hand of the robot: {}", carried.collect::<Vec<_>>().join(", ")));
            found.diagnostics.push(diagnostic);
            continue;
        }
        let Some(path) = files.locate(&value, found) else { continue };
        let file = value.text(found)?.to_owned();
        match files.options.read(&path) {
            Ok(bytes) => files.record("grasps", file.clone(), &path, &bytes),
            Err(error) => found.diagnostics.extend(error),
        }
        named.push(GraspFile { object, hand, name: file, path });
    }
    named.sort_by_key(|file| file.hand);
    Some(named)
}
