//! Fingertips that lift and land wrongly.

use super::Breeder;
use super::choice::{any_segment, pick_waypoint};
use super::edit::move_tip;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::roles::{contact_of, moving_finger};
use regrasp_plan::check::violation::ViolationKind::{Collision, LandingOrLiftingNotFree};
use regrasp_plan::plan::{ContactState, Plan, SegmentKind, Waypoint};

impl Breeder<'_> {
    pub(super) fn break_relocations(&mut self) {
        let (model, task) = (self.model, self.task);
        self.add("relocation without lift", &[LandingOrLiftingNotFree, Collision], |plan, rng| {
            // The tip goes straight through the object or along its surface, in small steps.
            let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
            let (first, last) = (segment.waypoints.first()?.clone(), segment.waypoints.last()?.clone());
            let f = moving_finger(model, segment)?;
            let (from, to) = (contact_of(&first.contacts[f])?, contact_of(&last.contacts[f])?);
            let object = Pose::from(&first.world_from_object);
            let center = |c: &regrasp_grasp::Contact, waypoint: &Waypoint| {
                let away = model.fingers[f].center_from_contact(waypoint, &c.normal_in_object);
                object * (c.point_in_object + away)
            };
            let (a, b) = (center(&from, &first), center(&to, &last));
            if (a - b).norm() < 2e-3 {
                return None;
            }
            let n_steps = ((b - a).norm() / 1e-3).ceil() as usize;
            let mut waypoints = vec![first.clone()];
            for k in 1..n_steps {
                let mut waypoint = waypoints.last()?.clone();
                waypoint.contacts[f] = ContactState::FREE;
                move_tip(model, f, &mut waypoint.joints, &(a + (b - a) * (k as f64 / n_steps as f64)))?;
                waypoints.push(waypoint);
            }
            waypoints.push(last);
            segment.waypoints = waypoints;
            Some(())
        });
        self.add("tip dips into the object before it lifts", &[LandingOrLiftingNotFree, Collision], |plan, rng| {
            let depth = rng.uniform(1e-3, 2e-3);
            push_free_tip(plan, model, rng, |end| end.point - end.normal * depth)
        });
        self.add("tip drags along the surface before it lifts", &[LandingOrLiftingNotFree, Collision], |plan, rng| {
            let way = rng.uniform(0.5e-3, 1e-3);
            push_free_tip(plan, model, rng, |end| end.point + end.side * way)
        });
        self.add("free finger reaches into another one", &[Collision], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Regrasp)?;
            let f = moving_finger(model, &plan.segments[s])?;
            let waypoint = &mut plan.segments[s].waypoints[w];
            let other = (f + 1 + rng.below(model.fingers.len() - 1)) % model.fingers.len();
            let hand_may_touch = task.hand().may_touch(model.fingers[f].tip_link, model.fingers[other].tip_link);
            let target = model.fingers[other].center_in_world(&waypoint.joints);
            let here = model.fingers[f].center_in_world(&waypoint.joints);
            let reach = (model.fingers[f].radius + model.fingers[other].radius - 1e-3).max(1e-3);
            if hand_may_touch || waypoint.contacts[f].holds() {
                return None;
            }
            move_tip(model, f, &mut waypoint.joints, &(target + (here - target).normalize() * reach))
        });
    }
}

/// An end of a relocation, in the world.
struct End {
    /// Where the tip's centre touches.
    point: Point,
    /// Outward normal.
    normal: Vector,
    /// A tangent.
    side: Vector,
}

/// Puts an extra waypoint after the beginning or before the end of a relocation, with the tip at `target`.
fn push_free_tip(plan: &mut Plan, model: &CheckedHand, rng: &mut Rng, target: impl Fn(&End) -> Point) -> Option<()> {
    let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
    let f = moving_finger(model, segment)?;
    let at_end = rng.chance(0.5);
    let end = if at_end { segment.waypoints.last()? } else { segment.waypoints.first()? };
    let contact = contact_of(&end.contacts[f])?;
    let object = Pose::from(&end.world_from_object);
    let (side, _) = regrasp_geometry::frame::tangents(&contact.normal_in_object);
    let ours = End {
        point: model.fingers[f].center_in_world(&end.joints),
        normal: object * contact.normal_in_object.into_inner(),
        side: object * side.into_inner(),
    };
    let mut waypoint = end.clone();
    waypoint.contacts[f] = ContactState::FREE;
    move_tip(model, f, &mut waypoint.joints, &target(&ours))?;
    let place = if at_end { segment.waypoints.len() - 1 } else { 1 };
    segment.waypoints.insert(place, waypoint);
    Some(())
}
