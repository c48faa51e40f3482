//! Rows of a growth curve as CSV: those of `csv`, after columns of their own.

use super::{Cost, Curve};
use crate::csv;
use crate::row::Row;
use regrasp_base::{Diagnostic, InputError, Place, files};
use std::path::Path;

/// A trial, and the point that it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct GrowthRow {
    /// Curve.
    pub curve: Curve,
    /// Object.
    pub object: String,
    /// Fingers, triangles, obstacles or threads.
    pub size: u64,
    /// Time to load the scene; the same in all rows of a point.
    pub load: Cost,
    /// Wall-clock time of the whole batch, in seconds, where queries were planned at the same time.
    pub batch_s: Option<f64>,
    /// Cores of the machine.
    pub cores: usize,
    /// The trial.
    pub row: Row,
}

const LEADING: [&str; 7] = ["curve", "object", "size", "load_s", "load_cpu_s", "batch_s", "cores"];

/// The header line.
pub fn header() -> String {
    format!("{},{}", LEADING.join(","), csv::header())
}

/// One line.
pub fn line(row: &GrowthRow) -> String {
    let leading = [
        row.curve.name().to_owned(),
        row.object.clone(),
        row.size.to_string(),
        row.load.wall_s.to_string(),
        row.load.cpu_s.to_string(),
        row.batch_s.map(|seconds| seconds.to_string()).unwrap_or_default(),
        row.cores.to_string(),
    ];
    csv::line_after(&leading, &row.row)
}

/// True when the file begins with the columns of [`header`]. Errors: as [`files::read_text`].
pub fn is_growth(path: &Path) -> Result<bool, InputError> {
    Ok(files::read_text(path)?.starts_with(&LEADING.join(",")))
}

/// Reads what was written before. Errors: as [`csv::read`].
pub fn read(path: &Path) -> Result<Vec<GrowthRow>, InputError> {
    let text = files::read_text(path)?;
    let rows = csv::read_leading(path, &text, &LEADING)?;
    let with_own = |(index, (own, row)): (usize, (Vec<String>, Row))| {
        growth_row(&own, row).ok_or_else(|| {
            let problem = format!("row {} is not a row of a growth curve", index + 1);
            Diagnostic::new("V021", Place::file(path), problem)
                .expected(format!("{} first", LEADING.join(",")))
                .fix("give a CSV file that `regrasp growth` of this version wrote")
                .into()
        })
    };
    rows.into_iter().enumerate().map(with_own).collect()
}

fn growth_row(own: &[String], row: Row) -> Option<GrowthRow> {
    let [curve, object, size, load_s, load_cpu_s, batch_s, cores] = own else { return None };
    Some(GrowthRow {
        curve: Curve::named(curve)?,
        object: object.clone(),
        size: size.parse().ok()?,
        load: Cost { wall_s: load_s.parse().ok()?, cpu_s: load_cpu_s.parse().ok()? },
        batch_s: if batch_s.is_empty() { None } else { Some(batch_s.parse().ok()?) },
        cores: cores.parse().ok()?,
        row,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_went() {
        let folder = std::env::temp_dir().join(format!("regrasp_growth_rows_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("threads.csv");
        let row = |batch_s| GrowthRow {
            curve: Curve::Threads,
            object: "box".into(),
            size: 8,
            load: Cost { wall_s: 0.1 + 0.2, cpu_s: 0.25 },
            batch_s,
            cores: 2,
            row: Row { scene: "threads_box".into(), seed: 7, accepted: Some(true), ..Row::default() },
        };
        let rows = [row(Some(1.5)), row(None)];
        let text: String = std::iter::once(header()).chain(rows.iter().map(line)).collect();
        std::fs::write(&path, &text).unwrap();
        assert!(is_growth(&path).unwrap());
        assert_eq!(read(&path).unwrap(), rows);
        std::fs::write(&path, text.replace("threads,", "legs,")).unwrap();
        assert_eq!(read(&path).unwrap_err().diagnostics[0].code, "V021");
        std::fs::write(&path, csv::header()).unwrap();
        assert!(!is_growth(&path).unwrap());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
