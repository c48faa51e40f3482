//! No collision at any moment: distances by parry, motion bounds between the moments where they are measured.

use crate::check::bodies::{Bodies, Owner, Pair};
use crate::check::far::Looked;
use crate::check::lift::{FreePart, Relocation, free_part};
use crate::check::model::CheckedHand;
use crate::check::motion::{Breach, WaypointStep, certify};
use crate::check::roles::{is_free_throughout, moving_finger};
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Clearance, Log};
use crate::plan::Plan;

/// What is known of a pair along the plan.
#[derive(Debug, Clone, Copy)]
struct Track {
    /// Lower bound of the distance now.
    bound: f64,
    /// Segment in which the pair was last reported; one report per segment is enough.
    reported_in: Option<usize>,
}

/// Judges all pairs along the plan. Returns the smallest clearance at a waypoint and the number of distances measured.
pub fn check_collision(
    bodies: &Bodies,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) -> (Option<Clearance>, u64) {
    let tolerance = plan.promises.contact_tolerance.min(settings.largest_contact_tolerance);
    let mut tracks = vec![Track { bound: f64::NEG_INFINITY, reported_in: None }; bodies.pairs.len()];
    let mut clearance: Option<Clearance> = None;
    let mut looked = Looked::new(bodies);
    let mut n_distances = 0;
    for (s, segment) in plan.segments.iter().enumerate() {
        // Segments may fail to meet; what was known before says nothing then.
        tracks.iter_mut().for_each(|track| track.bound = f64::NEG_INFINITY);
        let moving = moving_finger(model, segment);
        let free = moving.and_then(|f| {
            let relocation = Relocation { finger: &model.fingers[f], f, segment, s };
            free_part(bodies, &relocation, settings, log, &mut n_distances)
        });
        let is_free: Vec<bool> = (0..model.fingers.len()).map(|f| is_free_throughout(segment, f)).collect();
        for (w, ends) in segment.waypoints.windows(2).enumerate() {
            let mut step = WaypointStep::new(bodies, &ends[0], &ends[1]);
            step.most_pieces = log.work.left();
            let known = clearance.as_ref().map_or(f64::INFINITY, |c| c.distance.max(0.0));
            let forget = |index: usize| tracks[index].bound = f64::NEG_INFINITY;
            for &index in looked.in_step(bodies, &mut step, known, forget) {
                let (pair, track) = (&bodies.pairs[index], &mut tracks[index]);
                if track.reported_in == Some(s) {
                    continue;
                }
                let may_touch = pair.tip_of.is_some_and(|f| !is_free[f]);
                // The tip of a free finger touches nothing, and rounding is no distance.
                let apart = if pair.tip_of.is_some() { settings.free_clearance } else { 0.0 };
                if !may_touch && track.bound < clearance.as_ref().map_or(f64::INFINITY, |c| c.distance) {
                    note_clearance(&mut step, bodies, pair, track, Moment::at(s, w), &mut clearance);
                }
                if step.rests(pair) && track.bound > apart {
                    continue;
                }
                let is_moving_tip = may_touch && pair.tip_of == moving;
                if step.n_pieces >= step.most_pieces {
                    break;
                }
                for (t0, t1, floor) in pieces(w, if is_moving_tip { free } else { None }, may_touch, tolerance, apart) {
                    match certify(&mut step, pair, (t0, t1), track.bound, floor, settings.resolution) {
                        Ok(bound) => track.bound = bound,
                        // Cut, and not too near.
                        Err(_) if step.n_pieces > step.most_pieces => break,
                        Err(breach) => {
                            log.push(violation(bodies, pair, s, w, floor, &breach));
                            *track = Track { bound: f64::NEG_INFINITY, reported_in: Some(s) };
                            break;
                        }
                    }
                }
            }
            n_distances += step.n_distances;
            if !log.work.spend(step.n_pieces + 1, "collisions") {
                return (clearance, n_distances);
            }
        }
    }
    (clearance, n_distances)
}

/// The step cut where the moving tip becomes clear and where it lands; each piece with the distance it must keep.
fn pieces(w: usize, free: Option<FreePart>, may_touch: bool, tolerance: f64, apart: f64) -> Vec<(f64, f64, f64)> {
    if !may_touch {
        return vec![(0.0, 1.0, apart)];
    }
    let Some(((first, from), (last, to))) = free else { return vec![(0.0, 1.0, -tolerance)] };
    let from = if w < first {
        1.0
    } else if w == first {
        from
    } else {
        0.0
    };
    let to = if w > last {
        0.0
    } else if w == last {
        to
    } else {
        1.0
    };
    if from >= to {
        return vec![(0.0, 1.0, -tolerance)];
    }
    let mut pieces = vec![(0.0, from, -tolerance), (from, to, 0.0), (to, 1.0, -tolerance)];
    pieces.retain(|(t0, t1, _)| t0 < t1);
    pieces
}

fn note_clearance(
    step: &mut WaypointStep,
    bodies: &Bodies,
    pair: &Pair,
    track: &mut Track,
    at: Moment,
    clearance: &mut Option<Clearance>,
) {
    let known = clearance.as_ref().map_or(f64::INFINITY, |c| c.distance);
    if step.ball_distance(pair, 0.0) >= known {
        return;
    }
    if let Some(distance) = step.measure(pair, 0.0) {
        track.bound = track.bound.max(distance);
        if distance < known {
            let pair = [pair.a, pair.b].map(|item| bodies.items[item].name.clone());
            *clearance = Some(Clearance { distance, pair, at });
        }
    }
}

fn violation(bodies: &Bodies, pair: &Pair, s: usize, w: usize, floor: f64, breach: &Breach) -> Violation {
    let names = [pair.a, pair.b].map(|item| bodies.items[item].name.as_str());
    let who = match bodies.items[pair.b].owner {
        Owner::Object => format!("\"{}\" and the object \"{}\"", names[0], names[1]),
        _ => format!("\"{}\" and \"{}\"", names[0], names[1]),
    };
    let message = match breach.distance {
        Some(distance) if distance <= 0.0 => format!("{who} overlap by {:.3e} m", -distance),
        Some(distance) => format!("{who} are only {distance:.3e} m apart, too near to tell in motion"),
        None => format!("the distance of {who} could not be resolved, which counts as collision"),
    };
    let at = Moment { segment: s, waypoint: w, fraction: breach.t };
    let amount = breach.distance.map_or(f64::NAN, |distance| -distance);
    Violation::new(Kind::Collision, message).when(at).subjects(names).amount(amount, -floor)
}
