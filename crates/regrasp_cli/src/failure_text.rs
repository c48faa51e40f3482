//! Failures for people.

use crate::words::{counted, grouped};
use regrasp::Failure;
use regrasp::planners::FailureKind;
use std::fmt::Write;

/// Heading of a failed task of a robot where nothing is left to try. Other grasps may still have a plan.
const NOTHING_LEFT: &str = "NO PLAN: found no way for this robot in this scene";

/// A failure of a task of a whole robot, for people.
pub fn robot_failure_text(failure: &Failure) -> String {
    match failure.kind {
        FailureKind::Impossible => text_under(NOTHING_LEFT, failure),
        _ => failure_text(failure),
    }
}

/// A failure for people: what, why most often, how near, what to try.
pub fn failure_text(failure: &Failure) -> String {
    text_under(heading_of(failure.kind), failure)
}

fn heading_of(kind: FailureKind) -> &'static str {
    match kind {
        FailureKind::StartInvalid => "NO PLAN: the start is not valid",
        FailureKind::GoalInvalid => "NO PLAN: the goal is not valid",
        FailureKind::SettingsInvalid => "NO PLAN: the settings make no sense",
        FailureKind::WayInvalid => "NO PLAN: a way pose is not valid",
        FailureKind::Impossible => "NO PLAN: impossible with this hand and these contacts",
        FailureKind::NotConnected => "NO PLAN on this roadmap (not a proof)",
        FailureKind::WorkSpent => "NO PLAN within the work allowed (not a proof)",
        FailureKind::TimeLimit => "NO PLAN within the time limit (not a proof)",
        FailureKind::Interrupted => "interrupted",
    }
}

fn text_under(heading: &str, failure: &Failure) -> String {
    let mut out = format!("{heading}\n  {}\n", failure.message);
    if let Some(miss) = &failure.nearest_miss {
        let _ = writeln!(
            out,
            "  nearest: the object came within {:.0} deg{} of {}",
            miss.angle_left.to_degrees(),
            // A goal of tracking says no position.
            if miss.distance_left > 1e-5 { format!(" and {:.1} mm", 1e3 * miss.distance_left) } else { String::new() },
            failure.leg.map_or("the goal".to_owned(), |leg| format!("the end of leg {leg}"))
        );
    }
    if !failure.causes.is_empty() {
        // Before any search the message names them.
        if let Some(meeting) = failure.robot_miss.as_ref().and_then(|miss| miss.meeting.as_ref()) {
            let _ = writeln!(out, "  nearest: {}", meeting.in_words());
        }
        let tried: u64 = failure.causes.iter().map(|cause| cause.count).sum();
        let _ = writeln!(out, "  {} tries of the search failed:", grouped(tried));
        for cause in failure.causes.iter().take(8) {
            let _ = writeln!(out, "    {:>5.1} %  {}", 100.0 * cause.share, cause.reason);
        }
    }
    let statistics = &failure.statistics;
    if statistics.work > 0 {
        let _ = writeln!(
            out,
            "  searched: {} nodes, {} configurations, {}",
            grouped(statistics.nodes),
            grouped(statistics.work),
            counted(statistics.restarts as usize, "restart")
        );
    }
    if !failure.advice.is_empty() {
        let _ = writeln!(out, "  try: {}", failure.advice);
    }
    out
}

/// A failure of a search for grasps, for people.
pub fn grasp_failure_text(failure: &Failure) -> String {
    let mut out = format!("NO GRASP\n  {}\n", failure.message);
    for cause in failure.causes.iter().take(8) {
        let _ = writeln!(out, "    {:>5.1} %  of the frames: {}", 100.0 * cause.share, cause.reason);
    }
    if !failure.advice.is_empty() {
        let _ = writeln!(out, "  try: {}", failure.advice);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp::plan::plan::PoseData;
    use regrasp::planners::{Cause, NearestMiss};

    #[test]
    fn a_failed_task_of_a_robot_does_not_blame_the_hand() {
        let failure = Failure::bare(FailureKind::Impossible, "exchange: 155 tried, 155 hands touch".into(), "");
        assert!(failure_text(&failure).contains("impossible with this hand"));
        let text = robot_failure_text(&failure);
        assert!(text.starts_with("NO PLAN: found no way for this robot") && text.contains("155 hands touch"), "{text}");
        assert!(!text.contains("this hand"), "{text}");
        let late = Failure::bare(FailureKind::TimeLimit, "no way in 2 s".into(), "");
        assert_eq!(robot_failure_text(&late), failure_text(&late));
    }

    #[test]
    fn a_failure_is_told_with_causes_nearest_miss_and_advice() {
        let failure = Failure {
            kind: FailureKind::TimeLimit,
            message: "no way in 2 s".into(),
            advice: "more time: --time-limit 20".into(),
            causes: vec![
                Cause { reason: "finger \"thumb\" cannot reach a new contact".into(), count: 3000, share: 0.75 },
                Cause { reason: "closure lost".into(), count: 1000, share: 0.25 },
            ],
            leg: Some(2),
            nearest_miss: Some(Box::new(NearestMiss {
                world_from_object: PoseData { position: [0.0; 3], quat_xyzw: [0.0, 0.0, 0.0, 1.0] },
                angle_left: 61f64.to_radians(),
                distance_left: 0.0012,
                joints: vec![],
            })),
            robot_miss: None,
            reached: None,
            statistics: Default::default(),
        };
        let text = failure_text(&failure);
        for part in [
            "not a proof",
            "within 61 deg and 1.2 mm of the end of leg 2",
            "4 000 tries",
            "75.0 %  finger \"thumb\"",
            "try: more time",
        ] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
    }
}
