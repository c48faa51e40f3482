//! Data to stdout, talk to stderr; with `--json` one JSON object per line on stdout and only errors on stderr.
//!
//! Everything that came from a file goes through `printable` on its way to a terminal.

use crate::stop::Stop;
use regrasp::base::diagnostic::{printable, printable_line};
use serde_json::{Value, json};
use std::io::{self, IsTerminal, Write};
use std::sync::Mutex;

/// Where output goes.
#[derive(Debug)]
pub struct Talk {
    json: bool,
    quiet: bool,
    // Progress may come from a search thread while the main thread talks. Holds the first error of stdout.
    lost: Mutex<Option<io::Error>>,
}

impl Talk {
    /// How to talk.
    pub fn new(json: bool, quiet: bool) -> Self {
        Talk { json, quiet, lost: Mutex::new(None) }
    }

    /// True with `--json`.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// True when somebody may be watching stderr.
    pub fn is_watched(&self) -> bool {
        io::stderr().is_terminal()
    }

    /// A line of talk: nothing with `--quiet` or `--json`. Names in it may come from files: whatever they hold, it stays one line.
    pub fn say(&self, line: impl AsRef<str>) {
        if !self.quiet && !self.json {
            self.line_to_stderr(&printable_line(line.as_ref()));
        }
    }

    /// An event for programs: a line of JSON on stdout, only with `--json`.
    pub fn event(&self, name: &str, mut fields: Value) {
        if self.json {
            if let Some(map) = fields.as_object_mut() {
                map.insert("event".into(), json!(name));
            }
            self.write_stdout(&format!("{fields}\n"));
        }
    }

    /// Data for stdout.
    pub fn data(&self, text: &str) {
        self.write_stdout(text);
    }

    /// Why stdout holds less than was written to it: a full disk, a reader that went away. No command that lost some of its
    /// output ends well.
    pub fn lost(&self) -> Option<Stop> {
        let lost = self.lost.lock().ok()?;
        lost.as_ref().map(|error| Stop::unwritable("stdout".as_ref(), error))
    }

    /// A remark that a user should not miss: shown unless `--quiet`, and an event.
    pub fn note(&self, text: &str) {
        self.say(format!("note   {text}"));
        self.event("note", json!({ "text": text }));
    }

    /// Says why the command stopped. Errors are shown even with `--quiet`.
    pub fn stop(&self, stop: &Stop) {
        match stop {
            Stop::BadInput(error) => {
                self.event("error", json!({ "diagnostics": error.diagnostics, "more": error.n_more }));
                self.line_to_stderr(&format!("error: {error}"));
            }
            Stop::NoPlan(failure) => {
                self.event("no_plan", json!({ "failure": failure }));
                if !self.json {
                    self.line_to_stderr(crate::failure_text::failure_text(failure).trim_end());
                }
            }
            Stop::NoRobotPlan(failure) => {
                self.event("no_plan", json!({ "failure": failure }));
                if !self.json {
                    self.line_to_stderr(crate::failure_text::robot_failure_text(failure).trim_end());
                }
            }
            Stop::NoGrasp(failure) => {
                self.event("no_grasp", json!({ "failure": failure }));
                if !self.json {
                    self.line_to_stderr(crate::failure_text::grasp_failure_text(failure).trim_end());
                }
            }
            Stop::Rejected => {}
            Stop::Interrupted => self.line_to_stderr("interrupted"),
            Stop::Internal(message) => {
                self.event("internal_error", json!({ "message": message }));
                self.line_to_stderr(&format!(
                    "internal error: {}\n\
                     This is a bug in regrasp, not in your files. Please report it with the command line, the files it \
                     names, and this text:\n  regrasp {} on {} {}, {}",
                    message.trim(),
                    env!("CARGO_PKG_VERSION"),
                    std::env::consts::OS,
                    std::env::consts::ARCH,
                    concat!(env!("CARGO_PKG_REPOSITORY"), "/issues"),
                ));
            }
        }
    }

    /// The last event: the exit code.
    pub fn result(&self, exit_code: u8) {
        self.event("result", json!({ "exit_code": exit_code }));
    }

    fn write_stdout(&self, text: &str) {
        let Ok(mut lost) = self.lost.lock() else { return };
        if lost.is_some() {
            return;
        }
        let mut stdout = io::stdout().lock();
        *lost = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).err();
    }

    fn line_to_stderr(&self, line: &str) {
        let _guard = self.lost.lock();
        // A closed stderr leaves nobody to tell.
        let _ = writeln!(io::stderr(), "{}", printable(line));
    }
}
