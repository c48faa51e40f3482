//! Which part each link and joint belongs to, and which links are neighbours.

use super::layout::Part;
use super::{Arm, MountedHand};
use crate::robot::{Joint, JointId, LinkId, Robot};
use std::collections::{BTreeMap, BTreeSet};

/// The parts of all links and joints of a robot.
#[derive(Debug, Clone)]
pub struct Owners {
    /// By link.
    pub of_links: Vec<Part>,
    /// By joint: the part of the link that it carries, or of what carries the hand that it moves as a whole.
    pub of_joints: Vec<Part>,
}

impl Owners {
    /// A link below the first link of a hand is the hand's, else one that a joint of an arm's chain moves is the arm's. All
    /// others are common.
    pub fn of(robot: &Robot, arms: &[Arm], hands: &[MountedHand]) -> Self {
        let mut arm_of_joint: BTreeMap<JointId, usize> = BTreeMap::new();
        for (index, arm) in arms.iter().enumerate() {
            let base_path = robot.joints_to(arm.base);
            let path = robot.joints_to(arm.mount);
            let own = path.iter().skip(base_path.len()).filter(|joint| robot.joints[joint.0].moves());
            arm_of_joint.extend(own.map(|&joint| (joint, index)));
        }
        let hand_of_top: BTreeMap<LinkId, usize> =
            hands.iter().enumerate().map(|(index, hand)| (hand.top, index)).collect();
        let part_below = |above: Part, joint: Option<JointId>, link: LinkId| {
            let by_arm = joint.and_then(|joint| arm_of_joint.get(&joint)).map(|&arm| Part::Arm(arm));
            hand_of_top.get(&link).map(|&hand| Part::Hand(hand)).or(by_arm).unwrap_or(above)
        };
        let mut of_links = vec![Part::Common; robot.links.len()];
        of_links[robot.root.0] = part_below(Part::Common, None, robot.root);
        let mut waiting = vec![robot.root];
        while let Some(link) = waiting.pop() {
            for joint in robot.joints_from(link) {
                let child = robot.joints[joint.0].child;
                of_links[child.0] = part_below(of_links[link.0], Some(joint), child);
                waiting.push(child);
            }
        }
        let of_joint = |(index, joint): (usize, &Joint)| {
            // What moves a hand as a whole belongs to what carries it.
            let by_arm = arm_of_joint.get(&JointId(index)).map(|&arm| Part::Arm(arm));
            let carries_hand = hand_of_top.contains_key(&joint.child);
            by_arm.unwrap_or(of_links[if carries_hand { joint.parent.0 } else { joint.child.0 }])
        };
        let of_joints = robot.joints.iter().enumerate().map(of_joint).collect();
        Owners { of_links, of_joints }
    }
}

/// Pairs of links of one rigid body, and of bodies that follow each other with nothing but bodies without shapes between.
///
/// Of the body above, those links count that belong to the part that the joint stands on or leads to: the fingers of one hand are
/// no neighbours of the palm of another, even where nothing moves the two palms against each other.
pub fn adjacent_pairs(robot: &Robot, owners: &Owners) -> BTreeSet<(LinkId, LinkId)> {
    // The body of a link: the link that the last moving joint on the way to it carries.
    let body_of = |link: LinkId| {
        let mut at = link;
        while let Some(joint) = robot.links[at.0].parent_joint.filter(|joint| !robot.joints[joint.0].moves()) {
            at = robot.joints[joint.0].parent;
        }
        at
    };
    let mut links_of: BTreeMap<LinkId, Vec<LinkId>> = BTreeMap::new();
    for link in (0..robot.links.len()).map(LinkId).filter(|link| !robot.links[link.0].collision.is_empty()) {
        links_of.entry(body_of(link)).or_default().push(link);
    }
    let mut pairs = BTreeSet::new();
    for (&body, links) in &links_of {
        let mut stands_on = robot.links[body.0].parent_joint.map(|joint| robot.joints[joint.0].parent);
        while let Some(link) = stands_on.filter(|&link| !links_of.contains_key(&body_of(link))) {
            stands_on = robot.links[body_of(link).0].parent_joint.map(|joint| robot.joints[joint.0].parent);
        }
        for (k, &link) in links.iter().enumerate() {
            let part = owners.of_links[link.0];
            let above = stands_on.map_or(&[][..], |other| &links_of[&body_of(other)]);
            let is_near = |other: &LinkId| {
                let of_other = owners.of_links[other.0];
                of_other == part || stands_on.is_some_and(|stands_on| owners.of_links[stands_on.0] == of_other)
            };
            let neighbours = above.iter().copied().filter(is_near).chain(links[..k].iter().copied());
            pairs.extend(neighbours.map(|other| (link.min(other), link.max(other))));
        }
    }
    pairs
}

/// The first link on the way to `base` behind the last moving joint, or behind link `mount` where that comes later.
pub(crate) fn top_of(robot: &Robot, base: LinkId, mount: Option<LinkId>) -> LinkId {
    let mut top = base;
    while let Some(joint) = robot.links[top.0].parent_joint.map(|joint| &robot.joints[joint.0]) {
        if joint.moves() || mount == Some(joint.parent) {
            break;
        }
        top = joint.parent;
    }
    top
}
