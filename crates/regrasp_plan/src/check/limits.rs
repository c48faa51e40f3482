//! What is too large to be judged: leaps, which motion bounds would follow for ever, and more work than the checker does.

use crate::check::model::CheckedHand;
use crate::check::pose::pose_difference;
use crate::check::violation::{Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::Plan;
use std::time::Instant;

/// The first joint that is so far beyond its limits, or first step that is so long, that motion between waypoints is not
/// judged, in words.
pub fn leap(model: &CheckedHand, plan: &Plan, settings: &CheckSettings) -> Option<String> {
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            for row in &model.limits {
                let position = row.drive.position(&waypoint.joints);
                let beyond = (row.lower - position).max(position - row.upper);
                let slides = row.drive.terms.iter().any(|(k, _)| model.slides[*k]);
                if !(beyond <= settings.followed(slides)) {
                    return Some(format!(
                        "segment {s}, waypoint {w}: joint \"{}\" is at {position:.4e}, {beyond:.1e} beyond its limits",
                        row.name
                    ));
                }
            }
        }
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            for (k, name) in model.joint_names.iter().enumerate() {
                let step = (pair[1].joints[k] - pair[0].joints[k]).abs();
                if !(step <= settings.followed(model.slides[k])) {
                    return Some(format!("segment {s}, waypoint {w}: joint \"{name}\" moves {step:.1e} in one step"));
                }
            }
            let (distance, _) = pose_difference(&pair[0].world_from_object, &pair[1].world_from_object);
            if !(distance <= settings.followed_slide) {
                return Some(format!("segment {s}, waypoint {w}: the object moves {distance:.1e} m in one step"));
            }
        }
    }
    None
}

impl CheckSettings {
    /// How far a joint may go in a step, or be beyond its limits, for its motion to be judged.
    fn followed(&self, slides: bool) -> f64 {
        if slides { self.followed_slide } else { self.followed_turn }
    }
}

/// Work of the checker: configurations, samples and distances looked at.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    spent: u64,
    most: u64,
    deadline: Option<Instant>,
    /// What was being judged when the work was spent, or the time was up.
    cut: Option<(&'static str, Spent)>,
}

/// What there was no more of.
#[derive(Debug, Clone, Copy)]
enum Spent {
    Work,
    Time,
}

impl Default for Work {
    fn default() -> Self {
        Work { spent: 0, most: u64::MAX, deadline: None, cut: None }
    }
}

impl Work {
    /// As much work as `settings` allow.
    pub fn of(settings: &CheckSettings) -> Self {
        Work { most: settings.most_work, deadline: settings.deadline, ..Work::default() }
    }

    /// Counts `units` spent on judging `what`. False from when on more is spent than allowed: nothing more is judged then.
    #[must_use]
    pub fn spend(&mut self, units: u64, what: &'static str) -> bool {
        self.spent = self.spent.saturating_add(units);
        if self.cut.is_none() {
            let is_late = || self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
            self.cut = match self.spent > self.most {
                true => Some((what, Spent::Work)),
                false => is_late().then_some((what, Spent::Time)),
            };
        }
        self.cut.is_none()
    }

    /// Units that may still be spent, and one: who spends that has spent too much.
    pub fn left(&self) -> u64 {
        (self.most - self.spent.min(self.most)).saturating_add(1)
    }

    /// What was cut, in words.
    pub fn cut(&self) -> Option<String> {
        self.cut.map(|(what, spent)| match spent {
            Spent::Work => format!("{what}, after {} units of work", self.most),
            Spent::Time => format!("{what}, as the time limit was reached"),
        })
    }
}

/// Reports what was left out for want of work: such a plan is not accepted.
pub fn report_cut(log: &mut Log, left_out: &mut Vec<String>) {
    if let Some(cut) = log.work.cut() {
        let message =
            format!("the plan is too large or its steps are too long for the limits of the check: not judged {cut}");
        log.push(Violation::new(Kind::NotJudged, message));
        left_out.push(cut);
    }
}
