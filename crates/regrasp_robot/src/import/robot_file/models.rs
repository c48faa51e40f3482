//! Models: URDFs with their places.

use super::super::hand_file::{locate_and_load, read_srdf, unit_quaternion};
use super::super::options::{LoadOptions, LoadedInput};
use super::Draft;
use super::merge::{self, Place};
use super::{spheres, without};
use crate::robot::{LinkId, Robot};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_base::Diagnostic;
use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::Pose;
use std::collections::BTreeSet;
use std::path::Path;

/// A URDF that is part of the tree.
pub(super) struct PlacedUrdf {
    /// Its name, in front of the names of its links and joints where there are several models; may be empty where there is one.
    pub name: String,
    /// Where its links and joints are.
    pub place: Place,
    /// SHA-256 of the URDF.
    pub sha256: String,
}

/// A model before it joins the tree.
struct ModelSpec {
    name: Option<String>,
    robot: Robot,
    /// The link that carries it, and where the file names it; the root without one.
    parent: Option<(String, regrasp_base::Place)>,
    parent_from_model: Option<Pose>,
    inputs: Vec<LoadedInput>,
    disabled: BTreeSet<(crate::robot::LinkId, crate::robot::LinkId)>,
}

/// Reads `[[models]]`: one model as it is, several ones on a common root. Without models hands stand on that root.
///
/// Errors: models without names of their own (`U211`).
pub(super) fn read<'a>(
    entry: Option<&Entry>,
    name: &str,
    (path, options): (&'a Path, &'a LoadOptions),
    found: &mut Found,
) -> Option<Draft<'a>> {
    let items = match entry {
        Some(entry) => entry.entries(found, "at least one [[models]] table")?,
        None => Vec::new(),
    };
    if let Some(entry) = entry.filter(|_| items.is_empty()) {
        let diagnostic = entry.error("U202", found, "is empty").expected("at least one [[models]] table");
        found.diagnostics.push(diagnostic);
    }
    let specs: Vec<Option<ModelSpec>> =
        items.iter().map(|item| read_model(item.table(found)?, path, options, found)).collect();
    let specs: Vec<ModelSpec> = specs.into_iter().collect::<Option<_>>()?;
    for (index, spec) in specs.iter().enumerate() {
        let is_repeated = specs[..index].iter().any(|other| other.name == spec.name);
        if specs.len() > 1 && (spec.name.is_none() || is_repeated) {
            let problem = if is_repeated { "has the name of another model" } else { "has no name" };
            let diagnostic = items[index].error("U211", found, problem);
            found.diagnostics.push(diagnostic.expected("a name of its own, because there are several models"));
            return None;
        }
    }
    let (is_alone, has_own_root) =
        (specs.len() == 1, matches!(specs.as_slice(), [spec] if spec.parent_from_model.is_none()));
    let mut draft = Draft {
        path,
        options,
        tree: merge::empty(name),
        models: Vec::new(),
        inputs: Vec::new(),
        allow: BTreeSet::new(),
    };
    for spec in specs {
        let place = match has_own_root {
            true => {
                draft.tree = spec.robot;
                Place::whole()
            }
            false => {
                let prefix =
                    spec.name.as_ref().filter(|_| !is_alone).map_or_else(String::new, |name| format!("{name}/"));
                let parent = parent_of(&spec, &draft.tree, found)?;
                let parent_from_model = spec.parent_from_model.unwrap_or_default();
                merge::mount(&mut draft.tree, &spec.robot, &prefix, parent, &parent_from_model)
            }
        };
        draft.allow.extend(spec.disabled.iter().map(|&(a, b)| (place.link(a), place.link(b))));
        let sha256 = spec.inputs.first().map_or_else(String::new, |input| input.sha256.clone());
        draft.models.push(PlacedUrdf { name: spec.name.unwrap_or_default(), place, sha256 });
        draft.inputs.extend(spec.inputs);
    }
    Some(draft)
}

/// The link that carries a model: of a model before it, or the root. Errors: no such link (`U205`).
fn parent_of(spec: &ModelSpec, tree: &Robot, found: &mut Found) -> Option<LinkId> {
    let Some((name, place)) = &spec.parent else { return Some(tree.root) };
    let link = tree.link_named(name);
    if link.is_none() {
        let meant = did_you_mean(name, tree.links.iter().map(|link| link.name.as_str()));
        let problem = format!("the models before this one have no link \"{name}\"");
        let diagnostic = Diagnostic::new("U205", place.clone(), problem).element("key", "parent");
        let fix = meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"));
        found.diagnostics.push(diagnostic.expected("MODEL/LINK of a model above").fix(fix));
    }
    link
}

fn read_model(mut table: Table, path: &Path, options: &LoadOptions, found: &mut Found) -> Option<ModelSpec> {
    let name = table.optional("name").map(|entry| entry.name(found).map(str::to_owned));
    let urdf = table.required(found, "urdf", "add urdf = \"robot.urdf\"");
    let [srdf, spheres, parent, without] = ["srdf", "spheres", "parent", "without"].map(|key| table.optional(key));
    let parent = match parent {
        Some(entry) => Some((entry.text(found)?.to_owned(), found.place(&entry.span))),
        None => None,
    };
    let pose = read_pose(&mut table, found);
    table.finish(found);
    let (mut robot, mut inputs) = locate_and_load(&urdf?, path, options, &BTreeSet::new(), found)?;
    if let Some(entry) = &spheres {
        inputs.extend(spheres::replace(entry, &mut robot, path, options, found));
    }
    let mut disabled = BTreeSet::new();
    if let Some(entry) = srdf
        && let Some(loaded) = read_srdf(&entry, path, &robot, options, found)
    {
        disabled.extend(loaded.srdf.disabled_pairs.iter().map(|pair| pair.links));
        inputs.push(loaded.input);
    }
    if let Some(entry) = &without {
        without::take_away(entry, &mut robot, found)?;
    }
    let name = match name {
        Some(name) => Some(name?),
        None => None,
    };
    Some(ModelSpec { name, robot, parent, parent_from_model: pose?, inputs, disabled })
}

/// `position` and `quat_xyzw`; Some(None) where neither is there, none where one is bad.
pub(super) fn read_pose(table: &mut Table, found: &mut Found) -> Option<Option<Pose>> {
    let position = table.optional("position").map(|entry| entry.numbers::<3>(found));
    let turn = table.optional("quat_xyzw").map(|entry| unit_quaternion(&entry, found));
    if position.is_none() && turn.is_none() {
        return Some(None);
    }
    let [x, y, z] = position.unwrap_or(Some([0.0; 3]))?;
    let turn = turn.unwrap_or(Some(UnitQuaternion::identity()))?;
    Some(Some(Pose::from_parts(Translation3::new(x, y, z), turn)))
}
