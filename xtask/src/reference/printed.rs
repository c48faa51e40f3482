//! Commands that README and book print: commands and options that the program has, and files of the repository that exist.

use crate::run::{Outcome, output, words};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// An error where a document prints a command that cannot be typed.
pub fn check(program: &Path) -> Outcome {
    let mut documents = vec![PathBuf::from("README.md"), PathBuf::from("scenes/README.md")];
    documents_in(Path::new("docs"), &mut documents)?;
    documents.sort();
    let (mut helps, mut faults, mut n_commands) = (BTreeMap::new(), Vec::new(), 0);
    for document in &documents {
        let text = fs::read_to_string(document).map_err(|error| format!("{}: {error}", document.display()))?;
        for command in commands(&text) {
            n_commands += 1;
            if let Some(fault) = fault(program, &command, &mut helps) {
                faults.push(format!("{}: `{command}`: {fault}", document.display()));
            }
        }
    }
    match (faults.is_empty(), n_commands > 30) {
        (true, true) => Ok(()),
        (true, false) => Err(format!("the documents print {n_commands} commands only: they were not found")),
        (false, _) => Err(format!("commands that cannot be typed:\n{}", faults.join("\n"))),
    }
}

fn documents_in(folder: &Path, found: &mut Vec<PathBuf>) -> Outcome {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            documents_in(&path, found)?;
        } else if path.extension().is_some_and(|ending| ending == "md") && !path.ends_with("command-line.md") {
            found.push(path);
        }
    }
    Ok(())
}

/// Lines of code that begin with `regrasp`, without comments; a line that ends with a backslash goes on in the next.
fn commands(text: &str) -> Vec<String> {
    let text = text.replace("\\\n", " ");
    let mut found = Vec::new();
    for line in text.lines() {
        let line = line.trim_start().split(" #").next().unwrap_or_default();
        for part in line.split("&&").map(str::trim) {
            let is_command = part.starts_with("regrasp ") && part.split_whitespace().nth(1).is_some_and(is_word);
            if is_command && !part.contains('`') && !part.contains(": ") {
                found.push(part.split_whitespace().collect::<Vec<_>>().join(" "));
            }
        }
    }
    found
}

fn is_word(word: &str) -> bool {
    word.starts_with("--") || word.bytes().all(|byte| byte.is_ascii_lowercase())
}

/// What is wrong with `command`, if anything. `helps` keeps the texts of commands asked for before.
fn fault(program: &Path, command: &str, helps: &mut BTreeMap<String, String>) -> Option<String> {
    let parts: Vec<&str> = command.split_whitespace().skip(1).collect();
    let name = match parts.as_slice() {
        ["roadmap", inner, ..] => format!("roadmap {inner}"),
        [flag, ..] if flag.starts_with("--") => String::new(),
        [name, ..] => (*name).to_owned(),
        [] => return None,
    };
    if !helps.contains_key(&name) {
        match output(program, &words(&format!("help {name}"))) {
            Ok(help) => helps.insert(name.clone(), help),
            Err(_) => return Some("there is no such command".to_owned()),
        };
    }
    let help = &helps[&name];
    let knows = |flag: &str| help.split(|c: char| c.is_whitespace() || ",<>[]|=".contains(c)).any(|word| word == flag);
    let flags = parts.iter().filter(|part| part.starts_with('-') && part.parse::<f64>().is_err());
    if let Some(flag) = flags.map(|part| part.split('=').next().unwrap_or_default()).find(|flag| !knows(flag)) {
        return Some(format!("there is no option {flag}"));
    }
    let is_file =
        |part: &&&str| ["scenes/", "suites/", "docs/", "assets/"].iter().any(|folder| part.starts_with(folder));
    let missing = parts.iter().filter(is_file).find(|part| !part.contains('*') && !Path::new(part).exists());
    missing.map(|part| format!("{part} does not exist"))
}
