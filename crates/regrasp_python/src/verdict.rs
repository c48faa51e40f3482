//! What judging is asked and what it says, as the Python package has it.

use regrasp::base::{Diagnostic, Place};
use regrasp::plan::check::{Level, Report};
use serde_json::json;

/// The level of this name. Errors: there is none (`A503`).
pub fn level_named(name: &str) -> Result<Level, Diagnostic> {
    Level::named(name).ok_or_else(|| {
        bad("A503", format!("is \"{name}\""))
            .element("argument", "level")
            .expected("\"geometry\", \"forces\" or \"motion\"")
    })
}

/// An error of an argument of `regrasp.plan`.
pub fn bad(code: &'static str, problem: String) -> Diagnostic {
    Diagnostic::new(code, Place::file("regrasp.plan"), problem)
}

/// What the checker said, as JSON.
pub fn report(report: &Report) -> String {
    let mut value = json!(report);
    for (entry, violation) in value["violations"].as_array_mut().into_iter().flatten().zip(&report.violations) {
        entry["text"] = violation.to_string().into();
    }
    value.to_string()
}
