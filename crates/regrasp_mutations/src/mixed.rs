//! Tracking with relocations between, gone wrong where one gives way to the other.

use super::Breeder;
use super::choice::pick;
use super::tracking::turn;
use regrasp_base::Rng;
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::roles::moving_finger;
use regrasp_plan::check::violation::ViolationKind::{
    ContactOffTip, ObjectMovesInRegrasp, RelativeMotionMissing, SegmentsDoNotMeet, WrongContactMode,
};
use regrasp_plan::plan::{ContactMode, ContactState, Plan, SegmentKind};

impl Breeder<'_> {
    pub(super) fn break_mixed(&mut self) {
        if self.plan.promises.tracking.is_none() {
            return;
        }
        let model = self.model;
        self.add("relocation passed off as tracking", &[WrongContactMode], |plan, rng| {
            let (s, _) = pick_relocation(plan, model, rng)?;
            plan.segments[s].kind = SegmentKind::Tracking;
            Some(())
        });
        self.add("relocation left out between tracking", &[SegmentsDoNotMeet], |plan, rng| {
            let (s, _) = pick_relocation(plan, model, rng)?;
            let is_inner = s > 0 && s + 1 < plan.segments.len();
            plan.segments.remove(s);
            is_inner.then_some(())
        });
        self.add("relocated finger tracks on from where it was", &[SegmentsDoNotMeet, ContactOffTip], |plan, rng| {
            let (s, f) = pick_relocation(plan, model, rng)?;
            let left = plan.segments[s].waypoints.first()?.contacts[f];
            let next = plan.segments[s..].iter_mut().find(|next| next.kind == SegmentKind::Tracking)?;
            for waypoint in &mut next.waypoints {
                let contact = &mut waypoint.contacts[f];
                contact.point_in_object = left.point_in_object;
                contact.normal_in_object = left.normal_in_object;
            }
            Some(())
        });
        self.add("finger slides while another one is in the air", &[WrongContactMode], |plan, rng| {
            let contact = resting_in_relocation(plan, model, rng)?;
            contact.mode = ContactMode::Sliding;
            Some(())
        });
        self.add("finger is tracked while another one is in the air", &[RelativeMotionMissing], |plan, rng| {
            let contact = resting_in_relocation(plan, model, rng)?;
            contact.relative_velocity_in_object = Some([0.0; 3]);
            contact.relative_turn_in_object = Some([0.0; 3]);
            Some(())
        });
        self.add("finger in the air is said to slide", &[WrongContactMode], |plan, rng| {
            let (s, f) = pick_relocation(plan, model, rng)?;
            let mut contact = plan.segments[s].waypoints.first()?.contacts[f];
            contact.mode = ContactMode::Sliding;
            let n_waypoints = plan.segments[s].waypoints.len();
            plan.segments[s].waypoints[n_waypoints / 2].contacts[f] = contact;
            (n_waypoints > 2).then_some(())
        });
        self.add("object tracks on while a finger is in the air", &[ObjectMovesInRegrasp], |plan, rng| {
            let (s, _) = pick_relocation(plan, model, rng)?;
            let n_waypoints = plan.segments[s].waypoints.len();
            let pose = &mut plan.segments[s].waypoints[n_waypoints / 2].world_from_object;
            turn(pose, rng.uniform(1e-7, 1e-5), rng);
            Some(())
        });
    }
}

/// A relocation in which a finger leaves a contact for another one, and the finger.
fn pick_relocation(plan: &Plan, model: &CheckedHand, rng: &mut Rng) -> Option<(usize, usize)> {
    let mut found = Vec::new();
    for (s, segment) in plan.segments.iter().enumerate().filter(|(_, one)| one.kind == SegmentKind::Regrasp) {
        let Some(f) = moving_finger(model, segment) else { continue };
        let [first, last] =
            [segment.waypoints.first()?, segment.waypoints.last()?].map(|waypoint| waypoint.contacts[f]);
        let (Some(from), Some(to)) = (first.point_in_object, last.point_in_object) else { continue };
        let way = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        if way > 2.1 * plan.promises.contact_tolerance {
            found.push((s, f));
        }
    }
    pick(&mut found, rng).copied()
}

/// A contact of a finger that rests half-way through a relocation.
fn resting_in_relocation<'p>(plan: &'p mut Plan, model: &CheckedHand, rng: &mut Rng) -> Option<&'p mut ContactState> {
    let (s, f) = pick_relocation(plan, model, rng)?;
    let n_waypoints = plan.segments[s].waypoints.len();
    let resting = (f + 1 + rng.below(model.fingers.len() - 1)) % model.fingers.len();
    let contact = &mut plan.segments[s].waypoints[n_waypoints / 2].contacts[resting];
    contact.holds().then_some(contact)
}
