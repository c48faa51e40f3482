//! What the checker said, in words and as an event.

use crate::args::{Common, Judging};
use crate::load;
use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::plan::check::{Level, Report, check, check_any, query_of};
use regrasp::plan::format;
use regrasp::robot::import::LoadOptions;
use regrasp::scene::{LoadedScene, load_scene};
use regrasp::{AnyPlan, RobotPlan};
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
    common: &Common,
    judging: &Judging,
    talk: &Talk,
) -> Result<Report, Stop> {
    let plan = format::from_json(plan_path, bytes)
        .map_err(|error| Stop::Internal(format!("a plan just made is not a plan file: {error}")))?;
    let options = LoadOptions { deadline: judging.limits.deadline, ..load::options(common) };
    let loaded = judging.scene(load_scene(scene_path, &options)?);
    judge(&loaded, &plan, judging, talk)
}

/// Judges a plan in a scene that was read for it, against the query of the plan's seed, and says what came of it.
pub fn judge(loaded: &LoadedScene, plan: &regrasp::Plan, judging: &Judging, talk: &Talk) -> Result<Report, Stop> {
    let started = Instant::now();
    let query = judging.query(query_of(&loaded.scene, loaded.task_for(&plan.query), plan))?;
    let report = check((&loaded.scene, &loaded.state), Some(&query), plan, &judging.settings());
    say(&report, plan.promises.tracking.is_some(), started.elapsed(), talk);
    if plan.asked.is_some() {
        talk.say("       start and goal are those that the plan says it was asked; all else is the scene's");
    }
    if query.has_open_start() {
        let [x, y, z] = plan.start.position;
        talk.say(format!(
            "       the scene leaves the start open; the plan starts at [{x:.4}, {y:.4}, {z:.4}] m, turned by {:.1} degrees",
            regrasp::geometry::Pose::from(&plan.start).rotation.angle().to_degrees()
        ));
    }
    Ok(report)
}

/// Judges a plan of a whole robot in a scene that was read for it, and says what came of it.
pub fn judge_robot(loaded: &LoadedScene, plan: &RobotPlan, judging: &Judging, talk: &Talk) -> Report {
    let started = Instant::now();
    let query = loaded.task_for(&plan.query).query(plan.seed);
    let settings = judging.settings();
    let plan = AnyPlan::Robot(Box::new(plan.clone()));
    let report = check_any((&loaded.scene, &loaded.state), Some(&query), &plan, &settings);
    let seconds = started.elapsed().as_secs_f64();
    talk.event("check", json!({ "accepted": report.accepted(), "seconds": seconds, "report": report }));
    let clearance = clearance_in_words(&report);
    talk.say(format!(
        "check  {}   {} waypoints, {} distances   {}",
        verdict(&report),
        grouped(report.n_waypoints as u64),
        grouped(report.n_distances),
        duration(seconds),
    ));
    talk.say(format!("       clearance at waypoints {clearance}, motion takes {:.2} s", report.duration));
    for what in &report.assumed {
        talk.say(format!("       taken for granted: {what}"));
    }
    say_violations(&report, talk);
    report
}

/// The nearest pair at a waypoint.
fn clearance_in_words(report: &Report) -> String {
    report.min_clearance.as_ref().map_or("-".into(), |clearance| {
        format!("{:.2} mm ({} and {})", 1e3 * clearance.distance, clearance.pair[0], clearance.pair[1])
    })
}

/// What is wrong and what was not judged.
fn say_violations(report: &Report, talk: &Talk) {
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

/// The verdict, with the level that it is for.
fn verdict(report: &Report) -> String {
    let asked = report.level.name();
    match (report.accepted(), report.reached) {
        (true, _) if report.level == Level::Motion => "ACCEPTED".into(),
        (true, _) => format!("ACCEPTED for {asked} only"),
        (false, Some(reached)) => format!("REJECTED for {asked}; accepted for {} only", reached.name()),
        (false, None) => "REJECTED".into(),
    }
}

/// How far fingertips slip from landing to lifting.
fn slip_in_words(report: &Report) -> String {
    report.max_hold_slip.map_or("no contact moves".into(), |hold| {
        let millimetres = 1e3 * hold.slip;
        let verb = if report.reached == Some(Level::Motion) { "slip" } else { "would slip" };
        format!("fingertips {verb} at most {millimetres:.3} mm from landing to lifting")
    })
}

/// Gravity that the plan was judged under.
fn gravity_in_words(report: &Report) -> String {
    report.gravity_in_world.map_or("of any direction".into(), |[x, y, z]| format!("[{x:.2}, {y:.2}, {z:.2}] m/s^2"))
}

/// Says what the checker said.
fn say(report: &Report, is_tracking: bool, elapsed: Duration, talk: &Talk) {
    let seconds = elapsed.as_secs_f64();
    talk.event("check", json!({ "accepted": report.accepted(), "seconds": seconds, "report": report }));
    let margin = match report.min_margin {
        None if is_tracking => "not defined for sliding contacts".into(),
        None => "-".into(),
        // The plan promises a bound that the planner proves quickly; this one is proven with exact cones, and is no smaller.
        Some(margin) => format!("{margin:.4} (exact cones)"),
    };
    let clearance = clearance_in_words(report);
    talk.say(format!(
        "check  {}   {} waypoints, {} distances   {}",
        verdict(report),
        grouped(report.n_waypoints as u64),
        grouped(report.n_distances),
        duration(seconds),
    ));
    talk.say(format!(
        "       closure margin {margin}, clearance {clearance}, fingertips within {:.3} mm of their contacts",
        1e3 * report.max_contact_error
    ));
    talk.say(format!("       {}, gravity {}", slip_in_words(report), gravity_in_words(report)));
    for what in &report.assumed {
        talk.say(format!("       taken for granted: {what}"));
    }
    say_violations(report, talk);
}
