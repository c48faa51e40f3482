//! The command line: arguments in, one function per command, exit codes out.
//!
//! Exit codes: 0 ok, 1 no plan or plan rejected, 2 bad input, 3 internal error, 130 interrupted.

/// Arguments, as clap reads them.
mod args;
/// One file per command.
mod commands;
/// Failures for people.
mod failure_text;
/// Ctrl-C, SIGTERM, and the promise to stop within 100 ms.
mod interrupt;
/// What the checker said, in words and as an event.
mod judge;
/// What the checker said of a grasp list.
mod judge_grasps;
/// Models from disk, with what the environment says about packages.
mod load;
/// Files that a command writes.
mod outputs;
/// Pages for a browser.
mod pages;
/// What is printed while a search runs.
mod progress;
/// How a command ends, other than well.
mod stop;
/// Data to stdout, talk to stderr.
mod talk;
/// Numbers in words.
mod words;

use clap::Parser;
use regrasp::base::{Diagnostic, Place};
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;
use std::sync::Mutex;
use stop::Stop;

/// What the panic hook caught: message and place.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|info| {
        if let Ok(mut slot) = PANIC.lock() {
            slot.get_or_insert_with(|| info.to_string());
        }
    }));
    let arguments = match args::Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return refused_arguments(&error),
    };
    let talk = talk::Talk::new(arguments.common.json, arguments.common.quiet);
    let code = match guarded(AssertUnwindSafe(|| commands::run(&arguments, &talk))) {
        Ok(()) => 0,
        Err(stop) => {
            talk.stop(&stop);
            stop.exit_code()
        }
    };
    talk.result(code);
    ExitCode::from(with_lost(code, talk.lost(), &talk))
}

/// The exit code where some of the output was lost: no result that nobody got is a good one.
fn with_lost(code: u8, lost: Option<Stop>, talk: &talk::Talk) -> u8 {
    match lost {
        Some(stop) if code < stop.exit_code() => {
            talk.stop(&stop);
            stop.exit_code()
        }
        _ => code,
    }
}

/// Runs `work`; a panic in it is an internal error. Nothing that `work` touched is used afterwards but the talk.
fn guarded(work: AssertUnwindSafe<impl FnOnce() -> Result<(), Stop>>) -> Result<(), Stop> {
    std::panic::catch_unwind(work).unwrap_or_else(|_| {
        let message = PANIC.lock().ok().and_then(|mut slot| slot.take());
        Err(Stop::Internal(message.unwrap_or_else(|| "a panic without a message".into())))
    })
}

/// Help and version on stdout with exit code 0; anything else is bad input.
fn refused_arguments(error: &clap::Error) -> ExitCode {
    let is_error = error.use_stderr();
    if is_error && std::env::args_os().any(|argument| argument == "--json") {
        let talk = talk::Talk::new(true, false);
        let problem = error.to_string();
        let diagnostic = Diagnostic::new("A500", Place::file("command line"), problem.trim());
        talk.event("error", serde_json::json!({ "diagnostics": [diagnostic] }));
        talk.result(2);
    }
    match error.print() {
        Err(lost) if !is_error => {
            let talk = talk::Talk::new(false, false);
            ExitCode::from(with_lost(0, Some(Stop::unwritable("stdout".as_ref(), &lost)), &talk))
        }
        // A closed stderr leaves nobody to tell.
        _ => ExitCode::from(if is_error { 2 } else { 0 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_internal_error_with_exit_code_3() {
        let stop = guarded(AssertUnwindSafe(|| panic!("a broken invariant"))).unwrap_err();
        assert_eq!(stop.exit_code(), 3);
        assert_eq!(guarded(AssertUnwindSafe(|| Err(Stop::Rejected))).unwrap_err().exit_code(), 1);
    }
}
