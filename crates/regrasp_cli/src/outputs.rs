//! Files that a command writes: what cannot be written, or would be lost, is refused before any work is done.

use crate::stop::Stop;
use regrasp::base::files;
use std::io;
use std::path::{Path, PathBuf};

/// A file that a command writes, and the argument that names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    argument: &'static str,
    path: PathBuf,
    /// False for a file that is written only in case something fails: one that cannot be written stops nothing.
    is_certain: bool,
}

impl Output {
    /// A file that is written when all goes well.
    pub fn new(argument: &'static str, path: &Path) -> Self {
        Output { argument, path: path.to_owned(), is_certain: true }
    }

    /// A file that may be written too.
    pub fn beside(argument: &'static str, path: PathBuf) -> Self {
        Output { argument, path, is_certain: false }
    }
}

/// All files that a command writes.
#[derive(Debug, Default)]
pub struct Outputs(Vec<Output>);

impl Outputs {
    /// Errors: a file that cannot be written (`F003`), two arguments that name one file, however they spell it (`A505`).
    pub fn new(outputs: impl IntoIterator<Item = Output>) -> Result<Self, Stop> {
        let mut known: Vec<Output> = Vec::new();
        for output in outputs {
            if output.is_certain {
                refuse_unwritable(&output.path)?;
            }
            if let Some(other) = known.iter().find(|other| files::is_same_file(&other.path, &output.path)) {
                let problem = format!(
                    "writes to {}, the file that {} writes to ({})",
                    output.path.display(),
                    other.argument,
                    other.path.display()
                );
                return Err(Stop::argument("A505", output.argument, problem, "another file for each"));
            }
            known.push(output);
        }
        Ok(Outputs(known))
    }

    /// Refuses to write over files that this command reads (`F003`).
    pub fn refuse_inputs<'a>(&self, inputs: impl IntoIterator<Item = &'a Path>) -> Result<(), Stop> {
        let inputs: Vec<&Path> = inputs.into_iter().collect();
        self.0.iter().try_for_each(|output| refuse_input(&output.path, inputs.iter().copied()))
    }
}

/// Refuses a path that cannot be written, before any work is done (`F003`).
pub fn refuse_unwritable(path: &Path) -> Result<(), Stop> {
    let fail = |error: io::Error| Err(Stop::unwritable(path, &error));
    if let Err(error) = files::refuse_other_than_file(path) {
        return fail(error);
    }
    if path.file_name().is_none() {
        return fail(io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name"));
    }
    match files::target_of(path).and_then(|target| probe(&target)) {
        Ok(()) => Ok(()),
        Err(error) => fail(error),
    }
}

/// Writes a file beside `path` and removes it.
fn probe(path: &Path) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.probe", std::process::id()));
    let probe = path.with_file_name(name);
    std::fs::File::create_new(&probe).and_then(|_| std::fs::remove_file(&probe))
}

/// Refuses a folder that is a file, or that cannot be made, before any work is done (`F003`). Makes nothing.
pub fn refuse_no_folder(folder: &Path) -> Result<(), Stop> {
    let fail = |error: io::Error| Err(Stop::unwritable(folder, &error));
    // The folder, or what stands nearest above where it is to be made.
    for above in folder.ancestors() {
        let above = if above.as_os_str().is_empty() { Path::new(".") } else { above };
        match std::fs::metadata(above) {
            Ok(metadata) if metadata.is_dir() => {
                return probe(&above.join("folder")).or_else(fail);
            }
            Ok(_) => return fail(io::Error::from(io::ErrorKind::NotADirectory)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return fail(error),
        }
    }
    Ok(())
}

/// Refuses to write over a file that this command reads (`F003`).
pub fn refuse_input<'a>(path: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<(), Stop> {
    match inputs.into_iter().find(|input| files::is_same_file(path, input)) {
        None => Ok(()),
        Some(_) => Err(Stop::unwritable(path, &io::Error::other("it is an input of this command"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_cannot_be_written_is_refused_and_a_good_one_left_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        assert!(refuse_unwritable(&folder.path().join("missing").join("plan.json")).is_err());
        assert!(refuse_unwritable(folder.path()).is_err());
        assert!(refuse_unwritable(&folder.path().join("plan.json")).is_ok());
        assert!(refuse_input(&folder.path().join("plan.json"), [folder.path()]).is_ok());
        assert!(refuse_input(&folder.path().join("."), [folder.path()]).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_folder_is_one_or_can_be_made() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("file"), "x").unwrap();
        for good in ["", "new", "new/deeper"] {
            assert!(refuse_no_folder(&folder.path().join(good)).is_ok(), "{good}");
        }
        for bad in ["file", "file/below"] {
            assert!(refuse_no_folder(&folder.path().join(bad)).is_err(), "{bad}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn one_file_for_two_outputs_is_refused_however_it_is_spelled() {
        let folder = tempfile::tempdir().unwrap();
        let outputs = |a: &str, b: &str| {
            Outputs::new([
                Output::new("--output", &folder.path().join(a)),
                Output::new("--report", &folder.path().join(b)),
            ])
        };
        assert!(outputs("o.json", "./o.json").is_err());
        assert!(outputs("o.json", "o.html").is_ok());
    }
}
