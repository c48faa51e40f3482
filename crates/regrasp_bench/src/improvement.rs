//! First and improved plans side by side. Rows are those of `csv`, after columns of their own.

use crate::csv;
use crate::row::Row;
use crate::text::escaped;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_plan::plan::{Improvement, PlanFigures};
use std::fmt::Write;
use std::path::Path;

const LEADING: [&str; 16] = [
    "first_relocations",
    "first_transfers",
    "first_object_path",
    "first_joint_path",
    "first_kept_margin",
    "first_cost",
    "improved_relocations",
    "improved_transfers",
    "improved_object_path",
    "improved_joint_path",
    "improved_kept_margin",
    "improved_cost",
    "lower_bound",
    "rounds",
    "improve_work",
    "cut_by_time",
];

/// The header line.
pub fn header() -> String {
    format!("{},{}", LEADING.join(","), csv::header())
}

/// One line; what has no plan has empty columns of ours.
pub fn line(row: &Row) -> String {
    let own: Vec<String> = match &row.improvement {
        Some(improvement) => {
            let figures = |f: &PlanFigures| {
                [
                    f.relocations.to_string(),
                    f.transfers.to_string(),
                    f.object_path.to_string(),
                    f.joint_path.to_string(),
                    f.kept_margin.to_string(),
                    f.cost.to_string(),
                ]
            };
            let of_search = [
                improvement.lower_bound.to_string(),
                improvement.rounds.to_string(),
                improvement.work.to_string(),
                row.cut_by_time.to_string(),
            ];
            let of_plans = figures(&improvement.first).into_iter().chain(figures(&improvement.improved));
            of_plans.chain(of_search).collect()
        }
        None => vec![String::new(); LEADING.len()],
    };
    csv::line_after(&own, row)
}

/// True when the file begins with the columns of [`header`]. Errors: as [`regrasp_base::files::read_text`].
pub fn is_improvement(path: &Path) -> Result<bool, InputError> {
    Ok(regrasp_base::files::read_text(path)?.starts_with(LEADING[0]))
}

/// Reads what was written before. Errors: as [`csv::read`].
pub fn read(path: &Path) -> Result<Vec<Row>, InputError> {
    let text = regrasp_base::files::read_text(path)?;
    let rows = csv::read_leading(path, &text, &LEADING)?;
    let with_own = |(index, (own, row)): (usize, (Vec<String>, Row))| {
        if own.iter().all(String::is_empty) {
            return Ok(row);
        }
        match own_columns(&own) {
            Some((improvement, cut_by_time)) => Ok(Row { improvement: Some(improvement), cut_by_time, ..row }),
            None => {
                let problem = format!("row {} has no figures of an improvement", index + 1);
                Err(Diagnostic::new("V021", Place::file(path), problem).into())
            }
        }
    };
    rows.into_iter().enumerate().map(with_own).collect()
}

fn own_columns(own: &[String]) -> Option<(Improvement, bool)> {
    let [first @ .., lower_bound, rounds, work, cut_by_time] = own else { return None };
    let figures = |columns: &[String]| {
        let [relocations, transfers, object_path, joint_path, kept_margin, cost] = columns else { return None };
        Some(PlanFigures {
            relocations: relocations.parse().ok()?,
            transfers: transfers.parse().ok()?,
            object_path: object_path.parse().ok()?,
            joint_path: joint_path.parse().ok()?,
            kept_margin: kept_margin.parse().ok()?,
            cost: cost.parse().ok()?,
        })
    };
    let (first, improved) = first.split_at_checked(first.len() / 2)?;
    let improvement = Improvement {
        first: figures(first)?,
        improved: figures(improved)?,
        lower_bound: lower_bound.parse().ok()?,
        rounds: rounds.parse().ok()?,
        work: work.parse().ok()?,
    };
    Some((improvement, cut_by_time.parse().ok()?))
}

/// Means over the improved plans of a scene.
struct Means {
    scene: String,
    n: usize,
    runs: usize,
    accepted: usize,
    first: [f64; 4],
    improved: [f64; 4],
    rounds: f64,
    /// Processor time of planning and improving, in seconds.
    cpu_s: f64,
}

fn means(rows: &[Row]) -> Vec<Means> {
    let mut scenes: Vec<&str> = Vec::new();
    for row in rows {
        if !scenes.contains(&row.scene.as_str()) {
            scenes.push(&row.scene);
        }
    }
    scenes.into_iter().map(|scene| means_of(scene, rows)).collect()
}

fn means_of(scene: &str, rows: &[Row]) -> Means {
    let of_scene: Vec<&Row> = rows.iter().filter(|row| row.scene == scene).collect();
    let improved: Vec<(&Row, &Improvement)> =
        of_scene.iter().filter_map(|row| Some((*row, row.improvement.as_ref()?))).collect();
    let n = improved.len();
    let mean = |value: &dyn Fn(&Row, &Improvement) -> f64| {
        improved.iter().map(|(row, improvement)| value(row, improvement)).sum::<f64>() / n as f64
    };
    let figures = |which: fn(&Improvement) -> &PlanFigures| {
        [
            mean(&|_, i| which(i).relocations as f64),
            mean(&|_, i| which(i).object_path),
            mean(&|_, i| which(i).joint_path),
            mean(&|_, i| which(i).kept_margin),
        ]
    };
    Means {
        scene: scene.to_owned(),
        n,
        runs: of_scene.len(),
        accepted: improved.iter().filter(|(row, _)| row.accepted == Some(true)).count(),
        first: figures(|i| &i.first),
        improved: figures(|i| &i.improved),
        rounds: mean(&|_, i| i.rounds as f64),
        cpu_s: mean(&|row, _| row.plan_cpu_s),
    }
}

/// First and improved plans per scene, for a terminal.
pub fn table(rows: &[Row]) -> String {
    let means = means(rows);
    let width = means.iter().map(|means| means.scene.len()).max().unwrap_or(0).max(5);
    let mut out = format!(
        "{:<width$}  {:>9}  {:>14}  {:>15}  {:>14}  {:>15}  {:>6}\n",
        "scene", "improved", "relocations", "object path mm", "joint path rad", "margin", "rounds"
    );
    for m in &means {
        let _ = writeln!(
            out,
            "{:<width$}  {:>9}  {:>14}  {:>15}  {:>14}  {:>15}  {:>6.1}",
            m.scene,
            format!("{}/{}", m.n, m.runs),
            format!("{:.2} > {:.2}", m.first[0], m.improved[0]),
            format!("{:.0} > {:.0}", 1e3 * m.first[1], 1e3 * m.improved[1]),
            format!("{:.1} > {:.1}", m.first[2], m.improved[2]),
            format!("{:.4} > {:.4}", m.first[3], m.improved[3]),
            m.rounds
        );
    }
    out
}

/// The section of the benchmark page; `name` is that of the CSV file.
pub fn section(name: &str, rows: &[Row]) -> String {
    let mut out = format!(
        "## Improvement\n\nFrom `{}`. Means over the seeds, of the first plan and of the plan that was improved until its time was\n\
         over; *cpu* is processor time in ms, with the first plan's, and *margin* the closure margin promised.\n\n\
         | scene | improved | accepted | cpu | rounds | relocations first | improved | share left | object path mm first | improved | joint path rad first | improved | margin first | improved |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        escaped(name)
    );
    for m in means(rows) {
        let _ = writeln!(
            out,
            "| {} | {}/{} | {}/{} | {:.0} | {:.1} | {:.2} | {:.2} | {:.2} | {:.0} | {:.0} | {:.1} | {:.1} | {:.4} | {:.4} |",
            escaped(&m.scene),
            m.n,
            m.runs,
            m.accepted,
            m.n,
            1e3 * m.cpu_s,
            m.rounds,
            m.first[0],
            m.improved[0],
            m.improved[0] / m.first[0],
            1e3 * m.first[1],
            1e3 * m.improved[1],
            m.first[2],
            m.improved[2],
            m.first[3],
            m.improved[3]
        );
    }
    crate::page::misses(rows, &mut out);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scene: &str, relocations: [u64; 2]) -> Row {
        let figures = |relocations| PlanFigures {
            relocations,
            transfers: 3,
            object_path: 0.1 + 0.2,
            joint_path: 7.5,
            kept_margin: 0.01,
            cost: 2.25,
        };
        let [first, improved] = relocations.map(figures);
        Row {
            scene: scene.into(),
            status: "solved".into(),
            accepted: Some(true),
            improvement: Some(Improvement { first, improved, lower_bound: 0.3, rounds: 4, work: 1000 }),
            cut_by_time: true,
            ..Row::default()
        }
    }

    #[test]
    fn rows_come_back_as_they_went_and_the_section_has_their_means() {
        let folder = std::env::temp_dir().join(format!("regrasp_improvement_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("rows.csv");
        let miss = Row { scene: "a|b".into(), status: "time_limit".into(), ..Row::default() };
        let rows = [row("a|b", [8, 3]), row("a|b", [4, 2]), miss, row("c", [5, 5])];
        let text: String = std::iter::once(header()).chain(rows.iter().map(line)).collect();
        std::fs::write(&path, &text).unwrap();
        assert!(is_improvement(&path).unwrap());
        assert_eq!(read(&path).unwrap(), rows);
        let section = section("rows.csv", &rows);
        assert!(section.contains("| a\\|b | 2/3 | 2/2 | 0 | 4.0 | 6.00 | 2.50 | 0.42 | 300 | 300 |"), "{section}");
        assert!(section.contains("- a\\|b () seed 0: time_limit"), "{section}");
        std::fs::write(&path, text.replace("2.25", "x")).unwrap();
        assert_eq!(read(&path).unwrap_err().diagnostics[0].code, "V021");
        std::fs::write(&path, csv::header()).unwrap();
        assert!(!is_improvement(&path).unwrap());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
