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
    if entry.as_text().is_some() {
        return entry.choice(found, &["any"]).map(|_| Gravity::Any);
    }
    let down_in_hand = Vector::from(entry.numbers::<3>(found)?);
    if down_in_hand.norm() <= 1e-9 {
        let diagnostic = entry.error("S107", found, "is the zero vector, which is no direction");
        found.diagnostics.push(diagnostic.expected("a direction in the hand's frame, of any length, or \"any\""));
        return None;
    }
    Gravity::in_hand(hand?, &down_in_hand)
}
