//! ROS 2 `trajectory_msgs/JointTrajectory` as YAML, as `ros2 topic pub` reads it.
//!
//! Only independent joints are in it: coupled ones follow by the robot's mechanism, and a controller does not command them.
//! Accelerations are left empty, as the message allows: controllers then interpolate positions and velocities by cubics, which
//! are the motion that the plan means.

use crate::error::{ExportError, LATEST_TIME};
use regrasp_plan::{Plan, Waypoint};
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

fn list(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|&value| number(value)).collect();
    format!("[{}]", values.join(", "))
}

/// The shortest decimal that reads back to the same double, in a form that YAML 1.1 takes for a number: with a point, and a
/// sign in the exponent.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-4..1e15).contains(&value.abs()) {
        return format!("{value:?}");
    }
    let text = format!("{value:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// A double-quoted YAML scalar: escapes are those of JSON.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if (c as u32) < 0x20
                || ('\u{7f}'..='\u{a0}').contains(&c)
                || matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}') =>
            {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_numbers_in_yaml_too() {
        let shown = [0.0, -0.0, 1.0, 0.25, -1.5e-7, 1e-5, 1e16, 123456.789].map(number);
        assert_eq!(shown, ["0.0", "-0.0", "1.0", "0.25", "-1.5e-7", "1.0e-5", "1.0e+16", "123456.789"]);
    }

    #[test]
    fn names_cannot_break_out_of_their_quotes() {
        assert_eq!(quoted("a\"\\\n\u{85}b"), r#""a\"\\\u000a\u0085b""#);
    }
}
