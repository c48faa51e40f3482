//! Which places of three fingers close the object, before inverse kinematics is asked about them.

use super::contacts::{Candidates, Foothold};
use crate::prepared::Prepared;
use regrasp_grasp::closure;

/// Places of a finger that are looked at together with each contact of the first finger.
const PLACES: usize = 10;

/// A contact of the first finger and places of two others that close the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triple {
    /// Index among the contacts of the first finger.
    pub first: usize,
    /// Two other fingers, each with the index of its place: indices among the candidates.
    pub others: [(usize, usize); 2],
    /// A lower bound of the closure margin.
    pub margin: f64,
}

/// Triples whose margin is large enough, the largest first, and the largest margin seen. `others` are the candidates of all fingers but
/// the first one.
pub fn triples(prepared: &Prepared, firsts: &[Foothold], others: &[Candidates]) -> (Vec<Triple>, f64) {
    let frame = &prepared.model.frame;
    let (mut found, mut best) = (Vec::new(), 0.0f64);
    for (first, foothold) in firsts.iter().enumerate() {
        let normal = &foothold.place.contact.normal_in_object;
        let facing = |candidates: &Candidates| -> Vec<usize> {
            let of = |k: &usize| candidates.places[*k].contact.normal_in_object.dot(normal);
            let mut order: Vec<usize> = (0..candidates.places.len()).collect();
            order.sort_by(|a, b| of(a).total_cmp(&of(b)));
            order.truncate(PLACES);
            order
        };
        let places: Vec<Vec<usize>> = others.iter().map(facing).collect();
        for a in 0..others.len() {
            for b in a + 1..others.len() {
                for &i in &places[a] {
                    for &j in &places[b] {
                        let contacts = [foothold.place, others[a].places[i], others[b].places[j]];
                        let proof = closure::three::prove(&contacts.map(|place| place.contact), frame);
                        let Some((margin, _)) = proof else { continue };
                        best = best.max(margin);
                        if margin >= prepared.settings.margin {
                            found.push(Triple { first, others: [(a, i), (b, j)], margin });
                        }
                    }
                }
            }
        }
    }
    found.sort_by(|a, b| b.margin.total_cmp(&a.margin));
    (found, best)
}
