//! `regrasp growth`: how loading and planning grow with fingers, triangles, obstacles and threads.

use super::rows::{make_folder_of, say_row};
use super::written::available_threads;
use crate::args;
use crate::interrupt;
use crate::outputs::refuse_unwritable;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{duration, grouped};
use regrasp::InHandSettings;
use regrasp::base::files;
use regrasp::plan::check::Level;
use regrasp::scene::LoadedScene;
use regrasp_bench::growth::{Curve, GrowthRow, Point, batch, header, line, pictures, table, timed_load, write_scene};
use regrasp_bench::row::Judge;
use regrasp_bench::{Problem, Row, RunSettings, run as run_one};
use serde_json::json;
use std::path::Path;
use std::sync::atomic::Ordering;

/// Queries of a batch per trial of the other curves: a batch has to last long enough to be timed.
const BATCH_PER_TRIAL: u64 = 10;

/// Measures every point of every curve asked for, then writes rows and pictures.
pub fn run(arguments: &args::Growth, talk: &Talk) -> Result<(), Stop> {
    let curves: Vec<Curve> = Curve::ALL.into_iter().filter(|curve| is_asked_for(*curve, &arguments.curves)).collect();
    let up_to = arguments.up_to.unwrap_or(u64::MAX);
    for curve in &curves {
        if curve.points(up_to).is_empty() {
            let expected = format!("at least {}, where the curve of {} begins", curve.sizes()[0], curve.name());
            return Err(Stop::argument("A506", "--up-to", format!("is {up_to}"), expected));
        }
    }
    let cancelled = interrupt::flag()?;
    let results = arguments.results.as_ref().unwrap_or(&arguments.output);
    for file in [arguments.output.join("scene.toml"), results.join("rows.csv")] {
        make_folder_of(&file)?;
        refuse_unwritable(&file)?;
    }
    let settings = RunSettings {
        planner: InHandSettings { n_threads: 1, ..InHandSettings::plain() },
        tracking: Default::default(),
        max_work: arguments.max_work,
        time_limit: Some(arguments.time_limit),
        judge: Judge::Checker(Level::Geometry),
        improve_for: None,
        cancelled,
    };
    let mut is_rejected = false;
    for curve in curves {
        let mut rows = Vec::new();
        for point in curve.points(up_to) {
            rows.extend(measure(&point, arguments, &settings, talk)?);
        }
        is_rejected |= rows.iter().any(|row| row.row.accepted == Some(false));
        write(curve, &rows, results, talk)?;
    }
    if is_rejected { Err(Stop::Rejected) } else { Ok(()) }
}

/// True for every curve where none is named.
fn is_asked_for(curve: Curve, named: &[String]) -> bool {
    named.is_empty() || named.iter().any(|name| name == curve.name())
}

/// Writes and loads the scene of a point, and plans in it.
fn measure(
    point: &Point,
    arguments: &args::Growth,
    settings: &RunSettings,
    talk: &Talk,
) -> Result<Vec<GrowthRow>, Stop> {
    let folder = &arguments.output;
    let path = write_scene(point, folder).map_err(|error| Stop::unwritable(folder, &error))?;
    let (loaded, load) = timed_load(&path)?;
    talk.say(format!("scene  {}   loaded in {}", path.display(), duration(load.wall_s)));
    let (trials, batch_s) = plan(point.curve, point.size, &loaded, arguments.trials, settings);
    if settings.cancelled.load(Ordering::Relaxed) {
        return Err(Stop::Interrupted);
    }
    trials.iter().for_each(|row| say_row(row, talk));
    say_point(point, load.wall_s, &trials, batch_s, talk);
    let cores = available_threads();
    let row = |row: Row| GrowthRow {
        curve: point.curve,
        object: point.object.to_owned(),
        size: point.size,
        load,
        batch_s,
        cores,
        row,
    };
    Ok(trials.into_iter().map(row).collect())
}

/// Trials one after the other; or, over threads, a batch of them at the same time, with its wall-clock time in seconds.
fn plan(
    curve: Curve,
    size: u64,
    loaded: &LoadedScene,
    n_trials: u64,
    settings: &RunSettings,
) -> (Vec<Row>, Option<f64>) {
    if curve == Curve::Threads {
        let (rows, seconds) = batch(loaded, (n_trials * BATCH_PER_TRIAL) as usize, size as usize, settings);
        return (rows, Some(seconds));
    }
    let of_seed = |seed: u64| {
        let query = loaded.task().query(seed);
        run_one(Problem { task: loaded.manipulation(), query: &query, seed }, settings)
    };
    let goes_on = |_: &u64| !settings.cancelled.load(Ordering::Relaxed);
    ((0..n_trials).take_while(goes_on).map(of_seed).collect(), None)
}

/// Says how a point went.
fn say_point(point: &Point, load_s: f64, trials: &[Row], batch_s: Option<f64>, talk: &Talk) {
    let solved: Vec<&Row> = trials.iter().filter(|row| row.status == "solved").collect();
    let mean_s = solved.iter().map(|row| row.plan_cpu_s).sum::<f64>() / solved.len() as f64;
    talk.say(format!(
        "point  {:<9} {:>9}  {:<9}  solved {} of {}{}{}",
        point.curve.name(),
        grouped(point.size),
        point.object,
        solved.len(),
        trials.len(),
        if solved.is_empty() { String::new() } else { format!(", mean {}", duration(mean_s)) },
        batch_s.map_or(String::new(), |seconds| format!(", all in {}", duration(seconds))),
    ));
    talk.event(
        "point",
        json!({
            "curve": point.curve.name(), "object": point.object, "size": point.size, "load_s": load_s,
            "trials": trials.len(), "solved": solved.len(), "batch_s": batch_s,
        }),
    );
}

/// Writes rows and picture of a curve and shows its table.
fn write(curve: Curve, rows: &[GrowthRow], folder: &Path, talk: &Talk) -> Result<(), Stop> {
    let text: String = std::iter::once(header()).chain(rows.iter().map(line)).collect();
    for (name, text) in [(format!("{}.csv", curve.name()), text), pictures(curve, rows)] {
        let path = folder.join(name);
        files::write_atomic(&path, text.as_bytes()).map_err(|error| Stop::unwritable(&path, &error))?;
        talk.say(format!("wrote  {}", path.display()));
    }
    if !talk.is_json() {
        talk.data(&table(curve, rows));
    }
    Ok(())
}
