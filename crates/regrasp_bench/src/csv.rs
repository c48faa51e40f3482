//! Rows as CSV (RFC 4180): written whole at the end, appended one by one to `FILE.partial` meanwhile.

use crate::row::Row;
use regrasp_base::{Diagnostic, InputError, Place};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const COLUMNS: [&str; 19] = [
    "scene",
    "method",
    "seed",
    "status",
    "plan_s",
    "plan_cpu_s",
    "floor_s",
    "check_s",
    "accepted",
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

/// The header line.
pub fn header() -> String {
    COLUMNS.join(",") + "\n"
}

/// One line.
pub fn line(row: &Row) -> String {
    let optional = |value: Option<f64>| value.map(|x| x.to_string()).unwrap_or_default();
    let fields = [
        quoted(&row.scene),
        quoted(&row.method),
        row.seed.to_string(),
        quoted(&row.status),
        row.plan_s.to_string(),
        row.plan_cpu_s.to_string(),
        optional(row.floor_s),
        optional(row.check_s),
        row.accepted.map(|value| value.to_string()).unwrap_or_default(),
        row.nodes.to_string(),
        row.samples.to_string(),
        row.work.to_string(),
        row.restarts.to_string(),
        row.transfers.to_string(),
        row.relocations.to_string(),
        optional(row.min_margin),
        optional(row.min_clearance),
        optional(row.angle_left_deg),
        quoted(&row.cause),
    ];
    fields.join(",") + "\n"
}

fn quoted(text: &str) -> String {
    let needs_quotes = text.contains([',', '"', '\n', '\r']);
    if needs_quotes { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
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
        let mut name = path.file_name().ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?.to_owned();
        name.push(".partial");
        let partial_path = path.with_file_name(name);
        let mut partial = File::create(&partial_path)?;
        let text = header();
        partial.write_all(text.as_bytes())?;
        Ok(Writer { path: path.to_owned(), partial_path, partial, text })
    }

    /// Appends a row.
    pub fn push(&mut self, row: &Row) -> io::Result<()> {
        let line = line(row);
        self.partial.write_all(line.as_bytes())?;
        self.partial.flush()?;
        self.text.push_str(&line);
        Ok(())
    }

    /// Writes the file whole and removes the partial one.
    pub fn finish(self) -> io::Result<()> {
        regrasp_base::files::write_atomic(&self.path, self.text.as_bytes())?;
        std::fs::remove_file(&self.partial_path)
    }
}

/// Reads what [`Writer`] wrote. Errors: a header of other columns (`V020`), a line that is not a row (`V021`).
pub fn read(path: &Path) -> Result<Vec<Row>, InputError> {
    let text = regrasp_base::files::read_text(path)?;
    let mut records = records(&text).into_iter();
    let names = records.next().map(|(_, fields)| fields).unwrap_or_default();
    if names != COLUMNS {
        return Err(Diagnostic::new("V020", Place::line(path, 1), format!("has the columns {}", names.join(",")))
            .expected(COLUMNS.join(","))
            .fix("give a CSV file that `regrasp bench --csv` of this version wrote")
            .into());
    }
    records
        .map(|(line, fields)| {
            row_of(&fields)
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
    })
}

/// Records with the line each begins on.
fn records(text: &str) -> Vec<(u32, Vec<String>)> {
    let mut found = Vec::new();
    let mut fields = vec![String::new()];
    let (mut line, mut began) = (1, 1);
    let mut in_quotes = false;
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        line += u32::from(c == '\n');
        match c {
            '"' if in_quotes && characters.peek() == Some(&'"') => {
                characters.next();
                push(&mut fields, '"');
            }
            '"' => in_quotes = !in_quotes,
            ',' if !in_quotes => fields.push(String::new()),
            '\r' if !in_quotes => {}
            '\n' if !in_quotes => {
                found.push((began, std::mem::replace(&mut fields, vec![String::new()])));
                began = line;
            }
            c => push(&mut fields, c),
        }
    }
    if fields.iter().any(|field| !field.is_empty()) {
        found.push((began, fields));
    }
    found
}

fn push(fields: &mut [String], c: char) {
    if let Some(field) = fields.last_mut() {
        field.push(c);
    }
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
            Row { accepted: Some(true), cause: "finger \"x\" cannot".into(), ..Row::default() },
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
