//! The grasps of a roadmap: each finger has a list of contacts spread over the object, the same at every place, so that
//! grasps of one place share footholds and grasps of different places share contacts.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::{Candidate, Choice};
use crate::in_hand::grasps::closure_table::ClosureTable;
use crate::in_hand::grasps::combine::ClashTable;
use crate::settings::ReleaseRule;
use regrasp_base::Rng;
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::contact::reach;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_manipulation::model::Model;

/// Contacts drawn for one, of which the one farthest from those before is taken.
const CANDIDATES: usize = 12;
/// Draws for one contact before the surface counts as used up.
const TRIES: usize = 200;
/// Postures tried for a contact at a place.
const POSTURES: usize = 2;

/// Up to `n` contacts of each finger, spread over the object so that the first few are spread as well.
pub fn spread_contacts(model: &Model, n: usize, seed: u64) -> Vec<Vec<Contact>> {
    (0..model.n_fingers())
        .map(|finger| {
            let mut rng = Rng::keyed(seed, "roadmap_contacts", finger as u64);
            let mut contacts: Vec<Contact> = Vec::with_capacity(n);
            for _ in 0..n {
                let mut best: Option<(f64, Contact)> = None;
                let mut n_drawn = 0;
                for _ in 0..TRIES {
                    let Some(contact) = draw(model, finger, &mut rng) else { continue };
                    let nearest =
                        contacts.iter().map(|other| apart(model, &contact, other)).fold(f64::INFINITY, f64::min);
                    if best.as_ref().is_none_or(|(farthest, _)| nearest > *farthest) {
                        best = Some((nearest, contact));
                    }
                    n_drawn += 1;
                    if n_drawn == CANDIDATES {
                        break;
                    }
                }
                contacts.extend(best.map(|(_, contact)| contact));
            }
            contacts
        })
        .collect()
}

/// A contact drawn by area, as the fingertip really touches, off the creases.
fn draw(model: &Model, finger: usize, rng: &mut Rng) -> Option<Contact> {
    let object = &model.view.object;
    let drawn = object.surface.sample(rng);
    let settled = object.surface.settle(&drawn, model.fingers[finger].settle_radius)?;
    model
        .keeps_off_edges(&settled)
        .then_some(Contact { point_in_object: settled.point_in_object, normal_in_object: settled.normal_in_object })
}

/// How different two contacts are: in place, and in direction so that the two sides of a thin object are far apart.
pub fn apart(model: &Model, a: &Contact, b: &Contact) -> f64 {
    let turned = (a.normal_in_object.into_inner() - b.normal_in_object.into_inner()).norm();
    (a.point_in_object - b.point_in_object).norm() + 0.3 * model.turn_length() * turned
}

/// Contacts that each finger reaches with the object at a pose, with joints.
#[derive(Debug, Clone, Default)]
pub struct Reached {
    /// Candidates of every finger, in the order of the contacts.
    pub options: Vec<Vec<Candidate>>,
    /// Position of each in its finger's list of contacts.
    pub which: Vec<Vec<usize>>,
}

impl Reached {
    /// At a pose, of the contacts given for every finger.
    pub fn at(search: &mut Search, pose: &Pose, contacts: &[Vec<Contact>]) -> Self {
        let placement = Placement::from(pose);
        let mut reached = Reached::default();
        for (finger, of_finger) in contacts.iter().enumerate() {
            search.workspace.place_object(pose);
            let (mut options, mut which) = (Vec::new(), Vec::new());
            for (index, contact) in of_finger.iter().enumerate() {
                search.n_samples += 1;
                let joints = (0..POSTURES)
                    .find_map(|_| reach(&mut search.workspace, finger, contact, &placement, &mut search.rng));
                if let Some(joints) = joints {
                    options.push(Candidate { contact: Some(*contact), joints, follow: 1.0 });
                    which.push(index);
                }
            }
            reached.options.push(options);
            reached.which.push(which);
        }
        reached
    }

    /// The same with only the first `n` contacts of every finger.
    #[must_use]
    pub fn of_first(&self, n: usize) -> Self {
        let mut fewer = self.clone();
        for (options, which) in fewer.options.iter_mut().zip(&mut fewer.which) {
            let n_kept = which.partition_point(|&index| index < n);
            options.truncate(n_kept);
            which.truncate(n_kept);
        }
        fewer
    }

    /// All grasps that the candidates make, closed and clear, with a finger that may let go; at most `limit`.
    pub fn grasps(&self, search: &mut Search, pose: &Pose, limit: usize) -> Vec<GraspState> {
        let found = Vec::new();
        if self.options.iter().any(Vec::is_empty) {
            return found;
        }
        search.workspace.place_object(pose);
        let mut grasps = GraspsAt {
            pose,
            limit,
            clashes: ClashTable::new(&self.options),
            table: ClosureTable::new(search.model(), &self.options),
            found,
        };
        self.complete(search, &mut grasps, &mut Choice::new());
        grasps.found
    }

    /// Completes a choice for the first fingers in all ways.
    fn complete(&self, search: &mut Search, grasps: &mut GraspsAt, choice: &mut Choice) {
        let n = self.options.len();
        let finger = choice.len();
        if finger == n {
            let n_releasable = grasps.table.n_releasable(choice);
            let rule = search.settings.search.release_rule;
            let enough = if rule == ReleaseRule::EverywhereEveryFinger { n } else { 1 };
            if n_releasable >= enough && grasps.found.len() < grasps.limit {
                let chosen = |f: usize| &self.options[f][choice[f]];
                let fingers = (0..n).map(|f| (chosen(f).contact, chosen(f).joints.clone()));
                grasps.found.push(GraspState::of(*grasps.pose, fingers));
            }
            return;
        }
        for option in 0..self.options[finger].len() {
            choice.push(option);
            if (0..finger).all(|other| grasps.clashes.pair(&mut search.workspace, &self.options, other, finger, choice))
            {
                self.complete(search, grasps, choice);
            }
            choice.pop();
        }
    }
}

/// Grasps at one pose, as far as they have been found.
struct GraspsAt<'g> {
    pose: &'g Pose,
    /// Most grasps wanted.
    limit: usize,
    clashes: ClashTable,
    table: ClosureTable<'g>,
    found: Vec<GraspState>,
}
