//! What the checker said, in words and as an event.

use crate::stop::Stop;
use crate::talk::{Talk, counted, duration, grouped};
use regrasp::plan::check::{CheckSettings, Report, check};
use regrasp::plan::format;
use regrasp::robot::import::LoadOptions;
use regrasp::scene::{LoadedScene, load_scene};
use serde_json::json;
use std::path::Path;
use std::time::{Duration, Instant};

/// Violations that are shown one by one.
const SHOWN: usize = 12;

/// Judges the bytes of a plan file, which are or will be at `plan_path`, in a scene that is read afresh.
pub fn judge_bytes(
    plan_path: &Path,
    bytes: &[u8],
    scene_path: &Path,
    options: &LoadOptions,
    talk: &Talk,
) -> Result<Report, Stop> {
    let plan = format::from_json(plan_path, bytes)
        .map_err(|error| Stop::Internal(format!("a plan just made is not a plan file: {error}")))?;
    let loaded = load_scene(scene_path, options)?;
    judge(&loaded, &plan, talk)
}

/// Judges a plan in a scene that was read for it, against the query of the plan's seed, and says what came of it.
pub fn judge(loaded: &LoadedScene, plan: &regrasp::Plan, talk: &Talk) -> Result<Report, Stop> {
    let started = Instant::now();
    let query = loaded.task.query(plan.seed);
    let report = check(&loaded.scene, Some(&query), plan, &CheckSettings::default());
    say(&report, plan.promises.tracking.is_some(), started.elapsed(), talk);
    Ok(report)
}

/// Says what the checker said.
fn say(report: &Report, is_tracking: bool, elapsed: Duration, talk: &Talk) {
    let seconds = elapsed.as_secs_f64();
    talk.event("check", json!({ "accepted": report.accepted(), "seconds": seconds, "report": report }));
    let margin = match report.min_margin {
        None if is_tracking => "not judged (what slides closes nothing)".into(),
        None => "-".into(),
        // The plan promises a bound that the planner proves quickly; this one is proven with exact cones, and is no smaller.
        Some(margin) => format!("{margin:.4} (exact cones)"),
    };
    let clearance = report.min_clearance.as_ref().map_or("-".into(), |clearance| {
        format!("{:.2} mm ({} and {})", 1e3 * clearance.distance, clearance.pair[0], clearance.pair[1])
    });
    talk.say(format!(
        "check  {}   {} waypoints, {} distances   {}",
        if report.accepted() { "ACCEPTED" } else { "REJECTED" },
        grouped(report.n_waypoints as u64),
        grouped(report.n_distances),
        duration(seconds),
    ));
    talk.say(format!(
        "       closure margin {margin}, clearance {clearance}, fingertips within {:.3} mm of their contacts",
        1e3 * report.max_contact_error
    ));
    for violation in report.violations.iter().take(SHOWN) {
        talk.say(format!("  {violation}"));
    }
    for what in &report.left_out {
        talk.say(format!("  not judged: {what}"));
    }
    let shown = report.violations.len().min(SHOWN);
    if report.n_violations > shown {
        talk.say(format!("  and {}", counted(report.n_violations - shown, "more violation")));
    }
}
