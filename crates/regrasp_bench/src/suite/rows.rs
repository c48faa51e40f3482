//! Rows of a suite as CSV: those of `csv`, with the job's name and the hash of everything that the row depends on.
//!
//! A run that is cut off leaves `rows.csv.partial`; the next one takes over every row whose hash is still right.

use super::Job;
use crate::csv;
use crate::row::Row;
use regrasp_base::{InputError, files};
use regrasp_scene::Scene;
use std::path::Path;

/// A row, and what it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct SuiteRow {
    /// Name of the job.
    pub job: String,
    /// What it was made from: see [`inputs_hash`].
    pub inputs: String,
    /// The trial.
    pub row: Row,
}

const LEADING: [&str; 2] = ["job", "inputs"];

/// The header line.
pub fn header() -> String {
    format!("{},{}", LEADING.join(","), csv::header())
}

/// One line.
pub fn line(row: &SuiteRow) -> String {
    csv::line_after(&[row.job.clone(), row.inputs.clone()], &row.row)
}

/// Hash of everything that the rows of `job` depend on but for the seed: the program (by the hash of its file), the files
/// of the scene, settings and limits.
pub fn inputs_hash(program_sha256: &str, scene: &Scene, job: &Job) -> String {
    let inputs: Vec<_> = scene.inputs.iter().map(|file| (&file.role, &file.name, &file.sha256)).collect();
    let all = serde_json::json!([
        program_sha256,
        inputs,
        job.settings,
        job.tracking,
        job.max_work,
        job.time_limit_s,
        job.turn_deg
    ]);
    files::sha256(all.to_string().as_bytes())
}

/// Rows of earlier runs: those of the file at `path` and of the partial one beside it; none when there is neither.
///
/// Errors: as [`csv::read`]. A last line that a crash has cut off is left out.
pub fn earlier(path: &Path) -> Result<Vec<SuiteRow>, InputError> {
    let mut rows = Vec::new();
    for path in [path.to_owned(), csv::partial_path(path)] {
        if path.is_file() {
            rows.extend(read(&path)?);
        }
    }
    Ok(rows)
}

/// Reads what was written before.
pub fn read(path: &Path) -> Result<Vec<SuiteRow>, InputError> {
    let mut text = files::read_text(path)?;
    text.truncate(text.rfind('\n').map_or(0, |end| end + 1));
    csv::read_leading(path, &text, &LEADING)?
        .into_iter()
        .map(|(leading, row)| {
            let [job, inputs] = <[String; 2]>::try_from(leading).expect("as many fields as asked for");
            Ok(SuiteRow { job, inputs, row })
        })
        .collect()
}

/// The row of an earlier run for one trial of a job, if it is still right.
pub fn kept<'a>(earlier: &'a [SuiteRow], job: &str, inputs: &str, seed: u64) -> Option<&'a SuiteRow> {
    earlier.iter().find(|row| row.job == job && row.inputs == inputs && row.row.seed == seed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_a_line_cut_off_is_left_out() {
        let folder = std::env::temp_dir().join(format!("regrasp_suite_rows_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("rows.csv");
        let row = |seed| SuiteRow {
            job: "Table 1, \"a\"/b".into(),
            inputs: "0f".into(),
            row: Row { scene: "s".into(), seed, plan_s: 0.25, ..Row::default() },
        };
        assert_eq!(earlier(&path).unwrap(), []);
        std::fs::write(&path, header() + &line(&row(0))).unwrap();
        let cut = line(&row(2));
        std::fs::write(csv::partial_path(&path), header() + &line(&row(1)) + &cut[..cut.len() - 3]).unwrap();
        let rows = earlier(&path).unwrap();
        assert_eq!(rows, [row(0), row(1)]);
        assert_eq!(kept(&rows, &rows[0].job, "0f", 1), Some(&rows[1]));
        assert_eq!(kept(&rows, &rows[0].job, "1f", 1), None, "made from something else");
        assert_eq!(kept(&rows, "another", "0f", 1), None);
        std::fs::write(&path, "job,inputs,scene\n").unwrap();
        assert!(earlier(&path).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
