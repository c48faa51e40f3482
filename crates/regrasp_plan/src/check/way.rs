//! Poses to be passed between start and goal: those of the query, in its order, each at the waypoint that the plan names.

use crate::check::pose::pose_difference;
use crate::check::violation::{Moment, Violation, ViolationKind::WayPoseMissed};
use crate::check::{CheckSettings, Log};
use crate::plan::{Plan, PoseData, WayPose};
use regrasp_scene::Query;

/// Judges the way poses of `plan`: against the motion, against each other, and with a `query` against what was asked.
pub fn check_way(query: Option<&Query>, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    let mut last = (0, 0);
    for (i, way_pose) in plan.way_poses.iter().enumerate() {
        check_passed(i, way_pose, plan, settings, log);
        let here = (way_pose.segment, way_pose.waypoint);
        if here < last {
            let message = format!("way pose {i} is passed before the one that it follows");
            log.push(Violation::new(WayPoseMissed, message).when(Moment::at(here.0, here.1)));
        }
        last = here;
    }
    let Some(query) = query else { return };
    let asked = query.way();
    if asked.len() != plan.way_poses.len() {
        let message = format!("{} way poses were asked for, the plan has {}", asked.len(), plan.way_poses.len());
        log.push(Violation::new(WayPoseMissed, message));
    }
    for (i, (asked, way_pose)) in asked.iter().zip(&plan.way_poses).enumerate() {
        let miss = pose_difference(&PoseData::from(asked), &way_pose.world_from_object);
        report(miss, &format!("way pose {i} of the plan"), "the scene's", None, settings, log);
    }
}

/// The object is at the way pose where the plan says that it is.
fn check_passed(i: usize, way_pose: &WayPose, plan: &Plan, settings: &CheckSettings, log: &mut Log) {
    let (s, w) = (way_pose.segment, way_pose.waypoint);
    let Some(waypoint) = plan.segments.get(s).and_then(|segment| segment.waypoints.get(w)) else {
        let message =
            format!("way pose {i} is to be passed at segment {s}, waypoint {w}, which the plan does not have");
        log.push(Violation::new(WayPoseMissed, message));
        return;
    };
    let miss = pose_difference(&way_pose.world_from_object, &waypoint.world_from_object);
    report(miss, "the object", &format!("way pose {i}"), Some(Moment::at(s, w)), settings, log);
}

fn report(
    (distance, angle): (f64, f64),
    what: &str,
    from: &str,
    at: Option<Moment>,
    settings: &CheckSettings,
    log: &mut Log,
) {
    if distance <= settings.pose_tolerance && angle <= settings.pose_tolerance {
        return;
    }
    let message = format!("{what} is {distance:.3e} m and {angle:.3e} rad from {from}");
    let mut violation = Violation::new(WayPoseMissed, message).subjects(["object"]);
    violation.at = at;
    log.push(violation.amount(distance.max(angle), settings.pose_tolerance));
}
