//! Lines of facts about a plan.

use super::Judged;
use regrasp_base::files;
use regrasp_geometry::Pose;
use regrasp_plan::check::Report;
use regrasp_plan::{Plan, format};

/// Label and value of each line.
pub(super) fn plan_facts(plan: &Plan, report: &Report, judged: &Judged) -> Vec<(String, String)> {
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut fact = |label: &str, value: String| facts.push((label.to_owned(), value));
    let verdict = match report.n_violations {
        0 if !report.accepted() => "REJECTED: not judged whole".to_owned(),
        0 => format!(
            "ACCEPTED for {}: {} waypoints, {} distances",
            report.level.name(),
            report.n_waypoints,
            report.n_distances
        ),
        1 => "REJECTED: 1 violation".to_owned(),
        n => format!("REJECTED: {n} violations"),
    };
    fact("Checker", verdict);
    let (start, goal) = (Pose::from(&plan.start), Pose::from(&plan.goal));
    let angle = start.rotation.angle_to(&goal.rotation).to_degrees();
    let distance = 1e3 * (goal.translation.vector - start.translation.vector).norm();
    let way = if plan.way_poses.is_empty() { String::new() } else { format!(", {} way poses", plan.way_poses.len()) };
    let counts = &plan.statistics;
    match &plan.promises.tracking {
        // The goal says no position, and what are transfers elsewhere are sub-goals.
        Some(tracking) => {
            let within = tracking.goal_tolerance.to_degrees();
            fact("Asked", format!("{angle:.0}\u{b0}, within {within:.1}\u{b0}, by tracking"));
            let (tried, nodes) = (counts.samples, counts.nodes);
            fact("Sub-goals", format!("{} on the path, {tried} tried, {nodes} cells seen", counts.transfers));
            if plan.n_relocations() > 0 {
                fact("Relocations", plan.n_relocations().to_string());
            }
            for (cause, count) in &counts.failures {
                fact("Steps that failed", format!("{count}, {cause}"));
            }
        }
        None => {
            fact("Asked", format!("{angle:.0}\u{b0}, {distance:.1} mm{way}"));
            fact("Relocations", plan.n_relocations().to_string());
            let free = counts.transfers_with_free_fingers;
            let free = if free == 0 { String::new() } else { format!(", {free} with a free finger") };
            fact("Transfers", format!("{}{free}", counts.transfers));
        }
    }
    fact("Duration", format!("{:.1} s", report.duration));
    if let Some((margin, time)) = least(plan, &judged.margin) {
        let required = judged.required_margin;
        fact("Worst margin", format!("{margin:.4} at {time:.2} s; required {required}"));
    }
    if let Some((clearance, time)) = least(plan, &judged.clearance) {
        let at = judged.clearance.iter().position(|value| *value == Some(clearance));
        let pair = at.and_then(|at| judged.pairs.get(judged.pair[at]));
        let between = pair.map_or(String::new(), |(a, b)| format!(", {a} and {b}"));
        fact("Smallest clearance", format!("{:.2} mm at {time:.2} s{between}", 1e3 * clearance));
    }
    fact("Fingertips on contacts", format!("within {:.3} mm", 1e3 * report.max_contact_error));
    if let Some(slip) = report.max_slip {
        fact("Largest slip", format!("{:.4} mm", 1e3 * slip));
    }
    if let (Some(force), Some(moment)) = (report.max_force_residual, report.max_moment_residual) {
        fact("Forces balance", format!("within {force:.1e} N, {moment:.1e} N m"));
    }
    for assumed in &report.assumed {
        fact("Taken for granted", assumed.clone());
    }
    fact("Friction", format!("{:.4}, margin {}", plan.promises.friction, plan.promises.friction_margin));
    fact("Method", plan.method.clone());
    fact("Seed", plan.seed.to_string());
    fact("Work", format!("{} configurations", counts.work));
    fact("Written by", plan.tool.clone());
    fact("Plan", format!("sha256 {}", files::sha256(format::to_json(plan).as_bytes())));
    facts
}

/// The smallest of `series`, one entry per waypoint, and when it is.
fn least(plan: &Plan, series: &[Option<f64>]) -> Option<(f64, f64)> {
    let times = plan.segments.iter().flat_map(|segment| &segment.waypoints).map(|waypoint| waypoint.time);
    let known = series.iter().zip(times).filter_map(|(value, time)| Some(((*value)?, time)));
    known.min_by(|a, b| a.0.total_cmp(&b.0))
}
