//! Closure and pads of rolling contacts between waypoints, with contacts that the checker moves itself.
//!
//! From one waypoint to the next a rolling contact travels as the motion takes it: `Roll::contact` says where it is. Closure
//! and pads are judged at moments between which no contact travels farther than `LARGEST_TRAVEL`, and halfway at least. Both
//! change continuously with the contacts, and waypoints themselves are judged in `promises` and `contact`.

use crate::check::closure::{Certificate, HeldBody, certified_margin, margin_by};
use crate::check::model::CheckedHand;
use crate::check::promises::MARGIN_TOLERANCE;
use crate::check::roles::contact_of;
use crate::check::rolling::Roll;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, Plan, SegmentKind, Waypoint};
use regrasp_geometry::UnitVector;
use regrasp_grasp::{Contact, Grip};
use regrasp_scene::Object;

/// How far a contact travels over the object between two moments that are judged, at most, in metres.
const LARGEST_TRAVEL: f64 = 1e-3;
/// Most moments judged in a step.
const MOST_MOMENTS: usize = 7;

/// Judges the steps of all transfers in which a finger rolls; the smallest margin between waypoints.
pub fn check_rolling_closure(
    object: &Object,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) -> Option<f64> {
    let body = HeldBody::of(object, plan);
    let required = plan.promises.required_margin.max(settings.smallest_margin);
    let mut smallest: Option<f64> = None;
    let mut proof: Option<Certificate> = None;
    for (s, segment) in plan.segments.iter().enumerate().filter(|(_, one)| one.kind == SegmentKind::Transfer) {
        for (w, pair) in segment.waypoints.windows(2).enumerate() {
            let holders: Vec<Holder> =
                (0..model.fingers.len()).filter_map(|f| Holder::new(model, &pair[0], &pair[1], f, settings)).collect();
            if !holders.iter().any(|holder| holder.roll.is_some()) {
                continue;
            }
            let travel = holders.iter().filter_map(|holder| Some(holder.roll.as_ref()?.travel())).fold(0.0, f64::max);
            let n_pieces = ((travel / LARGEST_TRAVEL).ceil() as usize).clamp(2, MOST_MOMENTS + 1);
            for k in 1..n_pieces {
                let fraction = k as f64 / n_pieces as f64;
                let at = Moment { segment: s, waypoint: w, fraction };
                let grips: Vec<Grip> =
                    holders.iter().filter_map(|holder| holder.grip(model, fraction, at, log)).collect();
                // A contact that is nowhere near is off its contact, which `rolling` says.
                if grips.len() < holders.len() {
                    continue;
                }
                let known = proof.as_ref().map_or(0.0, |proof| margin_by(proof, &grips, &body));
                let margin = match known > 0.0 && known >= required {
                    true => known,
                    false => {
                        let solved = certified_margin(&grips, &body);
                        let margin = solved.as_ref().map_or(0.0, |(margin, _)| *margin);
                        proof = solved.map(|(_, proof)| proof);
                        margin
                    }
                };
                smallest = Some(smallest.map_or(margin, |least: f64| least.min(margin)));
                if !(margin > 0.0 && margin >= required - MARGIN_TOLERANCE) {
                    let names = holders.iter().map(|holder| model.fingers[holder.finger].name.as_str());
                    let message = format!(
                        "between waypoints the fingers hold with margin {margin:.6}, {required:.6} is required"
                    );
                    let violation = Violation::new(Kind::ClosureLost, message).when(at).subjects(names);
                    log.push(violation.amount(margin, required));
                }
            }
        }
    }
    smallest
}

/// A finger that holds all through a step.
struct Holder<'a> {
    finger: usize,
    at_start: Contact,
    /// How it rolls; none for a fixed contact.
    roll: Option<Roll<'a>>,
}

impl<'a> Holder<'a> {
    fn new(
        model: &'a CheckedHand,
        from: &'a Waypoint,
        to: &'a Waypoint,
        finger: usize,
        settings: &CheckSettings,
    ) -> Option<Self> {
        let at_start = contact_of(&from.contacts[finger]).filter(|_| to.contacts[finger].holds())?;
        let rolls = from.contacts[finger].mode == ContactMode::Rolling && model.fingers[finger].radius > 0.0;
        let tolerance = settings.largest_contact_tolerance;
        let roll = rolls.then(|| Roll::new((finger, &model.fingers[finger]), from, to, &model.shape, tolerance));
        Some(Holder { finger, at_start, roll })
    }

    /// What holds at a moment of the step, and a violation where the fingertip touches outside its pad.
    fn grip(&self, model: &CheckedHand, fraction: f64, at: Moment, log: &mut Log) -> Option<Grip> {
        let finger = &model.fingers[self.finger];
        let contact = match &self.roll {
            None => self.at_start,
            Some(roll) => {
                let (point_in_object, normal) = roll.contact(fraction)?;
                if let Some((angle, allowed)) = roll.off_pad(fraction, &normal) {
                    let message = format!(
                        "between waypoints finger \"{}\" touches {:.2} degrees from the axis of its pad, which ends at {:.2}",
                        finger.name,
                        angle.to_degrees(),
                        allowed.to_degrees()
                    );
                    let violation = Violation::new(Kind::ContactOffPad, message).when(at);
                    log.push(violation.subjects([finger.name.as_str()]).amount(angle, allowed));
                }
                Contact { point_in_object, normal_in_object: UnitVector::new_normalize(normal) }
            }
        };
        Some(Grip { contact, model: finger.contact })
    }
}
