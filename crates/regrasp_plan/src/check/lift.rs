//! Lifting and landing: a moving fingertip leaves its contact on the normal's side before it goes anywhere, and reaches
//! the next one from there. One that is free at an end of its motion has nothing to leave or reach there.

use crate::check::bodies::{Bodies, Owner, Pair};
use crate::check::model::FingerModel;
use crate::check::motion::WaypointStep;
use crate::check::roles::contact_of;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, Segment, Waypoint};
use regrasp_geometry::{Pose, Vector};

/// Tangent of the angle between the way of the tip's centre and the normal, at most: 60 degrees.
const LARGEST_SLOPE: f64 = 1.732;
/// Largest sideways way on top of that, in metres: joint motion between waypoints is not straight.
const SIDEWAYS_SLACK: f64 = 0.1e-3;
/// Largest way back into the object, in metres: the tip presses that much while it bends.
const BACKWARD_SLACK: f64 = 0.05e-3;
/// Most samples of one step.
const MOST_SAMPLES: usize = 4096;

/// The part of a regrasp in which the tip must not touch: from (step, parameter) to (step, parameter).
pub type FreePart = ((usize, f64), (usize, f64));

/// A finger that moves in a regrasp.
#[derive(Debug, Clone, Copy)]
pub struct Relocation<'a> {
    /// The finger.
    pub finger: &'a FingerModel,
    /// Its index.
    pub f: usize,
    /// The regrasp.
    pub segment: &'a Segment,
    /// Its index.
    pub s: usize,
}

/// Finds where the lift of the finger ends and its landing begins, and reports what is wrong with either.
///
/// None when the tip never gets clear of the object.
pub fn free_part(
    bodies: &Bodies,
    relocation: &Relocation,
    settings: &CheckSettings,
    log: &mut Log,
    n_distances: &mut u64,
) -> Option<FreePart> {
    let &Relocation { finger, f, segment, s } = relocation;
    let n_steps = segment.waypoints.len() - 1;
    let mut search = Search { bodies, finger, f, segment, s, settings, log, n_distances };
    let (first, last) = (&segment.waypoints[0], &segment.waypoints[n_steps]);
    let is_free = |waypoint: &Waypoint| waypoint.contacts[f].mode == ContactMode::Free;
    let lifted = match is_free(first) {
        true => Some((0, 0.0)),
        false => search.run(first, (0..n_steps).map(|w| (w, Direction::Forward)).collect()),
    };
    let landing = match is_free(last) {
        true => Some((n_steps - 1, 1.0)),
        false => search.run(last, (0..n_steps).rev().map(|w| (w, Direction::Backward)).collect()),
    };
    if search.log.work.cut().is_some() {
        return None;
    }
    let (Some(lifted), Some(landing)) = (lifted, landing) else {
        search.report(Moment::at(s, 0), "never gets clear of the object".into(), 0.0, settings.lift_clearance);
        return None;
    };
    (lifted < landing).then_some((lifted, landing))
}

#[derive(Clone, Copy, PartialEq)]
enum Direction {
    Forward,
    Backward,
}

struct Search<'a> {
    bodies: &'a Bodies,
    finger: &'a FingerModel,
    f: usize,
    segment: &'a Segment,
    s: usize,
    settings: &'a CheckSettings,
    log: &'a mut Log,
    n_distances: &'a mut u64,
}

impl Search<'_> {
    fn report(&mut self, at: Moment, what: String, amount: f64, limit: f64) {
        let message = format!("finger \"{}\" {what}", self.finger.name);
        let violation = Violation::new(Kind::LandingOrLiftingNotFree, message).when(at);
        self.log.push(violation.subjects([self.finger.name.as_str()]).amount(amount, limit));
    }

    /// Walks away from the contact at `end` until the tip is clear; where that is.
    fn run(&mut self, end: &Waypoint, steps: Vec<(usize, Direction)>) -> Option<(usize, f64)> {
        let contact = contact_of(&end.contacts[self.f])?;
        let object = Pose::from(&end.world_from_object);
        let normal: Vector = object * contact.normal_in_object.into_inner();
        let at_contact = self.finger.center_in_world(&end.joints);
        let bodies = self.bodies;
        let is_ours = |pair: &&Pair| pair.tip_of == Some(self.f) && bodies.items[pair.b].owner == Owner::Object;
        let pairs: Vec<Pair> = bodies.pairs.iter().filter(is_ours).copied().collect();
        let mut reported = false;
        for (w, direction) in steps {
            let (from, to) = (&self.segment.waypoints[w], &self.segment.waypoints[w + 1]);
            let mut step = WaypointStep::new(bodies, from, to);
            let speed = pairs.iter().map(|pair| step.speed(pair.a)).fold(0.0, f64::max);
            let n_samples = ((speed / self.settings.resolution).ceil() as usize).clamp(1, MOST_SAMPLES);
            if !self.log.work.spend(n_samples as u64, "how fingertips lift off and land") {
                return None;
            }
            for sample in 0..=n_samples {
                let t = match direction {
                    Direction::Forward => sample as f64 / n_samples as f64,
                    Direction::Backward => 1.0 - sample as f64 / n_samples as f64,
                };
                let way = self.finger.center_in_world(&step.joints(t)) - at_contact;
                let along = way.dot(&normal);
                let sideways = (way - normal * along).norm();
                let at = Moment { segment: self.s, waypoint: w, fraction: t };
                let allowed = LARGEST_SLOPE * along.max(0.0) + SIDEWAYS_SLACK;
                if (along < -BACKWARD_SLACK || sideways > allowed) && !reported {
                    let what = match direction {
                        Direction::Forward => "lifts off",
                        Direction::Backward => "lands",
                    };
                    let message =
                        format!("{what} sideways: {sideways:.2e} m beside and {along:.2e} m along the normal");
                    self.report(at, message, sideways, allowed);
                    reported = true;
                }
                let nearest =
                    pairs.iter().map(|pair| step.measure(pair, t).unwrap_or(0.0)).fold(f64::INFINITY, f64::min);
                if nearest >= self.settings.lift_clearance {
                    *self.n_distances += step.n_distances;
                    return Some((w, t));
                }
            }
            *self.n_distances += step.n_distances;
        }
        None
    }
}
