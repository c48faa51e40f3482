//! Pages of plans.

use crate::error;
use crate::guard::guarded;
use crate::model::Scene;
use crate::plan::Plan;
use pyo3::prelude::*;
use regrasp::plan::check::{CheckSettings, check};
use regrasp::viewer::page::html;
use regrasp::viewer::story::{Outcome, Telling, tell};

/// The page of `plan` in `scene` as it was read, judged by the checker: one HTML file.
#[pyfunction]
pub fn page(py: Python<'_>, plan: &Plan, scene: &Scene, title: Option<String>) -> PyResult<String> {
    guarded(py, || {
        let made = py.detach(|| {
            let loaded = &scene.loaded;
            let task = loaded.task_for(&plan.plan.query);
            let query = task.query(plan.plan.seed);
            let report = check((&loaded.scene, &loaded.state), Some(&query), &plan.plan, &CheckSettings::default());
            let telling = Telling {
                task: loaded.manipulation_of(task),
                query: None,
                outcome: Outcome::Planned { plan: &plan.plan, report: &report },
                title: title.as_deref(),
                facts: Vec::new(),
                roadmap: None,
                packages: scene.packages(),
            };
            tell(&telling).map(|story| html(&story))
        });
        made.map_err(|problem| error::argument(py, "view", "scene", problem, "a scene with a hand that can be drawn"))
    })
}
