//! A manipulator: one tree of links with a common part, arms, and hands on arms or in the world.
//!
//! All joints that move are coordinates of its state, those that belong to no finger and no arm among them. A hand alone is a
//! manipulator without arms.

/// Forward kinematics of all links.
mod kinematics;
/// The order, names and limits of coordinates.
pub mod layout;
/// Which part each link and joint belongs to, and which links never meet.
mod parts;

use crate::hand::{Hand, Tie};
use crate::kinematics::chain::Chain;
use crate::robot::{LinkId, Robot};
use kinematics::TreeKinematics;
use layout::{JointLayout, Part};
use regrasp_geometry::Pose;
use regrasp_geometry::shape::PlacedShape;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

pub(crate) use parts::top_of;
pub use parts::{Owners, adjacent_pairs};

/// A collision shape of a link.
#[derive(Debug, Clone)]
pub struct LinkShape {
    /// The link.
    pub link: LinkId,
    /// The shape, placed in the frame of the link. Convex.
    pub placed: PlacedShape,
}

/// An arm: a serial chain that carries a mount link.
#[derive(Debug, Clone)]
pub struct Arm {
    /// Name, unique among the arms.
    pub name: String,
    /// The link whose frame is the base frame of the chain. Joints above it are common.
    pub base: LinkId,
    /// The chain from the base link to the last moving body before the mount link.
    pub chain: Chain,
    /// The link that hands are mounted on.
    pub mount: LinkId,
    /// Pose of the mount link in the frame of the chain's last body.
    pub last_from_mount: Pose,
    /// Collision shapes of the links that the arm's joints move, hands excepted.
    pub shapes: Vec<LinkShape>,
    /// Posture in which the arm waits: one value per coordinate of the chain.
    pub home: Vec<f64>,
}

/// A hand and what carries it.
#[derive(Debug, Clone)]
pub struct MountedHand {
    /// Name, unique among the hands.
    pub name: String,
    /// The hand, in the frame of its base. Its links are those of [`Manipulator::robot`].
    pub hand: Hand,
    /// Index of the arm that carries it. None for a hand on the common part.
    pub arm: Option<usize>,
    /// The first link of the hand: the one that carries its base without a moving joint between. Every link below is the hand's.
    pub top: LinkId,
    /// The hand file. None for a hand that is a manipulator by itself.
    pub file: Option<PathBuf>,
}

/// The links of a manipulator that belong to neither an arm nor a hand.
#[derive(Debug, Clone, Default)]
pub struct CommonPart {
    /// Their collision shapes.
    pub shapes: Vec<LinkShape>,
}

/// What a scene plans with. Never changes after loading; the state is a vector of the layout's coordinates.
#[derive(Debug, Clone)]
pub struct Manipulator {
    /// Name.
    pub name: String,
    /// All links and joints in one tree.
    pub robot: Arc<Robot>,
    /// Names, order, limits and rest values of the coordinates.
    pub layout: JointLayout,
    /// What carries the arms.
    pub common: CommonPart,
    /// Arms, in the order of the file.
    pub arms: Vec<Arm>,
    /// Hands, in the order of the file.
    pub hands: Vec<MountedHand>,
    /// Pairs of links (smaller index first) that are never tested against each other.
    pub allowed_pairs: BTreeSet<(LinkId, LinkId)>,
    /// Joints of its models that stand still, by name, and their positions in radians or metres; in `robot` they are fixed.
    pub held_joints: BTreeMap<String, f64>,
    /// Where the root of the tree stands.
    world_from_root: Pose,
    /// The part of each link.
    part_of_link: Vec<Part>,
    /// Poses of hands that no joint moves, exactly as stated.
    fixed_hands: Vec<Option<Pose>>,
    tree: TreeKinematics,
}

/// Arms, hands and shapes of a manipulator to be made; see [`Manipulator::new`].
#[derive(Debug, Clone, Default)]
pub struct Parts {
    /// Arms.
    pub arms: Vec<Arm>,
    /// Hands.
    pub hands: Vec<MountedHand>,
    /// What carries them.
    pub common: CommonPart,
    /// Pairs of links that are never tested, besides neighbours and those of the hands.
    pub allow: BTreeSet<(LinkId, LinkId)>,
    /// Joints that stand still, by name, and their positions.
    pub held: BTreeMap<String, f64>,
    /// Rest positions of joints on no finger and no arm, by name; the allowed position nearest to zero without one.
    pub rest: BTreeMap<String, f64>,
    /// How fast joints may speed up.
    pub accelerations: Accelerations,
}

/// Largest accelerations, in radians or metres per second squared.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Accelerations {
    /// Of joints that are not named.
    pub default: Option<f64>,
    /// By name of joint.
    pub own: BTreeMap<String, f64>,
}

/// Limits of joints that cannot be met all at once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoPosture {
    /// A joint that has no position, or whose followers leave it none.
    pub joint: String,
}

impl Manipulator {
    /// The manipulator that `parts` make of `robot`, whose root stands at the world's origin.
    ///
    /// Errors: limits of joints that leave no posture.
    pub fn new(name: String, robot: Arc<Robot>, parts: Parts) -> Result<Self, NoPosture> {
        let Parts { arms, hands, common, allow, held, rest, accelerations } = parts;
        let owners = Owners::of(&robot, &arms, &hands);
        let mut posture = rest;
        for arm in &arms {
            posture.extend(arm.chain.names.iter().cloned().zip(arm.home.iter().copied()));
        }
        for hand in &hands {
            let fingers = hand.hand.fingers.iter();
            posture.extend(fingers.flat_map(|f| f.chain.names.iter().cloned().zip(f.rest.iter().copied())));
        }
        let order = layout::order(&arms, &hands);
        let ties: Vec<&Tie> = hands.iter().flat_map(|hand| &hand.hand.ties).collect();
        let mut layout = JointLayout::new(&robot, &owners.of_joints, order, &ties, &posture)?;
        for coordinate in &mut layout.coordinates {
            coordinate.acceleration = accelerations.own.get(&coordinate.name).copied().or(accelerations.default);
        }
        let mut allowed_pairs = allow;
        allowed_pairs.extend(hands.iter().flat_map(|hand| hand.hand.allowed_pairs.iter().copied()));
        allowed_pairs.extend(adjacent_pairs(&robot, &owners));
        let tree = TreeKinematics::new(&robot, &layout);
        let mut manipulator = Manipulator {
            name,
            robot,
            layout,
            common,
            arms,
            hands,
            allowed_pairs,
            held_joints: held,
            world_from_root: Pose::identity(),
            part_of_link: owners.of_links,
            fixed_hands: Vec::new(),
            tree,
        };
        manipulator.fix_hands();
        Ok(manipulator)
    }

    /// A hand alone, with its base at `world_from_hand` while joints above the base rest. Those, and joints of the hand on no
    /// finger, are coordinates too.
    ///
    /// Errors: limits of joints that leave no posture.
    pub fn of_hand(name: String, hand: Hand, world_from_hand: &Pose) -> Result<Self, NoPosture> {
        let robot = hand.robot.clone();
        let top = parts::top_of(&robot, hand.base, None);
        let base = hand.base;
        let hands = vec![MountedHand { name: name.clone(), hand, arm: None, top, file: None }];
        let mut manipulator = Manipulator::new(name, robot, Parts { hands, ..Parts::default() })?;
        let rest = manipulator.layout.rest();
        let root_from_hand = manipulator.tree.root_from_link(base, &rest);
        manipulator.world_from_root = world_from_hand * root_from_hand.inverse();
        manipulator.fix_hands();
        if let Some(fixed) = &mut manipulator.fixed_hands[0] {
            // The pose as it was given, not as it comes back from the root.
            *fixed = *world_from_hand;
        }
        Ok(manipulator)
    }

    /// The same manipulator with its root at `world_from_root`.
    #[must_use]
    pub fn placed_at(mut self, world_from_root: Pose) -> Self {
        self.world_from_root = world_from_root;
        self.fix_hands();
        self
    }

    /// Where the root of the tree stands in the world.
    pub fn world_from_root(&self) -> &Pose {
        &self.world_from_root
    }

    fn fix_hands(&mut self) {
        let rest = self.layout.rest();
        let fixed = |hand: &MountedHand| {
            let is_fixed = self.tree.coordinates_above(hand.hand.base).is_empty();
            is_fixed.then(|| self.world_from_root * self.tree.root_from_link(hand.hand.base, &rest))
        };
        self.fixed_hands = self.hands.iter().map(fixed).collect();
    }

    /// Where the base of hand `hand` stands in the world in a state.
    ///
    /// Panics unless the state has one value per coordinate.
    pub fn world_from_hand(&self, hand: usize, state: &[f64]) -> Pose {
        match &self.fixed_hands[hand] {
            Some(fixed) => *fixed,
            None => self.world_from_root * self.tree.root_from_link(self.hands[hand].hand.base, state),
        }
    }

    /// Poses of all links in the world in a state, by link id, written to `world_from_link`.
    ///
    /// Panics unless the state has one value per coordinate.
    pub fn link_poses(&self, state: &[f64], world_from_link: &mut Vec<Pose>) {
        self.tree.link_poses(&self.world_from_root, state, world_from_link);
    }

    /// The coordinates that move `link`, by index in the state, in rising order.
    pub fn coordinates_above(&self, link: LinkId) -> Vec<usize> {
        self.tree.coordinates_above(link)
    }

    /// The part that a link belongs to.
    pub fn part_of(&self, link: LinkId) -> Part {
        self.part_of_link[link.0]
    }

    /// The values of the fingers of hand `hand`, in the order of [`Hand::joint_names`].
    pub fn finger_joints<'s>(&self, hand: usize, state: &'s [f64]) -> &'s [f64] {
        let range = self.layout.range(Part::Hand(hand));
        &state[range.start..range.start + self.hands[hand].hand.n_joints()]
    }

    /// The values of the chain of arm `arm`.
    pub fn arm_joints<'s>(&self, arm: usize, state: &'s [f64]) -> &'s [f64] {
        let range = self.layout.range(Part::Arm(arm));
        &state[range.start..range.start + self.arms[arm].chain.n_coordinates()]
    }

    /// True when the joints of hand `hand` on no finger are at rest, where its chains and palm are made for.
    pub fn is_hand_as_made(&self, hand: usize, state: &[f64]) -> bool {
        let range = self.layout.range(Part::Hand(hand));
        let others = range.start + self.hands[hand].hand.n_joints()..range.end;
        others.into_iter().all(|k| state[k] == self.layout.coordinates[k].rest)
    }

    /// True when links `a` and `b` are never tested against each other.
    pub fn may_touch(&self, a: LinkId, b: LinkId) -> bool {
        a == b || self.allowed_pairs.contains(&(a.min(b), a.max(b)))
    }

    /// Index of the hand called `name`.
    pub fn hand_named(&self, name: &str) -> Option<usize> {
        self.hands.iter().position(|hand| hand.name == name)
    }

    /// Index of the arm called `name`.
    pub fn arm_named(&self, name: &str) -> Option<usize> {
        self.arms.iter().position(|arm| arm.name == name)
    }
}
