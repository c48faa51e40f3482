//! Links that are in each other's way whatever the fingers do: hulls of phalanges that reach into each other, or keep apart by
//! less than planners ask for. Where such a pair is tested, the finger has no posture to hold anything with.

use super::touch::Touch;
use crate::hand::Hand;
use crate::robot::{LinkId, Robot};
use regrasp_base::Rng;
use std::collections::BTreeSet;

/// Postures that are looked at.
const POSTURES: usize = 100;
/// Postures that stand for every one.
const EVERY_POSTURE: usize = 3_000;
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
    near_in(&touch, &touch.of_one_finger(), NEAR, (MOSTLY, POSTURES))
}

/// Pairs of links, smaller first, that touch in every posture, but for those of the links of fingertips: hulls of a palm and of the second links of
/// its fingers, often. A fingertip that is never free says that something else is wrong.
pub(crate) fn stuck_pairs(hand: &Hand) -> BTreeSet<(LinkId, LinkId)> {
    let touch = Touch::new(hand);
    let is_tip = |link: LinkId| hand.fingers.iter().any(|finger| finger.tip.link == link);
    let no_tip: Vec<bool> = touch.pairs.iter().map(|&(a, b)| !is_tip(a) && !is_tip(b)).collect();
    let few = near_in(&touch, &no_tip, 0.0, (1.0, POSTURES));
    if few.is_empty() {
        return few;
    }
    let asked: Vec<bool> = touch.pairs.iter().map(|pair| few.contains(pair)).collect();
    near_in(&touch, &asked, 0.0, (1.0, EVERY_POSTURE))
}

/// Those of `pairs` that are nearer than [`NEAR`] in nearly all postures.
pub(crate) fn inseparable_pairs(hand: &Hand, pairs: &BTreeSet<(LinkId, LinkId)>) -> BTreeSet<(LinkId, LinkId)> {
    if pairs.is_empty() {
        return BTreeSet::new();
    }
    let touch = Touch::new(hand);
    let asked: Vec<bool> = touch.pairs.iter().map(|pair| pairs.contains(pair)).collect();
    near_in(&touch, &asked, NEAR, (NEARLY_ALWAYS, POSTURES))
}

/// The pairs `asked` for that are nearer than `distance`, in metres, in this share of so many postures.
fn near_in(
    touch: &Touch,
    asked: &[bool],
    distance: f64,
    (share, n_postures): (f64, usize),
) -> BTreeSet<(LinkId, LinkId)> {
    let mut rng = Rng::keyed(0, "crowded", 0);
    let mut counts = vec![0usize; touch.pairs.len()];
    for _ in 0..n_postures {
        let near = touch.near(asked, &touch.draw_posture(&mut rng), distance);
        counts.iter_mut().zip(near).for_each(|(count, near)| *count += usize::from(near));
    }
    let is_crowded = |count: usize| count as f64 >= share * n_postures as f64;
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

/// What is said of pairs that [`stuck_pairs`] found.
pub(crate) fn stuck_note(robot: &Robot, pairs: &BTreeSet<(LinkId, LinkId)>) -> String {
    format!(
        "links that touch in every posture are not tested against each other (`allow` in the hand file): {}",
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

#[cfg(test)]
mod tests {
    use crate::import::{LoadOptions, LoadedHand, load_hand};
    use crate::inspect::hand_file_text;
    use crate::inspect::touch::Touch;
    use std::collections::BTreeSet;
    use std::path::Path;

    /// Two fingers of three links, 3 cm each, on a root with a plate at height `plate`, in metres.
    fn urdf(plate: f64) -> String {
        let finger = |name: &str, x: f64| -> String {
            let of = |parent: &str, link: &str, x: f64, z: f64| {
                format!(
                    r#"<link name="{name}_{link}"><collision><origin xyz="0 0 0.015"/><geometry><capsule radius="0.005" length="0.03"/></geometry></collision></link>
<joint name="{name}_{link}_joint" type="revolute"><parent link="{parent}"/><child link="{name}_{link}"/><origin xyz="{x} 0 {z}"/><axis xyz="0 1 0"/><limit lower="-0.4" upper="0.4"/></joint>
"#
                )
            };
            let [a, b] = ["a", "b"].map(|link| format!("{name}_{link}"));
            of("root", "a", x, 0.0) + &of(&a, "b", 0.0, 0.03) + &of(&b, "c", 0.0, 0.03)
        };
        format!(
            r#"<robot name="r"><link name="root"><collision><origin xyz="0 0 {plate}"/><geometry><box size="0.1 0.1 0.02"/></geometry></collision></link>{}{}</robot>"#,
            finger("i", 0.03),
            finger("t", -0.03)
        )
    }

    fn read(folder: &Path, name: &str) -> LoadedHand {
        load_hand(&folder.join(name), &LoadOptions::default()).unwrap()
    }

    /// A palm that reaches up into the second links: with these tested no finger has a posture.
    #[test]
    fn links_that_touch_in_every_posture_are_not_tested() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("hand.urdf"), urdf(0.03)).unwrap();
        let loaded = read(folder.path(), "hand.urdf");
        let hand = &loaded.hand;
        for (a, b, may) in [("root", "i_b", true), ("root", "t_b", true), ("root", "i_c", false), ("i_b", "t_b", false)]
        {
            let [first, second] = [a, b].map(|name| hand.robot.link_named(name).unwrap());
            assert_eq!(hand.may_touch(first, second), may, "{a} {b}");
        }
        let note = "links that touch in every posture are not tested";
        let said: Vec<&String> = loaded.notes.iter().filter(|text| text.starts_with(note)).collect();
        assert!(said.len() == 1 && said[0].ends_with(": \"root\" and \"i_b\", \"root\" and \"t_b\""), "{said:?}");

        let rest: Vec<Vec<f64>> = hand.fingers.iter().map(|finger| finger.rest.clone()).collect();
        assert!(!Touch::new(hand).touching(&rest).contains(&true), "{rest:?}");

        // The file that is written says so.
        let text = hand_file_text(hand, "hand.urdf", &BTreeSet::new());
        std::fs::write(folder.path().join("hand.toml"), text).unwrap();
        assert_eq!(read(folder.path(), "hand.toml").hand.allowed_pairs, hand.allowed_pairs);

        // A palm that ends half a millimetre below them at most, and that they meet where the first links lean; a palm far below.
        for plate in [0.0145, -0.02] {
            std::fs::write(folder.path().join("hand.urdf"), urdf(plate)).unwrap();
            let tested = read(folder.path(), "hand.urdf");
            let [palm, second] = ["root", "i_b"].map(|name| tested.hand.robot.link_named(name).unwrap());
            assert!(!tested.hand.may_touch(palm, second), "{plate}");
            assert!(!tested.notes.iter().any(|text| text.starts_with(note)), "{plate}: {:?}", tested.notes);
        }
    }
}
