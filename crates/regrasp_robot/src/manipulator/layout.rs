//! The coordinates of a manipulator: order, names, limits, rest values.
//!
//! The order is: common part, then each arm followed by the hands that it carries, then hands that no arm carries. Inside an arm
//! the chain comes first, inside a hand the fingers in the order of [`crate::Hand::joint_names`]; other joints of the part follow
//! in the order of the robot.

use super::{Arm, MountedHand, NoPosture};
use crate::coupling::{Coupling, LinearLimit, TIE_WIDTH, Terms, bring_within, limit_leaders};
use crate::hand::Tie;
use crate::robot::{JointId, Robot};
use std::collections::BTreeMap;
use std::ops::Range;

/// A part of a manipulator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// What carries the arms.
    Common,
    /// An arm, by its index.
    Arm(usize),
    /// A hand, by its index.
    Hand(usize),
}

/// An independent joint of a manipulator.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name of the joint.
    pub name: String,
    /// The joint.
    pub joint: JointId,
    /// The part that it belongs to.
    pub part: Part,
    /// Lowest value, couplings with one leader included; minus infinity for continuous joints.
    pub lower: f64,
    /// Highest value.
    pub upper: f64,
    /// Value where nothing else is asked: the rest posture of fingers, the home posture of arms.
    pub rest: f64,
    /// Largest acceleration, in radians or metres per second squared, where the robot file states one.
    pub acceleration: Option<f64>,
}

/// The coordinates of a manipulator.
#[derive(Debug, Clone, PartialEq)]
pub struct JointLayout {
    /// In the order of states.
    pub coordinates: Vec<Coordinate>,
    /// Limits of joints that follow several coordinates at once; and of coordinates that follow others, narrow ones
    /// ([`JointLayout::ties`]).
    pub linear_limits: Vec<LinearLimit>,
    /// Coordinates that follow others: joints of fingers that share a motor with another finger ([`crate::hand::Tie`]).
    pub ties: Vec<(usize, Coupling<usize>)>,
}

/// A coordinate that follows others may be this far off, in radians or metres: rounding.
pub const TIE_ROUNDING: f64 = 0.5 * TIE_WIDTH;

/// The parts in the order of states, each with the joints that come first in it.
pub(super) fn order(arms: &[Arm], hands: &[MountedHand]) -> Vec<(Part, Vec<String>)> {
    let mut parts = vec![(Part::Common, Vec::new())];
    let fingers = |hand: &MountedHand| hand.hand.joint_names();
    let hands_on = |arm: Option<usize>| {
        let of_arm = hands.iter().enumerate().filter(move |(_, hand)| hand.arm == arm);
        of_arm.map(|(index, hand)| (Part::Hand(index), fingers(hand)))
    };
    for (index, arm) in arms.iter().enumerate() {
        parts.push((Part::Arm(index), arm.chain.names.clone()));
        parts.extend(hands_on(Some(index)));
    }
    parts.extend(hands_on(None));
    parts
}

impl JointLayout {
    /// The coordinates of `robot`: in each part the joints named first, then the others. `rest` has rest values by name of joint.
    pub(super) fn new(
        robot: &Robot,
        part_of_joint: &[Part],
        order: Vec<(Part, Vec<String>)>,
        ties: &[&Tie],
        rest: &BTreeMap<String, f64>,
    ) -> Result<Self, NoPosture> {
        let mut coordinates = Vec::new();
        for (part, first) in order {
            let named = first.iter().filter_map(|name| robot.joint_named(name));
            let joints: Vec<JointId> = named.collect();
            let is_other = |joint: &JointId| part_of_joint[joint.0] == part && !joints.contains(joint);
            let others = (0..robot.joints.len()).map(JointId).filter(is_other);
            for id in joints.iter().copied().chain(others) {
                let joint = &robot.joints[id.0];
                if !joint.moves() || joint.coupling.is_some() {
                    continue;
                }
                let [lower, upper] =
                    joint.limits.map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| [limits.lower, limits.upper]);
                coordinates.push(Coordinate {
                    name: joint.name.clone(),
                    joint: id,
                    part,
                    lower,
                    upper,
                    rest: 0.0,
                    acceleration: None,
                });
            }
        }
        let mut layout = JointLayout { coordinates, linear_limits: Vec::new(), ties: Vec::new() };
        layout.limit(robot);
        layout.tie(ties);
        layout.set_rest(rest)?;
        Ok(layout)
    }

    /// Takes the limits of followers over to their leaders.
    fn limit(&mut self, robot: &Robot) {
        let mut lower: Vec<f64> = self.coordinates.iter().map(|c| c.lower).collect();
        let mut upper: Vec<f64> = self.coordinates.iter().map(|c| c.upper).collect();
        let mut linear = Vec::new();
        for (index, joint) in robot.joints.iter().enumerate() {
            if let (Some(_), Some(limits), Some(drive)) = (&joint.coupling, joint.limits, self.drive_of(robot, index)) {
                let own = [limits.lower, limits.upper];
                linear.extend(limit_leaders(&joint.name, &drive, own, (&mut lower, &mut upper)));
            }
        }
        for (coordinate, (lower, upper)) in self.coordinates.iter_mut().zip(lower.into_iter().zip(upper)) {
            (coordinate.lower, coordinate.upper) = (lower, upper);
        }
        self.linear_limits = linear;
    }

    /// Takes over what follows what. Ties with more leaders than a limit has terms are kept by whoever moves the hand.
    fn tie(&mut self, ties: &[&Tie]) {
        let place = |layout: &Self, joint: JointId| layout.coordinates.iter().position(|c| c.joint == joint);
        for tie in ties {
            let follower = place(self, tie.follower);
            let coupling = tie.coupling.renamed(|leader| place(self, leader));
            let (Some(follower), Some(coupling)) = (follower, coupling) else { continue };
            let mut terms = Terms::from_iter([(follower, 1.0)]);
            let leaders = coupling.terms.iter().map(|&(leader, multiplier)| (leader, -multiplier));
            if leaders.map(|term| terms.try_push(term)).all(|pushed| pushed.is_ok()) {
                self.linear_limits.push(LinearLimit {
                    joint: self.coordinates[follower].name.clone(),
                    terms,
                    lower: coupling.offset - TIE_ROUNDING,
                    upper: coupling.offset + TIE_ROUNDING,
                });
            }
            self.ties.push((follower, coupling));
        }
    }

    /// Brings the coordinates that follow others to where these have them.
    pub fn settle_ties(&self, state: &mut [f64]) {
        for (follower, coupling) in &self.ties {
            state[*follower] = coupling.position(|leader| state[leader]);
        }
    }

    fn set_rest(&mut self, rest: &BTreeMap<String, f64>) -> Result<(), NoPosture> {
        for coordinate in &mut self.coordinates {
            if coordinate.lower > coordinate.upper {
                return Err(NoPosture { joint: coordinate.name.clone() });
            }
            let stated = rest.get(&coordinate.name).copied();
            coordinate.rest = stated.unwrap_or_else(|| 0f64.clamp(coordinate.lower, coordinate.upper));
        }
        if self.linear_limits.iter().all(|limit| limit.room(&self.rest()) >= 0.0) {
            return Ok(());
        }
        let [lower, upper] = self.limits();
        let brought = bring_within(&self.linear_limits, [&lower, &upper], &self.rest());
        let kept = brought.ok_or_else(|| NoPosture { joint: self.linear_limits[0].joint.clone() })?;
        for (coordinate, kept) in self.coordinates.iter_mut().zip(kept) {
            coordinate.rest = kept;
        }
        Ok(())
    }

    /// Lowest and highest values.
    pub fn limits(&self) -> [Vec<f64>; 2] {
        [self.coordinates.iter().map(|c| c.lower).collect(), self.coordinates.iter().map(|c| c.upper).collect()]
    }

    /// Names, in the order of states.
    pub fn names(&self) -> Vec<String> {
        self.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect()
    }

    /// The state in which everything rests.
    pub fn rest(&self) -> Vec<f64> {
        self.coordinates.iter().map(|coordinate| coordinate.rest).collect()
    }

    /// Number of coordinates.
    pub fn len(&self) -> usize {
        self.coordinates.len()
    }

    /// True when nothing moves.
    pub fn is_empty(&self) -> bool {
        self.coordinates.is_empty()
    }

    /// Where the coordinates of a part stand in a state.
    pub fn range(&self, part: Part) -> Range<usize> {
        let is_own = |coordinate: &Coordinate| coordinate.part == part;
        let Some(start) = self.coordinates.iter().position(is_own) else { return 0..0 };
        start..start + self.coordinates[start..].iter().take_while(|coordinate| is_own(coordinate)).count()
    }

    /// Index of the coordinate called `name`.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.coordinates.iter().position(|coordinate| coordinate.name == name)
    }

    /// The coordinates that drive joint `joint` of `robot`: its own, or its leaders'. None for a joint that does not move.
    pub fn drive_of(&self, robot: &Robot, joint: usize) -> Option<Coupling<usize>> {
        let of_robot = &robot.joints[joint];
        if !of_robot.moves() {
            return None;
        }
        let own = of_robot.coupling.clone().unwrap_or_else(|| Coupling::independent(JointId(joint)));
        own.renamed(|leader| self.coordinates.iter().position(|coordinate| coordinate.joint == leader))
    }

    /// True when every coordinate of `state` can move by `margin` and all limits, those of sums too, are kept.
    pub fn within_limits(&self, state: &[f64], margin: f64) -> bool {
        let own = self.coordinates.iter().zip(state);
        own.into_iter().all(|(c, &q)| q >= c.lower + margin && q <= c.upper - margin)
            && self.linear_limits.iter().all(|limit| limit.room(state) >= margin)
    }
}
