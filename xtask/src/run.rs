//! Running programs, and what the environment says.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a task comes to: nothing, or why it failed.
pub type Outcome = Result<(), String>;

/// Runs `program` with `arguments`; its output is shown. An error where it fails.
pub fn run(program: impl AsRef<Path>, arguments: &[String]) -> Outcome {
    let program = program.as_ref();
    eprintln!("+ {} {}", program.display(), arguments.join(" "));
    let status = Command::new(program).args(arguments).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{} ended with {status}", program.display())),
        Err(error) => Err(format!("{} cannot be run: {error}", program.display())),
    }
}

/// The same, and what it prints on stdout.
pub fn output(program: impl AsRef<Path>, arguments: &[String]) -> Result<String, String> {
    let program = program.as_ref();
    let output = Command::new(program).args(arguments).env("COLUMNS", "100").output();
    let output = output.map_err(|error| format!("{} cannot be run: {error}", program.display()))?;
    if !output.status.success() {
        let talk = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(format!("{} {} ended with {}: {talk}", program.display(), arguments.join(" "), output.status));
    }
    String::from_utf8(output.stdout).map_err(|_| format!("{} prints what is not UTF-8", program.display()))
}

/// Words as arguments.
pub fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(str::to_owned).collect()
}

/// The release program of this tree, built first.
pub fn regrasp() -> Result<PathBuf, String> {
    run("cargo", &words("build --release --locked --quiet -p regrasp_cli"))?;
    let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    Ok(folder.join("release").join(format!("regrasp{}", std::env::consts::EXE_SUFFIX)))
}

/// Runs the release program with the words of `line`.
pub fn regrasp_with(program: &Path, line: &str) -> Outcome {
    run(program, &words(line))
}

/// The folder with models of real hands, where there is one.
pub fn models() -> Option<PathBuf> {
    let folder = std::env::var_os("REGRASP_MODELS").map_or_else(|| PathBuf::from("../shared/models"), PathBuf::from);
    let found = fs::canonicalize(&folder).ok();
    if found.is_none() {
        println!("SKIPPED: scenes of real hands (no models in {})", folder.display());
    }
    found
}

/// ` --package models=DIR`.
pub fn package(models: &Path) -> String {
    format!("--package models={}", models.display())
}

/// A number that the environment sets, else `default`.
pub fn number(name: &str, default: u64) -> Result<u64, String> {
    match std::env::var(name) {
        Err(_) => Ok(default),
        Ok(text) => text.parse().map_err(|_| format!("{name} is {text:?}; expected a whole number")),
    }
}

/// Where scratch files go; made when it is not there.
pub fn out(name: &str) -> Result<PathBuf, String> {
    let folder = std::env::var_os("OUT").map_or_else(|| PathBuf::from("out"), PathBuf::from).join(name);
    fs::create_dir_all(&folder).map_err(|error| format!("{} cannot be made: {error}", folder.display()))?;
    Ok(folder)
}

/// The files of `folder` whose names end with `ending`, sorted.
pub fn files(folder: &str, ending: &str) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{folder} cannot be read: {error}"))?;
    let mut found: Vec<PathBuf> =
        entries.flatten().map(|entry| entry.path()).filter(|path| path.to_string_lossy().ends_with(ending)).collect();
    found.sort();
    Ok(found)
}

/// Paths as words of a command line.
pub fn joined(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}
