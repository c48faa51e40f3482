//! Exports of plans of whole robots.

use crate::moving_robot::{load, motion, straight, two_arms, upright};
use regrasp_export::{controller_groups, robot_to_mjcf, robot_to_npz, robot_to_ros2};
use regrasp_plan::RobotPlan;
use regrasp_scene::{LoadedScene, MotionGoal};

fn plan_of(loaded: &LoadedScene, name: &str) -> RobotPlan {
    let query = motion(loaded, name);
    let MotionGoal::Joints(goal) = &query.goal else { panic!("a goal of joints") };
    straight(&loaded.scene, &query, &[query.start.clone(), goal.clone()], 4, 0.4)
}

#[test]
fn every_part_that_moves_has_a_trajectory_of_its_own() {
    let loaded = load(&two_arms());
    let robot = &loaded.scene.robots[0];
    let groups = controller_groups(robot);
    let names: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["common", "arm right", "hand right", "arm left", "hand left"]);
    let joints: Vec<usize> = groups.iter().flat_map(|group| group.joints.clone()).collect();
    assert_eq!(joints, (0..robot.layout.len()).collect::<Vec<usize>>());
    let plan = plan_of(&loaded, "carry");
    let text = robot_to_ros2(&plan, &groups).unwrap();
    // Only the torso and the right arm move.
    let documents: Vec<&str> = text.split("---\n").skip(1).collect();
    assert_eq!(documents.len(), 2, "{text}");
    assert!(documents[0].contains("\"common\"") && documents[0].contains("joint_names: [\"torso_yaw\"]"), "{text}");
    assert!(documents[1].contains("right_shoulder") && !documents[1].contains("left_"), "{text}");
    let n = plan.waypoints().count();
    assert!(documents.iter().all(|document| document.matches("time_from_start").count() == n));
    assert_eq!(robot_to_ros2(&plan, &[]).unwrap().matches("joint_names").count(), 1);
}

#[test]
fn archives_are_the_same_bytes_and_have_all_arrays() {
    let loaded = load(&two_arms());
    let plan = plan_of(&loaded, "carry");
    let bytes = robot_to_npz(&plan).unwrap();
    assert_eq!(bytes, robot_to_npz(&plan).unwrap());
    let text = String::from_utf8_lossy(&bytes);
    for name in ["joints", "joint_velocities", "object_quat_xyzw", "segment_held_by", "holders", "robot_of_joint"] {
        assert!(text.contains(&format!("{name}.npy")), "{name}");
    }
}

#[test]
fn models_have_every_joint_a_servo_and_the_object_on_its_hand() {
    let loaded = load(&two_arms());
    let plan = plan_of(&loaded, "carry");
    let model = robot_to_mjcf((&loaded.scene, &loaded.state), &plan).unwrap();
    let robot = &loaded.scene.robots[0];
    assert_eq!(model.xml.matches("<position ").count(), robot.layout.len());
    assert_eq!(model.xml.matches("<key ").count(), plan.waypoints().count());
    let hand = model.xml.find("<body name=\"right/palm\"").expect("the hand's base is a body");
    let ball = model.xml.find("<body name=\"object:ball\"").expect("the ball is a body");
    let left = model.xml.find("<body name=\"left_upper_arm\"").expect("the left arm is a body");
    assert!(hand < ball && ball < left);
    assert!(model.xml.contains("fixed:lamp") && !model.xml.contains("fixed:ball"));
    let (_folder, upright) = upright();
    let plan = plan_of(&upright, "");
    let xml = robot_to_mjcf((&upright.scene, &upright.state), &plan).unwrap().xml;
    assert!(xml.contains("torso_3:leaders") && xml.matches("<position ").count() == 2, "{xml}");
    let mut other = plan.clone();
    other.robots[0].joint_names.reverse();
    assert!(robot_to_mjcf((&upright.scene, &upright.state), &other).unwrap_err().contains("another robot"));
}
