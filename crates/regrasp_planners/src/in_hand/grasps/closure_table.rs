//! Closure of every set of fingers over candidates.

use crate::in_hand::attempt::release::Held;
use crate::in_hand::grasps::candidate::{Candidate, Choice};
use arrayvec::ArrayVec;
use regrasp_grasp::{Contact, ContactModel, Grip, closure};
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::Model;
use std::collections::BTreeMap;

/// Closure of every set of fingers over candidates, computed when first asked for.
#[derive(Debug)]
pub struct ClosureTable<'a> {
    model: &'a Model<'a>,
    options: &'a [Vec<Candidate>],
    n_options: usize,
    /// Margin from which on a set is closed.
    enough: f64,
    /// Which sets of fingers are looked at.
    sets: Sets,
    /// Margin of three fingers with their options, NaN where not asked for yet; triples i < j < k are numbered by k, j, i.
    triples: Vec<f64>,
    /// Margin of a pair of (finger, option), NaN where not asked for yet; none without soft fingers.
    pairs: Vec<f64>,
    /// Margin of all fingers of a set together, where pairs and triples are not enough.
    larger: BTreeMap<(u32, Choice), f64>,
    /// What letting each finger go was seen to come to.
    releases: [Held; MAX_FINGERS],
}

/// Which sets of fingers may be closed where no smaller one of them is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sets {
    /// Triples of points and pairs of soft fingertips. Four points of which no three are closed hold, but let nobody go: with four
    /// fingers they are of no use.
    Few,
    /// Any.
    All,
}

impl<'a> ClosureTable<'a> {
    /// An empty table over `options[finger]`, for the margin of the settings.
    pub fn new(model: &'a Model<'a>, options: &'a [Vec<Candidate>]) -> Self {
        ClosureTable::with_margin(model, options, model.settings.closure_margin)
    }

    /// An empty table over `options[finger]`; closed is what has the margin `enough`.
    pub fn with_margin(model: &'a Model<'a>, options: &'a [Vec<Candidate>], enough: f64) -> Self {
        let n_options = options.iter().map(Vec::len).max().unwrap_or(0);
        let n = options.len();
        let n_triples = n * n.saturating_sub(1) * n.saturating_sub(2) / 6;
        let are_points = model.fingers.iter().all(|finger| finger.contact == ContactModel::Point);
        let has_soft = model.fingers.iter().any(|finger| matches!(finger.contact, ContactModel::SoftFinger { .. }));
        ClosureTable {
            model,
            options,
            n_options,
            enough,
            sets: if are_points && n <= 4 { Sets::Few } else { Sets::All },
            triples: vec![f64::NAN; n_triples * n_options.pow(3)],
            pairs: vec![f64::NAN; if has_soft { (n * n_options).pow(2) } else { 0 }],
            larger: BTreeMap::new(),
            releases: Default::default(),
        }
    }

    /// As [`ClosureTable::new`], where grasps that let nobody go count too.
    pub fn of_all_sets(model: &'a Model<'a>, options: &'a [Vec<Candidate>]) -> Self {
        ClosureTable { sets: Sets::All, ..ClosureTable::new(model, options) }
    }

    /// Contact of a finger with its option, which is none of a free posture.
    fn contact(&self, finger: usize, choice: &Choice) -> Contact {
        self.options[finger][choice[finger]].contact.expect("only fingers that hold are asked about")
    }

    /// Fingers whose options are contacts, as bits.
    pub fn holding(&self, choice: &Choice) -> u32 {
        let holds = |&f: &usize| self.options[f][choice[f]].contact.is_some();
        (0..choice.len()).filter(holds).fold(0, |bits, f| bits | 1 << f)
    }

    /// Margin of three fingers, in rising order, with their options, as points.
    fn triple(&mut self, fingers: [usize; 3], choice: &Choice) -> f64 {
        let [i, j, k] = fingers;
        let m = self.n_options;
        let which = k * (k - 1) * (k - 2) / 6 + j * (j - 1) / 2 + i;
        let index = ((which * m + choice[i]) * m + choice[j]) * m + choice[k];
        if self.triples[index].is_nan() {
            let contacts = fingers.map(|f| self.contact(f, choice));
            let is_smooth = |&f: &usize| self.model.fingers[f].contact == ContactModel::Frictionless;
            self.triples[index] = match fingers.iter().any(is_smooth) {
                true => 0.0,
                false => closure::three::prove(&contacts, &self.model.frame).map_or(0.0, |(margin, _)| margin),
            };
        }
        self.triples[index]
    }

    /// Margin of two fingers with their options.
    fn pair(&mut self, fingers: [usize; 2], choice: &Choice) -> f64 {
        let [i, j] = fingers;
        let (n, m) = (self.options.len(), self.n_options);
        let index = ((i * n + j) * m + choice[i]) * m + choice[j];
        if self.pairs[index].is_nan() {
            self.pairs[index] = self.together(&fingers, choice);
        }
        self.pairs[index]
    }

    /// Margin in which all of `fingers` take part with their options, up to the one asked for.
    fn together(&self, fingers: &[usize], choice: &Choice) -> f64 {
        let grips: ArrayVec<Grip, MAX_FINGERS> =
            fingers.iter().map(|&f| self.model.grip(f, &self.contact(f, choice))).collect();
        let models: ArrayVec<ContactModel, MAX_FINGERS> = grips.iter().map(|grip| grip.model).collect();
        match closure::may_close(&models, self.model.frame.friction) {
            true => closure::general::prove(&grips, &self.model.frame, self.enough).margin(),
            false => 0.0,
        }
    }

    /// Margin of the fingers whose bit is set in `among` and whose options are contacts: the first found that is enough,
    /// or the largest.
    pub fn margin(&mut self, choice: &Choice, among: u32) -> f64 {
        let holding = among & self.holding(choice);
        let enough = self.enough;
        let fingers: ArrayVec<usize, MAX_FINGERS> =
            (0..self.options.len()).filter(|&f| holding & (1 << f) != 0).collect();
        let best = self.margin_of_few(choice, &fingers);
        if self.sets == Sets::Few || best >= enough {
            return best;
        }
        let n = fingers.len();
        let is_point = |&f: &usize| self.model.fingers[f].contact == ContactModel::Point;
        if n < 3 || (n == 3 && fingers.iter().all(is_point)) {
            return best;
        }
        // Who does not hold does not matter.
        let key = (holding, (0..choice.len()).map(|f| if fingers.contains(&f) { choice[f] } else { 0 }).collect());
        let together = match self.larger.get(&key) {
            Some(&known) => known,
            None => {
                let found = self.together(&fingers, choice);
                self.larger.insert(key, found);
                found
            }
        };
        best.max(together)
    }

    /// Margin of triples of points and pairs of soft fingertips among `fingers`: the first found that is enough, or the largest.
    fn margin_of_few(&mut self, choice: &Choice, fingers: &[usize]) -> f64 {
        let (n, enough) = (fingers.len(), self.enough);
        let mut best = 0.0f64;
        for i in 0..n {
            for j in i + 1..n {
                for k in j + 1..n {
                    best = best.max(self.triple([fingers[i], fingers[j], fingers[k]], choice));
                    if best >= enough {
                        return best;
                    }
                }
            }
        }
        if !self.pairs.is_empty() {
            for i in 0..n {
                for j in i + 1..n {
                    best = best.max(self.pair([fingers[i], fingers[j]], choice));
                    if best >= enough {
                        return best;
                    }
                }
            }
        }
        best
    }

    /// What `look` says where only triples of points and pairs of soft fingertips count as closed. Their number does not grow with that
    /// of all combinations.
    pub fn of_few<T>(&mut self, look: impl FnOnce(&mut Self) -> T) -> T {
        let sets = std::mem::replace(&mut self.sets, Sets::Few);
        let seen = look(self);
        self.sets = sets;
        seen
    }

    /// True where sets larger than triples and pairs count.
    pub fn sees_larger(&self) -> bool {
        self.sets == Sets::All
    }

    /// Number of larger sets whose margin was computed.
    pub fn n_larger(&self) -> usize {
        self.larger.len()
    }

    /// True when those of the fingers of `among` whose options are contacts keep the required margin.
    pub fn is_closed(&mut self, choice: &Choice, among: u32) -> bool {
        self.margin(choice, among) >= self.enough
    }

    /// Number of fingers that the others would let go, or that are free, in a choice that is closed.
    pub fn n_releasable(&mut self, choice: &Choice) -> usize {
        let n = self.options.len();
        let (holding, enough) = (self.holding(choice), self.enough);
        let mut n_releasable = 0;
        for finger in 0..n {
            if holding & (1 << finger) == 0 {
                n_releasable += 1;
                continue;
            }
            let best = self.margin(choice, holding & !(1 << finger));
            let is_held = best >= enough;
            self.releases[finger].add(&Held { n_grasps: 1, n_held: u64::from(is_held), best });
            n_releasable += usize::from(is_held);
        }
        n_releasable
    }

    /// What was seen so far of letting each finger go.
    pub fn releases(&self) -> &[Held] {
        &self.releases
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::in_hand::grasps::sample::draw_state;
    use crate::in_hand::roadmap_tests::with_search;

    /// Every set of fingers counts as closed where the margin that plans promise is enough, and nowhere else.
    #[test]
    fn the_table_agrees_with_the_margin_of_the_model() {
        for (scene, n_fingers) in [("six_finger_box_90x.toml", 6), ("box_90x.toml", 4)] {
            with_search(scene, |search| {
                let states: Vec<_> = (0..200).filter_map(|_| draw_state(search)).take(12).collect();
                let model = search.model();
                let of_finger = |finger: usize| states.iter().map(|state| Candidate::present(state, finger)).collect();
                let options: Vec<Vec<Candidate>> = (0..n_fingers).map(of_finger).collect();
                let mut table = ClosureTable::new(model, &options);
                let mut seen = [[0; 2]; MAX_FINGERS + 1];
                let mut n_only_larger = 0;
                for _ in 0..4000 {
                    let choice: Choice = (0..n_fingers).map(|_| search.rng.below(states.len())).collect();
                    let among = search.rng.below(1 << n_fingers) as u32;
                    let contacts: Vec<Contact> = (0..n_fingers).map(|f| table.contact(f, &choice)).collect();
                    let margin = model.closure_margin(&contacts, among);
                    let is_closed = margin >= model.settings.closure_margin;
                    let n_holding = among.count_ones() as usize;
                    // Of four fingers all together are of no use: they let nobody go.
                    if n_fingers == 4 && n_holding == 4 {
                        assert!(is_closed || !table.is_closed(&choice, among), "{choice:?}: {margin}");
                        continue;
                    }
                    // What few fingers close is closed, and of three there is nothing else.
                    let few_close = table.of_few(|table| table.is_closed(&choice, among));
                    assert!(is_closed || !few_close, "{scene} {choice:?} {among:b}: {margin}");
                    assert!(n_holding > 3 || few_close == is_closed, "{scene} {choice:?} {among:b}: {margin}");
                    n_only_larger += usize::from(is_closed && !few_close);
                    assert_eq!(table.is_closed(&choice, among), is_closed, "{scene} {choice:?} {among:b}: {margin}");
                    seen[n_holding][usize::from(is_closed)] += 1;
                }
                assert!((3..n_fingers).all(|n| seen[n].iter().all(|&count| count >= 5)), "{seen:?}");
                assert!(n_fingers == 4 || n_only_larger >= 5, "{n_only_larger}");
            });
        }
    }
}
