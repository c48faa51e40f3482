//! The scene file. `docs/reference/scene-format.md` says what it may contain.
//!
//! Codes: S100 not TOML, S101 unknown key, S102 missing key, S103 wrong type, S104 unknown word, S105 another format,
//! S106 exactly one of several, S107 number out of range, S110 file not found, S112 name used twice, S120 unknown joint
//! or finger, S121 joint or finger missing; M201 units, M204 mesh far from its own origin, M205 to M207 unusable mesh,
//! M210 no volume; P302 out of reach, P303 joint limit, P304 contact off the surface; V001 not finite, V002 quaternion
//! not of length one, V003 zero quaternion.

mod contact;
mod files;
mod gravity;
mod limits;
mod object;
mod pose;
mod shape;
mod task;
mod units;

pub use task::{Goal, InHandTask, StartOrientation};

use crate::gravity::Gravity;
use crate::limits::Limits;
use crate::query::TaskKind;
use crate::scene::{InputFile, Scene};
use files::Files;
use regrasp_base::InputError;
use regrasp_base::diagnostic::printable_line;
use regrasp_base::toml_table::{Codes, Found, Table};
use regrasp_geometry::Pose;
use regrasp_robot::Hand;
use regrasp_robot::contact_model::{self, ContactModel};
use regrasp_robot::import::{LoadOptions, load_hand};
use regrasp_robot::tip::{LARGEST_MISFIT, TipShape};
use std::path::Path;

/// Value of `format` in a scene file.
pub const FORMAT: &str = "regrasp-scene";
/// Value of `format_version` that this version reads.
pub const FORMAT_VERSION: f64 = 1.0;

const CODES: Codes = Codes {
    syntax: "S100",
    unknown_key: "S101",
    missing_key: "S102",
    wrong_type: "S103",
    unknown_word: "S104",
    other_format: "S105",
    out_of_range: "S107",
};

/// A scene file, read.
#[derive(Debug, Clone)]
pub struct LoadedScene {
    /// What the planner plans in.
    pub scene: Scene,
    /// What is asked.
    pub task: InHandTask,
    /// Things worth knowing that are no errors, each with its place.
    pub notes: Vec<String>,
}

/// Reads the scene file at `path` and every file it names.
///
/// Errors: every cause found, in this file and in those it names.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<LoadedScene, InputError> {
    let bytes = regrasp_base::files::read(path)?;
    let mut files = Files::new(path, &bytes, options);
    let text = regrasp_base::files::text_of(path, bytes)?;
    let mut found = Found::new(path, &text, CODES);
    let document = found.parse();
    let parts = document.as_ref().and_then(|document| read(Table::root(document), &mut files, &mut found));
    let (notes, diagnostics) = (found.notes, found.diagnostics);
    let parts = diagnostics.into_result(parts)?;
    let Parts { hand, reach, object, obstacles, gravity, limits, task } =
        parts.expect("what could not be read has left a diagnostic");
    let name = path.file_stem().map_or_else(String::new, |stem| printable_line(&stem.to_string_lossy()));
    let scene = Scene { name, hand, reach, object, obstacles, gravity, limits, inputs: files.inputs };
    Ok(LoadedScene { scene, task, notes })
}

struct Parts {
    hand: Hand,
    reach: Option<f64>,
    object: crate::object::Object,
    obstacles: Vec<crate::scene::Obstacle>,
    gravity: Option<Gravity>,
    limits: Limits,
    task: InHandTask,
}

/// Reads the whole file; none if anything is missing, with the reason in `found`.
fn read(mut root: Table, files: &mut Files, found: &mut Found) -> Option<Parts> {
    if !root.is_of_format(found, FORMAT, FORMAT_VERSION) {
        return None;
    }
    let kind = task_name(&mut root, found);
    let hand = hand(&mut root, files, found);
    let (hand, reach) = hand.map_or((None, None), |(hand, reach)| (Some(hand), reach));
    let gravity = gravity::gravity(&mut root, hand.as_ref(), found);
    let limits = limits::limits(&mut root, found);
    let object = object::object(&mut root, files, found);
    let obstacles = object::obstacles(&mut root, files, found);
    let start = task::start(&mut root, hand.as_ref(), found);
    let task = task::task(&mut root, kind.unwrap_or(TaskKind::InHand), start, hand.as_ref(), found);
    if let (Some(hand), Some(object)) = (&hand, &object) {
        units::check_sizes(hand, object, &mut root, found);
        if let Some(task) = &task {
            units::check_reach(hand, object, task, &mut root, found);
            units::check_contacts(hand, object, task, &mut root, found);
        }
    }
    root.finish(found);
    Some(Parts { hand: hand?, reach, object: object?, obstacles, gravity, limits, task: task? })
}

/// `task`. Errors: missing (`S102`), another task (`S105`).
fn task_name(root: &mut Table, found: &mut Found) -> Option<TaskKind> {
    let entry = root.required(found, "task", "add task = \"in_hand\"")?;
    let text = entry.text(found)?;
    let known = [TaskKind::InHand, TaskKind::Tracking].into_iter().find(|kind| kind.name() == text);
    if known.is_none() {
        let expected = "\"in_hand\" or \"tracking\", the tasks that this version plans";
        let diagnostic = entry.error("S105", found, format!("is \"{text}\"")).expected(expected);
        found.diagnostics.push(diagnostic);
    }
    known
}

/// Largest reach that makes sense, in metres.
const MAX_REACH: f64 = 10.0;

/// `[hand]`: the hand of the file named, placed in the world, with its rest posture and contact models; and the reach.
fn hand(root: &mut Table, files: &mut Files, found: &mut Found) -> Option<(Hand, Option<f64>)> {
    let mut table = root.required(found, "hand", "add [hand] with file = \"hand.toml\"")?.table(found)?;
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
    let default_contact = contact_model::read(&mut table, "contact", ContactModel::default(), "S106", found);
    let contacts = table.optional("contacts");
    let reach = table.optional("reach").and_then(|entry| {
        let expected = format!("a radius from 0 to {MAX_REACH} metres");
        entry.number_that(found, &expected, |x| (0.0..=MAX_REACH).contains(&x))
    });
    table.finish(found);
    let file = file?;
    let path = files.locate(&file, found)?;
    let options = LoadOptions { contact: default_contact?, ..files.options.clone() };
    let loaded = match load_hand(&path, &options) {
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
    for finger in &hand.fingers {
        if let TipShape::Hull { misfit, .. } = finger.tip.shape
            && misfit > LARGEST_MISFIT
        {
            let off = format!("finger \"{}\": the tip's hull is {:.2} mm off an ellipsoid", finger.name, 1e3 * misfit);
            let diagnostic = file.error("S108", found, off).expected("a rounded tip, within 0.2 mm over its pad");
            let fix = "in the hand file give the tip a pad around what touches, or shape = \"ellipsoid\" or \"sphere\"";
            found.diagnostics.push(diagnostic.fix(fix));
        }
    }
    if let Some(entry) = contacts {
        contact::apply(&entry, &mut hand, found)?;
    }
    if let Some(entry) = rest {
        let mut values = task::joint_values(&entry.table(found)?, &hand, false, found)?.into_iter();
        for finger in &mut hand.fingers {
            finger.rest = values.by_ref().take(finger.rest.len()).collect();
        }
    }
    Some((hand.placed_at(&pose?), reach))
}
