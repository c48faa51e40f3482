//! The results of a suite as Markdown: the paper's numbers beside ours. The same rows give the same bytes.

use super::rows::SuiteRow;
use super::{Entry, Figure, Published, Suite, Table, verdicts};
use crate::chart::{Axis, Panel, Scale, svg};
use crate::page::misses;
use crate::row::Row;
use crate::summary::{Spread, Summary, summary_of_rows};
use crate::text::escaped;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The section of the results page. `folder` is where its pictures are, as seen from the page: empty or ending in `/`.
pub fn markdown(suite: &Suite, rows: &[SuiteRow], folder: &str) -> String {
    let mut out = format!("## {}\n", escaped(&suite.title));
    for text in [suite.note.as_str(), METHOD_OF_MEASURING] {
        if !text.is_empty() {
            let _ = writeln!(out, "\n{}", text.trim());
        }
    }
    for table in &suite.tables {
        table_section(table, rows, &mut out);
    }
    for figure in &suite.figures {
        figure_section(figure, rows, folder, &mut out);
    }
    // Tables of tracking say themselves what was not solved.
    let all: Vec<Row> = rows.iter().filter(|row| !row.row.is_tracking()).map(|row| row.row.clone()).collect();
    misses(&all, &mut out);
    out
}

const METHOD_OF_MEASURING: &str = "Ours: processor time of the planner call on one thread, over the trials solved. *accepted* is the verdict of the independent \
     checker; *floors* is mean planning time over the mean time to validate the final plan once. Published times are of the \
     authors' machine and hand; a dash is what they do not give.";

const ALPHA: Axis = Axis { label: "alpha", scale: Scale::Unit };
const TIME: Axis = Axis { label: "mean time, ms", scale: Scale::FromZero };

/// The figures as (file name, SVG).
pub fn pictures(suite: &Suite, rows: &[SuiteRow]) -> Vec<(String, String)> {
    let picture = |figure: &Figure| {
        let panels: Vec<Panel> = figure.curves.iter().map(|curve| panel(figure, curve, rows)).collect();
        (format!("{}.svg", figure.name), svg(&panels, &ALPHA, &TIME))
    };
    suite.figures.iter().map(picture).collect()
}

fn panel(figure: &Figure, curve: &Entry, rows: &[SuiteRow]) -> Panel {
    let point = |&alpha: &f64| {
        let time = summary(&figure.job_name(curve, alpha), rows).plan_cpu_s;
        (alpha, time.map(|time| 1e3 * time.mean))
    };
    Panel { title: curve.name.clone(), points: figure.alpha.iter().map(point).collect() }
}

/// One summary per job, in the order of the rows, named after the job.
pub fn summaries(rows: &[SuiteRow]) -> Vec<Summary> {
    let mut jobs: Vec<&str> = rows.iter().map(|row| row.job.as_str()).collect();
    jobs.dedup();
    jobs.into_iter().map(|job| Summary { scene: job.to_owned(), ..summary(job, rows) }).collect()
}

/// All trials of a job.
fn summary(job: &str, rows: &[SuiteRow]) -> Summary {
    let of_job: Vec<&Row> = rows.iter().filter(|row| row.job == job).map(|row| &row.row).collect();
    summary_of_rows(&of_job)
}

fn table_section(table: &Table, rows: &[SuiteRow], out: &mut String) {
    let _ = writeln!(out, "\n### {}\n", escaped(&table.title));
    if !table.note.is_empty() {
        let _ = writeln!(out, "{}\n", table.note.trim());
    }
    if table.is_tracking() {
        tracking_table(table, rows, out);
        return verdicts::of_table(table, rows, out);
    }
    out.push_str(
        "| | solved | accepted | time min | mean | max | nodes min | mean | max | generated, mean | relocations min | mean | floors | asked |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for published in &table.published {
        published_row(published, out);
    }
    for row in &table.rows {
        measured_row(row, &summary(&table.job_name(row), rows), out);
    }
    verdicts::of_table(table, rows, out);
}

fn published_row(published: &Published, out: &mut String) {
    let time = three(&published.time_s).map(|x| x.map_or_else(dash, seconds));
    let nodes = three(&published.nodes).map(|x| x.map_or_else(dash, |x| x.to_string()));
    let generated = three(&published.generated)[1].map_or_else(dash, |x| x.to_string());
    let _ = writeln!(
        out,
        "| *{}* | - | - | {} | {} | {generated} | - | - | - | - |",
        escaped(&published.name),
        time.join(" | "),
        nodes.join(" | ")
    );
}

fn measured_row(row: &Entry, summary: &Summary, out: &mut String) {
    let spread = |spread: Option<Spread>, text: fn(f64) -> String| {
        let of = |value: fn(&Spread) -> f64| spread.as_ref().map_or_else(dash, |spread| text(value(spread)));
        [of(|s| s.min), of(|s| s.mean), of(|s| s.max)]
    };
    let whole = |x: f64| format!("{x:.0}");
    let relocations = spread(summary.relocations, |x| format!("{x:.1}"));
    let asked = asked(row, summary);
    let cap = row.time_limit_s.map_or(String::new(), |limit| format!(", at most {} each", seconds(limit)));
    let _ = writeln!(
        out,
        "| {}{cap} | {}/{} | {} | {} | {} | {} | {} | {} | {} | {asked} |",
        escaped(&row.name),
        summary.solved,
        summary.runs,
        summary.accepted.map_or_else(dash, |n| format!("{n}/{}", summary.solved)),
        spread(summary.plan_cpu_s, seconds).join(" | "),
        spread(summary.nodes, whole).join(" | "),
        summary.samples.map_or_else(dash, |samples| whole(samples.mean)),
        relocations[0],
        relocations[1],
        summary.floor_multiple.map_or_else(dash, |x| format!("{x:.1}")),
    );
}

/// What a row asks for, and whether it was met.
fn asked(row: &Entry, summary: &Summary) -> String {
    let verdict = |is_met: bool| if is_met { "met" } else { "MISSED" };
    let share = row.solved_at_least.map(|share| {
        let is_met = summary.runs > 0 && summary.solved as f64 >= share * summary.runs as f64;
        format!("solved at least {} %: {}", 100.0 * share, verdict(is_met))
    });
    let mean = row.mean_at_most_s.map(|limit| {
        let is_enough = row.solved_at_least.is_some() || summary.solved == summary.runs;
        let is_met = summary.plan_cpu_s.is_some_and(|time| time.mean <= limit) && is_enough;
        format!("mean at most {}: {}", seconds(limit), verdict(is_met))
    });
    let all: Vec<String> = share.into_iter().chain(mean).collect();
    if all.is_empty() { dash() } else { all.join("; ") }
}

/// A table like tables 4 and 5 of Cherif 1999, with the share of trials solved and what stopped the others.
fn tracking_table(table: &Table, rows: &[SuiteRow], out: &mut String) {
    out.push_str(
        "| | solved | accepted | time min | mean | max | nodes | sub-goals tried | on the path | restarts | asked |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for published in &table.published {
        let mean = |list: &[f64]| three(list)[1].map_or_else(dash, |x| x.to_string());
        let _ = writeln!(
            out,
            "| *{}* | - | - | {} | {} | {} | {} | - | - |",
            escaped(&published.name),
            three(&published.time_s).map(|x| x.map_or_else(dash, seconds)).join(" | "),
            mean(&published.nodes),
            mean(&published.generated),
            mean(&published.on_path),
        );
    }
    let mut notes = String::new();
    for row in &table.rows {
        let job = table.job_name(row);
        let runs: Vec<&Row> = rows.iter().filter(|row| row.job == job).map(|row| &row.row).collect();
        let summary = summary_of_rows(&runs);
        let mean = |spread: Option<Spread>, decimals: usize| {
            spread.map_or_else(dash, |spread| format!("{:.decimals$}", spread.mean))
        };
        let share = 100.0 * summary.solved as f64 / summary.runs.max(1) as f64;
        let solved: Vec<&&Row> = runs.iter().filter(|row| row.status == "solved").collect();
        let times = summary.plan_cpu_s.map_or([dash(), dash(), dash()], |s| [s.min, s.mean, s.max].map(seconds));
        let _ = writeln!(
            out,
            "| {} | {}/{} ({share:.0} %) | {} | {} | {} | {} | {} | {} | {} |",
            escaped(&row.name),
            summary.solved,
            summary.runs,
            summary.accepted.map_or_else(dash, |n| format!("{n}/{}", summary.solved)),
            times.join(" | "),
            mean(summary.nodes, 0),
            mean(summary.samples, 1),
            mean(summary.transfers, 1),
            mean(Spread::of(solved.iter().map(|row| row.restarts as f64)), 1),
            asked(row, &summary),
        );
        not_solved(&row.name, &runs, &mut notes);
    }
    if !notes.is_empty() {
        let _ = write!(out, "\n{notes}");
    }
}

/// How many trials of a row have no plan, of each kind of failure, and the cause that most of these name.
fn not_solved(name: &str, runs: &[&Row], out: &mut String) {
    let mut kinds: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
    for row in runs.iter().filter(|row| row.status != "solved") {
        *kinds.entry(&row.status).or_default().entry(&row.cause).or_default() += 1;
    }
    let told: Vec<String> = kinds
        .iter()
        .map(|(status, causes)| {
            let commonest = causes.iter().max_by_key(|(_, count)| **count).map_or("", |(cause, _)| *cause);
            format!("{} {status}, mostly {commonest}", causes.values().sum::<usize>())
        })
        .collect();
    if !told.is_empty() {
        let _ = writeln!(out, "- {}, not solved: {}", escaped(name), escaped(&told.join("; ")));
    }
}

fn figure_section(figure: &Figure, rows: &[SuiteRow], folder: &str, out: &mut String) {
    let _ = writeln!(out, "\n### {}\n", escaped(&figure.title));
    if !figure.note.is_empty() {
        let _ = writeln!(out, "{}\n", figure.note.trim());
    }
    let _ = writeln!(out, "![{}]({folder}{}.svg)\n", escaped(&figure.title), figure.name);
    out.push_str("| alpha |");
    for curve in &figure.curves {
        let _ = write!(out, " {0}: solved | {0}: mean | {0}: max |", escaped(&curve.name));
    }
    let _ = writeln!(out, "\n|---|{}", "---|---|---|".repeat(figure.curves.len()));
    for &alpha in &figure.alpha {
        let _ = write!(out, "| {alpha} |");
        for curve in &figure.curves {
            let summary = summary(&figure.job_name(curve, alpha), rows);
            let [mean, max] =
                summary.plan_cpu_s.map_or([dash(), dash()], |time| [seconds(time.mean), seconds(time.max)]);
            let _ = write!(out, " {}/{} | {mean} | {max} |", summary.solved, summary.runs);
        }
        out.push('\n');
    }
    verdicts::of_figure(figure, rows, out);
}

/// Smallest, mean and largest of a list that may hold only the mean.
fn three(list: &[f64]) -> [Option<f64>; 3] {
    match *list {
        [mean] => [None, Some(mean), None],
        [min, mean, max] => [Some(min), Some(mean), Some(max)],
        _ => [None; 3],
    }
}

/// Seconds or milliseconds, three significant digits.
fn seconds(value: f64) -> String {
    if value < 1.0 {
        return format!("{} ms", crate::summary::ms(value));
    }
    match value {
        x if x >= 100.0 => format!("{x:.0} s"),
        x if x >= 10.0 => format!("{x:.1} s"),
        x => format!("{x:.2} s"),
    }
}

fn dash() -> String {
    "-".to_owned()
}
