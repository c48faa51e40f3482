//! A hand of a scene file.

use super::files::Files;
use super::{contact, pose, task};
use crate::scene::{InputFile, SceneHand};
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::Pose;
use regrasp_robot::Hand;
use regrasp_robot::contact_model;
use regrasp_robot::import::{LoadOptions, load_hand};
use regrasp_robot::inspect::tip_report;
use regrasp_robot::tip::{LARGEST_MISFIT, TipShape};

/// Largest reach that makes sense, in metres.
const MAX_REACH: f64 = 10.0;

/// Reads a hand from its table: the hand of the file named, its place in the world, rest posture, contact models and reach.
pub(super) fn hand(mut table: Table, name: String, files: &mut Files, found: &mut Found) -> Option<SceneHand> {
    let file = table.required(found, "file", "add file = \"hand.toml\" or a .urdf");
    let pose = match table.optional("world_from_hand") {
        Some(entry) => entry.table(found).and_then(|mut inside| {
            let pose = pose::pose(&mut inside, found);
            inside.finish(found);
            pose
        }),
        None => Some(Pose::identity()),
    };
    let rest = table.optional("rest");
    let default_contact = contact_model::read(&mut table, "contact", files.options.contact, "S106", found);
    let contacts = table.optional("contacts");
    let reach = table.optional("reach").and_then(|entry| {
        let expected = format!("a radius from 0 to {MAX_REACH} metres");
        entry.number_that(found, &expected, |x| (0.0..=MAX_REACH).contains(&x))
    });
    table.finish(found);
    let file = file?;
    let path = files.locate(&file, found)?;
    let options = LoadOptions { contact: default_contact?, ..files.options.clone() };
    let read = || {
        let mut loaded = load_hand(&path, &options)?;
        loaded.notes.extend(notes_on_tips(&loaded.hand, &path.display().to_string()));
        Ok(loaded)
    };
    let loaded = match files.stock.hand(&path, options.contact, read) {
        Ok(loaded) => loaded,
        Err(error) => {
            found.diagnostics.extend(error);
            return None;
        }
    };
    found.notes.extend(loaded.notes);
    let name_in_scene = file.text(found)?.to_owned();
    for input in loaded.inputs {
        let name = if input.path == path { name_in_scene.clone() } else { input.name };
        files.inputs.push(InputFile { role: input.role, name, path: input.path, sha256: input.sha256 });
    }
    let mut hand = loaded.hand;
    refuse_rough_tips(&hand, &file, found);
    if let Some(entry) = contacts {
        contact::apply(&entry, &mut hand, found)?;
    }
    if let Some(entry) = rest {
        let mut values = task::joint_values(&entry.table(found)?, &hand, false, found)?.into_iter();
        for finger in &mut hand.fingers {
            finger.rest = values.by_ref().take(finger.rest.len()).collect();
        }
    }
    Some(SceneHand { name, hand, world_from_hand: pose?, carrier: None, reach })
}

/// What of tip links stands out of the declared tips, and would hit the object first.
fn notes_on_tips(hand: &Hand, file: &str) -> Vec<String> {
    let mut notes = Vec::new();
    for finger in &hand.fingers {
        let report = tip_report(hand, finger);
        let Some(worst) = report.stands_out.iter().max_by(|a, b| a.by.total_cmp(&b.by)) else { continue };
        let [x, y, z] = worst.at.map(|x| 1e3 * x);
        notes.push(format!(
            "{file}: finger \"{}\": collision geometry of its tip link stands out of the declared {} by {:.2} mm ({} faces of \
             <collision> element {}, most at [{x:.1}, {y:.1}, {z:.1}] mm in the link's frame): it touches the object before the tip \
             does; `regrasp inspect` on the URDF writes a tip that fits",
            finger.name,
            report.surface,
            1e3 * worst.by,
            worst.n_faces,
            worst.element
        ));
    }
    notes
}

/// Refuses tips that are meshes and that no smooth surface follows closely (`S108`).
pub(super) fn refuse_rough_tips(hand: &Hand, file: &Entry, found: &mut Found) {
    for finger in &hand.fingers {
        if let TipShape::Hull { misfit, .. } = finger.tip.shape
            && misfit > LARGEST_MISFIT
        {
            let off =
                format!("finger \"{}\": the tip's hull is {:.2} mm off its smooth surface", finger.name, 1e3 * misfit);
            let diagnostic = file.error("S108", found, off).expected("a rounded tip, within 0.2 mm over its pad");
            let fix = "in the hand file give the tip a pad around what touches, or shape = \"ellipsoid\" or \"sphere\"";
            found.diagnostics.push(diagnostic.fix(fix));
        }
    }
}
