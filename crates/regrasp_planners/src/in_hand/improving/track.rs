//! Contacts that a finger keeps along a part of a course.

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::improving::course::Course;
use crate::in_hand::moving::step::tip_stays;
use crate::in_hand::regrasping::change::SAME_POSTURE;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::interpolate_pose;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::contact::draw_footholds;
use regrasp_manipulation::rolling::follow::follow_contact;
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// A contact, the moments through which a finger keeps it, and its joints there: clear of everything but other fingers
/// at each of them.
#[derive(Debug, Clone)]
pub struct Track {
    /// The contact.
    pub contact: Contact,
    /// First moment.
    pub first: usize,
    /// Joints at this and the following moments.
    pub joints: Vec<Coordinates>,
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
        let before = follow(workspace, course, finger, contact, joints.clone(), (0..moment).rev(), moment);
        let after = follow(workspace, course, finger, contact, joints.clone(), moment + 1..course.poses.len(), moment);
        let first = moment - before.len();
        let joints = before.into_iter().rev().chain([joints]).chain(after).collect();
        Track { contact: *contact, first, joints }
    }

    /// The last moment.
    pub fn last(&self) -> usize {
        self.first + self.joints.len() - 1
    }

    /// True when the contact is kept at `moment`.
    pub fn spans(&self, moment: usize) -> bool {
        self.first <= moment && moment <= self.last()
    }

    /// Sets its joints at a moment to `joints` if they are those but for rounding: true then. Its first joints stay.
    pub fn settle(&mut self, moment: usize, joints: &Coordinates) -> bool {
        if moment == self.first || !self.spans(moment) {
            return self.first == moment && self.joints[0] == *joints;
        }
        let own = &mut self.joints[moment - self.first];
        let is_there = own.iter().zip(joints).all(|(a, b)| (a - b).abs() < SAME_POSTURE);
        if is_there {
            own.clone_from(joints);
        }
        is_there
    }

    /// Joints at a moment that it spans.
    pub fn at(&self, moment: usize) -> &Coordinates {
        &self.joints[moment - self.first]
    }
}

/// Joints at the moments of `along` for as long as the contact is kept.
fn follow(
    workspace: &mut Workspace,
    course: &Course,
    finger: usize,
    contact: &Contact,
    mut joints: Coordinates,
    along: impl Iterator<Item = usize>,
    mut moment: usize,
) -> Vec<Coordinates> {
    let model = workspace.model;
    let mut found = Vec::new();
    for next in along {
        let placement = &course.placements[next];
        let Some(there) = follow_contact(model, finger, contact, placement, &joints) else { break };
        let halfway = || Placement::from(&interpolate_pose(&course.poses[moment], &course.poses[next], 0.5));
        if !tip_stays(model, finger, contact, &joints, &there, halfway) {
            break;
        }
        workspace.place_object_and_finger(&course.poses[next], finger, &there);
        let normal_in_world = placement.vector(&contact.normal_in_object);
        if !workspace.finger_alone_is_clear(finger, TipMode::Near { finger, normal_in_world }) {
            break;
        }
        found.push(there.clone());
        (joints, moment) = (there, next);
    }
    found
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
