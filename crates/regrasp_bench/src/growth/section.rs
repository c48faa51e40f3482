//! Growth curves as tables and pictures. The same rows give the same bytes.

use super::rows::GrowthRow;
use super::{Cost, Curve};
use crate::chart::{Axis, Panel, Scale, svg};
use crate::page::misses;
use crate::row::Row;
use crate::summary::{Spread, Summary, ms, summary_of_rows};
use crate::text::escaped;
use std::fmt::Write;

/// Loading the largest mesh may take so long, in seconds of wall-clock time.
const LOAD_AT_MOST_S: f64 = 2.0;
/// Planning with the largest mesh may take so many times as long as with the one it is compared with.
const PLAN_AT_MOST: f64 = 2.0;

/// All trials of a point.
struct Measured {
    object: String,
    size: u64,
    load: Cost,
    batch_s: Option<f64>,
    cores: usize,
    summary: Summary,
}

impl Measured {
    fn mean_s(&self) -> Option<f64> {
        self.summary.plan_cpu_s.map(|time| time.mean)
    }

    /// Solved queries per second of wall-clock time.
    fn throughput(&self) -> Option<f64> {
        Some(self.summary.solved as f64 / self.batch_s?)
    }
}

/// The points of `curve`, in the order of the rows.
fn measured(curve: Curve, rows: &[GrowthRow]) -> Vec<Measured> {
    let of_curve: Vec<&GrowthRow> = rows.iter().filter(|row| row.curve == curve).collect();
    of_curve
        .chunk_by(|a, b| (&a.object, a.size) == (&b.object, b.size))
        .map(|rows| {
            let trials: Vec<&Row> = rows.iter().map(|row| &row.row).collect();
            let GrowthRow { object, size, load, batch_s, cores, .. } = rows[0];
            let (object, size) = (object.clone(), *size);
            Measured { object, size, load: *load, batch_s: *batch_s, cores: *cores, summary: summary_of_rows(&trials) }
        })
        .collect()
}

/// Column of a table: heading, and what it says of a point, with the point that it is compared with.
type Column = (&'static str, fn(&Measured, Option<&Measured>) -> Option<String>);

const SOLVED: Column = ("solved", |p, _| Some(format!("{}/{}", p.summary.solved, p.summary.runs)));
const ACCEPTED: Column = ("accepted", |p, _| p.summary.accepted.map(|n| format!("{n}/{}", p.summary.solved)));
const LOAD: Column = ("load ms", |p, _| Some(ms(p.load.wall_s)));
const LOAD_CPU: Column = ("of it processor", |p, _| Some(ms(p.load.cpu_s)));
const PLAN_MEDIAN: Column = ("plan ms median", |p, _| p.summary.plan_cpu_s.map(|time| ms(time.median)));
const PLAN_MEAN: Column = ("mean", |p, _| p.mean_s().map(ms));
const PLAN_MAX: Column = ("max", |p, _| p.summary.plan_cpu_s.map(|time| ms(time.max)));
const WORK: Column = ("configurations", |p, _| p.summary.work.map(whole));
const PER_WORK: Column = ("us each", |p, _| Some(format!("{:.1}", 1e6 * p.mean_s()? / p.summary.work?.mean)));
const RELOCATIONS: Column = ("relocations", |p, _| p.summary.relocations.map(|n| format!("{:.1}", n.mean)));
const TIMES: Column = ("times", |p, reference| Some(format!("{:.2}", p.mean_s()? / reference?.mean_s()?)));
const CHECK: Column = ("check ms", |p, _| p.summary.check_s.map(|time| ms(time.mean)));
const BATCH: Column = ("batch s", |p, _| p.batch_s.map(|seconds| format!("{seconds:.2}")));
const THROUGHPUT: Column = ("plans per s", |p, _| p.throughput().map(|rate| format!("{rate:.0}")));
const FASTER: Column = ("times", |p, reference| Some(format!("{:.2}", p.throughput()? / reference?.throughput()?)));

fn whole(spread: Spread) -> String {
    format!("{:.0}", spread.mean)
}

const COLUMNS: [Column; 12] =
    [SOLVED, ACCEPTED, LOAD, LOAD_CPU, PLAN_MEDIAN, PLAN_MEAN, PLAN_MAX, TIMES, WORK, PER_WORK, RELOCATIONS, CHECK];
const BATCH_COLUMNS: [Column; 7] = [SOLVED, ACCEPTED, BATCH, THROUGHPUT, FASTER, PLAN_MEAN, WORK];

fn columns(curve: Curve) -> &'static [Column] {
    match curve {
        Curve::Threads => &BATCH_COLUMNS,
        _ => &COLUMNS,
    }
}

/// A table: heading and one line per point.
fn cells(curve: Curve, points: &[Measured]) -> (Vec<String>, Vec<Vec<String>>) {
    let columns = columns(curve);
    let heading = ["object", curve.name()].into_iter().chain(columns.iter().map(|(name, _)| *name));
    let line = |point: &Measured| {
        let reference = points.iter().find(|p| p.object == point.object && p.size == curve.reference());
        let values = columns.iter().map(|(_, value)| value(point, reference).unwrap_or_else(|| "-".into()));
        [point.object.clone(), point.size.to_string()].into_iter().chain(values).collect()
    };
    (heading.map(str::to_owned).collect(), points.iter().map(line).collect())
}

/// The points of a curve, for a terminal.
pub fn table(curve: Curve, rows: &[GrowthRow]) -> String {
    let (heading, lines) = cells(curve, &measured(curve, rows));
    let width = |column: usize| {
        std::iter::once(&heading).chain(&lines).map(|line| line[column].chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..heading.len()).map(width).collect();
    let mut out = String::new();
    for line in std::iter::once(&heading).chain(&lines) {
        let padded: Vec<String> = line.iter().zip(&widths).map(|(cell, &width)| format!("{cell:>width$}")).collect();
        out.push_str(&(padded.join("  ") + "\n"));
    }
    out
}

/// The section of the benchmark page, from the files of curves: name, folder of the picture as seen from the page (empty or
/// ending in `/`), and rows.
pub fn section(files: &[(String, String, Vec<GrowthRow>)]) -> String {
    let mut out = String::from(
        "## Growth\n\nWritten by `cargo xtask growth`. Hands of equal fingers, evenly placed. Times of planning are processor times on one\n\
         thread in ms, over the trials solved; *times* is the mean over that of the size named in the text. *load* is the least of\n\
         three, in ms of wall-clock time; *configurations* is the mean work of a trial, *us each* the time per configuration. What is\n\
         not solved is in the tables and listed below them.\n",
    );
    for (name, folder, rows) in files {
        for curve in Curve::ALL {
            if rows.iter().any(|row| row.curve == curve) {
                curve_section(curve, name, folder, rows, &mut out);
            }
        }
    }
    out
}

fn curve_section(curve: Curve, name: &str, folder: &str, rows: &[GrowthRow], out: &mut String) {
    let points = measured(curve, rows);
    let _ = write!(
        out,
        "\n### {}\n\nFrom `{}`. {}\n\n![Growth with {}]({folder}{}.svg)\n\n",
        heading(curve),
        escaped(name),
        text(curve, &points),
        curve.name(),
        curve.name()
    );
    let (heading, lines) = cells(curve, &points);
    let _ = writeln!(out, "| {} |\n|{}", heading.join(" | "), "---|".repeat(heading.len()));
    for line in &lines {
        let _ = writeln!(out, "| {} |", line.iter().map(|cell| escaped(cell)).collect::<Vec<_>>().join(" | "));
    }
    if curve == Curve::Triangles {
        out.push_str(&asked(&points));
    }
    let trials: Vec<Row> = rows.iter().filter(|row| row.curve == curve).map(|row| row.row.clone()).collect();
    misses(&trials, out);
}

fn heading(curve: Curve) -> &'static str {
    match curve {
        Curve::Fingers => "Fingers",
        Curve::Triangles => "Triangles of the object",
        Curve::Obstacles => "Obstacles",
        Curve::Threads => "A batch over threads",
    }
}

fn text(curve: Curve, points: &[Measured]) -> String {
    match curve {
        Curve::Fingers => {
            "Turns by 180 degrees about z. Soft fingertips in every hand: three hard fingers cannot hold while one of them is \
             away. *times* is against four fingers."
                .to_owned()
        }
        Curve::Triangles => {
            "One ellipsoid of half axes 30, 28 and 34 mm, in more and more triangles with all corners on it, turned by 90 degrees \
             about x by four hard fingers. *times* is against 10000 triangles."
                .to_owned()
        }
        Curve::Obstacles => {
            "Boxes and balls of 4 to 8 mm in a shell around a box that four hard fingers turn by 90 degrees about x, 85 to 200 mm \
             from its middle; fewer are the first of more. *times* is against one obstacle."
                .to_owned()
        }
        Curve::Threads => {
            let [n, cores] = points.first().map_or([0, 0], |point| [point.summary.runs, point.cores]);
            format!(
                "{n} turns of a box by 180 degrees about z, with starts up to 3 mm from the middle, planned by four hard fingers at \
                 the same time on so many threads of a machine with {cores} cores, one thread each. *batch* and *plans per s* are \
                 wall-clock times of planning alone; *times* is against one thread."
            )
        }
    }
}

/// What was asked of the largest mesh, and whether it was met; nothing where it or its reference was not measured.
fn asked(points: &[Measured]) -> String {
    let of = |size| points.iter().find(|point| point.size == size);
    let (largest, reference) =
        (Curve::Triangles.sizes().last().copied().and_then(of), of(Curve::Triangles.reference()));
    let (Some(largest), Some(reference)) = (largest, reference) else { return String::new() };
    let verdict = |is_met: bool| if is_met { "met" } else { "MISSED" };
    let all_solved = [largest, reference].iter().all(|point| point.summary.solved == point.summary.runs);
    let ratio = largest.mean_s().zip(reference.mean_s()).map(|(a, b)| a / b);
    format!(
        "\nAsked of {} triangles: loaded in at most {LOAD_AT_MOST_S} s: {:.2} s ({:.2} s of processor time), {}; planned with \
         at most {PLAN_AT_MOST} times as slowly as {}: {}, {}.\n",
        largest.size,
        largest.load.wall_s,
        largest.load.cpu_s,
        verdict(largest.load.wall_s <= LOAD_AT_MOST_S),
        reference.size,
        ratio.map_or("no time".into(), |ratio| format!("{ratio:.2} times")),
        verdict(all_solved && ratio.is_some_and(|ratio| ratio <= PLAN_AT_MOST)),
    )
}

/// The picture of a curve as (file name, SVG).
pub fn pictures(curve: Curve, rows: &[GrowthRow]) -> (String, String) {
    let points = measured(curve, rows);
    let panel = |title: &str, object: &str, value: &dyn Fn(&Measured) -> Option<f64>| Panel {
        title: title.to_owned(),
        points: points.iter().filter(|p| p.object == object).map(|p| (p.size as f64, value(p))).collect(),
    };
    let plan_ms = |point: &Measured| point.mean_s().map(|seconds| 1e3 * seconds);
    let mut panels = Vec::new();
    for &object in curve.objects() {
        match curve {
            Curve::Fingers => panels.push(panel(object, object, &plan_ms)),
            Curve::Triangles | Curve::Obstacles => {
                panels.push(panel("loading", object, &|point| Some(1e3 * point.load.wall_s)));
                panels.push(panel("planning, mean", object, &plan_ms));
            }
            Curve::Threads => panels.push(panel("batch of queries", object, &Measured::throughput)),
        }
    }
    let (x, y) = match curve {
        Curve::Fingers => (Scale::Whole, Scale::FromZero),
        Curve::Triangles | Curve::Obstacles => (Scale::Log, Scale::Log),
        Curve::Threads => (Scale::FromZero, Scale::FromZero),
    };
    let y_label = match curve {
        Curve::Fingers => "mean time, ms",
        Curve::Triangles | Curve::Obstacles => "time, ms",
        Curve::Threads => "plans per second",
    };
    let text = svg(&panels, &Axis { label: curve.name(), scale: x }, &Axis { label: y_label, scale: y });
    (format!("{}.svg", curve.name()), text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(curve: Curve, object: &str, size: u64, seconds: Option<f64>) -> GrowthRow {
        GrowthRow {
            curve,
            object: object.into(),
            size,
            load: Cost { wall_s: 1e-6 * size as f64, cpu_s: 1e-6 * size as f64 },
            batch_s: (curve == Curve::Threads).then_some(2.0 / size as f64),
            cores: 2,
            row: Row {
                scene: format!("{}_{size}", curve.name()),
                status: if seconds.is_some() { "solved" } else { "work_spent" }.into(),
                plan_cpu_s: seconds.unwrap_or(9.0),
                accepted: seconds.map(|_| true),
                work: 1000,
                relocations: 3,
                cause: "closure lost".into(),
                ..Row::default()
            },
        }
    }

    #[test]
    fn the_section_says_what_was_measured_missed_and_asked() {
        let triangles = [(100, Some(0.001)), (100, None), (10_000, Some(0.002)), (1_000_000, Some(0.003))]
            .map(|(size, seconds)| row(Curve::Triangles, "ellipsoid", size, seconds));
        let threads = [1, 2].map(|size| row(Curve::Threads, "box", size, Some(0.001)));
        let files = [
            ("t.csv".to_owned(), "growth/".to_owned(), triangles.to_vec()),
            ("n.csv".to_owned(), String::new(), threads.to_vec()),
        ];
        let page = section(&files);
        for part in [
            "| ellipsoid | 100 | 1/2 | 1/1 | 0.10 | 0.10 | 1.00 | 1.00 | 1.00 | 0.50 | 1000 | 1.0 | 3.0 | - |",
            "| ellipsoid | 1000000 | 1/1 | 1/1 | 1000 |",
            "1.00 s (1.00 s of processor time), met; planned with at most 2 times as slowly as 10000: 1.50 times, met.",
            "![Growth with triangles](growth/triangles.svg)",
            "- triangles_100 () seed 0: work_spent; closure lost",
            "machine with 2 cores",
            "| box | 2 | 1/1 | 1/1 | 1.00 | 1 | 2.00 | 1.00 | 1000 |",
        ] {
            assert!(page.contains(part), "{part} is missing in\n{page}");
        }
        let mut slow = triangles.to_vec();
        slow[3].row.plan_cpu_s = 0.005;
        slow[3].load.wall_s = 2.5;
        let page = section(&[("t.csv".to_owned(), String::new(), slow.clone())]);
        assert!(
            page.contains("2.50 s (1.00 s of processor time), MISSED;") && page.contains("2.50 times, MISSED"),
            "{page}"
        );
        slow[0].row.accepted = Some(false);
        // A miss is no time.
        slow[3].row.status = "time_limit".into();
        let page = section(&[("t.csv".to_owned(), String::new(), slow)]);
        assert!(page.contains("no time, MISSED") && page.contains("| ellipsoid | 1000000 | 0/1 | - |"), "{page}");
        assert!(page.contains("| ellipsoid | 100 | 1/2 | 0/1 |") && page.contains("rejected by the checker"), "{page}");
    }

    #[test]
    fn pictures_have_a_panel_per_quantity_and_gaps_where_nothing_was_solved() {
        let fingers: Vec<GrowthRow> = ["sphere", "box"]
            .into_iter()
            .flat_map(|object| [3, 4].map(|n| row(Curve::Fingers, object, n, (n > 3).then_some(0.01))))
            .collect();
        let (name, picture) = pictures(Curve::Fingers, &fingers);
        assert_eq!((name.as_str(), picture.matches("<circle").count()), ("fingers.svg", 2));
        let triangles = [100, 1_000].map(|size| row(Curve::Triangles, "ellipsoid", size, Some(0.001)));
        let (_, picture) = pictures(Curve::Triangles, &triangles);
        assert!(picture.matches("<circle").count() == 4 && !picture.contains("NaN"), "{picture}");
        let text = table(Curve::Fingers, &fingers);
        assert!(text.lines().count() == 5 && text.contains("0/1"), "{text}");
    }
}
