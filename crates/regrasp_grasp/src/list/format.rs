//! Reading and writing `grasps.json`, and its JSON Schema. `docs/reference/grasp-list-format.md` describes the file.

use super::{FORMAT, FORMAT_VERSION, GraspList, validate};
use regrasp_base::json_place::{PathStep, locate};
use regrasp_base::{Diagnostic, InputError, Place};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::Path;

/// Largest file that is read, in bytes.
pub const MAX_BYTES: u64 = 64 << 20;

/// `list` as the bytes of a file: the same list gives the same bytes; numbers are the shortest that read back the same; every
/// grasp stands on a line of its own.
///
/// Panics if the list holds a NaN or an infinity, which JSON cannot express.
pub fn to_json(list: &GraspList) -> String {
    assert!(list.numbers().all(f64::is_finite), "a list with a number that is not finite cannot be written");
    fn compact<T: Serialize + ?Sized>(value: &T) -> String {
        serde_json::to_string(value).expect("types of grasp lists always serialise")
    }
    fn lines<T: Serialize>(values: &[T]) -> String {
        let lines: Vec<String> = values.iter().map(|value| format!("    {}", compact(value))).collect();
        if lines.is_empty() { "[]".into() } else { format!("[\n{}\n  ]", lines.join(",\n")) }
    }
    let mut out = String::from("{\n");
    let mut field = |name: &str, value: String| {
        let _ = writeln!(out, "  \"{name}\": {value},");
    };
    field("format", compact(FORMAT));
    field("format_version", FORMAT_VERSION.to_string());
    field("tool", compact(&list.tool));
    field("kind", compact(&list.kind));
    field("seed", compact(&list.seed));
    field("settings", compact(&list.settings));
    if let Some(source) = &list.source {
        field("source", compact(source));
    }
    field("inputs", lines(&list.inputs));
    field("hand", compact(&list.hand));
    field("object", compact(&list.object));
    field("promises", compact(&list.promises));
    field("stable_poses", lines(&list.stable_poses));
    field("statistics", compact(&list.statistics));
    let _ = write!(out, "  \"grasps\": {}\n}}\n", lines(&list.grasps));
    out
}

/// Reads a list from `bytes`, which came from `path`.
///
/// Errors, with line and column: not JSON or not the shape of a list (`G701`), another format (`G702`), another version
/// (`G703`), vectors of the wrong length (`G704`), a quaternion, normal or direction that is not of length one (`G705`), a contact
/// that makes no sense (`G707`), a name used twice or unknown (`G708`), a number that makes no sense (`G709`), too much of
/// something (`G710`).
pub fn from_json(path: &Path, bytes: &[u8]) -> Result<GraspList, InputError> {
    if bytes.len() as u64 > MAX_BYTES {
        let problem = format!("has {} bytes, more than the limit of {MAX_BYTES}", bytes.len());
        return Err(Diagnostic::new("G710", Place::file(path), problem).into());
    }
    let text = regrasp_base::files::text_of(path, bytes.to_vec())?;
    check_header(path, &text)?;
    let list = serde_json::from_str(&text).map_err(|error| syntax_error(path, &error))?;
    validate::validate(path, &text, list)
}

/// True for the text of a grasp list, whether it is a good one or not: it says so.
pub fn is_list(bytes: &[u8]) -> bool {
    serde_json::from_slice::<Header>(bytes)
        .is_ok_and(|header| header.format.as_ref().and_then(|value| value.as_str()) == Some(FORMAT))
}

/// The JSON Schema of a grasp list, as pretty JSON: the content of `schema/grasps.schema.json`.
pub fn schema() -> String {
    let schema = schemars::schema_for!(GraspList);
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
    Diagnostic::new("G701", place, problem).expected("a grasp list as in schema/grasps.schema.json")
}

/// Format and version, whatever else the file says.
#[derive(Deserialize)]
struct Header {
    #[serde(default)]
    format: Option<serde_json::Value>,
    #[serde(default)]
    format_version: Option<serde_json::Value>,
}

/// Format and version come first: their message helps more than the first key that a later version has and this one not.
fn check_header(path: &Path, text: &str) -> Result<(), InputError> {
    let header: Header = serde_json::from_str(text).map_err(|error| syntax_error(path, &error))?;
    let place = |key| Place::at_offset(path, text, locate(text, &[PathStep::Key(key)]).unwrap_or(0));
    let seen = |value: Option<serde_json::Value>| value.map_or("is missing".to_owned(), |value| format!("is {value}"));
    if header.format.as_ref().and_then(|value| value.as_str()) != Some(FORMAT) {
        return Err(Diagnostic::new("G702", place("format"), seen(header.format))
            .element("key", "format")
            .expected(format!("\"{FORMAT}\""))
            .fix("give a file that `regrasp grasps` wrote")
            .into());
    }
    if header.format_version.as_ref().and_then(serde_json::Value::as_u64) == Some(u64::from(FORMAT_VERSION)) {
        return Ok(());
    }
    Err(Diagnostic::new("G703", place("format_version"), seen(header.format_version))
        .element("key", "format_version")
        .expected(FORMAT_VERSION.to_string())
        .fix("use a version of regrasp that reads it, or make the list again")
        .into())
}
