//! Links that are in each other's way whatever the fingers do: hulls of phalanges that reach into each other, or keep apart by
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
/// The same for links with something between them that has no geometry, or is held. By hand: the thumb of a hand whose knuckle is not modelled
/// meets the box of its palm in more than half of the postures, and in the others it holds things.
const NEARLY_ALWAYS: f64 = 0.9;

/// Pairs of links of one finger, smaller first, that are nearer than [`NEAR`] in most postures.
pub(crate) fn crowded_pairs(hand: &Hand) -> BTreeSet<(LinkId, LinkId)> {
    let touch = Touch::new(hand);
    near_in(&touch, &touch.of_one_finger(), MOSTLY)
}

/// Those of `pairs` that are nearer than [`NEAR`] in nearly all postures.
pub(crate) fn inseparable_pairs(hand: &Hand, pairs: &BTreeSet<(LinkId, LinkId)>) -> BTreeSet<(LinkId, LinkId)> {
    if pairs.is_empty() {
        return BTreeSet::new();
    }
    let touch = Touch::new(hand);
    let asked: Vec<bool> = touch.pairs.iter().map(|pair| pairs.contains(pair)).collect();
    near_in(&touch, &asked, NEARLY_ALWAYS)
}

/// The pairs `asked` for that are nearer than [`NEAR`] in this share of the postures.
fn near_in(touch: &Touch, asked: &[bool], share: f64) -> BTreeSet<(LinkId, LinkId)> {
    let mut rng = Rng::keyed(0, "crowded", 0);
    let mut counts = vec![0usize; touch.pairs.len()];
    for _ in 0..POSTURES {
        let near = touch.near(asked, &touch.draw_posture(&mut rng), NEAR);
        counts.iter_mut().zip(near).for_each(|(count, near)| *count += usize::from(near));
    }
    let is_crowded = |count: usize| count as f64 >= share * POSTURES as f64;
    touch.pairs.iter().zip(counts).filter(|(_, count)| is_crowded(*count)).map(|(pair, _)| *pair).collect()
}

/// Pairs that are named; of more the number is said.
const NAMED: usize = 3;

/// What is said of pairs that [`crowded_pairs`] found.
pub(crate) fn crowded_note(robot: &Robot, pairs: &BTreeSet<(LinkId, LinkId)>) -> String {
    format!(
        "links of one finger that are within {} mm of each other in most postures are not tested against each other (`allow` in the hand file): \
         {}",
        1e3 * NEAR,
        named(robot, pairs)
    )
}

/// What is said of pairs that [`inseparable_pairs`] found.
pub(crate) fn inseparable_note(robot: &Robot, pairs: &BTreeSet<(LinkId, LinkId)>) -> String {
    format!(
        "links with only bodies without collision geometry, or held joints, between them that are within {} mm of each other in nearly all postures \
         are not tested against each other: {}",
        1e3 * NEAR,
        named(robot, pairs)
    )
}

/// The first of `pairs`, and how many more there are.
fn named(robot: &Robot, pairs: &BTreeSet<(LinkId, LinkId)>) -> String {
    let name = |link: LinkId| &robot.links[link.0].name;
    let named = pairs.iter().take(NAMED).map(|&(a, b)| format!("\"{}\" and \"{}\"", name(a), name(b)));
    let named = named.collect::<Vec<_>>().join(", ");
    let others = match pairs.len().saturating_sub(NAMED) {
        0 => String::new(),
        1 => ", and one more pair".to_owned(),
        n => format!(", and {n} more pairs"),
    };
    named + &others
}
