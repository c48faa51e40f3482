//! The file of grasp lists: what is written reads back the same, and what is wrong is refused at its place.

use regrasp_base::InputError;
use regrasp_grasp::list::format::{from_json, is_list, schema, to_json};
use regrasp_grasp::list::*;
use regrasp_grasp::record::{PlanInput, PoseData};
use std::path::Path;

/// A list of two grasps with one contact each: no good grasps, but a file.
pub fn sample() -> GraspList {
    let contact = ListedContact {
        finger: "thumb".into(),
        link: "thumb_tip".into(),
        point_in_object: [0.01, 0.0, 0.1 + 0.2],
        normal_in_object: [0.0, 0.0, 1.0],
        force_in_object: [0.0, 0.0, -1.5],
        torsion: None,
    };
    let grasp = ListedGrasp {
        object_from_hand: PoseData { position: [0.0, 0.0, 0.1], quat_xyzw: [0.0, 0.0, 0.6, 0.8] },
        joints: vec![0.1, 1.0 / 3.0],
        open_joints: vec![0.0, 0.0],
        approach: Approach { direction_in_object: [0.0, 0.0, -1.0], distance: 0.1 },
        contacts: vec![contact],
        joint_torques: vec![0.01, -0.02],
        margin: 0.05,
        margin_before_refinement: Some(0.03),
        score: 0.4,
        scores: Scores { closure: 0.25, centroid: 0.5, force_axis: 0.5, flatness: 1.0 },
        stable_poses: vec![0],
    };
    let second = ListedGrasp { margin_before_refinement: None, stable_poses: Vec::new(), ..grasp.clone() };
    GraspList {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        tool: "regrasp test".into(),
        kind: GraspKind::Precision,
        seed: 7,
        settings: serde_json::json!({ "grasps": 2 }),
        source: Some(GraspSource {
            hand: "hand.toml".into(),
            object: "mug.obj".into(),
            mesh: Some(MeshRecord {
                scale: 1.0,
                mass: 0.1,
                friction: 0.8,
                edge_distance: None,
                crease_angle_deg: Some(40.0),
            }),
            torsion_radius: None,
        }),
        inputs: vec![PlanInput { role: "mesh".into(), name: "mug.obj".into(), sha256: "0".repeat(64) }],
        hand: HandRecord {
            name: "test".into(),
            base_link: "palm".into(),
            fingers: vec!["thumb".into(), "index".into()],
            joint_names: vec!["a".into(), "b".into()],
            held_joints: [("wrist".to_owned(), 0.25)].into(),
        },
        object: ObjectRecord { name: "mug".into(), mass: 0.1, center_of_mass: [0.0; 3], friction: 0.8 },
        promises: GraspPromises {
            contact_tolerance: 5e-4,
            friction: 0.8 / 1.5,
            friction_margin: 1.5,
            required_margin: 0.01,
            torque_scale: 0.05,
            normal_force: [0.5, 20.0],
            joint_torques: vec![Some(0.7), None],
            tipping_angle: 0.03,
        },
        stable_poses: vec![StablePose { down_in_object: [0.0, 0.0, -1.0], height: 0.04, tipping_angle: 0.5 }],
        statistics: GraspStatistics { frames: 10, frames_tried: 5, ..GraspStatistics::default() },
        grasps: vec![grasp, second],
    }
}

fn read(text: &str) -> Result<GraspList, InputError> {
    from_json(Path::new("grasps.json"), text.as_bytes())
}

#[test]
fn what_is_written_reads_back_the_same() {
    let list = sample();
    let text = to_json(&list);
    assert!(is_list(text.as_bytes()));
    let again = read(&text).unwrap();
    assert_eq!(again, list);
    assert_eq!(to_json(&again), text);
    assert_eq!(text.lines().filter(|line| line.contains("object_from_hand")).count(), 2, "one line per grasp");
}

/// Each change of the text, the code that it is refused with, and a part of the place or message.
#[test]
fn what_is_wrong_is_refused_at_its_place() {
    let text = to_json(&sample());
    let swapped = |from: &str, to: &str| {
        assert!(text.contains(from), "{from} is not in the file");
        text.replacen(from, to, 1)
    };
    for (changed, code, part) in [
        ("{".to_owned(), "G701", "grasps.json:1"),
        (swapped("\"seed\": 7", "\"seed\": -7"), "G701", "expected u64"),
        (swapped("\"seed\": 7", "\"seed\": 7, \"speed\": 1"), "G701", "speed"),
        (swapped("regrasp-grasps", "regrasp-plan"), "G702", "regrasp-grasps"),
        (swapped("\"format_version\": 1", "\"format_version\": 2"), "G703", "is 2"),
        (swapped("\"open_joints\":[0.0,0.0]", "\"open_joints\":[0.0]"), "G704", "grasps[0].open_joints"),
        (swapped("[0.0,0.0,0.6,0.8]", "[0.0,0.0,0.6,0.9]"), "G705", "quaternion of length"),
        (swapped("[0.0,0.0,0.6,0.8]", "[0.0,0.0,0.6,-0.8]"), "G705", "w < 0"),
        (swapped("\"normal_in_object\":[0.0,0.0,1.0]", "\"normal_in_object\":[0.0,0.0,2.0]"), "G705", "contacts[0]"),
        (swapped("\"finger\":\"thumb\"", "\"finger\":\"ring\""), "G708", "one of thumb, index"),
        (swapped("[\"a\",\"b\"]", "[\"a\",\"a\"]"), "G708", "used twice"),
        (swapped("\"wrist\":0.25", "\"a\":0.25"), "G708", "hand.held_joints.a"),
        (swapped("\"wrist\":0.25", "\"wrist\":1e9"), "G709", "hand.held_joints.wrist"),
        (swapped("\"wrist\":0.25", "\"wr\\u0007ist\":0.25"), "V004", "U+0007"),
        (swapped("\"stable_poses\":[0]", "\"stable_poses\":[1]"), "G709", "below 1"),
        (swapped("\"margin\":0.05", "\"margin\":1e300"), "G709", "grasps[0].margin"),
        (swapped(&"0".repeat(64), "xyz"), "G709", "hex"),
        (swapped("\"normal_force\":[0.5,20.0]", "\"normal_force\":[5.5,2.0]"), "G709", "promises.normal_force"),
    ] {
        let error = read(&changed).expect_err(code).to_string();
        assert!(error.contains(code) && error.contains(part), "{code}, {part}: {error}");
    }
    let contact = text.find("\"contacts\":[{").unwrap() + 12;
    let end = contact + text[contact..].find("}]").unwrap() + 1;
    let none = format!("{}{}", &text[..contact], &text[end..]);
    assert!(read(&none).unwrap_err().to_string().contains("G707"));
    let twice = format!("{},{}", &text[..end], &text[contact..]);
    assert!(read(&twice).unwrap_err().to_string().contains("touches twice"));
}

#[test]
fn the_schema_file_is_the_one_of_the_types() {
    for (name, schema) in [("grasps", schema()), ("double-grasps", regrasp_grasp::list::double::schema())] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../schema/{name}.schema.json"));
        if std::env::var_os("REGRASP_WRITE_SCHEMA").is_some() {
            std::fs::write(&path, &schema).unwrap();
        }
        let stored = std::fs::read_to_string(path).unwrap();
        assert_eq!(stored, schema, "run with REGRASP_WRITE_SCHEMA=1");
    }
}
