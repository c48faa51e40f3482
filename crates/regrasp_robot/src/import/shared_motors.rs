//! Motors that move joints of several fingers, such as the spread of a hand: plans in the hand hold them still, so that every finger moves
//! alone with the joints that it has to itself.

use super::spec::HandSpec;
use crate::robot::{JointId, Robot};
use std::collections::BTreeSet;

/// The first joint of a finger after those that are coupled with joints of other fingers, such as spreads: those are held. None where
/// there are none, or where nothing independent is left.
pub(crate) fn first_uncoupled_joint(robot: &Robot, paths: &[Vec<JointId>], finger: usize) -> Option<JointId> {
    let path = &paths[finger];
    let leaders =
        |joint: JointId| robot.joints[joint.0].coupling.iter().flat_map(|own| own.terms.iter().map(|term| term.0));
    let leads_away = |joint: JointId| {
        let others = paths.iter().enumerate().filter(|&(k, _)| k != finger).flat_map(|(_, other)| other);
        others.filter(|other| !path.contains(other)).any(|&other| leaders(other).any(|leader| leader == joint))
    };
    let mut first = 0;
    // What follows a joint that is held is held too.
    while let Some(last) = (first..path.len())
        .rev()
        .find(|&k| leads_away(path[k]) || leaders(path[k]).any(|leader| !path[first..].contains(&leader)))
    {
        first = last + 1;
    }
    let is_independent = |joint: &JointId| robot.joints[joint.0].coupling.is_none();
    (first > 0 && path[first..].iter().any(is_independent)).then(|| path[first])
}

/// The moving joints from the base of `spec` to each of its tips.
fn paths(robot: &Robot, spec: &HandSpec) -> Vec<Vec<JointId>> {
    let above = robot.joints_to(spec.base).len();
    let path =
        |tip| robot.joints_to(tip).into_iter().skip(above).filter(|joint| robot.joints[joint.0].moves()).collect();
    spec.fingers.iter().map(|finger| path(finger.tip_link)).collect()
}

/// Lets every finger of `spec` that says nothing of its first joint begin after the joints that it shares a motor for with other fingers,
/// where it has others. What the file says of their rest is where they are held.
pub(super) fn hold(robot: &Robot, spec: &mut HandSpec, notes: &mut Vec<String>) {
    let paths = paths(robot, spec);
    let mut is_held = false;
    for (index, path) in paths.iter().enumerate() {
        if spec.fingers[index].first_joint.is_some() {
            continue;
        }
        let Some(first) = first_uncoupled_joint(robot, &paths, index) else { continue };
        let before: Vec<JointId> = path.iter().copied().take_while(|joint| *joint != first).collect();
        let names = |joints: &[JointId]| -> Vec<String> {
            joints.iter().map(|joint| format!("\"{}\"", robot.joints[joint.0].name)).collect()
        };
        notes.push(format!(
            "finger \"{}\": held, as other fingers share a motor with them: {}",
            spec.fingers[index].name,
            names(&before).join(", ")
        ));
        let finger = &mut spec.fingers[index];
        finger.first_joint = Some(first);
        let (of_held, own): (Vec<_>, Vec<_>) = std::mem::take(&mut finger.rest)
            .into_iter()
            .partition(|(name, ..)| before.iter().any(|joint| robot.joints[joint.0].name == *name));
        finger.rest = own;
        for (name, position, _) in of_held {
            if let Some(joint) = robot.joint_named(&name).filter(|joint| robot.joints[joint.0].coupling.is_none()) {
                spec.held.entry(joint).or_insert(position);
            }
        }
        is_held = true;
    }
    if is_held {
        place_held_leaders(robot, spec);
    }
}

/// The joints of fingers.
pub(super) fn moving_joints(robot: &Robot, spec: &HandSpec) -> BTreeSet<JointId> {
    let mut moving = BTreeSet::new();
    for (finger, path) in spec.fingers.iter().zip(paths(robot, spec)) {
        let is_held = |joint: &JointId| finger.first_joint.is_some_and(|first| *joint != first);
        moving.extend(path.into_iter().skip_while(is_held));
    }
    moving
}

/// `robot` with the joints that `spec` holds somewhere at their zero: whoever holds joints of no finger as near to zero as they go has them
/// there. Followers stay where their couplings have them.
pub(super) fn with_held_at_zero(robot: &Robot, spec: &HandSpec) -> Robot {
    let mut moved = robot.clone();
    for (&id, &position) in &spec.held {
        let joint = &mut moved.joints[id.0];
        joint.parent_from_joint *= joint.motion(position);
        if let Some(limits) = &mut joint.limits {
            limits.lower -= position;
            limits.upper -= position;
        }
        for follower in &mut moved.joints {
            if let Some(coupling) = &mut follower.coupling {
                coupling.offset += coupling.multiplier(id) * position;
            }
        }
    }
    moved
}

/// Gives joints that are held and lead joints of other fingers a position, where they have none: the middle of what their limits and those
/// of their followers leave. A thumb is then opposed, and a spread half open.
pub(crate) fn place_held_leaders(robot: &Robot, spec: &mut HandSpec) {
    let paths = paths(robot, spec);
    let moving = moving_joints(robot, spec);
    for path in &paths {
        for &leader in path.iter().filter(|joint| !moving.contains(joint)) {
            let joint = &robot.joints[leader.0];
            let (None, Some(limits)) = (&joint.coupling, joint.limits) else { continue };
            let (mut low, mut high, mut leads_away) = (limits.lower, limits.upper, false);
            for (index, follower) in robot.joints.iter().enumerate() {
                let Some((_, factor)) =
                    follower.coupling.as_ref().and_then(|own| own.single()).filter(|own| own.0 == leader)
                else {
                    continue;
                };
                leads_away |= !path.contains(&JointId(index));
                let offset = follower.coupling.as_ref().map_or(0.0, |own| own.offset);
                if let Some(own) = follower.limits {
                    let ends = [(own.lower - offset) / factor, (own.upper - offset) / factor];
                    low = low.max(ends[0].min(ends[1]));
                    high = high.min(ends[0].max(ends[1]));
                }
            }
            if leads_away && low <= high {
                spec.held.entry(leader).or_insert(0.5 * (low + high));
            }
        }
    }
}
