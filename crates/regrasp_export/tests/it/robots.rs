//! Exports of plans of whole robots.

use crate::moving_robot::{load, motion, pick_and_place, straight, two_arms, upright};
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
fn joints_that_stand_still_are_named() {
    let (_folder, upright) = upright();
    let plan = plan_of(&upright, "");
    let text = robot_to_ros2(&plan, &[]).unwrap();
    assert!(text.contains("# Joints that have to stand still meanwhile: \"neck\" at 0.3.\n"), "{text}");
    let archive = robot_to_npz(&plan).unwrap();
    let archive = String::from_utf8_lossy(&archive);
    assert!(archive.contains("held_joint_names.npy") && archive.contains("held_joints.npy"));
    let loaded = load(&two_arms());
    assert!(!robot_to_ros2(&plan_of(&loaded, "carry"), &[]).unwrap().contains("stand still"));
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

/// The value of an attribute in an element.
fn attribute<'x>(element: &'x str, name: &str) -> &'x str {
    let start = element.find(&format!(" {name}=\"")).unwrap_or_else(|| panic!("{name} in {element}")) + name.len() + 3;
    &element[start..start + element[start..].find('"').unwrap()]
}

#[test]
fn the_object_of_pick_and_place_is_free_and_only_fingertips_hold_it() {
    let (loaded, plan) = pick_and_place();
    let model = robot_to_mjcf((&loaded.scene, &loaded.state), &plan).unwrap();
    let elements: Vec<&str> = model.xml.split('<').collect();
    let named = |kind: &str, name: &str| {
        let found = elements.iter().find(|e| e.starts_with(kind) && e.contains(&format!(" name=\"{name}\"")));
        *found.unwrap_or_else(|| panic!("no {kind} {name}"))
    };
    named("freejoint", "object:box");
    assert!(!named("body ", "object:box").contains("gravcomp") && named("body ", "torso").contains("gravcomp"));
    // One pair for each finger of both hands, and no other: links meet the object by their classes.
    let pairs: Vec<&&str> = elements.iter().filter(|e| e.starts_with("pair geom1")).collect();
    assert_eq!(pairs.len(), 8);
    assert!(pairs.iter().all(|pair| attribute(pair, "geom2") == "object:box" && attribute(pair, "condim") == "4"));
    // Tips are as stiff as those of replays of one hand, arms as stiff as before.
    let stiffness = |name: &str| attribute(named("position ", name), "kp").parse::<f64>().unwrap();
    assert!((stiffness("right/east_abduction") - 5.0).abs() < 1.0, "{}", stiffness("right/east_abduction"));
    assert!(stiffness("right_shoulder") > 20.0 * stiffness("right/east_abduction"));
    assert_eq!(attribute(named("position ", "right/east_abduction"), "forcerange"), "-1 1");
    assert!(!named("position ", "right_shoulder").contains("forcerange"));
    for site in ["right:base", "left/south:tip"] {
        named("site ", site);
    }
    // Keyframes end with the object: three coordinates and a quaternion that begins with w.
    let key = named("key ", "0_0");
    let numbers: Vec<f64> = attribute(key, "qpos").split(' ').map(|x| x.parse().unwrap()).collect();
    assert_eq!(numbers.len(), plan.joint_names().len() + 7);
    let pose = &plan.segments[0].waypoints[0].world_from_objects[0];
    assert_eq!(numbers[numbers.len() - 7..numbers.len() - 4], pose.position);
    assert_eq!(numbers[numbers.len() - 4], pose.quat_xyzw[3]);
    let mut other = plan.clone();
    other.hands[0].name = "middle".into();
    assert!(robot_to_mjcf((&loaded.scene, &loaded.state), &other).unwrap_err().contains("no hand \"middle\""));
}

#[test]
fn archives_have_the_contacts_of_all_hands() {
    let (loaded, plan) = pick_and_place();
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(robot_to_npz(&plan).unwrap())).unwrap();
    let mut bytes = |name: &str| {
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut archive.by_name(&format!("{name}.npy")).unwrap(), &mut bytes).unwrap();
        let length = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        (String::from_utf8_lossy(&bytes[..length]).into_owned(), bytes.split_off(length))
    };
    let n = plan.waypoints().count();
    let (head, modes) = bytes("contact_modes");
    assert!(head.contains(&format!("({n},8,)")), "{head}");
    let (_, points) = bytes("contact_points_in_object");
    for (w, waypoint) in plan.waypoints().enumerate() {
        for f in 0..8 {
            let at = 8 * w + f;
            let first = f64::from_le_bytes(points[24 * at..24 * at + 8].try_into().unwrap());
            // The right hand comes first.
            let contact = waypoint.contacts.get(f).filter(|_| f < 4);
            assert_eq!(modes[at], u8::from(contact.is_some()));
            match contact {
                Some(contact) => assert_eq!(first, contact.point_in_object[0]),
                None => assert!(first.is_nan()),
            }
        }
    }
    let (head, _) = bytes("hand_of_finger");
    assert!(head.contains("(8,)"), "{head}");
    // Fingers move in controllers of their own, and the left arm has none.
    let groups = controller_groups(&loaded.scene.robots[0]);
    let text = robot_to_ros2(&plan, &groups).unwrap();
    let documents: Vec<&str> = text.split("---\n").skip(1).collect();
    assert_eq!(documents.len(), 3, "{text}");
    assert!(documents[2].contains("\"hand right\"") && documents[2].contains("right/east_distal_flexion"));
    // Where segments meet, one of the two waypoints is left.
    assert_eq!(documents[0].matches("time_from_start").count(), n - (plan.segments.len() - 1));
}
