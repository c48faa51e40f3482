//! Reading and writing `plan.json`, and its JSON Schema. `docs/reference/plan-format.md` describes the file.

use crate::plan::{
    ContactMode, ContactState, FORMAT, FORMAT_VERSION, ForcePromises, Plan, PoseData, Segment, SegmentKind,
};
use regrasp_base::diagnostic::{Diagnostics, GOOD_NAME, fault_of_name, number};
use regrasp_base::{Diagnostic, InputError, Place};
use serde::Deserialize;
use std::fmt::Write as _;
use std::path::Path;

/// Largest numbers of things in a plan file, so that a hostile file is refused before it costs anything.
mod caps {
    pub const BYTES: u64 = regrasp_base::files::MAX_FILE_BYTES;
    pub const JOINTS: usize = 1_000;
    pub const FINGERS: usize = 64;
    pub const INPUTS: usize = 10_000;
    pub const SEGMENTS: usize = 100_000;
    pub const WAYPOINTS: usize = 2_000_000;
    pub const WAY_POSES: usize = 10_000;
    /// Largest position, in metres or radians.
    pub const POSITION: f64 = 1e6;
    /// Largest time, velocity, acceleration, force, torque or mass.
    pub const SIZE: f64 = 1e9;
}

/// How far a quaternion's or a normal's length may be from one.
const UNIT_TOLERANCE: f64 = 1e-9;

/// `plan` as the bytes of a plan file: the same plan gives the same bytes; numbers are the shortest that read back
/// the same; every waypoint stands on a line of its own.
///
/// Panics if the plan holds a NaN or an infinity, which JSON cannot express.
pub fn to_json(plan: &Plan) -> String {
    assert!(all_numbers(plan).all(f64::is_finite), "a plan with a number that is not finite cannot be written");
    fn compact<T: serde::Serialize>(value: &T) -> String {
        serde_json::to_string(value).expect("plan types always serialise")
    }
    let mut out = String::from("{\n");
    let mut field = |name: &str, value: String| {
        let _ = writeln!(out, "  \"{name}\": {value},");
    };
    field("format", compact(&plan.format));
    field("format_version", compact(&plan.format_version));
    field("tool", compact(&plan.tool));
    field("task", compact(&plan.task));
    field("method", compact(&plan.method));
    field("seed", compact(&plan.seed));
    field("settings", compact(&plan.settings));
    let inputs: Vec<String> = plan.inputs.iter().map(|input| format!("    {}", compact(input))).collect();
    field("inputs", if inputs.is_empty() { "[]".into() } else { format!("[\n{}\n  ]", inputs.join(",\n")) });
    field("promises", compact(&plan.promises));
    field("joint_names", compact(&plan.joint_names));
    field("fingers", compact(&plan.fingers));
    field("start", compact(&plan.start));
    if !plan.way_poses.is_empty() {
        let way_poses: Vec<String> = plan.way_poses.iter().map(|pose| format!("    {}", compact(pose))).collect();
        field("way_poses", format!("[\n{}\n  ]", way_poses.join(",\n")));
    }
    field("goal", compact(&plan.goal));
    field("statistics", compact(&plan.statistics));
    out.push_str("  \"segments\": [");
    for (i, segment) in plan.segments.iter().enumerate() {
        out.push_str(if i == 0 { "\n" } else { ",\n" });
        let _ = write!(out, "    {{\"kind\": {}, ", compact(&segment.kind));
        if let Some(finger) = &segment.moving_finger {
            let _ = write!(out, "\"moving_finger\": {}, ", compact(finger));
        }
        if !segment.also_moving.is_empty() {
            let _ = write!(out, "\"also_moving\": {}, ", compact(&segment.also_moving));
        }
        if let Some(finger) = &segment.rolling_finger {
            let _ = write!(out, "\"rolling_finger\": {}, ", compact(finger));
        }
        out.push_str("\"waypoints\": [");
        for (j, waypoint) in segment.waypoints.iter().enumerate() {
            out.push_str(if j == 0 { "\n      " } else { ",\n      " });
            out.push_str(&compact(waypoint));
        }
        out.push_str("\n    ]}");
    }
    out.push_str("\n  ]\n}\n");
    out
}

/// Reads a plan from `bytes`, which came from `path`.
///
/// Errors, with line and column: not JSON or not the shape of a plan (`C401`), another format (`C402`), another version
/// (`C403`), vectors of the wrong length (`C404`), a quaternion or normal that is not of length one (`C405`), no
/// motion (`C406`), a contact that lacks something or has too much (`C407`), a name used twice or unknown (`C408`), a
/// number that makes no sense (`C409`), too much of something (`C410`).
pub fn from_json(path: &Path, bytes: &[u8]) -> Result<Plan, InputError> {
    if bytes.len() as u64 > caps::BYTES {
        let problem = format!("has {} bytes, more than the limit of {}", bytes.len(), caps::BYTES);
        return Err(Diagnostic::new("C410", Place::file(path), problem).into());
    }
    let text = regrasp_base::files::text_of(path, bytes.to_vec())?;
    check_header(path, &text)?;
    let plan: Plan = serde_json::from_str(&text).map_err(|error| syntax_error(path, &error))?;
    let mut reader = Reader { path, text: &text, found: Diagnostics::default() };
    reader.validate(&plan);
    reader.found.into_result(plan)
}

/// The JSON Schema of a plan file, as pretty JSON: the content of `schema/plan.schema.json`.
pub fn schema() -> String {
    let schema = schemars::schema_for!(Plan);
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema always serialises");
    text.push('\n');
    text
}

fn syntax_error(path: &Path, error: &serde_json::Error) -> Diagnostic {
    let place =
        Place { file: path.to_owned(), line: Some(error.line() as u32), column: Some(error.column().max(1) as u32) };
    let message = error.to_string();
    // serde_json repeats the place at the end of its message.
    let problem = message.rsplit_once(" at line ").map_or(message.as_str(), |(problem, _)| problem);
    Diagnostic::new("C401", place, problem).expected("a plan file as in schema/plan.schema.json")
}

/// Format and version first: their message helps more than the first key that a later version has and this one not.
fn check_header(path: &Path, text: &str) -> Result<(), InputError> {
    #[derive(Deserialize)]
    struct Header {
        #[serde(default)]
        format: Option<serde_json::Value>,
        #[serde(default)]
        format_version: Option<serde_json::Value>,
    }
    let header: Header = serde_json::from_str(text).map_err(|error| syntax_error(path, &error))?;
    let place = |key| locate(text, &[Step::Key(key)]).unwrap_or(0);
    if header.format.as_ref().and_then(|value| value.as_str()) != Some(FORMAT) {
        let seen = header.format.map_or("is missing".to_owned(), |value| format!("is {value}"));
        return Err(Diagnostic::new("C402", Place::at_offset(path, text, place("format")), seen)
            .element("key", "format")
            .expected(format!("\"{FORMAT}\""))
            .fix("give a file that `regrasp plan` wrote")
            .into());
    }
    if header.format_version.as_ref().and_then(serde_json::Value::as_u64) != Some(u64::from(FORMAT_VERSION)) {
        let seen = header.format_version.map_or("is missing".to_owned(), |value| format!("is {value}"));
        return Err(Diagnostic::new("C403", Place::at_offset(path, text, place("format_version")), seen)
            .element("key", "format_version")
            .expected(FORMAT_VERSION.to_string())
            .fix("use a version of regrasp that reads it, or plan again")
            .into());
    }
    Ok(())
}

/// A step into a JSON document.
#[derive(Debug, Clone, Copy)]
enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    found: Diagnostics,
}

impl Reader<'_> {
    fn fail(&mut self, code: &'static str, steps: &[Step], problem: String, expected: String) {
        // A broken writer breaks every waypoint in the same way.
        if self.found.counted_only() {
            return;
        }
        let offset = locate(self.text, steps).unwrap_or(0);
        let mut diagnostic = Diagnostic::new(code, Place::at_offset(self.path, self.text, offset), problem);
        let name: String = steps
            .iter()
            .map(|step| match step {
                Step::Key(key) => format!(".{key}"),
                Step::Index(index) => format!("[{index}]"),
            })
            .collect();
        diagnostic = diagnostic.element("key", name.trim_start_matches('.')).expected(expected);
        self.found.push(diagnostic);
    }

    fn validate(&mut self, plan: &Plan) {
        use Step::{Index, Key};
        let n_waypoints: usize = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
        for (key, seen, limit) in [
            ("joint_names", plan.joint_names.len(), caps::JOINTS),
            ("fingers", plan.fingers.len(), caps::FINGERS),
            ("inputs", plan.inputs.len(), caps::INPUTS),
            ("way_poses", plan.way_poses.len(), caps::WAY_POSES),
            ("segments", plan.segments.len(), caps::SEGMENTS),
            ("segments", n_waypoints, caps::WAYPOINTS),
        ] {
            if seen > limit {
                self.fail("C410", &[Key(key)], format!("has {seen} entries"), format!("at most {limit}"));
                return;
            }
        }
        for (key, names) in [("joint_names", &plan.joint_names), ("fingers", &plan.fingers)] {
            if names.is_empty() {
                self.fail("C404", &[Key(key)], "is empty".into(), "at least one name".into());
            }
            for (i, name) in names.iter().enumerate() {
                if let Some(fault) = fault_of_name(name) {
                    self.fail("V004", &[Key(key), Index(i)], fault, GOOD_NAME.into());
                }
                if names[..i].contains(name) {
                    self.fail("C408", &[Key(key), Index(i)], format!("\"{name}\" is used twice"), "each once".into());
                }
            }
        }
        for (i, input) in plan.inputs.iter().enumerate() {
            if input.sha256.len() != 64
                || !input.sha256.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
            {
                let steps = [Key("inputs"), Index(i), Key("sha256")];
                self.fail("C409", &steps, format!("is \"{}\"", input.sha256), "64 lower-case hex digits".into());
            }
        }
        let promises = &plan.promises;
        for (key, value, low, high) in [
            ("contact_tolerance", promises.contact_tolerance, 0.0, 1.0),
            ("friction", promises.friction, 0.0, 1e3),
            ("required_margin", promises.required_margin, 0.0, 1.0),
            ("kept_margin", promises.kept_margin, 0.0, 1.0),
            ("torque_scale", promises.torque_scale, 1e-9, 1e3),
            ("friction_margin", promises.friction_margin, 1.0, 1e3),
            ("slip_tolerance", promises.slip_tolerance, 0.0, 1.0),
        ] {
            self.within(&[Key("promises"), Key(key)], value, low, high);
        }
        self.motion_limits(plan);
        if let Some(forces) = &promises.forces {
            self.force_promises(plan, forces);
        }
        if let Some(tracking) = &promises.tracking {
            let inside = |key| [Key("promises"), Key("tracking"), Key(key)];
            self.within(&inside("goal_tolerance"), tracking.goal_tolerance, 0.0, std::f64::consts::PI);
            self.within(&inside("sliding_friction"), tracking.sliding_friction, 0.0, 1e3);
        }
        self.pose(&[Key("start")], &plan.start);
        self.pose(&[Key("goal")], &plan.goal);
        for (i, way_pose) in plan.way_poses.iter().enumerate() {
            let at = [Key("way_poses"), Index(i)];
            self.pose(&[at[0], at[1], Key("world_from_object")], &way_pose.world_from_object);
            let n_waypoints = plan.segments.get(way_pose.segment).map_or(0, |segment| segment.waypoints.len());
            if way_pose.waypoint >= n_waypoints {
                let problem = format!("is passed at segment {}, waypoint {}", way_pose.segment, way_pose.waypoint);
                self.fail("C409", &at, problem, "a waypoint that the plan has".into());
            }
        }
        if plan.segments.is_empty() {
            self.fail("C406", &[Key("segments")], "is empty".into(), "at least one segment".into());
        }
        for (i, segment) in plan.segments.iter().enumerate() {
            let at = [Key("segments"), Index(i)];
            if segment.waypoints.len() < 2 {
                let steps = [at[0], at[1], Key("waypoints")];
                let problem = format!("has {} waypoints", segment.waypoints.len());
                self.fail("C406", &steps, problem, "at least 2".into());
            }
            self.finger_of(plan, &at, segment, "moving_finger", &segment.moving_finger);
            self.finger_of(plan, &at, segment, "rolling_finger", &segment.rolling_finger);
            self.also_moving(plan, &at, segment);
            for (j, waypoint) in segment.waypoints.iter().enumerate() {
                self.waypoint(plan, &[at[0], at[1], Key("waypoints"), Index(j)], waypoint);
            }
        }
    }

    /// The finger that a segment names, where its kind has one.
    fn finger_of(&mut self, plan: &Plan, at: &[Step; 2], segment: &Segment, key: &'static str, name: &Option<String>) {
        let (kind, is_asked) = match segment.kind {
            SegmentKind::Transfer => ("transfer", false),
            SegmentKind::Regrasp => ("regrasp", key == "moving_finger"),
            SegmentKind::Tracking => ("tracking segment", true),
        };
        let steps = [at[0], at[1], Step::Key(key)];
        match name {
            Some(finger) if is_asked && !plan.fingers.contains(finger) => {
                let expected = format!("one of {}", plan.fingers.join(", "));
                self.fail("C408", &steps, format!("\"{finger}\" is not in \"fingers\""), expected);
            }
            Some(_) if !is_asked => {
                let expected = format!("no {}", key.replace('_', " "));
                self.fail("C408", &steps, format!("stands in a {kind}"), expected);
            }
            None if is_asked => self.fail("C408", at, format!("is a {kind} without \"{key}\""), "its name".into()),
            _ => {}
        }
    }

    /// Fingers that a tracking segment names beside its moving finger: of the plan's, each once.
    fn also_moving(&mut self, plan: &Plan, at: &[Step; 2], segment: &Segment) {
        for (i, finger) in segment.also_moving.iter().enumerate() {
            let steps = [at[0], at[1], Step::Key("also_moving"), Step::Index(i)];
            if segment.kind != SegmentKind::Tracking {
                let expected = "no \"also_moving\": in a tracking segment only".into();
                self.fail("C408", &steps, format!("names \"{finger}\""), expected);
            } else if !plan.fingers.contains(finger) {
                let expected = format!("one of {}", plan.fingers.join(", "));
                self.fail("C408", &steps, format!("\"{finger}\" is not in \"fingers\""), expected);
            } else if segment.moving_finger.as_ref() == Some(finger) || segment.also_moving[..i].contains(finger) {
                self.fail("C408", &steps, format!("names \"{finger}\" again"), "each finger once".into());
            }
        }
    }

    fn within(&mut self, steps: &[Step], value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            let expected = format!("a number from {} to {}", number(low), number(high));
            self.fail("C409", steps, format!("is {}", number(value)), expected);
        }
    }

    /// A vector of one value for each joint, none larger than any that makes sense.
    fn per_joint(&mut self, plan: &Plan, steps: &[Step], values: &[f64], n_expected: usize) {
        if values.len() != n_expected {
            let expected = match n_expected {
                0 => "none: \"promises\" has no \"forces\"".into(),
                _ => format!("{}, one for each of \"joint_names\"", plan.joint_names.len()),
            };
            self.fail("C404", steps, format!("has {} values", values.len()), expected);
        }
        if let Some(value) = values.iter().find(|value| value.abs() > caps::SIZE) {
            let expected = format!("at most {} in size", number(caps::SIZE));
            self.fail("C409", steps, format!("holds {}", number(*value)), expected);
        }
    }

    fn motion_limits(&mut self, plan: &Plan) {
        use Step::Key;
        let motion = &plan.promises.motion;
        let inside = |key| [Key("promises"), Key("motion"), Key(key)];
        self.within(&inside("largest_speed"), motion.largest_speed, 1e-9, caps::SIZE);
        let limits =
            [("joint_velocities", &motion.joint_velocities), ("joint_accelerations", &motion.joint_accelerations)];
        for (key, values) in limits {
            self.per_joint(plan, &inside(key), values, plan.joint_names.len());
            if let Some(value) = values.iter().find(|value| **value <= 0.0) {
                self.fail("C409", &inside(key), format!("holds {}", number(*value)), "limits above 0".into());
            }
        }
    }

    fn force_promises(&mut self, plan: &Plan, forces: &ForcePromises) {
        use Step::Key;
        let inside = |key| [Key("promises"), Key("forces"), Key(key)];
        self.within(&inside("mass"), forces.mass, 0.0, caps::SIZE);
        for component in forces.gravity_in_world.into_iter().flatten() {
            self.within(&inside("gravity_in_world"), component, -1e3, 1e3);
        }
        let [least, largest] = forces.normal_force;
        self.within(&inside("normal_force"), least, 0.0, caps::SIZE);
        self.within(&inside("normal_force"), largest, least, caps::SIZE);
        let limits: Vec<f64> = forces.joint_torques.iter().map(|limit| limit.unwrap_or(0.0)).collect();
        self.per_joint(plan, &inside("joint_torques"), &limits, plan.joint_names.len());
        if let Some(limit) = limits.iter().find(|limit| **limit < 0.0) {
            let steps = inside("joint_torques");
            self.fail("C409", &steps, format!("holds {}", number(*limit)), "limits of 0 or more, or null".into());
        }
    }

    fn waypoint(&mut self, plan: &Plan, at: &[Step; 4], waypoint: &crate::Waypoint) {
        use Step::{Index, Key};
        let inside = |key| [at[0], at[1], at[2], at[3], Key(key)];
        if waypoint.joints.len() != plan.joint_names.len() {
            let problem = format!("has {} values", waypoint.joints.len());
            let expected = format!("{}, one for each of \"joint_names\"", plan.joint_names.len());
            self.fail("C404", &inside("joints"), problem, expected);
        }
        if let Some(value) = waypoint.joints.iter().find(|value| value.abs() > caps::POSITION) {
            let expected = format!("at most {} in size", caps::POSITION);
            self.fail("C409", &inside("joints"), format!("holds {}", number(*value)), expected);
        }
        self.within(&inside("time"), waypoint.time, 0.0, caps::SIZE);
        let n_joints = plan.joint_names.len();
        self.per_joint(plan, &inside("joint_velocities"), &waypoint.joint_velocities, n_joints);
        let n_torques = if plan.promises.forces.is_some() { n_joints } else { 0 };
        self.per_joint(plan, &inside("joint_torques"), &waypoint.joint_torques, n_torques);
        self.pose(&inside("world_from_object"), &waypoint.world_from_object);
        if waypoint.contacts.len() != plan.fingers.len() {
            let problem = format!("has {} entries", waypoint.contacts.len());
            let expected = format!("{}, one for each of \"fingers\"", plan.fingers.len());
            self.fail("C404", &inside("contacts"), problem, expected);
        }
        for (k, contact) in waypoint.contacts.iter().enumerate() {
            let steps = [at[0], at[1], at[2], at[3], Key("contacts"), Index(k)];
            match (contact.mode, &contact.point_in_object, &contact.normal_in_object) {
                (ContactMode::Free, None, None) => {}
                (ContactMode::Free, _, _) => {
                    self.fail("C407", &steps, "is free but has a point or normal".into(), "neither".into());
                }
                (_, Some(point), Some(normal)) => {
                    if point.iter().any(|x| x.abs() > caps::POSITION) {
                        self.fail("C409", &steps, format!("has its point at {point:?}"), "metres".into());
                    }
                    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
                    if (length - 1.0).abs() > UNIT_TOLERANCE {
                        self.fail("C405", &steps, format!("has a normal of length {length}"), "length 1".into());
                    }
                }
                _ => self.fail("C407", &steps, "holds but lacks its point or normal".into(), "both".into()),
            }
            self.contact_force(plan, &steps, contact);
            let (point, velocity) = (contact.point_in_tip, contact.relative_velocity_in_object);
            let is_tracked = point.is_some() || velocity.is_some() || contact.relative_turn_in_object.is_some();
            if contact.mode == ContactMode::Free && is_tracked {
                let problem = "is free but has a point on the tip or a relative velocity";
                self.fail("C407", &steps, problem.into(), "neither".into());
            }
            let numbers = [point, velocity, contact.relative_turn_in_object].into_iter().flatten().flatten();
            if let Some(value) = numbers.into_iter().find(|value| value.abs() > caps::POSITION) {
                self.fail("C409", &steps, format!("holds {}", number(value)), "metres, m/s or rad/s".into());
            }
        }
    }

    fn contact_force(&mut self, plan: &Plan, steps: &[Step], contact: &ContactState) {
        let is_loaded = contact.force_in_object.is_some() || contact.torsion.is_some();
        if contact.mode == ContactMode::Free {
            if is_loaded {
                self.fail("C407", steps, "is free but has a force or torsion".into(), "neither".into());
            }
        } else if plan.promises.forces.is_none() {
            if is_loaded {
                let problem = "has a force or torsion, but \"promises\" has no \"forces\"";
                self.fail("C407", steps, problem.into(), "neither".into());
            }
        } else if contact.force_in_object.is_none() {
            self.fail("C407", steps, "holds but lacks its force, which \"promises\" has".into(), "a force".into());
        }
        let numbers = contact.force_in_object.into_iter().flatten().chain(contact.torsion);
        if let Some(value) = numbers.into_iter().find(|value| value.abs() > caps::SIZE) {
            self.fail("C409", steps, format!("has a force of {}", number(value)), "newtons".into());
        }
    }

    fn pose(&mut self, steps: &[Step], pose: &PoseData) {
        let length = pose.quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            self.fail("C405", steps, format!("has a quaternion of length {length}"), "length 1".into());
        } else if pose.quat_xyzw[3] < 0.0 {
            self.fail("C405", steps, "has a quaternion with w < 0".into(), "w >= 0".into());
        }
        if pose.position.iter().any(|x| x.abs() > caps::POSITION) {
            self.fail("C409", steps, format!("has position {:?}", pose.position), "metres".into());
        }
    }
}

/// Every floating-point number of the plan.
fn all_numbers(plan: &Plan) -> impl Iterator<Item = f64> + '_ {
    let way = plan.way_poses.iter().flat_map(|way_pose| way_pose.world_from_object.numbers());
    let waypoints = plan.segments.iter().flat_map(|segment| &segment.waypoints).flat_map(crate::Waypoint::numbers);
    plan.promises.numbers().chain(plan.start.numbers()).chain(way).chain(plan.goal.numbers()).chain(waypoints)
}

/// Byte offset of the value that `steps` lead to. `text` is valid JSON, or nothing is found.
fn locate(text: &str, steps: &[Step]) -> Option<usize> {
    let mut cursor = Cursor { bytes: text.as_bytes(), at: 0 };
    cursor.skip_space();
    for step in steps {
        match step {
            Step::Key(wanted) => {
                cursor.expect(b'{')?;
                loop {
                    cursor.skip_space();
                    let key = cursor.string()?;
                    cursor.skip_space();
                    cursor.expect(b':')?;
                    cursor.skip_space();
                    if key == wanted.as_bytes() {
                        break;
                    }
                    cursor.skip_value()?;
                    cursor.skip_space();
                    cursor.expect(b',')?;
                }
            }
            Step::Index(wanted) => {
                cursor.expect(b'[')?;
                for _ in 0..*wanted {
                    cursor.skip_space();
                    cursor.skip_value()?;
                    cursor.skip_space();
                    cursor.expect(b',')?;
                }
                cursor.skip_space();
            }
        }
    }
    Some(cursor.at)
}

/// Walks over JSON text that a real parser has already accepted.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn skip_space(&mut self) {
        while self.peek().is_some_and(|b| b.is_ascii_whitespace()) {
            self.at += 1;
        }
    }

    fn expect(&mut self, byte: u8) -> Option<()> {
        (self.peek()? == byte).then(|| self.at += 1)
    }

    fn string(&mut self) -> Option<&'a [u8]> {
        self.expect(b'"')?;
        let from = self.at;
        while self.peek()? != b'"' {
            self.at += if self.peek()? == b'\\' { 2 } else { 1 };
        }
        self.at += 1;
        self.bytes.get(from..self.at - 1)
    }

    fn skip_value(&mut self) -> Option<()> {
        let mut depth = 0usize;
        loop {
            match self.peek()? {
                b'"' => {
                    self.string()?;
                }
                b'{' | b'[' => {
                    depth += 1;
                    self.at += 1;
                }
                b'}' | b']' if depth == 0 => return Some(()),
                b'}' | b']' => {
                    depth -= 1;
                    self.at += 1;
                }
                b',' if depth == 0 => return Some(()),
                _ => self.at += 1,
            }
            if depth == 0 && matches!(self.peek()?, b',' | b'}' | b']') {
                return Some(());
            }
        }
    }
}
