//! Points of GS_n and GS_k: an object pose, the contacts of the fingers that hold, the joints of all; and the motions
//! between them.

use super::workspace::{Contacts, HandJoints};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::finger_ik::Coordinates;
use std::ops::RangeInclusive;

/// Some fingers hold the object, the others are free, each with a posture of its own: a configuration in GS_k with its
/// independent fingers; in GS_n where all hold (paper 000, sections 3.2 and 4.1).
#[derive(Debug, Clone, PartialEq)]
pub struct GraspState {
    /// Object pose.
    pub world_from_object: Pose,
    /// Fingers that hold, as bits.
    pub holding: u32,
    /// Contacts, in the object frame; [`no_contact`] for a finger that is free.
    pub contacts: Contacts,
    /// Joints: those that reach the contact, or the posture of a free finger.
    pub joints: HandJoints,
}

/// What stands in place of the contact of a free finger: always the same, so that states can be compared.
pub fn no_contact() -> Contact {
    Contact { point_in_object: Point::origin(), normal_in_object: Vector::z_axis() }
}

impl GraspState {
    /// The state in which all fingers hold.
    pub fn held_by_all(world_from_object: Pose, contacts: Contacts, joints: HandJoints) -> Self {
        GraspState { world_from_object, holding: (1 << contacts.len()) - 1, contacts, joints }
    }

    /// The state in which the fingers with a contact hold.
    pub fn of(world_from_object: Pose, fingers: impl Iterator<Item = (Option<Contact>, Coordinates)>) -> Self {
        let (contacts, joints) = (Contacts::new(), HandJoints::new());
        let mut state = GraspState { world_from_object, holding: 0, contacts, joints };
        for (finger, (contact, own)) in fingers.enumerate() {
            state.contacts.push(no_contact());
            state.joints.push(own);
            state.set_contact(finger, contact);
        }
        state
    }

    /// True when `finger` holds.
    pub fn holds(&self, finger: usize) -> bool {
        self.holding & (1 << finger) != 0
    }

    /// Contact of `finger`; None when it is free.
    pub fn contact(&self, finger: usize) -> Option<Contact> {
        self.holds(finger).then(|| self.contacts[finger])
    }

    /// Puts `finger` on a contact, or sets it free.
    pub fn set_contact(&mut self, finger: usize, contact: Option<Contact>) {
        match contact {
            Some(_) => self.holding |= 1 << finger,
            None => self.holding &= !(1 << finger),
        }
        self.contacts[finger] = contact.unwrap_or_else(no_contact);
    }

    /// True when all fingers hold.
    pub fn is_held_by_all(&self) -> bool {
        self.holding.count_ones() as usize == self.contacts.len()
    }
}

/// A moment of a transfer.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Object pose.
    pub world_from_object: Pose,
    /// Joints.
    pub joints: HandJoints,
    /// Contacts, which travel where fingertips roll.
    pub contacts: Contacts,
}

impl GraspState {
    /// The state at a moment of a transfer with this grasp.
    pub fn at(&self, moment: &Moment) -> Self {
        let Moment { world_from_object, joints, contacts } = moment.clone();
        GraspState { world_from_object, joints, contacts, holding: self.holding }
    }

    /// This state as a moment of a transfer.
    pub fn moment(&self) -> Moment {
        Moment {
            world_from_object: self.world_from_object,
            joints: self.joints.clone(),
            contacts: self.contacts.clone(),
        }
    }
}

/// A feasible elementary motion (paper 000, section 3.2).
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
