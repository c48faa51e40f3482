//! How files are read, and which were.

use super::resolve::ResolveOptions;
use crate::contact_model::ContactModel;
use regrasp_base::{Diagnostic, InputError, Place};
use std::path::{Path, PathBuf};
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
}

impl LoadOptions {
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
