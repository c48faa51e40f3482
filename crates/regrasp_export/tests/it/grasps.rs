//! Grasp lists in other formats: what is written reads back as the numbers of the list.

use regrasp_export::grasps::{to_isaac, to_moveit, to_npz};
use regrasp_plan::grasps::GraspList;
use regrasp_plan::grasps::format::from_json;
use std::path::Path;

fn sample() -> GraspList {
    let grasp = r#"{"object_from_hand":{"position":[1e-7,0.1,-0.2],"quat_xyzw":[0.0,0.0,0.6,0.8]},"joints":[0.1,0.30000000000000004],
        "open_joints":[0.0,-1e-9],"approach":{"direction_in_object":[0.0,0.0,-1.0],"distance":0.1},"contacts":[{"finger":"a b",
        "link":"tip","point_in_object":[0.0,0.0,0.01],"normal_in_object":[0.0,0.0,1.0],"force_in_object":[0.0,0.0,-1.0]}],
        "joint_torques":[0.0,0.5],"margin":0.1,"score":0.75,"scores":{"closure":0.5,"centroid":1.0,"force_axis":1.0,
        "flatness":0.5},"stable_poses":[]}"#;
    let text = format!(
        r#"{{"format":"regrasp-grasps","format_version":1,"tool":"test","kind":"precision","seed":0,"settings":{{}},"inputs":[],
        "hand":{{"name":"h","base_link":"palm: 1","fingers":["a b","c"],"joint_names":["j 1","j#2"]}},
        "object":{{"name":"mug","mass":0.1,"center_of_mass":[0,0,0],"friction":0.8}},"promises":{{"contact_tolerance":5e-4,
        "friction":0.5,"friction_margin":1.5,"required_margin":0.01,"torque_scale":0.05,"normal_force":[0.5,40.0],
        "joint_torques":[null,1.0],"tipping_angle":0.03}},"stable_poses":[],"statistics":{{}},"grasps":[{grasp},{grasp}]}}"#
    );
    from_json(Path::new("grasps.json"), text.as_bytes()).unwrap_or_else(|error| panic!("{error}"))
}

/// The text after `key: `, of its first place.
fn after<'t>(text: &'t str, key: &str) -> &'t str {
    let at = text.find(&format!("{key}: ")).unwrap_or_else(|| panic!("no {key} in {text}")) + key.len() + 2;
    text[at..].lines().next().unwrap()
}

fn numbers(text: &str) -> Vec<f64> {
    text.trim_matches(['[', ']']).split(", ").map(|number| number.parse().unwrap()).collect()
}

#[test]
fn an_isaac_file_has_the_numbers_of_the_list() {
    let list = sample();
    let text = to_isaac(&list);
    assert_eq!(numbers(after(&text, "position")), [1e-7, 0.1, -0.2]);
    assert_eq!(after(&text, "orientation"), "{w: 0.8, xyz: [0.0, 0.0, 0.6]}");
    assert_eq!(after(&text, "confidence").parse(), Ok(0.75));
    assert_eq!(after(&text, "\"j#2\"").parse(), Ok(0.30000000000000004));
    assert_eq!(after(&text, "gripper_frame_link"), "\"palm: 1\"", "names are quoted");
    assert!(text.contains("  grasp_1:\n") && !text.contains("grasp_2"));
    let none = to_isaac(&GraspList { grasps: Vec::new(), ..list });
    assert!(none.ends_with("grasps: {}\n"));
}

#[test]
fn messages_and_arrays_have_every_grasp() {
    let list = sample();
    let text = to_moveit(&list);
    assert_eq!(text.matches("- id: grasp_").count(), 2);
    assert_eq!(after(&text, "grasp_quality").parse(), Ok(0.75));
    assert!(text.contains("vector: {x: 0.0, y: 0.0, z: -1.0}"));
    let bytes = to_npz(&list).unwrap();
    assert!(bytes.starts_with(b"PK"));
    assert_eq!(bytes, to_npz(&list).unwrap(), "the same list gives the same bytes");
}
