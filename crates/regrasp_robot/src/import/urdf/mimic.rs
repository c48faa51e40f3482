//! Joints of a URDF that follow others.

use super::joint::DraftJoint;
use crate::coupling::{self, Coupling};
use crate::import::xml::{Reader, child};
use crate::robot::{Joint, JointId, JointKind};
use regrasp_base::Diagnostic;
use regrasp_base::diagnostic::{did_you_mean, number};
use std::collections::BTreeMap;

/// Multipliers above this and below its inverse, and offsets above it, are no gears of a hand.
const MAX_COUPLING: f64 = 1e6;

/// What [`check_coupling`] asks.
pub(crate) const GOOD_COUPLING: &str =
    "a multiplier of size 1e-6 to 1e6 that is not 0, and an offset of size up to 1e6";

/// What is wrong with the numbers of a coupling.
pub(crate) fn check_coupling(multiplier: f64, offset: f64) -> Result<(), String> {
    if !(1.0 / MAX_COUPLING..=MAX_COUPLING).contains(&multiplier.abs()) {
        return Err(format!("multiplier {}", number(multiplier)));
    }
    if offset.abs() > MAX_COUPLING { Err(format!("offset {}", number(offset))) } else { Ok(()) }
}

/// The joints with their couplings; a joint that follows a follower follows the leader of the chain.
///
/// Reports: unknown leader (`U140`), cycle (`U141`), multiplier 0 or far from 1 (`U142`), limits that leave no position (`U143`),
/// a leader that cannot move (`U144`).
pub(super) fn resolve(reader: &mut Reader, mut joints: Vec<Joint>, drafts: &[DraftJoint]) -> Vec<Joint> {
    let index: BTreeMap<String, JointId> =
        joints.iter().enumerate().map(|(i, joint)| (joint.name.clone(), JointId(i))).collect();
    let mut direct: Vec<Option<Coupling>> = vec![None; joints.len()];
    for draft in drafts {
        if let Some(&id) = index.get(draft.name) {
            direct[id.0] = read_mimic(reader, draft, &joints, &index);
        }
    }
    let resolved = coupling::resolve(&direct);
    for draft in drafts {
        let Some(&id) = index.get(draft.name) else { continue };
        if joints[id.0].kind == JointKind::Fixed {
            continue;
        }
        joints[id.0].coupling = resolved[id.0].clone().unwrap_or_else(|_| {
            let names = way_back(&joints, &direct, id).join(" -> ");
            let place = reader.place(draft.node);
            reader.found.push(
                Diagnostic::new("U141", place, format!("joints follow each other in a cycle: {names}"))
                    .element("joint", draft.name)
                    .expected("a joint at the end that follows no other"),
            );
            None
        });
    }
    refuse_empty_ranges(reader, &joints, drafts);
    joints
}

fn read_mimic(
    reader: &mut Reader,
    draft: &DraftJoint,
    joints: &[Joint],
    index: &BTreeMap<String, JointId>,
) -> Option<Coupling> {
    let node = child(draft.node, "mimic")?;
    let element = ("joint", draft.name);
    if draft.kind == JointKind::Fixed {
        reader.note(node, element, "is fixed; its <mimic> is not used");
        return None;
    }
    let [multiplier] = reader.numbers(node, "multiplier", Some([1.0]), element)?;
    let [offset] = reader.numbers(node, "offset", Some([0.0]), element)?;
    let leader = node.attribute("joint").unwrap_or_default();
    let place = reader.attribute_place(node, "joint");
    let Some(&joint) = index.get(leader) else {
        // A leader that exists but could not be read has its own message.
        let unreadable = draft.node.parent().is_some_and(|robot| {
            robot.children().any(|other| other.has_tag_name("joint") && other.attribute("name") == Some(leader))
        });
        if !unreadable {
            let meant = did_you_mean(leader, index.keys().map(String::as_str));
            reader.found.push(
                Diagnostic::new("U140", place, format!("follows joint \"{leader}\", which does not exist"))
                    .element("joint", draft.name)
                    .expected("the name of a joint")
                    .fix(meant.map_or(String::new(), |meant| format!("did you mean \"{meant}\"?"))),
            );
        }
        return None;
    };
    if let Err(problem) = check_coupling(multiplier, offset) {
        reader.found.push(
            Diagnostic::new("U142", place, format!("follows joint \"{leader}\" with {problem}"))
                .element("joint", draft.name)
                .expected(GOOD_COUPLING)
                .fix(if multiplier == 0.0 { "type=\"fixed\" if it does not move" } else { "" }),
        );
        return None;
    }
    if joints[joint.0].kind == JointKind::Fixed {
        reader.found.push(
            Diagnostic::new("U144", place, format!("follows joint \"{leader}\", which is fixed"))
                .element("joint", draft.name)
                .expected("a joint that moves"),
        );
        return None;
    }
    Some(Coupling::one(joint, multiplier, offset))
}

/// Names of the joints from `id` along its leaders, up to the first that comes again.
fn way_back(joints: &[Joint], direct: &[Option<Coupling>], id: JointId) -> Vec<String> {
    let (mut seen, mut at) = (vec![id], id);
    while let Some((leader, _)) = direct[at.0].as_ref().and_then(Coupling::single) {
        let again = seen.contains(&leader);
        seen.push(leader);
        if again {
            break;
        }
        at = leader;
    }
    seen.iter().map(|joint| format!("\"{}\"", joints[joint.0].name)).collect()
}

/// Reports followers whose own limits leave their leader no position.
fn refuse_empty_ranges(reader: &mut Reader, joints: &[Joint], drafts: &[DraftJoint]) {
    for draft in drafts {
        let Some(follower) = joints.iter().find(|joint| joint.name == draft.name) else { continue };
        if let Err(problem) = refuse_empty_range(joints, follower) {
            let place = reader.place(draft.node);
            reader.found.push(
                Diagnostic::new("U143", place, problem)
                    .element("joint", draft.name)
                    .expected("ranges that overlap")
                    .fix("correct multiplier or offset of its <mimic>, or its limits; without <mimic> it moves by itself"),
            );
        }
    }
}

/// Err, in words, when the leaders of `follower` never bring it within its own limits.
pub(crate) fn refuse_empty_range(joints: &[Joint], follower: &Joint) -> Result<(), String> {
    let (Some(coupling), Some(own)) = (&follower.coupling, follower.limits) else { return Ok(()) };
    let limits = |leader: JointId| {
        joints[leader.0].limits.map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| [limits.lower, limits.upper])
    };
    let [low, high] = coupling.range(limits);
    if high >= own.lower && low <= own.upper {
        return Ok(());
    }
    let names: Vec<String> =
        coupling.terms.iter().map(|(leader, _)| format!("\"{}\"", joints[leader.0].name)).collect();
    Err(format!(
        "follows {} {} to {}..{}, outside its own limits {}..{}",
        if names.len() == 1 { "joint" } else { "joints" },
        names.join(" and "),
        number(low),
        number(high),
        number(own.lower),
        number(own.upper)
    ))
}
