//! Which contacts of the fingers make the grasp of a frame.

use super::contacts::{Foothold, MOST};
use crate::prepared::Prepared;
use arrayvec::ArrayVec;
use regrasp_grasp::{Contact, Grip, closure};
use regrasp_manipulation::grasp::state::MAX_FINGERS;
use regrasp_manipulation::model::Model;
use regrasp_robot::ContactModel;

/// Contacts of every finger.
pub type Options = ArrayVec<ArrayVec<Foothold, MOST>, MAX_FINGERS>;

/// A choice of contacts: an index among the options of each finger; none for a finger without a contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// By finger.
    pub chosen: ArrayVec<Option<usize>, MAX_FINGERS>,
    /// A lower bound of its closure margin.
    pub margin: f64,
}

/// Most choices that are looked at in a frame.
const MOST_CHOICES: usize = 1_000;
/// A finger more is worth so much margin: it makes a grasp firmer than the bound by three contacts says.
const WORTH_OF_A_FINGER: f64 = 0.1;

/// Choices in the order in which they are tried, and the largest margin seen. `may_be_free` says which fingers have room without
/// a contact.
pub fn choices(prepared: &Prepared, options: &Options, may_be_free: &[bool]) -> (Vec<Choice>, f64) {
    let model = prepared.model;
    let mut all = vec![ArrayVec::<Option<usize>, MAX_FINGERS>::new()];
    for (of_finger, is_free) in options.iter().zip(may_be_free) {
        let n_last = all.len();
        let with = |k: Option<usize>| {
            move |choice: &ArrayVec<Option<usize>, MAX_FINGERS>| {
                let mut longer = choice.clone();
                longer.push(k);
                longer
            }
        };
        let mut next = Vec::with_capacity(n_last * (of_finger.len() + 1));
        for k in 0..of_finger.len() {
            next.extend(all.iter().map(with(Some(k))));
        }
        if *is_free {
            next.extend(all.iter().map(with(None)));
        }
        next.truncate(MOST_CHOICES);
        all = next;
    }
    let is_soft = model.fingers.iter().any(|finger| matches!(finger.contact, ContactModel::SoftFinger { .. }));
    let least = prepared.least_contacts();
    let triples = Triples::of(model, options);
    let mut best = 0.0f64;
    let mut found: Vec<Choice> = all
        .into_iter()
        .filter(|chosen| chosen.iter().flatten().count() >= least)
        .map(|chosen| {
            let mut margin = triples.margin(&chosen);
            if is_soft && margin < prepared.settings.margin {
                margin = margin.max(margin_of(model, options, &chosen, prepared.settings.margin));
            }
            best = best.max(margin);
            Choice { chosen, margin }
        })
        .collect();
    found.retain(|choice| choice.margin >= prepared.settings.margin);
    let worth =
        |choice: &Choice| choice.margin * (1.0 + WORTH_OF_A_FINGER * choice.chosen.iter().flatten().count() as f64);
    found.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    (found, best)
}

/// The margin of a choice by all its contacts.
fn margin_of(model: &Model, options: &Options, chosen: &[Option<usize>], enough: f64) -> f64 {
    let grips: ArrayVec<Grip, MAX_FINGERS> =
        (0..chosen.len()).filter_map(|f| chosen[f].map(|k| model.grip(f, &options[f][k].place.contact))).collect();
    closure::closure_margin(&grips, &model.frame, enough)
}

/// Margins of three contacts of three fingers, taken as points.
struct Triples {
    /// By three fingers and three options.
    margins: Vec<((usize, usize, usize), Vec<f64>)>,
    n_options: Vec<usize>,
}

impl Triples {
    fn of(model: &Model, options: &Options) -> Self {
        let n_options: Vec<usize> = options.iter().map(|of_finger| of_finger.len()).collect();
        let rubs = |f: usize| model.fingers[f].contact != ContactModel::Frictionless && model.frame.friction > 0.0;
        let contact = |f: usize, k: usize| -> Contact { options[f][k].place.contact };
        let mut margins = Vec::new();
        let n = options.len();
        for a in (0..n).filter(|&f| rubs(f)) {
            for b in (a + 1..n).filter(|&f| rubs(f)) {
                for c in (b + 1..n).filter(|&f| rubs(f)) {
                    let mut of_three = Vec::with_capacity(n_options[a] * n_options[b] * n_options[c]);
                    for i in 0..n_options[a] {
                        for j in 0..n_options[b] {
                            for k in 0..n_options[c] {
                                let triple = [contact(a, i), contact(b, j), contact(c, k)];
                                let proof = closure::three::prove(&triple, &model.frame);
                                of_three.push(proof.map_or(0.0, |(margin, _)| margin));
                            }
                        }
                    }
                    margins.push(((a, b, c), of_three));
                }
            }
        }
        Triples { margins, n_options }
    }

    /// The best of three contacts of a choice.
    fn margin(&self, chosen: &[Option<usize>]) -> f64 {
        let of_three = |((a, b, c), margins): &((usize, usize, usize), Vec<f64>)| {
            let (i, j, k) = (chosen[*a]?, chosen[*b]?, chosen[*c]?);
            Some(margins[(i * self.n_options[*b] + j) * self.n_options[*c] + k])
        };
        self.margins.iter().filter_map(of_three).fold(0.0, f64::max)
    }
}
