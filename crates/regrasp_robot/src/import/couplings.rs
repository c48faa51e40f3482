//! Couplings that a hand or robot file adds to those of the URDF: a joint follows one or several others.

use super::names::known_joint;
use super::urdf::{GOOD_COUPLING, check_coupling, refuse_empty_range};
use crate::coupling::{self, Coupling, MAX_TERMS, Terms, Unresolved};
use crate::robot::{JointId, JointKind, Robot};
use regrasp_base::toml_table::{Entry, Found, Table};

/// Reads `[[couplings]]` into the joints of `robot`; followers of followers come to follow independent joints.
///
/// A coupling that says the same as that of the URDF, but for rounding, changes nothing. Errors: a joint coupled in another way already
/// (`U219`), a joint or leader that is fixed (`U220`), multiplier 0 (`U213`), a cycle or more leaders than a joint may have (`U141`),
/// limits that leave no position (`U143`).
pub(super) fn read(entry: &Entry, robot: &mut Robot, found: &mut Found) {
    let items = entry.entries(found, "[[couplings]] tables").unwrap_or_default();
    let mut direct: Vec<Option<Coupling>> = robot.joints.iter().map(|joint| joint.coupling.clone()).collect();
    let mut added = Vec::new();
    for item in items {
        let Some((joint, coupling, place)) = item.table(found).and_then(|table| read_one(table, robot, found)) else {
            continue;
        };
        if direct[joint.0].as_ref().is_some_and(|known| known.is_like(&coupling)) {
            continue;
        }
        if direct[joint.0].is_some() {
            let problem = format!("joint \"{}\" follows another joint already", robot.joints[joint.0].name);
            refuse(&place, "U219", problem, "one coupling per joint, of the hand file or the URDF", found);
            continue;
        }
        direct[joint.0] = Some(coupling);
        added.push((joint, place));
    }
    let resolved = coupling::resolve(&direct);
    for (joint, place) in &added {
        let Err(reason) = resolved[joint.0] else { continue };
        let (problem, expected) = match reason {
            Unresolved::Cycle => ("follows itself".to_owned(), "a joint at the end that follows no other".to_owned()),
            Unresolved::NoLeader => ("follows joints that cancel".to_owned(), "a joint that leads".to_owned()),
            Unresolved::TooManyLeaders => {
                ("follows too many joints".to_owned(), format!("at most {MAX_TERMS} independent joints that lead"))
            }
        };
        let problem = format!("joint \"{}\" {problem}", robot.joints[joint.0].name);
        refuse(place, "U141", problem, &expected, found);
        return;
    }
    for (joint, coupling) in robot.joints.iter_mut().zip(resolved) {
        // What the URDF coupled before can fail only through a joint that was added, which is told above.
        joint.coupling = coupling.unwrap_or_default();
    }
    for (joint, place) in &added {
        let follower = &robot.joints[joint.0];
        if let Err(problem) = refuse_empty_range(&robot.joints, follower) {
            let problem = format!("joint \"{}\" {problem}", follower.name);
            let diagnostic = place.error("U143", found, problem).expected("ranges that overlap");
            found.diagnostics.push(diagnostic.fix("correct multiplier or offset of the coupling, or the limits"));
        }
    }
}

/// The joint, what it follows and where the file names it.
fn read_one<'a>(mut table: Table<'a>, robot: &Robot, found: &mut Found) -> Option<(JointId, Coupling, Entry<'a>)> {
    let joint = table.required(found, "joint", "add joint = \"...\", the one that follows");
    let offset = table
        .optional("offset")
        .map_or(Some(0.0), |entry| entry.number_that(found, GOOD_COUPLING, |x| check_coupling(1.0, x).is_ok()));
    let terms = match table.optional("terms") {
        Some(entry) => {
            table.finish(found);
            read_terms(&entry, robot, found)
        }
        None => {
            let term = read_term(&mut table, robot, found);
            table.finish(found);
            term.map(|term| Terms::from_iter([term]))
        }
    };
    let follower = joint.as_ref().and_then(|entry| moving_joint(entry, robot, found));
    Some((follower?, Coupling { terms: terms?, offset: offset? }, joint?))
}

/// `terms = [{ leader = "...", multiplier = -1.0 }, ...]`.
fn read_terms(entry: &Entry, robot: &Robot, found: &mut Found) -> Option<Terms<JointId>> {
    let expected = format!("1 to {MAX_TERMS} tables {{ leader = \"...\", multiplier = -1.0 }}, no leader twice");
    let items = entry.entries(found, &expected)?;
    let mut terms: Vec<(JointId, f64)> = Vec::new();
    for item in &items {
        let mut table = item.table(found)?;
        let term = read_term(&mut table, robot, found);
        table.finish(found);
        terms.push(term?);
    }
    let is_repeated = |k: usize| terms[..k].iter().any(|(leader, _)| *leader == terms[k].0);
    if let Some(k) = (0..terms.len()).find(|&k| is_repeated(k)) {
        let problem = format!("names leader \"{}\" twice", robot.joints[terms[k].0.0].name);
        refuse(&items[k], "U213", problem, &expected, found);
        return None;
    }
    if terms.is_empty() || terms.len() > MAX_TERMS {
        refuse(entry, "U213", format!("has {} terms", terms.len()), &expected, found);
        return None;
    }
    terms.sort_by_key(|(leader, _)| *leader);
    Some(terms.into_iter().collect())
}

/// `leader` and `multiplier`, which is 1 where it is left out.
fn read_term(table: &mut Table, robot: &Robot, found: &mut Found) -> Option<(JointId, f64)> {
    let leader = table.required(found, "leader", "add leader = \"...\", the joint that it follows");
    let multiplier = match table.optional("multiplier") {
        Some(entry) => entry.number_that(found, GOOD_COUPLING, |x| check_coupling(x, 0.0).is_ok()),
        None => Some(1.0),
    };
    let leader = leader.and_then(|entry| moving_joint(&entry, robot, found));
    leader.zip(multiplier)
}

fn moving_joint(entry: &Entry, robot: &Robot, found: &mut Found) -> Option<JointId> {
    let joint = known_joint(entry, robot, found)?;
    if robot.joints[joint.0].kind == JointKind::Fixed {
        let problem = format!("joint \"{}\" is fixed", robot.joints[joint.0].name);
        refuse(entry, "U220", problem, "a joint that moves", found);
        return None;
    }
    Some(joint)
}

fn refuse(entry: &Entry, code: &'static str, problem: String, expected: &str, found: &mut Found) {
    let diagnostic = entry.error(code, found, problem).expected(expected);
    found.diagnostics.push(diagnostic);
}
