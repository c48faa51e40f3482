//! Fingers that are free, and fingers that are said to be.

use super::Breeder;
use super::choice::{pick, pick_waypoint, places, waypoints_mut};
use super::edit::move_tip;
use regrasp_base::Rng;
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_grasp::Grip;
use regrasp_plan::check::closure::{HeldBody, margin};
use regrasp_plan::check::model::CheckedHand;
use regrasp_plan::check::roles::{contact_of, is_free_throughout};
use regrasp_plan::check::surface;
use regrasp_plan::check::violation::ViolationKind::{
    ClosureLost, Collision, ContactOffTip, WrongContactMode, WrongMovingFinger,
};
use regrasp_plan::plan::{ContactMode, ContactState, Plan, Segment, SegmentKind, Waypoint};
use regrasp_scene::Manipulation;

impl Breeder<'_> {
    pub(super) fn break_free_fingers(&mut self) {
        let (model, task) = (self.model, self.task);
        let body = HeldBody::of(task.object(), self.plan);
        let required = self.plan.promises.required_margin;
        let holds_without = |waypoint: &Waypoint, left_out: usize| {
            let grips: Vec<Grip> = (0..model.fingers.len())
                .filter(|&f| f != left_out)
                .filter_map(|f| {
                    Some(Grip { contact: contact_of(&waypoint.contacts[f])?, model: model.fingers[f].contact })
                })
                .collect();
            margin(&grips, &body) >= required
        };
        // All through the plan, so that it is the same finger at every meeting of segments.
        self.add("finger declared free whom the others need", &[ClosureLost], |plan, rng| {
            let needed = |f: &usize| plan.segments.iter().any(|segment| !holds_without(&segment.waypoints[0], *f));
            let mut fingers: Vec<usize> = (0..model.fingers.len()).filter(needed).collect();
            let f = *pick(&mut fingers, rng)?;
            declare_free(plan, f)
        });
        self.add("finger declared free that touches the object", &[Collision], |plan, rng| {
            let touches = |segment: &Segment, f: usize| {
                let first = &segment.waypoints[0];
                segment.kind == SegmentKind::Transfer && first.contacts[f].holds() && holds_without(first, f)
            };
            let (_, f) = *pick(&mut places(plan, model, touches), rng)?;
            declare_free(plan, f)
        });
        self.add("free finger touches the object", &[Collision], |plan, rng| {
            let (s, f) = pick_free(plan, model, rng)?;
            let n_waypoints = plan.segments[s].waypoints.len();
            let w = rng.below(n_waypoints);
            let depth = rng.uniform(0.0, 0.2e-3);
            let waypoint = &mut plan.segments[s].waypoints[w];
            let (foot, normal) = beneath(model, &task, waypoint, f)?;
            let center = foot + normal * (model.fingers[f].radius - depth);
            let target = Pose::from(&waypoint.world_from_object) * center;
            move_tip(model, f, &mut waypoint.joints, &target)
        });
        self.add("finger declared holding that is away", &[ContactOffTip], |plan, rng| {
            let (s, f) = pick_free(plan, model, rng)?;
            let (foot, normal) = beneath(model, &task, &plan.segments[s].waypoints[0], f)?;
            let contact = ContactState::at(ContactMode::Fixed, foot.into(), normal.into());
            plan.segments[s].waypoints.iter_mut().for_each(|waypoint| waypoint.contacts[f] = contact);
            Some(())
        });
        self.add("free finger holds for a moment", &[WrongContactMode], |plan, rng| {
            let (s, f) = pick_free(plan, model, rng)?;
            let w = 1 + rng.below(plan.segments[s].waypoints.len() - 1);
            let (foot, normal) = beneath(model, &task, &plan.segments[s].waypoints[w], f)?;
            plan.segments[s].waypoints[w].contacts[f] =
                ContactState::at(ContactMode::Fixed, foot.into(), normal.into());
            Some(())
        });
        self.add("free finger moves while another one relocates", &[WrongMovingFinger], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Regrasp)?;
            let segment = &mut plan.segments[s];
            let moving = segment.moving_finger.clone();
            let is_resting =
                |f: &usize| is_free_throughout(segment, *f) && Some(&model.fingers[*f].name) != moving.as_ref();
            let mut resting: Vec<usize> = (0..model.fingers.len()).filter(is_resting).collect();
            let f = *pick(&mut resting, rng)?;
            segment.waypoints[w].joints[model.fingers[f].coordinates.start] += rng.uniform(1e-5, 1e-3);
            Some(())
        });
    }
}

/// Says at every waypoint that finger `f` is free.
fn declare_free(plan: &mut Plan, f: usize) -> Option<()> {
    waypoints_mut(plan).for_each(|waypoint| waypoint.contacts[f] = ContactState::FREE);
    Some(())
}

/// A transfer, and a finger that is free in it.
fn pick_free(plan: &Plan, model: &CheckedHand, rng: &mut Rng) -> Option<(usize, usize)> {
    let is_free = |segment: &Segment, f| segment.kind == SegmentKind::Transfer && is_free_throughout(segment, f);
    pick(&mut places(plan, model, is_free), rng).copied()
}

/// The point of the object's surface nearest to the tip of finger `f` and the outward normal there, in the object frame.
fn beneath(model: &CheckedHand, task: &Manipulation, waypoint: &Waypoint, f: usize) -> Option<(Point, Vector)> {
    let object = task.object();
    let pose = Pose::from(&waypoint.world_from_object);
    let tip = pose.inverse() * model.fingers[f].center_in_world(&waypoint.joints);
    let foot = object.surface.project(&tip);
    let nearest = surface::nearest(&object.shape, &foot.point_in_object);
    (nearest.distance < 1e-6).then(|| (foot.point_in_object, foot.normal_in_object.into_inner()))
}
