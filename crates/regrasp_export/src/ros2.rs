//! ROS 2 `trajectory_msgs/JointTrajectory` as YAML, as `ros2 topic pub` reads it.
//!
//! Only independent joints are in it: coupled ones follow by the robot's mechanism, and a controller does not command them.
//! Accelerations are left empty, as the message allows: controllers then interpolate positions and velocities by cubics, which
//! are the motion that the plan means.

use crate::error::{ExportError, LATEST_TIME};
use crate::yaml::{list, quoted};
use regrasp_plan::{Plan, Waypoint};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Nanoseconds in a second.
const NANOSECONDS: u64 = 1_000_000_000;

/// `plan` as one YAML document.
///
/// Where one segment ends and the next begins at the same time, only the first waypoint of the next is written: controllers
/// demand times that increase. `effort` holds the joint torques of plans with forces, and is empty in others.
///
/// Errors: times that do not increase, or that no message holds.
pub fn to_ros2(plan: &Plan) -> Result<String, ExportError> {
    let mut out = format!(
        "# trajectory_msgs/JointTrajectory, written by {}. Radians, metres, seconds.\n",
        plan.tool.replace(char::is_control, " ")
    );
    out.push_str("header:\n  stamp: {sec: 0, nanosec: 0}\n  frame_id: \"\"\n");
    out.push_str(&standing_still(&plan.held_joints));
    let names: Vec<String> = plan.joint_names.iter().map(|name| quoted(name)).collect();
    let _ = writeln!(out, "joint_names: [{}]\npoints:", names.join(", "));
    for (waypoint, nanoseconds) in points(plan)? {
        let _ = writeln!(out, "- positions: {}", list(&waypoint.joints));
        let _ = writeln!(out, "  velocities: {}", list(&waypoint.joint_velocities));
        out.push_str("  accelerations: []\n");
        let _ = writeln!(out, "  effort: {}", list(&waypoint.joint_torques));
        let (sec, nanosec) = (nanoseconds / NANOSECONDS, nanoseconds % NANOSECONDS);
        let _ = writeln!(out, "  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}");
    }
    Ok(out)
}

/// A comment that says where the joints have to stand that a plan does not move: controllers refuse joints that are not theirs, so they are
/// in no message. Empty where there are none.
pub(crate) fn standing_still(positions: &BTreeMap<String, f64>) -> String {
    if positions.is_empty() {
        return String::new();
    }
    let each = positions.iter().map(|(name, position)| format!("{} at {position}", quoted(name)));
    format!("# Joints that have to stand still meanwhile: {}.\n", each.collect::<Vec<String>>().join(", "))
}

/// Waypoints with their times in nanoseconds, which increase. Only where segments meet may two have the same.
fn points(plan: &Plan) -> Result<Vec<(&Waypoint, u64)>, ExportError> {
    let mut points: Vec<(&Waypoint, u64)> = Vec::new();
    for (s, segment) in plan.segments.iter().enumerate() {
        for (w, waypoint) in segment.waypoints.iter().enumerate() {
            let time = waypoint.time;
            let wrong = |before| ExportError::WrongTime { segment: s, waypoint: w, time, before };
            if !(0.0..=LATEST_TIME).contains(&time) {
                return Err(wrong(None));
            }
            let nanoseconds = (time * NANOSECONDS as f64).round() as u64;
            match points.last() {
                Some((_, last)) if w == 0 && nanoseconds == *last => drop(points.pop()),
                Some((before, last)) if nanoseconds <= *last => return Err(wrong(Some(before.time))),
                _ => {}
            }
            points.push((waypoint, nanoseconds));
        }
    }
    Ok(points)
}
