//! Rust errors as Python exceptions, which `python/regrasp/_errors.py` defines.

use pyo3::prelude::*;
use regrasp::InputError;
use regrasp::base::{Diagnostic, Place};
use serde_json::{Value, json};

/// `regrasp.InputError` with all its diagnostics.
pub fn input(py: Python<'_>, error: &InputError) -> PyErr {
    let diagnostics: Vec<Value> = error.diagnostics.iter().map(diagnostic).collect();
    raised(py, "_input_error", (error.to_string(), Value::Array(diagnostics).to_string()))
}

fn diagnostic(diagnostic: &Diagnostic) -> Value {
    json!({
        "code": diagnostic.code,
        // A name that is not UTF-8 is no reason to lose the rest.
        "file": diagnostic.place.file.to_string_lossy(),
        "line": diagnostic.place.line,
        "column": diagnostic.place.column,
        "element": diagnostic.element,
        "problem": diagnostic.problem,
        "expected": diagnostic.expected,
        "fix": diagnostic.fix,
    })
}

/// `regrasp.InputError` for an argument of a Python function that makes no sense.
pub fn argument(py: Python<'_>, function: &str, name: &str, problem: impl Into<String>, expected: &str) -> PyErr {
    let diagnostic = Diagnostic::new("A510", Place::file(function), problem).element("argument", name);
    input(py, &diagnostic.expected(expected).into())
}

/// `regrasp.InternalError`, with what a report of the bug needs.
pub fn internal(py: Python<'_>, message: &str) -> PyErr {
    let text = format!(
        "{}\nThis is a bug in regrasp, not in your files. Please report it with the call, the files it names, and this \
         text:\n  regrasp {} on {} {}, {}",
        message.trim(),
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        concat!(env!("CARGO_PKG_REPOSITORY"), "/issues"),
    );
    raised(py, "InternalError", (text,))
}

/// The exception that `maker` in `regrasp._errors` makes.
fn raised<'py>(py: Python<'py>, maker: &str, arguments: impl pyo3::call::PyCallArgs<'py>) -> PyErr {
    let made = py.import("regrasp._errors").and_then(|module| module.getattr(maker)?.call1(arguments));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}
