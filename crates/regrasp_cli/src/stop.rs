//! How a command ends, other than well.

use regrasp::base::{Diagnostic, Place};
use regrasp::{Failure, InputError};
use std::path::Path;

/// Why a command stopped; each has its exit code.
#[derive(Debug)]
pub enum Stop {
    /// The input cannot be used: 2.
    BadInput(InputError),
    /// The search found no plan, and says why: 1.
    NoPlan(Box<Failure>),
    /// The search found no plan for a task of a whole robot, and says why: 1.
    NoRobotPlan(Box<Failure>),
    /// The search found no grasp, and says why: 1.
    NoGrasp(Box<Failure>),
    /// The checker or a campaign said no, and it was printed already: 1.
    Rejected,
    /// The user asked to stop: 130.
    Interrupted,
    /// A broken invariant: 3.
    Internal(String),
}

impl Stop {
    /// The exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Stop::NoPlan(_) | Stop::NoRobotPlan(_) | Stop::NoGrasp(_) | Stop::Rejected => 1,
            Stop::BadInput(_) => 2,
            Stop::Internal(_) => 3,
            Stop::Interrupted => 130,
        }
    }

    /// A file that cannot be written (`F003`).
    pub fn unwritable(path: &Path, error: &std::io::Error) -> Stop {
        Stop::BadInput(
            Diagnostic::new("F003", Place::file(path), format!("cannot be written: {error}")).fix(fix_of(error)).into(),
        )
    }

    /// An argument that makes no sense (`A5xx`).
    pub fn argument(
        code: &'static str,
        argument: &str,
        problem: impl Into<String>,
        expected: impl Into<String>,
    ) -> Stop {
        let place = Place::file("command line");
        Stop::BadInput(Diagnostic::new(code, place, problem).element("argument", argument).expected(expected).into())
    }
}

/// What can be done about a file that could not be written.
fn fix_of(error: &std::io::Error) -> &'static str {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => "name a file in a folder that exists",
        ErrorKind::PermissionDenied => "allow writing to it and to its folder, or name another file",
        ErrorKind::ReadOnlyFilesystem => "name a file on a disk that can be written to",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "make room on the disk, or name a file on another one",
        ErrorKind::IsADirectory => "name a file, not a folder",
        ErrorKind::BrokenPipe => "let the program that reads the output read all of it",
        _ => "name another file",
    }
}

impl From<InputError> for Stop {
    fn from(error: InputError) -> Self {
        Stop::BadInput(error)
    }
}
