//! Plan files of whole robots, and files of either kind.

use super::{caps, from_json, syntax_error};
use crate::plan::{ContactMode, FORMAT, FORMAT_VERSION, Plan, PoseData};
use crate::robot_plan::{RobotContact, RobotPlan, RobotSegment, RobotSegmentKind, RobotWaypoint};
use regrasp_base::diagnostic::{Diagnostics, GOOD_NAME, fault_of_name, number};
use regrasp_base::json_place::{PathStep, diagnostic};
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_scene::motion::MOTION;
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use serde::Deserialize;
use std::fmt::Write as _;
use std::path::Path;

/// How far a quaternion's or a normal's length may be from one.
const UNIT_TOLERANCE: f64 = 1e-9;
/// Largest clearance that a plan may promise, in metres.
const MOST_CLEARANCE: f64 = 10.0;

/// Tasks whose plans are plans of whole robots.
pub const ROBOT_TASKS: [&str; 2] = [MOTION, PICK_AND_PLACE];

/// A plan of either kind.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyPlan {
    /// One hand moves one object with its fingers.
    InHand(Box<Plan>),
    /// Whole robots move.
    Robot(Box<RobotPlan>),
}

impl AnyPlan {
    /// Name of the task in the scene file; empty where the file has only one.
    pub fn query(&self) -> &str {
        match self {
            AnyPlan::InHand(plan) => &plan.query,
            AnyPlan::Robot(plan) => &plan.query,
        }
    }

    /// Its seed.
    pub fn seed(&self) -> u64 {
        match self {
            AnyPlan::InHand(plan) => plan.seed,
            AnyPlan::Robot(plan) => plan.seed,
        }
    }

    /// Files it was made from.
    pub fn inputs(&self) -> &[crate::plan::PlanInput] {
        match self {
            AnyPlan::InHand(plan) => &plan.inputs,
            AnyPlan::Robot(plan) => &plan.inputs,
        }
    }

    /// The bytes of its file.
    ///
    /// Panics if the plan holds a NaN or an infinity.
    pub fn to_json(&self) -> String {
        match self {
            AnyPlan::InHand(plan) => super::to_json(plan),
            AnyPlan::Robot(plan) => robot_to_json(plan),
        }
    }
}

/// True if the bytes are a plan file whose task is one of whole robots.
pub fn is_robot_plan(bytes: &[u8]) -> bool {
    #[derive(Deserialize)]
    struct Header {
        format: String,
        task: String,
    }
    serde_json::from_slice::<Header>(bytes)
        .is_ok_and(|header| header.format == FORMAT && ROBOT_TASKS.contains(&header.task.as_str()))
}

/// Reads a plan of either kind from `bytes`, which came from `path`.
///
/// Errors: as [`from_json`] and [`robot_from_json`].
pub fn read_any(path: &Path, bytes: &[u8]) -> Result<AnyPlan, InputError> {
    if bytes.len() as u64 <= caps::BYTES && is_robot_plan(bytes) {
        return robot_from_json(path, bytes).map(|plan| AnyPlan::Robot(Box::new(plan)));
    }
    from_json(path, bytes).map(|plan| AnyPlan::InHand(Box::new(plan)))
}

/// `plan` as the bytes of a plan file: the same plan gives the same bytes; numbers are the shortest that read back the same; every
/// waypoint stands on a line of its own.
///
/// Panics if the plan holds a NaN or an infinity, which JSON cannot express.
pub fn robot_to_json(plan: &RobotPlan) -> String {
    assert!(plan.numbers().all(f64::is_finite), "a plan with a number that is not finite cannot be written");
    fn compact<T: serde::Serialize + ?Sized>(value: &T) -> String {
        serde_json::to_string(value).expect("plan types always serialise")
    }
    let mut out = String::from("{\n");
    let mut field = |name: &str, value: String| {
        let _ = writeln!(out, "  \"{name}\": {value},");
    };
    field("format", compact(FORMAT));
    field("format_version", FORMAT_VERSION.to_string());
    field("tool", compact(&plan.tool));
    field("task", compact(&plan.task));
    if !plan.query.is_empty() {
        field("query", compact(&plan.query));
    }
    field("method", compact(&plan.method));
    field("seed", compact(&plan.seed));
    field("settings", compact(&plan.settings));
    let inputs: Vec<String> = plan.inputs.iter().map(|input| format!("    {}", compact(input))).collect();
    field("inputs", if inputs.is_empty() { "[]".into() } else { format!("[\n{}\n  ]", inputs.join(",\n")) });
    field("promises", compact(&plan.promises));
    field("robots", compact(&plan.robots));
    field("hands", compact(&plan.hands));
    field("objects", compact(&plan.objects));
    field("statistics", compact(&plan.statistics));
    out.push_str("  \"segments\": [");
    for (i, segment) in plan.segments.iter().enumerate() {
        out.push_str(if i == 0 { "\n" } else { ",\n" });
        let (kind, held_by) = (compact(&segment.kind), compact(&segment.held_by));
        let _ = write!(out, "    {{\"kind\":{kind},\"held_by\":{held_by},");
        if let Some(part) = &segment.in_hand {
            let _ = write!(out, "\"in_hand\":{},", compact(part));
        }
        out.push_str("\"waypoints\":[");
        for (j, waypoint) in segment.waypoints.iter().enumerate() {
            out.push_str(if j == 0 { "\n      " } else { ",\n      " });
            out.push_str(&compact(waypoint));
        }
        out.push_str("\n    ]}");
    }
    out.push_str("\n  ]\n}\n");
    out
}

/// Reads a plan of whole robots from `bytes`, which came from `path`.
///
/// Errors, with line and column: codes and meanings as those of [`from_json`], and a plan of another task (`C412`).
pub fn robot_from_json(path: &Path, bytes: &[u8]) -> Result<RobotPlan, InputError> {
    if bytes.len() as u64 > caps::BYTES {
        let problem = format!("has {} bytes, more than the limit of {}", bytes.len(), caps::BYTES);
        return Err(Diagnostic::new("C410", Place::file(path), problem).into());
    }
    let text = regrasp_base::files::text_of(path, bytes.to_vec())?;
    let version = super::version_of(path, &text)?;
    if version != FORMAT_VERSION {
        let at = [PathStep::Key("format_version")];
        let problem = diagnostic(path, &text, "C403", &at, format!("is {version}, which has no plans of robots"));
        return Err(problem.expected(FORMAT_VERSION.to_string()).into());
    }
    if !is_robot_plan(text.as_bytes()) {
        let problem = diagnostic(path, &text, "C412", &[PathStep::Key("task")], "is not a task of whole robots".into());
        return Err(problem.expected(ROBOT_TASKS.join(" or ")).into());
    }
    let plan: RobotPlan = serde_json::from_str(&text).map_err(|error| syntax_error(path, &error))?;
    let mut reader = Reader { path, text: &text, found: Diagnostics::default() };
    reader.validate(&plan);
    reader.found.into_result(plan)
}

/// The JSON Schema of a plan file of whole robots, as pretty JSON: the content of `schema/robot-plan.schema.json`.
pub fn robot_schema() -> String {
    let schema = schemars::schema_for!(RobotPlan);
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema always serialises");
    text.push('\n');
    text
}

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    found: Diagnostics,
}

impl Reader<'_> {
    fn fail(&mut self, code: &'static str, steps: &[PathStep], problem: String, expected: impl Into<String>) {
        if !self.found.counted_only() {
            self.found.push(diagnostic(self.path, self.text, code, steps, problem).expected(expected.into()));
        }
    }

    fn validate(&mut self, plan: &RobotPlan) {
        use PathStep::{Index, Key};
        let n_joints: usize = plan.robots.iter().map(|robot| robot.joint_names.len()).sum();
        let n_waypoints = plan.waypoints().count();
        for (key, seen, limit) in [
            ("robots", plan.robots.len(), caps::ROBOTS),
            ("robots", n_joints, caps::JOINTS),
            ("hands", plan.hands.len(), caps::HOLDERS),
            ("objects", plan.objects.len(), caps::OBJECTS),
            ("inputs", plan.inputs.len(), caps::INPUTS),
            ("segments", plan.segments.len(), caps::SEGMENTS),
            ("segments", n_waypoints, caps::WAYPOINTS),
        ] {
            if seen > limit {
                self.fail("C410", &[Key(key)], format!("has {seen} entries"), format!("at most {limit}"));
                return;
            }
        }
        if plan.robots.len() != 1 {
            let expected = "one; this version judges plans of one robot";
            self.fail("C411", &[Key("robots")], format!("has {} entries", plan.robots.len()), expected);
        }
        if !plan.query.is_empty() {
            self.names(&[Key("query")], std::slice::from_ref(&plan.query));
        }
        for (i, robot) in plan.robots.iter().enumerate() {
            self.names(&[Key("robots"), Index(i), Key("name")], std::slice::from_ref(&robot.name));
            if robot.joint_names.is_empty() {
                let at = [Key("robots"), Index(i), Key("joint_names")];
                self.fail("C404", &at, "is empty".into(), "at least one name");
            }
            self.names(&[Key("robots"), Index(i), Key("joint_names")], &robot.joint_names);
        }
        for (i, hand) in plan.hands.iter().enumerate() {
            if hand.fingers.len() > caps::FINGERS {
                let at = [Key("hands"), Index(i), Key("fingers")];
                let problem = format!("has {} entries", hand.fingers.len());
                self.fail("C410", &at, problem, format!("at most {}", caps::FINGERS));
                return;
            }
            self.names(&[Key("hands"), Index(i), Key("fingers")], &hand.fingers);
        }
        let hands: Vec<String> = plan.hands.iter().map(|hand| hand.name.clone()).collect();
        self.names(&[Key("hands")], &hands);
        self.names(&[Key("objects")], &plan.objects);
        for (i, input) in plan.inputs.iter().enumerate() {
            if input.sha256.len() != 64
                || !input.sha256.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
            {
                let steps = [Key("inputs"), Index(i), Key("sha256")];
                self.fail("C409", &steps, format!("is \"{}\"", input.sha256), "64 lower-case hex digits");
            }
        }
        self.promises(plan, n_joints);
        if plan.task == PICK_AND_PLACE {
            self.holding(plan);
        }
        if plan.segments.is_empty() {
            self.fail("C406", &[Key("segments")], "is empty".into(), "at least one segment");
        }
        for s in 0..plan.segments.len() {
            self.segment(plan, n_joints, s);
        }
    }

    /// Names that can be shown, each once.
    fn names(&mut self, at: &[PathStep], names: &[String]) {
        let mut known = std::collections::BTreeSet::new();
        for name in names {
            if let Some(fault) = fault_of_name(name) {
                self.fail("V004", at, fault, GOOD_NAME);
            } else if !known.insert(name) {
                self.fail("C408", at, format!("\"{name}\" is used twice"), "each once");
            }
        }
    }

    fn promises(&mut self, plan: &RobotPlan, n_joints: usize) {
        use PathStep::Key;
        let promises = &plan.promises;
        let limits =
            [("joint_velocities", &promises.joint_velocities), ("joint_accelerations", &promises.joint_accelerations)];
        for (key, values) in limits {
            let at = [Key("promises"), Key(key)];
            self.per_joint(&at, values, n_joints, caps::SIZE);
            if let Some(value) = values.iter().find(|value| **value <= 0.0) {
                self.fail("C409", &at, format!("holds {}", number(*value)), "limits above 0");
            }
        }
        if !(0.0..=MOST_CLEARANCE).contains(&promises.clearance) {
            let problem = format!("is {}", number(promises.clearance));
            let expected = format!("a distance from 0 to {MOST_CLEARANCE} metres");
            self.fail("C409", &[Key("promises"), Key("clearance")], problem, expected);
        }
    }

    /// What only plans of pick and place have: one object, hands, promises of holding.
    fn holding(&mut self, plan: &RobotPlan) {
        use PathStep::{Index, Key};
        if plan.objects.len() != 1 {
            let problem = format!("has {} entries", plan.objects.len());
            self.fail("C411", &[Key("objects")], problem, "one: the object that is moved");
        }
        if plan.hands.is_empty() {
            self.fail("C411", &[Key("hands")], "is empty".into(), "all hands of the robot");
        }
        if let Some(i) = plan.hands.iter().position(|hand| hand.fingers.is_empty()) {
            let at = [Key("hands"), Index(i), Key("fingers")];
            self.fail("C404", &at, "is empty".into(), "names of all fingers");
        }
        let Some(holding) = &plan.promises.holding else {
            let expected = "\"holding\" in a plan of pick and place";
            self.fail("C409", &[Key("promises")], "says nothing of holding".into(), expected);
            return;
        };
        let [least, most] = holding.normal_force;
        for (key, value, low, high) in [
            ("contact_tolerance", holding.contact_tolerance, 0.0, caps::POSITION),
            ("friction_margin", holding.friction_margin, 1.0, caps::SIZE),
            ("required_margin", holding.required_margin, 0.0, caps::SIZE),
            ("torque_scale", holding.torque_scale, 0.0, caps::POSITION),
            ("normal_force", least, 0.0, most),
            ("normal_force", most, least, caps::SIZE),
        ] {
            if !(low..=high).contains(&value) {
                let at = [Key("promises"), Key("holding"), Key(key)];
                let expected = format!("a number from {} to {}", number(low), number(high));
                self.fail("C409", &at, format!("is {}", number(value)), expected);
            }
        }
    }

    fn per_joint(&mut self, at: &[PathStep], values: &[f64], n_joints: usize, most: f64) {
        if values.len() != n_joints {
            let expected = format!("{n_joints}, one for each of \"joint_names\"");
            self.fail("C404", at, format!("has {} values", values.len()), expected);
        }
        if let Some(value) = values.iter().find(|value| value.abs() > most) {
            self.fail("C409", at, format!("holds {}", number(*value)), format!("at most {} in size", number(most)));
        }
    }

    fn segment(&mut self, plan: &RobotPlan, n_joints: usize, s: usize) {
        use PathStep::{Index, Key};
        let (segment, at) = (&plan.segments[s], [Key("segments"), Index(s)]);
        if segment.waypoints.len() < 2 {
            let problem = format!("has {} waypoints", segment.waypoints.len());
            self.fail("C406", &[at[0], at[1], Key("waypoints")], problem, "at least 2");
        }
        let held = [at[0], at[1], Key("held_by")];
        for (object, holders) in &segment.held_by {
            if !plan.objects.contains(object) {
                let expected = format!("one of {}", plan.objects.join(", "));
                self.fail("C408", &held, format!("\"{object}\" is not in \"objects\""), expected);
            }
            if holders.len() > caps::HOLDERS {
                let problem = format!("has {} names", holders.len());
                self.fail("C410", &held, problem, format!("at most {}", caps::HOLDERS));
            } else {
                self.names(&held, holders);
            }
        }
        let is_held = segment.held_by.values().any(|holders| !holders.is_empty());
        if plan.task == MOTION && is_held != (segment.kind == RobotSegmentKind::Carry) {
            let problem = if is_held { "is a transit in which something is held" } else { "is a carry of nothing" };
            let expected = "\"carry\" where \"held_by\" names a hand, else \"transit\"";
            self.fail("C408", &[at[0], at[1], Key("kind")], problem.into(), expected);
        }
        let is_of_motion = matches!(segment.kind, RobotSegmentKind::Transit | RobotSegmentKind::Carry);
        if plan.task == MOTION && !is_of_motion {
            let expected = "\"transit\" or \"carry\" in a plan of this task";
            self.fail("C408", &[at[0], at[1], Key("kind")], "is one of pick and place".into(), expected);
        }
        if segment.kind.is_in_hand() != segment.in_hand.is_some() {
            let expected = "\"in_hand\" in every transfer and regrasp, and nowhere else";
            self.fail("C408", &[at[0], at[1], Key("in_hand")], "does not fit the kind of the segment".into(), expected);
        }
        if let Some(part) = &segment.in_hand {
            let path = [at[0], at[1], Key("in_hand"), Key("joint_torques")];
            let has_all = part.joint_torques.is_empty() || part.joint_torques.len() == segment.waypoints.len();
            if !has_all || part.joint_torques.iter().any(|torques| torques.len() > n_joints) {
                let problem = format!("has {} lists, or too long ones", part.joint_torques.len());
                self.fail("C404", &path, problem, "one torque for each joint of the hand, waypoint by waypoint");
            }
            if part.joint_torques.iter().flatten().any(|torque| torque.abs() > caps::SIZE) {
                self.fail("C409", &path, "holds a number beyond all sense".into(), "newton metres or newtons");
            }
        }
        if plan.task == PICK_AND_PLACE {
            let unheld = plan.objects.iter().find(|object| segment.held_by.get(*object).is_none_or(Vec::is_empty));
            if let Some(object) = unheld {
                let expected = "at least one hand or support for every object";
                self.fail("C408", &held, format!("names nobody that holds \"{object}\""), expected);
            }
            for (w, waypoint) in segment.waypoints.iter().enumerate() {
                self.contacts(plan, segment, [at[0], at[1], Key("waypoints"), Index(w), Key("contacts")], waypoint);
            }
        }
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            self.waypoint(plan, n_joints, [at[0], at[1], Key("waypoints"), Index(w)], waypoint);
        }
    }

    fn waypoint(&mut self, plan: &RobotPlan, n_joints: usize, at: [PathStep; 4], waypoint: &RobotWaypoint) {
        use PathStep::{Index, Key};
        let inside = |key| [at[0], at[1], at[2], at[3], Key(key)];
        if !(0.0..=caps::SIZE).contains(&waypoint.time) {
            let expected = format!("a number from 0 to {}", number(caps::SIZE));
            self.fail("C409", &inside("time"), format!("is {}", number(waypoint.time)), expected);
        }
        self.per_joint(&inside("joints"), &waypoint.joints, n_joints, caps::POSITION);
        self.per_joint(&inside("joint_velocities"), &waypoint.joint_velocities, n_joints, caps::SIZE);
        if waypoint.world_from_objects.len() != plan.objects.len() {
            let problem = format!("has {} poses", waypoint.world_from_objects.len());
            self.fail("C404", &inside("world_from_objects"), problem, "one for each of \"objects\"");
        }
        for (i, pose) in waypoint.world_from_objects.iter().enumerate() {
            self.pose(&[at[0], at[1], at[2], at[3], Key("world_from_objects"), Index(i)], pose);
        }
        for (i, contact) in waypoint.contacts.iter().enumerate() {
            self.contact(plan, &[at[0], at[1], at[2], at[3], Key("contacts"), Index(i)], contact);
        }
    }

    /// Contacts of pick and place: each finger once, of hands that hold, and fixed.
    fn contacts(&mut self, plan: &RobotPlan, segment: &RobotSegment, at: [PathStep; 5], waypoint: &RobotWaypoint) {
        let n_fingers: usize = plan.hands.iter().map(|hand| hand.fingers.len()).sum();
        if waypoint.contacts.len() > n_fingers {
            let problem = format!("has {} entries", waypoint.contacts.len());
            self.fail("C410", &at, problem, format!("at most {n_fingers}, one for each finger"));
            return;
        }
        let mut known = std::collections::BTreeSet::new();
        for (i, contact) in waypoint.contacts.iter().enumerate() {
            let inside = [at[0], at[1], at[2], at[3], at[4], PathStep::Index(i)];
            let who = format!("\"{}/{}\"", contact.hand, contact.finger);
            if !known.insert((&contact.hand, &contact.finger)) {
                self.fail("C408", &inside, format!("is a second entry of {who}"), "each finger once");
            }
            let holders = segment.held_by.get(&contact.object);
            if holders.is_none_or(|holders| !holders.contains(&contact.hand)) {
                let problem = format!("is of {who}, whose hand does not hold in this segment");
                self.fail("C407", &inside, problem, "fingers of the hands in \"held_by\" only");
            }
            let may_roll = segment.kind.is_in_hand() && contact.mode == ContactMode::Rolling;
            if contact.mode != ContactMode::Fixed && !may_roll {
                let expected = "\"fixed\", or \"rolling\" in a transfer or regrasp";
                self.fail("C407", &inside, format!("of {who} is not fixed"), expected);
            }
        }
    }

    fn contact(&mut self, plan: &RobotPlan, at: &[PathStep], contact: &RobotContact) {
        let hand = plan.hands.iter().find(|hand| hand.name == contact.hand);
        let is_known = hand.is_some_and(|hand| hand.fingers.contains(&contact.finger));
        if !is_known || !plan.objects.contains(&contact.object) {
            let problem = format!("is of \"{}/{}\" and \"{}\"", contact.hand, contact.finger, contact.object);
            self.fail("C408", at, problem, "a hand, a finger and an object of the plan");
        }
        let length = contact.normal_in_object.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            self.fail("C405", at, format!("has a normal of length {length}"), "length 1");
        }
        let force = contact.force_in_object.into_iter().flatten().chain(contact.torsion);
        if contact.point_in_object.into_iter().chain(force).any(|x| x.abs() > caps::POSITION) {
            self.fail("C409", at, "holds a number beyond all sense".into(), "metres and newtons");
        }
    }

    fn pose(&mut self, at: &[PathStep], pose: &PoseData) {
        let length = pose.quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            self.fail("C405", at, format!("has a quaternion of length {length}"), "length 1");
        } else if pose.quat_xyzw[3] < 0.0 {
            self.fail("C405", at, "has a quaternion with w < 0".into(), "w >= 0");
        }
        if pose.position.iter().any(|x| x.abs() > caps::POSITION) {
            self.fail("C409", at, format!("has position {:?}", pose.position), "metres");
        }
    }
}
