//! One frame: contacts finger by finger, closure, forces, way in (Saut 2010, sec. IV-A.2 and IV-A.3).

use super::closing::triples;
use super::combine::{Choice, Options, choices};
use super::contacts::{Candidates, Foothold, MOST, Site};
use super::worth;
use crate::driven;
use crate::found::{Found, Reason};
use crate::prepared::Prepared;
use crate::way::{self, NoWay};
use arrayvec::ArrayVec;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_manipulation::grasp::state::{GraspState, HandJoints};
use regrasp_manipulation::workspace::{TipMode, Workspace};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Choices of contacts that are tried in a frame.
const CHOICES_TRIED: usize = 6;
/// Triples of contacts in reach that are tried in a frame.
const TRIPLES_TRIED: usize = 4;

/// A frame without a grasp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Miss {
    /// Why.
    pub reason: Reason,
    /// The largest margin seen.
    pub margin: f64,
    /// The first finger that reached no contact.
    pub out_of_reach: Option<usize>,
}

/// The grasp of frame `index`, or why there is none. The answer does not depend on what the workspace did before.
pub fn try_frame(prepared: &Prepared, workspace: &mut Workspace, index: u64) -> Result<Found, Miss> {
    let mut rng = Rng::keyed(prepared.seed, "grasp frame", index);
    let Some(motors) = &prepared.motors else {
        return precision(prepared, workspace, index, &Site::new(&prepared.object_from_hand(index)), &mut rng);
    };
    let miss = |reason: Reason, margin: f64| Miss { reason, margin, out_of_reach: None };
    let closed = driven::close_in_frame(prepared, motors, workspace, index, &mut rng);
    let (state, margin) = closed.map_err(|(reason, margin)| miss(reason, margin))?;
    let flatness = driven::flatness(prepared, &state);
    accept(prepared, workspace, index, state, (&flatness, margin), None).map_err(|reason| miss(reason, margin))
}

/// A grasp of chosen contacts: first those of the first finger, then places of the others that close the object with it.
fn precision(
    prepared: &Prepared,
    workspace: &mut Workspace,
    index: u64,
    site: &Site,
    rng: &mut Rng,
) -> Result<Found, Miss> {
    let mut miss = Miss { reason: Reason::Palm, margin: 0.0, out_of_reach: None };
    if prepared.rough.palm_hits(&site.object_from_hand) {
        return Err(miss);
    }
    let (first, n_fingers) = (prepared.order[0], prepared.model.n_fingers());
    let mut firsts = Candidates::new(prepared, first, site, rng);
    // No stable grasp without the first finger (Saut 2010, sec. IV-A.2).
    if firsts.places.is_empty() {
        return Err(Miss { reason: Reason::TooFewContacts, out_of_reach: Some(first), ..miss });
    }
    let mut others = Vec::with_capacity(n_fingers - 1);
    let mut n_left = n_fingers;
    for &finger in &prepared.order[1..] {
        let candidates = Candidates::new(prepared, finger, site, rng);
        if candidates.places.is_empty() {
            miss.out_of_reach = miss.out_of_reach.or(Some(finger));
            n_left -= 1;
            if n_left < prepared.least_contacts() {
                return Err(Miss { reason: Reason::TooFewContacts, ..miss });
            }
            if prepared.rough.finger_hits(prepared.model, finger, &rest_of(prepared, finger), &site.object_from_hand) {
                return Err(Miss { reason: Reason::FreeFinger(finger), ..miss });
            }
        }
        others.push(candidates);
    }
    firsts.oppose_all(&others);
    if firsts.places.is_empty() {
        return Err(Miss { reason: Reason::NotClosed, ..miss });
    }
    workspace.place_object(&site.hand_from_object);
    if !workspace.palm_is_clear() {
        return Err(Miss { reason: Reason::Palm, ..miss });
    }
    let footholds = firsts.footholds(prepared, workspace, site, rng);
    if footholds.is_empty() {
        return Err(Miss { reason: Reason::TooFewContacts, out_of_reach: Some(first), ..miss });
    }
    let mut search = Search { prepared, workspace, index, site, free: vec![None; n_fingers] };
    if prepared.least_contacts() < 3 {
        return search.by_contacts(footholds, others, miss, rng);
    }
    let (triples, best) = triples(prepared, &footholds, &others);
    miss = Miss { reason: Reason::NotClosed, margin: best, ..miss };
    let mut n_tried = 0;
    for triple in triples {
        if n_tried == TRIPLES_TRIED {
            break;
        }
        let mut options: Options = (0..n_fingers).map(|_| Default::default()).collect();
        options[first].push(footholds[triple.first].clone());
        let reached = triple.others.iter().all(|&(other, place)| {
            let candidates = &mut others[other];
            let foothold = candidates.foothold(prepared, search.workspace, site, place, rng);
            options[candidates.finger].extend(foothold);
            !options[candidates.finger].is_empty()
        });
        if !reached {
            miss.reason = miss.reason.max(Reason::TooFewContacts);
            continue;
        }
        n_tried += 1;
        for candidates in &mut others {
            if options[candidates.finger].is_empty() {
                options[candidates.finger] = candidates.footholds(prepared, search.workspace, site, rng);
            }
        }
        let needed = [first, others[triple.others[0].0].finger, others[triple.others[1].0].finger];
        match search.grasp_of(&options, &needed, miss) {
            Ok(grasp) => return Ok(grasp),
            Err(why) => miss.reason = miss.reason.max(why.reason),
        }
    }
    Err(miss)
}

/// The search in one frame.
struct Search<'s, 'a, 'm> {
    prepared: &'s Prepared<'a>,
    workspace: &'s mut Workspace<'m>,
    index: u64,
    site: &'s Site,
    /// Whether each finger has room in its rest posture, once it was asked.
    free: Vec<Option<bool>>,
}

impl Search<'_, '_, '_> {
    /// Contacts finger by finger, then closure: two soft fingertips may be enough.
    fn by_contacts(
        &mut self,
        footholds: ArrayVec<Foothold, MOST>,
        others: Vec<Candidates>,
        mut miss: Miss,
        rng: &mut Rng,
    ) -> Result<Found, Miss> {
        let prepared = self.prepared;
        let mut options: Options = (0..prepared.model.n_fingers()).map(|_| Default::default()).collect();
        let opposed = footholds[0].place;
        options[prepared.order[0]] = footholds;
        for mut candidates in others {
            let finger = candidates.finger;
            candidates.oppose(&opposed);
            options[finger] = candidates.footholds(prepared, self.workspace, self.site, rng);
            if options[finger].is_empty() {
                miss.out_of_reach = miss.out_of_reach.or(Some(finger));
            }
        }
        if options.iter().filter(|of_finger| !of_finger.is_empty()).count() < prepared.least_contacts() {
            return Err(Miss { reason: Reason::TooFewContacts, ..miss });
        }
        self.grasp_of(&options, &[], miss)
    }

    /// The best grasp of these contacts, in which the fingers of `needed` hold.
    fn grasp_of(&mut self, options: &Options, needed: &[usize], miss: Miss) -> Result<Found, Miss> {
        let prepared = self.prepared;
        let n_fingers = options.len();
        let mut may_be_free = vec![false; n_fingers];
        for finger in 0..n_fingers {
            may_be_free[finger] = !needed.contains(&finger) && self.rests(finger);
            if options[finger].is_empty() && !may_be_free[finger] {
                return Err(Miss { reason: Reason::FreeFinger(finger), ..miss });
            }
        }
        let (found, best) = choices(prepared, options, &may_be_free);
        let miss = Miss { margin: miss.margin.max(best), ..miss };
        let mut reason = if found.is_empty() { Reason::NotClosed } else { Reason::Fingers };
        let mut clear = Clear::new(options);
        for choice in found.iter().take(CHOICES_TRIED) {
            if !clear.of_each_other(prepared, self.workspace, options, choice) {
                continue;
            }
            let state = state_of(prepared, &self.site.hand_from_object, options, choice);
            self.workspace.set_state(&state);
            if !self.workspace.is_clear(TipMode::AllHold) {
                continue;
            }
            let flatness: Vec<f64> =
                (0..n_fingers).filter_map(|f| choice.chosen[f].map(|k| options[f][k].place.flatness)).collect();
            match accept(prepared, self.workspace, self.index, state, (&flatness, choice.margin), None) {
                Ok(grasp) => return Ok(grasp),
                Err(why) => reason = reason.max(why),
            }
        }
        Err(Miss { reason, ..miss })
    }

    /// True when a finger has room in its rest posture, whatever the others do.
    fn rests(&mut self, finger: usize) -> bool {
        let (prepared, site) = (self.prepared, self.site);
        if let Some(known) = self.free[finger] {
            return known;
        }
        let rest = rest_of(prepared, finger);
        let clearance = prepared.model.free_clearance();
        let is_free = !prepared.rough.finger_hits(prepared.model, finger, &rest, &site.object_from_hand) && {
            self.workspace.set_finger(finger, &rest);
            self.workspace.finger_alone_is_clear(finger, TipMode::Away { finger, clearance })
        };
        self.free[finger] = Some(is_free);
        is_free
    }
}

fn rest_of(prepared: &Prepared, finger: usize) -> Coordinates {
    prepared.model.view.hand.fingers[finger].rest.iter().copied().collect()
}

/// Which postures of two fingers are clear of each other, asked once.
struct Clear {
    n_options: Vec<usize>,
    known: Vec<Option<bool>>,
}

impl Clear {
    fn new(options: &Options) -> Self {
        let n_options: Vec<usize> = options.iter().map(|of_finger| of_finger.len() + 1).collect();
        let n: usize = n_options.iter().sum();
        Clear { known: vec![None; n * n], n_options }
    }

    fn of_each_other(
        &mut self,
        prepared: &Prepared,
        workspace: &mut Workspace,
        options: &Options,
        choice: &Choice,
    ) -> bool {
        let total: usize = self.n_options.iter().sum();
        let slot = |f: usize| -> usize {
            let first: usize = self.n_options[..f].iter().sum();
            first + choice.chosen[f].unwrap_or(self.n_options[f] - 1)
        };
        let slots: Vec<usize> = (0..choice.chosen.len()).map(slot).collect();
        for f in 0..slots.len() {
            for g in f + 1..slots.len() {
                let index = slots[f] * total + slots[g];
                let is_clear = self.known[index].unwrap_or_else(|| {
                    let (first, second) =
                        (joints_of(prepared, options, choice, f), joints_of(prepared, options, choice, g));
                    workspace.fingers_are_clear((f, &first), (g, &second))
                });
                self.known[index] = Some(is_clear);
                if !is_clear {
                    return false;
                }
            }
        }
        true
    }
}

fn joints_of(prepared: &Prepared, options: &Options, choice: &Choice, finger: usize) -> Coordinates {
    choice.chosen[finger].map_or_else(|| rest_of(prepared, finger), |k| options[finger][k].joints.clone())
}

/// The hand at the contacts of a choice.
fn state_of(prepared: &Prepared, hand_from_object: &Pose, options: &Options, choice: &Choice) -> GraspState {
    let finger = |f: usize| {
        let contact = choice.chosen[f].map(|k| options[f][k].place.contact);
        (contact, joints_of(prepared, options, choice, f))
    };
    GraspState::of(*hand_from_object, (0..choice.chosen.len()).map(finger))
}

/// The grasp `state`, which hits nothing, with all that belongs to it; `flatness` has the inverse curvature at its contacts, beside the
/// margin. `open` is the open hand to be tried first.
pub fn accept(
    prepared: &Prepared,
    workspace: &mut Workspace,
    frame: u64,
    state: GraspState,
    (flatness, margin): (&[f64], f64),
    open: Option<&HandJoints>,
) -> Result<Found, Reason> {
    let forces = worth::forces(prepared, &state).ok_or(Reason::Forces)?;
    let way = way::way_in(prepared, workspace, &state, open).map_err(|why| match why {
        NoWay::Closed => Reason::NotOpened,
        NoWay::Blocked => Reason::NoWayIn,
    })?;
    let scores = worth::terms(prepared, &state, flatness, margin);
    let score = scores.mean(&prepared.settings.weights);
    Ok(Found { frame, state, margin, margin_before: None, scores, score, forces, way, stable_poses: Vec::new() })
}
