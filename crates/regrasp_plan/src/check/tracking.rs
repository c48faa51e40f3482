//! Tracking: every fingertip stays on the object, the fingers named move, and every contact is in the mode that the plan says
//! with the relative velocity that it says, by poses alone (Cherif 1999, sec. 6.1.2 and 6.2.2, table 1).
//!
//! What a fingertip does from a waypoint to the next belongs to the first of the two, and at the last waypoint to that as well.
//! Seen from the object, a step has
//!
//! - the slide: the integral of the velocity of the touching point of the link, without its part along the normal
//!   ([`sliding`](crate::check::rolling::Roll::sliding));
//! - the turn of the link, and the parts of its angular speed about the normal and across it ([`turning`](crate::check::rolling::Roll::turning)).
//!
//! A contact on an edge or a corner has the normal along which the tip's centre lies; the tip rolls, slides and pivots there
//! as it does on faces.
//!
//! | mode | slide | turn about the normal | turn across it |
//! |---|---|---|---|
//! | fixed | none | none | none |
//! | twisting | none | any | none |
//! | pure rolling | none | none | any |
//! | rolling | none | any | any |
//! | pure sliding | in every step | none | none |
//! | sliding | in every step | any | any |
//!
//! None is `slip_tolerance` of the plan for slides, but no faster than `largest_slip_speed` on the mean, and
//! `turn_tolerance` for turns, each summed over the steps of a segment so that nothing cancels. In every step is faster
//! than `smallest_sliding_speed`. Relative velocities are means: slide and turn over the time of the step.

use crate::check::between::Between;
use crate::check::contact::{error_at, off_contact};
use crate::check::model::{CheckedHand, FingerModel};
use crate::check::roles::{contact_of, contacts_agree};
use crate::check::rolling::{Roll, Rolled, Turning, UNKNOWN_SHARE};
use crate::check::step_slip::StepSlip;
use crate::check::surface::SortedShape;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log};
use crate::plan::{ContactMode, ContactState, Plan, Segment, SegmentKind, Waypoint};
use regrasp_geometry::{Pose, Vector};
use std::collections::BTreeMap;

/// Share of a slide that may stay unknown where it is compared with the plan's relative velocity, and what may anyway, in
/// metres: a tenth of the way in a tenth of a second at the smallest sliding speed counts as sliding.
const UNKNOWN_SLIDE: (f64, f64) = (1e-3, 1e-9);

/// Least number of fingers that rest while the object moves (Cherif 1999, sec. 8: two of three).
const FEWEST_RESTING: usize = 2;

/// True where a tracking segment says that finger `f` moves.
pub fn may_move(model: &CheckedHand, segment: &Segment, f: usize) -> bool {
    let name = &model.fingers[f].name;
    segment.moving_fingers().any(|moving| moving == name)
}

/// Indices of the fingers that a tracking segment names: the (first) moving and the rolling one.
pub fn named_fingers(model: &CheckedHand, segment: &Segment) -> [Option<usize>; 2] {
    [&segment.moving_finger, &segment.rolling_finger]
        .map(|name| model.fingers.iter().position(|finger| Some(&finger.name) == name.as_ref()))
}

/// Who may do what in a tracking segment, from the waypoints alone; that the others rest is judged in `continuity`.
pub fn check_tracking_roles(model: &CheckedHand, segment: &Segment, s: usize, settings: &CheckSettings, log: &mut Log) {
    let [moving, rolling] = named_fingers(model, segment);
    if moving.is_none() {
        let message = format!("moving finger {:?} is none of the hand's", segment.moving_finger);
        log.push(Violation::new(Kind::WrongMovingFinger, message).when(Moment::at(s, 0)));
    }
    for name in &segment.also_moving {
        let again = segment.also_moving.iter().filter(|other| *other == name).count() > 1;
        let unknown = !model.fingers.iter().any(|finger| finger.name == *name);
        if unknown || again || segment.moving_finger.as_ref() == Some(name) {
            let message = format!("\"{name}\" is named as also moving, but is none of the hand's or named twice");
            log.push(Violation::new(Kind::WrongMovingFinger, message).when(Moment::at(s, 0)));
        }
    }
    let n_resting = (0..model.fingers.len()).filter(|&f| !may_move(model, segment, f)).count();
    if n_resting < FEWEST_RESTING {
        let message = format!("{n_resting} fingers rest, fewer than {FEWEST_RESTING}");
        log.push(Violation::new(Kind::WrongMovingFinger, message).when(Moment::at(s, 0)));
    }
    if rolling.is_none_or(|rolling| may_move(model, segment, rolling)) {
        let what = if rolling.is_none() { "none of the hand's" } else { "one that moves" };
        let message = format!("rolling finger {:?} is {what}", segment.rolling_finger);
        log.push(Violation::new(Kind::WrongRollingFinger, message).when(Moment::at(s, 0)));
    }
    for (f, finger) in model.fingers.iter().enumerate() {
        let state = |w: usize| &segment.waypoints[w].contacts[f];
        let slides = (0..segment.waypoints.len()).find(|&w| state(w).mode.slides());
        if let Some(w) = slides.filter(|_| rolling == Some(f)) {
            let message = format!("rolling finger \"{}\" is said to slide", finger.name);
            log.push(Violation::new(Kind::WrongRollingFinger, message).when(Moment::at(s, w)));
        }
        if let Some((w, what)) = wrong_mode(finger, segment, f) {
            let message = format!("finger \"{}\" {what}", finger.name);
            let violation = Violation::new(Kind::WrongContactMode, message).when(Moment::at(s, w));
            log.push(violation.subjects([finger.name.as_str()]));
        }
        for w in 1..segment.waypoints.len() {
            let (before, after) = (state(w - 1), state(w));
            let is_fixed = before.mode == ContactMode::Fixed;
            if is_fixed && !contacts_agree(before, after, settings.meeting_tolerance) {
                let message = format!("the fixed contact of finger \"{}\" is another one here", finger.name);
                log.push(Violation::new(Kind::GraspChanges, message).when(Moment::at(s, w)));
            }
        }
    }
}

/// The first waypoint at which a finger has a mode that it may not have, and why.
fn wrong_mode(finger: &FingerModel, segment: &Segment, f: usize) -> Option<(usize, String)> {
    let mut mode: Option<ContactMode> = None;
    let last = segment.waypoints.len() - 1;
    for (w, waypoint) in segment.waypoints.iter().enumerate() {
        let here = waypoint.contacts[f].mode;
        if here == ContactMode::Free {
            return Some((w, "does not touch, but in tracking every finger does".into()));
        }
        if finger.radius == 0.0 {
            return Some((w, "has a sharp tip, with which nothing is tracked".into()));
        }
        if w == last && here != segment.waypoints[last - 1].contacts[f].mode {
            return Some((w, "ends in another mode than that of the way there".into()));
        }
        let before = *mode.get_or_insert(here);
        if before == ContactMode::Fixed {
            mode = Some(here);
        } else if here != ContactMode::Fixed && here != before {
            return Some((w, format!("is said to be {here:?}, but {before:?} before")));
        }
    }
    None
}

/// Point on the tip, relative velocity and turn are there in tracking, and only there.
pub fn check_present(model: &CheckedHand, segment: &Segment, s: usize, log: &mut Log) {
    let is_tracking = segment.kind == SegmentKind::Tracking;
    for (w, waypoint) in segment.waypoints.iter().enumerate() {
        for (finger, state) in model.fingers.iter().zip(&waypoint.contacts) {
            let there = [state.point_in_tip, state.relative_velocity_in_object, state.relative_turn_in_object];
            if there.iter().all(|vector| vector.is_some() == (is_tracking && state.holds())) {
                continue;
            }
            let message = format!(
                "finger \"{}\" {} its point on the tip, relative velocity and relative turn",
                finger.name,
                if is_tracking { "lacks some of" } else { "is not tracked, but has some of" }
            );
            let violation = Violation::new(Kind::RelativeMotionMissing, message).when(Moment::at(s, w));
            log.push(violation.subjects([finger.name.as_str()]));
        }
    }
}

/// Judges every contact of every tracking segment.
pub fn check_tracking(
    shape: &SortedShape,
    model: &CheckedHand,
    plan: &Plan,
    settings: &CheckSettings,
    log: &mut Log,
) -> Rolled {
    let mut rolled = Rolled::default();
    let mut steps = BTreeMap::new();
    let tolerance = plan.promises.contact_tolerance.min(settings.largest_contact_tolerance);
    let slip_tolerance = plan.promises.slip_tolerance.min(settings.largest_slip_tolerance);
    for (s, segment) in plan.segments.iter().enumerate().filter(|(_, one)| one.kind == SegmentKind::Tracking) {
        for (f, finger) in model.fingers.iter().enumerate() {
            let mut track = Track {
                finger,
                f,
                segment,
                s,
                settings,
                tolerance,
                slip_tolerance,
                sums: Default::default(),
                still: 0.0,
                steps: &mut steps,
                log,
            };
            let error = track.check_touch(shape);
            rolled.max_contact_error = rolled.max_contact_error.max(error);
            track.check_modes(shape);
            if segment.waypoints.iter().any(|waypoint| !waypoint.contacts[f].mode.slides()) {
                let slip = track.sums[SLIP].total;
                rolled.max_slip = Some(rolled.max_slip.map_or(slip, |most: f64| most.max(slip)));
            }
        }
    }
    Rolled { steps, ..rolled }
}

/// A sum over the steps of a segment, and its largest part with the waypoint that it belongs to.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    total: f64,
    worst: (f64, usize),
}

impl Sum {
    fn add(&mut self, part: f64, w: usize) {
        self.total += part;
        if part > self.worst.0 {
            self.worst = (part, w);
        }
    }
}

/// Indices of [`Track::sums`]: slides of modes that do not slide, and turns, turns about the normal and turns across it of
/// modes that do not turn so.
const SLIP: usize = 0;
const TURN: usize = 1;
const TWIST: usize = 2;
const ROLL: usize = 3;

/// One finger in one segment.
struct Track<'a> {
    finger: &'a FingerModel,
    f: usize,
    segment: &'a Segment,
    s: usize,
    settings: &'a CheckSettings,
    tolerance: f64,
    slip_tolerance: f64,
    sums: [Sum; 4],
    /// Time of the steps in modes that do not slide, in seconds.
    still: f64,
    steps: &'a mut BTreeMap<(usize, usize, usize), StepSlip>,
    log: &'a mut Log,
}

impl Track<'_> {
    fn state(&self, w: usize) -> &ContactState {
        &self.segment.waypoints[w].contacts[self.f]
    }

    fn report(&mut self, kind: Kind, at: Moment, message: String, amount: f64, limit: f64) {
        let violation = Violation::new(kind, message).when(at).subjects([self.finger.name.as_str()]);
        self.log.push(violation.amount(amount, limit));
    }

    /// The tip is on its contact at waypoints, with the point that the plan says, and on the surface between them. The largest
    /// error.
    fn check_touch(&mut self, shape: &SortedShape) -> f64 {
        let mut largest: (f64, Moment) = (0.0, Moment::at(self.s, 0));
        let mut worst_point: (f64, usize) = (0.0, 0);
        for (w, waypoint) in self.segment.waypoints.iter().enumerate() {
            let mut note = |error: f64, fraction: f64| {
                if error > largest.0 {
                    largest = (error, Moment { segment: self.s, waypoint: w, fraction });
                }
            };
            if waypoint.contacts[self.f].holds() {
                note(error_at(self.finger, waypoint, self.f), 0.0);
            }
            if let Some(next) = self.segment.waypoints.get(w + 1) {
                let roll = Roll::new((self.f, self.finger), waypoint, next, shape, self.tolerance);
                let (between, fraction) = roll.off_surface(self.tolerance);
                if !self.log.work.spend(roll.looked(), "fingertips in tracking") {
                    break;
                }
                note(between, fraction);
            }
            let off = self.point_error(waypoint).unwrap_or(0.0);
            if off > worst_point.0 {
                worst_point = (off, w);
            }
        }
        if largest.0 > self.tolerance {
            self.log.push(off_contact(self.finger, largest.0, self.tolerance).when(largest.1));
        }
        if worst_point.0 > self.tolerance {
            let message =
                format!("the point on the tip of finger \"{}\" is {:.3e} m elsewhere", self.finger.name, worst_point.0);
            self.report(Kind::ContactOffTip, Moment::at(self.s, worst_point.1), message, worst_point.0, self.tolerance);
        }
        largest.0
    }

    /// Distance of the stated point on the tip from the contact.
    fn point_error(&self, waypoint: &Waypoint) -> Option<f64> {
        let state = &waypoint.contacts[self.f];
        let contact = contact_of(state)?;
        let world_from_tip = self.finger.path.world_from_link(&waypoint.joints) * self.finger.body_from_tip_link;
        let stated = world_from_tip.transform_point(&state.point_in_tip?.into());
        Some((stated - Pose::from(&waypoint.world_from_object) * contact.point_in_object).norm())
    }

    /// Modes and relative velocities of all steps.
    fn check_modes(&mut self, shape: &SortedShape) {
        let n_steps = self.segment.waypoints.len() - 1;
        for w in 0..n_steps {
            let (from, to) = (&self.segment.waypoints[w], &self.segment.waypoints[w + 1]);
            let mode = self.state(w).mode;
            let roll = Roll::new((self.f, self.finger), from, to, shape, self.tolerance);
            let unknown = UNKNOWN_SHARE * self.slip_tolerance;
            let allowed = |slide: &Vector| match mode.slides() {
                true => (UNKNOWN_SLIDE.0 * slide.norm()).max(UNKNOWN_SLIDE.1),
                false => unknown,
            };
            // A tip that is nowhere near is off its contact.
            let (slid, turned) = (roll.sliding(allowed), roll.turning());
            if !self.log.work.spend(roll.looked(), "modes of contacts in tracking") {
                return;
            }
            let (Some((slide, unknown)), Some(turning)) = (slid, turned) else { continue };
            self.add_up(mode, slide.norm() + unknown, &turning, w);
            if !mode.slides() {
                let step = roll.step_slip(self.finger, slide.norm() + unknown);
                self.steps.insert((self.f, self.s, w), step);
            }
            let span = to.time - from.time;
            if span <= 0.0 {
                continue;
            }
            self.still += if mode.slides() { 0.0 } else { span };
            if mode.slides() && slide.norm() - unknown < self.settings.smallest_sliding_speed * span {
                let (speed, least) = (slide.norm() / span, self.settings.smallest_sliding_speed);
                let message = format!(
                    "finger \"{}\" is said to slide, but goes {speed:.3e} m/s over the object",
                    self.finger.name
                );
                self.report(Kind::ContactModeWrong, Moment::at(self.s, w), message, speed, least);
            }
            let found = Found { velocity: slide / span, unknown: unknown / span, turn: turning.whole / span };
            self.check_velocities(w, &found);
            if w + 1 == n_steps {
                self.check_velocities(n_steps, &found);
            }
        }
        self.check_sums();
    }

    fn add_up(&mut self, mode: ContactMode, slide: f64, turning: &Turning, w: usize) {
        if !mode.slides() {
            self.sums[SLIP].add(slide, w);
        }
        match mode {
            ContactMode::Fixed | ContactMode::PureSliding => self.sums[TURN].add(turning.all, w),
            ContactMode::PureRolling => self.sums[TWIST].add(turning.twist, w),
            ContactMode::Twisting => self.sums[ROLL].add(turning.roll, w),
            ContactMode::Rolling | ContactMode::Sliding | ContactMode::Free => {}
        }
    }

    fn check_sums(&mut self) {
        let name = self.finger.name.as_str();
        let Sum { total, worst } = self.sums[SLIP];
        let limit = self.slip_tolerance.min(self.settings.largest_slip_speed * self.still);
        if total > limit {
            let message = format!(
                "the tip of finger \"{name}\" slides {total:.3e} m over the object in this segment, most of it here"
            );
            self.report(Kind::Slip, Moment::at(self.s, worst.1), message, total, limit);
        }
        for (which, how) in [(TURN, "turns"), (TWIST, "turns about the normal"), (ROLL, "turns across the normal")] {
            let Sum { total, worst } = self.sums[which];
            let limit = self.settings.turn_tolerance;
            if total > limit {
                let mode = self.state(worst.1).mode;
                let message = format!(
                    "finger \"{name}\" is said to be {mode:?}, but {how} by {total:.3e} rad in this segment, most of it here"
                );
                self.report(Kind::ContactModeWrong, Moment::at(self.s, worst.1), message, total, limit);
            }
        }
    }

    /// Relative velocity and turn that the plan states at a waypoint against those of its step.
    fn check_velocities(&mut self, w: usize, found: &Found) {
        let state = *self.state(w);
        let CheckSettings { relative_velocity_share: share, relative_velocity_angle, velocity_tolerance, .. } =
            *self.settings;
        let name = self.finger.name.as_str();
        if let Some(stated) = state.relative_velocity_in_object.map(Vector::from) {
            let (size, speed) = (stated.norm(), found.velocity.norm());
            let off = if state.mode.slides() { (size - speed).abs() } else { size - speed };
            let limit = share * speed + velocity_tolerance + found.unknown;
            if off > limit {
                let message = format!("finger \"{name}\" is said to slide with {size:.4e} m/s, poses say {speed:.4e}");
                self.report(Kind::RelativeVelocityWrong, Moment::at(self.s, w), message, off, limit);
            } else if state.mode.slides() && stated.angle(&found.velocity) > relative_velocity_angle {
                let angle = stated.angle(&found.velocity);
                let message = format!("finger \"{name}\" slides {angle:.4} rad from where it is said to");
                self.report(
                    Kind::RelativeVelocityWrong,
                    Moment::at(self.s, w),
                    message,
                    angle,
                    relative_velocity_angle,
                );
            }
        }
        if let Some(stated) = state.relative_turn_in_object.map(Vector::from) {
            let rests = matches!(state.mode, ContactMode::Fixed | ContactMode::PureSliding);
            let off = if rests { stated.norm() - found.turn.norm() } else { (stated - found.turn).norm() };
            let limit = share * found.turn.norm() + velocity_tolerance;
            if off > limit {
                let message =
                    format!("the relative turn of finger \"{name}\" is {off:.4e} rad/s off that of the poses");
                self.report(Kind::RelativeVelocityWrong, Moment::at(self.s, w), message, off, limit);
            }
        }
    }
}

/// What the poses say of a step, per second, in the object frame.
struct Found {
    velocity: Vector,
    unknown: f64,
    turn: Vector,
}

/// Every tip's centre stays within `reach` of where it is at rest, at and between waypoints.
///
/// Between two moments `h` apart the centre strays from its chord by at most acceleration `h^2 / 8`, and on the chord it is
/// farthest at an end. Steps are halved until that decides; what it does not decide counts as too far.
pub fn check_reach(reach: f64, model: &CheckedHand, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    let limit = reach + settings.limit_tolerance;
    for (s, segment) in plan.segments.iter().enumerate() {
        for finger in &model.fingers {
            let steps = segment.waypoints.windows(2).enumerate();
            let work = &mut log.work;
            let far = steps.map_while(|(w, ends)| {
                let (far, looked) = too_far(finger, &ends[0], &ends[1], limit);
                work.spend(looked, "how far fingertips reach").then_some((w, far))
            });
            let far = far.filter_map(|(w, far)| Some((w, far?))).next();
            let Some((w, (distance, t))) = far else { continue };
            let message = format!(
                "the tip of finger \"{}\" is {distance:.6} m from where it rests, {reach:.6} m are allowed",
                finger.name
            );
            let at = if t < 1.0 { Moment { segment: s, waypoint: w, fraction: t } } else { Moment::at(s, w + 1) };
            let violation = Violation::new(Kind::OutOfReach, message).when(at).subjects([finger.name.as_str()]);
            log.push(violation.amount(distance, reach));
        }
    }
}

/// Where in a step the tip's centre is farther than `limit` from where it rests, or may be, and how far; and the number of
/// configurations looked at.
fn too_far(finger: &FingerModel, from: &Waypoint, to: &Waypoint, limit: f64) -> (Option<(f64, f64)>, u64) {
    let motion = Between::new(from, to);
    let acceleration = finger.path.rates(&finger.center, 0.0, &motion.joint_bounds()).acceleration;
    let distance = |t: f64| (finger.center_in_world(&motion.joints_at(t)) - finger.center_at_rest).norm();
    let ends = [0.0, 1.0].map(|t| (distance(t), t));
    let mut pending = vec![ends];
    let mut looked = 2;
    while let Some([first, second]) = pending.pop() {
        if let Some(&far) = [first, second].iter().find(|(distance, _)| !(*distance <= limit)) {
            return (Some(far), looked);
        }
        let span = second.1 - first.1;
        let most = first.0.max(second.0) + acceleration * span * span / 8.0;
        if most <= limit {
            continue;
        }
        if span < SMALLEST_SPAN {
            return (Some((most, first.1)), looked);
        }
        let middle = 0.5 * (first.1 + second.1);
        let middle = (distance(middle), middle);
        looked += 1;
        pending.extend([[middle, second], [first, middle]]);
    }
    (None, looked)
}

/// Share of a step that is not divided further.
const SMALLEST_SPAN: f64 = 1e-3;
