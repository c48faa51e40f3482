//! Reading and writing `plan.json`, and its JSON Schema. `docs/reference/plan-format.md` describes the file.

/// The file as it stands on disk.
mod file;
/// Plans of whole robots, and plans of either kind.
mod robot;
/// `schema/plan.d.ts`.
#[cfg(test)]
mod typescript;
/// What a plan file may not say.
mod validate;

pub use robot::{AnyPlan, is_robot_plan, read_any, robot_from_json, robot_schema, robot_to_json};

use crate::plan::{FORMAT, FORMAT_VERSION, ONLY_HAND, Plan, Segment};
use file::{FileHand, FilePlan, FileSegment, FileWaypoint};
use regrasp_base::json_place::{PathStep, diagnostic, locate};
use regrasp_base::{Diagnostic, InputError, Place};
use serde::Deserialize;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// The version before, which is read as well.
const OLD_VERSION: u32 = 2;

/// Largest numbers of things in a plan file, so that a hostile file is refused before it costs anything.
mod caps {
    pub const BYTES: u64 = regrasp_base::files::MAX_FILE_BYTES;
    pub const JOINTS: usize = 1_000;
    pub const FINGERS: usize = 64;
    /// Robots that move.
    pub const ROBOTS: usize = 64;
    /// Objects that move.
    pub const OBJECTS: usize = 1_000;
    /// Hands and supports that hold an object at once.
    pub const HOLDERS: usize = 64;
    pub const INPUTS: usize = 10_000;
    pub const SEGMENTS: usize = 100_000;
    pub const WAYPOINTS: usize = 2_000_000;
    pub const WAY_POSES: usize = 10_000;
    /// Largest position, in metres or radians.
    pub const POSITION: f64 = 1e6;
    /// Largest time, velocity, acceleration, force, torque or mass.
    pub const SIZE: f64 = 1e9;
}

/// `plan` as the bytes of a plan file: the same plan gives the same bytes; numbers are the shortest that read back
/// the same; every waypoint stands on a line of its own.
///
/// Panics if the plan holds a NaN or an infinity, which JSON cannot express.
pub fn to_json(plan: &Plan) -> String {
    assert!(all_numbers(plan).all(f64::is_finite), "a plan with a number that is not finite cannot be written");
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
    let hand = FileHand {
        name: Cow::Borrowed(&plan.hand),
        fingers: Cow::Borrowed(&plan.fingers),
        joint_names: Cow::Borrowed(&plan.joint_names),
        held_joints: Cow::Borrowed(&plan.held_joints),
    };
    field("hands", compact(&[hand]));
    field("objects", compact(&[&plan.object]));
    field("start", compact(&plan.start));
    if let Some(asked) = &plan.asked {
        field("asked", compact(asked));
    }
    if !plan.way_poses.is_empty() {
        let way_poses: Vec<String> = plan.way_poses.iter().map(|pose| format!("    {}", compact(pose))).collect();
        field("way_poses", format!("[\n{}\n  ]", way_poses.join(",\n")));
    }
    field("goal", compact(&plan.goal));
    field("statistics", compact(&plan.statistics));
    out.push_str("  \"segments\": [");
    for (i, segment) in plan.segments.iter().enumerate() {
        out.push_str(if i == 0 { "\n" } else { ",\n" });
        let head = compact(&FileSegment::of(plan, segment));
        let head = head.strip_suffix("]}").expect("an empty list of waypoints stands last");
        let _ = write!(out, "    {head}");
        for (j, waypoint) in segment.waypoints.iter().enumerate() {
            out.push_str(if j == 0 { "\n      " } else { ",\n      " });
            out.push_str(&compact(&FileWaypoint::of(plan, waypoint)));
        }
        out.push_str("\n    ]}");
    }
    out.push_str("\n  ]\n}\n");
    out
}

/// Reads a plan from `bytes`, which came from `path`. Files of version 2 are read as well; what they do not say is filled in.
///
/// Errors, with line and column: not JSON or not the shape of a plan (`C401`), another format (`C402`), another version
/// (`C403`), vectors of the wrong length (`C404`), a quaternion or normal that is not of length one (`C405`), no
/// motion (`C406`), a contact that lacks something or has too much (`C407`), a name used twice or unknown (`C408`), a
/// number that makes no sense (`C409`), too much of something (`C410`), several hands or objects that move (`C411`).
pub fn from_json(path: &Path, bytes: &[u8]) -> Result<Plan, InputError> {
    if bytes.len() as u64 > caps::BYTES {
        let problem = format!("has {} bytes, more than the limit of {}", bytes.len(), caps::BYTES);
        return Err(Diagnostic::new("C410", Place::file(path), problem).into());
    }
    let text = regrasp_base::files::text_of(path, bytes.to_vec())?;
    let version = version_of(path, &text)?;
    if robot::is_robot_plan(text.as_bytes()) {
        let at = [PathStep::Key("task")];
        let problem = "is a plan of a whole robot, which this cannot be done with".into();
        let expected = "a plan in which one hand moves one object: \"in_hand\" or \"tracking\"";
        return Err(diagnostic(path, &text, "C412", &at, problem).expected(expected).into());
    }
    let plan = match version {
        OLD_VERSION => version_2(serde_json::from_str(&text).map_err(|error| syntax_error(path, &error))?),
        _ => {
            let file: FilePlan = serde_json::from_str(&text).map_err(|error| syntax_error(path, &error))?;
            file.plan().map_err(|fault| {
                diagnostic(path, &text, fault.code, &fault.at, fault.problem).expected(fault.expected)
            })?
        }
    };
    validate::validate(path, &text, version, plan)
}

/// What version 2 does not say: the hand and the object are the only ones, and the hand holds the object.
fn version_2(plan: Plan) -> Plan {
    let segments = plan.segments.into_iter();
    let segments = segments.map(|segment| Segment { held_by: vec![ONLY_HAND.into()], ..segment }).collect();
    Plan { hand: ONLY_HAND.into(), format_version: FORMAT_VERSION, segments, ..plan }
}

/// The JSON Schema of a plan file, as pretty JSON: the content of `schema/plan.schema.json`.
pub fn schema() -> String {
    let schema = schemars::schema_for!(FilePlan);
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
    let is_toml = path.extension().is_some_and(|extension| extension == "toml");
    let fix = if is_toml { "where this is a scene, `regrasp plan` makes a plan of it" } else { "" };
    Diagnostic::new("C401", place, problem).expected("a plan file as in schema/plan.schema.json").fix(fix)
}

/// The version. Format and version come first: their message helps more than the first key that a later version has and this one
/// not.
fn version_of(path: &Path, text: &str) -> Result<u32, InputError> {
    #[derive(Deserialize)]
    struct Header {
        #[serde(default)]
        format: Option<serde_json::Value>,
        #[serde(default)]
        format_version: Option<serde_json::Value>,
    }
    let header: Header = serde_json::from_str(text).map_err(|error| syntax_error(path, &error))?;
    let place = |key| locate(text, &[PathStep::Key(key)]).unwrap_or(0);
    if header.format.as_ref().and_then(|value| value.as_str()) != Some(FORMAT) {
        let seen = header.format.map_or("is missing".to_owned(), |value| format!("is {value}"));
        return Err(Diagnostic::new("C402", Place::at_offset(path, text, place("format")), seen)
            .element("key", "format")
            .expected(format!("\"{FORMAT}\""))
            .fix("give a file that `regrasp plan` wrote")
            .into());
    }
    let seen = header.format_version.as_ref().and_then(serde_json::Value::as_u64);
    if let Some(known) = [FORMAT_VERSION, OLD_VERSION].into_iter().find(|known| seen == Some(u64::from(*known))) {
        return Ok(known);
    }
    let seen = header.format_version.map_or("is missing".to_owned(), |value| format!("is {value}"));
    Err(Diagnostic::new("C403", Place::at_offset(path, text, place("format_version")), seen)
        .element("key", "format_version")
        .expected(format!("{FORMAT_VERSION}, or {OLD_VERSION}, which is read as well"))
        .fix("use a version of regrasp that reads it, or plan again")
        .into())
}

/// Every floating-point number of the plan.
fn all_numbers(plan: &Plan) -> impl Iterator<Item = f64> + '_ {
    let way = plan.way_poses.iter().flat_map(|way_pose| way_pose.world_from_object.numbers());
    let waypoints = plan.segments.iter().flat_map(|segment| &segment.waypoints).flat_map(crate::Waypoint::numbers);
    let asked = plan.asked.iter().flat_map(|asked| asked.numbers());
    plan.promises
        .numbers()
        .chain(plan.start.numbers())
        .chain(way)
        .chain(plan.goal.numbers())
        .chain(waypoints)
        .chain(asked)
        .chain(plan.held_joints.values().copied())
}
