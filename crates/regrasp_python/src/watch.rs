//! Searches that the interpreter watches.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use regrasp::planners::Progress;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

/// How often a waiting caller looks for signals and progress.
const LISTEN_EVERY: Duration = Duration::from_millis(20);

/// Runs `work` on a thread of its own, without the interpreter's lock, while this one tells `listener` of progress and hears
/// signals. What the listener or a signal handler raises stops the search, and is raised.
pub fn watched<T: Send>(
    py: Python<'_>,
    listener: Option<&Py<PyAny>>,
    work: impl FnOnce(Arc<AtomicBool>, &(dyn Fn(Progress) + Sync)) -> T + Send,
) -> PyResult<T> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let latest = Mutex::new(None);
    py.detach(|| {
        std::thread::scope(|scope| {
            let (ended, end) = mpsc::channel::<()>();
            let flag = Arc::clone(&cancelled);
            let worker = scope.spawn(|| {
                // Dropped at the end, also when `work` panics.
                let _ended = ended;
                work(flag, &|progress| {
                    if let Ok(mut latest) = latest.lock() {
                        *latest = Some(progress);
                    }
                })
            });
            let mut raised = None;
            loop {
                let is_over = end.recv_timeout(LISTEN_EVERY) != Err(mpsc::RecvTimeoutError::Timeout);
                if raised.is_none()
                    && let Err(error) = Python::attach(|py| listen(py, listener, &latest))
                {
                    cancelled.store(true, Ordering::Relaxed);
                    raised = Some(error);
                }
                if is_over {
                    break;
                }
            }
            let result = worker.join().unwrap_or_else(|payload| std::panic::resume_unwind(payload));
            raised.map_or(Ok(result), Err)
        })
    })
}

/// Runs signal handlers (on the main thread), and tells the listener of the latest progress, if it has not heard of it.
fn listen(py: Python<'_>, listener: Option<&Py<PyAny>>, latest: &Mutex<Option<Progress>>) -> PyResult<()> {
    py.check_signals()?;
    let news = latest.lock().ok().and_then(|mut latest| latest.take());
    let (Some(listener), Some(progress)) = (listener, news) else { return Ok(()) };
    let fields = PyDict::new(py);
    fields.set_item("nodes", progress.nodes)?;
    fields.set_item("work", progress.work)?;
    fields.set_item("restarts", progress.restarts)?;
    fields.set_item("angle_left", progress.angle_left)?;
    listener.call1(py, (fields,))?;
    Ok(())
}
