//! Files held in memory: what a hand or a scene was read from, kept so that it can be read where its files are not.

use super::resolve::Resolved;
use regrasp_base::{Diagnostic, InputError, Place};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Files by the path at which they were found. While files are kept no other file is read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct KeptFiles {
    /// By paths without detours.
    files: BTreeMap<PathBuf, KeptFile>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct KeptFile {
    /// Where it was found.
    path: PathBuf,
    /// How the file that names it spells it.
    name: String,
    bytes: Arc<[u8]>,
}

impl KeptFiles {
    /// Keeps `bytes` as the file at `path`, which another file names `name`.
    pub fn insert(&mut self, path: PathBuf, name: String, bytes: Vec<u8>) {
        self.files.insert(without_detours(&path), KeptFile { path, name, bytes: bytes.into() });
    }

    /// True when there is a file at `path`.
    pub fn contains(&self, path: &Path) -> bool {
        self.files.contains_key(&without_detours(path))
    }

    /// The bytes of the file at `path`. Errors: it was not kept (`F001`).
    pub fn read(&self, path: &Path) -> Result<Vec<u8>, InputError> {
        let file = self.files.get(&without_detours(path)).ok_or_else(|| {
            Diagnostic::new("F001", Place::file(path), "is not one of the files that were kept with the scene")
        })?;
        Ok(file.bytes.to_vec())
    }

    /// The file that `name`, found in the file `model`, means: the one at that path, else the one that was named so.
    ///
    /// Errors: it was not kept (`U101`).
    pub(crate) fn resolve(&self, name: &str, model: &Path, place: Place) -> Result<Resolved, Diagnostic> {
        let beside = without_detours(&model.parent().unwrap_or(Path::new("")).join(name));
        let file = self.files.get(&beside).or_else(|| self.files.values().find(|file| file.name == name));
        file.map(|file| Resolved { path: file.path.clone(), notes: Vec::new() }).ok_or_else(|| {
            let problem = format!("\"{name}\" is not one of the files that were kept with the scene");
            Diagnostic::new("U101", place, problem).fix("read the scene again from its files")
        })
    }
}

/// The path without `.`, and without folders that `..` leaves at once. No link can stand in the way: these files are on no disk.
fn without_detours(path: &Path) -> PathBuf {
    let mut short = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(short.components().next_back(), Some(Component::Normal(_))) => {
                short.pop();
            }
            other => short.push(other),
        }
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_beside_the_model_or_by_their_name_and_nowhere_else() {
        let mut kept = KeptFiles::default();
        kept.insert("a/hand.urdf".into(), "hand.urdf".into(), b"urdf".to_vec());
        kept.insert("b/tip.stl".into(), "package://hand/tip.stl".into(), b"tip".to_vec());
        let find = |name: &str| kept.resolve(name, Path::new("a/hand.toml"), Place::file("a/hand.toml"));
        assert_eq!(find("hand.urdf").unwrap().path, Path::new("a/hand.urdf"));
        assert_eq!(find("package://hand/tip.stl").unwrap().path, Path::new("b/tip.stl"));
        assert_eq!(kept.read(Path::new("b/tip.stl")).unwrap(), b"tip");
        // A robot may name the hand of another folder; the path is told as it was found.
        kept.insert("a/../c/hand.toml".into(), "hand.toml".into(), b"hand".to_vec());
        let find = |name: &str| kept.resolve(name, Path::new("a/hand.toml"), Place::file("a/hand.toml"));
        assert_eq!(find("../c/hand.toml").unwrap().path, Path::new("a/../c/hand.toml"));
        assert_eq!(find("../c/./../b/tip.stl").unwrap().path, Path::new("b/tip.stl"));
        assert_eq!(find("other.urdf").unwrap_err().code, "U101");
        assert_eq!(kept.read(Path::new("Cargo.toml")).unwrap_err().diagnostics[0].code, "F001");
    }
}
