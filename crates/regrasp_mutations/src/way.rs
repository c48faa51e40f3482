//! Way poses that are not passed, or not as the plan says.

use super::Breeder;
use super::choice::{pick, pick_waypoint, swap_two_that};
use super::edit::shift;
use regrasp_plan::check::pose::pose_difference;
use regrasp_plan::check::violation::ViolationKind::WayPoseMissed;
use regrasp_plan::plan::SegmentKind;

impl Breeder<'_> {
    pub(super) fn break_way(&mut self) {
        self.add("way pose skipped", &[WayPoseMissed], |plan, rng| {
            let chosen = rng.below(plan.way_poses.len().max(1));
            (chosen < plan.way_poses.len()).then(|| _ = plan.way_poses.remove(chosen))
        });
        self.add("way poses passed out of order", &[WayPoseMissed], |plan, rng| {
            // Poses and moments together: each is still passed where the plan says.
            swap_two_that(&mut plan.way_poses, rng, |a, b| (a.segment, a.waypoint) != (b.segment, b.waypoint))
        });
        self.add("way poses listed in another order", &[WayPoseMissed], |plan, rng| {
            let moments: Vec<_> = plan.way_poses.iter().map(|pose| (pose.segment, pose.waypoint)).collect();
            swap_two_that(&mut plan.way_poses, rng, |a, b| {
                let (distance, angle) = pose_difference(&a.world_from_object, &b.world_from_object);
                distance.max(angle) > 1e-4
            })?;
            for (pose, (segment, waypoint)) in plan.way_poses.iter_mut().zip(moments) {
                (pose.segment, pose.waypoint) = (segment, waypoint);
            }
            Some(())
        });
        self.add("way pose elsewhere", &[WayPoseMissed], |plan, rng| {
            shift(&mut pick(&mut plan.way_poses, rng)?.world_from_object, rng, 1e-5, 1e-4);
            Some(())
        });
        self.add("way pose passed at another moment", &[WayPoseMissed], |plan, rng| {
            let (s, w) = pick_waypoint(plan, rng, SegmentKind::Transfer)?;
            let there = plan.segments[s].waypoints[w].world_from_object;
            let way_pose = pick(&mut plan.way_poses, rng)?;
            let (distance, angle) = pose_difference(&there, &way_pose.world_from_object);
            (way_pose.segment, way_pose.waypoint) = (s, w);
            (distance.max(angle) > 1e-4).then_some(())
        });
        self.add("way pose passed at no moment", &[WayPoseMissed], |plan, rng| {
            let n_segments = plan.segments.len();
            pick(&mut plan.way_poses, rng)?.segment = n_segments;
            Some(())
        });
        self.add("object cuts a way pose short", &[WayPoseMissed], |plan, rng| {
            // The waypoint itself is left out; the moments named after it move up.
            let n_poses = plan.way_poses.len();
            let chosen = *plan.way_poses.get(rng.below(n_poses.max(1)))?;
            let waypoints = &mut plan.segments.get_mut(chosen.segment)?.waypoints;
            if waypoints.len() < 3 {
                return None;
            }
            let there = chosen.waypoint.min(waypoints.len() - 2);
            let next = waypoints.get(if there == chosen.waypoint { there + 1 } else { there })?;
            let (distance, angle) = pose_difference(&next.world_from_object, &chosen.world_from_object);
            waypoints.remove(chosen.waypoint);
            plan.way_poses
                .iter_mut()
                .filter(|p| p.segment == chosen.segment && p.waypoint > there)
                .for_each(|p| p.waypoint -= 1);
            (distance.max(angle) > 1e-4).then_some(())
        });
    }
}
