//! Who holds the object in each segment, as the plan says it, and which orders of kinds and holders a plan may have. Whether the plan
//! tells the truth is judged by geometry in `room` and `contacts`.
//!
//! - In every segment somebody holds the object. The first and the last segment are of one support alone.
//! - Between two segments one holder joins or leaves, never more.
//! - A hand joins at the end of its `grasp`, and leaves at the begin of its `release`.
//! - `transit`: one support holds. `carry`: a hand does. `transfer`, `regrasp`: one hand alone, and the segments beside have the same holder.

use crate::check::Log;
use crate::check::tasks::task::Task;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::robot_plan::{RobotPlan, RobotSegmentKind};
use std::collections::BTreeSet;

/// Who holds an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Holder {
    /// A hand, by its index in [`Task::hands`].
    Hand(usize),
    /// A support, by its index in `Scene::supports`.
    Support(usize),
}

impl Holder {
    /// Its name.
    pub fn name<'a>(self, task: &'a Task) -> &'a str {
        match self {
            Holder::Hand(hand) => &task.hands[hand].name,
            Holder::Support(support) => &task.scene.supports[support].body.name,
        }
    }
}

/// What a segment does with the object.
pub struct Phase {
    /// Its kind.
    pub kind: RobotSegmentKind,
    /// Who holds the object all through.
    pub holders: BTreeSet<Holder>,
    /// The hand that closes or opens.
    pub closing: Option<usize>,
}

impl Phase {
    /// Hands that hold.
    pub fn hands(&self) -> impl Iterator<Item = usize> + '_ {
        self.holders.iter().filter_map(|holder| if let Holder::Hand(hand) = holder { Some(*hand) } else { None })
    }

    /// Supports that hold.
    pub fn supports(&self) -> impl Iterator<Item = usize> + '_ {
        self.holders.iter().filter_map(|holder| if let Holder::Support(index) = holder { Some(*index) } else { None })
    }

    /// True where this hand holds.
    pub fn has_hand(&self, hand: usize) -> bool {
        self.holders.contains(&Holder::Hand(hand))
    }

    /// The hand in which the object moves, or that changes its grasp.
    pub fn moves_in(&self) -> Option<usize> {
        self.hands().next().filter(|_| self.kind.is_in_hand() && self.holders.len() == 1)
    }

    /// The hand that carries the object, where it may move.
    pub fn carrier(&self) -> Option<usize> {
        let is_alone = self.kind == RobotSegmentKind::Carry && self.holders.len() == 1;
        self.hands().next().filter(|_| is_alone)
    }
}

fn wrong(message: String, s: usize) -> Violation {
    Violation::new(Kind::WrongHolder, message).when(Moment::at(s, 0))
}

/// Reads who holds; None, and violations, where names are unknown or nobody holds: nothing else can be judged then.
pub fn read_phases(task: &Task, plan: &RobotPlan, log: &mut Log) -> Option<Vec<Phase>> {
    let object = &plan.objects[0];
    let mut phases: Vec<Phase> = Vec::new();
    for (s, segment) in plan.segments.iter().enumerate() {
        for name in segment.held_by.keys().filter(|name| *name != object) {
            let message = format!("somebody holds \"{name}\", which the plan does not move");
            log.push(wrong(message, s).subjects([name.as_str()]));
        }
        let names = segment.held_by.get(object).map_or(&[][..], Vec::as_slice);
        let mut holders = BTreeSet::new();
        for name in names {
            let hand = task.hand_named(name).map(Holder::Hand);
            match hand.or_else(|| task.support_named(name).map(Holder::Support)) {
                Some(holder) if holders.insert(holder) => {}
                Some(_) => log.push(wrong(format!("\"{name}\" holds \"{object}\" twice"), s).subjects([name.as_str()])),
                None => {
                    let message = format!("\"{name}\" is neither a hand of the robot nor a support");
                    log.push(wrong(message, s).subjects([name.as_str()]));
                    return None;
                }
            }
        }
        if holders.is_empty() {
            log.push(wrong(format!("nobody holds \"{object}\""), s).subjects([object.as_str()]));
            return None;
        }
        phases.push(Phase { kind: segment.kind, holders, closing: None });
    }
    for s in 0..phases.len() {
        let beside = match phases[s].kind {
            RobotSegmentKind::Grasp => phases.get(s + 1),
            RobotSegmentKind::Release => s.checked_sub(1).map(|before| &phases[before]),
            _ => None,
        };
        let closing = beside.and_then(|beside| beside.hands().find(|hand| !phases[s].has_hand(*hand)));
        phases[s].closing = closing;
    }
    Some(phases)
}

/// Kinds and order of the segments.
pub fn check_order(task: &Task, phases: &[Phase], log: &mut Log) {
    for (s, phase) in phases.iter().enumerate() {
        let (n_hands, n_supports) = (phase.hands().count(), phase.supports().count());
        let fault = match phase.kind {
            RobotSegmentKind::Transit if n_hands > 0 || n_supports != 1 => {
                Some("in a transit one support holds the object, and no hand")
            }
            RobotSegmentKind::Transfer | RobotSegmentKind::Regrasp if n_hands != 1 || n_supports > 0 => {
                Some("in a transfer or regrasp one hand holds the object, and no support")
            }
            RobotSegmentKind::Carry if n_hands == 0 => Some("in a carry a hand holds the object"),
            RobotSegmentKind::Grasp if phase.closing.is_none() => Some("no hand joins those that hold after the grasp"),
            RobotSegmentKind::Release if phase.closing.is_none() => {
                Some("no hand has left those that held before the release")
            }
            _ => None,
        };
        let two = (n_supports > 1).then_some("two supports hold the object; only one can be judged");
        for fault in fault.into_iter().chain(two) {
            log.push(wrong(fault.into(), s));
        }
    }
    for (s, pair) in phases.windows(2).enumerate() {
        let (before, after) = (&pair[0], &pair[1]);
        let joins: Vec<Holder> = after.holders.difference(&before.holders).copied().collect();
        let leaves: Vec<Holder> = before.holders.difference(&after.holders).copied().collect();
        if joins.len() + leaves.len() > 1 {
            let names: Vec<&str> = joins.iter().chain(&leaves).map(|holder| holder.name(task)).collect();
            let message = format!("more than one holder joins or leaves at once: {}", names.join(", "));
            log.push(wrong(message, s + 1).subjects(names));
        }
        let is_in_hand = before.kind.is_in_hand() || after.kind.is_in_hand();
        if is_in_hand && before.holders != after.holders {
            let message = "a holder joins or leaves beside a transfer or regrasp; a carry has to be between";
            log.push(wrong(message.into(), s + 1));
        }
        let is_hand = |holder: &&Holder| matches!(holder, Holder::Hand(_));
        if let Some(hand) = joins.iter().find(is_hand).filter(|_| before.kind != RobotSegmentKind::Grasp) {
            let message = format!("\"{}\" holds, and did not grasp before", hand.name(task));
            log.push(wrong(message, s + 1).subjects([hand.name(task)]));
        }
        if let Some(hand) = leaves.iter().find(is_hand).filter(|_| after.kind != RobotSegmentKind::Release) {
            let message = format!("\"{}\" no longer holds, and does not release", hand.name(task));
            log.push(wrong(message, s + 1).subjects([hand.name(task)]));
        }
    }
    for s in [0, phases.len() - 1] {
        if phases[s].hands().next().is_some() || phases[s].supports().count() != 1 {
            let when = if s == 0 { "starts" } else { "ends" };
            log.push(wrong(format!("the plan {when} with an object that no support holds alone"), s));
        }
    }
}
