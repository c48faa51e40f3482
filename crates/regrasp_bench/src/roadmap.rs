//! Random queries on a roadmap: answer, judge, measure; and what a graph is like, for the page.

use crate::row::{Problem, Row, RunSettings, measured, plan_only, status_of};
use crate::summary::{Spread, ms};
use crate::text::escaped;
use cpu_time::{ProcessTime, ThreadTime};
use regrasp_base::{Budget, Diagnostic, InputError, Place, files};
use regrasp_plan::Plan;
use regrasp_planners::in_hand::roadmap::{GraspRoadmap, QueryMemory, RoadmapPlanner};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Queries that are answered one right after the other before any of their plans is judged.
pub const BLOCK: usize = 100;

/// The method of rows of queries that a graph answered.
pub const METHOD: &str = "roadmap";

/// Answers queries, one right after the other as a user of a graph asks them; plans the first `n_single` of them without the
/// graph; then judges the plans and measures both. Times are of the query alone: the roadmap is open. `keep` is given each plan with
/// what was asked and its row, before it is judged; one of the graph has the method [`METHOD`].
pub fn run(
    planner: &RoadmapPlanner,
    problems: &[Problem],
    n_single: usize,
    settings: &RunSettings,
    memory: &mut QueryMemory,
    keep: &mut dyn FnMut(Problem, &Row, &Plan),
) -> Vec<Row> {
    let answers: Vec<_> = problems.iter().map(|&problem| answer(planner, problem, settings, memory)).collect();
    let singles: Vec<_> = problems.iter().take(n_single).map(|&problem| plan_only(problem, settings)).collect();
    for planned in [&answers, &singles] {
        for (&problem, (row, plan)) in problems.iter().zip(planned) {
            plan.iter().for_each(|plan| keep(problem, row, plan));
        }
    }
    let mut singles = singles.into_iter();
    let mut rows = Vec::with_capacity(2 * problems.len());
    for (&problem, answer) in problems.iter().zip(answers) {
        rows.push(measured(problem, answer, planner.settings(), settings.judge));
        rows.extend(singles.next().map(|single| measured(problem, single, &settings.planner, settings.judge)));
    }
    rows
}

/// Answers one query: the plan, if there is one, is neither measured nor judged yet.
fn answer(
    planner: &RoadmapPlanner,
    problem: Problem,
    settings: &RunSettings,
    memory: &mut QueryMemory,
) -> (Row, Option<Plan>) {
    let mut row = Row { scene: problem.name(), method: METHOD.into(), seed: problem.seed, ..Row::default() };
    let started = (Instant::now(), ThreadTime::now());
    let budget = Budget {
        max_work: settings.max_work,
        deadline: settings.time_limit.map(|limit| started.0 + limit),
        improve_for: None,
        cancelled: Arc::clone(&settings.cancelled),
    };
    let query = problem.query.as_in_hand().expect("queries of roadmaps are in-hand queries");
    let outcome = planner.plan(query, problem.seed, &budget, memory);
    row.plan_s = started.0.elapsed().as_secs_f64();
    row.plan_cpu_s = started.1.elapsed().as_secs_f64();
    match outcome {
        Ok(answer) => {
            let statistics = &answer.plan.statistics;
            row.status = "solved".into();
            (row.nodes, row.samples, row.work) = (statistics.nodes, statistics.samples, statistics.work);
            (row, Some(answer.plan))
        }
        Err(failure) => {
            row.status = status_of(&failure);
            row.work = failure.statistics.work;
            row.cause = failure.message;
            (row, None)
        }
    }
}

/// What a saved graph is like. Times in seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraphFacts {
    /// Scene.
    pub scene: String,
    /// Object poses.
    pub places: usize,
    /// Grasps.
    pub nodes: usize,
    /// Transfers.
    pub transfers: usize,
    /// Relocations.
    pub relocations: usize,
    /// Size of the file.
    pub bytes: u64,
    /// Wall-clock time of loading it, the median of [`LOADS`].
    pub load_s: f64,
    /// Processor time of loading it, the median of [`LOADS`].
    pub load_cpu_s: f64,
}

/// How often a graph is loaded to be timed.
pub const LOADS: usize = 5;

impl GraphFacts {
    /// Loads the file [`LOADS`] times. Errors: as [`GraspRoadmap::read`].
    pub fn of(path: &Path, scene: &str) -> Result<Self, InputError> {
        let (mut seconds, mut cpu_seconds) = (Vec::new(), Vec::new());
        let median = |values| Spread::of(values).map_or(f64::NAN, |spread| spread.median);
        let mut last = None;
        for _ in 0..LOADS {
            // The one before goes first: two would not fit where one does.
            drop(last.take());
            let started = (Instant::now(), ProcessTime::now());
            last = Some(GraspRoadmap::read(path)?);
            seconds.push(started.0.elapsed().as_secs_f64());
            cpu_seconds.push(started.1.elapsed().as_secs_f64());
        }
        let census = last.expect("loaded at least once").census();
        Ok(GraphFacts {
            scene: scene.to_owned(),
            places: census.places,
            nodes: census.nodes,
            transfers: census.transfers,
            relocations: census.relocations,
            bytes: std::fs::metadata(path).map_or(0, |metadata| metadata.len()),
            load_s: median(seconds),
            load_cpu_s: median(cpu_seconds),
        })
    }

    /// Reads what was written as JSON. Errors: as [`files::read_text`], and not such facts (`V024`).
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = files::read_text(path)?;
        serde_json::from_str(&text).map_err(|error| {
            let place = Place::line(path, error.line() as u32);
            let fix = "give a file that `regrasp roadmap bench --graph` of this version wrote";
            Diagnostic::new("V024", place, format!("is not about a graph: {error}")).fix(fix).into()
        })
    }
}

/// Answered queries, and the same ones planned without the graph; then the graphs.
pub(crate) fn section(parts: &[(String, Vec<Row>)], graphs: &[GraphFacts], out: &mut String) {
    let mut lines = String::new();
    for (name, rows) in parts.iter().filter(|(_, rows)| rows.iter().any(|row| row.method == METHOD)) {
        line(name, rows, &mut lines);
    }
    if !lines.is_empty() {
        let _ = write!(
            out,
            "\n## Many queries, one roadmap\n\n\
             Random queries, start and goal drawn uniformly from the graph's region, a hundred answered right after each other before\n\
             their plans are judged. Medians of processor time, in ms; *single* are the same queries planned without the graph, and\n\
             *faster* is the ratio over those that both solved.\n\n\
             | from | queries | answered | accepted | with the graph | single | faster |\n|---|---|---|---|---|---|---|\n{lines}"
        );
    }
    if !graphs.is_empty() {
        out.push_str(
            "\n| graph of | places | grasps | transfers | relocations | MB | load s | of it processor |\n|---|---|---|---|---|---|---|---|\n",
        );
    }
    for graph in graphs {
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} | {} | {:.0} | {:.2} | {:.2} |",
            escaped(&graph.scene),
            graph.places,
            graph.nodes,
            graph.transfers,
            graph.relocations,
            1e-6 * graph.bytes as f64,
            graph.load_s,
            graph.load_cpu_s
        );
    }
}

fn line(name: &str, rows: &[Row], out: &mut String) {
    let (with, without): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|row| row.method == METHOD);
    let answered: Vec<&&Row> = with.iter().filter(|row| row.status == "solved").collect();
    let accepted = answered.iter().filter(|row| row.accepted == Some(true)).count();
    let time_of = |rows: &[&Row], wanted: &Row| {
        let found = rows.iter().find(|row| row.seed == wanted.seed && row.scene == wanted.scene);
        found.filter(|row| row.status == "solved").map(|row| row.plan_cpu_s)
    };
    let both: Vec<(f64, f64)> =
        answered.iter().filter_map(|row| Some((row.plan_cpu_s, time_of(&without, row)?))).collect();
    let median = |values: Vec<f64>| Spread::of(values).map(|spread| spread.median);
    let quick = median(both.iter().map(|pair| pair.0).collect());
    let slow = median(both.iter().map(|pair| pair.1).collect());
    let dash = || "-".to_owned();
    let _ = writeln!(
        out,
        "| {} | {} | {} | {accepted} | {} | {} | {} |",
        escaped(name.rsplit('/').next().unwrap_or(name)),
        with.len(),
        answered.len(),
        median(answered.iter().map(|row| row.plan_cpu_s).collect()).map_or_else(dash, ms),
        slow.map_or_else(dash, ms),
        quick.zip(slow).map_or_else(dash, |(quick, slow)| format!("{:.1}", slow / quick)),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_section_compares_the_queries_that_both_solved() {
        let row = |method: &str, seed, status: &str, plan_cpu_s| Row {
            method: method.into(),
            seed,
            status: status.into(),
            plan_cpu_s,
            accepted: Some(true),
            ..Row::default()
        };
        let rows = vec![
            row("roadmap", 0, "solved", 0.001),
            row("gait", 0, "solved", 0.012),
            row("roadmap", 1, "not_connected", 0.5),
            row("gait", 1, "solved", 0.5),
            row("roadmap", 2, "solved", 0.003),
            row("gait", 2, "time_limit", 9.0),
        ];
        let graph = GraphFacts {
            scene: "b|x".into(),
            places: 1,
            nodes: 2,
            transfers: 3,
            relocations: 4,
            bytes: 5_400_000,
            load_s: 0.125,
            load_cpu_s: 0.0625,
        };
        let mut out = String::new();
        section(&[("a/box.csv".into(), rows)], std::slice::from_ref(&graph), &mut out);
        assert!(out.contains("| box.csv | 3 | 2 | 2 | 2.00 | 12.0 | 12.0 |"), "{out}");
        assert!(out.contains("| b\\|x | 1 | 2 | 3 | 4 | 5 | 0.12 | 0.06 |"), "{out}");
        let text = serde_json::to_string(&graph).unwrap();
        assert_eq!(serde_json::from_str::<GraphFacts>(&text).unwrap(), graph);
        let mut nothing = String::new();
        section(&[("w.csv".into(), vec![row("gait", 0, "solved", 1.0)])], &[], &mut nothing);
        assert!(nothing.is_empty());
    }
}
