//! `docs/benchmarks.md` from CSV files. The same files give the same bytes.

use crate::row::Row;
use crate::summary::{Summary, ms, summarise};
use std::fmt::Write;

/// Most misses that are listed per CSV file.
const MAX_MISSES: usize = 60;

/// The page. Each part is the name of a CSV file and its rows.
pub fn markdown(parts: &[(String, Vec<Row>)]) -> String {
    let mut out = String::from(
        "# Benchmarks\n\n\
         Written by `make bench`; never edited by hand. Planning times are processor times of the planner call over the solved\n\
         seeds, in milliseconds; *floor* is the time to validate the final plan once at the planner's resolution, and *floors* is\n\
         mean planning time over mean floor. *accepted* is the verdict of the independent checker; *margin* and *gap* are the\n\
         smallest closure margin and the smallest clearance that it found in any plan of the row.\n",
    );
    for (name, rows) in parts {
        let _ = writeln!(out, "\n## {}\n\nFrom `{}`.\n", heading(name), escaped(name));
        table(&summarise(rows), &mut out);
        misses(rows, &mut out);
    }
    ratios(parts, &mut out);
    out
}

fn heading(name: &str) -> String {
    let file = name.rsplit('/').next().unwrap_or(name);
    escaped(file.strip_suffix(".csv").unwrap_or(file))
}

fn table(summaries: &[Summary], out: &mut String) {
    out.push_str(
        "| scene | method | solved | accepted | min | median | mean | max | floors | check ms | nodes | transfers | relocations | margin | gap mm |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for summary in summaries {
        let [min, median, mean, max] =
            summary.plan_cpu_s.map_or(["-".to_owned(), "-".into(), "-".into(), "-".into()], |s| {
                [ms(s.min), ms(s.median), ms(s.mean), ms(s.max)]
            });
        let dash = || "-".to_owned();
        let _ = writeln!(
            out,
            "| {} | {} | {}/{} | {} | {min} | {median} | {mean} | {max} | {} | {} | {} | {} | {} | {} | {} |",
            escaped(&summary.scene),
            escaped(&summary.method),
            summary.solved,
            summary.runs,
            summary.accepted.map_or_else(dash, |n| format!("{n}/{}", summary.solved)),
            summary.floors(),
            summary.check_s.map_or_else(dash, |s| ms(s.mean)),
            summary.nodes.map_or_else(dash, |s| format!("{:.0}", s.mean)),
            summary.transfers.map_or_else(dash, |s| format!("{:.1}", s.mean)),
            summary.relocations.map_or_else(dash, |s| format!("{:.1}", s.mean)),
            summary.min_margin.map_or_else(dash, |x| format!("{x:.4}")),
            summary.min_clearance.map_or_else(dash, |x| format!("{:.3}", 1e3 * x)),
        );
    }
}

/// Seeds without an accepted plan, with the cause.
fn misses(rows: &[Row], out: &mut String) {
    let missed: Vec<&Row> = rows.iter().filter(|row| row.status != "solved" || row.accepted == Some(false)).collect();
    if missed.is_empty() {
        return;
    }
    let _ = writeln!(out, "\nMisses:\n");
    for row in missed.iter().take(MAX_MISSES) {
        let status = if row.status == "solved" { "rejected by the checker" } else { &row.status };
        let left = row.angle_left_deg.map_or(String::new(), |angle| format!(", {angle:.0} degrees left"));
        let _ = writeln!(
            out,
            "- {} ({}) seed {}: {}{left}; {}",
            escaped(&row.scene),
            escaped(&row.method),
            row.seed,
            escaped(status),
            escaped(&row.cause)
        );
    }
    if missed.len() > MAX_MISSES {
        let _ = writeln!(out, "- and {} more, in the CSV file", missed.len() - MAX_MISSES);
    }
}

/// The paper's comparison: classic over the faithful mode, on each scene where both were run.
fn ratios(parts: &[(String, Vec<Row>)], out: &mut String) {
    let all: Vec<Row> = parts.iter().flat_map(|(_, rows)| rows.iter().cloned()).collect();
    let summaries = summarise(&all);
    let mean = |scene: &str, method: &str| {
        let found = summaries.iter().find(|summary| summary.scene == scene && summary.method == method)?;
        Some((found.plan_cpu_s?.mean, found.solved, found.runs))
    };
    let mut lines = String::new();
    for summary in summaries.iter().filter(|summary| summary.method == "classic") {
        let (Some(classic), Some(faithful)) = (mean(&summary.scene, "classic"), mean(&summary.scene, "visibility"))
        else {
            continue;
        };
        let _ = writeln!(
            lines,
            "| {} | {} ({}/{}) | {} ({}/{}) | {:.0} |",
            escaped(&summary.scene),
            ms(classic.0),
            classic.1,
            classic.2,
            ms(faithful.0),
            faithful.1,
            faithful.2,
            classic.0 / faithful.0
        );
    }
    if !lines.is_empty() {
        let _ = write!(
            out,
            "\n## Classic method over the method of paper 000\n\n\
             Mean planning time over the solved seeds, in ms. Paper 000 reports 116 for its sphere and 13 for its box.\n\n\
             | scene | classic | visibility | ratio |\n|---|---|---|---|\n{lines}"
        );
    }
}

fn escaped(text: &str) -> String {
    regrasp_base::diagnostic::printable(text).replace('|', "\\|").replace('<', "&lt;").replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_holds_the_ratio_and_the_misses() {
        let row = |method: &str, status: &str, time| Row {
            scene: "tight|sphere".into(),
            method: method.into(),
            status: status.into(),
            plan_cpu_s: time,
            cause: "closure <lost>".into(),
            ..Row::default()
        };
        let page = markdown(&[
            (
                "docs/benchmarks/classic.csv".into(),
                vec![row("classic", "solved", 0.3), row("classic", "time_limit", 9.0)],
            ),
            ("v.csv".into(), vec![row("visibility", "solved", 0.003)]),
        ]);
        assert!(page.contains("| tight\\|sphere | 300 (1/2) | 3.00 (1/1) | 100 |"), "{page}");
        assert!(page.contains("- tight\\|sphere (classic) seed 0: time_limit; closure &lt;lost>"), "{page}");
        assert!(page.contains("## classic\n"));
    }
}
