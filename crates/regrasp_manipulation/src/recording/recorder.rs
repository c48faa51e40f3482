//! A plan in the making: motions are written down one after the other.

use crate::forces::along::add_forces;
use crate::forces::limits::Unbalanced;
use crate::grasp::sequence::{Motion, Sequence};
use crate::grasp::state::{Contacts, GraspState, Moment, no_contact};
use crate::model::Model;
use crate::recording::pieces::{Piece, promises};
use crate::recording::plan::{finger_names, plan_of};
use crate::timing;
use regrasp_geometry::Pose;
use regrasp_grasp::Contact;
use regrasp_plan::plan::{
    ContactMode, ContactState, Plan, PoseData, Segment, SegmentKind, Statistics, WayPose, Waypoint, relocations,
};
use regrasp_scene::InHandQuery;
use regrasp_scene::query::IN_HAND;

/// Which motions become one segment of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Joins {
    /// None: every motion is a segment.
    Nothing,
    /// Transfers that follow each other.
    TransfersInARow,
}

/// A plan in the making: motions are written down one after the other, each from where the one before ended.
pub struct Recorder<'m, 'a> {
    model: &'m Model<'a>,
    /// Which motions become one segment.
    joins: Joins,
    segments: Vec<Segment>,
    /// Where the last motion ended.
    here: Waypoint,
    contacts: Contacts,
    holding: u32,
    /// The smallest closure margin so far.
    kept_margin: f64,
    transfers: u64,
    transfers_with_free_fingers: u64,
}

impl<'m, 'a> Recorder<'m, 'a> {
    /// Begins at a state.
    pub fn at(model: &'m Model<'a>, start: &GraspState, joins: Joins) -> Self {
        let here = Waypoint {
            time: 0.0,
            joint_velocities: vec![0.0; model.view.hand.n_joints()],
            joint_torques: Vec::new(),
            joints: start.joints.iter().flatten().copied().collect(),
            world_from_object: PoseData::from(&start.world_from_object),
            contacts: resting(&start.contacts, start.holding),
        };
        Recorder {
            model,
            joins,
            segments: Vec::new(),
            here,
            contacts: start.contacts.clone(),
            holding: start.holding,
            kept_margin: f64::INFINITY,
            transfers: 0,
            transfers_with_free_fingers: 0,
        }
    }

    /// Writes down the motions of a sequence.
    pub fn sequence(&mut self, way: &Sequence) {
        for step in way.steps() {
            match step.motion() {
                Motion::Transfer(moments) => self.transfer(moments),
                Motion::Regrasp { finger, path } => {
                    self.begin_regrasp(*finger, step.end().contact(*finger).as_ref(), path.len());
                    path.iter().for_each(|joints| self.finger_at(*finger, joints.iter().copied()));
                    self.end_regrasp();
                }
            }
        }
    }

    /// Writes down a transfer.
    pub fn transfer(&mut self, moments: &[Moment]) {
        self.begin_transfer(moments.len());
        for moment in moments {
            if self.model.any_rolls() {
                self.contacts.clone_from(&moment.contacts);
                self.keep(self.holding);
                self.here.contacts = moving(self.model, &self.contacts, self.holding);
            }
            self.moment(&moment.world_from_object, moment.joints.iter().flatten().copied());
        }
    }

    /// Begins a transfer of `n` moments, or goes on with the one before.
    pub fn begin_transfer(&mut self, n: usize) {
        let goes_on = self.segments.last().is_some_and(|segment| segment.kind == SegmentKind::Transfer);
        if self.joins == Joins::TransfersInARow && goes_on {
            self.waypoints().reserve(n);
            return;
        }
        self.keep(self.holding);
        self.transfers += 1;
        self.transfers_with_free_fingers += u64::from(self.holding != self.model.all_fingers());
        self.here.contacts = moving(self.model, &self.contacts, self.holding);
        self.begin(SegmentKind::Transfer, None, n);
    }

    /// A moment of the transfer, with the joints of all fingers.
    pub fn moment(&mut self, world_from_object: &Pose, joints: impl Iterator<Item = f64>) {
        self.here.joints.clear();
        self.here.joints.extend(joints);
        self.here.world_from_object = PoseData::from(world_from_object);
        self.push_here();
    }

    /// Begins the motion of a finger of `n` joint vectors to a contact, or to be free.
    pub fn begin_regrasp(&mut self, finger: usize, contact: Option<&Contact>, n: usize) {
        let others = self.holding & !(1 << finger);
        self.keep(others);
        let name = self.model.view.hand.fingers[finger].name.clone();
        self.here.contacts = resting(&self.contacts, self.holding);
        self.begin(SegmentKind::Regrasp, Some(name), n);
        self.contacts[finger] = contact.copied().unwrap_or_else(no_contact);
        self.holding = others | contact.map_or(0, |_| 1 << finger);
        self.here.contacts = resting(&self.contacts, others);
    }

    /// Joints of the finger that moves, the last ones being at its contact.
    pub fn finger_at(&mut self, finger: usize, joints: impl Iterator<Item = f64>) {
        let first: usize = self.model.fingers[..finger].iter().map(|finger| finger.ik.chain().n_coordinates()).sum();
        self.here.joints[first..].iter_mut().zip(joints).for_each(|(own, joint)| *own = joint);
        self.push_here();
    }

    /// The finger has arrived.
    pub fn end_regrasp(&mut self) {
        self.here.contacts = resting(&self.contacts, self.holding);
        let contacts = self.here.contacts.clone();
        if let Some(last) = self.waypoints().last_mut() {
            last.contacts = contacts;
        }
    }

    /// What has been written down, without forces and times.
    pub fn into_segments(self) -> Vec<Segment> {
        self.segments
    }

    fn begin(&mut self, kind: SegmentKind, moving_finger: Option<String>, n: usize) {
        let waypoints = Vec::with_capacity(1 + n);
        self.segments.push(Segment { kind, moving_finger, ..Segment::transfer(waypoints) });
        self.push_here();
    }

    fn push_here(&mut self) {
        let here = self.here.clone();
        self.waypoints().push(here);
    }

    fn waypoints(&mut self) -> &mut Vec<Waypoint> {
        &mut self.segments.last_mut().expect("a motion has begun").waypoints
    }

    fn keep(&mut self, holding: u32) {
        self.kept_margin = self.kept_margin.min(self.model.closure_margin(&self.contacts, holding));
    }

    /// What has been written down, with contact forces and times.
    ///
    /// Errors: a moment at which no contact forces balance the weight.
    pub fn into_piece(mut self) -> Result<Piece, Unbalanced> {
        self.keep(self.holding);
        add_forces(self.model, &mut self.segments)?;
        let motion = timing::limits(self.model);
        timing::assign_times(self.model, &motion, &mut self.segments, |_| timing::LEAST_SPAN);
        Ok(Piece { segments: self.segments, kept_margin: self.kept_margin })
    }

    /// The plan.
    ///
    /// Errors: a moment at which no contact forces balance the weight: a plan without them is none.
    pub fn finish(
        mut self,
        query: &InHandQuery,
        seed: u64,
        steps_to_way: &[usize],
        statistics: Statistics,
    ) -> Result<Plan, Unbalanced> {
        if self.segments.is_empty() {
            // Start and goal are the same and any grasp will do: hold still.
            let waypoints = vec![self.here.clone(), self.here.clone()];
            self.segments.push(Segment::transfer(waypoints));
        }
        let model = self.model;
        let statistics = Statistics {
            transfers: self.transfers,
            transfers_with_free_fingers: self.transfers_with_free_fingers,
            relocations: relocations(&finger_names(model.view), &self.segments),
            ..statistics
        };
        let Piece { segments, kept_margin } = self.into_piece()?;
        let ends = [&query.world_from_object_start, &query.world_from_object_goal];
        Ok(Plan {
            seed,
            way_poses: way_poses(query, &segments, steps_to_way),
            statistics,
            ..plan_of(model.view, IN_HAND, ends, promises(model, kept_margin), segments)
        })
    }
}

/// Each way pose with the last waypoint of the leg that leads to it; every step is a segment.
fn way_poses(query: &InHandQuery, segments: &[Segment], steps_to_way: &[usize]) -> Vec<WayPose> {
    let passed = |&n_steps: &usize| match n_steps.checked_sub(1) {
        Some(segment) => (segment, segments[segment].waypoints.len() - 1),
        None => (0, 0),
    };
    let poses = query.world_from_object_way.iter().zip(steps_to_way.iter().map(passed));
    poses
        .map(|(pose, (segment, waypoint))| WayPose { world_from_object: PoseData::from(pose), segment, waypoint })
        .collect()
}

/// Contacts while the object stands still.
pub fn resting(contacts: &Contacts, holding: u32) -> Vec<ContactState> {
    contact_states(contacts, holding, |_| ContactMode::Fixed)
}

/// Contacts while the object moves.
pub fn moving(model: &Model, contacts: &Contacts, holding: u32) -> Vec<ContactState> {
    contact_states(contacts, holding, |finger| match model.rolls(finger) {
        true => ContactMode::Rolling,
        false => ContactMode::Fixed,
    })
}

fn contact_states(contacts: &Contacts, holding: u32, mode: impl Fn(usize) -> ContactMode) -> Vec<ContactState> {
    let state = |(finger, contact): (usize, &Contact)| {
        if holding & (1 << finger) == 0 {
            return ContactState::FREE;
        }
        let (point, normal) = (contact.point_in_object.coords, contact.normal_in_object.into_inner());
        ContactState::at(mode(finger), point.into(), normal.into())
    };
    contacts.iter().enumerate().map(state).collect()
}
