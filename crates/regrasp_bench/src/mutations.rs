//! The checker against plans: good ones must be accepted, plans broken in one known way must be rejected.

use crate::row::Problem;
use regrasp_base::Rng;
use regrasp_mutations::mutants;
use regrasp_mutations::robots::robot_mutants;
use regrasp_mutations::tasks::task_mutants;
use regrasp_plan::check::{CheckSettings, Report, ViolationKind, check, check_pick_and_place, check_robot};
use regrasp_plan::{Plan, RobotPlan};
use regrasp_scene::LoadedScene;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Mutants of one kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct KindCount {
    /// Made and judged.
    pub made: u64,
    /// Rejected.
    pub rejected: u64,
    /// Rejected with a violation of a kind that fits the damage.
    pub fitting: u64,
}

/// A plan that was judged wrongly.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Misjudged {
    /// Scene.
    pub scene: String,
    /// Seed of the plan.
    pub seed: u64,
    /// The damage, or the first violation of a good plan.
    pub what: String,
}

/// What a campaign found.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Campaign {
    /// Good plans judged.
    pub good: u64,
    /// Good plans rejected.
    pub false_alarms: Vec<Misjudged>,
    /// Mutants by kind of damage.
    pub kinds: BTreeMap<&'static str, KindCount>,
    /// Mutants accepted.
    pub escaped: Vec<Misjudged>,
}

impl Campaign {
    /// Judges a good plan, then its mutants of every kind of which fewer than `per_kind` were judged so far.
    ///
    /// A plan that is rejected has no mutants: they would prove nothing.
    pub fn add(&mut self, problem: Problem, plan: &Plan, per_kind: u64) {
        let settings = CheckSettings::default();
        let misjudged = |what: String| Misjudged { scene: problem.name(), seed: problem.seed, what };
        self.good += 1;
        let report = check(problem.in_state(), Some(problem.query), plan, &settings);
        if !report.accepted() {
            let first = report.violations.first().map_or(String::new(), ToString::to_string);
            self.false_alarms.push(misjudged(first));
            return;
        }
        if !self.kinds.is_empty() && self.kinds.values().all(|count| count.made >= per_kind) {
            return;
        }
        let mut rng = Rng::keyed(problem.seed, "mutation campaign", 0);
        for mutant in mutants(plan, problem.task, &mut rng) {
            let count = self.kinds.entry(mutant.name).or_default();
            if count.made >= per_kind {
                continue;
            }
            let scene = mutant.scene.as_ref().unwrap_or(problem.task.scene);
            let report = check((scene, problem.task.state), Some(problem.query), &mutant.plan, &settings);
            count.made += 1;
            count.rejected += u64::from(!report.accepted());
            let fits = report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind));
            count.fitting += u64::from(fits);
            if report.accepted() {
                self.escaped.push(misjudged(mutant.name.to_owned()));
            }
        }
    }

    /// As [`Campaign::add`], of a plan of a whole robot for the first task of `loaded`: a motion, or pick and place.
    pub fn add_robot(&mut self, loaded: &LoadedScene, plan: &RobotPlan, seed: u64, per_kind: u64) {
        let settings = CheckSettings::default();
        let around = (&loaded.scene, &loaded.state);
        let mut rng = Rng::keyed(seed, "mutation campaign", 0);
        if let Some(query) = loaded.task().motion() {
            let report = check_robot(around, Some(query), plan, &settings);
            if !self.takes_good(loaded, seed, &report, per_kind) {
                return;
            }
            for mutant in robot_mutants(plan, around, query, &mut rng) {
                let scene = mutant.scene.as_ref().unwrap_or(&loaded.scene);
                let state = mutant.state.as_ref().unwrap_or(&loaded.state);
                let asked = mutant.query.as_ref().unwrap_or(query);
                let judge = || check_robot((scene, state), Some(asked), &mutant.plan, &settings);
                self.count(loaded, seed, per_kind, (mutant.name, &mutant.expected), judge);
            }
        } else if let Some(query) = loaded.task().pick_and_place() {
            let report = check_pick_and_place(around, Some(query), plan, &settings);
            if !self.takes_good(loaded, seed, &report, per_kind) {
                return;
            }
            for mutant in task_mutants(plan, around, query, &mut rng) {
                let scene = mutant.scene.as_ref().unwrap_or(&loaded.scene);
                let state = mutant.state.as_ref().unwrap_or(&loaded.state);
                let asked = mutant.query.as_ref().unwrap_or(query);
                let judge = || check_pick_and_place((scene, state), Some(asked), &mutant.plan, &settings);
                self.count(loaded, seed, per_kind, (mutant.name, &mutant.expected), judge);
            }
        }
    }

    /// Counts a good plan; false where it is rejected, or mutants of every kind are judged.
    fn takes_good(&mut self, loaded: &LoadedScene, seed: u64, report: &Report, per_kind: u64) -> bool {
        self.good += 1;
        if !report.accepted() {
            let what = report.violations.first().map_or(String::new(), ToString::to_string);
            self.false_alarms.push(Misjudged { scene: loaded.scene.name.clone(), seed, what });
            return false;
        }
        self.kinds.is_empty() || self.kinds.values().any(|count| count.made < per_kind)
    }

    /// Judges a mutant, where there are fewer than `per_kind` of its kind.
    fn count(
        &mut self,
        loaded: &LoadedScene,
        seed: u64,
        per_kind: u64,
        (name, expected): (&'static str, &[ViolationKind]),
        judge: impl FnOnce() -> Report,
    ) {
        let count = self.kinds.entry(name).or_default();
        if count.made >= per_kind {
            return;
        }
        let report = judge();
        count.made += 1;
        count.rejected += u64::from(!report.accepted());
        count.fitting += u64::from(report.violations.iter().any(|violation| expected.contains(&violation.kind)));
        if report.accepted() {
            self.escaped.push(Misjudged { scene: loaded.scene.name.clone(), seed, what: name.to_owned() });
        }
    }

    /// Mutants judged.
    pub fn n_mutants(&self) -> u64 {
        self.kinds.values().map(|count| count.made).sum()
    }

    /// True when nothing was judged wrongly and something was judged.
    pub fn is_clean(&self) -> bool {
        self.false_alarms.is_empty() && self.escaped.is_empty() && self.good > 0 && self.n_mutants() > 0
    }

    /// The findings as a table, for a terminal.
    pub fn table(&self) -> String {
        let width = self.kinds.keys().map(|name| name.len()).max().unwrap_or(0).max(6);
        let mut out = format!("{:<width$}  {:>6}  {:>8}  {:>8}\n", "damage", "made", "rejected", "fitting");
        for (name, count) in &self.kinds {
            let _ = writeln!(out, "{name:<width$}  {:>6}  {:>8}  {:>8}", count.made, count.rejected, count.fitting);
        }
        let rejected: u64 = self.kinds.values().map(|count| count.rejected).sum();
        let _ = writeln!(
            out,
            "{} of {} mutants of {} kinds rejected; {} false alarms on {} good plans",
            rejected,
            self.n_mutants(),
            self.kinds.len(),
            self.false_alarms.len(),
            self.good
        );
        for case in &self.escaped {
            let _ = writeln!(out, "ESCAPED      {} seed {}: {}", case.scene, case.seed, case.what);
        }
        for case in &self.false_alarms {
            let _ = writeln!(out, "FALSE ALARM  {} seed {}: {}", case.scene, case.seed, case.what);
        }
        out
    }
}
