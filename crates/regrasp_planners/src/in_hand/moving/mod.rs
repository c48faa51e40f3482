//! Motions of the object with fingers that keep their contacts, roll, or are free (Saut 2011, sec. 4.2.3).

/// How a contact moves on a path in GS_n.
mod contact_path;
/// Linear paths in GS_n.
pub mod grasp_path;
#[cfg(test)]
mod roll_tests;
/// Motions in which soft fingertips do not turn about their normals.
pub mod spin;
/// One step of the object.
pub mod step;
/// Transfer paths.
pub mod transfer;
