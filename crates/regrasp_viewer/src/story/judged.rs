//! Margin and clearance along a plan, from the checker's own functions.

use super::Judged;
use crate::timeline;
use regrasp_plan::Plan;
use regrasp_plan::check::{Along, Report, along};
use regrasp_plan::plan::SegmentKind;
use regrasp_scene::Manipulation;

/// Violations that are told one by one.
const TOLD: usize = 20;

/// The checker's report and its series. Nothing is measured along a plan that is not of this scene.
pub(super) fn judged(task: &Manipulation, plan: &Plan, report: &Report) -> Judged {
    let n_waypoints = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
    let nothing = |_| Along { margin: Vec::new(), clearance: vec![None; n_waypoints], pairs: Vec::new() };
    let found = along(task, plan).unwrap_or_else(nothing);
    let mut violations: Vec<String> = report.violations.iter().take(TOLD).map(ToString::to_string).collect();
    if report.n_violations > violations.len() {
        violations.push(format!("and {} more", report.n_violations - violations.len()));
    }
    violations.extend(report.left_out.iter().map(|what| format!("not judged: {what}")));
    let margin = match found.margin.is_empty() {
        true => vec![None; n_waypoints],
        // What slides closes nothing: there the checker judges forces and not closure.
        false => found
            .margin
            .into_iter()
            .zip(timeline::steps(plan))
            .map(|(margin, step)| (plan.segments[step.segment].kind != SegmentKind::Tracking).then_some(margin))
            .collect(),
    };
    Judged {
        accepted: report.accepted(),
        level: report.level,
        violations,
        margin,
        required_margin: plan.promises.required_margin,
        clearance: found.clearance.iter().map(|nearest| nearest.map(|nearest| nearest.distance)).collect(),
        pair: found.clearance.iter().map(|nearest| nearest.map_or(0, |nearest| nearest.pair)).collect(),
        pairs: found.pairs.into_iter().map(|[a, b]| (a, b)).collect(),
    }
}
