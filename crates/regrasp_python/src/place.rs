//! Where to hold an object.

use crate::error;
use crate::guard::guarded;
use crate::model::{Options, load_options};
use crate::watch::watched;
use pyo3::prelude::*;
use regrasp::base::{Diagnostic, files};
use regrasp::placing::{Asked, of_draft};
use regrasp::planners::in_hand::placing::place as find_places;
use regrasp::scene::load_scene_text;
use regrasp::scene_text::Turn;
use regrasp::{Budget, Failure, InHandQuery, InHandSettings, InputError};
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What is asked for; see `regrasp.place`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Request {
    hand: PathBuf,
    object: String,
    output: PathBuf,
    turns: Vec<String>,
    mass: Option<f64>,
    friction: Option<f64>,
    scale: Option<String>,
    solid: Option<String>,
    torsion_radius: Option<f64>,
    alternatives: usize,
    hold: bool,
    seed: u64,
    time_limit: Option<f64>,
    max_work: u64,
}

/// Finds poses and writes scenes: their paths, or none and the failure as JSON.
#[pyfunction]
pub fn place(py: Python<'_>, request: Request, options: Options) -> PyResult<(Vec<PathBuf>, Option<String>)> {
    guarded(py, || {
        let options = load_options(options);
        let turns: Result<Vec<Turn>, String> = request.turns.iter().map(|turn| Turn::read(turn)).collect();
        let turns = turns
            .map_err(|expected| error::argument(py, "place", "turns", format!("are {:?}", request.turns), &expected))?;
        if turns.is_empty() {
            return Err(error::argument(py, "place", "turns", "are empty", "at least one turn"));
        }
        let asked = Asked {
            output: &request.output,
            hand: &request.hand,
            object: &request.object,
            turns: &turns,
            mass: request.mass,
            friction: request.friction,
            scale: request.scale.as_deref(),
            solid: request.solid.as_deref(),
            torsion_radius: request.torsion_radius,
            packages: &options.resolve.packages,
        };
        let deadline = request.time_limit.map(|limit| Instant::now() + Duration::from_secs_f64(limit));
        let found = watched(py, None, |cancelled, _| -> Result<Result<Vec<PathBuf>, Failure>, InputError> {
            let text = asked.scene()?;
            let draft = text.text(None);
            let loaded = load_scene_text(&request.output, draft.clone().into_bytes(), &options)
                .map_err(|error| of_draft(error, &request.output, &draft))?;
            let mut queries: Vec<InHandQuery> =
                loaded.tasks.iter().filter_map(|task| task.query(request.seed).as_in_hand().cloned()).collect();
            if request.hold {
                queries = queries.iter().take(1).map(InHandQuery::held).collect();
            }
            let settings = InHandSettings { n_threads: 1, ..InHandSettings::default() };
            let budget = Budget { max_work: request.max_work, deadline, improve_for: None, cancelled };
            let wanted = (request.seed, 1 + request.alternatives);
            let places = match find_places(&loaded.view(), &queries, &settings, wanted, &budget, &|_| {}) {
                Ok(found) => found.places,
                Err(failure) => return Ok(Err(failure)),
            };
            let mut paths = Vec::new();
            for (index, place) in places.iter().enumerate() {
                let path = asked.path(index);
                let written = files::write_atomic(&path, text.text(Some(&place.world_from_object)).as_bytes());
                written.map_err(|error| {
                    let place = regrasp::base::Place::file(&path);
                    InputError::from(Diagnostic::new("F003", place, format!("cannot be written: {error}")))
                })?;
                paths.push(path);
            }
            Ok(Ok(paths))
        })?;
        match found.map_err(|error| error::input(py, &error))? {
            Ok(paths) => Ok((paths, None)),
            Err(failure) => Ok((Vec::new(), Some(json!(failure).to_string()))),
        }
    })
}
