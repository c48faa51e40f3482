//! Arms: chains between two links.

use super::super::chain::{ChainOwner, make_chain, rest_posture};
use super::super::names::known_link;
use super::super::spec::{Carried, Positions, RigidBody};
use super::read_positions;
use crate::manipulator::Arm;
use crate::robot::{JointId, LinkId, Robot};
use regrasp_base::Place;
use regrasp_base::toml_table::{Entry, Found, Table};
use regrasp_geometry::Pose;
use std::collections::BTreeMap;

/// An arm to be made.
pub(super) struct ArmSpec {
    pub name: String,
    pub base: LinkId,
    pub mount: LinkId,
    joints: Vec<JointId>,
    home: Positions,
    place: Place,
}

/// Reads `[[arms]]`. None where one of them is bad.
///
/// Errors: names used twice (`U211`), links that no chain joins (`U206`), no moving joint (`U207`), shared joints (`U208`).
pub(super) fn read(entry: &Entry, tree: &Robot, found: &mut Found) -> Option<Vec<ArmSpec>> {
    let items = entry.entries(found, "[[arms]] tables")?;
    let mut arms: Vec<ArmSpec> = Vec::new();
    let mut is_complete = true;
    for item in items {
        match item.table(found).and_then(|table| read_arm(table, tree, &arms, found)) {
            Some(arm) => arms.push(arm),
            None => is_complete = false,
        }
    }
    is_complete.then_some(arms)
}

fn read_arm(mut table: Table, tree: &Robot, others: &[ArmSpec], found: &mut Found) -> Option<ArmSpec> {
    let name_entry = table.required(found, "name", "add name = \"right\"");
    let base_entry = table.required(found, "base_link", "add base_link = \"...\", the link that the arm stands on");
    let mount_entry = table.required(found, "mount_link", "add mount_link = \"...\", the link that carries the hand");
    let home = table.optional("home").map_or_else(Positions::new, |entry| read_positions(&entry, found));
    let place = found.place(&table.span);
    table.finish(found);
    let name = name_entry.as_ref().and_then(|entry| entry.name(found)).map(str::to_owned);
    let base = base_entry.as_ref().and_then(|entry| known_link(entry, tree, found));
    let mount = mount_entry.as_ref().and_then(|entry| known_link(entry, tree, found));
    let (name, base, mount) = (name?, base?, mount?);
    let mut refuse = |entry: &Option<Entry>, code, problem: String, expected: &str| {
        if let Some(entry) = entry {
            let diagnostic = entry.error(code, found, problem).expected(expected);
            found.diagnostics.push(diagnostic);
        }
    };
    if others.iter().any(|other| other.name == name) {
        refuse(&name_entry, "U211", format!("is \"{name}\", the name of another arm"), "a name of its own");
        return None;
    }
    let (above, path) = (tree.joints_to(base), tree.joints_to(mount));
    let [base_name, mount_name] = [base, mount].map(|link| tree.links[link.0].name.as_str());
    if !path.starts_with(&above) {
        let problem = format!("link \"{mount_name}\" is not carried by base link \"{base_name}\"");
        refuse(&mount_entry, "U206", problem, "a link below the base link");
        return None;
    }
    let joints: Vec<JointId> = path[above.len()..].iter().copied().filter(|j| tree.joints[j.0].moves()).collect();
    if joints.is_empty() {
        let problem = format!("no joint moves between \"{base_name}\" and \"{mount_name}\"");
        refuse(&mount_entry, "U207", problem, "at least one moving joint");
        return None;
    }
    let shared = |other: &&ArmSpec| other.joints.iter().any(|joint| joints.contains(joint));
    if let Some(other) = others.iter().find(shared) {
        let problem = format!("arm \"{name}\" shares joints with arm \"{}\"", other.name);
        refuse(&base_entry, "U208", problem, "a base link below the joints that arms share: those are common");
        return None;
    }
    Some(ArmSpec { name, base, mount, joints, home, place })
}

/// The arm, without shapes. None where its joints or its posture are refused.
pub(super) fn make(tree: &Robot, spec: &ArmSpec, found: &mut Found) -> Option<Arm> {
    let mut carried =
        BTreeMap::from([(spec.base, Carried { body: RigidBody::Palm, body_from_link: Pose::identity() })]);
    let (mut body_from_link, mut body) = (Pose::identity(), RigidBody::Palm);
    for id in &tree.joints_to(spec.mount)[tree.joints_to(spec.base).len()..] {
        let joint = &tree.joints[id.0];
        match spec.joints.iter().position(|own| own == id) {
            Some(index) => (body_from_link, body) = (Pose::identity(), RigidBody::Finger { finger: 0, body: index }),
            None => body_from_link *= joint.parent_from_joint,
        }
        carried.insert(joint.child, Carried { body, body_from_link });
    }
    let owner = ChainOwner { kind: "arm", name: &spec.name, place: &spec.place, rest_key: "home" };
    let chain = make_chain(tree, &owner, &spec.joints, &carried, &mut found.diagnostics)?;
    let near_zero = chain.lower.iter().zip(&chain.upper).map(|(&lower, &upper)| 0f64.clamp(lower, upper)).collect();
    let home = rest_posture(&owner, &spec.home, &chain, near_zero, &mut found.diagnostics);
    Some(Arm {
        name: spec.name.clone(),
        base: spec.base,
        chain,
        mount: spec.mount,
        last_from_mount: body_from_link,
        shapes: Vec::new(),
        home,
    })
}
