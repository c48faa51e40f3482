//! Joints and objects that go elsewhere.

use super::Breeder;
use super::choice::{any_segment, any_waypoint, pick};
use super::edit::shift;
use regrasp_plan::check::pose::pose_difference;
use regrasp_plan::check::violation::ViolationKind::{
    self, ContactOffTip, GoalMismatch, JointJump, JointLimit, NotANumber, ObjectMovesInRegrasp, SegmentsDoNotMeet,
    StartMismatch,
};
use regrasp_plan::plan::SegmentKind;

impl Breeder<'_> {
    pub(super) fn break_joints(&mut self) {
        let limits = &self.model.limits;
        self.add("joint half a degree beyond its limit", &[JointLimit], |plan, rng| {
            let row = limits.get(rng.below(limits.len().max(1)))?;
            let beyond = rng.uniform(0.5f64, 1.0).to_radians();
            let position = if rng.chance(0.5) { row.lower - beyond } else { row.upper + beyond };
            row.put(&mut any_waypoint(plan, rng)?.joints, position);
            Some(())
        });
        let model = self.model;
        self.add("joint jumps", &[JointJump], |plan, rng| {
            let turning: Vec<usize> = (0..model.slides.len()).filter(|&k| !model.slides[k]).collect();
            let k = *turning.get(rng.below(turning.len().max(1)))?;
            // Both steps at the waypoint change by this much, so one of them is a jump.
            any_waypoint(plan, rng)?.joints[k] += rng.uniform(1.01, 1.2);
            Some(())
        });
        self.add("joint is not a number", &[NotANumber], |plan, rng| {
            *pick(&mut any_waypoint(plan, rng)?.joints, rng)? = f64::NAN;
            Some(())
        });
    }

    pub(super) fn break_object(&mut self) {
        const MOVED: [ViolationKind; 5] =
            [ContactOffTip, ObjectMovesInRegrasp, SegmentsDoNotMeet, StartMismatch, GoalMismatch];
        self.add("object shifted at a waypoint", &MOVED, |plan, rng| {
            let tolerance = plan.promises.contact_tolerance;
            let waypoint = any_waypoint(plan, rng)?;
            shift(&mut waypoint.world_from_object, rng, 2.5 * tolerance, 4.0 * tolerance);
            Some(())
        });
        self.add("quaternion components swapped", &MOVED, |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            let before = waypoint.world_from_object;
            waypoint.world_from_object.quat_xyzw.swap(0, 1 + rng.below(2));
            let (_, angle) = pose_difference(&before, &waypoint.world_from_object);
            (angle > 0.1).then_some(())
        });
        self.add("quaternion not of length one", &[NotANumber], |plan, rng| {
            let waypoint = any_waypoint(plan, rng)?;
            waypoint.world_from_object.quat_xyzw.iter_mut().for_each(|x| *x *= 1.0 + 1e-6);
            Some(())
        });
        self.add("object creeps in a regrasp", &[ObjectMovesInRegrasp], |plan, rng| {
            let segment = any_segment(plan, rng, SegmentKind::Regrasp)?;
            let n_waypoints = segment.waypoints.len();
            let waypoint = segment.waypoints.get_mut(1 + rng.below(n_waypoints - 1))?;
            shift(&mut waypoint.world_from_object, rng, 1e-6, 1e-5);
            Some(())
        });
    }
}
