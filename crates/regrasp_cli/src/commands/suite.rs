//! `regrasp bench SUITE.toml`: the tables and figures of a paper, measured again; what an earlier run measured is kept.

use super::rows::{make_folder_of, say_row};
use crate::args::{self, Common};
use crate::interrupt;
use crate::load;
use crate::outputs::refuse_unwritable;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::files;
use regrasp::plan::check::Level;
use regrasp::scene::LoadedScene;
use regrasp_bench::at_once::in_order;
use regrasp_bench::csv::Writer;
use regrasp_bench::row::Judge;
use regrasp_bench::suite::rows::{SuiteRow, earlier, header, inputs_hash, kept, line};
use regrasp_bench::suite::{self, Job, Suite, results};
use regrasp_bench::{Problem, RunSettings, run as run_one, summary};
use serde_json::json;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two lines of progress.
const INTERVAL: Duration = Duration::from_secs(10);

/// Runs what is not measured yet, then writes rows, page and pictures.
pub fn run(path: &Path, arguments: &args::Bench, common: &Common, talk: &Talk) -> Result<(), Stop> {
    let cancelled = interrupt::flag()?;
    let suite = suite::read(path)?;
    let folder = arguments.results.clone().unwrap_or_else(|| suite.results_folder(path));
    let csv_path = folder.join("rows.csv");
    make_folder_of(&csv_path)?;
    refuse_unwritable(&csv_path)?;
    let mut plan = prepare(&suite, path, arguments, common, talk)?;
    // What still holds of an earlier run goes first, whatever order it was measured in.
    let earlier = earlier(&csv_path)?;
    let mut text = header();
    for part in &mut plan {
        part.done =
            (0..part.job.trials).map(|seed| kept(&earlier, &part.job.name, &part.inputs, seed).cloned()).collect();
        part.done.iter().flatten().for_each(|row| text.push_str(&line(row)));
    }
    let mut writer = Writer::with_text(&csv_path, text).map_err(|error| Stop::unwritable(&csv_path, &error))?;
    let n_trials: u64 = plan.iter().map(|part| part.job.trials).sum();
    let n_kept = plan.iter().flat_map(|part| &part.done).flatten().count();
    talk.say(format!("suite  {}: {n_trials} trials, {n_kept} of them measured before", suite.title));
    let mut progress = Progress { n_done: n_kept as u64, n_trials, last: Instant::now() };
    for part in &mut plan {
        measure(part, arguments.at_once, &cancelled, &mut progress, talk, |row| {
            writer.push_line(&line(row)).map_err(|error| Stop::unwritable(&csv_path, &error))
        })?;
    }
    let rows: Vec<SuiteRow> = plan.into_iter().flat_map(|part| part.done).flatten().collect();
    // In the order of the suite, not in that of measuring.
    let text: String = std::iter::once(header()).chain(rows.iter().map(line)).collect();
    writer.finish_as(&text).map_err(|error| Stop::unwritable(&csv_path, &error))?;
    write_results(&suite, &rows, &folder, talk)
}

/// A job with its scene and its rows.
struct Part {
    job: Job,
    loaded: LoadedScene,
    inputs: String,
    done: Vec<Option<SuiteRow>>,
}

/// Loads every scene before anything is measured.
fn prepare(
    suite: &Suite,
    path: &Path,
    arguments: &args::Bench,
    common: &Common,
    talk: &Talk,
) -> Result<Vec<Part>, Stop> {
    let program = program_hash()?;
    let mut plan = Vec::new();
    for mut job in suite.jobs(path) {
        job.trials = job.trials.min(arguments.seeds.unwrap_or(u64::MAX));
        let loaded = regrasp::scene::load_scene(&job.scene, &load::options(common))?;
        loaded.notes.iter().for_each(|note| talk.note(note));
        job.refuse_other_task(loaded.task(), path)?;
        let inputs = inputs_hash(&program, &loaded.scene, &job);
        plan.push(Part { job, loaded, inputs, done: Vec::new() });
    }
    Ok(plan)
}

/// Another program measures other numbers: the hash of this one's file.
fn program_hash() -> Result<String, Stop> {
    let read = || -> io::Result<Vec<u8>> { std::fs::read(std::env::current_exe()?) };
    match read() {
        Ok(bytes) => Ok(files::sha256(&bytes)),
        Err(error) => Err(Stop::Internal(format!("the program's own file cannot be read: {error}"))),
    }
}

struct Progress {
    n_done: u64,
    n_trials: u64,
    last: Instant,
}

impl Progress {
    /// Counts a trial; says where things are, now and then.
    fn count(&mut self, job: &str, talk: &Talk) {
        self.n_done += 1;
        if self.last.elapsed() >= INTERVAL || self.n_done == self.n_trials {
            self.last = Instant::now();
            let n_full = (20 * self.n_done / self.n_trials.max(1)) as usize;
            let bar = format!("{}{}", "#".repeat(n_full), ".".repeat(20 - n_full));
            talk.say(format!("[{bar}] {} of {}   {job}", self.n_done, self.n_trials));
        }
    }
}

fn measure(
    part: &mut Part,
    n_at_once: usize,
    cancelled: &Arc<AtomicBool>,
    progress: &mut Progress,
    talk: &Talk,
    mut push: impl FnMut(&SuiteRow) -> Result<(), Stop>,
) -> Result<(), Stop> {
    let job = &part.job;
    let settings = RunSettings {
        planner: job.settings.clone(),
        tracking: job.tracking.clone().unwrap_or_default(),
        max_work: job.max_work,
        time_limit: job.time_limit_s.map(Duration::from_secs_f64),
        judge: Judge::Checker(Level::Geometry),
        improve_for: None,
        cancelled: Arc::clone(cancelled),
    };
    let missing: Vec<usize> = (0..part.done.len()).filter(|&seed| part.done[seed].is_none()).collect();
    let run_seed = |index: usize| {
        let seed = missing[index] as u64;
        let query = job.query(part.loaded.task(), seed);
        run_one(Problem { task: part.loaded.manipulation(), query: &query, seed }, &settings)
    };
    in_order(missing.len(), n_at_once, run_seed, |index, row| {
        if cancelled.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted);
        }
        say_row(&row, talk);
        let row = SuiteRow { job: job.name.clone(), inputs: part.inputs.clone(), row };
        push(&row)?;
        part.done[missing[index]] = Some(row);
        progress.count(&job.name, talk);
        Ok(())
    })
}

fn write_results(suite: &Suite, rows: &[SuiteRow], folder: &Path, talk: &Talk) -> Result<(), Stop> {
    let page = format!("# Results\n\n{}", results::markdown(suite, rows, ""));
    let mut outputs = vec![("results.md".to_owned(), page)];
    outputs.extend(results::pictures(suite, rows));
    for (name, text) in outputs {
        let path = folder.join(name);
        files::write_atomic(&path, text.as_bytes()).map_err(|error| Stop::unwritable(&path, &error))?;
        talk.say(format!("wrote  {}", path.display()));
    }
    let summaries = results::summaries(rows);
    for summary in &summaries {
        talk.event("summary", json!(summary));
    }
    if !talk.is_json() {
        talk.data(&summary::table(&summaries));
    }
    Ok(())
}

/// The section of a suite for a page at `page`, from the rows measured before.
pub fn section(path: &Path, page: &Path) -> Result<String, Stop> {
    let suite = suite::read(path)?;
    let folder = suite.results_folder(path);
    let rows = earlier(&folder.join("rows.csv"))?;
    Ok(results::markdown(&suite, &rows, &link(&folder, page)))
}

/// `folder` as seen from the page, ending in `/`, or empty for the page's own: relative if it lies below the page's folder.
pub fn link(folder: &Path, page: &Path) -> String {
    let real = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().unwrap_or_else(|_| path.to_owned())
    };
    let from = real(page.parent().unwrap_or(Path::new("")));
    let folder = real(folder);
    match folder.strip_prefix(&from).unwrap_or(&folder) {
        same if same.as_os_str().is_empty() => String::new(),
        below => format!("{}/", below.to_string_lossy()),
    }
}
