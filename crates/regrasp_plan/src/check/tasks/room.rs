//! Who touches what: every pair of bodies at every moment, with the object where its holders put it, and who holds it by geometry.
//!
//! | pair | what it has to keep |
//! |---|---|
//! | fingertip with a contact, or of the hand that closes or opens, and the object | an overlap of at most the contact tolerance |
//! | the object and the support on which it stands, or from which it comes or to which it goes in this carry | an overlap of at most 0.1 mm |
//! | other links of hands, and the object | they do not touch: hands work close to objects |
//! | all others | the clearance promised |
//!
//! In a carry that comes from a support or goes to one the object's distance from it is, at sampled moments, at least a tenth of how far the
//! object has moved from where it stands, less 0.1 mm, until it has the clearance: objects do not slide over supports. All overlaps are
//! certified to 0.05 mm.

use crate::check::model::FingerModel;
use crate::check::robots::along::RobotAlong;
use crate::check::robots::apart::{Placed, check_segment};
use crate::check::robots::items::{Item, Items, Owner, are_judged};
use crate::check::robots::motion::RobotStep;
use crate::check::robots::tree::Frame;
use crate::check::surface::SortedShape;
use crate::check::tasks::contacts::finger_of;
use crate::check::tasks::holders::{Holder, Phase};
use crate::check::tasks::rest::{Hold, hold_at};
use crate::check::tasks::standing::{Feet, INSIDE, LEAST_INSIDE, Plane, Top, foot_of, inside};
use crate::check::tasks::task::Task;
use crate::check::tip_surface::TipSurface;
use crate::check::violation::{Moment, Violation, ViolationKind as Kind};
use crate::check::{CheckSettings, Log, Report};
use crate::robot_plan::{RobotPlan, RobotSegment, RobotSegmentKind, RobotWaypoint};
use regrasp_geometry::{Point, Pose};
use regrasp_robot::Part;
use regrasp_scene::State;
use std::collections::BTreeSet;

/// An object that leaves a support is at least this share of its way away from it.
const LEAVING: f64 = 0.1;
/// Moments at which a step away from a support is looked at.
const SAMPLES: usize = 16;

/// What is judged, and by what.
pub struct Room<'a> {
    task: &'a Task<'a>,
    phases: &'a [Phase],
    holds: &'a [Hold],
    plan: &'a RobotPlan,
    settings: &'a CheckSettings,
    feet: Feet,
    shape: SortedShape,
    plane: Plane,
    /// Of every support, where it has one.
    tops: Vec<Result<Top, String>>,
}

impl<'a> Room<'a> {
    /// Of a plan whose holders are known.
    pub fn new(
        task: &'a Task<'a>,
        (phases, holds): (&'a [Phase], &'a [Hold]),
        plan: &'a RobotPlan,
        settings: &'a CheckSettings,
    ) -> Self {
        let plane = Plane::across(task.up());
        let tops = task.scene.supports.iter().map(|support| Top::of(support, &plane)).collect();
        let (feet, shape) = (Feet::of(&task.object.shape), SortedShape::of(&task.object.shape));
        Room { task, phases, holds, plan, settings, feet, shape, plane, tops }
    }

    /// Horizontal planes of the scene.
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// Where the object touches a support at a pose, in the world; none where it does not, or where that is not judged.
    pub fn touching(&self, support: usize, world_from_object: &Pose) -> Vec<Point> {
        let top = self.tops[support].as_ref();
        top.map_or_else(|_| Vec::new(), |top| self.feet.touching(world_from_object, top, &self.plane))
    }

    /// Objects on supports stand there.
    pub fn check_standing(&self, log: &mut Log) {
        let mut before: BTreeSet<usize> = BTreeSet::new();
        for (s, phase) in self.phases.iter().enumerate() {
            let present: BTreeSet<usize> = phase.supports().collect();
            for &support in present.difference(&before) {
                self.check_stand(support, s, log);
            }
            before = present;
        }
    }

    fn check_stand(&self, support: usize, s: usize, log: &mut Log) {
        let name = self.task.scene.supports[support].body.name.as_str();
        let object = self.plan.objects[0].as_str();
        let tell = |message: String| {
            Violation::new(Kind::Unsupported, message).when(Moment::at(s, 0)).subjects([object, name])
        };
        if let Err(reason) = &self.tops[support] {
            log.push(tell(reason.clone()));
            return;
        }
        let pose = Pose::from(&self.plan.segments[s].waypoints[0].world_from_objects[0]);
        let touching = self.touching(support, &pose);
        if touching.is_empty() {
            log.push(tell(format!("\"{object}\" does not touch the top of \"{name}\" within 0.5 mm")));
            return;
        }
        let center = pose * self.task.object.center_of_mass;
        let margin = inside(&touching, &foot_of(&center, &touching, &self.plane), &self.plane);
        if !(margin >= LEAST_INSIDE) {
            let message = format!(
                "the centre of mass of \"{object}\" is {:.2} mm inside what touches \"{name}\", at least 2 mm are asked for",
                1e3 * margin
            );
            log.push(tell(message).amount(margin, LEAST_INSIDE));
        }
    }

    /// Clearance along the whole plan, for charts.
    pub fn along(&self, state: &State, n_moments: usize) -> Result<RobotAlong, String> {
        let mut items = Items::of_object((self.task.scene, state), &self.task.question, self.task.object_index)?;
        let mut along = RobotAlong::default();
        let step = self.plan.duration() / n_moments.max(1) as f64;
        for (s, segment) in self.plan.segments.iter().enumerate().filter(|(_, segment)| !segment.kind.is_in_hand()) {
            self.arrange(&mut items, s, segment);
            let mut placed = Placed::new(&self.task.question.tree, &items);
            along.add_segment(&mut placed, segment, s, step);
        }
        Ok(along)
    }

    /// Puts the object where it is in a segment, and makes the segment's pairs. The body that the object goes with.
    fn arrange(&self, items: &mut Items, s: usize, segment: &RobotSegment) -> Option<usize> {
        let (body, frame) = self.object_in(s);
        items.put_object(body, frame);
        let touching = self.touching_tips(s, segment);
        items.pairs.clear();
        items.add_pairs(&self.task.question.tree, |a, b| self.floor(s, &touching, a, b));
        body
    }

    /// Distances along the whole plan.
    pub fn check_room(&self, state: &State, (log, report): (&mut Log, &mut Report)) {
        let mut items = match Items::of_object((self.task.scene, state), &self.task.question, self.task.object_index) {
            Ok(items) => items,
            Err(message) => {
                log.push(Violation::new(Kind::WrongScene, message));
                return;
            }
        };
        // In a transfer or regrasp nothing moves but one hand's fingers and the object: `in_hand` judges them.
        for (s, segment) in self.plan.segments.iter().enumerate().filter(|(_, segment)| !segment.kind.is_in_hand()) {
            let body = self.arrange(&mut items, s, segment);
            let mut placed = Placed::new(&self.task.question.tree, &items);
            let goes_on = check_segment(&mut placed, segment, s, self.settings, log, &mut report.min_clearance);
            self.check_holders(s, segment, &mut placed, log);
            if body.is_some() {
                self.check_leaving(s, segment, &mut placed, log);
            }
            report.n_distances += placed.n_distances;
            if !goes_on {
                return;
            }
        }
    }

    /// The body that the object goes with in a segment, and where it is there; no body where it rests in the world.
    fn object_in(&self, s: usize) -> (Option<usize>, Frame) {
        let carried = self.phases[s].carrier().and_then(|hand| hold_at(self.holds, hand, s));
        match carried {
            Some(hold) => (Some(self.task.hands[hold.hand].body), hold.body_from_object),
            None => {
                let pose = Pose::from(&self.plan.segments[s].waypoints[0].world_from_objects[0]);
                (None, Frame::of(&pose))
            }
        }
    }

    /// Fingertips that may touch the object: those with contacts, and those that have them before or after a hand closes or opens. By
    /// index in `Manipulator::hands`, and finger.
    fn touching_tips(&self, s: usize, segment: &RobotSegment) -> BTreeSet<(usize, usize)> {
        let phase = &self.phases[s];
        let beside = match phase.kind {
            RobotSegmentKind::Grasp => self.plan.segments.get(s + 1).map(|next| &next.waypoints[0]),
            RobotSegmentKind::Release => {
                s.checked_sub(1).and_then(|before| self.plan.segments[before].waypoints.last())
            }
            _ => None,
        };
        let mut tips = BTreeSet::new();
        for (waypoint, is_beside) in [(Some(&segment.waypoints[0]), false), (beside, true)] {
            for contact in waypoint.iter().flat_map(|waypoint| &waypoint.contacts) {
                let Some(hand) = self.task.hand_named(&contact.hand) else { continue };
                let counts = if is_beside { phase.closing == Some(hand) } else { phase.has_hand(hand) };
                let hand = &self.task.hands[hand];
                tips.extend(finger_of(hand, contact).filter(|_| counts).map(|finger| (hand.index, finger)));
            }
        }
        tips
    }

    /// Supports that the object may touch in a segment.
    fn supports_near(&self, s: usize) -> BTreeSet<usize> {
        let mut near: BTreeSet<usize> = self.phases[s].supports().collect();
        if self.phases[s].carrier().is_some() {
            let beside = [s.checked_sub(1), Some(s + 1)].into_iter().flatten();
            near.extend(beside.filter_map(|s| self.phases.get(s)).flat_map(Phase::supports));
        }
        near
    }

    fn floor(&self, s: usize, touching: &BTreeSet<(usize, usize)>, first: &Item, second: &Item) -> Option<f64> {
        let apart = (self.plan.promises.clearance - self.settings.resolution).max(0.0);
        match (first.owner, second.owner) {
            (Owner::Link(_), Owner::Link(_)) => are_judged(first, second, &self.task.question).then_some(apart),
            (Owner::Carried(_), Owner::Carried(_)) => None,
            (Owner::Link(_), Owner::Carried(_)) | (Owner::Carried(_), Owner::Link(_)) => {
                let (link, object) =
                    if matches!(first.owner, Owner::Link(_)) { (first, second) } else { (second, first) };
                // Fingertips ask for the object's shape, all else for its hull, where it has one.
                if if link.tip_of.is_some() { object.is_hull } else { object.is_for_tips_only } {
                    return None;
                }
                let may_touch = link.tip_of.is_some_and(|tip| touching.contains(&tip));
                let Owner::Link(id) = link.owner else { return None };
                // Hands work close to the object.
                let is_of_hand = matches!(self.task.question.robot.part_of(id), Part::Hand(_));
                let apart = if is_of_hand { 0.0 } else { apart };
                Some(if may_touch {
                    -self.task.contact_tolerance(self.settings.largest_contact_tolerance)
                } else {
                    apart
                })
            }
            (Owner::Carried(_), Owner::Still) | (Owner::Still, Owner::Carried(_)) => {
                let (object, still) =
                    if matches!(first.owner, Owner::Carried(_)) { (first, second) } else { (second, first) };
                let is_near = still.support.is_some_and(|support| self.supports_near(s).contains(&support));
                // Supports carry the shape; everything else keeps away from the hull.
                match is_near {
                    true => (!object.is_hull).then_some(-INSIDE - self.settings.resolution),
                    false => (!object.is_for_tips_only).then_some(apart),
                }
            }
            _ => Some(apart),
        }
    }

    /// Who touches the object all through a segment holds it, and is named.
    fn check_holders(&self, s: usize, segment: &RobotSegment, placed: &mut Placed, log: &mut Log) {
        let phase = &self.phases[s];
        let tolerance = self.task.contact_tolerance(self.settings.largest_contact_tolerance);
        let tips: Vec<(usize, (usize, usize))> = placed.tips_of_object();
        // Fingers that touch at every waypoint so far.
        let fingers = self.task.hands.iter().flat_map(|hand| (0..hand.fingers.len()).map(|f| (hand.index, f)));
        let mut touching: BTreeSet<(usize, usize)> = fingers.collect();
        let named: BTreeSet<usize> = phase.hands().map(|hand| self.task.hands[hand].index).collect();
        for waypoint in &segment.waypoints {
            if touching.is_empty() {
                break;
            }
            placed.place(&waypoint.joints);
            let near: BTreeSet<(usize, usize)> = tips
                .iter()
                .filter(|(item, tip)| touching.contains(tip) && placed.is_near_object(*item, tolerance))
                .map(|(_, tip)| *tip)
                .chain(self.sharp_tips_near(waypoint, tolerance).filter(|tip| touching.contains(tip)))
                .collect();
            touching = near;
        }
        let holding: BTreeSet<usize> = touching.iter().map(|(hand, _)| *hand).collect();
        for hand in &self.task.hands {
            let (touches, is_named) = (holding.contains(&hand.index), named.contains(&hand.index));
            if touches != is_named {
                let message = match touches {
                    true => {
                        format!("hand \"{}\" touches the object all the time, and is not named as a holder", hand.name)
                    }
                    false => {
                        format!("the plan says that hand \"{}\" holds; no fingertip touches all the time", hand.name)
                    }
                };
                let violation = Violation::new(Kind::WrongHolder, message).when(Moment::at(s, 0));
                log.push(violation.subjects([hand.name.as_str()]));
            }
        }
        for support in 0..self.tops.len() {
            if phase.holders.contains(&Holder::Support(support)) {
                continue;
            }
            let n = segment.waypoints.len();
            // The middle of a carry is where supports are far away.
            let stands = (0..n).map(|w| (w + n / 2) % n).all(|w| {
                let pose = Pose::from(&segment.waypoints[w].world_from_objects[0]);
                !self.touching(support, &pose).is_empty()
            });
            if stands {
                let name = self.task.scene.supports[support].body.name.as_str();
                let message = format!("the object stands on \"{name}\", which is not named as a holder");
                log.push(Violation::new(Kind::WrongHolder, message).when(Moment::at(s, 0)).subjects([name]));
            }
        }
    }

    /// Sharp fingertips on the object's surface: they have no shape.
    fn sharp_tips_near(&self, waypoint: &RobotWaypoint, tolerance: f64) -> impl Iterator<Item = (usize, usize)> {
        let world_from_object = Pose::from(&waypoint.world_from_objects[0]);
        let is_near = |finger: &FingerModel| {
            let is_sharp = matches!(finger.surface, TipSurface::Ball) && finger.radius == 0.0;
            let tip = world_from_object.inverse() * finger.center_in_world(&waypoint.joints);
            is_sharp && self.shape.nearest(&tip).distance <= tolerance
        };
        let mut found = Vec::new();
        for hand in &self.task.hands {
            found.extend((0..hand.fingers.len()).filter(|f| is_near(&hand.fingers[*f])).map(|f| (hand.index, f)));
        }
        found.into_iter()
    }

    /// In a carry from or to a support the object does not slide over it.
    fn check_leaving(&self, s: usize, segment: &RobotSegment, placed: &mut Placed, log: &mut Log) {
        let apart = (self.plan.promises.clearance - self.settings.resolution).max(INSIDE);
        let own = |side: Option<usize>, pose: &Pose| {
            let phase = side.and_then(|s| self.phases.get(s));
            phase.into_iter().flat_map(Phase::supports).map(|support| (support, *pose)).collect::<Vec<_>>()
        };
        let at = |w: usize| Pose::from(&segment.waypoints[w].world_from_objects[0]);
        let mut stands = own(s.checked_sub(1), &at(0));
        stands.extend(own(Some(s + 1), &at(segment.waypoints.len() - 1)));
        let supports: BTreeSet<usize> = stands.iter().map(|(support, _)| *support).collect();
        let radius = self.task.object.radius;
        let mut joints = Vec::new();
        for support in supports {
            let pairs = placed.pairs_of_support(support);
            let ends: Vec<&Pose> = stands.iter().filter(|(own, _)| *own == support).map(|(_, stand)| stand).collect();
            // From a support to the same one the object has to be clear of it in between.
            let mut is_clear = ends.len() < 2 || self.moved(ends[0], ends[1], radius) <= self.settings.pose_tolerance;
            'steps: for (w, ends) in segment.waypoints.windows(2).enumerate() {
                let step = RobotStep::new(&ends[0], &ends[1]);
                for sample in 0..SAMPLES {
                    let u = sample as f64 / SAMPLES as f64;
                    step.joints_at(u, &mut joints);
                    placed.place(&joints);
                    for pair in &pairs {
                        if placed.gap(pair) > apart {
                            is_clear = true;
                            continue;
                        }
                        let pose = placed.pose_of(pair.a);
                        let of_support = stands.iter().filter(|(own, _)| *own == support);
                        let moved = of_support.map(|(_, stand)| self.moved(stand, &pose, radius));
                        let moved = moved.fold(f64::INFINITY, f64::min);
                        let needed = (LEAVING * moved - INSIDE - self.settings.resolution).min(apart);
                        let distance = placed.measure(pair, apart + self.settings.resolution);
                        is_clear |= distance.is_some_and(|distance| distance >= apart);
                        if !distance.is_some_and(|distance| distance >= needed) {
                            let name = self.task.scene.supports[support].body.name.as_str();
                            let object = self.plan.objects[0].as_str();
                            let message = format!(
                                "\"{object}\" slides over \"{name}\": {:.3e} m above it, {moved:.3e} m from where it stands",
                                distance.unwrap_or(f64::NAN)
                            );
                            let violation = Violation::new(Kind::Collision, message);
                            let violation = violation.when(Moment { segment: s, waypoint: w, fraction: u });
                            let amount = distance.unwrap_or(f64::NAN);
                            log.push(violation.subjects([object, name]).amount(amount, needed));
                            is_clear = true;
                            break 'steps;
                        }
                    }
                }
            }
            if !is_clear {
                let name = self.task.scene.supports[support].body.name.as_str();
                let object = self.plan.objects[0].as_str();
                let message = format!("\"{object}\" moves over \"{name}\" and is never clear of it");
                log.push(Violation::new(Kind::Collision, message).when(Moment::at(s, 0)).subjects([object, name]));
            }
        }
    }

    /// At least how far some point of the object is from where it is when the object stands: the motion of its centre of mass, or the
    /// turn at its farthest point.
    fn moved(&self, stand: &Pose, pose: &Pose, radius: f64) -> f64 {
        let center = self.task.object.center_of_mass;
        let shift = (pose * center - stand * center).norm();
        let turn = 2.0 * (0.5 * stand.rotation.angle_to(&pose.rotation)).sin() * radius;
        shift.max(turn)
    }
}
