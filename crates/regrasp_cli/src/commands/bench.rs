//! `regrasp bench`: plan scenes with many seeds and tabulate; or make the page of CSV files; suites are in `suite`.

use super::rows::{make_folder_of, of_rows, say_row};
use super::suite;
use super::task_bench;
use crate::args::{self, Common};
use crate::interrupt;
use crate::load;
use crate::outputs::{Output, Outputs};
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::counted;
use regrasp::base::files;
use regrasp::scene::LoadedScene;
use regrasp::scene::query::TRACKING;
use regrasp::{InHandSettings, InputError, TrackingSettings};
use regrasp_bench::at_once::in_order;
use regrasp_bench::chain;
use regrasp_bench::growth;
use regrasp_bench::roadmap::GraphFacts;
use regrasp_bench::row::Judge;
use regrasp_bench::suite::is_suite;
use regrasp_bench::{Limits, Problem, RunSettings, csv, improvement, limits, page, run as run_one, summarise, summary};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Runs every seed of every scene, or writes the page.
pub fn run(arguments: &args::Bench, common: &Common, talk: &Talk) -> Result<(), Stop> {
    if let Some(path) = &arguments.page {
        return write_page(path, &arguments.scenes, arguments.limits.as_deref(), talk);
    }
    if arguments.scenes.iter().any(|path| is_suite(path)) {
        let [path] = arguments.scenes.as_slice() else {
            let seen = format!("are {} files", arguments.scenes.len());
            return Err(Stop::argument("A505", "SCENE", seen, "one suite, alone, or scenes"));
        };
        return suite::run(path, arguments, common, talk);
    }
    let files = load::scene_files(&arguments.scenes)?;
    if task_bench::is_for(&files, common) {
        return task_bench::run(&files, arguments, common, talk);
    }
    let (mut scenes, bad) = load_scenes(&files, arguments, common, talk)?;
    for loaded in &scenes {
        arguments.judging.query(loaded.task().query(0))?;
    }
    let (planner, tracking) = bench_settings(&scenes, arguments)?;
    let improves = planner.improvement.improve_work > 0;
    let cancelled = interrupt::flag()?;
    let mut writer = match &arguments.csv {
        Some(path) => {
            let read = scenes.iter().flat_map(|loaded| &loaded.scene.inputs).map(|input| input.path.as_path());
            let read = read.chain(files.iter().map(PathBuf::as_path)).chain(arguments.search.settings.as_deref());
            make_folder_of(path)?;
            Outputs::new(of_rows(path))?.refuse_inputs(read)?;
            let header = match arguments.chain {
                Some(_) => chain::header(),
                None if improves => improvement::header(),
                None => csv::header(),
            };
            Some(csv::Writer::with_text(path, header).map_err(|error| Stop::unwritable(path, &error))?)
        }
        None => None,
    };
    let settings = RunSettings {
        planner,
        tracking,
        max_work: arguments.search.max_work,
        time_limit: arguments.search.time_limit,
        improve_for: arguments.search.improve,
        judge: if arguments.no_check { Judge::Skip } else { Judge::Checker(arguments.judging.level()) },
        cancelled: Arc::clone(&cancelled),
    };
    if let Some(n_links) = arguments.chain {
        run_chains(&scenes, (n_links as usize, &settings), arguments, writer, talk)?;
        return end_of(bad, files.len(), talk);
    }
    let mut rows = Vec::new();
    for loaded in scenes.drain(..) {
        let n_seeds = arguments.seeds.unwrap_or(DEFAULT_SEEDS).min(u64::MAX - arguments.first_seed);
        let job = |index: usize| {
            let seed = arguments.first_seed + index as u64;
            let query = loaded.task().query(seed);
            // Scenes of tracking are refused below.
            let query = if arguments.judging.hold { query.held().unwrap_or(query) } else { query };
            run_one(Problem { task: loaded.manipulation(), query: &query, seed }, &settings)
        };
        in_order(n_seeds as usize, arguments.at_once, job, |_, row| {
            if cancelled.load(Ordering::Relaxed) {
                return Err(Stop::Interrupted);
            }
            say_row(&row, talk);
            if let (Some(writer), Some(path)) = (&mut writer, &arguments.csv) {
                let line = if improves { improvement::line(&row) } else { csv::line(&row) };
                writer.push_line(&line).map_err(|error| Stop::unwritable(path, &error))?;
            }
            rows.push(row);
            Ok(())
        })?;
    }
    if let (Some(writer), Some(path)) = (writer, &arguments.csv) {
        writer.finish().map_err(|error| Stop::unwritable(path, &error))?;
    }
    let summaries = summarise(&rows);
    for summary in &summaries {
        talk.event("summary", json!(summary));
    }
    if !talk.is_json() {
        talk.data(&summary::table(&summaries));
        if improves {
            talk.data(&improvement::table(&rows));
        }
    }
    end_of(bad, files.len(), talk)
}

/// Plans chains of goals in scenes of in-hand tasks, seed after seed.
fn run_chains(
    scenes: &[LoadedScene],
    (n_links, settings): (usize, &RunSettings),
    arguments: &args::Bench,
    mut writer: Option<csv::Writer>,
    talk: &Talk,
) -> Result<(), Stop> {
    let path = arguments.csv.as_deref().unwrap_or(Path::new(""));
    let mut links = Vec::new();
    for loaded in scenes {
        let n_seeds = arguments.seeds.unwrap_or(DEFAULT_SEEDS).min(u64::MAX - arguments.first_seed);
        for seed in arguments.first_seed..arguments.first_seed + n_seeds {
            let query = loaded.task().query(seed);
            if query.as_in_hand().is_none_or(|query| query.open_start.is_some()) {
                let seen = format!("is for scenes of in-hand tasks with a start; {} has none", loaded.scene.name);
                return Err(Stop::argument("A505", "--chain", seen, "other scenes, or no --chain"));
            }
            let problem = Problem { task: loaded.manipulation(), query: &query, seed };
            chain::run(problem, n_links, settings, |link| {
                if settings.cancelled.load(Ordering::Relaxed) {
                    return Err(Stop::Interrupted);
                }
                say_row(&link.row, talk);
                talk.event(
                    "link",
                    json!({ "link": link.link, "angle_deg": link.angle_deg, "motion_s": link.motion_s }),
                );
                if let Some(writer) = &mut writer {
                    writer.push_line(&chain::line(&link)).map_err(|error| Stop::unwritable(path, &error))?;
                }
                links.push(link);
                Ok(())
            })?;
        }
    }
    if let Some(writer) = writer {
        writer.finish().map_err(|error| Stop::unwritable(path, &error))?;
    }
    talk.data(&chain::table(&links));
    Ok(())
}

/// Reads the scenes. One that cannot be read is left out, so that the others are planned; it is told of at the end again.
/// Errors: none can be read.
fn load_scenes(
    files: &[PathBuf],
    arguments: &args::Bench,
    common: &Common,
    talk: &Talk,
) -> Result<(Vec<LoadedScene>, Vec<InputError>), Stop> {
    let (mut scenes, mut bad) = (Vec::new(), Vec::new());
    for path in files {
        match load::scene(path, common, talk) {
            Ok(loaded) => {
                let loaded = arguments.judging.scene(loaded);
                // Of several tasks each is a problem of its own, but where one was asked for.
                let n_tasks = if common.task.is_some() { 1 } else { loaded.tasks.len() };
                let names: Vec<String> = loaded.tasks.iter().take(n_tasks).map(|task| task.name.clone()).collect();
                scenes.extend(names.iter().map(|name| loaded.clone().for_query(name)));
            }
            Err(Stop::BadInput(error)) => {
                talk.note(&format!("{} is left out: it cannot be read", path.display()));
                talk.event("left_out", json!({ "scene": path, "diagnostics": error.diagnostics }));
                bad.push(error);
            }
            Err(stop) => return Err(stop),
        }
    }
    match scenes.is_empty() {
        true => end_of(bad, files.len(), talk).map(|()| (scenes, Vec::new())),
        false => Ok((scenes, bad)),
    }
}

/// Bad input where scenes were left out, with all that is wrong with them.
fn end_of(bad: Vec<InputError>, n_scenes: usize, talk: &Talk) -> Result<(), Stop> {
    if bad.is_empty() {
        return Ok(());
    }
    talk.say(format!("{} of {} could not be read and had no trial:", bad.len(), counted(n_scenes, "scene")));
    let n_more = bad.iter().map(|error| error.n_more).sum();
    let diagnostics = bad.into_iter().flat_map(|error| error.diagnostics).collect();
    Err(Stop::BadInput(InputError { diagnostics, n_more }))
}

/// Settings of both planners, whose failures give no advice: it takes time and is not shown. A file of settings is that of the task that all scenes have (`A505` where they differ).
fn bench_settings(scenes: &[LoadedScene], arguments: &args::Bench) -> Result<(InHandSettings, TrackingSettings), Stop> {
    let is_tracking = |loaded: &&LoadedScene| loaded.task().kind_name() == TRACKING;
    if let Some(first) = scenes.iter().find(is_tracking) {
        if arguments.search.settings.is_some() && !scenes.iter().all(|loaded| is_tracking(&loaded)) {
            let problem = "is for scenes of two kinds of tasks";
            return Err(Stop::argument("A505", "--settings", problem, "scenes of one kind"));
        }
        let tracking = load::for_task(first.task(), &arguments.search, arguments.threads)?.tracking;
        let in_hand = InHandSettings { n_threads: arguments.threads, advise: false, ..InHandSettings::default() };
        return Ok((in_hand, tracking));
    }
    let in_hand = InHandSettings { advise: false, ..load::settings(&arguments.search, arguments.threads)? };
    Ok((in_hand, TrackingSettings::default()))
}

/// Seeds per scene where none are given.
const DEFAULT_SEEDS: u64 = 20;

/// The page of CSV files, of facts about graphs and, after them, of suites with what was measured of them.
fn write_page(path: &Path, inputs: &[PathBuf], limits: Option<&Path>, talk: &Talk) -> Result<(), Stop> {
    make_folder_of(path)?;
    Outputs::new([Output::new("--page", path)])?.refuse_inputs(inputs.iter().map(PathBuf::as_path).chain(limits))?;
    let limits = limits.map_or_else(|| Ok(Limits::new()), limits::read)?;
    let (mut parts, mut graphs, mut sections, mut curves) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for file in inputs {
        if is_suite(file) {
            sections.push(suite::section(file, path)?);
        } else if file.extension().is_some_and(|extension| extension == "json") {
            graphs.push(GraphFacts::read(file)?);
        } else if improvement::is_improvement(file)? {
            sections.push(improvement::section(&file.to_string_lossy(), &improvement::read(file)?));
        } else if growth::is_growth(file)? {
            let folder = suite::link(file.parent().unwrap_or(Path::new("")), path);
            curves.push((file.to_string_lossy().into_owned(), folder, growth::read(file)?));
        } else {
            parts.push((file.to_string_lossy().into_owned(), csv::read(file)?));
        }
    }
    if !curves.is_empty() {
        sections.push(growth::section(&curves));
    }
    let text = page::markdown(&parts, &graphs, &sections, &limits);
    files::write_atomic(path, text.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
    talk.say(format!("wrote  {}", path.display()));
    Ok(())
}
