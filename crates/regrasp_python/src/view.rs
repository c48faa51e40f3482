//! Pages and pictures of plans and runs.

use crate::error;
use crate::guard::guarded;
use crate::model::Scene;
use crate::plan::Plan;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use regrasp::base::files;
use regrasp::plan::check::{CheckSettings, OwnQuery, check, query_of};
use regrasp::viewer::page::html;
use regrasp::viewer::runs;
use regrasp::viewer::story::{Outcome, Story, Telling, tell};
use regrasp::viewer::storyboard::StoryboardSettings;
use std::path::{Path, PathBuf};

/// The page of `plan` in `scene` as it was read, judged by the checker: one HTML file.
#[pyfunction]
pub fn page(py: Python<'_>, plan: &Plan, scene: &Scene, title: Option<String>) -> PyResult<String> {
    guarded(py, || {
        let made = py.detach(|| told(plan, scene, title.as_deref()).map(|story| html(&story)));
        made.map_err(|problem| error::argument(py, "view", "scene", problem, DRAWABLE))
    })
}

/// The storyboard of `plan` in `scene`: key frames in one PNG picture.
#[pyfunction]
pub fn storyboard<'py>(
    py: Python<'py>,
    plan: &Plan,
    scene: &Scene,
    frames: usize,
    width: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    guarded(py, || {
        let settings = StoryboardSettings { frames, width, ..StoryboardSettings::default() };
        let made = py.detach(|| {
            let story = told(plan, scene, None)?;
            regrasp::viewer::storyboard::storyboard(&story, &settings).map_err(|error| error.to_string())
        });
        let picture = made.map_err(|problem| error::argument(py, "storyboard", "plan", problem, DRAWABLE))?;
        Ok(PyBytes::new(py, &picture))
    })
}

/// The content of the run file at `path`, a run that makes sense.
#[pyfunction]
pub fn run_file<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyBytes>> {
    guarded(py, || {
        let read = || {
            let bytes = files::read_at_most(&path, runs::format::MAX_BYTES)?;
            runs::format::from_json(&path, &bytes).map(|_| bytes)
        };
        Ok(PyBytes::new(py, &py.detach(read).map_err(|error| error::input(py, &error))?))
    })
}

/// The page of a run, of the content of its file; `plans` are those of its first legs.
#[pyfunction]
pub fn run_page(py: Python<'_>, content: &[u8], plans: Vec<Py<Plan>>, title: Option<String>) -> PyResult<String> {
    guarded(py, || {
        let made = py.detach(|| {
            let run = runs::format::from_json(Path::new("run"), content)?;
            let mut plans: Vec<Option<regrasp::Plan>> =
                plans.iter().map(|plan| Some(plan.get().plan.clone())).collect();
            plans.resize(run.legs.len(), None);
            Ok(runs::html(&run, &plans, title.as_deref()))
        });
        made.map_err(|error: regrasp::InputError| error::input(py, &error))
    })
}

/// What pictures need.
const DRAWABLE: &str = "a scene with a hand that can be drawn";

/// All that a picture of `plan` needs to know.
fn told(plan: &Plan, scene: &Scene, title: Option<&str>) -> Result<Story, String> {
    let loaded = &scene.loaded;
    let task = loaded.task_for(&plan.plan.query);
    let query = query_of(&loaded.scene, task, &plan.plan);
    // A picture shows what the plan does, whatever it was asked.
    let settings = CheckSettings { own_query: OwnQuery::Allowed, ..CheckSettings::default() };
    let report = check((&loaded.scene, &loaded.state), Some(&query), &plan.plan, &settings);
    tell(&Telling {
        task: loaded.manipulation_of(task),
        query: None,
        outcome: Outcome::Planned { plan: &plan.plan, report: &report },
        title,
        facts: Vec::new(),
        roadmap: None,
        packages: scene.packages(),
    })
}
