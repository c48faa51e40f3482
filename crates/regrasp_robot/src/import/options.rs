//! How files are read, and which were.

use super::kept::KeptFiles;
use super::resolve::{Hints, ResolveOptions, Resolved, resolve_own, resolve_with};
use crate::contact_model::ContactModel;
use regrasp_base::{Diagnostic, InputError, Place};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// How hands and robots are read.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// Where packages are.
    pub resolve: ResolveOptions,
    /// Drop, with a note, what is not supported or not found: joints of unsupported types are held fixed, collision
    /// geometry that cannot be read is left out, unknown links in an SRDF are skipped.
    pub lenient: bool,
    /// Contact model of fingertips of which the hand file says nothing.
    pub contact: ContactModel,
    /// Name of the base link of a hand that is guessed from a bare URDF; hand files have their own.
    pub base: Option<String>,
    /// Wall-clock instant after which reading is given up (`F004`). It cuts and never changes what is read.
    pub deadline: Option<Instant>,
    /// Let joints move that follow joints of other fingers: see [`crate::hand::Hand::ties`]. Without it they are held still, where that
    /// leaves every finger a joint.
    pub untie: bool,
    /// Files in memory, in place of all files on disk.
    pub kept: Option<Arc<KeptFiles>>,
}

impl LoadOptions {
    /// The bytes of the file at `path`, from memory where files are kept. Errors: it cannot be read (`F001`).
    pub fn read(&self, path: &Path) -> Result<Vec<u8>, InputError> {
        self.kept.as_ref().map_or_else(|| regrasp_base::files::read(path), |kept| kept.read(path))
    }

    /// True when there is a file at `path`.
    pub fn is_file(&self, path: &Path) -> bool {
        self.kept.as_ref().map_or_else(|| path.is_file(), |kept| kept.contains(path))
    }

    /// The file that `name`, found in the model file `model`, means. Errors: as [`super::resolve::resolve`].
    pub fn resolve(&self, name: &str, model: &Path, place: Place) -> Result<Resolved, Diagnostic> {
        self.resolve_with(name, model, place, Hints::SameNameNear)
    }

    /// As [`Self::resolve`], with the hints asked for.
    pub(crate) fn resolve_with(
        &self,
        name: &str,
        model: &Path,
        place: Place,
        hints: Hints,
    ) -> Result<Resolved, Diagnostic> {
        match &self.kept {
            Some(kept) => kept.resolve(name, model, place),
            None => resolve_with(name, model, place, &self.resolve, hints),
        }
    }

    /// The file that the user's own file `file` names. Errors: as [`super::resolve::resolve_own`].
    pub(crate) fn resolve_own(&self, name: &str, file: &Path, place: Place) -> Result<Resolved, Diagnostic> {
        match &self.kept {
            Some(kept) => kept.resolve(name, file, place),
            None => resolve_own(name, file, place, &self.resolve),
        }
    }

    /// Err when the deadline has passed before `path` was read and made ready (`F004`).
    pub fn check_time(&self, path: &Path) -> Result<(), InputError> {
        match self.deadline {
            Some(deadline) if Instant::now() >= deadline => {
                Err(Diagnostic::new(OUT_OF_TIME, Place::file(path), "the time limit passed while this file was read")
                    .fix("allow more time, or simplify the meshes")
                    .into())
            }
            _ => Ok(()),
        }
    }
}

/// The code of reading that a deadline cut.
pub const OUT_OF_TIME: &str = "F004";

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoadedInput {
    /// What it is for: `hand`, `urdf`, `srdf`, `mesh`.
    pub role: String,
    /// How the file that names it spells it; the file name for the outermost.
    pub name: String,
    /// Where it was found.
    pub path: PathBuf,
    /// SHA-256 of its bytes, lower-case hexadecimal.
    pub sha256: String,
}
