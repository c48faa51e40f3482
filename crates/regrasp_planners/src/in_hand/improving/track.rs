//! Contacts that a finger keeps along a part of a course, or rolls along.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::improving::course::Course;
use crate::in_hand::moving::step::{HALFWAY_ALLOWED, tip_stays};
use crate::in_hand::regrasping::change::SAME_POSTURE;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::frame::PoseLine;
use regrasp_geometry::interpolate_pose;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::contact::draw_footholds;
use regrasp_manipulation::grasp::state::no_contact;
use regrasp_manipulation::rolling::follow::follow_contact;
use regrasp_manipulation::rolling::step::RollStep;
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Most steps that a fingertip rolls along one track each way: what each step may slip adds up to less than plans may.
const MOST_ROLLED: usize = 200;

/// A finger on the object through some moments of a course: clear of everything but other fingers at each of them.
#[derive(Debug, Clone)]
pub struct Track {
    /// First moment.
    pub first: usize,
    /// Joints at this and the following moments.
    pub joints: Vec<Coordinates>,
    /// The contact that is kept; of fingertips that roll, the contacts at all moments.
    contacts: Vec<Contact>,
    /// Of fingertips that roll, the contacts halfway between two moments.
    halfway: Vec<Contact>,
    /// True where the finger does not hold: it keeps its joints.
    is_free: bool,
}

/// One step of a track.
struct TrackStep {
    joints: Coordinates,
    contact: Contact,
    halfway: Contact,
}

impl Track {
    /// Follows `contact` from `moment`, where `joints` reach it, as far as it goes both ways.
    pub fn new(
        workspace: &mut Workspace,
        course: &Course,
        finger: usize,
        contact: &Contact,
        joints: Coordinates,
        moment: usize,
    ) -> Self {
        let rolls = workspace.model.rolls(finger);
        let last = course.poses.len();
        let (least, most) = match rolls {
            true => (moment.saturating_sub(MOST_ROLLED), last.min(moment + 1 + MOST_ROLLED)),
            false => (0, last),
        };
        let before = follow(workspace, course, finger, (contact, &joints), (least..moment).rev(), moment);
        let after = follow(workspace, course, finger, (contact, &joints), moment + 1..most, moment);
        let first = moment - before.len();
        let (mut contacts, mut halfway) = (vec![*contact], Vec::new());
        if rolls {
            let back = || before.iter().rev();
            halfway = back().chain(&after).map(|step| step.halfway).collect();
            contacts = back().map(|step| step.contact).chain([*contact]).collect();
            contacts.extend(after.iter().map(|step| step.contact));
        }
        let of = |step: TrackStep| step.joints;
        let joints = before.into_iter().rev().map(of).chain([joints]).chain(after.into_iter().map(of)).collect();
        Track { first, joints, contacts, halfway, is_free: false }
    }

    /// A free finger that keeps `joints` around `moment`, for as long as it is clear; None where it is not at `moment`.
    pub fn free(
        workspace: &mut Workspace,
        course: &Course,
        finger: usize,
        joints: &Coordinates,
        moment: usize,
    ) -> Option<Self> {
        let mode = TipMode::Away { finger, clearance: workspace.model.free_clearance() };
        let mut is_clear = |moment: &usize| {
            workspace.place_object_and_finger(&course.poses[*moment], finger, joints);
            workspace.finger_alone_is_clear(finger, mode)
        };
        if !is_clear(&moment) {
            return None;
        }
        let n_before = (0..moment).rev().take_while(&mut is_clear).count();
        let n_after = (moment + 1..course.poses.len()).take_while(&mut is_clear).count();
        let joints = vec![joints.clone(); n_before + 1 + n_after];
        Some(Track {
            first: moment - n_before,
            joints,
            contacts: vec![no_contact()],
            halfway: Vec::new(),
            is_free: true,
        })
    }

    /// True where the finger does not hold.
    pub fn is_free(&self) -> bool {
        self.is_free
    }

    /// The last moment.
    pub fn last(&self) -> usize {
        self.first + self.joints.len() - 1
    }

    /// True when the contact is kept at `moment`.
    pub fn spans(&self, moment: usize) -> bool {
        self.first <= moment && moment <= self.last()
    }

    /// Sets its contact and joints at a moment to these if they are those but for rounding: true then. Its first ones stay.
    pub fn settle(&mut self, moment: usize, contact: &Contact, joints: &Coordinates) -> bool {
        if self.is_free {
            return false;
        }
        if moment == self.first || !self.spans(moment) {
            return self.first == moment && self.joints[0] == *joints && self.contacts[0] == *contact;
        }
        let which = if self.halfway.is_empty() { 0 } else { moment - self.first };
        let is_exact = self.contacts[which] == *contact;
        if !is_exact && (self.halfway.is_empty() || !is_near(&self.contacts[which], contact, SAME_CONTACT)) {
            return false;
        }
        let own = &mut self.joints[moment - self.first];
        let is_there = own.iter().zip(joints).all(|(a, b)| (a - b).abs() < SAME_POSTURE);
        if is_there {
            own.clone_from(joints);
            self.contacts[which] = *contact;
        }
        is_there
    }

    /// Joints at a moment that it spans.
    pub fn at(&self, moment: usize) -> &Coordinates {
        &self.joints[moment - self.first]
    }

    /// Contact at a moment that it spans; [`no_contact`] of a free finger.
    pub fn contact(&self, moment: usize) -> &Contact {
        if self.halfway.is_empty() { &self.contacts[0] } else { &self.contacts[moment - self.first] }
    }

    /// Contact halfway from a moment to the next, both of which it spans.
    pub fn contact_after(&self, moment: usize) -> &Contact {
        if self.halfway.is_empty() { &self.contacts[0] } else { &self.halfway[moment - self.first] }
    }

    /// The same where the finger holds.
    pub fn foothold(&self, moment: usize) -> Option<&Contact> {
        (!self.is_free).then(|| self.contact(moment))
    }

    /// True when it passes `contact` at `moment`.
    pub fn passes(&self, moment: usize, contact: &Contact) -> bool {
        let is_here = |own: &Contact| match self.halfway.is_empty() {
            true => own == contact,
            false => is_near(own, contact, PASSED),
        };
        !self.is_free && self.spans(moment) && is_here(self.contact(moment))
    }
}

/// Contacts nearer than this differ by what solvers leave, in metres.
const SAME_CONTACT: f64 = 1e-7;
/// Contacts of fingertips that roll, nearer than this, belong to one track, in metres.
const PASSED: f64 = 2e-5;

fn is_near(a: &Contact, b: &Contact, distance: f64) -> bool {
    (a.point_in_object - b.point_in_object).norm() < distance
}

/// The steps to the moments of `along` for as long as the contact is kept or rolled from.
fn follow(
    workspace: &mut Workspace,
    course: &Course,
    finger: usize,
    from: (&Contact, &Coordinates),
    along: impl Iterator<Item = usize>,
    mut moment: usize,
) -> Vec<TrackStep> {
    let (mut contact, mut joints) = (*from.0, from.1.clone());
    let mut found = Vec::new();
    for next in along {
        let Some(there) = step(workspace, course, finger, (&contact, &joints), [moment, next]) else { break };
        workspace.place_object_and_finger(&course.poses[next], finger, &there.joints);
        let normal_in_world = course.placements[next].vector(&there.contact.normal_in_object);
        if !workspace.finger_alone_is_clear(finger, TipMode::Near { finger, normal_in_world }) {
            break;
        }
        joints.clone_from(&there.joints);
        (contact, moment) = (there.contact, next);
        found.push(there);
    }
    found
}

/// The step of a finger from one moment to another.
fn step(
    workspace: &Workspace,
    course: &Course,
    finger: usize,
    (contact, joints): (&Contact, &Coordinates),
    [moment, next]: [usize; 2],
) -> Option<TrackStep> {
    let model = workspace.model;
    let placement = &course.placements[next];
    if model.rolls(finger) {
        let line = PoseLine::between(&course.poses[moment], &course.poses[next]);
        let step = RollStep::new(model, finger, contact, joints, &course.placements[moment], placement);
        let rolled = step.fine(|t| Placement::from(&line.at(t)), HALFWAY_ALLOWED).ok()?;
        let halfway = rolled.halfway.unwrap_or(rolled.contact);
        let keeps_off = rolled.keeps_off_edges(model, contact);
        return keeps_off.then_some(TrackStep { joints: rolled.joints, contact: rolled.contact, halfway });
    }
    let there = follow_contact(model, finger, contact, placement, joints)?;
    let between = || Placement::from(&interpolate_pose(&course.poses[moment], &course.poses[next], 0.5));
    let stays = tip_stays(model, finger, contact, joints, &there, between);
    stays.then_some(TrackStep { joints: there, contact: *contact, halfway: *contact })
}

/// Up to `n` new tracks of `finger`, through contacts drawn at stations spread over the course. Err when the search is to
/// stop.
pub fn draw_tracks(
    search: &mut Search,
    course: &Course,
    finger: usize,
    n: usize,
    rng: &mut Rng,
) -> Result<Vec<Track>, Stop> {
    let mut tracks = Vec::with_capacity(n);
    for k in 0..n {
        search.check()?;
        let workspace = &mut search.workspace;
        let moment = course.stations[k * course.stations.len() / n];
        let mut drawn = None;
        workspace.place_object(&course.poses[moment]);
        draw_footholds(workspace, finger, &course.placements[moment], 1, rng, |contact, joints| {
            drawn = Some((contact, joints));
        });
        if let Some((contact, joints)) = drawn {
            tracks.push(Track::new(workspace, course, finger, &contact, joints, moment));
        }
    }
    search.n_samples += tracks.len() as u64;
    Ok(tracks)
}

/// Up to `n_wanted` of `tracks`: those that cover the course with the fewest changes, then those of the others that do,
/// and so on.
pub fn covers(course: &Course, mut tracks: Vec<Track>, n_wanted: usize) -> Vec<Track> {
    let mut kept = Vec::with_capacity(n_wanted);
    let mut station = 0;
    while !tracks.is_empty() && kept.len() < n_wanted {
        let moment = course.stations[station];
        let here = (0..tracks.len()).filter(|&index| tracks[index].spans(moment));
        let next = match here.max_by_key(|&index| tracks[index].last()) {
            Some(farthest) => {
                let track = tracks.swap_remove(farthest);
                let beyond = course.stations.partition_point(|&moment| moment <= track.last());
                kept.push(track);
                // The finger changes where it still holds.
                if beyond > course.last() { beyond } else { (beyond - 1).max(station + 1) }
            }
            None => station + 1,
        };
        station = if next > course.last() { 0 } else { next };
    }
    kept
}
