//! Fingers that share a motor: a joint of one finger follows a joint of another one. For grasp lists such a joint becomes a
//! coordinate of its own finger, and the hand says what it follows ([`Tie`]). So it does on a robot that carries the hand, and where
//! [`super::shared_motors`] cannot hold the motor still.

use super::spec::HandSpec;
use crate::coupling::{Coupling, Terms};
use crate::hand::{Hand, Tie};
use crate::robot::{JointId, JointKind, LinkId, Robot};

/// `robot` with the followers of other fingers' joints as joints of their own, and what they follow. Linkages that carry no
/// collision geometry are held, with a note.
///
/// A motor that drives several fingers can give each its share of the effort limit: what all of them need together then
/// stays below it.
pub(super) fn untie(robot: &Robot, spec: &HandSpec, notes: &mut Vec<String>) -> (Robot, Vec<Tie>) {
    let mut untied = robot.clone();
    let base_path = robot.joints_to(spec.base);
    let chains: Vec<Vec<JointId>> = spec
        .fingers
        .iter()
        .map(|finger| {
            let path = robot.joints_to(finger.tip_link);
            let below = path.get(base_path.len()..).unwrap_or_default();
            let from = finger.first_joint.and_then(|first| below.iter().position(|joint| *joint == first));
            below[from.unwrap_or(0)..].to_vec()
        })
        .collect();
    let on_finger = |joint: JointId| chains.iter().any(|chain| chain.contains(&joint));
    let mut ties: Vec<Tie> = Vec::new();
    for chain in &chains {
        let first = ties.len();
        for &joint in chain {
            let Some(coupling) = &robot.joints[joint.0].coupling else { continue };
            let is_elsewhere = |leader: JointId| !chain.contains(&leader) && on_finger(leader);
            if !coupling.terms.iter().all(|(leader, _)| is_elsewhere(*leader)) {
                continue;
            }
            let in_proportion = ties[first..].iter().find_map(|tie| follows_alike(coupling, tie));
            if in_proportion.is_none() {
                ties.push(Tie { follower: joint, coupling: coupling.clone() });
            }
            untied.joints[joint.0].coupling = in_proportion;
        }
    }
    share_efforts(&mut untied, &ties);
    for index in 0..untied.joints.len() {
        let joint = &untied.joints[index];
        let Some(coupling) = &joint.coupling else { continue };
        let leads = coupling.terms.iter().any(|(leader, _)| on_finger(*leader));
        if leads && !on_finger(JointId(index)) && carries_nothing(robot, joint.child) {
            notes.push(format!("joint \"{}\" moves no collision geometry and is held", joint.name));
            untied.joints[index].coupling = None;
        }
    }
    (untied, ties)
}

/// As [`untie`], for a hand on a whole robot: linkages that carry no collision geometry become fixed, so that they are no coordinates.
pub(super) fn untie_on(robot: &mut Robot, spec: &HandSpec, notes: &mut Vec<String>) -> Vec<Tie> {
    let (untied, ties) = untie(robot, spec, notes);
    let before = std::mem::replace(robot, untied);
    for (index, (joint, was)) in robot.joints.iter_mut().zip(&before.joints).enumerate() {
        let is_let_go = was.coupling.is_some() && joint.coupling.is_none();
        if is_let_go && ties.iter().all(|tie| tie.follower != JointId(index)) {
            joint.kind = JointKind::Fixed;
        }
    }
    ties
}

/// The coupling to the follower of `tie` that says the same as `coupling` to its one leader.
fn follows_alike(coupling: &Coupling, tie: &Tie) -> Option<Coupling> {
    let ([(leader, factor)], [(other, base)]) = (coupling.terms.as_slice(), tie.coupling.terms.as_slice()) else {
        return None;
    };
    (leader == other).then(|| {
        let ratio = factor / base;
        let offset = coupling.offset - ratio * tie.coupling.offset;
        Coupling { terms: Terms::from_iter([(tie.follower, ratio)]), offset }
    })
}

/// Every member of a group of tied joints gets its share of the leader's effort limit.
fn share_efforts(robot: &mut Robot, ties: &[Tie]) {
    let efforts: Vec<Option<f64>> = robot.joints.iter().map(|joint| joint.limits?.effort).collect();
    for leader in 0..robot.joints.len() {
        let followers: Vec<(JointId, f64)> = ties
            .iter()
            .flat_map(|tie| tie.coupling.terms.iter().map(|term| (tie.follower, *term)))
            .filter(|(_, (of, _))| of.0 == leader)
            .map(|(follower, (_, factor))| (follower, factor))
            .collect();
        let Some(effort) = efforts[leader].filter(|_| !followers.is_empty()) else { continue };
        let share = effort / (followers.len() + 1) as f64;
        let mut limit = |joint: usize, most: f64| {
            if let Some(limits) = &mut robot.joints[joint].limits {
                limits.effort = Some(limits.effort.map_or(most, |own| own.min(most)));
            }
        };
        limit(leader, share);
        for (follower, factor) in followers {
            limit(follower.0, share / factor.abs());
        }
    }
}

/// True when neither `link` nor anything that it carries has collision geometry.
fn carries_nothing(robot: &Robot, link: LinkId) -> bool {
    robot.links[link.0].collision.is_empty()
        && robot.joints_from(link).into_iter().all(|joint| carries_nothing(robot, robot.joints[joint.0].child))
}

/// Brings the followers' rest positions to where their couplings say.
pub(super) fn settle_rest(hand: &mut Hand) {
    for tie in hand.ties.clone() {
        let place = |hand: &Hand, joint: JointId| {
            let name = &hand.robot.joints[joint.0].name;
            let at = |(f, finger): (usize, &crate::hand::Finger)| {
                Some((f, finger.chain.names.iter().position(|n| n == name)?))
            };
            hand.fingers.iter().enumerate().find_map(at)
        };
        let position = |leader: JointId| place(hand, leader).map_or(0.0, |(f, k)| hand.fingers[f].rest[k]);
        let wanted = tie.coupling.position(position);
        if let Some((f, k)) = place(hand, tie.follower) {
            hand.fingers[f].rest[k] = wanted;
        }
    }
}
