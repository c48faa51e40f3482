//! Links of one finger that are in each other's way whatever the finger does: hulls of phalanges that reach into each other, or keep apart by
//! less than planners ask for. Where such a pair is tested, the finger has no posture to hold anything with.

use super::touch::Touch;
use crate::hand::Hand;
use crate::robot::{LinkId, Robot};
use regrasp_base::Rng;
use std::collections::BTreeSet;

/// Postures that are looked at.
const POSTURES: usize = 100;
/// Distance within which links are in each other's way, in metres: what the first search of a plan keeps.
const NEAR: f64 = 0.001;
/// Share of the postures from which on a pair is excused. By hand: of the thumb of TIAGo's Hey5 hand, the hulls of the link that spreads and the next
/// one meet in 0.66 of the postures. With these two tested it finds no contact at all.
const MOSTLY: f64 = 0.5;

/// Pairs of links of one finger, smaller first, that are nearer than [`NEAR`] in most postures.
pub(crate) fn crowded_pairs(hand: &Hand) -> BTreeSet<(LinkId, LinkId)> {
    let touch = Touch::new(hand);
    let mut rng = Rng::keyed(0, "crowded", 0);
    let mut counts = vec![0usize; touch.pairs.len()];
    for _ in 0..POSTURES {
        let near = touch.near_in_fingers(&touch.draw_posture(&mut rng), NEAR);
        counts.iter_mut().zip(near).for_each(|(count, near)| *count += usize::from(near));
    }
    let is_crowded = |count: usize| count as f64 >= MOSTLY * POSTURES as f64;
    touch.pairs.iter().zip(counts).filter(|(_, count)| is_crowded(*count)).map(|(pair, _)| *pair).collect()
}

/// Pairs that are named; of more the number is said.
const NAMED: usize = 3;

/// What is said of pairs that [`crowded_pairs`] found.
pub(crate) fn crowded_note(robot: &Robot, pairs: &BTreeSet<(LinkId, LinkId)>) -> String {
    let name = |link: LinkId| &robot.links[link.0].name;
    let named = pairs.iter().take(NAMED).map(|&(a, b)| format!("\"{}\" and \"{}\"", name(a), name(b)));
    let named = named.collect::<Vec<_>>().join(", ");
    let others = match pairs.len().saturating_sub(NAMED) {
        0 => String::new(),
        1 => ", and one more pair".to_owned(),
        n => format!(", and {n} more pairs"),
    };
    format!(
        "links of one finger that are within {} mm of each other in most postures are not tested against each other (`allow` in the hand file): \
         {named}{others}",
        1e3 * NEAR
    )
}
