//! `gravity`: a direction in the hand's frame, or any.

use crate::gravity::Gravity;
use regrasp_base::toml_table::{Found, Table};
use regrasp_geometry::Vector;
use regrasp_robot::Hand;

/// The direction stated, if one is and the hand is known; what is wrong with it is told in any case.
///
/// Errors: neither a direction nor `"any"` (`S103`, `S104`), the zero vector (`S107`).
pub(super) fn gravity(root: &mut Table, hand: Option<&Hand>, found: &mut Found) -> Option<Gravity> {
    let entry = root.optional("gravity")?;
    if let Some(word) = entry.as_text() {
        if word == "any" {
            return Some(Gravity::Any);
        }
        let diagnostic = entry.error("S104", found, format!("is \"{word}\"")).expected(EXPECTED);
        found.diagnostics.push(diagnostic);
        return None;
    }
    let down_in_hand = Vector::from(entry.numbers::<3>(found)?);
    if down_in_hand == Vector::zeros() {
        let diagnostic = entry.error("S107", found, "is the zero vector, which is no direction");
        found.diagnostics.push(diagnostic.expected(EXPECTED));
        return None;
    }
    Gravity::in_hand(hand?, &down_in_hand)
}

/// What may stand there.
const EXPECTED: &str = "a direction in the hand's frame, of any length, or \"any\"";
