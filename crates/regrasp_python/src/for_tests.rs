//! A panic on purpose.

use crate::guard::guarded;
use crate::search::watched;
use pyo3::prelude::*;

/// Panics, on this thread or on a search thread: for tests that nothing gets past the border.
#[pyfunction]
#[pyo3(name = "_panic_for_tests", signature = (message, *, in_search=false))]
pub fn panic_for_tests(py: Python<'_>, message: &str, in_search: bool) -> PyResult<()> {
    guarded(py, || {
        if in_search {
            return watched(py, None, |_, _| panic!("{message}"));
        }
        panic!("{message}")
    })
}
