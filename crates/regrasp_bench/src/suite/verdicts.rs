//! What a paper found, and whether our rows confirm it.

use super::rows::SuiteRow;
use super::{Figure, Table};
use crate::row::Row;
use crate::summary::{Summary, summary_of_rows};
use crate::text::escaped;
use serde::Deserialize;
use std::fmt::Write;

/// A finding of the paper, to be compared with our rows.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verdict {
    /// What the paper says, in a sentence without a full stop.
    pub claim: String,
    /// What has to hold of our rows.
    pub holds_if: Finding,
}

/// What has to hold of rows. Names are those of rows in the same table, or of curves in the same figure.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Finding {
    /// One row takes several times as long as another, in mean time over the trials solved.
    Ratio {
        /// The row that takes longer.
        slower: String,
        /// The other one.
        faster: String,
        /// How many times at least.
        at_least: f64,
    },
    /// A share of the trials of a row is solved.
    Solved {
        /// The row.
        row: String,
        /// Smallest share.
        at_least: f64,
    },
    /// No trial of a row is solved.
    NoneSolved {
        /// The row.
        row: String,
    },
    /// The mean time of a curve changes from one alpha to another.
    Trend {
        /// The curve.
        curve: String,
        /// Values of alpha: the first and the second.
        alphas: [f64; 2],
        /// Least ratio of the second mean to the first where it is above 1; the largest where it is below.
        factor: f64,
    },
    /// No trial of a curve is solved at some alpha.
    Unsolved {
        /// The curve.
        curve: String,
        /// The value.
        alpha: f64,
    },
}

impl Verdict {
    /// What makes no sense in a table.
    pub(super) fn faults_in_table(&self, table: &Table) -> Vec<String> {
        let names: Vec<&str> = table.rows.iter().map(|row| row.name.as_str()).collect();
        let asked: Vec<&str> = match &self.holds_if {
            Finding::Ratio { slower, faster, .. } => vec![slower, faster],
            Finding::Solved { row, .. } | Finding::NoneSolved { row } => vec![row],
            Finding::Trend { .. } | Finding::Unsolved { .. } => {
                return vec![format!("verdict \"{}\": trend and unsolved are for figures", self.claim)];
            }
        };
        let unknown = asked.into_iter().filter(|name| !names.contains(name));
        unknown.map(|name| format!("verdict \"{}\": there is no row \"{name}\"", self.claim)).collect()
    }

    /// What makes no sense in a figure.
    pub(super) fn faults_in_figure(&self, figure: &Figure) -> Vec<String> {
        let (curve, alphas) = match &self.holds_if {
            Finding::Trend { curve, alphas, .. } => (curve, alphas.to_vec()),
            Finding::Unsolved { curve, alpha } => (curve, vec![*alpha]),
            Finding::Ratio { .. } | Finding::Solved { .. } | Finding::NoneSolved { .. } => {
                return vec![format!("verdict \"{}\": ratio and solved are for tables", self.claim)];
            }
        };
        let mut faults = Vec::new();
        if !figure.curves.iter().any(|entry| entry.name == *curve) {
            faults.push(format!("verdict \"{}\": there is no curve \"{curve}\"", self.claim));
        }
        let unknown = alphas.iter().filter(|value| !figure.alpha.contains(value));
        faults.extend(unknown.map(|value| format!("verdict \"{}\": alpha {value} is not measured", self.claim)));
        faults
    }
}

/// The verdicts of a table, one line each; nothing where it has none.
pub(super) fn of_table(table: &Table, rows: &[SuiteRow], out: &mut String) {
    let summary = |name: &str| summary_of(&format!("{}/{name}", table.title), rows);
    lines(&table.verdicts, out, |finding| match finding {
        Finding::Ratio { slower, faster, at_least } => {
            let (slow, fast) = (summary(slower), summary(faster));
            let ratio = slow.plan_cpu_s?.mean / fast.plan_cpu_s?.mean;
            let unsolved = |summary: &Summary| match summary.runs - summary.solved {
                0 => String::new(),
                n => format!("; {n} of {} trials were given up and do not count", summary.runs),
            };
            let told = format!("{ratio:.1} times{}{}", unsolved(&slow), unsolved(&fast));
            Some((ratio >= *at_least, told))
        }
        Finding::Solved { row, at_least } => {
            let Summary { solved, runs, .. } = summary(row);
            let is_met = runs > 0 && solved as f64 >= at_least * runs as f64;
            (runs > 0).then(|| (is_met, format!("{solved} of {runs} trials")))
        }
        Finding::NoneSolved { row } => {
            let Summary { solved, runs, .. } = summary(row);
            (runs > 0).then(|| (solved == 0, format!("{solved} of {runs} trials")))
        }
        Finding::Trend { .. } | Finding::Unsolved { .. } => None,
    });
}

/// The verdicts of a figure.
pub(super) fn of_figure(figure: &Figure, rows: &[SuiteRow], out: &mut String) {
    let summary = |curve: &str, alpha: f64| summary_of(&format!("{}/{curve}/{alpha}", figure.name), rows);
    lines(&figure.verdicts, out, |finding| match finding {
        Finding::Trend { curve, alphas: [first, second], factor } => {
            let ratio = summary(curve, *second).plan_cpu_s?.mean / summary(curve, *first).plan_cpu_s?.mean;
            let is_met = if *factor >= 1.0 { ratio >= *factor } else { ratio <= *factor };
            Some((is_met, format!("{ratio:.2} times the time at {second} as at {first}")))
        }
        Finding::Unsolved { curve, alpha } => {
            let Summary { solved, runs, .. } = summary(curve, *alpha);
            (runs > 0).then(|| (solved == 0, format!("{solved} of {runs} trials solved")))
        }
        Finding::Ratio { .. } | Finding::Solved { .. } | Finding::NoneSolved { .. } => None,
    });
}

fn summary_of(job: &str, rows: &[SuiteRow]) -> Summary {
    let of_job: Vec<&Row> = rows.iter().filter(|row| row.job == job).map(|row| &row.row).collect();
    summary_of_rows(&of_job)
}

fn lines(verdicts: &[Verdict], out: &mut String, judge: impl Fn(&Finding) -> Option<(bool, String)>) {
    if verdicts.is_empty() {
        return;
    }
    out.push_str("\nWhat the paper found, and whether these rows confirm it:\n\n");
    for verdict in verdicts {
        let told = match judge(&verdict.holds_if) {
            Some((true, told)) => format!("confirmed ({told})"),
            Some((false, told)) => format!("NOT CONFIRMED ({told})"),
            None => "not measured".to_owned(),
        };
        let _ = writeln!(out, "- {}: {told}.", escaped(&verdict.claim));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::suite::Suite;

    fn suite() -> Suite {
        toml::from_str(
            r#"
            format = "regrasp-suite"
            format_version = 1
            title = "t"
            results = "r"
            [[tables]]
            title = "T"
            rows = [{ name = "a", scene = "s.toml", trials = 2 }, { name = "b", scene = "s.toml", trials = 2 }]
            verdicts = [
                { claim = "b takes longer", holds_if = { ratio = { slower = "b", faster = "a", at_least = 3 } } },
                { claim = "b is solved", holds_if = { solved = { row = "b", at_least = 1 } } },
                { claim = "b is not", holds_if = { none_solved = { row = "b" } } },
            ]
            [[figures]]
            name = "f"
            title = "F"
            alpha = [0.5, 1.0]
            curves = [{ name = "c", scene = "s.toml", trials = 2 }]
            verdicts = [
                { claim = "it falls", holds_if = { trend = { curve = "c", alphas = [0.5, 1.0], factor = 0.9 } } },
                { claim = "never at 1", holds_if = { unsolved = { curve = "c", alpha = 1.0 } } },
            ]
            "#,
        )
        .unwrap()
    }

    fn row(job: &str, time: Option<f64>) -> SuiteRow {
        let status = if time.is_some() { "solved" } else { "time_limit" };
        let row = Row { status: status.into(), plan_cpu_s: time.unwrap_or(9.0), ..Row::default() };
        SuiteRow { job: job.into(), inputs: String::new(), row }
    }

    #[test]
    fn verdicts_follow_from_the_rows() {
        let suite = suite();
        let of = |rows: &[SuiteRow]| {
            let mut out = String::new();
            of_table(&suite.tables[0], rows, &mut out);
            of_figure(&suite.figures[0], rows, &mut out);
            out
        };
        let rows = [
            row("T/a", Some(1.0)),
            row("T/b", Some(2.0)),
            row("T/b", None),
            row("f/c/0.5", Some(2.0)),
            row("f/c/1", None),
        ];
        let told = of(&rows);
        let ratio = "- b takes longer: NOT CONFIRMED (2.0 times; 1 of 2 trials were given up and do not count).";
        assert!(told.contains(ratio), "{told}");
        assert!(told.contains("- b is solved: NOT CONFIRMED (1 of 2 trials)."), "{told}");
        assert!(told.contains("- b is not: NOT CONFIRMED (1 of 2 trials)."), "{told}");
        assert!(told.contains("- it falls: not measured."), "{told}");
        assert!(told.contains("- never at 1: confirmed (0 of 1 trials solved)."), "{told}");
        let rows = [row("T/a", Some(1.0)), row("T/b", Some(3.0)), row("f/c/0.5", Some(2.0)), row("f/c/1", Some(1.0))];
        let told = of(&rows);
        assert!(told.contains("b takes longer: confirmed (3.0 times)."), "{told}");
        assert!(told.contains("it falls: confirmed (0.50 times the time at 1 as at 0.5)."), "{told}");
        assert!(told.contains("never at 1: NOT CONFIRMED (1 of 1 trials solved)."), "{told}");
    }

    #[test]
    fn names_that_are_none_are_faults() {
        let mut suite = suite();
        assert_eq!(suite.tables[0].verdicts[0].faults_in_table(&suite.tables[0]), Vec::<String>::new());
        suite.tables[0].rows.pop();
        assert_eq!(suite.tables[0].verdicts[0].faults_in_table(&suite.tables[0]).len(), 1);
        suite.figures[0].alpha.pop();
        assert_eq!(suite.figures[0].verdicts[1].faults_in_figure(&suite.figures[0]).len(), 1);
        assert_eq!(suite.figures[0].verdicts[1].faults_in_table(&suite.tables[0]).len(), 1);
    }
}
