//! Plans of whole robots: files, judging, exports.

use crate::error;
use crate::guard::guarded;
use crate::model::Scene;
use crate::verdict::{level_named, report};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use regrasp::AnyPlan;
use regrasp::base::{Diagnostic, Place, files};
use regrasp::export::{ExportError, controller_groups, robot_to_mjcf, robot_to_npz, robot_to_ros2};
use regrasp::plan::check::{CheckSettings, check_any, find_scene_among};
use regrasp::plan::format;
use std::path::PathBuf;

/// A plan of a whole robot.
#[pyclass(frozen, module = "regrasp._regrasp")]
pub struct RobotPlan {
    /// The plan.
    pub plan: regrasp::RobotPlan,
}

fn refused(py: Python<'_>, diagnostic: Diagnostic) -> PyErr {
    error::input(py, &diagnostic.into())
}

fn unfit(py: Python<'_>, wrong: &ExportError) -> PyErr {
    let (expected, fix) = wrong.expected_and_fix();
    let diagnostic = Diagnostic::new(wrong.code(), Place::file("plan"), wrong.to_string());
    refused(py, diagnostic.expected(expected).fix(fix))
}

#[pymethods]
impl RobotPlan {
    /// Reads the plan file at `path`.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        guarded(py, || {
            let read = || format::robot_from_json(&path, &files::read(&path)?);
            Ok(RobotPlan { plan: py.detach(read).map_err(|error| error::input(py, &error))? })
        })
    }

    /// Reads a plan from the content of a plan file; errors call it `name`.
    #[staticmethod]
    fn parse(py: Python<'_>, content: &[u8], name: PathBuf) -> PyResult<Self> {
        guarded(py, || {
            let read = || format::robot_from_json(&name, content);
            Ok(RobotPlan { plan: py.detach(read).map_err(|error| error::input(py, &error))? })
        })
    }

    /// The bytes of its plan file.
    fn to_json<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        guarded(py, || Ok(PyBytes::new(py, py.detach(|| format::robot_to_json(&self.plan)).as_bytes())))
    }

    /// The bytes of an archive of arrays for numpy.
    fn to_npz<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        guarded(py, || {
            let npz = py.detach(|| robot_to_npz(&self.plan)).map_err(|wrong| unfit(py, &wrong))?;
            Ok(PyBytes::new(py, &npz))
        })
    }

    /// Trajectories of controllers as YAML, one document for each group of the robot in `scene`.
    fn to_ros2(&self, py: Python<'_>, scene: &Scene) -> PyResult<String> {
        guarded(py, || {
            let robots = &scene.loaded.scene.robots;
            let robot = robots.iter().find(|robot| self.plan.robots.iter().any(|own| own.name == robot.name));
            let groups = robot.map(controller_groups).unwrap_or_default();
            py.detach(|| robot_to_ros2(&self.plan, &groups)).map_err(|wrong| unfit(py, &wrong))
        })
    }

    /// The MuJoCo model of the scene, and where it differs from it.
    fn to_mjcf(&self, py: Python<'_>, scene: &Scene) -> PyResult<(String, Vec<String>)> {
        guarded(py, || {
            let around = (&scene.loaded.scene, &scene.loaded.state);
            let made = py.detach(|| robot_to_mjcf(around, &self.plan));
            let model = made.map_err(|problem| refused(py, Diagnostic::new("C408", Place::file("plan"), problem)))?;
            Ok((model.xml, model.notes))
        })
    }

    /// Judges the plan in `scene` as it was read, and returns the report as JSON.
    fn check(&self, py: Python<'_>, scene: &Scene, level: &str) -> PyResult<String> {
        guarded(py, || {
            let level = level_named(level).map_err(|diagnostic| refused(py, diagnostic))?;
            let judged = py.detach(|| {
                let loaded = &scene.loaded;
                let query = loaded.task_for(&self.plan.query).query(self.plan.seed);
                let settings = CheckSettings { level, ..CheckSettings::default() };
                let plan = AnyPlan::Robot(Box::new(self.plan.clone()));
                check_any((&loaded.scene, &loaded.state), Some(&query), &plan, &settings)
            });
            Ok(report(&judged))
        })
    }

    /// The scene file that the plan, at `path`, names, looked for as `regrasp check` does; `current` is the current folder.
    fn find_scene(&self, py: Python<'_>, path: PathBuf, current: PathBuf) -> PyResult<PathBuf> {
        guarded(py, || {
            find_scene_among(&path, &self.plan.inputs, Some(&current)).map_err(|error| error::input(py, &error))
        })
    }
}
