//! `moveit_msgs/Grasp` messages as YAML: a sequence of one message for each grasp.
//!
//! `grasp_pose` is the pose of the hand's base link in the object's frame, whose name stands in `frame_id`. The retreat after
//! the grasp goes back along the approach.

use crate::yaml::{list, number, quoted};
use regrasp_plan::grasps::{GraspList, ListedGrasp};
use std::fmt::Write;

/// Shortest way that a planner may leave of an approach, as a share of it.
const LEAST_SHARE: f64 = 0.5;

/// `list` as one YAML document.
pub fn to_moveit(list: &GraspList) -> String {
    let mut out =
        format!("# moveit_msgs/Grasp, written by {}. Metres, radians.\n", list.tool.replace(char::is_control, " "));
    if list.grasps.is_empty() {
        out.push_str("[]\n");
    }
    for (index, grasp) in list.grasps.iter().enumerate() {
        add(list, index, grasp, &mut out);
    }
    out
}

fn add(of: &GraspList, index: usize, grasp: &ListedGrasp, out: &mut String) {
    let frame = quoted(&of.object.name);
    let header = format!("{{stamp: {{sec: 0, nanosec: 0}}, frame_id: {frame}}}");
    let vector = |v: [f64; 3]| format!("{{x: {}, y: {}, z: {}}}", number(v[0]), number(v[1]), number(v[2]));
    let names: Vec<String> = of.hand.joint_names.iter().map(|name| quoted(name)).collect();
    let _ = writeln!(out, "- id: grasp_{index}");
    for (key, joints, torques) in
        [("pre_grasp_posture", &grasp.open_joints, &[][..]), ("grasp_posture", &grasp.joints, &grasp.joint_torques)]
    {
        let _ = writeln!(out, "  {key}:\n    header: {header}\n    joint_names: [{}]\n    points:", names.join(", "));
        let _ = writeln!(out, "    - positions: {}\n      velocities: []\n      accelerations: []", list(joints));
        let _ = writeln!(out, "      effort: {}\n      time_from_start: {{sec: 0, nanosec: 0}}", list(torques));
    }
    let [x, y, z, w] = grasp.object_from_hand.quat_xyzw;
    let _ = writeln!(out, "  grasp_pose:\n    header: {header}\n    pose:");
    let _ = writeln!(out, "      position: {}", vector(grasp.object_from_hand.position));
    let _ =
        writeln!(out, "      orientation: {{x: {}, y: {}, z: {}, w: {}}}", number(x), number(y), number(z), number(w));
    let _ = writeln!(out, "  grasp_quality: {}", number(grasp.score));
    let direction = grasp.approach.direction_in_object;
    for (key, direction) in [
        ("pre_grasp_approach", direction),
        ("post_grasp_retreat", direction.map(|x| -x)),
        ("post_place_retreat", direction.map(|x| -x)),
    ] {
        let _ = writeln!(out, "  {key}:\n    direction:\n      header: {header}\n      vector: {}", vector(direction));
        let distance = grasp.approach.distance;
        let (desired, least) = (number(distance), number(distance * LEAST_SHARE));
        let _ = writeln!(out, "    desired_distance: {desired}\n    min_distance: {least}");
    }
    let largest = of.promises.normal_force[1];
    let _ = writeln!(out, "  max_contact_force: {}\n  allowed_touch_objects: [{frame}]", number(largest));
}
