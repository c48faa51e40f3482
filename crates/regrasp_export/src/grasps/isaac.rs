//! Isaac grasp files (`format: isaac_grasp`, version 1.0), as Isaac Sim reads them: YAML.
//!
//! Pose of the gripper's frame in the object's frame, a confidence from 0 to 1, and joint positions by name. Confidence is the score.

use crate::yaml::{list, number, quoted};
use regrasp_plan::grasps::{GraspList, ListedGrasp};
use std::fmt::Write;

/// `list` as one YAML document.
pub fn to_isaac(list: &GraspList) -> String {
    let mut out = format!("# Written by {}. Metres, radians.\n", list.tool.replace(char::is_control, " "));
    out.push_str("format: isaac_grasp\nformat_version: 1.0\n");
    let _ = writeln!(out, "object_frame_link: {}", quoted(&list.object.name));
    let _ = writeln!(out, "gripper_frame_link: {}", quoted(&list.hand.base_link));
    out.push_str(if list.grasps.is_empty() { "grasps: {}\n" } else { "grasps:\n" });
    for (index, grasp) in list.grasps.iter().enumerate() {
        add(list, index, grasp, &mut out);
    }
    out
}

fn add(of: &GraspList, index: usize, grasp: &ListedGrasp, out: &mut String) {
    let [x, y, z, w] = grasp.object_from_hand.quat_xyzw;
    let _ = writeln!(out, "  grasp_{index}:");
    let _ = writeln!(out, "    confidence: {}", number(grasp.score));
    let _ = writeln!(out, "    position: {}", list(&grasp.object_from_hand.position));
    let _ = writeln!(out, "    orientation: {{w: {}, xyz: {}}}", number(w), list(&[x, y, z]));
    for (key, joints) in [("cspace_position", &grasp.joints), ("pregrasp_cspace_position", &grasp.open_joints)] {
        let _ = writeln!(out, "    {key}:");
        for (name, position) in of.hand.joint_names.iter().zip(joints) {
            let _ = writeln!(out, "      {}: {}", quoted(name), number(*position));
        }
    }
}
