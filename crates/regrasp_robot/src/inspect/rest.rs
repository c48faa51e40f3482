//! Rest postures: the middle of the limits, bent a little towards the point that all tips surround.

use super::touch::Touch;
use crate::hand::Hand;
use regrasp_geometry::Point;

/// Part of its range that the joint which moves the tip most towards the centre is bent by.
const BEND: f64 = 0.15;

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
    let free = [BEND, BEND / 2.0, 0.0, -BEND, -2.0 * BEND, -3.0 * BEND]
        .into_iter()
        .map(bent)
        .find(|posture| touch.touching(posture).iter().all(|touching| !touching));
    for (finger, rest) in hand.fingers.iter_mut().zip(free.unwrap_or(middle)) {
        finger.rest = rest;
    }
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
