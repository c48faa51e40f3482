//! Segments and waypoints out of order.

use super::Breeder;
use super::choice::pick;
use super::edit::{goes_somewhere, travel};
use regrasp_plan::check::pose::pose_difference;
use regrasp_plan::check::violation::ViolationKind::{EmptySegment, GoalMismatch, SegmentsDoNotMeet, StartMismatch};
use regrasp_plan::plan::SegmentKind;

impl Breeder<'_> {
    pub(super) fn break_order(&mut self) {
        self.add("no segments", &[EmptySegment], |plan, _| {
            plan.segments.clear();
            Some(())
        });
        self.add("segment of one waypoint", &[EmptySegment], |plan, rng| {
            pick(&mut plan.segments, rng)?.waypoints.truncate(1);
            Some(())
        });
        self.add("segment left out", &[SegmentsDoNotMeet], |plan, rng| {
            // A transfer that only takes out rounding is not missed.
            let n_segments = plan.segments.len();
            let inner = 1..n_segments.saturating_sub(1);
            let missed: Vec<usize> = inner.filter(|&s| goes_somewhere(&plan.segments[s])).collect();
            (!missed.is_empty()).then(|| drop(plan.segments.remove(missed[rng.below(missed.len())])))
        });
        self.add("segment reversed in time", &[SegmentsDoNotMeet, StartMismatch, GoalMismatch], |plan, rng| {
            let mut moving: Vec<_> = plan.segments.iter_mut().filter(|segment| goes_somewhere(segment)).collect();
            pick(&mut moving, rng)?.waypoints.reverse();
            Some(())
        });
        self.add("plan reversed in time", &[StartMismatch, GoalMismatch], |plan, _| {
            plan.segments.reverse();
            plan.segments.iter_mut().for_each(|segment| segment.waypoints.reverse());
            let (distance, angle) = pose_difference(&plan.start, &plan.goal);
            (distance.max(angle) > 1e-4 && plan.promises.tracking.is_none()).then_some(())
        });
        self.add("beginning cut off", &[StartMismatch], |plan, _| {
            let moved = plan.segments.iter().position(|s| s.kind == SegmentKind::Transfer && travel(s) > 1e-4)?;
            plan.segments.drain(..=moved);
            (!plan.segments.is_empty()).then_some(())
        });
        self.add("end cut off", &[GoalMismatch], |plan, _| {
            let moved = plan.segments.iter().rposition(|s| s.kind == SegmentKind::Transfer && travel(s) > 1e-4)?;
            plan.segments.truncate(moved);
            (moved > 0).then_some(())
        });
    }
}
