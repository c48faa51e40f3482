//! What the checker said of a grasp list, in words and as an event.

use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::{counted, duration, grouped};
use regrasp::grasp::GraspList;
use regrasp::grasp::list::format;
use regrasp::plan::check::{CheckSettings, GraspReport, check_grasps};
use regrasp::scene::GraspScene;
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Violations that are shown one by one.
const SHOWN: usize = 12;

/// Judges a list in a scene that was read for it, and says what came of it.
pub fn judge(scene: &GraspScene, list: &GraspList, n_threads: usize, talk: &Talk) -> GraspReport {
    let started = Instant::now();
    let report = check_grasps(scene, list, &CheckSettings::default(), n_threads);
    let seconds = started.elapsed().as_secs_f64();
    talk.event("check", json!({ "accepted": report.accepted(), "seconds": seconds, "report": report }));
    let verdict = if report.accepted() { "ACCEPTED" } else { "REJECTED" };
    talk.say(format!(
        "check  {verdict}   {}, {} rejected, {} distances   {}",
        counted(report.n_grasps, "grasp"),
        report.rejected.len(),
        grouped(report.n_distances),
        duration(seconds)
    ));
    let margin = report.min_margin.map_or("-".into(), |margin| format!("{margin:.4} (exact cones)"));
    let clearance = report.min_clearance.as_ref().map_or("-".into(), |clearance| {
        format!("{:.2} mm ({} and {})", 1e3 * clearance.distance, clearance.pair[0], clearance.pair[1])
    });
    talk.say(format!(
        "       closure margin {margin}, clearance {clearance}, fingertips within {:.3} mm of their contacts",
        1e3 * report.max_contact_error
    ));
    let object = &scene.scene.objects[0];
    // A list that was made from a mesh says itself how heavy and how rough the object is: whoever reads the verdict has to know.
    let by_list = list.source.as_ref().is_some_and(|source| source.mesh.is_some());
    talk.say(format!(
        "       object of {} kg with friction {}{}, ways in of at least {}",
        object.mass,
        object.friction,
        if by_list { " (as the list says)" } else { "" },
        report.shortest_way_in.map_or("-".into(), |line| format!("{:.0} mm", 1e3 * line))
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
    report
}

/// The grasps of a list just made that the checker accepts. Errors: it rejects the list as a whole, or all grasps.
pub fn accepted(
    list: GraspList,
    scene: &GraspScene,
    n_threads: usize,
    talk: &Talk,
) -> Result<(GraspList, GraspReport), Stop> {
    let bytes = format::to_json(&list);
    let mut list = format::from_json(Path::new("grasps.json"), bytes.as_bytes())
        .map_err(|error| Stop::Internal(format!("a list just made is not a grasp list: {error}")))?;
    let report = judge(scene, &list, n_threads, talk);
    if report.accepted() {
        return Ok((list, report));
    }
    if !report.heading_is_good || !report.left_out.is_empty() || report.rejected.len() == list.grasps.len() {
        return Err(Stop::Rejected);
    }
    let mut index = 0;
    list.grasps.retain(|_| {
        index += 1;
        report.rejected.binary_search(&(index - 1)).is_err()
    });
    let n_rejected = report.rejected.len() as u64;
    list.statistics.rejected.insert("the checker rejected the grasp".into(), n_rejected);
    talk.note(&format!("the checker rejected {n_rejected} grasps; they are not in the list. Please report it"));
    let report = judge(scene, &list, n_threads, talk);
    Ok((list, report))
}
