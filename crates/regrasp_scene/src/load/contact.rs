//! Contact models of single fingertips, as the scene gives them.

use regrasp_base::toml_table::{Entry, Found, suggestion};
use regrasp_robot::{ContactModel, Hand, contact_model};

/// `contacts = { finger = { model, torsion_radius } }` of `[hand]`, which stand above the hand file.
///
/// Errors: unknown finger (`S120`), and as [`contact_model::read`].
pub(super) fn apply(entry: &Entry, hand: &mut Hand, found: &mut Found) -> Option<()> {
    let mut is_good = true;
    for (name, value) in entry.table(found)?.all() {
        let Some(finger) = hand.finger_named(name) else {
            is_good = false;
            if found.diagnostics.counted_only() {
                continue;
            }
            let names = hand.fingers.iter().map(|finger| finger.name.as_str());
            let problem = format!("is not a finger of the hand{}", suggestion(name, names));
            let diagnostic = value.error("S120", found, problem);
            found.diagnostics.push(diagnostic);
            continue;
        };
        let contact = value.table(found).and_then(|mut table| {
            let contact = contact_model::read(&mut table, "model", ContactModel::default(), "S106", found)?;
            table.required(found, "model", "add model = \"soft_finger\"")?;
            table.finish(found);
            Some(contact)
        });
        match contact {
            Some(contact) => hand.fingers[finger.0].tip.contact = contact,
            None => is_good = false,
        }
    }
    is_good.then_some(())
}
