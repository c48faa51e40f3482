//! Plans: files, arrays, exports.

use crate::error;
use crate::guard::guarded;
use crate::model::Scene;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use regrasp::base::{Diagnostic, Place, files};
use regrasp::export::{ExportError, PlanArrays, to_mjcf, to_npz, to_ros2};
use regrasp::plan::format;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A plan that cannot be written in a format, as `InputError`.
fn export_error(py: Python<'_>, wrong: &ExportError) -> PyErr {
    let (expected, fix) = wrong.expected_and_fix();
    let diagnostic = Diagnostic::new(wrong.code(), Place::file("plan"), wrong.to_string());
    error::input(py, &diagnostic.expected(expected).fix(fix).into())
}

/// A plan.
#[pyclass(frozen, module = "regrasp._regrasp")]
pub struct Plan {
    /// The plan.
    pub plan: regrasp::Plan,
}

#[pymethods]
impl Plan {
    /// Reads the plan file at `path`.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        guarded(py, || {
            let read = || format::from_json(&path, &files::read(&path)?);
            Ok(Plan { plan: py.detach(read).map_err(|error| error::input(py, &error))? })
        })
    }

    /// Reads a plan from the content of a plan file; errors call it `name`.
    #[staticmethod]
    fn parse(py: Python<'_>, content: &[u8], name: PathBuf) -> PyResult<Self> {
        guarded(py, || {
            let read = || format::from_json(&name, content);
            Ok(Plan { plan: py.detach(read).map_err(|error| error::input(py, &error))? })
        })
    }

    /// The bytes of its plan file.
    fn to_json<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        guarded(py, || Ok(PyBytes::new(py, py.detach(|| format::to_json(&self.plan)).as_bytes())))
    }

    /// The bytes of an archive of arrays for numpy.
    fn to_npz<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        guarded(py, || {
            let npz = py.detach(|| to_npz(&self.plan)).map_err(|wrong| export_error(py, &wrong))?;
            Ok(PyBytes::new(py, &npz))
        })
    }

    /// A ROS 2 trajectory, as YAML.
    fn to_ros2(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, || py.detach(|| to_ros2(&self.plan)).map_err(|wrong| export_error(py, &wrong)))
    }

    /// The MuJoCo model of `scene` with a keyframe per waypoint, and where it differs from the scene.
    fn to_mjcf(&self, py: Python<'_>, scene: &Scene) -> PyResult<(String, Vec<String>)> {
        guarded(py, || {
            let model = py
                .detach(|| to_mjcf(&scene.loaded.manipulation_of(scene.loaded.task_for(&self.plan.query)), &self.plan));
            let model = model
                .map_err(|wrong| error::argument(py, "export_mjcf", "scene", wrong.to_string(), "the plan's scene"))?;
            Ok((model.xml, model.notes))
        })
    }

    /// Everything but the waypoints, as JSON: the keys of a plan file, and of each segment kind, fingers and number of
    /// waypoints.
    fn header(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, || {
            let bare = regrasp::Plan { segments: Vec::new(), ..self.plan.clone() };
            let mut header = json!(bare);
            // These are no part of a plan's own serialisation: files have them in other places.
            for (key, name) in [("query", &self.plan.query), ("hand", &self.plan.hand), ("object", &self.plan.object)] {
                header[key] = name.as_str().into();
            }
            header["held_joints"] = json!(self.plan.held_joints);
            let segments = self.plan.segments.iter().map(|segment| {
                json!({
                    "kind": segment.kind,
                    "moving_finger": segment.moving_finger,
                    "also_moving": segment.also_moving,
                    "rolling_finger": segment.rolling_finger,
                    "held_by": segment.held_by,
                    "n_waypoints": segment.waypoints.len(),
                })
            });
            header["segments"] = Value::Array(segments.collect());
            Ok(header.to_string())
        })
    }

    /// Arrays over all waypoints by name: numpy type, shape, bytes.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        guarded(py, || {
            let arrays = py.detach(|| PlanArrays::new(&self.plan));
            let out = PyDict::new(py);
            for array in arrays.numeric() {
                let bytes = PyBytes::new(py, &array.data.to_bytes());
                out.set_item(array.name, (array.data.numpy_type(), array.shape, bytes))?;
            }
            Ok(out)
        })
    }

    /// Writes `content` to `path`, whole or not at all.
    #[staticmethod]
    fn write(py: Python<'_>, path: PathBuf, content: &[u8]) -> PyResult<()> {
        guarded(py, || py.detach(|| files::write_atomic(&path, content)).map_err(|error| unwritable(py, &path, &error)))
    }
}

/// A file that cannot be written (`F003`).
fn unwritable(py: Python<'_>, path: &Path, error: &std::io::Error) -> PyErr {
    let diagnostic = Diagnostic::new("F003", Place::file(path), format!("cannot be written: {error}"))
        .fix("name a file in a folder that exists and may be written to");
    error::input(py, &diagnostic.into())
}
