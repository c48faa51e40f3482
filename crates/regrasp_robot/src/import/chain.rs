//! The chain of a finger or an arm, and its rest posture.

use super::fixes;
use super::spec::Carried;
use crate::coupling::{Coupling, limit_leaders};
use crate::hand::MAX_FINGER_JOINTS;
use crate::kinematics::chain::{Chain, ChainJoint, JointMotion};
use crate::kinematics::finger_ik::MAX_COORDINATES;
use crate::kinematics::motion_bound::MAX_JOINTS;
use crate::robot::{Joint, JointId, JointKind, LinkId, Robot};
use regrasp_base::diagnostic::{Diagnostics, did_you_mean, number};
use regrasp_base::{Diagnostic, Place};
use std::collections::BTreeMap;

/// What a chain is made for, for messages.
pub(super) struct ChainOwner<'a> {
    /// `finger` or `arm`.
    pub kind: &'static str,
    /// Its name.
    pub name: &'a str,
    /// Where the file describes it.
    pub place: &'a Place,
    /// The key that states its posture.
    pub rest_key: &'static str,
}

/// The serial chain over `joints`, with followers folded into their leaders' coordinates.
///
/// Reports: leaders that are not on the chain (`U209`), limits that leave no position (`U143`), too many joints
/// (`U222`).
pub(super) fn make_chain(
    robot: &Robot,
    owner: &ChainOwner,
    joints: &[JointId],
    carried: &BTreeMap<LinkId, Carried>,
    found: &mut Diagnostics,
) -> Option<Chain> {
    let independent: Vec<JointId> = joints.iter().copied().filter(|j| robot.joints[j.0].coupling.is_none()).collect();
    if independent.len() > MAX_COORDINATES || joints.len() > MAX_FINGER_JOINTS {
        let problem = format!("has {} joints, {} of them independent", joints.len(), independent.len());
        let expected = format!("at most {MAX_FINGER_JOINTS} joints, at most {MAX_COORDINATES} of them independent");
        let diagnostic = Diagnostic::new("U222", owner.place.clone(), problem).element(owner.kind, owner.name);
        let fix = match owner.kind {
            "finger" => "first_joint = \"...\" holds the joints before it",
            _ => "base_link = \"...\", a link farther along; joints above it are common",
        };
        found.push(diagnostic.expected(expected).fix(fix));
        return None;
    }
    let n_terms: usize =
        joints.iter().map(|joint| robot.joints[joint.0].coupling.as_ref().map_or(1, |own| own.terms.len())).sum();
    if n_terms > MAX_JOINTS {
        let problem = format!("has joints that follow {n_terms} others in all, counting independent joints once");
        let diagnostic = Diagnostic::new("U222", owner.place.clone(), problem).element(owner.kind, owner.name);
        found.push(
            diagnostic.expected(format!("at most {MAX_JOINTS}")).fix("terms with fewer leaders in [[couplings]]"),
        );
        return None;
    }
    let (mut chain_joints, mut names, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for id in &independent {
        let joint = &robot.joints[id.0];
        names.push(joint.name.clone());
        lower.push(joint.limits.map_or(f64::NEG_INFINITY, |limits| limits.lower));
        upper.push(joint.limits.map_or(f64::INFINITY, |limits| limits.upper));
    }
    let (mut linear, mut complete) = (Vec::new(), true);
    for id in joints {
        let joint = &robot.joints[id.0];
        let own = joint.coupling.clone().unwrap_or_else(|| Coupling::independent(*id));
        let coordinate_of = |leader: JointId| independent.iter().position(|other| *other == leader);
        let Some(drive) = own.renamed(coordinate_of) else {
            let leader =
                own.terms.iter().find(|(leader, _)| coordinate_of(*leader).is_none()).map_or(*id, |term| term.0);
            let problem = format!(
                "joint \"{}\" follows joint \"{}\", which is on another finger or on none",
                joint.name, robot.joints[leader.0].name
            );
            found.push(
                Diagnostic::new("U209", owner.place.clone(), problem)
                    .element(owner.kind, owner.name)
                    .expected("followers on the chain of the joint they follow")
                    .fix(fixes::leader_elsewhere(robot, joints, *id, leader, carried)),
            );
            complete = false;
            continue;
        };
        if let (Some(_), Some(limits)) = (&joint.coupling, joint.limits) {
            let own = [limits.lower, limits.upper];
            linear.extend(limit_leaders(&joint.name, &drive, own, (&mut lower, &mut upper)));
        }
        let parent = carried.get(&joint.parent)?;
        chain_joints.push(ChainJoint {
            parent_from_joint: parent.body_from_link * joint.parent_from_joint,
            axis: joint.axis,
            motion: if joint.kind == JointKind::Prismatic { JointMotion::Slide } else { JointMotion::Turn },
            drive,
        });
    }
    for (k, name) in names.iter().enumerate() {
        if lower[k] > upper[k] {
            let problem = format!("the joints that follow joint \"{name}\" leave it no position");
            found.push(
                Diagnostic::new("U143", owner.place.clone(), problem)
                    .element(owner.kind, owner.name)
                    .expected("limits that overlap")
                    .fix("correct multiplier or offset of the joints that follow it, or their limits"),
            );
            complete = false;
        }
    }
    complete.then(|| Chain::new(chain_joints, names, lower, upper).with_linear_limits(linear))
}

/// Least share of its own range that followers leave a joint which can be meant.
const LEAST_LEFT: f64 = 0.02;

/// What to say of joints of `chain` that can hardly move, for the limits of the joints that follow them: often the sign of a coupling is
/// wrong.
pub(super) fn remarks_on_stuck_leaders(robot: &Robot, chain: &Chain) -> Vec<String> {
    let of_coordinate = |k: usize| {
        let name = &chain.names[k];
        let (id, joint) = robot.joints.iter().enumerate().find(|(_, joint)| joint.name == *name)?;
        let own = joint.limits?;
        let (range, left) = (own.upper - own.lower, chain.upper[k] - chain.lower[k]);
        if !(range > 0.0) || left >= LEAST_LEFT * range {
            return None;
        }
        let follows = |other: &&Joint| {
            let single = other.coupling.as_ref().and_then(Coupling::single);
            other.limits.is_some() && single.is_some_and(|(leader, _)| leader == JointId(id))
        };
        let followers: Vec<String> =
            robot.joints.iter().filter(follows).map(|other| format!("\"{}\"", other.name)).collect();
        Some(format!(
            "joint \"{name}\" can move only from {} to {}, of {}..{}: the limits of what follows it ({}) leave no more. \
             Correct multiplier or offset there, or the limits",
            number(chain.lower[k]),
            number(chain.upper[k]),
            number(own.lower),
            number(own.upper),
            followers.join(", "),
        ))
    };
    (0..chain.n_coordinates()).filter_map(of_coordinate).collect()
}

/// The middle of the limits; 0 for coordinates without limits.
pub(super) fn middle_of_limits(chain: &Chain) -> Vec<f64> {
    (0..chain.n_coordinates())
        .map(|k| {
            let (lower, upper) = (chain.lower[k], chain.upper[k]);
            if lower.is_finite() && upper.is_finite() { 0.5 * (lower + upper) } else { 0.0 }
        })
        .collect()
}

/// The posture that `stated` asks for by name of joint, each with its place; `otherwise` where it says nothing.
///
/// Reports: unknown joints (`U205`), positions outside the limits (`U212`), limits that leave no posture (`U143`).
pub(super) fn rest_posture(
    owner: &ChainOwner,
    stated: &[(String, f64, Place)],
    chain: &Chain,
    otherwise: Vec<f64>,
    found: &mut Diagnostics,
) -> Vec<f64> {
    let mut rest = otherwise;
    for (name, value, place) in stated {
        let Some(k) = chain.names.iter().position(|other| other == name) else {
            if found.counted_only() {
                continue;
            }
            let meant = did_you_mean(name, chain.names.iter().map(String::as_str));
            found.push(
                Diagnostic::new(
                    "U205",
                    place.clone(),
                    format!("{} \"{}\" has no independent joint \"{name}\"", owner.kind, owner.name),
                )
                .element("key", owner.rest_key)
                .expected(format!("one of {}", chain.names.join(", ")))
                .fix(meant.map_or(String::new(), |meant| format!("did you mean {meant}?"))),
            );
            continue;
        };
        if *value < chain.lower[k] || *value > chain.upper[k] {
            found.push(
                Diagnostic::new(
                    "U212",
                    place.clone(),
                    format!("{} position {} is outside the limits", owner.rest_key, number(*value)),
                )
                .element("joint", name)
                .expected(format!("{}..{}", number(chain.lower[k]), number(chain.upper[k]))),
            );
            continue;
        }
        rest[k] = *value;
    }
    if chain.within_linear_limits(&rest, 0.0) {
        return rest;
    }
    let named = |k: usize| stated.iter().find(|(name, _, _)| *name == chain.names[k]);
    for limit in chain.linear_limits.iter().filter(|limit| limit.room(&rest) < 0.0) {
        // A posture that the file states is kept or refused, never changed.
        if let Some((_, _, place)) = limit.terms.iter().find_map(|(k, _)| named(*k)) {
            let problem = format!(
                "the {} posture takes joint \"{}\", which follows, outside its limits",
                owner.rest_key, limit.joint
            );
            let leaders: Vec<&str> = limit.terms.iter().map(|(k, _)| chain.names[*k].as_str()).collect();
            found.push(
                Diagnostic::new("U212", place.clone(), problem)
                    .element(owner.kind, owner.name)
                    .expected(format!("positions of {} within the limits of their follower", leaders.join(", "))),
            );
            return rest;
        }
    }
    let kept = chain.bring_within_limits(&rest);
    if kept.is_none() {
        let problem = "the limits of joints that follow several others leave no posture";
        let diagnostic = Diagnostic::new("U143", owner.place.clone(), problem).element(owner.kind, owner.name);
        found.push(diagnostic.expected("limits that overlap"));
    }
    kept.unwrap_or(rest)
}
