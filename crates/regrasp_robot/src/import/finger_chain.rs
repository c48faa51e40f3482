//! The chain of a finger and its rest posture.

use super::spec::{Carried, FingerSpec};
use crate::coupling::{Coupling, LinearLimit};
use crate::hand::MAX_FINGER_JOINTS;
use crate::kinematics::chain::{Chain, ChainJoint, Motion};
use crate::kinematics::finger_ik::MAX_COORDINATES;
use crate::kinematics::motion_bound::MAX_JOINTS;
use crate::robot::{JointId, JointKind, LinkId, Robot};
use regrasp_base::Diagnostic;
use regrasp_base::diagnostic::{Diagnostics, did_you_mean, number};
use std::collections::BTreeMap;

/// The serial chain over `joints`, with followers folded into their leaders' coordinates.
///
/// Reports: leaders that are not on the chain (`U209`), limits that leave no position (`U143`), too many joints
/// (`U222`).
pub(super) fn make_chain(
    robot: &Robot,
    spec: &FingerSpec,
    joints: &[JointId],
    carried: &BTreeMap<LinkId, Carried>,
    found: &mut Diagnostics,
) -> Option<Chain> {
    let independent: Vec<JointId> = joints.iter().copied().filter(|j| robot.joints[j.0].coupling.is_none()).collect();
    if independent.len() > MAX_COORDINATES || joints.len() > MAX_FINGER_JOINTS {
        let problem = format!("has {} joints, {} of them independent", joints.len(), independent.len());
        let expected = format!("at most {MAX_FINGER_JOINTS} joints, at most {MAX_COORDINATES} of them independent");
        let diagnostic = Diagnostic::new("U222", spec.place.clone(), problem).element("finger", &spec.name);
        found.push(diagnostic.expected(expected).fix("first_joint = \"...\" holds the joints before it"));
        return None;
    }
    let n_terms: usize =
        joints.iter().map(|joint| robot.joints[joint.0].coupling.as_ref().map_or(1, |own| own.terms.len())).sum();
    if n_terms > MAX_JOINTS {
        let problem = format!("has joints that follow {n_terms} others in all, counting independent joints once");
        let diagnostic = Diagnostic::new("U222", spec.place.clone(), problem).element("finger", &spec.name);
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
                Diagnostic::new("U209", spec.place.clone(), problem)
                    .element("finger", &spec.name)
                    .expected("followers on the chain of the joint they follow"),
            );
            complete = false;
            continue;
        };
        if let (Some(_), Some(limits)) = (&joint.coupling, joint.limits) {
            limit_leaders(&joint.name, &drive, [limits.lower, limits.upper], (&mut lower, &mut upper), &mut linear);
        }
        let parent = carried.get(&joint.parent)?;
        chain_joints.push(ChainJoint {
            parent_from_joint: parent.body_from_link * joint.parent_from_joint,
            axis: joint.axis,
            motion: if joint.kind == JointKind::Prismatic { Motion::Slide } else { Motion::Turn },
            drive,
        });
    }
    for (k, name) in names.iter().enumerate() {
        if lower[k] > upper[k] {
            let problem = format!("the joints that follow joint \"{name}\" leave it no position");
            found.push(
                Diagnostic::new("U143", spec.place.clone(), problem)
                    .element("finger", &spec.name)
                    .expected("limits that overlap"),
            );
            complete = false;
        }
    }
    complete.then(|| Chain::new(chain_joints, names, lower, upper).with_linear_limits(linear))
}

/// Narrows the limits of coordinates to those of a joint that follows them: one leader's own, or the limit of a sum.
pub(super) fn limit_leaders(
    name: &str,
    drive: &Coupling<usize>,
    limits: [f64; 2],
    (lower, upper): (&mut [f64], &mut [f64]),
    linear: &mut Vec<LinearLimit>,
) {
    let Some((coordinate, multiplier)) = drive.single() else {
        linear.push(LinearLimit::new(name.to_owned(), drive, limits));
        return;
    };
    let ends = limits.map(|position| (position - drive.offset) / multiplier);
    lower[coordinate] = lower[coordinate].max(ends[0].min(ends[1]));
    upper[coordinate] = upper[coordinate].min(ends[0].max(ends[1]));
}

/// The rest posture that `spec` asks for, in the middle of the limits where it says nothing.
///
/// Reports: unknown joints (`U205`), positions outside the limits (`U212`).
pub(super) fn rest_posture(spec: &FingerSpec, chain: &Chain, found: &mut Diagnostics) -> Vec<f64> {
    let mut rest: Vec<f64> = (0..chain.n_coordinates())
        .map(|k| {
            let (lower, upper) = (chain.lower[k], chain.upper[k]);
            if lower.is_finite() && upper.is_finite() { 0.5 * (lower + upper) } else { 0.0 }
        })
        .collect();
    for (name, value, place) in &spec.rest {
        let Some(k) = chain.names.iter().position(|other| other == name) else {
            if found.counted_only() {
                continue;
            }
            let meant = did_you_mean(name, chain.names.iter().map(String::as_str));
            found.push(
                Diagnostic::new(
                    "U205",
                    place.clone(),
                    format!("finger \"{}\" has no independent joint \"{name}\"", spec.name),
                )
                .element("key", "rest")
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
                    format!("rest position {} is outside the limits", number(*value)),
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
    let named = |k: usize| spec.rest.iter().find(|(name, _, _)| *name == chain.names[k]);
    for limit in chain.linear_limits.iter().filter(|limit| limit.room(&rest) < 0.0) {
        // A posture that the file states is kept or refused, never changed.
        if let Some((_, _, place)) = limit.terms.iter().find_map(|(k, _)| named(*k)) {
            let problem =
                format!("the rest posture takes joint \"{}\", which follows, outside its limits", limit.joint);
            let leaders: Vec<&str> = limit.terms.iter().map(|(k, _)| chain.names[*k].as_str()).collect();
            found.push(
                Diagnostic::new("U212", place.clone(), problem)
                    .element("finger", &spec.name)
                    .expected(format!("positions of {} within the limits of their follower", leaders.join(", "))),
            );
            return rest;
        }
    }
    let kept = chain.bring_within_limits(&rest);
    if kept.is_none() {
        let problem = "the limits of joints that follow several others leave no posture";
        let diagnostic = Diagnostic::new("U143", spec.place.clone(), problem).element("finger", &spec.name);
        found.push(diagnostic.expected("limits that overlap"));
    }
    kept.unwrap_or(rest)
}
