//! Rows as CSV: written whole at the end, appended one by one to `FILE.partial` meanwhile.

use crate::row::Row;
use regrasp_base::{Diagnostic, InputError, Place};
use regrasp_plan::check::Level;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const COLUMNS: [&str; 20] = [
    "scene",
    "method",
    "seed",
    "status",
    "plan_s",
    "plan_cpu_s",
    "floor_s",
    "check_s",
    "accepted",
    LEVEL,
    "nodes",
    "samples",
    "work",
    "restarts",
    "transfers",
    "relocations",
    "min_margin",
    "min_clearance",
    "angle_left_deg",
    "cause",
];

/// The column that files of earlier versions lack.
const LEVEL: &str = "level";

/// The header line.
pub fn header() -> String {
    COLUMNS.join(",") + "\n"
}

/// One line.
pub fn line(row: &Row) -> String {
    line_after(&[], row)
}

/// One line with fields of other columns before those of the row.
pub(crate) fn line_after(leading: &[String], row: &Row) -> String {
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    let written = writer.write_record(leading.iter().chain(&fields(row))).and_then(|()| Ok(writer.flush()?));
    written.expect("memory takes every record");
    let bytes = writer.into_inner().expect("memory takes every record");
    String::from_utf8(bytes).expect("all fields are text")
}

fn fields(row: &Row) -> [String; COLUMNS.len()] {
    let optional = |value: Option<f64>| value.map(|x| x.to_string()).unwrap_or_default();
    [
        row.scene.clone(),
        row.method.clone(),
        row.seed.to_string(),
        row.status.clone(),
        row.plan_s.to_string(),
        row.plan_cpu_s.to_string(),
        optional(row.floor_s),
        optional(row.check_s),
        row.accepted.map(|value| value.to_string()).unwrap_or_default(),
        row.level.map(|level| level.name().to_owned()).unwrap_or_default(),
        row.nodes.to_string(),
        row.samples.to_string(),
        row.work.to_string(),
        row.restarts.to_string(),
        row.transfers.to_string(),
        row.relocations.to_string(),
        optional(row.min_margin),
        optional(row.min_clearance),
        optional(row.angle_left_deg),
        row.cause.clone(),
    ]
}

/// Rows on their way to a CSV file: a crash loses at most the row in flight.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    partial_path: PathBuf,
    partial: File,
    text: String,
}

impl Writer {
    /// Creates `PATH.partial` with the header.
    pub fn create(path: &Path) -> io::Result<Self> {
        Writer::with_text(path, header())
    }

    /// Creates `PATH.partial` with `text`: a header, and lines that are there already.
    pub fn with_text(path: &Path, text: String) -> io::Result<Self> {
        let partial_path = partial_path(path);
        // Whole or not at all: rows taken over from an earlier run are not lost when this one is cut off here.
        regrasp_base::files::write_atomic(&partial_path, text.as_bytes())?;
        let partial = File::options().append(true).open(&partial_path)?;
        Ok(Writer { path: path.to_owned(), partial_path, partial, text })
    }

    /// Appends a row.
    pub fn push(&mut self, row: &Row) -> io::Result<()> {
        self.push_line(&line(row))
    }

    /// Appends a line, which ends with a line feed.
    pub fn push_line(&mut self, line: &str) -> io::Result<()> {
        self.partial.write_all(line.as_bytes())?;
        self.partial.flush()?;
        self.text.push_str(line);
        Ok(())
    }

    /// Writes the file whole and removes the partial one.
    pub fn finish(mut self) -> io::Result<()> {
        let text = std::mem::take(&mut self.text);
        self.finish_as(&text)
    }

    /// The same with the lines in another order: `text` is all of them with the header.
    pub fn finish_as(self, text: &str) -> io::Result<()> {
        regrasp_base::files::write_atomic(&self.path, text.as_bytes())?;
        std::fs::remove_file(&self.partial_path)
    }
}

/// Where the rows of `path` are kept until all are there: `PATH.partial`.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

/// Reads what [`Writer`] wrote. Errors: a header of other columns (`V020`), a line that is not a row (`V021`).
pub fn read(path: &Path) -> Result<Vec<Row>, InputError> {
    let text = regrasp_base::files::read_text(path)?;
    Ok(read_leading(path, &text, &[])?.into_iter().map(|(_, row)| row).collect())
}

/// Rows of `text`, which came from `path`, with columns of other names before ours. Errors: as [`read`].
pub fn read_leading(path: &Path, text: &str, leading: &[&str]) -> Result<Vec<(Vec<String>, Row)>, InputError> {
    let mut records = records(text).into_iter();
    let names = records.next().map(|(_, fields)| fields).unwrap_or_default();
    let expected: Vec<&str> = leading.iter().copied().chain(COLUMNS).collect();
    let without_level: Vec<&str> = expected.iter().copied().filter(|name| *name != LEVEL).collect();
    let level_at = COLUMNS.iter().position(|name| *name == LEVEL).filter(|_| names == without_level);
    if names != expected && level_at.is_none() {
        return Err(Diagnostic::new("V020", Place::line(path, 1), format!("has the columns {}", names.join(",")))
            .expected(expected.join(","))
            .fix("give a CSV file that `regrasp bench --csv` of this version wrote")
            .into());
    }
    records
        .map(|(line, mut fields)| {
            let mut own = fields.split_off(leading.len().min(fields.len()));
            if let Some(at) = level_at.filter(|at| *at <= own.len()) {
                own.insert(at, String::new());
            }
            row_of(&own)
                .map(|row| (fields, row))
                .ok_or_else(|| Diagnostic::new("V021", Place::line(path, line), "is not a row of a benchmark").into())
        })
        .collect()
}

fn row_of(fields: &[String]) -> Option<Row> {
    let [
        scene,
        method,
        seed,
        status,
        plan_s,
        plan_cpu_s,
        floor_s,
        check_s,
        accepted,
        level,
        nodes,
        samples,
        work,
        restarts,
        transfers,
        relocations,
        min_margin,
        min_clearance,
        angle_left_deg,
        cause,
    ] = fields
    else {
        return None;
    };
    let optional = |text: &String| if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) };
    Some(Row {
        scene: scene.clone(),
        method: method.clone(),
        seed: seed.parse().ok()?,
        status: status.clone(),
        plan_s: plan_s.parse().ok()?,
        plan_cpu_s: plan_cpu_s.parse().ok()?,
        floor_s: optional(floor_s)?,
        check_s: optional(check_s)?,
        accepted: if accepted.is_empty() { None } else { Some(accepted.parse().ok()?) },
        level: if level.is_empty() { None } else { Some(Level::named(level)?) },
        nodes: nodes.parse().ok()?,
        samples: samples.parse().ok()?,
        work: work.parse().ok()?,
        restarts: restarts.parse().ok()?,
        transfers: transfers.parse().ok()?,
        relocations: relocations.parse().ok()?,
        min_margin: optional(min_margin)?,
        min_clearance: optional(min_clearance)?,
        angle_left_deg: optional(angle_left_deg)?,
        cause: cause.clone(),
        ..Row::default()
    })
}

/// Records with the line each begins on.
fn records(text: &str) -> Vec<(u32, Vec<String>)> {
    let mut reader = ::csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
    let with_line = |record: ::csv::StringRecord| {
        let line = record.position().map_or(0, ::csv::Position::line);
        (u32::try_from(line).unwrap_or(u32::MAX), record.iter().map(str::to_owned).collect())
    };
    // Text in memory has no other error than not being text.
    reader.records().map_while(Result::ok).map(with_line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_went() {
        let folder = std::env::temp_dir().join(format!("regrasp_csv_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("rows.csv");
        let rows = [
            Row { scene: "a,\"b\"\nc".into(), plan_s: 0.1 + 0.2, floor_s: Some(1e-7), seed: 7, ..Row::default() },
            Row {
                accepted: Some(true),
                level: Some(Level::Forces),
                cause: "finger \"x\" cannot".into(),
                ..Row::default()
            },
        ];
        let mut writer = Writer::create(&path).unwrap();
        for row in &rows {
            writer.push(row).unwrap();
        }
        assert!(!path.exists());
        writer.finish().unwrap();
        assert_eq!(read(&path).unwrap(), rows);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "the partial file is gone");
        std::fs::write(&path, header() + "a,b,c\n").unwrap();
        assert_eq!(read(&path).unwrap_err().diagnostics[0].place.line, Some(2));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
