//! Fingertips that roll, and fingertips that are said to.

use super::Breeder;
use super::choice::{pick, places};
use super::edit::move_tip;
use regrasp_base::Rng;
use regrasp_geometry::{Pose, Shape, UnitVector, Vector};
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::patch::Patch;
use regrasp_plan::check::roles::contact_of;
use regrasp_plan::check::surface;
use regrasp_plan::check::tip_surface::TipSurface;
use regrasp_plan::check::violation::ViolationKind::{
    ContactOffSurface, ContactOffTip, GraspChanges, PromiseBroken, Slip, WrongContactMode,
};
use regrasp_plan::plan::{ContactMode, Plan, Segment, SegmentKind, Waypoint};

impl Breeder<'_> {
    pub(super) fn break_rolling(&mut self) {
        let (model, shape) = (self.model, &self.task.object().shape);
        self.add("slip tolerance raised", &[PromiseBroken], |plan, rng| {
            plan.promises.slip_tolerance = rng.uniform(0.11e-3, 0.2e-3);
            Some(())
        });
        self.add("slip tolerance below the slip", &[Slip], |plan, rng| {
            pick_rolling(plan, model, rng)?;
            plan.promises.slip_tolerance = 0.0;
            Some(())
        });
        self.add("rolling contacts shifted on the object only", &[ContactOffTip, ContactOffSurface], |plan, rng| {
            let (s, f) = pick_rolling(plan, model, rng)?;
            let way = plan.promises.contact_tolerance * rng.uniform(1.5, 3.0);
            for waypoint in &mut plan.segments[s].waypoints {
                let contact = contact_of(&waypoint.contacts[f])?;
                let side = regrasp_geometry::frame::tangents(&contact.normal_in_object).0;
                waypoint.contacts[f].point_in_object = Some((contact.point_in_object + side.into_inner() * way).into());
            }
            Some(())
        });
        self.add("rolling tip slides there and back", &[Slip], |plan, rng| {
            let (s, f) = pick_rolling(plan, model, rng)?;
            let segment = &mut plan.segments[s];
            let inner = segment.waypoints.len().checked_sub(2).filter(|&inner| inner > 0)?;
            let way = plan.promises.slip_tolerance * rng.uniform(1.0, 3.0);
            let angle = rng.uniform(0.0, std::f64::consts::TAU);
            slide(model, shape, &mut segment.waypoints[1 + rng.below(inner)], f, angle, way)
        });
        self.add("rolling tip creeps", &[Slip], |plan, rng| {
            // No step slips by as much as the segment may.
            let (s, f) = pick_rolling(plan, model, rng)?;
            let n_steps = plan.segments[s].waypoints.len() - 1;
            let step = plan.promises.slip_tolerance * rng.uniform(2.5, 4.0) / n_steps as f64;
            let angle = rng.uniform(0.0, std::f64::consts::TAU);
            for (w, waypoint) in plan.segments[s].waypoints.iter_mut().enumerate() {
                slide(model, shape, waypoint, f, angle, step * w.min(n_steps - w) as f64)?;
            }
            (n_steps >= 6).then_some(())
        });
        self.add("link of a rolling tip turned about the tip's centre", &[Slip], |plan, rng| {
            let (s, f) = pick_rolling(plan, model, rng)?;
            let finger = &model.fingers[f];
            let segment = &mut plan.segments[s];
            let inner = segment.waypoints.len().checked_sub(2).filter(|&inner| inner > 0)?;
            let waypoint = &mut segment.waypoints[1 + rng.below(inner)];
            let before = waypoint.clone();
            let center = finger.center_in_world(&waypoint.joints);
            waypoint.joints[finger.coordinates.start + rng.below(finger.coordinates.len())] += rng.uniform(0.1, 0.2);
            move_tip(model, f, &mut waypoint.joints, &center)?;
            (arc_between(model, f, &before, waypoint)? > 2.0 * plan.promises.slip_tolerance).then_some(())
        });
        self.add("pivoting tip passed off as rolling", &[Slip], |plan, rng| {
            let (s, f) = pick_rolling(plan, model, rng)?;
            let first = plan.segments[s].waypoints.first()?.contacts[f];
            let contact = contact_of(&first)?;
            for waypoint in &mut plan.segments[s].waypoints {
                let away = model.fingers[f].center_from_contact(waypoint, &contact.normal_in_object);
                let center = contact.point_in_object + away;
                waypoint.contacts[f] = first;
                move_tip(model, f, &mut waypoint.joints, &(Pose::from(&waypoint.world_from_object) * center))?;
            }
            pivots(model, &plan.segments[s], f, plan.promises.slip_tolerance)
        });
        self.add("fixed contact declared as rolling", &[Slip], |plan, rng| {
            let fixed = |segment: &Segment, f: usize| {
                segment.kind == SegmentKind::Transfer
                    && segment.waypoints[0].contacts[f].mode == ContactMode::Fixed
                    && pivots(model, segment, f, plan.promises.slip_tolerance).is_some()
            };
            let &mut (s, f) = pick(&mut places(plan, model, fixed), rng)?;
            declare(plan, s, f, ContactMode::Rolling);
            Some(())
        });
        self.add("rolling contact declared as fixed", &[GraspChanges], |plan, rng| {
            let (s, f) = pick_rolling(plan, model, rng)?;
            declare(plan, s, f, ContactMode::Fixed);
            Some(())
        });
        self.add("finger stops rolling on its way", &[WrongContactMode], |plan, rng| {
            let (s, f) = pick_rolling(plan, model, rng)?;
            let n_waypoints = plan.segments[s].waypoints.len();
            plan.segments[s].waypoints[1 + rng.below(n_waypoints - 1)].contacts[f].mode = ContactMode::Fixed;
            (plan.segments[s].kind == SegmentKind::Transfer).then_some(())
        });
        self.add("finger rolls while the object rests", &[WrongContactMode], |plan, rng| {
            let holds = |segment: &Segment, f: usize| {
                segment.kind == SegmentKind::Regrasp && segment.waypoints.iter().all(|w| w.contacts[f].holds())
            };
            let &mut (s, f) = pick(&mut places(plan, model, holds), rng)?;
            declare(plan, s, f, ContactMode::Rolling);
            Some(())
        });
    }
}

/// A segment, and a finger that rolls in it and gets somewhere.
fn pick_rolling(plan: &Plan, model: &CheckedHand, rng: &mut Rng) -> Option<(usize, usize)> {
    let rolls = |segment: &Segment, f: usize| {
        let ends = [segment.waypoints.first(), segment.waypoints.last()];
        let [Some(from), Some(to)] = ends.map(|end| end.and_then(|w| w.contacts[f].point_in_object)) else {
            return false;
        };
        let goes = (Vector::from(from) - Vector::from(to)).norm() > 1e-5;
        goes && segment.waypoints.iter().all(|waypoint| waypoint.contacts[f].mode == ContactMode::Rolling)
    };
    pick(&mut places(plan, model, rolls), rng).copied()
}

pub(super) fn declare(plan: &mut Plan, s: usize, f: usize, mode: ContactMode) {
    plan.segments[s].waypoints.iter_mut().for_each(|waypoint| waypoint.contacts[f].mode = mode);
}

/// Moves contact, tip and joints of finger `f` by `way` along the surface, `angle` from the first tangent.
pub(super) fn slide(
    model: &CheckedHand,
    shape: &Shape,
    waypoint: &mut Waypoint,
    f: usize,
    angle: f64,
    way: f64,
) -> Option<()> {
    let radius = model.fingers[f].radius;
    let contact = contact_of(&waypoint.contacts[f])?;
    let (x, y) = regrasp_geometry::frame::tangents(&contact.normal_in_object);
    let side = x.into_inner() * angle.cos() + y.into_inner() * angle.sin();
    let away = model.fingers[f].center_from_contact(waypoint, &contact.normal_in_object);
    let center = contact.point_in_object + away + side * way;
    let foot = Patch::near(&model.shape, &center, radius + 1e-3).foot(&center)?;
    let normal = match model.fingers[f].surface {
        TipSurface::Ball => UnitVector::new_normalize(center - foot).into_inner(),
        // Its centre is not over its contact; the surface is smooth where fingers roll.
        TipSurface::Ellipsoid { .. } => surface::nearest(shape, &foot).normals.first()?.normalize(),
    };
    let away = model.fingers[f].center_from_contact(waypoint, &normal);
    (waypoint.contacts[f].point_in_object, waypoint.contacts[f].normal_in_object) =
        (Some(foot.into()), Some(normal.into()));
    let target = Pose::from(&waypoint.world_from_object) * (foot + away);
    move_tip(model, f, &mut waypoint.joints, &target)
}

/// The arc on the ball of finger `f` that its link's turn sweeps, seen from the object and across the first contact's
/// normal.
fn arc_between(model: &CheckedHand, f: usize, from: &Waypoint, to: &Waypoint) -> Option<f64> {
    let normal = contact_of(&from.contacts[f])?.normal_in_object.into_inner();
    let [before, after] = [from, to].map(|waypoint| {
        let world_from_link =
            regrasp_plan::check::kinematics::pose_of(&model.fingers[f].path.world_from_link(&waypoint.joints));
        Pose::from(&waypoint.world_from_object).rotation.inverse() * world_from_link.rotation
    });
    let turn = (after * before.inverse()).scaled_axis();
    Some(model.fingers[f].radius * turn.cross(&normal).norm())
}

/// Some when the link of finger `f` turns so much over its contact that the tip must slide, if the contact stays.
fn pivots(model: &CheckedHand, segment: &Segment, f: usize, slip_tolerance: f64) -> Option<()> {
    let arc = arc_between(model, f, segment.waypoints.first()?, segment.waypoints.last()?)?;
    (arc > 2.0 * slip_tolerance).then_some(())
}
