//! The pages of the book that are generated: command line, settings, error codes.

mod codes;
mod command_line;
mod printed;
mod settings;

use crate::run::{Outcome, regrasp};
use std::fs;
use std::path::{Path, PathBuf};

/// Writes the pages; with `--check` fails where one is not as it would be written.
pub fn task(arguments: &[String]) -> Outcome {
    let checks = match arguments {
        [] => false,
        [flag] if flag == "--check" => true,
        _ => return Err(format!("cargo xtask reference takes --check or nothing, not {arguments:?}")),
    };
    let program = regrasp()?;
    if checks {
        printed::check(&program)?;
    }
    let sources = sources()?;
    let pages = [
        ("command-line.md", command_line::page(&program)?),
        ("settings.md", settings::page(&program, &sources)?),
        ("error-codes.md", codes::page(&sources)?),
    ];
    let mut stale = Vec::new();
    for (name, text) in pages {
        let path = Path::new("docs/reference").join(name);
        if checks {
            if fs::read_to_string(&path).unwrap_or_default() != text {
                stale.push(path.display().to_string());
            }
        } else {
            fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))?;
        }
    }
    match stale.is_empty() {
        true => Ok(()),
        false => Err(format!("out of date: {}; `cargo xtask reference` writes them", stale.join(", "))),
    }
}

/// A source file and its text.
pub struct Source {
    /// The crate that it belongs to.
    pub package: String,
    /// Its text.
    pub text: String,
}

/// All sources of the crates but tests, sorted by path.
fn sources() -> Result<Vec<Source>, String> {
    let mut paths = Vec::new();
    walk(Path::new("crates"), &mut paths)?;
    paths.sort();
    let mut found = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        // Tests at the end of a file are no messages of the program.
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().to_owned();
        let package = path.components().nth(1).map(|part| part.as_os_str().to_string_lossy().into_owned());
        found.push(Source { package: package.unwrap_or_default(), text });
    }
    Ok(found)
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) -> Outcome {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let is_test = name == "tests"
            || name.contains("tests.rs")
            || name == "examples"
            || name == "node_modules"
            || name == "page";
        if path.is_dir() && !is_test {
            walk(&path, found)?;
        } else if name.ends_with(".rs") && !is_test {
            found.push(path);
        }
    }
    Ok(())
}
