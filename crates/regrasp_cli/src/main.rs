//! The command line: arguments in, one function per command, exit codes out.
//!
//! Exit codes: 0 ok, 1 no plan or plan rejected, 2 bad input, 3 internal error, 130 interrupted.

/// Arguments, as clap reads them.
mod args;
/// One file per command.
mod commands;
/// The finger gait of a plan as an SVG picture.
mod gait_chart;
/// Ctrl-C, SIGTERM, and the promise to stop within 100 ms.
mod interrupt;
/// What the checker said, in words and as an event.
mod judge;
/// Models from disk, with what the environment says about packages.
mod load;
/// What is printed while a search runs.
mod progress;
/// How a command ends, other than well.
mod stop;
/// Data to stdout, talk to stderr.
mod talk;

use clap::Parser;
use std::process::ExitCode;
use std::sync::Mutex;

/// What the panic hook caught: message and place.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|info| {
        if let Ok(mut slot) = PANIC.lock() {
            slot.get_or_insert_with(|| info.to_string());
        }
    }));
    let arguments = args::Arguments::parse();
    let talk = talk::Talk::new(arguments.common.json, arguments.common.quiet);
    let code = match std::panic::catch_unwind(|| commands::run(&arguments, &talk)) {
        Ok(Ok(())) => 0,
        Ok(Err(stop)) => {
            talk.stop(&stop);
            stop.exit_code()
        }
        Err(_) => {
            let message = PANIC.lock().ok().and_then(|mut slot| slot.take()).unwrap_or_default();
            let stop = stop::Stop::Internal(message);
            talk.stop(&stop);
            stop.exit_code()
        }
    };
    talk.result(code);
    ExitCode::from(code)
}
