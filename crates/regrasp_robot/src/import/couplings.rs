//! Couplings that a hand file adds to those of the URDF: `position = multiplier * position(leader) + offset`.

use super::hand_file::known_joint;
use super::urdf::{GOOD_COUPLING, check_coupling};
use crate::robot::{JointId, JointKind, Mimic, Robot};
use regrasp_base::diagnostic::number;
use regrasp_base::toml_table::{Entry, Found, Table};

/// Reads `[[couplings]]` into the joints of `robot`; a joint that follows a follower follows the leader of the chain.
///
/// A coupling that the URDF has is taken as it is. Errors: a joint coupled in another way already (`U219`), a joint or
/// leader that is fixed (`U220`), multiplier 0 (`U213`), a cycle (`U141`), limits that leave no position (`U143`).
pub(super) fn read(entry: &Entry, robot: &mut Robot, found: &mut Found) {
    let items = entry.entries(found, "[[couplings]] tables").unwrap_or_default();
    let mut direct: Vec<Option<Mimic>> = robot.joints.iter().map(|joint| joint.mimic).collect();
    let mut added = Vec::new();
    for item in items {
        let Some((joint, mimic, place)) = item.table(found).and_then(|table| read_one(table, robot, found)) else {
            continue;
        };
        if direct[joint.0] == Some(mimic) {
            continue;
        }
        if direct[joint.0].is_some() {
            let problem = format!("joint \"{}\" follows another joint already", robot.joints[joint.0].name);
            refuse(&place, "U219", problem, "one coupling per joint, of the hand file or the URDF", found);
            continue;
        }
        direct[joint.0] = Some(mimic);
        added.push((joint, place));
    }
    for (joint, place) in &added {
        if has_cycle(&direct, *joint) {
            let problem = format!("joint \"{}\" follows itself", robot.joints[joint.0].name);
            refuse(place, "U141", problem, "a joint at the end that follows no other", found);
            return;
        }
    }
    for (index, joint) in robot.joints.iter_mut().enumerate() {
        joint.mimic = led(&direct, JointId(index));
    }
    for (joint, place) in &added {
        refuse_empty_range(robot, *joint, place, found);
    }
}

/// The joint, what it follows and where the file names it.
fn read_one<'a>(mut table: Table<'a>, robot: &Robot, found: &mut Found) -> Option<(JointId, Mimic, Entry<'a>)> {
    let joint = table.required(found, "joint", "add joint = \"...\", the one that follows");
    let leader = table.required(found, "leader", "add leader = \"...\", the joint that it follows");
    let multiplier = match table.optional("multiplier") {
        Some(entry) => entry.number_that(found, GOOD_COUPLING, |x| check_coupling(x, 0.0).is_ok()),
        None => Some(1.0),
    };
    let offset = table
        .optional("offset")
        .map_or(Some(0.0), |entry| entry.number_that(found, GOOD_COUPLING, |x| check_coupling(1.0, x).is_ok()));
    table.finish(found);
    let mut moving = |entry: &Entry| {
        let joint = known_joint(entry, robot, found)?;
        if robot.joints[joint.0].kind == JointKind::Fixed {
            let problem = format!("joint \"{}\" is fixed", robot.joints[joint.0].name);
            refuse(entry, "U220", problem, "a joint that moves", found);
            return None;
        }
        Some(joint)
    };
    let (follower, leader) = (joint.as_ref().and_then(&mut moving), leader.as_ref().and_then(&mut moving));
    Some((follower?, Mimic { joint: leader?, multiplier: multiplier?, offset: offset? }, joint?))
}

fn refuse(entry: &Entry, code: &'static str, problem: String, expected: &str, found: &mut Found) {
    let diagnostic = entry.error(code, found, problem).expected(expected);
    found.diagnostics.push(diagnostic);
}

fn has_cycle(direct: &[Option<Mimic>], joint: JointId) -> bool {
    let mut at = joint;
    for _ in 0..direct.len() {
        match direct[at.0] {
            Some(mimic) => at = mimic.joint,
            None => return false,
        }
    }
    true
}

/// The coupling of `joint` to the independent joint at the end of its chain of leaders.
fn led(direct: &[Option<Mimic>], joint: JointId) -> Option<Mimic> {
    let mut coupling = direct[joint.0]?;
    while let Some(next) = direct[coupling.joint.0] {
        coupling = Mimic {
            joint: next.joint,
            multiplier: coupling.multiplier * next.multiplier,
            offset: coupling.multiplier * next.offset + coupling.offset,
        };
    }
    Some(coupling)
}

fn refuse_empty_range(robot: &Robot, joint: JointId, place: &Entry, found: &mut Found) {
    let follower = &robot.joints[joint.0];
    let (Some(mimic), Some(own)) = (follower.mimic, follower.limits) else { return };
    let leader = &robot.joints[mimic.joint.0];
    let Some(limits) = leader.limits else { return };
    let ends = [limits.lower, limits.upper].map(|q| mimic.multiplier * q + mimic.offset);
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    if high < own.lower || low > own.upper {
        let problem = format!(
            "joint \"{}\" follows joint \"{}\" to {}..{}, outside its own limits {}..{}",
            follower.name,
            leader.name,
            number(low),
            number(high),
            number(own.lower),
            number(own.upper)
        );
        refuse(place, "U143", problem, "ranges that overlap", found);
    }
}
