//! Hands and what carries them.

use super::super::assemble::assemble;
use super::super::hand_file::{HandParts, hand_file_parts, locate, refuse_wrong_unit};
use super::super::names::known_link;
use super::super::spec::{FingerSpec, HandSpec, leave_geometry_out};
use super::super::ties;
use super::Draft;
use super::arms::ArmSpec;
use super::merge::{self, Place};
use super::models::read_pose;
use crate::hand::{Hand, Tie};
use crate::manipulator::{MountedHand, top_of};
use crate::robot::{LinkId, Robot};
use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::Pose;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A hand to be made.
pub(super) struct Mount {
    name: String,
    arm: Option<usize>,
    top: LinkId,
    spec: HandSpec,
    file: PathBuf,
    /// Where the hand stands on its mount link, as the file says.
    place: Pose,
}

/// Where a hand's links come from.
enum Source {
    /// From a URDF of its own, which is mounted with this pose in the mount link.
    OwnModel(Pose),
    /// From a model of the robot file, by index.
    Model(usize),
}

/// Reads `[[hands]]`, and mounts those with URDFs of their own on the tree. None where one of them is bad.
///
/// Errors: names used twice (`U211`), unknown arms and models (`U224`), a hand file about another URDF than the model (`U225`), a
/// hand that its mount link does not carry (`U206`), couplings that differ (`U219`), two hands on one
/// arm, or at one place of a link (`U226`).
pub(super) fn read(entry: &Entry, draft: &mut Draft, arms: &[ArmSpec], found: &mut Found) -> Option<Vec<Mount>> {
    let items = entry.entries(found, "[[hands]] tables")?;
    let mut mounts: Vec<Mount> = Vec::new();
    let mut is_complete = true;
    for item in items {
        match item.table(found).and_then(|table| read_hand(table, draft, (arms, &mounts), found)) {
            Some(mount) => mounts.push(mount),
            None => is_complete = false,
        }
    }
    is_complete.then_some(mounts)
}

fn read_hand(
    mut table: Table,
    draft: &mut Draft,
    (arms, others): (&[ArmSpec], &[Mount]),
    found: &mut Found,
) -> Option<Mount> {
    let name_entry = table.required(found, "name", "add name = \"right\"");
    let file_entry = table.required(found, "hand", "add hand = \"hand.toml\"");
    let arm_entry = table.optional("arm");
    let mount_entry = table.optional("mount_link");
    let model_entry = table.optional("model");
    let pose = read_pose(&mut table, found);
    table.finish(found);
    let name = name_entry.as_ref().and_then(|entry| entry.name(found)).map(str::to_owned)?;
    if others.iter().any(|other| other.name == name) {
        refuse(&name_entry?, "U211", format!("is \"{name}\", the name of another hand"), "a name of its own", found);
        return None;
    }
    let arm = match &arm_entry {
        Some(entry) => Some(named(entry, "arm", arms.iter().map(|arm| arm.name.as_str()), found)?),
        None => None,
    };
    let model = match &model_entry {
        Some(entry) => Some(named(entry, "model", draft.models.iter().map(|model| model.name.as_str()), found)?),
        None => None,
    };
    let mount = match (&mount_entry, arm) {
        (Some(entry), None) => known_link(entry, &draft.tree, found)?,
        (None, Some(arm)) => arms[arm].mount,
        (None, None) => draft.tree.root,
        (Some(entry), Some(_)) => {
            refuse(
                entry,
                "U213",
                "stands beside `arm`".into(),
                "`arm`, whose mount link it is, or `mount_link`",
                found,
            );
            return None;
        }
    };
    let is_named = mount_entry.is_some() || arm.is_some();
    let pose = pose?;
    let stands = pose.unwrap_or_default();
    // A bar of the common part may carry several hands, side by side.
    let is_in_the_way =
        |other: &&Mount| is_named && other.spec.mount == Some(mount) && (arm.is_some() || other.place == stands);
    if let Some(other) = others.iter().find(is_in_the_way) {
        let link = &draft.tree.links[mount.0].name;
        let problem = format!("link \"{link}\" carries hand \"{}\" already", other.name);
        refuse(
            mount_entry.as_ref().or(arm_entry.as_ref())?,
            "U226",
            problem,
            "one hand on an arm, or another place on the link",
            found,
        );
        return None;
    }
    let source = match (model, pose) {
        (Some(model), None) => Source::Model(model),
        (None, pose) => Source::OwnModel(pose.unwrap_or_default()),
        (Some(_), Some(_)) => {
            let expected = "no `position` and `quat_xyzw`: the model says where the hand is";
            refuse(&model_entry?, "U213", "stands beside a pose".into(), expected, found);
            return None;
        }
    };
    let file_entry = file_entry?;
    let file = locate(&file_entry, draft.path, draft.options, found)?;
    let parts = match hand_file_parts(&file, draft.options) {
        Ok(parts) => parts,
        Err(error) => {
            found.diagnostics.extend(error);
            return None;
        }
    };
    found.notes.extend(parts.notes.iter().cloned());
    draft.inputs.extend(parts.inputs.iter().cloned());
    let place = match source {
        Source::OwnModel(mount_from_root) => {
            merge::mount(&mut draft.tree, &parts.robot, &format!("{name}/"), mount, &mount_from_root)
        }
        Source::Model(model) => {
            let place = draft.models[model].place.clone();
            refuse_other_urdf(&file_entry, &parts, &draft.models[model].sha256, found)?;
            take_couplings(&file_entry, &mut draft.tree, &parts, &place, found)?;
            refuse_base_elsewhere(&file_entry, &draft.tree, mount, place.link(parts.spec.base), found)?;
            take_visuals(&mut draft.tree, &parts.robot, &place);
            place
        }
    };
    let spec = in_tree(&parts.spec, &place, mount);
    leave_geometry_out(&mut draft.tree, spec.without_geometry.iter().copied());
    let top = top_of(&draft.tree, spec.base, Some(mount));
    Some(Mount { name, arm, top, spec, file, place: stands })
}

/// The index of the one of `names` that `entry` gives. Errors: none of them (`U224`).
fn named<'n>(
    entry: &Entry,
    kind: &str,
    names: impl Iterator<Item = &'n str> + Clone,
    found: &mut Found,
) -> Option<usize> {
    let name = entry.text(found)?;
    let index = names.clone().position(|known| known == name);
    if index.is_none() {
        let meant = did_you_mean(name, names.clone());
        let diagnostic = entry
            .error("U224", found, format!("there is no {kind} \"{name}\""))
            .expected(format!("one of {}", names.collect::<Vec<_>>().join(", ")))
            .fix(meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?")));
        found.diagnostics.push(diagnostic);
    }
    index
}

fn refuse(entry: &Entry, code: &'static str, problem: String, expected: &str, found: &mut Found) {
    let diagnostic = entry.error(code, found, problem).expected(expected);
    found.diagnostics.push(diagnostic);
}

fn refuse_other_urdf(entry: &Entry, parts: &HandParts, sha256: &str, found: &mut Found) -> Option<()> {
    let urdf = parts.inputs.iter().find(|input| input.role == "urdf")?;
    if urdf.sha256 == sha256 {
        return Some(());
    }
    let problem = format!("is about {}, which is not the URDF of the model", urdf.path.display());
    refuse(entry, "U225", problem, "a hand file about the URDF of the model, or no `model`", found);
    None
}

/// Gives the tree the couplings of the hand file.
fn take_couplings(entry: &Entry, tree: &mut Robot, parts: &HandParts, place: &Place, found: &mut Found) -> Option<()> {
    for (index, joint) in parts.robot.joints.iter().enumerate() {
        let Some(coupling) = joint.coupling.as_ref().map(|coupling| place.coupling(coupling)) else { continue };
        let of_tree = &mut tree.joints[place.joint(crate::robot::JointId(index)).0];
        if of_tree.coupling.as_ref().is_some_and(|known| *known != coupling) {
            let problem =
                format!("couples joint \"{}\" in another way than the robot file or another hand", joint.name);
            refuse(entry, "U219", problem, "one coupling per joint", found);
            return None;
        }
        of_tree.coupling = Some(coupling);
    }
    Some(())
}

/// Gives links of the tree that have no collision geometry what stands for it in the hand file's robot.
fn take_visuals(tree: &mut Robot, robot: &Robot, place: &Place) {
    for (index, link) in robot.links.iter().enumerate().filter(|(_, link)| link.collision_from_visuals) {
        let of_tree = &mut tree.links[place.link(LinkId(index)).0];
        if of_tree.collision.is_empty() {
            of_tree.collision.clone_from(&link.collision);
            of_tree.collision_from_visuals = true;
        }
    }
}

fn refuse_base_elsewhere(entry: &Entry, tree: &Robot, mount: LinkId, base: LinkId, found: &mut Found) -> Option<()> {
    let (above, path) = (tree.joints_to(mount), tree.joints_to(base));
    if path.len() > above.len() && path.starts_with(&above) {
        return Some(());
    }
    let [base, mount] = [base, mount].map(|link| tree.links[link.0].name.as_str());
    let problem = format!("its base link \"{base}\" is not carried by mount link \"{mount}\"");
    refuse(entry, "U206", problem, "a base link below the mount link", found);
    None
}

/// `spec` by the ids and names of the tree.
fn in_tree(spec: &HandSpec, place: &Place, mount: LinkId) -> HandSpec {
    let finger = |finger: &FingerSpec| FingerSpec {
        tip_link: place.link(finger.tip_link),
        first_joint: finger.first_joint.map(|joint| place.joint(joint)),
        rest: finger.rest.iter().map(|(name, value, at)| (place.name(name), *value, at.clone())).collect(),
        ..finger.clone()
    };
    HandSpec {
        base: place.link(spec.base),
        fingers: spec.fingers.iter().map(finger).collect(),
        mount: Some(mount),
        allow: spec.allow.iter().map(|&(a, b)| (place.link(a), place.link(b))).collect(),
        // On a robot they are coordinates like others.
        held: BTreeMap::new(),
        without_geometry: spec.without_geometry.iter().map(|&link| place.link(link)).collect(),
    }
}

impl Mount {
    /// Makes joints of one finger that follow another finger coordinates of their own, and says what they follow.
    pub(super) fn untie(&self, tree: &mut Robot, found: &mut Found) -> Vec<Tie> {
        ties::untie_on(tree, &self.spec, &mut found.notes)
    }
}

/// The hand. None where its fingers are refused.
pub(super) fn make(tree: &Arc<Robot>, mount: &Mount, ties: Vec<Tie>, found: &mut Found) -> Option<MountedHand> {
    let made = assemble(tree, &mount.spec, &mount.file).and_then(|(hand, notes)| {
        let mut hand = Hand { ties, ..hand };
        ties::settle_rest(&mut hand);
        refuse_wrong_unit(&hand, &mount.file)?;
        Ok((hand, notes))
    });
    match made {
        Ok((hand, notes)) => {
            found.notes.extend(notes);
            let file = Some(mount.file.clone());
            Some(MountedHand { name: mount.name.clone(), hand, arm: mount.arm, top: mount.top, file })
        }
        Err(error) => {
            found.diagnostics.extend(error);
            None
        }
    }
}
