//! What every floor of the tower may use and none may know more than.
//!
//! Keyed random numbers, work budgets, diagnostics about input files, strict TOML, files that are written whole or not
//! at all.

/// Work budgets, deadlines and interruption.
pub mod budget;
/// Errors in input files: every cause, with file, line, element, value seen, value expected and fix.
pub mod diagnostic;
/// Reading with a size cap, hashing, and writing through a temporary file.
pub mod files;
/// Where a value stands in a JSON text.
pub mod json_place;
/// XML that no parser should see.
pub mod markup;
/// Random numbers keyed by (seed, purpose, index).
pub mod random;
/// TOML tables read strictly, with the place of every key and value.
pub mod toml_table;

pub use budget::{Budget, Interrupt};
pub use diagnostic::{Diagnostic, InputError, Place};
pub use random::Rng;
