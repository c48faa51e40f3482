//! Plans of whole robots as arrays, and as trajectories of controllers. `crate::mjcf` has their MuJoCo models.

mod contacts;

use crate::arrays::Numbers;
use crate::error::{ExportError, LATEST_TIME};
use crate::npz::{Npz, integers, names, npy, refuse_too_long, texts};
use crate::ros2::standing_still;
use crate::yaml::{list, quoted};
use regrasp_plan::robot_plan::{RobotPlan, RobotSegmentKind, RobotWaypoint};
use regrasp_robot::{Manipulator, Part};
use std::fmt::Write;

/// Nanoseconds in a second.
const NANOSECONDS: u64 = 1_000_000_000;

/// The bytes of an `.npz` file with the arrays of `plan`: n waypoints of all segments in order, j joints, o objects, k holders, s
/// segments, h hands, f fingers of all hands.
///
/// Errors: a name so long that an array of names would be huge.
pub fn robot_to_npz(plan: &RobotPlan) -> Result<Vec<u8>, ExportError> {
    let joint_names = plan.joint_names();
    let mut holders: Vec<String> = Vec::new();
    for holder in plan.segments.iter().flat_map(|segment| segment.held_by.values().flatten()) {
        if !holders.contains(holder) {
            holders.push(holder.clone());
        }
    }
    let robots: Vec<String> = plan.robots.iter().map(|robot| robot.name.clone()).collect();
    let contacts = contacts::ContactArrays::of(plan);
    for (what, texts) in [
        ("the joint names", joint_names.as_slice()),
        ("the names of hands", &contacts.hands),
        ("the names of fingers", &contacts.fingers),
        ("the names of robots", &robots),
        ("the names of objects", &plan.objects),
        ("the names of holders", &holders),
        ("the tool's name", std::slice::from_ref(&plan.tool)),
        ("the method's name", std::slice::from_ref(&plan.method)),
        ("the task's name", std::slice::from_ref(&plan.query)),
    ] {
        refuse_too_long(what, texts)?;
    }
    let floats = |shape: &[usize], values: &[f64]| {
        let values = Numbers::Floats(values);
        npy(values.numpy_type(), shape, values.to_bytes())
    };
    let waypoints: Vec<&RobotWaypoint> = plan.waypoints().collect();
    let (n, j, o, s) = (waypoints.len(), joint_names.len(), plan.objects.len(), plan.segments.len());
    let all = |of: fn(&RobotWaypoint) -> &[f64]| waypoints.iter().flat_map(|w| of(w).to_vec()).collect::<Vec<f64>>();
    let poses = || waypoints.iter().flat_map(|waypoint| &waypoint.world_from_objects);
    let positions: Vec<f64> = poses().flat_map(|pose| pose.position).collect();
    let rotations: Vec<f64> = poses().flat_map(|pose| pose.quat_xyzw).collect();
    let robot_of_joint: Vec<i64> =
        plan.robots.iter().enumerate().flat_map(|(k, robot)| vec![k as i64; robot.joint_names.len()]).collect();
    let mut starts = vec![0i64];
    let mut held_by = Vec::new();
    for segment in &plan.segments {
        starts.push(starts[starts.len() - 1] + segment.waypoints.len() as i64);
        for object in &plan.objects {
            let own = segment.held_by.get(object);
            held_by.extend(holders.iter().map(|holder| i64::from(own.is_some_and(|own| own.contains(holder)))));
        }
    }
    let segments = || plan.segments.iter().enumerate();
    let of_waypoint: Vec<i64> = segments().flat_map(|(k, segment)| vec![k as i64; segment.waypoints.len()]).collect();
    let kinds: Vec<&str> = plan.segments.iter().map(|segment| kind_name(segment.kind)).collect();
    let mut file = Npz::new();
    file.add("format", &texts(&[], &["regrasp-robot-arrays"]));
    file.add("format_version", &integers(&[], &[1]));
    file.add("tool", &texts(&[], &[&plan.tool]));
    file.add("method", &texts(&[], &[&plan.method]));
    file.add("seed", &npy("<u8", &[], plan.seed.to_le_bytes().into()));
    file.add("task", &texts(&[], &[&plan.task]));
    file.add("query", &texts(&[], &[&plan.query]));
    file.add("robots", &names(&robots));
    file.add("objects", &names(&plan.objects));
    file.add("holders", &names(&holders));
    file.add("joint_names", &names(&joint_names));
    file.add("robot_of_joint", &integers(&[j], &robot_of_joint));
    let held = plan.robots.iter().flat_map(|robot| &robot.held_joints);
    let (held_names, held): (Vec<String>, Vec<f64>) = held.map(|(name, at)| (name.clone(), *at)).unzip();
    file.add("held_joint_names", &names(&held_names));
    file.add("held_joints", &floats(&[held.len()], &held));
    file.add("times", &floats(&[n], &waypoints.iter().map(|waypoint| waypoint.time).collect::<Vec<f64>>()));
    file.add("joints", &floats(&[n, j], &all(|waypoint| &waypoint.joints)));
    file.add("joint_velocities", &floats(&[n, j], &all(|waypoint| &waypoint.joint_velocities)));
    file.add("object_positions", &floats(&[n, o, 3], &positions));
    file.add("object_quat_xyzw", &floats(&[n, o, 4], &rotations));
    file.add("segment_of_waypoint", &integers(&[n], &of_waypoint));
    file.add("segment_kinds", &texts(&[s], &kinds));
    file.add("segment_held_by", &integers(&[s, o, holders.len()], &held_by));
    file.add("segment_starts", &integers(&[s + 1], &starts));
    contacts.add_to(&mut file, n);
    Ok(file.finish())
}

/// As plan files spell it.
pub fn kind_name(kind: RobotSegmentKind) -> &'static str {
    match kind {
        RobotSegmentKind::Transit => "transit",
        RobotSegmentKind::Carry => "carry",
        RobotSegmentKind::Approach => "approach",
        RobotSegmentKind::Grasp => "grasp",
        RobotSegmentKind::Release => "release",
        RobotSegmentKind::Retreat => "retreat",
        RobotSegmentKind::Transfer => "transfer",
        RobotSegmentKind::Regrasp => "regrasp",
    }
}

/// A group of joints that one controller commands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ControllerGroup {
    /// `common`, or the kind and name of the part: `arm right`, `hand left`.
    pub name: String,
    /// Indices in the joint vector.
    pub joints: Vec<usize>,
}

/// The controller groups of a robot, in the order of its joint vector: the common part, every arm, every hand.
pub fn controller_groups(robot: &Manipulator) -> Vec<ControllerGroup> {
    let mut groups: Vec<(Part, ControllerGroup)> = Vec::new();
    for (k, coordinate) in robot.layout.coordinates.iter().enumerate() {
        match groups.iter_mut().find(|(part, _)| *part == coordinate.part) {
            Some((_, group)) => group.joints.push(k),
            None => {
                let name = match coordinate.part {
                    Part::Common => "common".to_owned(),
                    Part::Arm(arm) => format!("arm {}", robot.arms[arm].name),
                    Part::Hand(hand) => format!("hand {}", robot.hands[hand].name),
                };
                groups.push((coordinate.part, ControllerGroup { name, joints: vec![k] }));
            }
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// `plan` as YAML: a document of `trajectory_msgs/JointTrajectory` for each of `groups`. A group whose joints do not move is left out.
/// Without groups all joints are in one document.
///
/// Where one segment ends and the next begins at the same time, only the first waypoint of the next is written.
///
/// Errors: times that do not increase, or that no message holds.
pub fn robot_to_ros2(plan: &RobotPlan, groups: &[ControllerGroup]) -> Result<String, ExportError> {
    let names = plan.joint_names();
    let points = points(plan)?;
    let everything = ControllerGroup { name: "all".into(), joints: (0..names.len()).collect() };
    let groups = if groups.is_empty() { std::slice::from_ref(&everything) } else { groups };
    let held: String = plan.robots.iter().map(|robot| standing_still(&robot.held_joints)).collect();
    let mut out = String::new();
    for group in groups {
        let moves = |&&k: &&usize| points.windows(2).any(|pair| pair[0].0.joints[k] != pair[1].0.joints[k]);
        if !group.joints.iter().any(|k| moves(&k)) {
            continue;
        }
        let clean = |text: &str| text.replace(char::is_control, " ");
        let _ = writeln!(
            out,
            "---\n# trajectory_msgs/JointTrajectory of the group \"{}\", written by {}.",
            clean(&group.name),
            clean(&plan.tool)
        );
        out.push_str(&held);
        out.push_str("# Radians, metres, seconds.\nheader:\n  stamp: {sec: 0, nanosec: 0}\n  frame_id: \"\"\n");
        let of_group: Vec<String> = group.joints.iter().map(|&k| quoted(&names[k])).collect();
        let _ = writeln!(out, "joint_names: [{}]\npoints:", of_group.join(", "));
        for (waypoint, nanoseconds) in &points {
            let of_group = |values: &[f64]| list(&group.joints.iter().map(|&k| values[k]).collect::<Vec<f64>>());
            let _ = writeln!(out, "- positions: {}", of_group(&waypoint.joints));
            let _ = writeln!(out, "  velocities: {}", of_group(&waypoint.joint_velocities));
            out.push_str("  accelerations: []\n  effort: []\n");
            let (sec, nanosec) = (nanoseconds / NANOSECONDS, nanoseconds % NANOSECONDS);
            let _ = writeln!(out, "  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}");
        }
    }
    Ok(out)
}

/// Waypoints with their times in nanoseconds, which increase. Only where segments meet may two have the same.
fn points(plan: &RobotPlan) -> Result<Vec<(&RobotWaypoint, u64)>, ExportError> {
    let mut points: Vec<(&RobotWaypoint, u64)> = Vec::new();
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
