//! Arms, hands and common joints guessed from the tree of a robot, and from its SRDF where there is one.

use super::super::rigid::rigid_links;
use crate::import::srdf::{Srdf, joints_of_group};
use crate::robot::{JointId, LinkId, Robot};
use std::collections::BTreeSet;

/// Moving joints, one after the other without a branch, that make an arm.
const MIN_ARM_JOINTS: usize = 6;
/// Most joints of an arm: what comes before them lifts or turns the arm as a whole.
const MAX_ARM_JOINTS: usize = 7;
/// Words in names that say on which side an arm is.
const SIDES: [(&str, &[&str]); 2] = [("left", &["left", "l"]), ("right", &["right", "r"])];

/// An arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArmGuess {
    /// Name.
    pub name: String,
    /// The link that it stands on.
    pub base: LinkId,
    /// The link that carries a hand.
    pub mount: LinkId,
    /// Its moving joints, base first.
    pub joints: Vec<JointId>,
}

/// A hand below the mount link of an arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HandGuess {
    /// Name: that of the arm, or of the SRDF's end effector.
    pub name: String,
    /// Index of the arm.
    pub arm: usize,
    /// The link that all its moving joints are below of.
    pub base: LinkId,
}

/// The parts of a robot.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RobotGuess {
    /// Arms, in the order of the tree.
    pub arms: Vec<ArmGuess>,
    /// Hands that seem to be below them.
    pub hands: Vec<HandGuess>,
    /// Independent joints that carry arms.
    pub common: Vec<JointId>,
    /// Independent joints that carry no arm and are on none: wheels, heads, sensors.
    pub others: Vec<JointId>,
}

/// Guesses the parts of `robot`. Without arms where no six moving joints follow each other without a branch.
pub fn guess_robot(robot: &Robot, srdf: Option<&Srdf>) -> RobotGuess {
    let mut arms: Vec<ArmGuess> = chains(robot).into_iter().filter_map(|chain| arm_of(robot, chain)).collect();
    // What is below an arm is its hand, however many joints a finger has.
    let all: BTreeSet<JointId> = arms.iter().flat_map(|arm| arm.joints.iter().copied()).collect();
    arms.retain(|arm| !robot.joints_to(arm.base).iter().any(|joint| all.contains(joint)));
    if let Some(srdf) = srdf {
        arms.iter_mut().for_each(|arm| take_group(robot, srdf, arm));
    }
    name_arms(robot, &mut arms);
    let hands: Vec<HandGuess> = (0..arms.len()).filter_map(|arm| hand_of(robot, &arms[arm], arm)).collect();
    let on_arms: BTreeSet<JointId> = arms.iter().flat_map(|arm| arm.joints.iter().copied()).collect();
    let above: BTreeSet<JointId> = arms.iter().flat_map(|arm| robot.joints_to(arm.base)).collect();
    let is_below_arm = |joint: &JointId| {
        let path = robot.joints_to(robot.joints[joint.0].child);
        path.iter().any(|other| on_arms.contains(other))
    };
    let independent = |joint: &JointId| robot.joints[joint.0].moves() && robot.joints[joint.0].coupling.is_none();
    let free = (0..robot.joints.len()).map(JointId).filter(|joint| independent(joint) && !is_below_arm(joint));
    // A leader of a joint above an arm moves the arm too.
    let leads: BTreeSet<JointId> = above
        .iter()
        .filter_map(|joint| robot.joints[joint.0].coupling.as_ref())
        .flat_map(|coupling| coupling.terms.iter().map(|(leader, _)| *leader))
        .collect();
    let (common, others) = free.partition(|joint| above.contains(joint) || leads.contains(joint));
    RobotGuess { arms, hands, common, others }
}

/// Moving joints that the body behind `joint` carries.
fn next_joints(robot: &Robot, joint: JointId) -> Vec<JointId> {
    let links = rigid_links(robot, robot.joints[joint.0].child);
    let carried = links.iter().flat_map(|(link, _)| robot.joints_from(*link));
    carried.filter(|joint| robot.joints[joint.0].moves()).collect()
}

/// Maximal chains of moving joints without a branch between, base first, in document order.
fn chains(robot: &Robot) -> Vec<Vec<JointId>> {
    let moving: Vec<JointId> = (0..robot.joints.len()).map(JointId).filter(|j| robot.joints[j.0].moves()).collect();
    let next: Vec<Vec<JointId>> = moving.iter().map(|&joint| next_joints(robot, joint)).collect();
    let is_inside = |joint: JointId| next.iter().any(|after| after.as_slice() == [joint]);
    let after = |joint: JointId| moving.iter().position(|&other| other == joint).map(|k| next[k].as_slice());
    let from = |first: JointId| {
        let mut chain = vec![first];
        while let Some(&[one]) = chain.last().and_then(|&last| after(last)) {
            chain.push(one);
        }
        chain
    };
    moving.iter().copied().filter(|&joint| !is_inside(joint)).map(from).collect()
}

fn arm_of(robot: &Robot, mut chain: Vec<JointId>) -> Option<ArmGuess> {
    let n_independent = |chain: &[JointId]| chain.iter().filter(|j| robot.joints[j.0].coupling.is_none()).count();
    while n_independent(&chain) > MAX_ARM_JOINTS {
        chain.remove(0);
    }
    if n_independent(&chain) < MIN_ARM_JOINTS {
        return None;
    }
    let (first, last) = (*chain.first()?, *chain.last()?);
    let base = robot.joints[first.0].parent;
    let mount = if next_joints(robot, last).is_empty() {
        flange(robot, robot.joints[last.0].child)
    } else {
        robot.joints[last.0].child
    };
    Some(ArmGuess { name: String::new(), base, mount, joints: chain })
}

/// The last link of a row of fixed links without a branch.
fn flange(robot: &Robot, link: LinkId) -> LinkId {
    let mut at = link;
    while let [only] = robot.joints_from(at).collect::<Vec<_>>().as_slice() {
        at = robot.joints[only.0].child;
    }
    at
}

/// Takes name, base and mount link from the smallest group of the SRDF that is this arm: its moving joints are one after the other, at
/// least six, and all on the arm. The parent link of an end effector that the arm carries is the mount link.
fn take_group(robot: &Robot, srdf: &Srdf, arm: &mut ArmGuess) {
    let joints_of = |name: &str| -> Vec<JointId> {
        let all = joints_of_group(srdf, robot, name).into_iter();
        all.filter(|joint| robot.joints[joint.0].coupling.is_none()).collect()
    };
    let groups = srdf.groups.iter().map(|group| (group, joints_of(&group.name)));
    let of_arm = groups
        .filter(|(_, joints)| joints.len() >= MIN_ARM_JOINTS && joints.iter().all(|joint| arm.joints.contains(joint)));
    let Some((group, joints)) = of_arm.min_by_key(|(group, joints)| (joints.len(), group.groups.len())) else { return };
    arm.name.clone_from(&group.name);
    arm.joints.retain(|joint| joints.contains(joint) || robot.joints[joint.0].coupling.is_some());
    let [Some(first), Some(last)] = [arm.joints.first(), arm.joints.last()] else { return };
    let is_carried = |link: LinkId| robot.joints_to(link).contains(last);
    arm.base = robot.joints[first.0].parent;
    if let Some((base, tip)) = group.chains.first() {
        let is_above = robot.joints_to(arm.base).starts_with(&robot.joints_to(*base));
        let moves_between = robot.joints_to(arm.base)
            [robot.joints_to(*base).len().min(robot.joints_to(arm.base).len())..]
            .iter()
            .any(|joint| robot.joints[joint.0].moves());
        if is_above && !moves_between {
            arm.base = *base;
        }
        if is_carried(*tip) {
            arm.mount = *tip;
        }
    }
    if let Some(end) = srdf.end_effectors.iter().find(|end| is_carried(end.parent_link)) {
        arm.mount = end.parent_link;
    }
}

/// Names by side, where joints say it; else by number.
fn name_arms(robot: &Robot, arms: &mut [ArmGuess]) {
    let side_of = |arm: &ArmGuess| {
        let name = robot.joints[arm.joints[0].0].name.to_lowercase();
        let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).collect();
        let has = |side: &&(&str, &[&str])| side.1.iter().any(|word| words.contains(word));
        SIDES.iter().find(has).map(|side| side.0.to_owned())
    };
    let guessed: Vec<Option<String>> = arms.iter().map(side_of).collect();
    let n_arms = arms.len();
    for (k, arm) in arms.iter_mut().enumerate().filter(|(_, arm)| arm.name.is_empty()) {
        let is_alone = guessed.iter().filter(|other| **other == guessed[k]).count() == 1;
        arm.name = match (&guessed[k], n_arms) {
            (Some(side), 2..) if is_alone => side.clone(),
            (_, 1) => "arm".into(),
            _ => format!("arm_{}", k + 1),
        };
    }
}

/// The hand that moves below the mount link of an arm.
fn hand_of(robot: &Robot, arm: &ArmGuess, index: usize) -> Option<HandGuess> {
    let below = robot.joints_to(arm.mount).len();
    let is_below = |joint: &JointId| {
        let path = robot.joints_to(robot.joints[joint.0].parent);
        path.starts_with(&robot.joints_to(arm.mount))
    };
    let moving = (0..robot.joints.len()).map(JointId).filter(|joint| robot.joints[joint.0].moves() && is_below(joint));
    let paths: Vec<Vec<JointId>> = moving.map(|joint| robot.joints_to(robot.joints[joint.0].parent)).collect();
    let first = paths.first()?;
    let n_shared = (below..=first.len())
        .rev()
        .find(|&n| paths.iter().all(|path| path.get(below..n) == Some(&first[below..n])))
        .unwrap_or(below);
    // A hand has to be below the mount link, not on it.
    let last = first.get(n_shared.checked_sub(1)?).filter(|_| n_shared > below)?;
    let moves_alone = first[below..n_shared].iter().any(|joint| robot.joints[joint.0].moves());
    let base = robot.joints[last.0].child;
    (!moves_alone).then(|| HandGuess { name: arm.name.clone(), arm: index, base })
}
