//! Grasp lists: searched and judged, without the interpreter's lock.

use crate::error;
use crate::guard::guarded;
use crate::model::{Options, load_options};
use pyo3::prelude::*;
use regrasp::base::{Budget, Diagnostic, Place};
use regrasp::export::grasps::to_mjcf;
use regrasp::grasp::list::format;
use regrasp::grasp::record::PlanInput;
use regrasp::grasp_lists::{GraspSettings, list_grasps as search};
use regrasp::plan::check::grasps::{GraspPaths, load_grasp_files, source_of};
use regrasp::plan::check::{CheckSettings, check_grasps as judge};
use regrasp::robot::ContactModel;
use regrasp::robot::import::LoadOptions;
use regrasp::scene::{GraspScene, MeshObject, ObjectSource, load_grasp_scene};
use regrasp::settings::{SettingsError, read};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What is asked of a search; see `regrasp.list_grasps`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct GraspRequest {
    hand: PathBuf,
    object: PathBuf,
    mass: f64,
    friction: f64,
    scale: f64,
    torsion_radius: Option<f64>,
    grasps: Option<usize>,
    frames: Option<u64>,
    settings: Option<String>,
    seed: u64,
    threads: usize,
    time_limit: Option<f64>,
}

/// Finds grasps and judges them: `(list, None)` when the checker accepts it, else `(None, why)`, both as JSON.
#[pyfunction]
pub fn list_grasps(
    py: Python<'_>,
    request: GraspRequest,
    options: Options,
) -> PyResult<(Option<String>, Option<String>)> {
    guarded(py, || {
        let settings = settings(&request).map_err(|diagnostic| error::input(py, &diagnostic.into()))?;
        let contact = request
            .torsion_radius
            .map_or(ContactModel::default(), |torsion_radius| ContactModel::SoftFinger { torsion_radius });
        let options = LoadOptions { contact, ..load_options(options) };
        let found = py.detach(|| searched(&request, &settings, &options));
        found.map_err(|error| error::input(py, &error))
    })
}

/// Judges the list in the file at `path`; the report as JSON. `current` is the current folder.
#[pyfunction]
pub fn check_grasps(py: Python<'_>, path: PathBuf, current: PathBuf, options: Options) -> PyResult<String> {
    guarded(py, || {
        let options = load_options(options);
        let judged = py.detach(|| -> Result<String, regrasp::InputError> {
            let bytes = regrasp::base::files::read_at_most(&path, format::MAX_BYTES)?;
            let list = format::from_json(&path, &bytes)?;
            let own = path.parent().map_or_else(PathBuf::new, Path::to_owned);
            let paths = GraspPaths { folders: vec![own, current], ..GraspPaths::default() };
            let scene = load_grasp_files(&path, &list, &paths, &options)?;
            let report = judge(&scene, &list, &CheckSettings::default(), 1);
            Ok(json!({ "accepted": report.accepted(), "report": report }).to_string())
        });
        judged.map_err(|error| error::input(py, &error))
    })
}

/// The MuJoCo model of the list in the file at `path`, and where it differs from hand and object. `current` is the current folder.
#[pyfunction]
pub fn grasps_mjcf(
    py: Python<'_>,
    path: PathBuf,
    current: PathBuf,
    options: Options,
) -> PyResult<(String, Vec<String>)> {
    guarded(py, || {
        let options = load_options(options);
        let made = py.detach(|| -> Result<_, regrasp::InputError> {
            let bytes = regrasp::base::files::read_at_most(&path, format::MAX_BYTES)?;
            let list = format::from_json(&path, &bytes)?;
            let own = path.parent().map_or_else(PathBuf::new, Path::to_owned);
            let paths = GraspPaths { folders: vec![own, current], ..GraspPaths::default() };
            let scene = load_grasp_files(&path, &list, &paths, &options)?;
            to_mjcf(&scene, &list)
                .map_err(|wrong| Diagnostic::new("A504", Place::file(&path), wrong.to_string()).into())
        });
        let model = made.map_err(|error| error::input(py, &error))?;
        Ok((model.xml, model.notes))
    })
}

/// Defaults, then the JSON, then what has an argument of its own.
fn settings(request: &GraspRequest) -> Result<GraspSettings, Diagnostic> {
    let bad = |problem: String| {
        Diagnostic::new("A504", Place::file("regrasp.list_grasps"), problem).element("argument", "settings")
    };
    let mut settings: GraspSettings = read(request.settings.as_deref()).map_err(|error| match error {
        SettingsError::Unreadable { problem, .. } => bad(problem),
        other => bad(format!("{other:?}")),
    })?;
    settings.grasps = request.grasps.unwrap_or(settings.grasps);
    settings.frames = request.frames.unwrap_or(settings.frames);
    settings.n_threads = request.threads;
    Ok(settings)
}

fn searched(
    request: &GraspRequest,
    settings: &GraspSettings,
    options: &LoadOptions,
) -> Result<(Option<String>, Option<String>), regrasp::InputError> {
    let source = if request.object.extension().is_some_and(|extension| extension == "toml") {
        ObjectSource::Scene(request.object.clone())
    } else {
        ObjectSource::Mesh(MeshObject {
            path: request.object.clone(),
            scale: request.scale,
            mass: request.mass,
            friction: request.friction,
            edge_distance: None,
            crease_angle_deg: None,
        })
    };
    let scene = load_grasp_scene(&request.hand, &source, options)?;
    let deadline = request.time_limit.map(|limit| Instant::now() + Duration::from_secs_f64(limit));
    let budget = Budget { deadline, ..Budget::unlimited() };
    let mut list = match search(&scene.scene.hands[0].hand, &scene.scene.objects[0], settings, request.seed, &budget) {
        Ok(list) => list,
        Err(failure) => return Ok((None, Some(json!({ "failure": failure }).to_string()))),
    };
    list.source = Some(source_of(&request.hand, &source, request.torsion_radius));
    list.inputs = inputs(&scene);
    // The checker starts from files.
    let afresh = load_grasp_scene(&request.hand, &source, options)?;
    let report = judge(&afresh, &list, &CheckSettings::default(), settings.n_threads);
    if report.accepted() {
        return Ok((Some(format::to_json(&list)), None));
    }
    Ok((None, Some(json!({ "rejected": report }).to_string())))
}

fn inputs(scene: &GraspScene) -> Vec<PlanInput> {
    let input = |input: &regrasp::scene::scene::InputFile| PlanInput {
        role: input.role.clone(),
        name: input.name.clone(),
        sha256: input.sha256.clone(),
    };
    scene.scene.inputs.iter().map(input).collect()
}
