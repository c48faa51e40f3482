//! What the plan promises of its inputs and contacts; promises of time are judged in `times`, of forces in `forces`.
//!
//! - Input files: the same roles, names and SHA-256 as the scene's, none more and none less.
//! - Friction: not negative, at most the scene's, and at most that over `friction_margin`, which is at least 1.
//! - Contact and slip tolerance: at most what the settings accept. That they are kept is judged in `contact` and `rolling`.
//! - Tracking: the goal's tolerance is at most what the settings accept, friction of what slides is the scene's.
//! - Closure: at every waypoint but those of tracking, of exactly the fingers that hold, with the margin promised or asked
//!   for by the settings; the margin is that of `closure`, dimensionless, with torques divided by the object's radius,
//!   which `torque_scale` has to be. The margin said to be kept is no more than the smallest one found; where none is
//!   judged, no margin is promised.
//!
//! Tolerances, for rounding and two solvers, are the constants below.

use crate::check::closure::{Certificate, HeldBody, certified_margin_up_to, margin_by};
use crate::check::model::CheckedHand;
use crate::check::roles::{contact_of, moving_finger};
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{Plan, PlanInput, SegmentKind, Waypoint};
use regrasp_grasp::{Contact, Grip};
use regrasp_scene::{InputFile, Object};
use std::collections::{BTreeMap, BTreeSet};

/// How much smaller than required a margin may come out: two solvers, one number.
pub(super) const MARGIN_TOLERANCE: f64 = 1e-9;
/// How far the kept margin may be above the one found here before it is a broken promise.
const KEPT_MARGIN_TOLERANCE: f64 = 1e-6;
/// The torque scale may differ from the object's radius by this share of it: rounding.
const SCALE_TOLERANCE: f64 = 1e-9;
/// Friction times its margin may be this much above the scene's: rounding.
const FRICTION_TOLERANCE: f64 = 1e-9;

/// The files of the plan against those of the scene as loaded now.
///
/// Files of several hands may have the same name, each in a folder of its own: the first in the plan is the first in the scene.
pub fn check_input_files(of_plan: &[PlanInput], inputs: &[InputFile], log: &mut Log) {
    let mut n_seen: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for input in of_plan {
        let n_before = n_seen.entry((&input.role, &input.name)).or_default();
        let mut alike = inputs.iter().filter(|file| file.role == input.role && file.name == input.name);
        match alike.nth(*n_before) {
            None => {
                let message = format!("{} \"{}\" is not among the scene's files", input.role, input.name);
                log.push(Violation::new(Kind::InputHashMismatch, message).subjects([input.name.as_str()]));
            }
            Some(file) if file.sha256 != input.sha256 => {
                let message = format!(
                    "{} \"{}\" has sha256 {}, the plan was made from {}",
                    input.role, input.name, file.sha256, input.sha256
                );
                log.push(Violation::new(Kind::InputHashMismatch, message).subjects([input.name.as_str()]));
            }
            Some(_) => {}
        }
        *n_before += 1;
    }
    for file in inputs {
        match n_seen.get_mut(&(file.role.as_str(), file.name.as_str())).filter(|n_left| **n_left > 0) {
            Some(n_left) => *n_left -= 1,
            None => {
                let message = format!("the scene reads {} \"{}\", the plan was made without it", file.role, file.name);
                log.push(Violation::new(Kind::InputHashMismatch, message).subjects([file.name.as_str()]));
            }
        }
    }
}

/// Of so many different sets of contacts one is solved for before the others are looked at.
const SOLVED_FIRST: usize = 16;

/// Contacts that hold at some waypoints, and the first of these.
struct Holding {
    at: Moment,
    fingers: Vec<usize>,
    grips: Vec<Grip>,
}

/// A finger that holds, and its contact.
pub struct Holder {
    /// Index of the finger.
    pub finger: usize,
    contact: Contact,
}

impl Holder {
    /// The same for the same finger at the same contact only.
    pub fn key(&self) -> (usize, [u64; 6]) {
        let (p, n) = (self.contact.point_in_object, self.contact.normal_in_object);
        (self.finger, [p.x, p.y, p.z, n.x, n.y, n.z].map(f64::to_bits))
    }
}

/// The fingers that hold at a waypoint; `moving` is the one that a regrasp moves.
pub fn holders(model: &CheckedHand, moving: Option<usize>, waypoint: &Waypoint) -> Vec<Holder> {
    (0..model.fingers.len())
        .filter(|&f| Some(f) != moving && waypoint.contacts[f].holds())
        .filter_map(|finger| Some(Holder { finger, contact: contact_of(&waypoint.contacts[finger])? }))
        .collect()
}

/// Contacts of fingers with what their tips transmit.
pub fn grips_of(model: &CheckedHand, holders: &[Holder]) -> Vec<Grip> {
    let grip = |holder: &Holder| Grip { contact: holder.contact, model: model.fingers[holder.finger].contact };
    holders.iter().map(grip).collect()
}

/// Closure of exactly the fingers that hold, at every waypoint; the smallest margin.
///
/// Contacts that roll are others at every waypoint. Forces found for the waypoint before are tried first: what they prove is
/// enough where it is no less than what is required and than the smallest margin found so far.
pub fn check_closure(
    object: &Object,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) -> Option<f64> {
    let body = HeldBody::of(object, plan);
    let required = plan.promises.required_margin.max(settings.smallest_margin);
    let sets = holding_sets(model, plan);
    let mut smallest: Option<f64> = None;
    let mut solved: Vec<Option<(f64, Option<Certificate>)>> = vec![None; sets.len()];
    // A set that holds with more than the smallest margin so far cannot be the one with the smallest.
    let solve = |set: &Holding, near: Option<&Certificate>, smallest: &mut Option<f64>| {
        let enough = smallest.map_or(f64::INFINITY, |least: f64| least.max(required));
        let certified = certified_margin_up_to(enough, near, &set.grips, &body);
        let (margin, certificate) = certified.map_or((0.0, None), |(margin, proof)| (margin, Some(proof)));
        *smallest = Some(smallest.map_or(margin, |least: f64| least.min(margin)));
        (margin, certificate)
    };
    let mut last: Option<(&[usize], Certificate)> = None;
    for (set, solved) in sets.iter().zip(&mut solved).step_by(SOLVED_FIRST) {
        let near = last.as_ref().filter(|(fingers, _)| *fingers == set.fingers).map(|(_, proof)| proof);
        let found = solve(set, near, &mut smallest);
        last = found.1.clone().map(|proof| (set.fingers.as_slice(), proof));
        *solved = Some(found);
    }
    let mut before: Option<(&[usize], Certificate)> = None;
    for (set, solved) in sets.iter().zip(solved) {
        let enough = smallest.map_or(required, |least| least.max(required));
        let tried = before.as_ref().filter(|(fingers, _)| *fingers == set.fingers && solved.is_none());
        if enough > 0.0 && tried.is_some_and(|(_, proof)| margin_by(proof, &set.grips, &body) >= enough) {
            continue;
        }
        let near = tried.map(|(_, proof)| proof);
        let (found, certificate) = solved.unwrap_or_else(|| solve(set, near, &mut smallest));
        before = certificate.map(|proof| (set.fingers.as_slice(), proof));
        if !(found > 0.0 && found >= required - MARGIN_TOLERANCE) {
            log.push(closure_lost(model, set, found, required));
        }
    }
    smallest
}

/// The different sets of contacts that hold in the plan, in order.
fn holding_sets(model: &CheckedHand, plan: &Plan) -> Vec<Holding> {
    let mut seen = BTreeSet::new();
    let mut sets = Vec::new();
    for (s, segment) in plan.segments.iter().enumerate() {
        // Fingers that slide close nothing: forces alone hold the object in tracking.
        if segment.kind == SegmentKind::Tracking {
            continue;
        }
        let moving = moving_finger(model, segment);
        // A waypoint may break the roles; closure is judged for what really holds there.
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let holding = holders(model, moving, waypoint);
            if seen.insert(holding.iter().map(Holder::key).collect::<Vec<_>>()) {
                let fingers = holding.iter().map(|holder| holder.finger).collect();
                sets.push(Holding { at: Moment::at(s, w), fingers, grips: grips_of(model, &holding) });
            }
        }
    }
    sets
}

fn closure_lost(model: &CheckedHand, set: &Holding, found: f64, required: f64) -> Violation {
    let names: Vec<&str> = set.fingers.iter().map(|&f| model.fingers[f].name.as_str()).collect();
    let message = if found > 0.0 {
        format!("fingers {names:?} hold with margin {found:.6}, {required:.6} is required")
    } else {
        format!("fingers {names:?} are not proved to be force closed")
    };
    Violation::new(Kind::ClosureLost, message).when(set.at).subjects(names).amount(found, required)
}

/// Promises that no plan may make, and promises that this plan does not keep.
pub fn check_promises(object: &Object, plan: &Plan, settings: &CheckSettings, min_margin: Option<f64>, log: &mut Log) {
    let promises = &plan.promises;
    if promises.friction > object.friction {
        let message = format!("the plan counts on friction {}, the scene has {}", promises.friction, object.friction);
        let violation = Violation::new(Kind::FrictionAboveScene, message);
        log.push(violation.amount(promises.friction, object.friction));
    }
    // The margin between the two frictions.
    let divided = promises.friction * promises.friction_margin;
    if promises.friction <= object.friction && divided > object.friction + FRICTION_TOLERANCE {
        let message = format!(
            "friction {} with a margin of {} needs {divided}, the scene has {}",
            promises.friction, promises.friction_margin, object.friction
        );
        log.push(Violation::new(Kind::FrictionAboveScene, message).amount(divided, object.friction));
    }
    let mut broken = |name: &str, amount: f64, limit: f64, message: String| {
        log.push(Violation::new(Kind::PromiseBroken, message).subjects([name]).amount(amount, limit));
    };
    if !(promises.contact_tolerance > 0.0 && promises.contact_tolerance <= settings.largest_contact_tolerance) {
        let limit = settings.largest_contact_tolerance;
        let message = format!("contact tolerance {:e} m, at most {limit:e} is accepted", promises.contact_tolerance);
        broken("contact_tolerance", promises.contact_tolerance, limit, message);
    }
    if !(promises.slip_tolerance >= 0.0 && promises.slip_tolerance <= settings.largest_slip_tolerance) {
        let limit = settings.largest_slip_tolerance;
        let message = format!("slip tolerance {:e} m, at most {limit:e} is accepted", promises.slip_tolerance);
        broken("slip_tolerance", promises.slip_tolerance, limit, message);
    }
    if !(promises.required_margin >= 0.0 && promises.kept_margin >= promises.required_margin) {
        let message = format!("keeps margin {}, requires {}", promises.kept_margin, promises.required_margin);
        broken("kept_margin", promises.kept_margin, promises.required_margin, message);
    }
    if let Some(found) = min_margin
        && promises.kept_margin > found + KEPT_MARGIN_TOLERANCE
    {
        let message = format!("the plan says it keeps margin {}, found is {found}", promises.kept_margin);
        broken("kept_margin", promises.kept_margin, found, message);
    }
    let promised = promises.required_margin.max(promises.kept_margin);
    if min_margin.is_none() && promised != 0.0 {
        let message = format!("a margin of {promised} where no closure is asked for");
        broken("kept_margin", promised, 0.0, message);
    }
    if let Some(tracking) = &promises.tracking {
        let (asked, limit) = (tracking.goal_tolerance, settings.largest_goal_tolerance);
        if !(asked >= 0.0 && asked <= limit) {
            broken("goal_tolerance", asked, limit, format!("goal tolerance {asked} rad, at most {limit} is accepted"));
        }
        let (friction, limit) = (tracking.sliding_friction, object.friction);
        if (friction - limit).abs() > FRICTION_TOLERANCE {
            let message = format!("sliding friction {friction}, the scene's is {limit}");
            broken("sliding_friction", friction, limit, message);
        }
    }
    let scale = object.radius;
    if (promises.torque_scale - scale).abs() > SCALE_TOLERANCE * scale {
        let message = format!("torque scale {}, the object's radius is {scale}", promises.torque_scale);
        broken("torque_scale", promises.torque_scale, scale, message);
    }
    if promises.friction_margin < 1.0 {
        let message = format!("friction margin {} is below one", promises.friction_margin);
        broken("friction_margin", promises.friction_margin, 1.0, message);
    }
    if promises.friction < 0.0 {
        let message = format!("friction {} is negative", promises.friction);
        broken("friction", promises.friction, 0.0, message);
    }
}
