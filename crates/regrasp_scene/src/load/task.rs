//! `[start]`, `[[way]]` and `[goal]`: what is asked, and how a seed resolves what the file leaves open.

use super::pose;
use crate::goal::{Goal, poses_from};
use crate::motion::{MOTION, MotionQuery};
use crate::pick_and_place::{PICK_AND_PLACE, PickAndPlaceQuery};
use crate::query::{GraspRequest, IN_HAND, InHandQuery, Query, StartChoice, TRACKING, TrackingQuery};
use regrasp_base::Rng;
use regrasp_base::diagnostic::number;
use regrasp_base::toml_table::{Entry, Found, Table, suggestion};
use regrasp_geometry::frame::rotation_between;
use regrasp_geometry::{Point, Pose, Vector, pose_from};
use regrasp_robot::Hand;

/// A start position may be drawn from a ball of at most this radius, in metres.
const MAX_POSITION_WITHIN: f64 = 1.0;
/// Start and goal nearer than this are the same, in metres.
const SAME_POSITION: f64 = 1e-9;
/// Start and goal nearer than this are the same, in radians.
const SAME_ANGLE: f64 = 1e-9;
/// Most way poses that a file may give.
const MAX_WAY: usize = 1000;

/// Orientation at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartOrientation {
    /// As the file says.
    Given,
    /// Drawn uniformly over all rotations, by seed; then the file's orientation is applied first.
    Random,
}

/// What of the start pose the planner chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OpenStart {
    /// The position; the orientation is the file's.
    Position,
    /// Position and orientation.
    Pose,
}

/// What kind of goal a task has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TaskKind {
    /// A pose.
    InHand,
    /// An orientation.
    Tracking,
    /// Of a whole robot.
    Motion,
    /// Of a whole robot, with an object.
    PickAndPlace,
}

impl TaskKind {
    /// As scene and plan files spell it.
    pub fn name(self) -> &'static str {
        match self {
            TaskKind::InHand => IN_HAND,
            TaskKind::Tracking => TRACKING,
            TaskKind::Motion => MOTION,
            TaskKind::PickAndPlace => PICK_AND_PLACE,
        }
    }
}

/// A task of a scene file, before a seed resolves its randomness.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Its name, unique among the tasks of the scene; empty where the file has only one.
    pub name: String,
    /// The hand, by its index in `Scene::hands`.
    pub hand: usize,
    /// The object, by its index in `Scene::objects`.
    pub object: usize,
    /// Its kind.
    pub(super) kind: TaskKind,
    /// Object pose at the start, before the draw. Where the planner chooses the position it is the origin of the hand's frame.
    pub world_from_object_start: Pose,
    /// What of the start pose the planner chooses; none where the file gives all of it.
    pub open_start: Option<OpenStart>,
    /// The start position is drawn uniformly from the ball of this radius, in metres; 0 for none.
    pub position_within: f64,
    /// Start orientation.
    pub start_orientation: StartOrientation,
    /// Grasp at the start.
    pub start_grasp: GraspRequest,
    /// Poses that the object has to pass, in order; without those that break up a goal beyond half a turn.
    pub way: Vec<Goal>,
    /// Where the object has to go.
    pub goal: Goal,
    /// Grasp at the goal.
    pub goal_grasp: GraspRequest,
    /// Of a task of a whole robot what it asks for; all other fields but the name are then empty.
    pub of_robot: Option<Box<Query>>,
}

impl Task {
    /// The motion that it asks for, if it is of that kind.
    pub fn motion(&self) -> Option<&MotionQuery> {
        self.of_robot.as_ref().and_then(|query| query.as_motion())
    }

    /// The query of a task of kind `pick_and_place`.
    pub fn pick_and_place(&self) -> Option<&PickAndPlaceQuery> {
        self.of_robot.as_ref().and_then(|query| query.as_pick_and_place())
    }

    /// The query of `seed`: the same on every machine and for every number of threads.
    pub fn query(&self, seed: u64) -> Query {
        if let Some(query) = &self.of_robot {
            return (**query).clone();
        }
        let mut start = self.world_from_object_start;
        if self.position_within > 0.0 {
            let mut rng = Rng::keyed(seed, "start_position", 0);
            let direction = Vector::from(rng.direction());
            // The cube root makes the draw uniform in the ball.
            start.translation.vector += direction * (self.position_within * rng.unit().cbrt());
        }
        if self.start_orientation == StartOrientation::Random {
            let drawn = Rng::keyed(seed, "start_orientation", 0).quat_xyzw();
            start.rotation = pose_from([0.0; 3], drawn).rotation * start.rotation;
        }
        let (way, goal) = poses_from(&start, &self.way, &self.goal);
        let (start_grasp, goal_grasp) = (self.start_grasp.clone(), self.goal_grasp.clone());
        let (name, hand, object) = (self.name.clone(), self.hand, self.object);
        match self.kind {
            TaskKind::InHand => Query::InHand(InHandQuery {
                name,
                hand,
                object,
                world_from_object_start: start,
                world_from_object_way: way,
                world_from_object_goal: goal,
                start_grasp,
                goal_grasp,
                open_start: self.open_start.map(|what| {
                    let rotation = (what == OpenStart::Position).then_some(start.rotation);
                    StartChoice { rotation, way: self.way.clone(), goal: self.goal.clone() }
                }),
            }),
            TaskKind::Tracking | TaskKind::Motion | TaskKind::PickAndPlace => Query::Tracking(TrackingQuery {
                name,
                hand,
                object,
                world_from_object_start: start,
                world_from_object_goal: goal,
                start_grasp,
                goal_grasp,
            }),
        }
    }

    /// A task of kind `motion`.
    pub(super) fn of_motion(motion: MotionQuery) -> Self {
        Task::of_robot(TaskKind::Motion, Query::Motion(motion))
    }

    /// A task of kind `pick_and_place`.
    pub(super) fn of_pick_and_place(query: PickAndPlaceQuery) -> Self {
        Task::of_robot(TaskKind::PickAndPlace, Query::PickAndPlace(query))
    }

    fn of_robot(kind: TaskKind, query: Query) -> Self {
        Task {
            name: query.name().to_owned(),
            hand: 0,
            object: query.object(),
            kind,
            world_from_object_start: Pose::identity(),
            open_start: None,
            position_within: 0.0,
            start_orientation: StartOrientation::Given,
            start_grasp: GraspRequest::Automatic,
            way: Vec::new(),
            goal: Goal::Pose(Pose::identity()),
            goal_grasp: GraspRequest::Automatic,
            of_robot: Some(Box::new(query)),
        }
    }

    /// Name of what it asks for, as scene and plan files spell it.
    pub fn kind_name(&self) -> &'static str {
        self.kind.name()
    }
}

/// `[start]`, as far as the file says it.
pub(super) struct Start {
    pose: Option<Pose>,
    open: Option<OpenStart>,
    position_within: f64,
    orientation: StartOrientation,
    grasp: GraspRequest,
}

impl Start {
    /// An object that starts where it rests, in a grasp that the planner chooses.
    pub(super) fn at_rest(pose: Option<Pose>) -> Self {
        let (orientation, grasp) = (StartOrientation::Given, GraspRequest::Automatic);
        Start { pose, open: None, position_within: 0.0, orientation, grasp }
    }
}

/// Reads `[start]`. `hand` is none when the hand file was refused; then grasps are not looked into. Where `resting` is given the
/// object starts there unless the table says another pose.
pub(super) fn start(
    root: &mut Table,
    kind: TaskKind,
    hand: Option<&Hand>,
    resting: Option<Pose>,
    found: &mut Found,
) -> Option<Start> {
    let entry = match resting {
        Some(_) => root.optional("start"),
        None => Some(root.required(found, "start", "add [start] with position = [x, y, z]")?),
    };
    let Some(entry) = entry else { return Some(Start::at_rest(resting)) };
    let mut table = entry.table(found)?;
    let says_pose = !table.present(&["position", "quat_xyzw", "quat_wxyz", "rotation_vector"]).is_empty();
    let open = open_start(&mut table, kind, found);
    let pose = match open {
        Some(_) => pose::orientation(&mut table, found)
            .map(|rotation| Pose::from_parts(nalgebra::Translation3::identity(), rotation)),
        None if resting.is_some() && !says_pose => resting,
        None => pose::pose(&mut table, found),
    };
    let expected = format!("a radius from 0 to {MAX_POSITION_WITHIN} metres");
    let position_within = table
        .optional("position_within")
        .and_then(|entry| entry.number_that(found, &expected, |x| (0.0..=MAX_POSITION_WITHIN).contains(&x)));
    let is_random = table.optional("random_orientation").and_then(|entry| entry.boolean(found));
    let grasp = grasp(&mut table, hand, GraspEnd::Start, found);
    if open.is_some() {
        refuse_beside_open(&mut table, found);
    }
    table.finish(found);
    Some(Start {
        pose,
        open: match is_random {
            Some(true) => open.map(|_| OpenStart::Position),
            _ => open,
        },
        position_within: position_within.unwrap_or(0.0),
        orientation: if is_random == Some(true) { StartOrientation::Random } else { StartOrientation::Given },
        grasp,
    })
}

/// `position = "auto"`: the planner chooses it, and the orientation too where the file gives none.
fn open_start(table: &mut Table, kind: TaskKind, found: &mut Found) -> Option<OpenStart> {
    let position = table.optional("position").filter(|entry| entry.as_text().is_some())?;
    position.choice(found, &["auto"]);
    if kind == TaskKind::Tracking {
        let problem = "cannot be \"auto\": a task of kind \"tracking\" needs a start pose and a start grasp";
        found.diagnostics.push(position.error("S106", found, problem).fix("give the position, in metres"));
    }
    let says_orientation = !table.present(&pose::ORIENTATIONS).is_empty();
    Some(if says_orientation { OpenStart::Position } else { OpenStart::Pose })
}

/// Refuses what has no meaning where the planner chooses the position (`S106`).
fn refuse_beside_open(table: &mut Table, found: &mut Found) {
    for entry in table.present(&["position_within", "grasp"]) {
        if entry.name.ends_with("grasp") && entry.as_text() == Some("automatic") {
            continue;
        }
        let diagnostic = entry.error("S106", found, "cannot stand beside position = \"auto\"");
        found.diagnostics.push(diagnostic.fix("leave it out, or give the position"));
    }
}

/// Reads `[[way]]`. Errors: as for a goal, but a turn beyond half a turn (`S107`), and too many (`S107`).
fn way(root: &mut Table, found: &mut Found) -> Option<Vec<Goal>> {
    let Some(entry) = root.optional("way") else { return Some(Vec::new()) };
    let entries = entry.entries(found, "tables [[way]]")?;
    if entries.len() > MAX_WAY {
        let diagnostic = entry.error("S107", found, format!("has {} poses", entries.len()));
        found.diagnostics.push(diagnostic.expected(format!("at most {MAX_WAY}")));
        return None;
    }
    let mut poses = Vec::with_capacity(entries.len());
    for entry in &entries {
        let mut table = entry.table(found)?;
        let pose = pose_or_turn(&mut table, found);
        table.finish(found);
        if let Some(pose) = &pose
            && pose.n_legs() > 1
        {
            let diagnostic = entry.error("S107", found, "turns by more than 180 degrees, which is no single pose");
            found.diagnostics.push(diagnostic.expected("a turn of at most 180 degrees as seen from the start"));
            return None;
        }
        poses.push(pose);
    }
    poses.into_iter().collect()
}

/// A pose of the world, or a turn and displacement seen from the start. Errors: both (`S106`), neither (`S102`).
pub(super) fn pose_or_turn(table: &mut Table, found: &mut Found) -> Option<Goal> {
    let absolute = table.present(&["position", "quat_xyzw", "quat_wxyz", "rotation_vector"]);
    let relative = table.present(&["turn", "move"]);
    match (absolute.first(), relative.first()) {
        (Some(absolute), Some(relative)) => {
            let diagnostic = relative
                .error("S106", found, format!("cannot stand beside {}", absolute.name))
                .expected("either position and quat_xyzw, or turn and move");
            found.diagnostics.push(diagnostic);
            None
        }
        (None, None) => {
            let diagnostic = table.error("S102", found, "says neither a pose nor a turn").fix(POSE_FIX);
            found.diagnostics.push(diagnostic);
            None
        }
        (Some(_), None) => pose::pose(table, found).map(Goal::Pose),
        (None, Some(_)) => relative_goal(table, found),
    }
}

/// An orientation of the world, or a turn seen from the start. Errors: both (`S106`), neither (`S102`).
fn orientation_or_turn(table: &mut Table, found: &mut Found) -> Option<Goal> {
    let absolute = table.present(&pose::ORIENTATIONS);
    let relative = table.present(&["turn"]);
    match (absolute.first(), relative.first()) {
        (Some(absolute), Some(relative)) => {
            let diagnostic = relative
                .error("S106", found, format!("cannot stand beside {}", absolute.name))
                .expected("either rotation_vector or quat_xyzw, or turn");
            found.diagnostics.push(diagnostic);
            None
        }
        (None, None) => {
            let diagnostic = table.error("S102", found, "says neither an orientation nor a turn");
            let fix = "add turn = { axis = \"x\", angle_deg = 90 } or rotation_vector";
            found.diagnostics.push(diagnostic.fix(fix));
            None
        }
        (Some(_), None) => pose::orientation(table, found).map(Goal::Orientation),
        (None, Some(_)) => relative_goal(table, found),
    }
}

/// How to say a pose.
const POSE_FIX: &str = "add turn = { axis = \"x\", angle_deg = 90 } or position and quat_xyzw";

/// Whose task it is, and what it is called.
pub(super) struct Heading {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: TaskKind,
    /// Index of the hand.
    pub hand: usize,
    /// Index of the object.
    pub object: usize,
}

/// Reads `[[way]]` and `[goal]` and joins them with the start.
pub(super) fn task(
    root: &mut Table,
    heading: Heading,
    start: Option<Start>,
    hand: Option<&Hand>,
    found: &mut Found,
) -> Option<Task> {
    let kind = heading.kind;
    // Tracking knows no poses on the way: [[way]] is then a key that is not known.
    let way = if kind == TaskKind::InHand { way(root, found) } else { Some(Vec::new()) };
    let fix = "add [goal] with turn = { axis = \"x\", angle_deg = 90 } or position and quat_xyzw";
    let mut table = root.required(found, "goal", fix)?.table(found)?;
    let goal = match kind {
        TaskKind::InHand => pose_or_turn(&mut table, found),
        TaskKind::Tracking | TaskKind::Motion | TaskKind::PickAndPlace => orientation_or_turn(&mut table, found),
    };
    if let (Some(way), Some(goal)) = (&way, &goal)
        && !way.is_empty()
        && goal.n_legs() > 1
    {
        let diagnostic = table.error("S106", found, "turns by more than 180 degrees beside [[way]]");
        found
            .diagnostics
            .push(diagnostic.fix("give the last pose by a turn of at most 180 degrees, and the others in [[way]]"));
    }
    let goal_grasp = grasp(&mut table, hand, GraspEnd::Goal, found);
    let span = table.span.clone();
    table.finish(found);
    let (start, way, goal) = (start?, way?, goal?);
    let task = Task {
        name: heading.name,
        hand: heading.hand,
        object: heading.object,
        kind,
        world_from_object_start: start.pose?,
        open_start: start.open,
        position_within: start.position_within,
        start_orientation: start.orientation,
        start_grasp: start.grasp,
        way,
        goal,
        goal_grasp,
        of_robot: None,
    };
    if is_goal_start(&task) {
        found.note(&span, "the goal pose is the start pose: there is nothing to turn");
    }
    Some(task)
}

fn relative_goal(table: &mut Table, found: &mut Found) -> Option<Goal> {
    let turn = match table.optional("turn") {
        Some(entry) => pose::turn(&entry, found),
        None => Some((Vector::z_axis(), 0.0)),
    };
    let shift = match table.optional("move") {
        Some(entry) => entry.numbers::<3>(found).map(Vector::from),
        None => Some(Vector::zeros()),
    };
    let (axis, angle) = turn?;
    Some(Goal::Turn { axis, angle, shift: shift? })
}

fn is_goal_start(task: &Task) -> bool {
    let is_fixed = task.position_within == 0.0 && task.start_orientation == StartOrientation::Given;
    if !is_fixed && matches!(task.goal, Goal::Pose(_) | Goal::Orientation(_)) {
        return false;
    }
    let query = task.query(0);
    if !query.way().is_empty() {
        return false;
    }
    let (start, goal) = (query.start(), query.goal());
    (start.translation.vector - goal.translation.vector).norm() < SAME_POSITION
        && rotation_between(start, goal).norm() < SAME_ANGLE
}

/// Which grasp of a task it is.
#[derive(Clone, Copy, PartialEq)]
enum GraspEnd {
    /// Fingers may be free.
    Start,
    /// All fingers hold.
    Goal,
}

/// `grasp = "automatic"`, `{ joints = {...} }`, with `free = [...]` at the start, or `{ contacts = {...} }`.
fn grasp(table: &mut Table, hand: Option<&Hand>, end: GraspEnd, found: &mut Found) -> GraspRequest {
    let Some(entry) = table.optional("grasp") else { return GraspRequest::Automatic };
    if entry.as_text().is_some() {
        entry.choice(found, &["automatic"]);
        return GraspRequest::Automatic;
    }
    given_grasp(&entry, hand, end, found).unwrap_or(GraspRequest::Automatic)
}

fn given_grasp(entry: &Entry, hand: Option<&Hand>, end: GraspEnd, found: &mut Found) -> Option<GraspRequest> {
    let mut table = entry.table(found)?;
    let kinds = table.present(&["joints", "contacts"]);
    let has_joints = kinds.iter().any(|kind| kind.name.ends_with("joints"));
    // Contacts are those of fingers that hold, and so is every finger at the goal: there the key is unknown.
    let free = if end == GraspEnd::Start && has_joints { table.optional("free") } else { None };
    table.finish(found);
    let [kind] = kinds.as_slice() else {
        let diagnostic = entry
            .error(
                "S106",
                found,
                format!("says {} of joints and contacts", if kinds.is_empty() { "neither" } else { "both" }),
            )
            .expected("\"automatic\", { joints = { name = value } } or { contacts = { finger = [x, y, z] } }");
        found.diagnostics.push(diagnostic);
        return None;
    };
    let values = kind.table(found)?;
    let hand = hand?;
    if kind.name.ends_with("joints") {
        let joints = joint_values(&values, hand, true, found)?;
        let Some(free) = free else { return Some(GraspRequest::Joints(joints)) };
        free_fingers(&free, hand, found).map(|holds| GraspRequest::Posture { joints, holds })
    } else {
        contact_points(&values, hand, found).map(GraspRequest::Contacts)
    }
}

/// For every finger whether it holds, from a list of the names of those that are free.
fn free_fingers(entry: &Entry, hand: &Hand, found: &mut Found) -> Option<Vec<bool>> {
    let mut holds = vec![true; hand.fingers.len()];
    let mut is_good = true;
    for name in entry.entries(found, "names of fingers")? {
        let Some(text) = name.text(found) else {
            is_good = false;
            continue;
        };
        let names = || hand.fingers.iter().map(|finger| finger.name.as_str());
        if let Some(index) = names().position(|known| known == text) {
            holds[index] = false;
            continue;
        }
        is_good = false;
        let problem = format!("\"{text}\" is not a finger of the hand{}", suggestion(text, names()));
        let diagnostic = name.error("S120", found, problem).expected(names().collect::<Vec<_>>().join(", "));
        found.diagnostics.push(diagnostic);
    }
    is_good.then_some(holds)
}

/// Joint positions in the order of `Hand::joint_names`, from a table of names.
///
/// Errors: unknown joint (`S120`), outside limits (`P303`), and, where `all_needed`, missing joints (`S121`).
/// Joints that may be missing and are keep the value of `Finger::rest`.
pub(super) fn joint_values(table: &Table, hand: &Hand, all_needed: bool, found: &mut Found) -> Option<Vec<f64>> {
    let names = hand.joint_names();
    let mut values: Vec<Option<f64>> = vec![None; names.len()];
    let limits: Vec<(f64, f64)> = hand
        .fingers
        .iter()
        .flat_map(|finger| finger.chain.lower.iter().copied().zip(finger.chain.upper.iter().copied()))
        .collect();
    let mut is_good = true;
    for (name, entry) in table.all() {
        let Some(index) = names.iter().position(|known| known == name) else {
            is_good = false;
            if found.diagnostics.counted_only() {
                continue;
            }
            let problem = format!("is not a joint of the hand{}", suggestion(name, names.iter().map(String::as_str)));
            let diagnostic = entry.error("S120", found, problem).expected(names.join(", "));
            found.diagnostics.push(diagnostic);
            continue;
        };
        let Some(value) = entry.number(found) else {
            is_good = false;
            continue;
        };
        match (values.get_mut(index), limits.get(index)) {
            (Some(slot), Some((lower, upper))) if value >= *lower && value <= *upper => *slot = Some(value),
            (_, Some((lower, upper))) => {
                let diagnostic = entry
                    .error("P303", found, format!("is {}, outside the joint's limits", number(value)))
                    .expected(format!("{} to {} (radians or metres)", number(*lower), number(*upper)));
                found.diagnostics.push(diagnostic);
                is_good = false;
            }
            _ => is_good = false,
        }
    }
    let missing: Vec<&str> =
        names.iter().zip(&values).filter(|(_, value)| value.is_none()).map(|(name, _)| name.as_str()).collect();
    if all_needed && is_good && !missing.is_empty() {
        let diagnostic = table
            .error("S121", found, format!("has no value for {}", missing.join(", ")))
            .expected("a value for every joint of every finger");
        found.diagnostics.push(diagnostic);
        return None;
    }
    let rest = hand.fingers.iter().flat_map(|finger| finger.rest.iter().copied());
    is_good.then(|| values.into_iter().zip(rest).map(|(value, rest)| value.unwrap_or(rest)).collect())
}

/// One contact point per finger, in the object frame, from a table of finger names.
///
/// Errors: unknown finger (`S120`), missing fingers (`S121`).
fn contact_points(table: &Table, hand: &Hand, found: &mut Found) -> Option<Vec<Point>> {
    let mut points: Vec<Option<Point>> = vec![None; hand.fingers.len()];
    let mut is_good = true;
    for (name, entry) in table.all() {
        let slot = hand.finger_named(name).and_then(|finger| points.get_mut(finger.0));
        let Some(slot) = slot else {
            is_good = false;
            if found.diagnostics.counted_only() {
                continue;
            }
            let names: Vec<&str> = hand.fingers.iter().map(|finger| finger.name.as_str()).collect();
            let problem = format!("is not a finger of the hand{}", suggestion(name, names.iter().copied()));
            let diagnostic = entry.error("S120", found, problem).expected(names.join(", "));
            found.diagnostics.push(diagnostic);
            continue;
        };
        *slot = entry.numbers::<3>(found).map(Point::from);
        is_good &= slot.is_some();
    }
    let missing: Vec<&str> = hand
        .fingers
        .iter()
        .zip(&points)
        .filter(|(_, point)| point.is_none())
        .map(|(finger, _)| finger.name.as_str())
        .collect();
    if is_good && !missing.is_empty() {
        let diagnostic = table
            .error("S121", found, format!("has no contact for {}", missing.join(", ")))
            .expected("a contact for every finger");
        found.diagnostics.push(diagnostic);
        return None;
    }
    points.into_iter().collect()
}
