//! Collision geometry that encloses the fingers: volumes that drivers of an arm keep clear, such as the `hand_safety_box` of TIAGo. No object can
//! be touched inside of one.

use super::touch::Touch;
use crate::hand::Hand;
use crate::robot::{LinkId, Robot};
use regrasp_base::Rng;
use std::collections::BTreeSet;

/// Postures that are looked at.
const POSTURES: usize = 100;

/// Radius of the ball around geometry that can be meant as it is, in metres: larger is a mesh in millimetres.
pub(crate) const LARGEST_RADIUS: f64 = 1.5;

/// Links of the palm, other than the base link, that touch the tips of more than half the fingers in every posture.
///
/// What a hand really has lets its fingertips away, or the hand would never hold anything with them. Meshes that are far too large are another
/// matter: nobody wants those left out.
pub(crate) fn enclosing_links(hand: &Hand) -> BTreeSet<LinkId> {
    let touch = Touch::new(hand);
    let mut enclosing: BTreeSet<LinkId> =
        hand.palm.iter().map(|shape| shape.link).filter(|&link| link != hand.base).collect();
    for shape in hand.palm.iter().filter(|shape| shape.placed.shape.bounding_sphere().1 > LARGEST_RADIUS) {
        enclosing.remove(&shape.link);
    }
    let tips: BTreeSet<LinkId> = hand.fingers.iter().map(|finger| finger.tip.link).collect();
    let mut rng = Rng::keyed(0, "enclosing", 0);
    for _ in 0..POSTURES {
        if enclosing.is_empty() {
            break;
        }
        let touching = touch.touching(&touch.draw_posture(&mut rng));
        let n_tips = |link: LinkId| {
            let pairs = touch.pairs.iter().zip(&touching).filter(|(_, touches)| **touches);
            let meets_tip =
                |(a, b): (LinkId, LinkId)| (a == link && tips.contains(&b)) || (b == link && tips.contains(&a));
            pairs.filter(|(pair, _)| meets_tip(**pair)).count()
        };
        enclosing.retain(|&link| 2 * n_tips(link) > tips.len());
    }
    enclosing
}

/// What is said of a link that [`enclosing_links`] found.
pub(crate) fn enclosing_note(robot: &Robot, link: LinkId) -> String {
    format!(
        "link \"{}\" touches most fingertips in every posture, so that no object could be held; its collision geometry is left out \
         (`without_geometry` in the hand file)",
        robot.links[link.0].name
    )
}
