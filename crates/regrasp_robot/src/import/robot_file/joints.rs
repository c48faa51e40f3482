//! Joints of a robot file: which are held, which are common, and how fast they may speed up.

use super::super::names::known_joint;
use crate::coupling::Coupling;
use crate::manipulator::layout::Part;
use crate::manipulator::{Accelerations, Manipulator};
use crate::robot::{JointId, JointKind, Robot};
use regrasp_base::Diagnostic;
use regrasp_base::diagnostic::{did_you_mean, number};
use regrasp_base::toml_table::{Entry, Found, Table};
use std::collections::BTreeMap;

/// Largest acceleration that a robot file may state, in radians or metres per second squared.
const MAX_ACCELERATION: f64 = 1e6;
/// The key of `[accelerations]` that stands for all other joints.
const DEFAULT: &str = "default";

/// Fixes the joints of `[held]` at their positions, and followers that are left without leaders. Returns the names and positions of the
/// former.
///
/// Errors: unknown joints (`U205`), fixed ones and followers (`U220`), positions outside the limits (`U212`).
pub(super) fn hold(entry: &Entry, tree: &mut Robot, found: &mut Found) -> BTreeMap<String, f64> {
    let Some(table) = entry.table(found) else { return BTreeMap::new() };
    let mut held: Vec<(JointId, f64)> = Vec::new();
    for (name, entry) in table.all() {
        let Some(joint) = moving_joint(name, &entry, tree, found) else { continue };
        let Some(value) = entry.number(found) else { continue };
        if let Some(limits) = tree.joints[joint.0].limits.filter(|l| !(l.lower..=l.upper).contains(&value)) {
            let problem = format!("joint \"{name}\" is held at {}, outside its limits", number(value));
            let diagnostic = entry.error("U212", found, problem);
            found.diagnostics.push(diagnostic.expected(format!("{}..{}", number(limits.lower), number(limits.upper))));
            continue;
        }
        held.push((joint, value));
    }
    for joint in &mut tree.joints {
        let Some(coupling) = &mut joint.coupling else { continue };
        let position = |leader: JointId| held.iter().find(|(joint, _)| *joint == leader).map(|(_, value)| *value);
        coupling.offset +=
            coupling.terms.iter().filter_map(|&(leader, factor)| Some(factor * position(leader)?)).sum::<f64>();
        coupling.terms.retain(|(leader, _)| position(*leader).is_none());
        let Coupling { terms, offset } = &*coupling;
        if terms.is_empty() {
            let offset = *offset;
            fix(joint, offset);
        }
    }
    for &(joint, value) in &held {
        fix(&mut tree.joints[joint.0], value);
    }
    held.into_iter().map(|(joint, value)| (tree.joints[joint.0].name.clone(), value)).collect()
}

fn fix(joint: &mut crate::robot::Joint, position: f64) {
    joint.parent_from_joint *= joint.motion(position);
    (joint.kind, joint.limits, joint.coupling) = (JointKind::Fixed, None, None);
}

/// The independent joint called `name`, a key of a table.
fn moving_joint(name: &str, entry: &Entry, tree: &Robot, found: &mut Found) -> Option<JointId> {
    let Some(id) = tree.joint_named(name) else {
        let independent = tree.joints.iter().filter(|joint| joint.moves() && joint.coupling.is_none());
        let meant = did_you_mean(name, independent.map(|joint| joint.name.as_str()));
        let diagnostic = entry.error("U205", found, format!("the robot has no joint \"{name}\""));
        let fix = meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"));
        found.diagnostics.push(diagnostic.expected("the name of a joint").fix(fix));
        return None;
    };
    let joint = &tree.joints[id.0];
    if !joint.moves() || joint.coupling.is_some() {
        let how = if joint.moves() { "follows another joint" } else { "is fixed" };
        let diagnostic = entry.error("U220", found, format!("joint \"{name}\" {how}"));
        found.diagnostics.push(diagnostic.expected("an independent joint that moves"));
        return None;
    }
    Some(id)
}

/// `[accelerations]`: `default` and single joints.
///
/// Errors: as [`hold`], and numbers that are no acceleration (`U213`).
pub(super) fn read_accelerations(entry: &Entry, tree: &Robot, found: &mut Found) -> Accelerations {
    let mut accelerations = Accelerations::default();
    let Some(table) = entry.table(found) else { return accelerations };
    for (name, entry) in table.all() {
        let expected = format!("a number above 0 and at most {}", number(MAX_ACCELERATION));
        let value = entry.number_that(found, &expected, |x| x > 0.0 && x <= MAX_ACCELERATION);
        if name == DEFAULT {
            accelerations.default = value;
        } else if let (Some(_), Some(value)) = (moving_joint(name, &entry, tree, found), value) {
            accelerations.own.insert(name.to_owned(), value);
        }
    }
    accelerations
}

/// `[common] joints`, where the file has it: every joint of the common part has to be in it.
///
/// Errors: joints of the list that are on an arm or a hand (`U227`), joints on none that are not in the list (`U228`).
pub(super) fn refuse_unlisted(mut table: Table, manipulator: &Manipulator, found: &mut Found) {
    let joints = table.required(found, "joints", "add joints = [...], the joints that carry the arms");
    table.finish(found);
    let Some(entry) = joints else { return };
    let items = entry.entries(found, "names of joints").unwrap_or_default();
    let layout = &manipulator.layout;
    let mut listed = Vec::new();
    for item in &items {
        let Some(joint) = known_joint(item, &manipulator.robot, found) else { continue };
        let name = &manipulator.robot.joints[joint.0].name;
        let part = layout.index_of(name).map(|k| layout.coordinates[k].part);
        let problem = match part {
            Some(Part::Common) => {
                listed.push(joint);
                continue;
            }
            Some(Part::Arm(arm)) => format!("joint \"{name}\" is on arm \"{}\"", manipulator.arms[arm].name),
            Some(Part::Hand(hand)) => format!("joint \"{name}\" is on hand \"{}\"", manipulator.hands[hand].name),
            None => format!("joint \"{name}\" does not move on its own"),
        };
        let diagnostic = item.error("U227", found, problem).expected("independent joints on no arm and no hand");
        found.diagnostics.push(diagnostic);
    }
    let common = layout.coordinates.iter().filter(|coordinate| coordinate.part == Part::Common);
    let missing: Vec<&str> =
        common.filter(|coordinate| !listed.contains(&coordinate.joint)).map(|c| c.name.as_str()).collect();
    if !missing.is_empty() {
        let problem = format!("joints on no arm and no hand are not in the list: {}", missing.join(", "));
        let diagnostic: Diagnostic = entry.error("U228", found, problem).expected("every joint of the common part");
        found.diagnostics.push(diagnostic.fix("add them to the list, or give their positions in [held]"));
    }
}
