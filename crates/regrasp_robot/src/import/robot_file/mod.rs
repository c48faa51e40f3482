//! `robot.toml`: models, arms and hands that make one manipulator.
//!
//! A hand file or a URDF is accepted too: a hand is a manipulator without arms.

/// Arms.
mod arms;
/// Hands and what carries them.
mod hands;
/// Held and common joints, accelerations.
mod joints;
/// Several robots as one tree.
mod merge;
/// Models: URDFs with their places.
mod models;
/// Balls instead of collision geometry.
mod spheres;
/// Links that a model does without.
mod without;

use super::couplings;
use super::hand_file::{CODES, LoadedHand, load_hand, read_pairs};
use super::options::{LoadOptions, LoadedInput};
use super::spec::Positions;
use crate::manipulator::layout::Part;
use crate::manipulator::{Accelerations, CommonPart, LinkShape, Manipulator, NoPosture, Owners, Parts};
use crate::robot::{LinkId, Robot};
use regrasp_base::diagnostic::number;
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_base::{Diagnostic, InputError, Place, files};
use regrasp_geometry::Pose;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// The value of `format` in a robot file.
pub const FORMAT: &str = "regrasp-robot";
/// The value of `format_version` in a robot file.
pub const VERSION: f64 = 1.0;

/// A manipulator with what it was read from.
#[derive(Debug, Clone)]
pub struct LoadedManipulator {
    /// The manipulator, with its root at the world's origin; of a hand alone the base.
    pub manipulator: Manipulator,
    /// Every file that was read, outermost first.
    pub inputs: Vec<LoadedInput>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// Reads a manipulator from a robot file, a hand file, or the URDF of a hand.
///
/// Errors: `F00x`, `U1xx`, `U2xx`, `V001`, `M2xx`.
pub fn load_manipulator(path: &Path, options: &LoadOptions) -> Result<LoadedManipulator, InputError> {
    let is_toml = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    if !is_toml {
        return of_hand(load_hand(path, options)?, path);
    }
    let bytes = options.read(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let own = LoadedInput { role: "robot".into(), name, path: path.to_owned(), sha256: files::sha256(&bytes) };
    let text = files::text_of(path, bytes)?;
    let mut found = Found::new(path, &text, CODES);
    let document = found.parse();
    if let Some(document) = &document
        && Table::root(document).optional("format").and_then(|entry| entry.as_text()) == Some(super::hand_file::FORMAT)
    {
        return of_hand(load_hand(path, options)?, path);
    }
    let read = document.as_ref().and_then(|document| read(Table::root(document), path, options, &mut found));
    let (notes, diagnostics) = (found.notes, found.diagnostics);
    let (manipulator, read) = diagnostics.into_result(read)?.expect("what could not be read has left a diagnostic");
    let mut inputs = vec![own];
    for input in read {
        // A URDF that a model and a hand file name is one file.
        if !inputs.iter().any(|known| known.path == input.path && known.role == input.role) {
            inputs.push(input);
        }
    }
    Ok(LoadedManipulator { manipulator, inputs, notes })
}

fn of_hand(loaded: LoadedHand, path: &Path) -> Result<LoadedManipulator, InputError> {
    let LoadedHand { hand, inputs, notes } = loaded;
    let manipulator = Manipulator::of_hand(file_stem(path), hand, &Pose::identity())
        .map_err(|no_posture| InputError::from(refused_posture(&no_posture, Place::file(path))))?;
    Ok(LoadedManipulator { manipulator, inputs, notes })
}

fn file_stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn refused_posture(no_posture: &NoPosture, place: Place) -> Diagnostic {
    Diagnostic::new("U143", place, "the limits of joints that follow others leave no posture")
        .element("joint", &no_posture.joint)
        .expected("limits that overlap")
}

/// What is read so far: the tree, and what it was read from.
struct Draft<'a> {
    path: &'a Path,
    options: &'a LoadOptions,
    tree: Robot,
    models: Vec<models::PlacedUrdf>,
    inputs: Vec<LoadedInput>,
    allow: BTreeSet<(LinkId, LinkId)>,
}

/// Reads the whole file; none if anything is missing, with the reason in `found`.
fn read(
    mut root: Table,
    path: &Path,
    options: &LoadOptions,
    found: &mut Found,
) -> Option<(Manipulator, Vec<LoadedInput>)> {
    if !root.is_of_format(found, FORMAT, VERSION) {
        return None;
    }
    let name = root.optional("name").map(|entry| entry.name(found).map(str::to_owned));
    let [models, couplings, arms, hands, rest, allow] =
        ["models", "couplings", "arms", "hands", "rest", "allow"].map(|key| root.optional(key));
    let [common, held, accelerations] = ["common", "held", "accelerations"].map(|key| root.optional(key));
    if models.is_none() && hands.is_none() {
        let diagnostic = root.error("U202", found, "has neither `models` nor `hands`");
        found.diagnostics.push(diagnostic.fix("add at least one [[models]] or [[hands]] table"));
    }
    root.finish(found);
    let name = name.unwrap_or_else(|| Some(file_stem(path)))?;
    let mut draft = models::read(models.as_ref(), &name, (path, options), found)?;
    if let Some(entry) = &couplings {
        couplings::read(entry, &mut draft.tree, found);
    }
    let held = held.map_or_else(BTreeMap::new, |entry| joints::hold(&entry, &mut draft.tree, found));
    // Hands with URDFs of their own join the tree, before arms and hands are made of it.
    let arm_specs = arms.map_or_else(|| Some(Vec::new()), |entry| arms::read(&entry, &draft.tree, found));
    let arm_specs = arm_specs?;
    let mounts = hands.map_or_else(|| Some(Vec::new()), |entry| hands::read(&entry, &mut draft, &arm_specs, found));
    let mounts = mounts?;
    refuse_repeated_names(&draft.tree, path, found);
    let ties: Vec<_> = mounts.iter().map(|mount| mount.untie(&mut draft.tree, found)).collect();
    let tree = Arc::new(draft.tree);
    if let Some(entry) = &allow {
        draft.allow.extend(read_pairs(entry, &tree, found));
    }
    let arms: Vec<_> = arm_specs.iter().filter_map(|spec| arms::make(&tree, spec, found)).collect();
    let hands: Vec<_> =
        mounts.iter().zip(ties).filter_map(|(mount, ties)| hands::make(&tree, mount, ties, found)).collect();
    let rest = rest.map_or_else(Positions::new, |entry| read_positions(&entry, found));
    let accelerations =
        accelerations.map_or_else(Accelerations::default, |entry| joints::read_accelerations(&entry, &tree, found));
    if !found.diagnostics.is_empty() {
        return None;
    }
    let owners = Owners::of(&tree, &arms, &hands);
    refuse_couplings_across(&tree, &owners, path, found);
    let mut parts = Parts {
        arms,
        hands,
        common: CommonPart::default(),
        allow: draft.allow,
        held,
        rest: rest.iter().map(|(name, value, _)| (name.clone(), *value)).collect(),
        accelerations,
    };
    add_shapes(&tree, &owners, &mut parts, path, found);
    let made = Manipulator::new(name, tree, parts);
    let manipulator = made.map_err(|no| found.diagnostics.push(refused_posture(&no, Place::file(path)))).ok()?;
    refuse_bad_rest(&manipulator, &rest, found);
    if let Some(table) = common.and_then(|entry| entry.table(found)) {
        joints::refuse_unlisted(table, &manipulator, found);
    }
    found.diagnostics.is_empty().then_some((manipulator, draft.inputs))
}

/// A table of positions by name of joint, with their places.
fn read_positions(entry: &Entry, found: &mut Found) -> Positions {
    let Some(table) = entry.table(found) else { return Vec::new() };
    let mut positions = Vec::new();
    for (joint, entry) in table.all() {
        let value = entry.number(found);
        positions.extend(value.map(|value| (joint.to_owned(), value, found.place(&entry.span))));
    }
    positions
}

/// Errors: two links or two joints of one name (`U223`).
fn refuse_repeated_names(tree: &Robot, path: &Path, found: &mut Found) {
    let links: Vec<&str> = tree.links.iter().map(|link| link.name.as_str()).collect();
    let joints: Vec<&str> = tree.joints.iter().map(|joint| joint.name.as_str()).collect();
    for (kind, mut names) in [("link", links), ("joint", joints)] {
        names.sort_unstable();
        for pair in names.windows(2).filter(|pair| pair[0] == pair[1]) {
            let diagnostic = Diagnostic::new("U223", Place::file(path), "two models or hands bring this name");
            let fix = "give the models other names; links and joints are called NAME/...";
            found.diagnostics.push(diagnostic.element(kind, pair[0]).expected("names that differ").fix(fix));
        }
    }
}

/// Errors: a joint of a hand that follows one outside of it, or the other way round (`U209`): a hand plans while the rest of the robot is
/// at rest.
fn refuse_couplings_across(tree: &Robot, owners: &Owners, path: &Path, found: &mut Found) {
    let hand_of = |joint: usize| match owners.of_joints[joint] {
        part @ Part::Hand(_) => Some(part),
        Part::Common | Part::Arm(_) => None,
    };
    for (index, joint) in tree.joints.iter().enumerate() {
        let Some(coupling) = &joint.coupling else { continue };
        let Some((leader, _)) = coupling.terms.iter().find(|(leader, _)| hand_of(leader.0) != hand_of(index)) else {
            continue;
        };
        let name = &tree.joints[leader.0].name;
        let problem = match hand_of(index) {
            Some(_) => format!("is on a hand and follows joint \"{name}\", which is not on that hand"),
            None => format!("follows joint \"{name}\", which is on a hand, but is on none"),
        };
        let diagnostic = Diagnostic::new("U209", Place::file(path), problem).element("joint", &joint.name);
        found.diagnostics.push(diagnostic.expected("leaders on the same hand, or both on no hand"));
    }
}

/// Collision shapes of arms and of the common part.
fn add_shapes(tree: &Robot, owners: &Owners, parts: &mut Parts, path: &Path, found: &mut Found) {
    let mut hulls = super::hulls::Hulls::new(tree, path);
    for link in (0..tree.links.len()).map(LinkId) {
        let shapes = match owners.of_links[link.0] {
            Part::Common => &mut parts.common.shapes,
            Part::Arm(arm) => &mut parts.arms[arm].shapes,
            Part::Hand(_) => continue,
        };
        let placed = hulls.of_link(link, &Pose::identity(), &mut found.diagnostics);
        shapes.extend(placed.into_iter().map(|placed| LinkShape { link, placed }));
    }
}

/// Errors: rest positions of joints that are not common (`U205`) or outside the limits (`U212`).
fn refuse_bad_rest(manipulator: &Manipulator, rest: &Positions, found: &mut Found) {
    let layout = &manipulator.layout;
    for (name, value, place) in rest {
        let known = layout.index_of(name).map(|k| &layout.coordinates[k]).filter(|c| c.part == Part::Common);
        let Some(coordinate) = known else {
            let problem = format!("the common part has no independent joint \"{name}\"");
            let common: Vec<&str> =
                layout.coordinates[layout.range(Part::Common)].iter().map(|c| c.name.as_str()).collect();
            let diagnostic = Diagnostic::new("U205", place.clone(), problem).element("key", "rest");
            found.diagnostics.push(diagnostic.expected(format!("one of {}", common.join(", "))));
            continue;
        };
        if *value < coordinate.lower || *value > coordinate.upper {
            let problem = format!("rest position {} is outside the limits", number(*value));
            let diagnostic = Diagnostic::new("U212", place.clone(), problem).element("joint", name);
            let expected = format!("{}..{}", number(coordinate.lower), number(coordinate.upper));
            found.diagnostics.push(diagnostic.expected(expected));
        } else if coordinate.rest != *value {
            // The posture was moved so that a follower of several joints keeps its limits.
            let problem = "the rest posture takes a joint that follows several others outside its limits";
            let diagnostic = Diagnostic::new("U212", place.clone(), problem).element("joint", name);
            found.diagnostics.push(diagnostic.expected("positions within the limits of their followers"));
        }
    }
}
