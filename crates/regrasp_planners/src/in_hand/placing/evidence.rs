//! What a hand can really do with the object at a pose: contacts that fingers reach with all their links clear, grasps of them that
//! close, and who could let go.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::attempt::tally::Reason;
use crate::in_hand::grasps::candidate::{Candidate, Choice, Way};
use crate::in_hand::grasps::choose::choose_grasp;
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::combine::ClashTable;
use crate::in_hand::grasps::free::free_posture_at;
use arrayvec::ArrayVec;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::ContactModel;
use regrasp_manipulation::grasp::contact::draw_footholds;
use regrasp_manipulation::grasp::state::{GraspState, MAX_FINGERS};
use regrasp_manipulation::model::Model;

/// Contacts looked for per finger.
const FOOTHOLDS: usize = 10;
/// Share that stands for none.
const NONE: f64 = 0.002;

/// What was seen at a pose.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// Contacts found per finger, of `FOOTHOLDS`.
    pub n_contacts: [usize; MAX_FINGERS],
    /// Without each finger: the sum, over the sets of others that can hold, of the share of their contacts that close clear of each
    /// other.
    pub released: [f64; MAX_FINGERS],
    /// The same sum over all sets.
    pub held: f64,
    /// A closed grasp from which some finger may lift, clear of everything.
    pub grasp: Option<GraspState>,
}

impl Evidence {
    /// Looks for contacts and grasps with the object at `hand_from_object`.
    pub fn gather(search: &mut Search, hand_from_object: &Pose) -> Self {
        let model = search.model();
        let n = model.n_fingers();
        let placement = Placement::from(hand_from_object);
        let mut options: Vec<Vec<Candidate>> = Vec::with_capacity(n);
        let mut evidence =
            Evidence { n_contacts: [0; MAX_FINGERS], released: [0.0; MAX_FINGERS], held: 0.0, grasp: None };
        for finger in 0..n {
            search.workspace.place_object(hand_from_object);
            let mut found = Vec::with_capacity(FOOTHOLDS);
            draw_footholds(&mut search.workspace, finger, &placement, FOOTHOLDS, &mut search.rng, |contact, joints| {
                found.push(Candidate { contact: Some(contact), joints, follow: 1.0 });
            });
            evidence.n_contacts[finger] = found.len();
            let stays_free = model.fingers[finger].closes() && !search.holds_only;
            if found.is_empty() || stays_free {
                if stays_free {
                    // It cannot follow: what the others do without it is what counts.
                    found.clear();
                } else {
                    search.tally.add(Reason::NoContact(finger));
                }
                let stays = Way::new(hand_from_object, hand_from_object);
                let Some(free) = free_posture_at(search, finger, hand_from_object, &stays) else { return evidence };
                found.push(free);
            }
            options.push(found);
        }
        search.workspace.place_object(hand_from_object);
        (evidence.released, evidence.held) = shares(search, &options);
        search.workspace.place_object(hand_from_object);
        evidence.grasp = choose_grasp(search, hand_from_object, &options, None);
        if evidence.grasp.is_none() {
            search.tally.add(search.no_grasp());
        }
        evidence
    }

    /// The geometric mean over the fingers of the share of grasps that hold without it; of hands that never let go, of those that hold.
    pub fn worth(&self, model: &Model) -> f64 {
        if !model.may_release {
            return self.held + NONE;
        }
        let n = model.n_fingers();
        (self.released[..n].iter().map(|share| (share + NONE).ln()).sum::<f64>() / n as f64).exp()
    }
}

/// Per finger, the sum over the triples of other fingers, and over the pairs of soft ones, of the share of their options that close
/// clear of each other; and the same sum over all fingers.
fn shares(search: &mut Search, options: &[Vec<Candidate>]) -> ([f64; MAX_FINGERS], f64) {
    let model = search.model();
    let n = options.len();
    let mut table = ClosureTable::new(model, options);
    let mut clashes = ClashTable::new(options);
    let (mut without, mut held) = ([0.0; MAX_FINGERS], 0.0);
    let is_soft = |f: &usize| matches!(model.fingers[*f].contact, ContactModel::SoftFinger { .. });
    for set in 1u32..1 << n {
        let fingers: ArrayVec<usize, MAX_FINGERS> = (0..n).filter(|f| set & (1 << f) != 0).collect();
        let may_close = fingers.len() == 3 || (fingers.len() == 2 && fingers.iter().all(is_soft));
        if !may_close || fingers.iter().any(|&f| options[f][0].contact.is_none()) {
            continue;
        }
        let n_choices: usize = fingers.iter().map(|&f| options[f].len()).product();
        let mut n_closed = 0u32;
        for code in 0..n_choices {
            let mut rest = code;
            let mut choice: Choice = options.iter().map(|_| 0).collect();
            for &f in &fingers {
                choice[f] = rest % options[f].len();
                rest /= options[f].len();
            }
            let mut is_clear =
                |a: usize, b: usize| clashes.pair(&mut search.workspace, options, fingers[a], fingers[b], &choice);
            if table.is_closed(&choice, set) && (1..fingers.len()).all(|b| (0..b).all(|a| is_clear(a, b))) {
                n_closed += 1;
            }
        }
        // A finger that finds few contacts has little to choose from.
        let n_most = (FOOTHOLDS as f64).powi(fingers.len() as i32);
        let share = f64::from(n_closed) / n_most;
        held += share;
        (0..n).filter(|f| !fingers.contains(f)).for_each(|f| without[f] += share);
    }
    (without, held)
}
