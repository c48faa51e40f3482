//! Smallest, median, mean and largest per scene and method.

use crate::row::{Row, is_tracking};
use serde::Serialize;

/// Smallest, median, mean and largest of some numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Smallest.
    pub min: f64,
    /// Median; the mean of the middle two for an even count.
    pub median: f64,
    /// Mean.
    pub mean: f64,
    /// Largest.
    pub max: f64,
}

impl Spread {
    /// None when there are no numbers.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let n = sorted.len();
        let median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
        Some(Spread { min, median, mean: sorted.iter().sum::<f64>() / n as f64, max })
    }
}

/// All seeds of one scene and method. Times in seconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Scene.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Seeds run.
    pub runs: usize,
    /// Seeds with a plan.
    pub solved: usize,
    /// Plans that the checker accepted; none when it was not asked.
    pub accepted: Option<usize>,
    /// Wall-clock time of the planner over the solved seeds.
    pub plan_s: Option<Spread>,
    /// Processor time of the planner over the solved seeds.
    pub plan_cpu_s: Option<Spread>,
    /// Mean processor time of planning over mean floor, over the solved seeds.
    pub floor_multiple: Option<f64>,
    /// Solved seeds whose plan was not proven again at the planner's resolution, so that they have no floor: defects.
    pub without_floor: usize,
    /// Wall-clock time of the checker.
    pub check_s: Option<Spread>,
    /// Nodes over the solved seeds.
    pub nodes: Option<Spread>,
    /// Grasps and contacts sampled over the solved seeds; in tracking, sub-goals tried.
    pub samples: Option<Spread>,
    /// Configurations looked at over the solved seeds.
    pub work: Option<Spread>,
    /// Transfers per plan; in tracking, sub-goals on its path.
    pub transfers: Option<Spread>,
    /// Relocations per plan.
    pub relocations: Option<Spread>,
    /// Smallest closure margin of any accepted plan.
    pub min_margin: Option<f64>,
    /// Smallest clearance of any accepted plan, in metres.
    pub min_clearance: Option<f64>,
}

impl Summary {
    /// Planning time in floors, and how many plans have none if any do.
    pub fn floors(&self) -> String {
        let multiple = self.floor_multiple.map_or("-".into(), |x| format!("{x:.1}"));
        if self.without_floor == 0 { multiple } else { format!("{multiple} ({} without)", self.without_floor) }
    }
}

/// One summary per scene and method, in the order in which they first appear.
pub fn summarise(rows: &[Row]) -> Vec<Summary> {
    let mut keys: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        if !keys.contains(&(&row.scene, &row.method)) {
            keys.push((&row.scene, &row.method));
        }
    }
    let of = |(scene, method)| -> Vec<&Row> {
        rows.iter().filter(|row| row.scene == scene && row.method == method).collect()
    };
    keys.into_iter().map(|key| summary_of_rows(&of(key))).collect()
}

/// One summary of all `runs`, named after the first.
pub fn summary_of_rows(runs: &[&Row]) -> Summary {
    let (scene, method) = runs.first().map_or(("", ""), |row| (&row.scene, &row.method));
    let solved: Vec<&Row> = runs.iter().copied().filter(|row| row.status == "solved").collect();
    let over = |value: fn(&Row) -> f64| Spread::of(solved.iter().map(|row| value(row)));
    let smallest = |value: fn(&Row) -> Option<f64>| solved.iter().filter_map(|row| value(row)).reduce(f64::min);
    let floored: Vec<&&Row> = solved.iter().filter(|row| row.floor_s.is_some()).collect();
    let floor: f64 = floored.iter().filter_map(|row| row.floor_s).sum();
    let planned: f64 = floored.iter().map(|row| row.plan_cpu_s).sum();
    Summary {
        scene: scene.to_owned(),
        method: method.to_owned(),
        runs: runs.len(),
        solved: solved.len(),
        accepted: solved
            .iter()
            .any(|row| row.accepted.is_some())
            .then(|| solved.iter().filter(|row| row.accepted == Some(true)).count()),
        plan_s: over(|row| row.plan_s),
        plan_cpu_s: over(|row| row.plan_cpu_s),
        floor_multiple: (floor > 0.0).then(|| planned / floor),
        without_floor: solved.iter().filter(|row| row.lacks_floor()).count(),
        check_s: Spread::of(solved.iter().filter_map(|row| row.check_s)),
        nodes: over(|row| row.nodes as f64),
        samples: over(|row| row.samples as f64),
        work: over(|row| row.work as f64),
        transfers: over(|row| row.transfers as f64),
        relocations: over(|row| row.relocations as f64),
        min_margin: smallest(|row| row.min_margin),
        min_clearance: smallest(|row| row.min_clearance),
    }
}

/// The summaries as tables of fixed columns, for a terminal: one of in-hand planning, one of tracking.
pub fn table(summaries: &[Summary]) -> String {
    let (tracking, in_hand): (Vec<&Summary>, Vec<&Summary>) =
        summaries.iter().partition(|summary| is_tracking(&summary.method));
    let mut out = String::new();
    if tracking.is_empty() || !in_hand.is_empty() {
        out.push_str(&table_of(&in_hand, &[("floors", 6), ("check ms", 9), ("margin", 7), ("gap mm", 7)], |summary| {
            vec![
                summary.floors(),
                summary.check_s.map_or_else(dash, |spread| ms(spread.mean)),
                summary.min_margin.map_or_else(dash, |x| format!("{x:.4}")),
                gap(summary),
            ]
        }));
    }
    if !tracking.is_empty() {
        // Means of what tables 4 and 5 of Cherif 1999 count.
        let columns = [("check ms", 9), ("nodes", 7), ("tried", 7), ("on path", 7), ("gap mm", 7)];
        out.push_str(&table_of(&tracking, &columns, |summary| {
            let mean = |spread: Option<Spread>| spread.map_or_else(dash, |spread| format!("{:.1}", spread.mean));
            vec![
                summary.check_s.map_or_else(dash, |spread| ms(spread.mean)),
                mean(summary.nodes),
                mean(summary.samples),
                mean(summary.transfers),
                gap(summary),
            ]
        }));
    }
    out
}

/// A table of `summaries`: scene, method, solved, accepted, times, then `columns` (name, width) with what `cells` says.
fn table_of(summaries: &[&Summary], columns: &[(&str, usize)], cells: impl Fn(&Summary) -> Vec<String>) -> String {
    let width = summaries.iter().map(|summary| summary.scene.len()).max().unwrap_or(0).max(5);
    let further = |texts: Vec<String>| -> String {
        columns.iter().zip(texts).map(|((_, width), text)| format!("  {text:>width$}")).collect()
    };
    let mut out = format!(
        "{:<width$}  {:<10}  {:>9}  {:>9}  {:>34}{}\n",
        "scene",
        "method",
        "solved",
        "accepted",
        "plan cpu ms min/median/mean/max",
        further(columns.iter().map(|(name, _)| (*name).to_owned()).collect())
    );
    for summary in summaries {
        let times = summary.plan_cpu_s.map_or_else(dash, |spread| {
            format!("{}/{}/{}/{}", ms(spread.min), ms(spread.median), ms(spread.mean), ms(spread.max))
        });
        out.push_str(&format!(
            "{:<width$}  {:<10}  {:>9}  {:>9}  {times:>34}{}\n",
            summary.scene,
            summary.method,
            format!("{}/{}", summary.solved, summary.runs),
            summary.accepted.map_or_else(dash, |n| format!("{n}/{}", summary.solved)),
            further(cells(summary)),
        ));
    }
    out
}

/// Smallest clearance, in millimetres.
pub(crate) fn gap(summary: &Summary) -> String {
    summary.min_clearance.map_or_else(dash, |x| format!("{:.3}", 1e3 * x))
}

pub(crate) fn dash() -> String {
    "-".to_owned()
}

/// Seconds as milliseconds with three significant digits.
pub(crate) fn ms(seconds: f64) -> String {
    let value = 1e3 * seconds;
    match value {
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x => format!("{x:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_of_a_known_list() {
        assert_eq!(Spread::of([]), None);
        assert_eq!(Spread::of([4.0, 1.0, 2.0, 5.0]), Some(Spread { min: 1.0, median: 3.0, mean: 3.0, max: 5.0 }));
    }

    #[test]
    fn tracking_has_no_floor_and_a_table_with_its_own_words() {
        let row = |method: &str| Row {
            scene: "s".into(),
            method: method.into(),
            status: "solved".into(),
            samples: 41,
            transfers: 40,
            ..Row::default()
        };
        let summaries = summarise(&[row("tracking"), row("gait"), row("tracking+gaiting")]);
        assert_eq!(summaries.iter().map(|summary| summary.without_floor).collect::<Vec<_>>(), [0, 1, 0]);
        let text = table(&summaries);
        let (in_hand, tracking) = text.split_at(text.rfind("scene ").unwrap());
        assert!(in_hand.contains("floors") && in_hand.contains("1 without") && !in_hand.contains("tracking"), "{text}");
        assert!(tracking.contains("tried") && tracking.contains("on path") && !tracking.contains("floors"), "{text}");
        assert!(tracking.contains("41.0     40.0"), "{text}");
    }

    #[test]
    fn failures_do_not_enter_the_times_and_groups_stay_apart() {
        let row = |method: &str, status: &str, time| Row {
            scene: "s".into(),
            method: method.into(),
            status: status.into(),
            plan_cpu_s: time,
            floor_s: Some(0.5),
            accepted: Some(time < 2.5),
            ..Row::default()
        };
        let rows =
            [row("a", "solved", 1.0), row("b", "solved", 9.0), row("a", "time_limit", 100.0), row("a", "solved", 3.0)];
        let summaries = summarise(&rows);
        assert_eq!(summaries.len(), 2);
        let a = &summaries[0];
        assert_eq!((a.runs, a.solved, a.accepted), (3, 2, Some(1)));
        assert_eq!(a.plan_cpu_s.map(|spread| spread.mean), Some(2.0));
        assert_eq!(a.floor_multiple, Some(4.0));
    }
}
