//! Rest postures: the middle of the limits, bent a little towards the point that all tips surround.

use super::touch::Touch;
use crate::hand::Hand;
use regrasp_base::Rng;
use regrasp_geometry::Point;

/// Part of its range that the joint which moves the tip most towards the centre is bent by.
const BEND: f64 = 0.15;
/// Parts that are tried, in this order.
const BENDS: [f64; 6] = [BEND, BEND / 2.0, 0.0, -BEND, -2.0 * BEND, -3.0 * BEND];
/// Distances of the tips' links from the palm at rest, in metres, the first that some bend keeps: room for an object, by hand.
const OFF_THE_PALM: [f64; 3] = [0.015, 0.008, 0.003];
/// Postures drawn where no bend keeps the tips off the palm.
const DRAWN: usize = 2000;

/// Sets the rest posture of every finger; as much bent as nothing touches, by halves.
pub(crate) fn bend_towards_palm(hand: &mut Hand) {
    let middle: Vec<Vec<f64>> = hand
        .fingers
        .iter()
        .map(|finger| {
            let ends = finger.chain.lower.iter().zip(&finger.chain.upper);
            ends.map(|(&low, &high)| if low.is_finite() && high.is_finite() { 0.5 * (low + high) } else { 0.0 })
                .collect()
        })
        .collect();
    let tips: Vec<Point> =
        hand.fingers.iter().zip(&middle).map(|(finger, q)| finger.chain.tip(q, &finger.tip.center_in_body)).collect();
    let center =
        Point::from(tips.iter().map(|tip| tip.coords).sum::<nalgebra::Vector3<f64>>() / tips.len().max(1) as f64);
    let directions: Vec<Vec<f64>> =
        (0..hand.fingers.len()).map(|f| bend_direction(hand, f, &middle[f], &center)).collect();
    let touch = Touch::new(hand);
    let bent = |amount: f64| -> Vec<Vec<f64>> {
        middle.iter().zip(&directions).map(|(q, d)| q.iter().zip(d).map(|(q, d)| q + amount * d).collect()).collect()
    };
    let is_free = |posture: &Vec<Vec<f64>>| touch.touching(posture).iter().all(|touching| !touching);
    let free: Vec<Vec<Vec<f64>>> = BENDS.into_iter().map(bent).filter(is_free).collect();
    let keeps_off = |distance: &f64| free.iter().find(|posture| touch.tips_keep_off_the_palm(posture, *distance));
    let posture = OFF_THE_PALM.iter().find_map(keeps_off).cloned();
    let posture = posture.or_else(|| drawn_off_the_palm(&touch, &middle)).or_else(|| free.first().cloned());
    for (finger, rest) in hand.fingers.iter_mut().zip(posture.unwrap_or(middle)) {
        finger.rest = rest;
    }
}

/// A posture in which nothing touches and every tip is off the palm, drawn at random ever farther from the middle of the limits: for
/// hands whose fingers touch, or curl into the palm, there.
fn drawn_off_the_palm(touch: &Touch, middle: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let mut rng = Rng::keyed(0, "rest_posture", 0);
    let drawn = (1..=DRAWN).map(|k| {
        let share = k as f64 / DRAWN as f64;
        let towards = |(middle, drawn): (&Vec<f64>, Vec<f64>)| -> Vec<f64> {
            middle.iter().zip(drawn).map(|(middle, drawn)| middle + share * (drawn - middle)).collect()
        };
        middle.iter().zip(touch.draw_posture(&mut rng)).map(towards).collect::<Vec<_>>()
    });
    let mut off = drawn.filter(|posture| touch.tips_keep_off_the_palm(posture, OFF_THE_PALM[0]));
    off.find(|posture| touch.touching(posture).iter().all(|touching| !touching))
}

/// Per coordinate the part of its range, between -1 and 1, that brings the tip towards `center` fastest.
fn bend_direction(hand: &Hand, finger: usize, middle: &[f64], center: &Point) -> Vec<f64> {
    let finger = &hand.fingers[finger];
    let mut poses = Vec::new();
    finger.chain.forward(middle, &mut poses);
    let tip = finger.chain.tip(middle, &finger.tip.center_in_body);
    let jacobian = finger.chain.jacobian(&poses, &tip);
    let towards = center - tip;
    let ranges: Vec<f64> = finger
        .chain
        .lower
        .iter()
        .zip(&finger.chain.upper)
        .map(|(l, h)| if (h - l).is_finite() { h - l } else { 0.0 })
        .collect();
    let gains: Vec<f64> = (0..middle.len()).map(|k| jacobian.column(k).dot(&towards) * ranges[k]).collect();
    let most = gains.iter().fold(0.0f64, |most, gain| most.max(gain.abs()));
    gains.iter().zip(&ranges).map(|(gain, range)| if most > 0.0 { gain / most * range } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{LoadOptions, load_hand};
    use crate::places::shared_models;

    /// At rest nothing touches, and no tip is near the palm: of hands guessed from their URDF alone.
    #[test]
    fn guessed_hands_rest_with_their_tips_off_the_palm() {
        let Some(models) = shared_models() else { return };
        for file in ["allegro/allegro_left.urdf", "leap/leap_right.urdf", "dclaw/dclaw.urdf", "barrett/barrett.urdf"] {
            let path = models.join("hands").join(file);
            let hand = load_hand(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{file}: {error}")).hand;
            let touch = Touch::new(&hand);
            let rest: Vec<Vec<f64>> = hand.fingers.iter().map(|finger| finger.rest.clone()).collect();
            for finger in &hand.fingers {
                assert!(finger.chain.within_limits(&finger.rest, 0.0), "{file} {}", finger.name);
            }
            let n_touching = touch.touching(&rest).iter().filter(|touches| **touches).count();
            let is_off = touch.tips_keep_off_the_palm(&rest, OFF_THE_PALM[2]);
            assert!(n_touching == 0 && is_off, "{file}: {n_touching} pairs touch, off the palm: {is_off}");
        }
    }
}
