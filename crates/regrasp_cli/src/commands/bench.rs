//! `regrasp bench`: plan scenes with many seeds and tabulate; or make the page of CSV files.

use super::plan::{refuse_input, refuse_unwritable};
use crate::args::{self, Common};
use crate::interrupt;
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp::base::files;
use regrasp_bench::row::Judge;
use regrasp_bench::{Limits, Problem, Row, RunSettings, csv, limits, page, run as run_one, summarise, summary};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Runs every seed of every scene, or writes the page.
pub fn run(arguments: &args::Bench, common: &Common, talk: &Talk) -> Result<(), Stop> {
    if let Some(path) = &arguments.page {
        return write_page(path, &arguments.scenes, arguments.limits.as_deref(), talk);
    }
    let cancelled = interrupt::flag()?;
    let mut writer = match &arguments.csv {
        Some(path) => {
            make_folder_of(path)?;
            refuse_unwritable(path)?;
            refuse_input(path, arguments.scenes.iter().map(PathBuf::as_path))?;
            Some(csv::Writer::create(path).map_err(|error| Stop::unwritable(path, &error))?)
        }
        None => None,
    };
    let settings = RunSettings {
        planner: load::settings(&arguments.search, arguments.threads)?,
        max_work: arguments.search.max_work,
        time_limit: arguments.search.time_limit,
        judge: if arguments.no_check { Judge::Skip } else { Judge::Checker },
        cancelled: Arc::clone(&cancelled),
    };
    let mut rows = Vec::new();
    for path in load::scene_files(&arguments.scenes)? {
        let loaded = load::scene(&path, common, talk)?;
        for seed in arguments.first_seed..arguments.first_seed.saturating_add(arguments.seeds) {
            let query = loaded.task.query(seed);
            let row = run_one(Problem { scene: &loaded.scene, query: &query, seed }, &settings);
            if cancelled.load(Ordering::Relaxed) {
                return Err(Stop::Interrupted);
            }
            say_row(&row, talk);
            if let (Some(writer), Some(path)) = (&mut writer, &arguments.csv) {
                writer.push(&row).map_err(|error| Stop::unwritable(path, &error))?;
            }
            rows.push(row);
        }
    }
    if let (Some(writer), Some(path)) = (writer, &arguments.csv) {
        writer.finish().map_err(|error| Stop::unwritable(path, &error))?;
    }
    let summaries = summarise(&rows);
    for summary in &summaries {
        talk.event("summary", json!(summary));
    }
    if talk.is_json() { Ok(()) } else { talk.data(&summary::table(&summaries)) }
}

/// One line per miss, rejection or plan without floor; other solved seeds stay silent but for `--json`.
pub fn say_row(row: &Row, talk: &Talk) {
    talk.event("row", json!(row));
    if row.status != "solved" {
        let left = row.angle_left_deg.map_or(String::new(), |angle| format!(", {angle:.0} deg left"));
        talk.say(format!("miss   {} seed {}: {}{left}; {}", row.scene, row.seed, row.status, row.cause));
    } else if row.accepted == Some(false) {
        talk.say(format!("REJECTED   {} seed {}: {}", row.scene, row.seed, row.cause));
    } else if row.floor_s.is_none() {
        talk.say(format!("NO FLOOR   {} seed {}: {}", row.scene, row.seed, row.cause));
    }
}

fn write_page(path: &Path, csv_files: &[PathBuf], limits: Option<&Path>, talk: &Talk) -> Result<(), Stop> {
    make_folder_of(path)?;
    refuse_unwritable(path)?;
    refuse_input(path, csv_files.iter().map(PathBuf::as_path).chain(limits))?;
    let limits = limits.map_or_else(|| Ok(Limits::new()), limits::read)?;
    let mut parts = Vec::new();
    for file in csv_files {
        parts.push((file.to_string_lossy().into_owned(), csv::read(file)?));
    }
    let text = page::markdown(&parts, &limits);
    files::write_atomic(path, text.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
    talk.say(format!("wrote  {}", path.display()));
    Ok(())
}

/// Makes the folder of a file that this command is about to write.
pub fn make_folder_of(path: &Path) -> Result<(), Stop> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => {
            std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error))
        }
        _ => Ok(()),
    }
}
