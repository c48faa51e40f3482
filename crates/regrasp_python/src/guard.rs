//! No panic crosses the border: PyO3 would raise it as a `BaseException`, which `except Exception` lets through.

use crate::error;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;

/// What the panic hook heard first and nobody has taken yet: message and place.
static HEARD: Mutex<Option<String>> = Mutex::new(None);

/// Keeps messages of panics instead of printing them. The hook is this library's own: it has its own copy of `std`.
pub fn catch_messages() {
    std::panic::set_hook(Box::new(|info| {
        if let Ok(mut heard) = HEARD.lock() {
            heard.get_or_insert_with(|| info.to_string());
        }
    }));
}

/// Runs `work`; a panic in it, or in a thread that it waits for, becomes `regrasp.InternalError`.
///
/// Models never change after loading, so nothing that `work` touched can be left half changed.
pub fn guarded<T>(py: Python<'_>, work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let said = payload.downcast_ref::<String>().cloned();
        let said = said.or_else(|| payload.downcast_ref::<&str>().map(|&text| text.to_owned()));
        let heard = HEARD.lock().ok().and_then(|mut heard| heard.take());
        Err(error::internal(py, &heard.or(said).unwrap_or_else(|| "a panic without a message".into())))
    })
}

/// Panics, on this thread or on a search thread: for tests that nothing gets past the border.
#[pyfunction]
#[pyo3(name = "_panic_for_tests", signature = (message, *, in_search=false))]
pub fn panic_for_tests(py: Python<'_>, message: &str, in_search: bool) -> PyResult<()> {
    guarded(py, || {
        if in_search {
            return crate::search::watched(py, None, |_, _| panic!("{message}"));
        }
        panic!("{message}")
    })
}
