//! Ctrl-C, SIGTERM, and the promise to stop within 100 ms.

use crate::stop::Stop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time that a search gets to stop by itself and say what it had, before the process ends anyway.
const GRACE: Duration = Duration::from_millis(80);

/// A flag that Ctrl-C or SIGTERM sets. The process ends with exit code 130 shortly after, whatever it is doing.
pub fn flag() -> Result<Arc<AtomicBool>, Stop> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&cancelled);
    // The handler runs on a thread of its own, so it may sleep.
    ctrlc::set_handler(move || {
        seen.store(true, Ordering::Relaxed);
        std::thread::sleep(GRACE);
        std::process::exit(130);
    })
    .map_err(|error| Stop::Internal(format!("cannot listen to Ctrl-C: {error}")))?;
    Ok(cancelled)
}

/// A flag that the first Ctrl-C or SIGTERM sets, for commands that end well with what they have. The second one ends the process
/// with exit code 130.
pub fn patient_flag() -> Result<Arc<AtomicBool>, Stop> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&cancelled);
    ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|error| Stop::Internal(format!("cannot listen to Ctrl-C: {error}")))?;
    Ok(cancelled)
}
