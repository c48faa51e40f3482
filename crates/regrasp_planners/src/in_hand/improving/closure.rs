//! Closure of tracks: where fingertips roll, it is another one at every station.

use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::improving::course::Course;
use crate::in_hand::improving::track::Track;
use arrayvec::ArrayVec;
use regrasp_grasp::{Contact, Grip, closure};
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::Model;

/// The contacts of tracks, as candidates for closure.
pub struct StationContacts {
    /// One entry where contacts stay; else one per station.
    at: Vec<OfStation>,
}

struct OfStation {
    /// Contacts by finger.
    options: Vec<Vec<Candidate>>,
    /// Index in `options` by finger and track; where contacts roll, of those tracks that span the station.
    index: Vec<Vec<usize>>,
}

impl OfStation {
    /// Contacts of those tracks that `moment_of` gives a moment to.
    fn new(tracks: &[Vec<Track>], moment_of: impl Fn(&Track) -> Option<usize>) -> Self {
        let mut of_station = OfStation { options: Vec::new(), index: Vec::new() };
        for tracks in tracks {
            let (mut options, mut index) = (Vec::new(), Vec::with_capacity(tracks.len()));
            for track in tracks {
                index.push(options.len());
                if let Some(moment) = moment_of(track) {
                    let (contact, joints) = (track.foothold(moment).copied(), track.at(moment).clone());
                    options.push(Candidate { contact, joints, follow: 0.0 });
                }
            }
            of_station.options.push(options);
            of_station.index.push(index);
        }
        of_station
    }
}

impl StationContacts {
    /// Those of `tracks[finger]` along `course`.
    pub fn of(model: &Model, course: &Course, tracks: &[Vec<Track>]) -> Self {
        if !model.any_rolls() {
            return StationContacts { at: vec![OfStation::new(tracks, |track| Some(track.first))] };
        }
        let at = |&moment: &usize| OfStation::new(tracks, |track| track.spans(moment).then_some(moment));
        StationContacts { at: course.stations.iter().map(at).collect() }
    }
}

/// Which sets of fingers hold the object on which tracks, found out when first asked for.
pub struct StationClosure<'g> {
    model: &'g Model<'g>,
    contacts: &'g StationContacts,
    margin: f64,
    tables: Vec<Option<ClosureTable<'g>>>,
}

impl<'g> StationClosure<'g> {
    /// Nothing known yet; closed is what has the margin `margin`.
    pub fn new(model: &'g Model<'g>, contacts: &'g StationContacts, margin: f64) -> Self {
        StationClosure { model, contacts, margin, tables: contacts.at.iter().map(|_| None).collect() }
    }

    /// True where contacts roll, so that closure changes from station to station.
    pub fn changes(&self) -> bool {
        self.tables.len() > 1
    }

    fn at(&mut self, station: usize, choice: &Choice) -> (&mut ClosureTable<'g>, Choice) {
        let which = if self.contacts.at.len() == 1 { 0 } else { station };
        let OfStation { options, index } = &self.contacts.at[which];
        let (model, margin) = (self.model, self.margin);
        let table = self.tables[which].get_or_insert_with(|| ClosureTable::with_margin(model, options, margin));
        (table, choice.iter().enumerate().map(|(finger, &track)| index[finger][track]).collect())
    }

    /// True when the fingers of `among` hold the object at a station that their tracks span.
    pub fn is_closed(&mut self, station: usize, choice: &Choice, among: u32) -> bool {
        let (table, choice) = self.at(station, choice);
        table.is_closed(&choice, among)
    }

    /// Number of fingers that the others would let go.
    pub fn n_releasable(&mut self, station: usize, choice: &Choice) -> usize {
        let (table, choice) = self.at(station, choice);
        table.n_releasable(&choice)
    }

    /// True when the fingers of `holding` hold at these contacts.
    pub fn holds(&self, contacts: &[Contact], holding: u32) -> bool {
        let holds = |(finger, _): &(usize, &Contact)| holding & (1 << finger) != 0;
        let grip = |(finger, contact): (usize, &Contact)| self.model.grip(finger, contact);
        let grips: ArrayVec<Grip, MAX_FINGERS> = contacts.iter().enumerate().filter(holds).map(grip).collect();
        closure::closure_margin(&grips, &self.model.frame, self.margin) >= self.margin
    }
}
