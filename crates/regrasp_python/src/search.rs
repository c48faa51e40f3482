//! Searching and judging, without the interpreter's lock; the thread that called keeps an ear for Ctrl-C and for progress.

use crate::error;
use crate::guard::guarded;
use crate::model::Scene;
use crate::plan::Plan;
use crate::robot_plan::RobotPlan;
use crate::verdict::{bad, level_named, report};
use crate::watch::watched;
use pyo3::prelude::*;
use regrasp::base::Diagnostic;
use regrasp::plan::check::{CheckSettings, Level, OwnQuery, Report, check_any, query_of};
use regrasp::plan::format;
use regrasp::scene::Task;
use regrasp::settings::{Argument, Overrides, SettingsError, settings_for};
use regrasp::{AnyPlan, Budget, Failure, PlannerSettings, Query};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What is asked of a search, beside scene and settings; see `regrasp.plan`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Request {
    seed: u64,
    threads: usize,
    max_work: u64,
    time_limit: Option<f64>,
    improve: Option<f64>,
    method: Option<String>,
    margin: Option<f64>,
    improve_work: Option<u64>,
    settings: Option<String>,
    level: String,
    task: Option<String>,
    hold: bool,
    progress: Option<Py<PyAny>>,
}

/// Plans `scene` and judges the plan: `(plan, report)` when the checker accepts it, else `(None, failure)`, both as JSON.
#[pyfunction]
pub fn plan(py: Python<'_>, scene: &Scene, request: Request) -> PyResult<(Option<Plan>, String)> {
    guarded(py, || {
        let task = scene.task(py, request.task.as_deref())?;
        let level = level_named(&request.level).map_err(|diagnostic| error::input(py, &diagnostic.into()))?;
        let settings = settings(task, &request).map_err(|diagnostic| error::input(py, &diagnostic.into()))?;
        let query = asked(py, task.query(request.seed), request.hold)?;
        let started = Instant::now();
        let seconds = |value: Option<f64>| value.map(Duration::from_secs_f64);
        let (deadline, improve_for) =
            (seconds(request.time_limit).map(|limit| started + limit), seconds(request.improve));
        let found = watched(py, request.progress.as_ref(), |cancelled, report| {
            let budget = Budget { max_work: request.max_work, deadline, improve_for, cancelled };
            regrasp::planners::plan(
                (&scene.loaded.scene, &scene.loaded.state),
                &query,
                &settings,
                request.seed,
                &budget,
                report,
            )
        })?;
        let plan = match found {
            Ok(plan) => plan,
            Err(failure) => return Ok((None, failed(&failure))),
        };
        let (plan, report) = py
            .detach(|| judged_as_written(&plan, scene, level, request.hold))
            .map_err(|error| error::input(py, &error))?;
        if report.accepted() {
            return Ok((Some(Plan { plan }), self::report(&report)));
        }
        Ok((None, rejected(&plan, &report)))
    })
}

/// Plans the motion that a task of `scene` asks for, and judges the plan: as [`plan`], for whole robots.
#[pyfunction]
pub fn plan_motion(py: Python<'_>, scene: &Scene, request: Request) -> PyResult<(Option<RobotPlan>, String)> {
    guarded(py, || {
        let task = scene.task(py, request.task.as_deref())?;
        let level = level_named(&request.level).map_err(|diagnostic| error::input(py, &diagnostic.into()))?;
        let settings = settings(task, &request).map_err(|diagnostic| error::input(py, &diagnostic.into()))?;
        let query = task.query(request.seed);
        let started = Instant::now();
        let deadline = request.time_limit.map(|limit| started + Duration::from_secs_f64(limit));
        let found = watched(py, request.progress.as_ref(), |cancelled, report| {
            let budget = Budget { max_work: request.max_work, deadline, improve_for: None, cancelled };
            let around = (&scene.loaded.scene, &scene.loaded.state);
            regrasp::plan_any(around, &query, &settings, request.seed, &budget, report)
        })?;
        let plan = match found {
            Ok(AnyPlan::Robot(plan)) => *plan,
            Ok(AnyPlan::InHand(_)) => {
                let problem = bad("A507", "asks a hand to move an object".into()).element("argument", "task");
                return Err(error::input(
                    py,
                    &problem.expected("a task of kind \"motion\" or \"pick_and_place\"").into(),
                ));
            }
            Err(failure) => return Ok((None, failed(&failure))),
        };
        let judged = py.detach(|| {
            let text = format::robot_to_json(&plan);
            let plan = format::robot_from_json(Path::new("plan.json"), text.as_bytes())
                .expect("a plan just made is a plan file");
            let again = scene.read_again()?;
            let query = again.task_for(&plan.query).query(plan.seed);
            let settings = CheckSettings { level, ..CheckSettings::default() };
            let any = AnyPlan::Robot(Box::new(plan.clone()));
            let report = check_any((&again.scene, &again.state), Some(&query), &any, &settings);
            Ok((plan, report))
        });
        let (plan, report) = judged.map_err(|error: regrasp::InputError| error::input(py, &error))?;
        if report.accepted() {
            return Ok((Some(RobotPlan { plan }), self::report(&report)));
        }
        let text = format::robot_to_json(&plan);
        Ok((None, rejected_text(json!(plan.statistics), text, &report)))
    })
}

/// Judges `plan` in `scene` as it was read, against the query of the plan's seed, and returns the report as JSON.
#[pyfunction]
pub fn check(py: Python<'_>, plan: &Plan, scene: &Scene, level: &str, own_query: bool, hold: bool) -> PyResult<String> {
    guarded(py, || {
        let level = level_named(level).map_err(|diagnostic| error::input(py, &diagnostic.into()))?;
        let loaded = &scene.loaded;
        let query = asked(py, query_of(&loaded.scene, loaded.task_for(&plan.plan.query), &plan.plan), hold)?;
        let judged = py.detach(|| {
            let own_query = if own_query { OwnQuery::Allowed } else { OwnQuery::Refused };
            let settings = CheckSettings { level, own_query, ..CheckSettings::default() };
            regrasp::plan::check::check((&scene.loaded.scene, &scene.loaded.state), Some(&query), &plan.plan, &settings)
        });
        Ok(report(&judged))
    })
}

/// What is asked: `query`, or whether its object can be held at the start.
fn asked(py: Python<'_>, query: Query, hold: bool) -> PyResult<Query> {
    if !hold {
        return Ok(query);
    }
    query.held().ok_or_else(|| {
        let problem = "is for tasks of kind \"in_hand\" only: others start with a given grasp, or hold nothing";
        let diagnostic = bad("A507", problem.into()).element("argument", "hold");
        error::input(py, &diagnostic.expected("a task of kind \"in_hand\"").into())
    })
}

/// The scene file that `plan`, at `path`, names, looked for as `regrasp check` does; `current` is the current folder.
#[pyfunction]
pub fn find_scene(py: Python<'_>, plan: &Plan, path: PathBuf, current: PathBuf) -> PyResult<PathBuf> {
    guarded(py, || {
        regrasp::plan::check::find_scene(&path, &plan.plan, Some(&current)).map_err(|error| error::input(py, &error))
    })
}

/// Judges the bytes that a file of `plan` would have, in a scene that is read afresh: the checker starts from files. A plan that only
/// `holds` is judged against the hold at the scene's start.
fn judged_as_written(
    plan: &regrasp::Plan,
    scene: &Scene,
    level: Level,
    holds: bool,
) -> Result<(regrasp::Plan, Report), regrasp::InputError> {
    let plan = format::from_json(Path::new("plan.json"), format::to_json(plan).as_bytes())
        .expect("a plan just made is a plan file");
    let again = scene.read_again()?;
    let query = again.task_for(&plan.query).query(plan.seed);
    let query = if holds { query.held().unwrap_or(query) } else { query };
    let settings = CheckSettings { level, ..CheckSettings::default() };
    let report = regrasp::plan::check::check((&again.scene, &again.state), Some(&query), &plan, &settings);
    Ok((plan, report))
}

/// Settings for a task of this kind: defaults, then the JSON, then what has an argument of its own.
fn settings(task: &Task, request: &Request) -> Result<PlannerSettings, Diagnostic> {
    let asked = Overrides {
        method: request.method.clone(),
        margin: request.margin,
        improves_for_a_time: request.improve.is_some(),
        improve_work: request.improve_work,
        n_threads: request.threads,
    };
    settings_for(task.kind_name(), request.settings.as_deref(), &asked).map_err(|error| match error {
        SettingsError::Unreadable { problem, .. } => bad("A504", problem)
            .element("argument", "settings")
            .expected("keys and values like \"settings\" in a plan file"),
        SettingsError::Invalid(problem) => bad("A503", problem).element("argument", "settings"),
        SettingsError::OtherMethod { name, problem } => {
            bad("A507", format!("is \"{name}\", which does not plan tasks of this kind: {problem}"))
                .element("argument", "method")
                .fix("leave it out, or name a method of the scene's task")
        }
        SettingsError::NotForTracking { argument, why } => {
            let argument = match argument {
                Argument::Margin => "margin",
                Argument::Improve => "improve",
                Argument::ImproveWork => "improve_work",
            };
            bad("A507", format!("is not for a task of kind \"tracking\": {why}"))
                .element("argument", argument)
                .expected("a task of kind \"in_hand\"")
                .fix("leave it out; `settings` has all of tracking (docs/reference/tracking.md)")
        }
    })
}

/// Why there is no plan, as JSON.
pub fn failed(failure: &Failure) -> String {
    json!(failure).to_string()
}

/// A plan that the checker rejects is a failure, with what a report of the bug needs.
pub fn rejected(plan: &regrasp::Plan, report: &Report) -> String {
    rejected_text(json!(plan.statistics), format::to_json(plan), report)
}

/// As [`rejected`], of a plan of any kind with these statistics and this file.
fn rejected_text(statistics: serde_json::Value, text: String, report: &Report) -> String {
    json!({
        "kind": "rejected",
        "message": format!("the checker rejects the plan that was found: {}", report.violations.first().map_or_else(String::new, ToString::to_string)),
        "advice": "another seed may do; please report this, with the rejected plan",
        "causes": [],
        "leg": null,
        "nearest_miss": null,
        "statistics": statistics,
        "report": serde_json::from_str::<serde_json::Value>(&self::report(report)).unwrap_or_default(),
        "rejected_plan": text,
    })
    .to_string()
}
