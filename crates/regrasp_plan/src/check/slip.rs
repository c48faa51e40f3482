//! How far fingertips slip over the object from landing to lifting, whatever the segments in between.
//!
//! A contact slips by what its touching material point moves over the object, without the part along the normal: the integral
//! that `rolling` and `tracking` measure in every step. A soft fingertip resists turning too. Its relative turn about the
//! normal counts as slip by the contact's torsion radius, at which that turn moves the patch (Howe and Cutkosky 1996).
//!
//! From landing to lifting a contact may slip by
//!
//! - at most [`CheckSettings::largest_slip`], and
//! - at most [`CheckSettings::slip_share`] of the way that the contact travels over the object, and
//!   [`CheckSettings::slip_floor`] for rounding and for the chords of integrated steps.
//!
//! Steps in which the finger slides on purpose (in tracking) do not count, and do not start the sum anew. What is said to roll
//! has to roll at every level. The turn of soft fingertips about the normal, and the slip of fixed contacts over which a round
//! fingertip pivots, count from level `motion` on.

use crate::check::between::Between;
use crate::check::level::Level;
use crate::check::model::{CheckedHand, FingerModel};
use crate::check::pose::pose_difference;
use crate::check::roles::{contact_of, moving_finger};
use crate::check::rolling::{Roll, UNKNOWN_SHARE};
use crate::check::step_slip::{StepSlip, torsion_radius};
use crate::check::surface::SortedShape;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, Plan, Segment};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// The contact that slips most from landing to lifting.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct HoldSlip {
    /// Index of the finger.
    pub finger: usize,
    /// How far it slips, in metres.
    pub slip: f64,
    /// How far its contact travels over the object, in metres.
    pub travel: f64,
    /// When it lands, or the plan begins.
    pub landed: Moment,
}

/// Judges slip from landing to lifting of every contact. The largest, where the object or a holding finger moves.
///
/// `known` is what `rolling` and `tracking` have measured, by finger, segment and waypoint; fixed contacts are measured here.
pub fn check_slip(
    shape: &SortedShape,
    model: &CheckedHand,
    plan: &Plan,
    known: &BTreeMap<(usize, usize, usize), StepSlip>,
    settings: &CheckSettings,
    log: &mut Log,
) -> Option<HoldSlip> {
    let mut worst: Option<HoldSlip> = None;
    for (f, finger) in model.fingers.iter().enumerate() {
        let mut hold = Hold::begin(Moment::at(0, 0));
        for (s, segment) in plan.segments.iter().enumerate() {
            let lifts = moving_finger(model, segment) == Some(f);
            if lifts {
                hold.end(f, finger, settings, log, &mut worst);
                hold = Hold::begin(Moment::at(s, segment.waypoints.len() - 1));
            }
            for (w, pair) in segment.waypoints.windows(2).enumerate().filter(|_| !lifts) {
                let modes = [0, 1].map(|i| pair[i].contacts[f].mode);
                if modes.contains(&ContactMode::Free) {
                    hold.end(f, finger, settings, log, &mut worst);
                    hold = Hold::begin(Moment::at(s, w + 1));
                } else if !modes[0].slides() {
                    let known = known.get(&(f, s, w)).copied();
                    let step = known.or_else(|| fixed_slip(shape, finger, f, (segment, w), settings, log));
                    step.into_iter().for_each(|step| hold.add(step, modes[0], Moment::at(s, w)));
                }
            }
        }
        hold.end(f, finger, settings, log, &mut worst);
    }
    worst
}

/// One contact from landing to lifting.
struct Hold {
    landed: Moment,
    all: StepSlip,
    /// The slides of [`Hold::all`] in steps in which the plan says that the contact rolls, or does not slide in tracking.
    rolling: StepSlip,
    largest: (f64, Moment),
}

impl Hold {
    fn begin(landed: Moment) -> Self {
        Hold { landed, all: StepSlip::default(), rolling: StepSlip::default(), largest: (0.0, landed) }
    }

    fn add(&mut self, step: StepSlip, mode: ContactMode, at: Moment) {
        self.all += step;
        if mode != ContactMode::Fixed {
            self.rolling += StepSlip { twist: 0.0, ..step };
        }
        if step.slip() > self.largest.0 {
            self.largest = (step.slip(), at);
        }
    }

    fn end(
        &self,
        f: usize,
        finger: &FingerModel,
        settings: &CheckSettings,
        log: &mut Log,
        worst: &mut Option<HoldSlip>,
    ) {
        let Hold { landed, all, .. } = *self;
        if all.slip() > worst.map_or(0.0, |worst| worst.slip) {
            *worst = Some(HoldSlip { finger: f, slip: all.slip(), travel: all.travel, landed });
        }
        // What is said to roll has to, whatever the plan is judged for.
        for (sum, level) in [(self.rolling, Level::Geometry), (all, Level::Motion)] {
            let limit = settings.largest_slip.min(settings.slip_share * sum.travel + settings.slip_floor);
            // Not-a-number is no small slip.
            if sum.slip() <= limit {
                continue;
            }
            let message = format!(
                "the tip of finger \"{}\" slips {:.3e} m over the object while its contact travels {:.3e} m, from {landed} until it \
                 lifts; {limit:.3e} m are allowed, and most of it is here",
                finger.name,
                sum.slip(),
                sum.travel
            );
            let violation = Violation::new(Kind::Slip, message).when(self.largest.1).from_level(level);
            log.push(violation.subjects([finger.name.as_str()]).amount(sum.slip(), limit));
            break;
        }
    }
}

/// Slip of finger `f` from waypoint `w` of the segment to the next; none where neither it nor the object moves.
fn fixed_slip(
    shape: &SortedShape,
    finger: &FingerModel,
    f: usize,
    (segment, w): (&Segment, usize),
    settings: &CheckSettings,
    log: &mut Log,
) -> Option<StepSlip> {
    let (from, to) = (&segment.waypoints[w], &segment.waypoints[w + 1]);
    let (shift, turn) = pose_difference(&from.world_from_object, &to.world_from_object);
    if shift == 0.0 && turn == 0.0 && !finger.path.moves(&Between::new(from, to).joint_bounds()) {
        return None;
    }
    let roll = Roll::new((f, finger), from, to, shape, settings.largest_contact_tolerance);
    let step = if finger.radius == 0.0 {
        // A sharp tip stays on its contact within the contact tolerance, which `contact` judges.
        let normal = contact_of(&from.contacts[f])?.normal_in_object.into_inner();
        StepSlip { twist: torsion_radius(finger) * roll.turn_about(&normal), ..StepSlip::default() }
    } else {
        roll.step_slip(finger, roll.slip(UNKNOWN_SHARE * settings.largest_slip_tolerance))
    };
    log.work.spend(roll.looked(), "fixed contacts").then_some(step)
}
