//! `gravity`: a direction, or any.

use crate::gravity::Gravity;
use regrasp_base::toml_table::{Found, Table};
use regrasp_geometry::{Pose, Vector};

/// The direction stated, if one is and the frame that it is stated in is known; what is wrong with it is told in any case.
///
/// Errors: neither a direction nor `"any"` (`S103`, `S104`), the zero vector (`S107`).
pub(super) fn gravity(root: &mut Table, world_from_frame: Option<&Pose>, found: &mut Found) -> Option<Gravity> {
    let entry = root.optional("gravity")?;
    if let Some(word) = entry.as_text() {
        if word == "any" {
            return Some(Gravity::Any);
        }
        let diagnostic = entry.error("S104", found, format!("is \"{word}\"")).expected(EXPECTED);
        found.diagnostics.push(diagnostic);
        return None;
    }
    let down = Vector::from(entry.numbers::<3>(found)?);
    if down == Vector::zeros() {
        let diagnostic = entry.error("S107", found, "is the zero vector, which is no direction");
        found.diagnostics.push(diagnostic.expected(EXPECTED));
        return None;
    }
    Gravity::along(world_from_frame?, &down)
}

/// What may stand there.
const EXPECTED: &str =
    "a direction of any length, in the hand's frame (version 1) or the world's (version 2), or \"any\"";
