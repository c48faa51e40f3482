//! The bundled scene of two hands through every command: a plan for each hand, judged, drawn, exported and measured.

use crate::folder::{Folder, Run};
use crate::places::repository;
use serde_json::Value;
use std::fs;

const SCENE: &str = "scenes/two_hands.toml";
const TASKS: [(&str, &str, &str, usize); 2] = [("turn_ball", "right", "ball", 4), ("turn_box", "left", "box", 6)];

/// A folder with the scene and its two hands, where a repository has them.
fn folder() -> Folder {
    let folder = Folder::new();
    for hand in ["wide_four_finger", "six_finger"] {
        let path = format!("assets/hands/{hand}");
        fs::create_dir_all(folder.path(&path)).unwrap();
        for file in ["hand.toml", "hand.urdf"] {
            folder.write(&format!("{path}/{file}"), fs::read(repository().join(&path).join(file)).unwrap());
        }
    }
    fs::create_dir_all(folder.path("scenes")).unwrap();
    folder.write(SCENE, fs::read(repository().join(SCENE)).unwrap());
    folder
}

#[track_caller]
fn succeeds(run: Run) -> Run {
    assert_eq!(run.code, Some(0), "{run:?}");
    run
}

#[test]
fn each_hand_plans_and_every_command_knows_its_plan() {
    let folder = folder();
    for (task, hand, object, n_fingers) in TASKS {
        let name = |ending: &str| format!("scenes/{task}{ending}");
        let plan = name(".json");
        succeeds(folder.run(&["plan", SCENE, "--task", task, "-o", &plan]));
        let file: Value = serde_json::from_slice(&fs::read(folder.path(&plan)).unwrap()).unwrap();
        assert_eq!((file["format_version"].as_u64(), &file["query"]), (Some(3), &task.into()));
        assert_eq!(file["hands"][0]["name"], hand);
        assert_eq!(file["hands"][0]["fingers"].as_array().unwrap().len(), n_fingers);
        assert_eq!(file["objects"], serde_json::json!([object]));
        for segment in file["segments"].as_array().unwrap() {
            assert_eq!((&segment["hand"], &segment["held_by"][object]), (&hand.into(), &serde_json::json!([hand])));
        }
        // The plan names its task: nobody has to say it again.
        succeeds(folder.run(&["check", &plan]));
        succeeds(folder.run(&["view", &plan, SCENE, "-o", &name(".html"), "--png", &name(".png")]));
        let page = fs::read_to_string(folder.path(&name(".html"))).unwrap();
        let other = TASKS.iter().find(|(other, ..)| *other != task).unwrap();
        for shown in [object, other.2, "table"] {
            assert!(page.contains(&format!("\"{shown}\"")), "{task}: the page does not show {shown}");
        }
        assert!(fs::read(folder.path(&name(".png"))).unwrap().starts_with(b"\x89PNG"));
        let [npz, ros2, mjcf] = [".npz", ".yaml", ".xml"].map(name);
        succeeds(folder.run(&["export", &plan, "--npz", &npz, "--ros2", &ros2, "--mjcf", &mjcf]));
        assert!(fs::read(folder.path(&npz)).unwrap().starts_with(b"PK"));
        assert!(fs::read_to_string(folder.path(&ros2)).unwrap().contains("joint_names"));
        let model = fs::read_to_string(folder.path(&mjcf)).unwrap();
        assert!(model.contains("<mujoco") && model.contains(object), "{task}");
        let bench = succeeds(folder.run(&["bench", SCENE, "--task", task, "--seeds", "2", "--max-work", "3000000"]));
        assert!(bench.out.contains("two_hands"), "{}", bench.out);
    }
}

/// A plan of one hand is none of the other one, whatever it calls itself.
#[test]
fn a_plan_under_the_name_of_the_other_task_is_rejected() {
    let folder = folder();
    succeeds(folder.run(&["plan", SCENE, "--task", "turn_ball", "-o", "scenes/plan.json"]));
    for (old, new) in [
        ("\"query\": \"turn_ball\"", "\"query\": \"turn_box\""),
        ("\"query\": \"turn_ball\"", "\"query\": \"turn_nothing\""),
        ("\"held_by\":{\"ball\":[\"right\"]}", "\"held_by\":{\"ball\":[\"left\"]}"),
        ("\"held_by\":{\"ball\":[\"right\"]}", "\"held_by\":{\"ball\":[\"right\",\"table\"]}"),
    ] {
        let text = fs::read_to_string(folder.path("scenes/plan.json")).unwrap();
        assert!(text.contains(old), "{old}");
        folder.write("scenes/other.json", text.replacen(old, new, 1));
        let run = folder.run(&["check", "scenes/other.json"]);
        assert_eq!(run.code, Some(1), "{new}: {run:?}");
    }
}

/// A plan of format 2, as earlier versions wrote them, is judged like the same plan of format 3.
#[test]
fn a_plan_of_format_2_is_judged_as_before() {
    let folder = Folder::new();
    succeeds(folder.run(&["plan", "scene.toml", "-o", "plan.json"]));
    let mut file: Value = serde_json::from_slice(&fs::read(folder.path("plan.json")).unwrap()).unwrap();
    let root = file.as_object_mut().unwrap();
    root["format_version"] = 2.into();
    let hand = root.remove("hands").unwrap()[0].take();
    root.remove("objects");
    for key in ["fingers", "joint_names"] {
        root.insert(key.into(), hand[key].clone());
    }
    for segment in root["segments"].as_array_mut().unwrap() {
        let segment = segment.as_object_mut().unwrap();
        segment.remove("held_by");
        segment.remove("hand");
        if let Some(moving) = segment.remove("moving") {
            segment.insert("moving_finger".into(), moving[0].clone());
        }
        for waypoint in segment["waypoints"].as_array_mut().unwrap() {
            let waypoint = waypoint.as_object_mut().unwrap();
            let pose = waypoint.remove("world_from_objects").unwrap()[0].take();
            waypoint.insert("world_from_object".into(), pose);
            let touching = waypoint["contacts"].take();
            let of_finger = |finger: &Value| {
                let own = touching.as_array().unwrap().iter().find(|contact| contact["finger"] == *finger);
                let mut own = own.cloned().unwrap_or_else(|| serde_json::json!({"mode": "free"}));
                for key in ["hand", "finger", "object"] {
                    own.as_object_mut().unwrap().remove(key);
                }
                own
            };
            waypoint["contacts"] = hand["fingers"].as_array().unwrap().iter().map(of_finger).collect();
        }
    }
    folder.write("old.json", file.to_string());
    let verdict = |plan: &str| {
        let run = succeeds(folder.run(&["check", plan, "--json"]));
        let line = run.out.lines().find(|line| line.contains("\"accepted\"")).unwrap();
        let event: Value = serde_json::from_str(line).unwrap();
        assert_eq!(event["accepted"], true);
        event["report"].clone()
    };
    assert_eq!(verdict("old.json"), verdict("plan.json"));
    // One number off, and it is rejected as before.
    let joint = &mut file["segments"][0]["waypoints"][1]["joints"][2];
    *joint = (joint.as_f64().unwrap() + 0.01).into();
    folder.write("old.json", file.to_string());
    assert_eq!(folder.run(&["check", "old.json"]).code, Some(1));
}
