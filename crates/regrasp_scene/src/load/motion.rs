//! Tasks of kind `motion`: a robot goes from joints to joints, or to poses of its wrists.

use super::named::which;
use super::pose;
use crate::gravity::Gravity;
use crate::motion::{CarriedObject, Holder, MotionGoal, MotionQuery, WristGoal};
use crate::object::Object;
use crate::scene::{Obstacle, SceneHand, Support};
use regrasp_base::diagnostic::number;
use regrasp_base::toml_table::{Entry, Found, Table, suggestion};
use regrasp_geometry::Pose;
use regrasp_robot::Manipulator;

/// Coordinates that it takes to reach any pose.
const DEGREES_OF_A_POSE: usize = 6;
/// A sum of joints may be this far beyond its limits: rounding.
const LIMIT_ROUNDING: f64 = 1e-9;

/// What a task of kind `motion` is about.
pub(super) struct Bodies<'a> {
    /// The robots of the scene.
    pub robots: &'a [Manipulator],
    /// Its hands.
    pub hands: &'a [SceneHand],
    /// Its objects, each with the pose at which it rests.
    pub objects: &'a [(Object, Pose)],
    /// What objects may stand on.
    pub supports: &'a [Support],
    /// What nothing may touch.
    pub obstacles: &'a [Obstacle],
    /// Which way things fall.
    pub gravity: Gravity,
}

/// Reads `robot`, `start`, `goal` and `carried` of a task.
///
/// Errors: names that the scene does not have (`S120`), joints outside their limits (`P303`), neither or both of `joints` and `wrists`
/// (`S106`), an arm named twice (`S112`), an arm that too few joints move (`P305`).
pub(super) fn motion(table: &mut Table, name: String, bodies: &Bodies, found: &mut Found) -> Option<MotionQuery> {
    let [start, goal, carried] = ["start", "goal", "carried"].map(|key| table.optional(key));
    let (index, robot) = robot_of(table, bodies, found)?;
    let start = match start {
        Some(entry) => posture(&entry, robot, robot.layout.rest(), found),
        None => Some(robot.layout.rest()),
    };
    let Some(goal) = goal else {
        let fix = "add goal = { joints = { joint = value } } or { wrists = [{ arm, position, quat_xyzw }] }";
        let diagnostic = table.error("S102", found, "has no `goal`").fix(fix);
        found.diagnostics.push(diagnostic);
        return None;
    };
    let goal = read_goal(&goal, robot, start.clone(), found);
    let carried = match carried {
        Some(entry) => read_carried(&entry, (index, robot), bodies, found),
        None => Some(Vec::new()),
    };
    Some(MotionQuery { name, robot: index, start: start?, goal: goal?, carried: carried? })
}

/// The robot that a task is about: the one it names, else the first. Errors: none there (`S106`), unknown (`S120`).
pub(super) fn robot_of<'a>(
    table: &mut Table,
    bodies: &Bodies<'a>,
    found: &mut Found,
) -> Option<(usize, &'a Manipulator)> {
    let named = table.optional("robot");
    if bodies.robots.is_empty() {
        let diagnostic = table.error("S106", found, "needs a robot, and the scene has none");
        found.diagnostics.push(diagnostic.fix("add [robot] with file = \"robot.toml\""));
        return None;
    }
    let names: Vec<&str> = bodies.robots.iter().map(|robot| robot.name.as_str()).collect();
    let index = match &named {
        Some(_) => which(table, "robot", &names, found)?,
        None => 0,
    };
    Some((index, &bodies.robots[index]))
}

/// `{ joints = { joint = value } }`; joints left out keep the value in `before`. Errors: as [`joint_values`].
pub(super) fn posture(entry: &Entry, robot: &Manipulator, before: Vec<f64>, found: &mut Found) -> Option<Vec<f64>> {
    let mut inside = entry.table(found)?;
    let joints = inside.optional("joints");
    inside.finish(found);
    match joints {
        Some(entry) => joint_values(&entry, robot, before, found),
        None => Some(before),
    }
}

/// Values of coordinates by name of joint; those left out keep the value in `posture`.
///
/// Errors: a joint that is no coordinate (`S120`), limits, those of joints that follow too (`P303`).
fn joint_values(entry: &Entry, robot: &Manipulator, posture: Vec<f64>, found: &mut Found) -> Option<Vec<f64>> {
    let layout = &robot.layout;
    let (mut values, mut is_good, mut named) = (posture, true, Vec::new());
    for (name, value) in entry.table(found)?.all() {
        let Some(k) = layout.index_of(name) else {
            is_good = false;
            if found.diagnostics.counted_only() {
                continue;
            }
            let names = layout.names();
            let follows = robot.robot.joint_named(name).is_some_and(|id| robot.robot.joints[id.0].coupling.is_some());
            let problem = match follows {
                true => "follows other joints, so that it has no value of its own".to_owned(),
                false => format!(
                    "is not a joint of the robot \"{}\" that moves on its own{}",
                    robot.name,
                    suggestion(name, names.iter().map(String::as_str))
                ),
            };
            let diagnostic = value.error("S120", found, problem).expected(names.join(", "));
            found.diagnostics.push(diagnostic);
            continue;
        };
        let Some(position) = value.number(found) else {
            is_good = false;
            continue;
        };
        let coordinate = &layout.coordinates[k];
        if position < coordinate.lower || position > coordinate.upper {
            let problem = format!("is {}, outside the joint's limits", number(position));
            let expected = format!("{} to {} (radians or metres)", number(coordinate.lower), number(coordinate.upper));
            found.diagnostics.push(value.error("P303", found, problem).expected(expected));
            is_good = false;
        }
        values[k] = position;
        named.push(k);
    }
    if !is_good {
        return None;
    }
    // A joint on another joint's motor goes along, unless it has a value of its own here.
    for (follower, coupling) in &layout.ties {
        if !named.contains(follower) {
            values[*follower] = coupling.position(|leader| values[leader]);
        }
    }
    for limit in layout.linear_limits.iter().filter(|limit| limit.room(&values) < -LIMIT_ROUNDING) {
        let problem = format!("takes \"{}\", which follows several joints, outside its limits", limit.joint);
        let diagnostic = entry.error("P303", found, problem);
        let expected = format!("a sum from {} to {}", number(limit.lower), number(limit.upper));
        found.diagnostics.push(diagnostic.expected(expected));
        is_good = false;
    }
    is_good.then_some(values)
}

fn read_goal(entry: &Entry, robot: &Manipulator, start: Option<Vec<f64>>, found: &mut Found) -> Option<MotionGoal> {
    let mut table = entry.table(found)?;
    let kinds = table.present(&["joints", "wrists"]);
    table.finish(found);
    let [kind] = kinds.as_slice() else {
        let problem = format!("says {} of joints and wrists", if kinds.is_empty() { "neither" } else { "both" });
        let expected = "{ joints = { joint = value } } or { wrists = [{ arm, position, quat_xyzw }] }";
        found.diagnostics.push(entry.error("S106", found, problem).expected(expected));
        return None;
    };
    if kind.name.ends_with("joints") {
        let posture = start.unwrap_or_else(|| robot.layout.rest());
        return joint_values(kind, robot, posture, found).map(MotionGoal::Joints);
    }
    let arms: Vec<&str> = robot.arms.iter().map(|arm| arm.name.as_str()).collect();
    if arms.is_empty() {
        found.diagnostics.push(kind.error("S106", found, "asks for a wrist of a robot without arms"));
        return None;
    }
    let mut wrists: Vec<WristGoal> = Vec::new();
    for entry in kind.entries(found, "tables with arm, position and quat_xyzw")? {
        let mut table = entry.table(found)?;
        let arm = which(&mut table, "arm", &arms, found);
        let pose = pose::pose(&mut table, found);
        table.finish(found);
        let (arm, world_from_mount) = (arm?, pose?);
        let n_joints = robot.coordinates_above(robot.arms[arm].mount).len();
        if wrists.iter().any(|known| known.arm == arm) {
            let problem = format!("asks for the wrist of arm \"{}\" again", arms[arm]);
            found.diagnostics.push(entry.error("S112", found, problem).expected("each arm once"));
        }
        if n_joints < DEGREES_OF_A_POSE {
            let problem = format!("asks for a pose of arm \"{}\", which only {n_joints} joints move", arms[arm]);
            let diagnostic = entry.error("P305", found, problem).expected("an arm that six joints or more move");
            found.diagnostics.push(diagnostic.fix("give the goal by joints"));
        }
        wrists.push(WristGoal { arm, world_from_mount });
    }
    if wrists.is_empty() {
        found.diagnostics.push(kind.error("S102", found, "names no wrist").fix("add { arm, position, quat_xyzw }"));
    }
    found.diagnostics.is_empty().then_some(MotionGoal::Wrists(wrists))
}

/// `carried`: which objects go with the robot, and what holds each.
fn read_carried(
    entry: &Entry,
    (index, robot): (usize, &Manipulator),
    bodies: &Bodies,
    found: &mut Found,
) -> Option<Vec<CarriedObject>> {
    let objects: Vec<&str> = bodies.objects.iter().map(|(object, _)| object.name.as_str()).collect();
    let hands: Vec<&str> = bodies.hands.iter().map(|hand| hand.name.as_str()).collect();
    let arms: Vec<&str> = robot.arms.iter().map(|arm| arm.name.as_str()).collect();
    let mut carried: Vec<CarriedObject> = Vec::new();
    for entry in entry.entries(found, "tables with object and hand")? {
        let mut table = entry.table(found)?;
        let object = named(&mut table, "object", &objects, found);
        let says_pose = !table.present(&["position"]).is_empty() || !table.present(&pose::ORIENTATIONS).is_empty();
        let pose = if says_pose { Some(pose::pose(&mut table, found)?) } else { None };
        let holders = table.present(&["hand", "arm"]);
        let holder = match holders.as_slice() {
            [one] if one.name.ends_with("hand") => named(&mut table, "hand", &hands, found).map(Holder::Hand),
            [_] => named(&mut table, "arm", &arms, found).map(Holder::Arm),
            _ => {
                let problem = format!("says {} of hand and arm", if holders.is_empty() { "neither" } else { "both" });
                let expected = "hand = NAME, or arm = NAME for an arm without a hand";
                found.diagnostics.push(entry.error("S106", found, problem).expected(expected));
                None
            }
        };
        table.finish(found);
        let (object, holder) = (object?, holder?);
        let fault = match holder {
            Holder::Hand(hand) if bodies.hands[hand].carrier.is_none_or(|carrier| carrier.robot != index) => {
                Some(("S120", format!("names hand \"{}\", which the robot does not carry", hands[hand])))
            }
            Holder::Arm(arm) if robot.hands.iter().any(|hand| hand.arm == Some(arm)) => {
                Some(("S106", format!("names arm \"{}\", which carries a hand: name the hand", arms[arm])))
            }
            Holder::Arm(arm) if hands.contains(&arms[arm]) => {
                Some(("S112", format!("names arm \"{}\", and a hand of the scene has that name too", arms[arm])))
            }
            _ if carried.iter().any(|known| known.object == object) => {
                Some(("S112", format!("names object \"{}\" again", objects[object])))
            }
            _ => None,
        };
        if let Some((code, problem)) = fault {
            found.diagnostics.push(entry.error(code, found, problem));
            continue;
        }
        let world_from_object = pose.unwrap_or(bodies.objects[object].1);
        carried.push(CarriedObject { object, holder, world_from_object });
    }
    Some(carried)
}

/// The one of `names` that `key` says. Errors: missing (`S102`), unknown (`S120`).
fn named(table: &mut Table, key: &'static str, names: &[&str], found: &mut Found) -> Option<usize> {
    let entry = table.required(found, key, &format!("add {key} = NAME"))?;
    let name = entry.text(found)?;
    let known = names.iter().position(|known| *known == name);
    if known.is_none() {
        let hint = suggestion(name, names.iter().copied());
        let problem = format!("is \"{name}\", which the scene does not have{hint}");
        found.diagnostics.push(entry.error("S120", found, problem).expected(names.join(", ")));
    }
    known
}
