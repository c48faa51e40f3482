//! The bodies and tasks of a scene file, by the two versions of the format.

use super::files::Files;
use super::named::which;
use super::object::{self, Hands, Names};
use super::task::{self, Heading, Task, TaskKind};
use super::{gravity, hand, limits, motion, overlap, pick_and_place, pose, robot, units};
use crate::gravity::Gravity;
use crate::limits::Limits;
use crate::object::Object;
use crate::pick_and_place::GraspFile;
use crate::scene::{Obstacle, SceneHand, Support};
use regrasp_base::toml_table::{Entry, Found, Table, one_of};
use regrasp_geometry::Pose;
use regrasp_robot::Manipulator;

/// What a scene file says, read.
pub(super) struct Parts {
    pub robots: Vec<Manipulator>,
    pub hands: Vec<SceneHand>,
    pub objects: Vec<Object>,
    pub world_from_objects: Vec<Pose>,
    pub grasp_files: Vec<GraspFile>,
    pub supports: Vec<Support>,
    pub obstacles: Vec<Obstacle>,
    pub gravity: Option<Gravity>,
    pub limits: Limits,
    pub tasks: Vec<Task>,
}

/// Version 1: `[hand]`, `[object]`, `[[obstacles]]` and one task.
pub(super) fn one_hand(root: &mut Table, files: &mut Files, found: &mut Found) -> Option<Parts> {
    let kind = task_kind(root, &[TaskKind::InHand, TaskKind::Tracking], found);
    let hand = root
        .required(found, "hand", "add [hand] with file = \"hand.toml\"")
        .and_then(|entry| entry.table(found))
        .and_then(|table| hand::hand(table, "hand".to_owned(), files, found));
    let gravity = gravity::gravity(root, hand.as_ref().map(|hand| &hand.world_from_hand), found);
    let limits = limits::limits(root, found);
    let fix = "add [object] with name, a shape such as sphere = { radius = 0.03 }, mass and friction";
    let object_entry = root.required(found, "object", fix);
    let object = object_entry
        .as_ref()
        .and_then(|entry| entry.table(found))
        .and_then(|table| object::object(table, Hands::of(&hand), files, found));
    let obstacles = object::fixed_bodies(root, "obstacles", &mut Names::of("body of the scene"), files, found);
    let inner = hand.as_ref().map(|hand| &hand.hand);
    let kind = kind.unwrap_or(TaskKind::InHand);
    let start = task::start(root, kind, inner, None, found);
    let heading = Heading { name: String::new(), kind, hand: 0, object: 0 };
    let task = task::task(root, heading, start, inner, found);
    if let (Some(hand), Some(object), Some(entry)) = (&hand, &object, &object_entry) {
        units::check_sizes(&hand.hand, object, entry, found);
        if let Some(task) = &task {
            units::check_reach(hand, object, task, root, found);
            units::check_contacts(&hand.hand, object, task, root, found);
        }
    }
    let task = task?;
    Some(Parts {
        robots: Vec::new(),
        hands: vec![hand?],
        objects: vec![object?],
        world_from_objects: vec![task.world_from_object_start],
        grasp_files: Vec::new(),
        supports: Vec::new(),
        obstacles,
        gravity,
        limits,
        tasks: vec![task],
    })
}

/// Version 2: `[robot]`, `[[objects]]`, `[[supports]]`, `[[obstacles]]`, `[[tasks]]`.
pub(super) fn several(root: &mut Table, files: &mut Files, found: &mut Found) -> Option<Parts> {
    let mut names = Names::of("body of the scene");
    let needed = Needed::of(root);
    let carried = robot_and_hands(root, needed, &mut names, files, found);
    let gravity = gravity::gravity(root, Some(&Pose::identity()), found);
    let limits = limits::limits(root, found);
    let hands = carried.as_ref().map_or(&[][..], |(_, hands)| hands);
    let objects = objects(root, needed, &mut names, hands, files, found);
    let supports = object::fixed_bodies(root, "supports", &mut names, files, found);
    let supports: Vec<Support> = supports.into_iter().map(|body| Support { body }).collect();
    let obstacles = object::fixed_bodies(root, "obstacles", &mut names, files, found);
    let obstacle_entries = root.optional("obstacles").and_then(|entry| entry.as_list()).unwrap_or_default();
    let bodies = carried.zip(objects);
    let fix = "add [[tasks]] with task = \"in_hand\", hand, object and goal";
    let entries = root.required(found, "tasks", fix)?.entries(found, "tables [[tasks]]")?;
    let ((robots, hands), (mut objects, grasp_files)) = bodies?;
    let mut task_names = Names::of("task");
    let mut tasks = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        let Some(mut table) = entry.table(found) else { continue };
        let default_name = if entries.len() == 1 { String::new() } else { format!("task_{}", index + 1) };
        let bodies = motion::Bodies {
            robots: &robots,
            hands: &hands,
            objects: &objects,
            supports: &supports,
            obstacles: &obstacles,
            gravity: gravity.unwrap_or_default(),
        };
        let task = task_of(&mut table, default_name, &bodies, found);
        table.finish(found);
        let Some(task) = task else { continue };
        task_names.add(&task.name, entry, found);
        if let Some(query) = task.pick_and_place() {
            // Where the task sets the object down is where it rests.
            objects[query.object].1 = query.world_from_object_start;
        }
        tasks.push(task);
    }
    if tasks.is_empty() && found.diagnostics.is_empty() {
        let diagnostic = root.error("S102", found, "asks for nothing").fix(fix);
        found.diagnostics.push(diagnostic);
    }
    if tasks.iter().any(|task| task.of_robot.as_ref().is_some_and(|query| query.as_pick_and_place().is_some())) {
        overlap::refuse_overlaps(&supports, &obstacles, &obstacle_entries, found);
    }
    let (objects, world_from_objects) = objects.into_iter().unzip();
    Some(Parts { robots, hands, objects, world_from_objects, grasp_files, supports, obstacles, gravity, limits, tasks })
}

/// Robots, and all hands: those that robots carry first.
type Carried = (Vec<Manipulator>, Vec<SceneHand>);

/// `[robot]`: a robot file with its hands, and hands that stand by themselves. None where one of them could not be read.
fn robot_and_hands(
    root: &mut Table,
    needed: Needed,
    names: &mut Names,
    files: &mut Files,
    found: &mut Found,
) -> Option<Carried> {
    let fix = "add [[robot.hands]] with name and file = \"hand.toml\", or [robot] with file = \"robot.toml\"";
    let mut table = root.required(found, "robot", fix)?.table(found)?;
    let (mut robots, mut hands) = (Vec::new(), Vec::new());
    if let Some(entry) = table.optional("file") {
        let (robot, carried) = robot::robot(&entry, &mut table, files, found)?;
        carried.iter().for_each(|hand| names.add(&hand.name, &entry, found));
        robots.push(robot);
        hands.extend(carried);
    }
    let entries = match table.optional("hands") {
        Some(entry) => entry.entries(found, "tables [[robot.hands]]"),
        None => Some(Vec::new()),
    };
    table.finish(found);
    for entry in &entries? {
        let Some(mut table) = entry.table(found) else { continue };
        let name = table.required(found, "name", "add name = \"right\"").and_then(|entry| entry.name(found));
        let Some(hand) = hand::hand(table, name.unwrap_or("hand").to_owned(), files, found) else { continue };
        names.add(&hand.name, entry, found);
        hands.push(hand);
    }
    if hands.is_empty() && (needed == Needed::HandAndObject || robots.is_empty()) && found.diagnostics.is_empty() {
        let diagnostic = root.error("S102", found, "has no hand").fix(fix);
        found.diagnostics.push(diagnostic);
    }
    found.diagnostics.is_empty().then_some((robots, hands))
}

/// Objects, each with the pose at which it rests, and lists of their grasps.
type PlacedObjects = (Vec<(Object, Pose)>, Vec<GraspFile>);

/// `[[objects]]`, each with the pose at which it rests. None where one of them could not be read.
fn objects(
    root: &mut Table,
    needed: Needed,
    names: &mut Names,
    hands: &[SceneHand],
    files: &mut Files,
    found: &mut Found,
) -> Option<PlacedObjects> {
    let fix = "add [[objects]] with name, a shape such as sphere = { radius = 0.03 }, mass, friction and position";
    let entry = match needed {
        Needed::HandAndObject => Some(root.required(found, "objects", fix)?),
        Needed::Robot => root.optional("objects"),
    };
    let Some(entry) = entry else { return Some((Vec::new(), Vec::new())) };
    let entries = entry.entries(found, "tables [[objects]]")?;
    let (mut objects, mut grasp_files) = (Vec::new(), Vec::new());
    for entry in &entries {
        let Some(mut table) = entry.table(found) else { continue };
        if table.required(found, "name", "add name = \"cube\"").is_none() {
            continue;
        }
        let pose = pose::pose(&mut table, found);
        if let Some(entry) = table.optional("grasps") {
            let named = pick_and_place::grasp_files(&entry, objects.len(), hands, files, found);
            grasp_files.extend(named.unwrap_or_default());
        }
        let Some(object) = object::object(table, Hands::of(hands), files, found) else { continue };
        names.add(&object.name, entry, found);
        objects.extend(pose.map(|pose| (object, pose)));
    }
    if objects.is_empty() && found.diagnostics.is_empty() {
        let diagnostic = root.error("S102", found, "has no object").fix(fix);
        found.diagnostics.push(diagnostic);
    }
    found.diagnostics.is_empty().then_some((objects, grasp_files))
}

/// Kinds of `[[tasks]]`.
const KINDS: [TaskKind; 4] = [TaskKind::InHand, TaskKind::Tracking, TaskKind::Motion, TaskKind::PickAndPlace];

/// One of `[[tasks]]`.
fn task_of(table: &mut Table, default_name: String, bodies: &motion::Bodies, found: &mut Found) -> Option<Task> {
    let (hands, objects) = (bodies.hands, bodies.objects);
    let known_kind = task_kind(table, &KINDS, found);
    let kind = known_kind.unwrap_or(TaskKind::InHand);
    let name = table.optional("name").map_or(Some(default_name), |entry| entry.name(found).map(str::to_owned));
    if kind == TaskKind::Motion {
        return motion::motion(table, name?, bodies, found).map(Task::of_motion);
    }
    if hands.is_empty() || objects.is_empty() {
        // Only where the kind of the task is not known: else hands and objects have been asked for.
        return None;
    }
    if kind == TaskKind::PickAndPlace {
        return pick_and_place::pick_and_place(table, name?, bodies, found).map(Task::of_pick_and_place);
    }
    let hand_names: Vec<&str> = hands.iter().map(|hand| hand.name.as_str()).collect();
    let object_names: Vec<&str> = objects.iter().map(|(object, _)| object.name.as_str()).collect();
    let hand = which(table, "hand", &hand_names, found);
    let object = which(table, "object", &object_names, found);
    // All keys are read whatever is unknown: none of them is then said not to exist.
    let resting = object.map_or(Pose::identity(), |object| objects[object].1);
    let inner = hand.map(|hand| &hands[hand].hand);
    let start = task::start(table, kind, inner, Some(resting), found);
    let is_known = known_kind.is_some() && name.is_some();
    let (name, indices) = (name.unwrap_or_default(), (hand.unwrap_or(0), object.unwrap_or(0)));
    let heading = Heading { name, kind, hand: indices.0, object: indices.1 };
    let task = task::task(table, heading, start, inner, found).filter(|_| is_known);
    let (placed, body) = (&hands[hand?], &objects[object?].0);
    let task = task?;
    if let Some(entry) = table.optional("object").or_else(|| table.optional("goal")) {
        units::check_sizes(&placed.hand, body, &entry, found);
    }
    units::check_reach(placed, body, &task, table, found);
    units::check_contacts(&placed.hand, body, &task, table, found);
    Some(task)
}

/// What the tasks of a scene cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Needed {
    /// A hand and an object.
    HandAndObject,
    /// A robot: all tasks are of kind `motion`.
    Robot,
}

impl Needed {
    /// Looks at the tasks without reading them.
    fn of(root: &mut Table) -> Self {
        let tasks = root.optional("tasks").and_then(|entry| entry.as_list()).unwrap_or_default();
        let is_motion = |entry: &Entry| entry.text_inside("task") == Some(TaskKind::Motion.name());
        if !tasks.is_empty() && tasks.iter().all(is_motion) { Needed::Robot } else { Needed::HandAndObject }
    }
}

/// `task`. Errors: missing (`S102`), another task (`S105`).
fn task_kind(table: &mut Table, kinds: &[TaskKind], found: &mut Found) -> Option<TaskKind> {
    let entry = table.required(found, "task", "add task = \"in_hand\"")?;
    let text = entry.text(found)?;
    let known = kinds.iter().copied().find(|kind| kind.name() == text);
    if known.is_none() {
        let names: Vec<String> = kinds.iter().map(|kind| format!("\"{}\"", kind.name())).collect();
        let expected = format!("{}, the tasks that this version plans", one_of(&names));
        let diagnostic = entry.error("S105", found, format!("is \"{text}\"")).expected(expected);
        found.diagnostics.push(diagnostic);
    }
    known
}
