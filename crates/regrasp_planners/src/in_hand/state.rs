//! Points of GS_n: an object pose and n contacts, with the joints that reach them; and the motions between them.

use super::workspace::{Contacts, HandJoints};
use regrasp_geometry::Pose;
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::ops::RangeInclusive;

/// All fingers hold the object (a configuration in GS_n; paper 000, section 4.1).
#[derive(Debug, Clone, PartialEq)]
pub struct GraspState {
    /// Object pose.
    pub world_from_object: Pose,
    /// Contacts, in the object frame.
    pub contacts: Contacts,
    /// Joints that reach the contacts.
    pub joints: HandJoints,
}

/// A moment of a transfer.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Object pose.
    pub world_from_object: Pose,
    /// Joints.
    pub joints: HandJoints,
}

/// A feasible elementary motion (paper 000, section 3.2).
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// The object moves, the grasp stays. Moments after the start, the last one being the end.
    Transfer(Vec<Moment>),
    /// One finger moves to another contact. Its joints after the start, the last ones being at the contact.
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

    /// Appends a transfer through `moments`, if there are any.
    pub fn push_transfer(&mut self, moments: Vec<Moment>) {
        let Some(last) = moments.last() else { return };
        let end = GraspState {
            world_from_object: last.world_from_object,
            contacts: self.end().contacts.clone(),
            joints: last.joints.clone(),
        };
        self.steps.push(Step { motion: Motion::Transfer(moments), end });
    }

    /// Appends the relocation of `finger` along `path` to `contact`, if the path has any joints.
    pub fn push_regrasp(&mut self, finger: usize, contact: Contact, path: Vec<Coordinates>) {
        let Some(last) = path.last() else { return };
        let mut end = self.end().clone();
        end.contacts[finger] = contact;
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
            match (step.motion, joined.steps.last_mut()) {
                (Motion::Transfer(moments), Some(Step { motion: Motion::Transfer(before), end })) => {
                    before.extend(moments);
                    *end = step.end;
                }
                (motion, _) => joined.steps.push(Step { motion, end: step.end }),
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
                    back.push(Moment { world_from_object: before.world_from_object, joints: before.joints.clone() });
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
