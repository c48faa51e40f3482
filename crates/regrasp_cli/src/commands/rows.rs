//! Rows of benchmarks: their files, and what is said of them.

use crate::outputs::Output;
use crate::stop::Stop;
use crate::talk::Talk;
use regrasp_bench::{Row, csv};
use serde_json::json;
use std::path::Path;

/// The files of rows that go to `path`: the file, and that of the rows until all are there.
pub fn of_rows(path: &Path) -> [Output; 2] {
    [Output::new("--csv", path), Output::beside("--csv", csv::partial_path(path))]
}

/// One line per miss, rejection or plan without floor; other solved seeds stay silent but for `--json`.
pub fn say_row(row: &Row, talk: &Talk) {
    talk.event("row", json!(row));
    if row.status != "solved" {
        let left = row.angle_left_deg.map_or(String::new(), |angle| format!(", {angle:.0} deg left"));
        talk.say(format!("miss   {} seed {}: {}{left}; {}", row.scene, row.seed, row.status, row.cause));
    } else if row.accepted == Some(false) {
        talk.say(format!("REJECTED   {} seed {}: {}", row.scene, row.seed, row.cause));
    } else if row.lacks_floor() {
        talk.say(format!("NO FLOOR   {} seed {}: {}", row.scene, row.seed, row.cause));
    }
}

/// Makes the folder of a file that this command is about to write.
pub fn make_folder_of(path: &Path) -> Result<(), Stop> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => {
            std::fs::create_dir_all(folder).map_err(|error| Stop::unwritable(folder, &error))
        }
        _ => Ok(()),
    }
}
