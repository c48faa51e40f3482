//! The grasp and its way in: nothing touches but fingertips on their contacts, at every moment.

use super::waypoints::way_of;
use super::{GraspClearance, Judged, Measured};
use crate::check::Log;
use crate::check::bodies::{Owner, Pair};
use crate::check::motion::{Breach, WaypointStep, certify};
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};

/// Pieces of motion that are looked at in one step; a way that needs more is one that nobody makes.
const MOST_PIECES: u64 = 200_000;

/// Judges the two steps of the way in.
pub(super) fn check_way(judged: &Judged, index: usize, log: &mut Log, measured: &mut Measured) {
    let grasp = &judged.list.grasps[index];
    let [before, open, closed] = way_of(grasp);
    let (line, shortest) = (grasp.approach.distance, judged.settings.shortest_way_in);
    measured.shortest_way_in = Some(measured.shortest_way_in.map_or(line, |known: f64| known.min(line)));
    if !(line >= shortest) {
        let message = format!("the hand comes on a line of {:.1} mm, which is no way in", 1e3 * line);
        log.push(Violation::new(Kind::NoWayIn, message).when(Moment::at(0, index)).amount(line, shortest));
    }
    let touches = |pair: &Pair| {
        let finger = pair.tip_of.map(|f| &judged.model.fingers[f].name);
        finger.is_some_and(|name| grasp.contacts.iter().any(|contact| contact.finger == *name))
    };
    let tolerance = judged.plan.promises.contact_tolerance.min(judged.settings.largest_contact_tolerance);
    let apart = |pair: &Pair| if pair.tip_of.is_some() { judged.settings.free_clearance } else { 0.0 };
    for (what, ends, closes) in [("on its line", [&before, &open], false), ("while it closes", [&open, &closed], true)]
    {
        if leaps(judged, ends, index, log) {
            return;
        }
        let mut step = WaypointStep::new(judged.bodies, ends[0], ends[1]);
        step.most_pieces = MOST_PIECES;
        for pair in &judged.bodies.pairs {
            let may_touch = closes && touches(pair);
            let floor = if may_touch { -tolerance } else { apart(pair) };
            if closes {
                measure(judged, &mut step, pair, may_touch, index, measured);
            }
            let certified = certify(&mut step, pair, (0.0, 1.0), f64::NEG_INFINITY, floor, judged.settings.resolution);
            if let Err(breach) = certified {
                log.push(violation(judged, pair, index, what, floor, &breach));
            }
        }
        measured.n_distances += step.n_distances;
    }
}

/// What a report says of distances in the grasp itself.
fn measure(
    judged: &Judged,
    step: &mut WaypointStep,
    pair: &Pair,
    may_touch: bool,
    index: usize,
    measured: &mut Measured,
) {
    let known = measured.clearance.as_ref().map_or(f64::INFINITY, |clearance| clearance.distance);
    if !may_touch && step.ball_distance(pair, 1.0) >= known {
        return;
    }
    let Some(distance) = step.measure(pair, 1.0) else { return };
    if may_touch {
        measured.deepest_tip = measured.deepest_tip.max(-distance);
    } else if distance < known {
        let pair = [pair.a, pair.b].map(|item| judged.bodies.items[item].name.clone());
        measured.clearance = Some(GraspClearance { distance, pair, grasp: index });
    }
}

/// Joints so far apart, or a line so long, that following the motion has no end.
fn leaps(judged: &Judged, ends: [&crate::Waypoint; 2], index: usize, log: &mut Log) -> bool {
    let settings = judged.settings;
    let line = judged.list.grasps[index].approach.distance;
    let far = |k: usize| {
        let most = if judged.model.slides[k] { settings.followed_slide } else { settings.followed_turn };
        !((ends[1].joints[k] - ends[0].joints[k]).abs() <= most)
    };
    let leaps = !(line <= settings.followed_slide) || (0..ends[0].joints.len()).any(far);
    if leaps {
        let message = "the way in is too long to be judged: not judged".to_owned();
        log.push(Violation::new(Kind::NotJudged, message).when(Moment::at(0, index)));
    }
    leaps
}

fn violation(judged: &Judged, pair: &Pair, index: usize, what: &str, floor: f64, breach: &Breach) -> Violation {
    let items = &judged.bodies.items;
    let names = [pair.a, pair.b].map(|item| items[item].name.as_str());
    let who = match items[pair.b].owner {
        Owner::Object => format!("\"{}\" and the object \"{}\"", names[0], names[1]),
        _ => format!("\"{}\" and \"{}\"", names[0], names[1]),
    };
    let message = match breach.distance {
        Some(distance) if distance <= 0.0 => format!("{who} overlap by {:.3e} m {what}", -distance),
        Some(distance) => format!("{who} are only {distance:.3e} m apart {what}, too near to tell in motion"),
        None => format!("the distance of {who} could not be resolved {what}, which counts as collision"),
    };
    let at = Moment { segment: 0, waypoint: index, fraction: breach.t };
    let amount = breach.distance.map_or(f64::NAN, |distance| -distance);
    Violation::new(Kind::Collision, message).when(at).subjects(names).amount(amount, -floor)
}
