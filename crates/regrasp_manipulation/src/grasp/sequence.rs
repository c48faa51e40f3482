//! Points of GS_n and GS_k: an object pose, the contacts of the fingers that hold, the joints of all; and the motions
//! between them.

use crate::grasp::state::{GraspState, Moment};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::ops::{Range, RangeInclusive};

/// A feasible elementary motion (Saut 2011, sec. 3.2).
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// The object moves, every finger keeps its contact or rolls; fingers that are free may move. Moments after the start,
    /// the last one being the end.
    Transfer(Vec<Moment>),
    /// One finger moves to another contact or posture. Its joints after the start, the last ones being there.
    Regrasp {
        /// Which finger.
        finger: usize,
        /// Its joints.
        path: Vec<Coordinates>,
    },
}

/// A motion and the state it ends in.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    motion: Motion,
    end: GraspState,
}

impl Step {
    /// The motion.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Where it ends.
    pub fn end(&self) -> &GraspState {
        &self.end
    }
}

/// Motions, each of which begins in exactly the state that the one before ends in.
///
/// Only this module puts steps together, so no other sequence can be made: where a motion ends is read off its own last
/// joints and pose, and two sequences are joined only where they meet to the last bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    start: GraspState,
    steps: Vec<Step>,
}

impl Sequence {
    /// No motion yet.
    pub fn at(start: GraspState) -> Self {
        Sequence { start, steps: Vec::new() }
    }

    /// Where the first motion begins.
    pub fn start(&self) -> &GraspState {
        &self.start
    }

    /// Where the last motion ends.
    pub fn end(&self) -> &GraspState {
        self.state_before(self.steps.len())
    }

    /// The motions.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The state in which the motion `index` begins.
    pub fn state_before(&self, index: usize) -> &GraspState {
        if index == 0 { &self.start } else { &self.steps[index - 1].end }
    }

    /// The motions `range` by themselves.
    pub fn part(&self, range: Range<usize>) -> Sequence {
        Sequence { start: self.state_before(range.start).clone(), steps: self.steps[range].to_vec() }
    }

    /// Appends a transfer through `moments`, if there are any.
    pub fn push_transfer(&mut self, moments: Vec<Moment>) {
        let Some(last) = moments.last() else { return };
        let end = GraspState {
            world_from_object: last.world_from_object,
            holding: self.end().holding,
            contacts: last.contacts.clone(),
            joints: last.joints.clone(),
        };
        self.steps.push(Step { motion: Motion::Transfer(moments), end });
    }

    /// As [`Sequence::push_transfer`], but a transfer that is the last motion goes on.
    fn go_on(&mut self, moments: impl IntoIterator<Item = Moment>) {
        let Some(Step { motion: Motion::Transfer(before), end }) = self.steps.last_mut() else {
            return self.push_transfer(moments.into_iter().collect());
        };
        before.extend(moments);
        if let Some(last) = before.last() {
            end.world_from_object = last.world_from_object;
            end.joints.clone_from(&last.joints);
            end.contacts.clone_from(&last.contacts);
        }
    }

    /// Appends the motion of `finger` along `path` to `contact`, or to be free, if the path has any joints.
    pub fn push_regrasp(&mut self, finger: usize, contact: Option<Contact>, path: Vec<Coordinates>) {
        let Some(last) = path.last() else { return };
        let mut end = self.end().clone();
        end.set_contact(finger, contact);
        end.joints[finger].clone_from(last);
        self.steps.push(Step { motion: Motion::Regrasp { finger, path }, end });
    }

    /// Takes the last motion off if it is a transfer: its moments.
    pub fn pop_transfer(&mut self) -> Option<Vec<Moment>> {
        match self.steps.pop()? {
            Step { motion: Motion::Transfer(moments), .. } => Some(moments),
            regrasp => {
                self.steps.push(regrasp);
                None
            }
        }
    }

    /// This sequence, then `next`; None unless `next` begins in exactly the state that this one ends in.
    pub fn then(mut self, next: Sequence) -> Option<Sequence> {
        (*self.end() == next.start).then(|| {
            self.steps.extend(next.steps);
            self
        })
    }

    /// Puts `detour` in place of the motions `range`; false, and nothing done, unless it begins in exactly the state that
    /// they begin in and, where others follow, ends in exactly the one that they end in.
    pub fn replace(&mut self, range: RangeInclusive<usize>, detour: Sequence) -> bool {
        let meets_before = *self.state_before(*range.start()) == detour.start;
        let is_tail = range.end() + 1 == self.steps.len();
        let fits = meets_before && (is_tail || self.steps[*range.end()].end == *detour.end());
        if fits {
            self.steps.splice(range, detour.steps);
        }
        fits
    }

    /// One transfer in place of each run of transfers: the same motion in fewer segments.
    pub fn with_transfers_joined(self) -> Sequence {
        let mut joined = Sequence::at(self.start);
        for step in self.steps {
            match step.motion {
                Motion::Transfer(moments) => joined.go_on(moments),
                motion @ Motion::Regrasp { .. } => joined.steps.push(Step { motion, end: step.end }),
            }
        }
        joined
    }

    /// The same motions gone backwards, from the end to the start.
    pub fn reversed(&self) -> Sequence {
        let backwards = |index: usize| {
            let before = self.state_before(index);
            let motion = match &self.steps[index].motion {
                Motion::Transfer(moments) => {
                    let mut back: Vec<Moment> = moments[..moments.len() - 1].iter().rev().cloned().collect();
                    back.push(before.moment());
                    Motion::Transfer(back)
                }
                Motion::Regrasp { finger, path } => {
                    let mut back: Vec<_> = path[..path.len() - 1].iter().rev().cloned().collect();
                    back.push(before.joints[*finger].clone());
                    Motion::Regrasp { finger: *finger, path: back }
                }
            };
            Step { motion, end: before.clone() }
        };
        Sequence { start: self.end().clone(), steps: (0..self.steps.len()).rev().map(backwards).collect() }
    }
}
