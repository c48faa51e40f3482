//! Where a hand can hold something: where its tips reach, which sizes fit, and where.

use crate::words::metres;
use regrasp::InHandSettings;
use regrasp::base::Rng;
use regrasp::planners::in_hand::placing::sizes::{Size, fingers_that_only_hold, never_lets_go, sizes};
use regrasp::robot::Hand;
use regrasp::robot::inspect::{TipReach, TipRegion};
use serde::Serialize;
use std::fmt::Write;

/// Postures from which it is known where tips reach.
const POSTURES: usize = 12_000;
/// Fingers that hold while one is away.
const FINGERS: usize = 3;

/// Where a hand can hold something, in its own frame.
#[derive(Debug, Serialize)]
pub struct Room {
    /// What at least three fingertips reach, or two of a hand with two; none where they have no place in common.
    region: Option<TipRegion>,
    /// Balls, small ones first.
    balls: Vec<Size>,
    /// Why no ball was tried.
    refusal: Option<String>,
    /// Which fingers cannot follow an object that moves; none where all of them can.
    only_hold: Option<String>,
    /// Why the hand can never change its grasp; none where it can.
    never_lets_go: Option<String>,
}

impl Room {
    /// Measures it.
    pub fn of(hand: &Hand, seed: u64) -> Self {
        let mut rng = Rng::keyed(seed, "room", 0);
        let reach = TipReach::sample(hand, POSTURES, &mut rng);
        let region = reach.region(FINGERS.min(hand.fingers.len()));
        let settings = InHandSettings::default();
        let only_hold = fingers_that_only_hold(hand, &settings);
        let never_lets_go = never_lets_go(hand, &settings);
        let (balls, refusal) = match sizes(hand, &reach, &settings, seed) {
            Ok(balls) => (balls, None),
            Err(failure) => (Vec::new(), Some(failure.message)),
        };
        Room { region, balls, refusal, only_hold, never_lets_go }
    }

    /// Adds it to a report.
    pub fn write(&self, out: &mut String) {
        // Writing to a String cannot fail.
        match &self.region {
            Some(region) => {
                let size: [f64; 3] = std::array::from_fn(|axis| 100.0 * (region.high[axis] - region.low[axis]));
                let _ = writeln!(
                    out,
                    "  region that {} fingertips reach: {} to {} m ({:.0} x {:.0} x {:.0} cm, {:.0} cm^3)",
                    region.n_fingers,
                    metres(&region.low),
                    metres(&region.high),
                    size[0],
                    size[1],
                    size[2],
                    1e6 * region.volume
                );
            }
            None if self.only_hold.is_some() => {}
            None => out.push_str("  the fingertips reach no place in common\n"),
        }
        if let Some(only_hold) = &self.only_hold {
            let _ = writeln!(out, "  {only_hold}");
        }
        if let Some(never_lets_go) = &self.never_lets_go {
            let _ = writeln!(out, "  {never_lets_go}");
        }
        if let Some(refusal) = &self.refusal {
            let _ = writeln!(out, "  balls: {refusal}");
            return;
        }
        // Few poses of a ball are looked at; hands of short fingers hold it at few.
        let more = match (&self.only_hold, &self.never_lets_go) {
            (None, None) => "",
            _ => " (at a few poses each; `regrasp place --hold` looks at more)",
        };
        let held = range(&self.balls, |ball| ball.center.is_some());
        let _ = writeln!(out, "  balls that can be held:         {held}{more}");
        let _ = writeln!(out, "  balls that every finger can let go of: {}", range(&self.balls, |ball| ball.lets_go));
        let best = self.balls.iter().max_by(|a, b| a.evidence.total_cmp(&b.evidence));
        if let Some((ball, center)) = best.and_then(|ball| Some((ball, ball.center?))) {
            let _ = writeln!(
                out,
                "  suggested place: {} m, for a ball of radius {:.0} mm; `regrasp place` finds one for your object",
                metres(&center),
                1e3 * ball.radius
            );
        }
    }
}

/// The radii of the balls that `fits` takes, in words.
fn range(balls: &[Size], fits: impl Fn(&Size) -> bool) -> String {
    let radii: Vec<f64> = balls.iter().filter(|ball| fits(ball)).map(|ball| 1e3 * ball.radius).collect();
    match (radii.first(), radii.last()) {
        (Some(least), Some(most)) => format!("radius {least:.0} to {most:.0} mm"),
        _ => "none of those tried".into(),
    }
}
