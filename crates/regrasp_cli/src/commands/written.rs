//! What all that plans has in common: its limits, and how a plan is written.

use crate::outputs::Output;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::files;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// The files of a plan that goes to `path`: the plan, or the rejected one.
pub fn of_plan(path: &Path) -> [Output; 2] {
    [Output::new("--output", path), Output::beside("--output", rejected_path(path))]
}

/// Writes a plan file to `output`, or to stdout.
pub fn write(output: Option<&Path>, bytes: &str, talk: &Talk) -> Result<(), Stop> {
    let Some(path) = output else {
        if talk.is_json() {
            let as_in_file: serde_json::Value = serde_json::from_str(bytes).unwrap_or_default();
            talk.event("written", json!({ "sha256": files::sha256(bytes.as_bytes()), "plan": as_in_file }));
        } else {
            talk.data(bytes);
        }
        return Ok(());
    };
    files::write_atomic(path, bytes.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
    let sha256 = files::sha256(bytes.as_bytes());
    talk.event("written", json!({ "path": path, "sha256": sha256 }));
    talk.say(format!("wrote  {}   sha256 {sha256}", path.display()));
    Ok(())
}

/// What a search may use.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Configurations looked at.
    pub max_work: u64,
    /// Wall-clock time.
    pub time_limit: Option<Duration>,
    /// Wall-clock time for a better plan after the first.
    pub improve_for: Option<Duration>,
    /// Set by Ctrl-C.
    pub cancelled: Arc<AtomicBool>,
}

/// Threads of this machine.
pub fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get)
}

/// Keeps a rejected plan for a bug report, beside where the plan would have gone: never under its name.
pub fn rejected(output: Option<&Path>, bytes: &str, talk: &Talk) -> Stop {
    if let Some(path) = output {
        let kept = rejected_path(path);
        match files::write_atomic(&kept, bytes.as_bytes()) {
            Ok(()) => {
                talk.event("rejected", json!({ "path": kept }));
                talk.say(format!("kept   {}   for a bug report; it is not a plan", kept.display()));
            }
            Err(error) => talk.note(&format!("{} cannot be written: {error}", kept.display())),
        }
    }
    Stop::Rejected
}

/// `plan.json` becomes `plan.json.rejected.json`.
fn rejected_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".rejected.json");
    path.with_file_name(name)
}
