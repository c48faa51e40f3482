//! `docs/benchmarks.md` from CSV files. The same files give the same bytes.

use crate::limits::Limits;
use crate::roadmap::{self, GraphFacts};
use crate::row::{Row, is_tracking};
use crate::summary::{Spread, Summary, dash, gap, ms, summarise};
use crate::text::escaped;
use std::fmt::Write;

/// Most misses that are listed per CSV file.
const MAX_MISSES: usize = 60;

/// The page. Each part is the name of a CSV file and its rows; parts stand in the order given, the comparison of the
/// paper's methods after the last part that has a row of either, queries on roadmaps and then sections of suites at the end.
pub fn markdown(parts: &[(String, Vec<Row>)], graphs: &[GraphFacts], suites: &[String], limits: &Limits) -> String {
    let mut out = String::from(
        "# Benchmarks\n\n\
         Written by `cargo xtask bench`; never edited by hand. Planning times are processor times of the planner call over the solved\n\
         seeds, in milliseconds; *floor* is the time to validate the final plan once at the planner's resolution, and *floors* is\n\
         mean planning time over mean floor. *within limit* is the share of seeds with an accepted plan in at most the processor\n\
         time in brackets, where one is set. *accepted* is the verdict of the independent checker; *margin* and *gap* are the\n\
         smallest closure margin and the smallest clearance that it found in any plan of the row.\n",
    );
    let is_of_the_paper =
        |(_, rows): &(String, Vec<Row>)| rows.iter().any(|row| matches!(row.method.as_str(), "classic" | "visibility"));
    let last_of_the_paper = parts.iter().rposition(is_of_the_paper);
    for (i, (name, rows)) in parts.iter().enumerate() {
        let _ = writeln!(out, "\n## {}\n\nFrom `{}`.\n", heading(name), escaped(name));
        table(rows, limits, &mut out);
        misses(rows, &mut out);
        if last_of_the_paper == Some(i) {
            ratios(parts, &mut out);
        }
    }
    roadmap::section(parts, graphs, &mut out);
    for section in suites {
        out.push('\n');
        out.push_str(section);
    }
    out
}

fn heading(name: &str) -> String {
    let file = name.rsplit('/').next().unwrap_or(name);
    escaped(file.strip_suffix(".csv").unwrap_or(file))
}

/// In-hand planning and tracking have a table each.
fn table(rows: &[Row], limits: &Limits, out: &mut String) {
    let summaries = summarise(rows);
    let (tracking, in_hand): (Vec<&Summary>, Vec<&Summary>) =
        summaries.iter().partition(|summary| is_tracking(&summary.method));
    if tracking.is_empty() || !in_hand.is_empty() {
        let columns = ["floors", "check ms", "nodes", "transfers", "relocations", "margin", "gap mm"];
        table_of(&in_hand, rows, limits, &columns, out, |summary| {
            vec![
                summary.floors(),
                check_ms(summary),
                mean(summary.nodes, 0),
                mean(summary.transfers, 1),
                mean(summary.relocations, 1),
                summary.min_margin.map_or_else(dash, |x| format!("{x:.4}")),
                gap(summary),
            ]
        });
    }
    if !tracking.is_empty() {
        if !in_hand.is_empty() {
            out.push('\n');
        }
        let columns = ["check ms", "nodes", "sub-goals tried", "sub-goals on the path", "relocations", "gap mm"];
        table_of(&tracking, rows, limits, &columns, out, |summary| {
            vec![
                check_ms(summary),
                mean(summary.nodes, 0),
                mean(summary.samples, 1),
                mean(summary.transfers, 1),
                mean(summary.relocations, 1),
                gap(summary),
            ]
        });
    }
}

/// A table of `summaries`: who, share solved and accepted, times, then `columns` with what `cells` says.
fn table_of(
    summaries: &[&Summary],
    rows: &[Row],
    limits: &Limits,
    columns: &[&str],
    out: &mut String,
    cells: impl Fn(&Summary) -> Vec<String>,
) {
    let _ = writeln!(
        out,
        "| scene | method | solved | within limit | accepted | min | median | mean | max | {} |\n|{}",
        columns.join(" | "),
        "---|".repeat(9 + columns.len())
    );
    for summary in summaries {
        let times =
            summary.plan_cpu_s.map_or([dash(), dash(), dash(), dash()], |s| [s.min, s.median, s.mean, s.max].map(ms));
        let _ = writeln!(
            out,
            "| {} | {} | {}/{} | {} | {} | {} | {} |",
            escaped(&summary.scene),
            escaped(&summary.method),
            summary.solved,
            summary.runs,
            within_limit(summary, rows, limits).unwrap_or_else(dash),
            summary.accepted.map_or_else(dash, |n| format!("{n}/{}", summary.solved)),
            times.join(" | "),
            cells(summary).join(" | "),
        );
    }
}

fn check_ms(summary: &Summary) -> String {
    summary.check_s.map_or_else(dash, |s| ms(s.mean))
}

fn mean(spread: Option<Spread>, decimals: usize) -> String {
    spread.map_or_else(dash, |s| format!("{:.decimals$}", s.mean))
}

/// `19/20 (10 s)`: seeds with a plan, not rejected, in at most the scene's limit of processor time; none without a limit.
fn within_limit(summary: &Summary, rows: &[Row], limits: &Limits) -> Option<String> {
    let limit = *limits.get(&summary.scene)?;
    let is_within = |row: &&Row| {
        (&row.scene, &row.method) == (&summary.scene, &summary.method)
            && row.status == "solved"
            && row.accepted != Some(false)
            && row.plan_cpu_s <= limit
    };
    Some(format!("{}/{} ({limit} s)", rows.iter().filter(is_within).count(), summary.runs))
}

/// Seeds without an accepted plan, with the cause.
pub(crate) fn misses(rows: &[Row], out: &mut String) {
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
            "\n## Classic method over the method of Saut 2011\n\n\
             Mean planning time over the solved seeds, in ms. Saut 2011 reports 116 for its sphere and 13 for its box.\n\n\
             | scene | classic | visibility | ratio |\n|---|---|---|---|\n{lines}"
        );
    }
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
        let parts = [
            (
                "docs/benchmarks/classic.csv".into(),
                vec![row("classic", "solved", 0.3), row("classic", "time_limit", 9.0)],
            ),
            ("v.csv".into(), vec![row("visibility", "solved", 0.003)]),
            ("w.csv".into(), vec![row("gait", "solved", 0.001)]),
        ];
        let page = markdown(&parts, &[], &["## A suite\n".into()], &Limits::new());
        assert!(page.ends_with("\n## A suite\n"), "{page}");
        assert!(page.contains("| tight\\|sphere | 300 (1/2) | 3.00 (1/1) | 100 |"), "{page}");
        assert!(page.contains("- tight\\|sphere (classic) seed 0: time_limit; closure &lt;lost>"), "{page}");
        assert!(page.contains("## classic\n"));
        let at = |text: &str| page.find(text).unwrap();
        assert!(at("## v\n") < at("## Classic method over") && at("## Classic method over") < at("## w\n"), "{page}");
    }

    #[test]
    fn tracking_has_a_table_with_its_own_words() {
        let row = |method: &str| Row {
            scene: "football".into(),
            method: method.into(),
            status: "solved".into(),
            nodes: 992,
            samples: 41,
            transfers: 40,
            ..Row::default()
        };
        let part = |rows| markdown(&[("a.csv".into(), rows)], &[], &[], &Limits::new());
        let page = part(vec![row("tracking")]);
        assert!(!page.contains("transfers") && page.contains("| sub-goals tried | sub-goals on the path |"), "{page}");
        assert!(page.contains("| 992 | 41.0 | 40.0 | 0.0 | - |"), "{page}");
        let both = part(vec![row("tracking"), row("gait")]);
        assert!(
            both.contains("| 992 | 40.0 | 0.0 | - | - |") && both.contains("| 992 | 41.0 | 40.0 | 0.0 | - |"),
            "{both}"
        );
    }

    #[test]
    fn a_plan_is_within_the_limit_when_it_is_in_time_and_not_rejected() {
        let row = |scene: &str, status: &str, plan_cpu_s, accepted| Row {
            scene: scene.into(),
            method: "gait".into(),
            status: status.into(),
            plan_cpu_s,
            accepted,
            ..Row::default()
        };
        let rows = vec![
            row("cube", "solved", 2.0, Some(true)),
            row("cube", "solved", 2.1, Some(true)),
            row("cube", "solved", 0.1, Some(false)),
            row("cube", "time_limit", 1.0, None),
            row("cube", "solved", 0.2, None),
            row("ball", "solved", 0.2, Some(true)),
        ];
        let page =
            markdown(&[("a.csv".into(), rows)], &[], &[], &Limits::from([("cube".into(), 2.0), ("cone".into(), 1.0)]));
        assert!(page.contains("| cube | gait | 4/5 | 2/5 (2 s) |"), "{page}");
        assert!(page.contains("| ball | gait | 1/1 | - |"), "{page}");
    }
}
