//! Reading and writing `run.json`.

use super::{FORMAT, FORMAT_VERSION, Run, validate};
use regrasp_base::json_place::{PathStep, locate};
use regrasp_base::{Diagnostic, InputError, Place};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Largest file that is read, in bytes.
pub const MAX_BYTES: u64 = 256 << 20;

/// `run` as the bytes of a file.
///
/// Panics if the run holds a NaN or an infinity, which JSON cannot express: runs that were read hold none.
pub fn to_json(run: &Run) -> String {
    let text = serde_json::to_string(run).expect("types of runs always serialise");
    assert!(!has_lost_number(run), "a run with a number that is not finite cannot be written");
    text + "\n"
}

/// Reads a run from `bytes`, which came from `path`.
///
/// Errors, with line and column: not JSON or not the shape of a run (`E801`), another format (`E802`), another version (`E803`), a
/// number that makes no sense (`E804`), the index of a leg or a goal that is not there (`E805`), a quaternion that is not of length one
/// (`E806`), fingertips of which some samples have more than others (`E807`), too much of something (`E808`).
pub fn from_json(path: &Path, bytes: &[u8]) -> Result<Run, InputError> {
    if bytes.len() as u64 > MAX_BYTES {
        let problem = format!("has {} bytes, more than the limit of {MAX_BYTES}", bytes.len());
        return Err(Diagnostic::new("E808", Place::file(path), problem).into());
    }
    let text = regrasp_base::files::text_of(path, bytes.to_vec())?;
    check_header(path, &text)?;
    let run = serde_json::from_str(&text).map_err(|error| syntax_error(path, &error))?;
    validate::validate(path, &text, run)
}

/// True for the text of a run, whether it is a good one or not: it says so.
pub fn is_run(bytes: &[u8]) -> bool {
    serde_json::from_slice::<Header>(bytes)
        .is_ok_and(|header| header.format.as_ref().and_then(|value| value.as_str()) == Some(FORMAT))
}

/// Where the plan of leg `index` (from 0) of the run at `path` is: `run.leg1.json` beside `run.json`.
pub fn leg_path(path: &Path, index: usize) -> PathBuf {
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    path.with_file_name(format!("{stem}.leg{}.json", index + 1))
}

/// True where a number would be written as `null`.
fn has_lost_number(run: &Run) -> bool {
    validate::numbers(run).any(|(_, value)| !value.is_finite())
}

fn syntax_error(path: &Path, error: &serde_json::Error) -> Diagnostic {
    let place =
        Place { file: path.to_owned(), line: Some(error.line() as u32), column: Some(error.column().max(1) as u32) };
    let message = error.to_string();
    // serde_json repeats the place at the end of its message.
    let problem = message.rsplit_once(" at line ").map_or(message.as_str(), |(problem, _)| problem);
    Diagnostic::new("E801", place, problem).expected("a run as in docs/reference/run-format.md")
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
        return Err(Diagnostic::new("E802", place("format"), seen(header.format))
            .element("key", "format")
            .expected(format!("\"{FORMAT}\""))
            .fix("give a file that `RunLog.save` of regrasp.execute wrote")
            .into());
    }
    if header.format_version.as_ref().and_then(serde_json::Value::as_u64) == Some(u64::from(FORMAT_VERSION)) {
        return Ok(());
    }
    Err(Diagnostic::new("E803", place("format_version"), seen(header.format_version))
        .element("key", "format_version")
        .expected(FORMAT_VERSION.to_string())
        .fix("use the version of regrasp that wrote it")
        .into())
}
