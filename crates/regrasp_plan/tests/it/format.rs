//! Plan files: what is written is read back the same, what is broken is refused with its place, nothing panics.

use crate::sample;
use proptest::prelude::*;
use regrasp_plan::check::Level;
use regrasp_plan::format::{from_json, schema, to_json};
use regrasp_plan::plan::ONLY_HAND;
use regrasp_plan::{ContactMode, Plan, SegmentKind};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::LazyLock;

static GOOD: LazyLock<(Plan, String)> = LazyLock::new(|| {
    let plan = sample::plan(&sample::scene());
    let text = to_json(&plan);
    (plan, text)
});

fn read(text: &str) -> Result<Plan, String> {
    from_json(Path::new("plan.json"), text.as_bytes()).map_err(|error| error.to_string())
}

#[test]
fn a_plan_survives_the_file_bit_by_bit() {
    let (plan, text) = &*GOOD;
    let back = read(text).unwrap();
    assert_eq!(&back, plan);
    assert_eq!(&to_json(&back), text);
    let n_waypoints: usize = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
    assert_eq!(text.lines().filter(|line| line.trim_start().starts_with("{\"time\"")).count(), n_waypoints);
    let value: Value = serde_json::from_str(text).unwrap();
    assert_eq!(value["format_version"], 3);
    assert_eq!(in_version_2(&value), serde_json::to_value(plan).unwrap());
}

/// What a plan file of version 3 says, in the words of version 2: a second way from the one to the other.
fn in_version_2(file: &Value) -> Value {
    let mut file = file.clone();
    let root = file.as_object_mut().unwrap();
    let hand = root.remove("hands").unwrap()[0].take();
    root.remove("objects").unwrap();
    root.remove("query");
    for key in ["fingers", "joint_names"] {
        root.insert(key.into(), hand[key].clone());
    }
    for segment in root["segments"].as_array_mut().unwrap() {
        let segment = segment.as_object_mut().unwrap();
        segment.remove("held_by").unwrap();
        assert_eq!(segment.remove("hand").unwrap(), hand["name"]);
        if let Some(Value::Array(mut moving)) = segment.remove("moving") {
            segment.insert("moving_finger".into(), moving.remove(0));
            if !moving.is_empty() {
                segment.insert("also_moving".into(), moving.into());
            }
        }
        for waypoint in segment["waypoints"].as_array_mut().unwrap() {
            let waypoint = waypoint.as_object_mut().unwrap();
            let pose = waypoint.remove("world_from_objects").unwrap()[0].take();
            waypoint.insert("world_from_object".into(), pose);
            let given = waypoint["contacts"].take();
            let contact_of = |finger: &Value| {
                let mut contact =
                    given.as_array().unwrap().iter().find(|contact| contact["finger"] == *finger).cloned();
                for key in ["hand", "finger", "object"] {
                    contact.as_mut().and_then(Value::as_object_mut).map(|contact| contact.remove(key).unwrap());
                }
                contact.unwrap_or_else(|| json!({"mode": "free"}))
            };
            waypoint["contacts"] = hand["fingers"].as_array().unwrap().iter().map(contact_of).collect();
        }
    }
    file
}

/// The plan as a file of version 2 has it: the hand is the only one, the object has no name.
fn without_names(mut plan: Plan) -> Plan {
    (plan.hand, plan.object, plan.query) = (ONLY_HAND.into(), String::new(), String::new());
    for segment in &mut plan.segments {
        segment.held_by = vec![ONLY_HAND.into()];
    }
    plan
}

#[test]
fn a_file_of_version_2_reads_to_the_same_plan_and_is_judged_alike() {
    let scene = sample::scene();
    let plans = [
        sample::plan(&scene),
        sample::plan_with_way(&scene),
        sample::plan_with_free_finger(&scene),
        crate::loaded::plan(&scene),
    ];
    for plan in plans {
        let mut old = in_version_2(&serde_json::from_str(&to_json(&plan)).unwrap());
        old["format_version"] = 2.into();
        let back = read(&serde_json::to_string(&old).unwrap()).unwrap();
        assert_eq!(back, without_names(plan.clone()));
        assert_eq!(sample::judge_for(Level::Motion, &scene, &back), sample::judge_for(Level::Motion, &scene, &plan));
    }
    // Files as they were written by earlier versions: the seeds of the fuzz target are one plan in both versions.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/plan_json");
    let [new, old] = ["plan.json", "version_2.json"].map(|name| std::fs::read_to_string(folder.join(name)).unwrap());
    assert!(old.contains("\"format_version\": 2") && new.contains("\"format_version\": 3"));
    assert_eq!(read(&old).unwrap(), without_names(read(&new).unwrap()));
}

/// Version 2 has no names of tasks, hands, objects and holders, version 3 none of the keys that it replaced.
#[test]
fn keys_of_one_version_are_refused_in_the_other() {
    let new: Value = serde_json::from_str(&GOOD.1).unwrap();
    let mut old = in_version_2(&new);
    old["format_version"] = 2.into();
    let refused = |file: &Value, change: &dyn Fn(&mut Value), key: &str| {
        let mut file = file.clone();
        change(&mut file);
        let message = read(&serde_json::to_string(&file).unwrap()).unwrap_err();
        assert!(message.contains("C401") && message.contains(key), "{key}: {message}");
    };
    for key in ["query", "hand", "object"] {
        refused(&old, &|file| file[key] = "hand".into(), key);
    }
    refused(&old, &|file| file["segments"][0]["held_by"] = json!(["hand"]), "held_by");
    let (once, twice) = (r#""held_by":{"ball":["hand"]}"#, r#""held_by":{"ball":["table"],"ball":["hand"]}"#);
    assert!(GOOD.1.contains(once));
    let message = read(&GOOD.1.replacen(once, twice, 1)).unwrap_err();
    assert!(message.contains("C401") && message.contains("duplicate field `ball`"), "{message}");
    refused(&new, &|file| file["fingers"] = json!(["f0"]), "fingers");
    refused(&new, &|file| file["segments"][1]["moving_finger"] = "f1".into(), "moving_finger");
    refused(&new, &|file| file["segments"][1]["also_moving"] = json!(["f0"]), "also_moving");
}

/// What a plan in memory cannot say is damaged in the file.
#[test]
fn names_and_lists_that_do_not_fit_are_named_with_their_place() {
    let good: Value = serde_json::from_str(&GOOD.1).unwrap();
    // Segment 1 lifts f1: at its waypoint 2 the others hold.
    const AT: [usize; 2] = [1, 2];
    let waypoint = |file: &mut Value, change: &dyn Fn(&mut Value)| {
        change(&mut file["segments"][AT[0]]["waypoints"][AT[1]]);
    };
    type Damage<'a> = &'a dyn Fn(&mut Value);
    let contacts = "segments[1].waypoints[2].contacts";
    let cases: [(&str, Damage, String); 17] = [
        ("C404", &|f| waypoint(f, &|w| w["world_from_objects"] = json!([])), "waypoints[2].world_from_objects".into()),
        (
            "C404",
            &|f| waypoint(f, &|w| w["world_from_objects"] = json!([w["world_from_objects"][0], pose()])),
            "has 2 poses".into(),
        ),
        (
            "C407",
            &|f| {
                waypoint(f, &|w| {
                    insert(w, 1, json!({"hand": "hand", "finger": "f1", "object": "ball", "mode": "free"}))
                })
            },
            format!("{contacts}[1].mode"),
        ),
        ("C407", &|f| waypoint(f, &|w| w["contacts"][0]["mode"] = "free".into()), "no entry".into()),
        ("C408", &|f| waypoint(f, &|w| w["contacts"][0]["hand"] = "left".into()), format!("{contacts}[0].hand")),
        ("C408", &|f| waypoint(f, &|w| w["contacts"][1]["finger"] = "thumb".into()), format!("{contacts}[1].finger")),
        ("C408", &|f| waypoint(f, &|w| w["contacts"][2]["object"] = "cube".into()), format!("{contacts}[2].object")),
        ("C408", &|f| waypoint(f, &|w| w["contacts"].as_array_mut().unwrap().swap(0, 2)), "in the order".into()),
        ("C408", &|f| waypoint(f, &|w| w["contacts"][1] = w["contacts"][0].clone()), "each finger once".into()),
        ("C408", &|f| f["segments"][1]["hand"] = "left".into(), "segments[1].hand".into()),
        ("C408", &|f| f["segments"][1]["held_by"] = json!({"cube": ["hand"]}), "segments[1].held_by".into()),
        ("C408", &|f| f["segments"][1]["held_by"]["ball"] = json!(["hand", "hand"]), "again".into()),
        ("C410", &|f| f["segments"][1]["held_by"]["ball"] = json!(vec!["hand"; 65]), "has 65 names".into()),
        ("V004", &|f| f["segments"][1]["held_by"]["ball"] = json!(["a\u{1b}[2Jb"]), "segments[1].held_by".into()),
        (
            "C411",
            &|f| {
                let second = f["hands"][0].clone();
                f["hands"].as_array_mut().unwrap().push(second);
            },
            "hands".into(),
        ),
        ("C411", &|f| f["objects"] = json!(["ball", "cube"]), "objects".into()),
        ("C411", &|f| f["objects"] = json!([]), "has 0 entries".into()),
    ];
    for (code, damage, part) in cases {
        let mut file = good.clone();
        damage(&mut file);
        let message = read(&serde_json::to_string_pretty(&file).unwrap()).unwrap_err();
        assert!(message.contains(code) && message.contains(&part), "wanted {code} and {part:?} in:\n{message}");
        assert!(!message.contains("plan.json:1:"), "no place in:\n{message}");
    }
}

fn insert(waypoint: &mut Value, index: usize, contact: Value) {
    waypoint["contacts"].as_array_mut().unwrap().insert(index, contact);
}

fn pose() -> Value {
    json!({"position": [0.0, 0.0, 0.0], "quat_xyzw": [0.0, 0.0, 0.0, 1.0]})
}

#[test]
fn the_schema_in_the_repository_is_the_one_of_the_types() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../schema/plan.schema.json");
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    if written != schema() && std::env::var_os("REGRASP_WRITE_SCHEMA").is_some() {
        std::fs::write(&path, schema()).unwrap();
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap_or_default(), schema(), "run with REGRASP_WRITE_SCHEMA=1");
}

/// Makes the second segment one of tracking that moves the first finger and others.
fn name_others(plan: &mut Plan, others: &[&str]) {
    let segment = &mut plan.segments[1];
    segment.kind = SegmentKind::Tracking;
    segment.moving_finger = Some("f0".into());
    segment.rolling_finger = Some("f3".into());
    segment.also_moving = others.iter().map(|name| (*name).to_owned()).collect();
}

#[test]
fn every_kind_of_damage_is_named_with_its_place() {
    let (plan, text) = &*GOOD;
    let cut = |f: &dyn Fn(&mut Plan)| {
        let mut plan = plan.clone();
        f(&mut plan);
        to_json(&plan)
    };
    let held = |joints: &[(&str, f64)]| {
        cut(&|p| p.held_joints = joints.iter().map(|(name, at)| ((*name).to_owned(), *at)).collect())
    };
    let with_wrist = read(&held(&[("wrist", 0.1), ("lamp", -0.2)])).unwrap();
    assert_eq!(with_wrist.held_joints.into_iter().collect::<Vec<_>>(), [("lamp".into(), -0.2), ("wrist".into(), 0.1)]);
    let waypoint_line = text.lines().position(|line| line.contains("{\"time\"")).unwrap() + 1;
    let third_line = waypoint_line + 2;
    let cases: Vec<(&str, String, String)> = vec![
        ("C401", "{".into(), "plan.json:1:".into()),
        ("C401", text.replacen("\"seed\": 0", "\"seed\": -1", 1), "plan.json:7:".into()),
        ("C401", text.replacen("\"seed\": 0", "\"sede\": 0", 1), "sede".into()),
        ("C401", text.replacen("\"friction\":0.8", "\"friction\":1e999", 1), "out of range".into()),
        ("C402", text.replacen("regrasp-plan", "other-plan", 1), "plan.json:2:13".into()),
        ("C402", "{}".into(), "format".into()),
        ("C403", text.replacen("\"format_version\": 3", "\"format_version\": 1", 1), "plan.json:3:21".into()),
        ("C404", cut(&|p| p.segments[0].waypoints[2].joints.truncate(3)), format!("plan.json:{third_line}:")),
        ("C405", cut(&|p| p.goal.quat_xyzw[3] += 1e-6), "goal".into()),
        ("C405", cut(&|p| p.goal.quat_xyzw = p.goal.quat_xyzw.map(|x| -x)), "w < 0".into()),
        (
            "C405",
            cut(&|p| {
                p.segments[0].waypoints[2].contacts[1].normal_in_object = Some([0.0, 0.0, 0.9]);
            }),
            format!("plan.json:{third_line}:"),
        ),
        ("C406", cut(&|p| p.segments.clear()), "segments".into()),
        ("C406", cut(&|p| p.segments[1].waypoints.truncate(1)), "segments[1].waypoints".into()),
        ("C407", cut(&|p| p.segments[0].waypoints[2].contacts[0].mode = ContactMode::Free), "has an entry".into()),
        ("C407", cut(&|p| p.segments[0].waypoints[2].contacts[0].point_in_object = None), "lacks".into()),
        ("C408", cut(&|p| p.segments[1].moving_finger = Some("thumb".into())), "thumb".into()),
        ("C408", cut(&|p| p.segments[1].moving_finger = None), "without".into()),
        ("C408", cut(&|p| p.segments[0].moving_finger = Some("f0".into())), "transfer".into()),
        ("C408", cut(&|p| p.segments[1].also_moving = vec!["f0".into()]), "in a tracking segment only".into()),
        ("C408", cut(&|p| name_others(p, &["thumb"])), "thumb".into()),
        ("C408", cut(&|p| name_others(p, &["f1", "f2", "f1"])), "again".into()),
        ("C408", cut(&|p| p.joint_names[1] = p.joint_names[0].clone()), "twice".into()),
        ("C409", cut(&|p| p.promises.friction = -0.1), "promises.friction".into()),
        ("C409", cut(&|p| p.inputs[0].sha256 = "abc".into()), "abc".into()),
        ("C409", cut(&|p| p.segments[0].waypoints[2].joints[0] = 1e9), format!("plan.json:{third_line}:")),
        ("C404", cut(&|p| p.segments[0].waypoints[2].joint_velocities.truncate(3)), format!("plan.json:{third_line}:")),
        ("C404", cut(&|p| p.segments[0].waypoints[2].joint_torques = vec![0.0; 12]), "\"forces\"".into()),
        ("C404", cut(&|p| p.promises.motion.joint_velocities.truncate(3)), "motion.joint_velocities".into()),
        ("C409", cut(&|p| p.promises.motion.joint_accelerations[2] = 0.0), "above 0".into()),
        ("C409", cut(&|p| p.promises.motion.largest_speed = -1.0), "largest_speed".into()),
        ("C409", cut(&|p| p.promises.friction_margin = 0.9), "friction_margin".into()),
        ("C409", cut(&|p| p.promises.slip_tolerance = -1e-9), "slip_tolerance".into()),
        ("C409", cut(&|p| p.segments[0].waypoints[2].time = -1.0), format!("plan.json:{third_line}:")),
        (
            "C407",
            cut(&|p| p.segments[0].waypoints[2].contacts[1].force_in_object = Some([0.0; 3])),
            "has no \"forces\"".into(),
        ),
        ("C407", cut(&|p| p.segments[1].waypoints[2].contacts[1].torsion = Some(0.0)), "has an entry".into()),
        ("V004", held(&[("a\nb", 0.1)]), "has the character U+000A".into()),
        ("C408", held(&[(&plan.joint_names[2], 0.1)]), "\"joint_names\" too".into()),
        ("C409", held(&[("wrist", 1e9)]), "hands[0].held_joints.wrist".into()),
        ("C401", held(&[("wrist", 0.1), ("wrisp", 0.1)]).replace("wrisp", "wrist"), "duplicate field `wrist`".into()),
        ("C410", cut(&|p| p.fingers = (0..65).map(|i| i.to_string()).collect()), "65".into()),
    ];
    for (code, text, part) in cases {
        let message = read(&text).unwrap_err();
        assert!(message.contains(code) && message.contains(&part), "wanted {code} and {part:?} in:\n{message}");
    }
}

#[test]
fn damaged_forces_are_named_with_their_place() {
    let scene = sample::scene();
    let good = crate::loaded::plan(&scene);
    assert_eq!(read(&to_json(&good)).as_ref(), Ok(&good));
    type Damage<'a> = &'a dyn Fn(&mut Plan);
    let cases: [(&str, Damage, &str); 8] = [
        ("C404", &|p| p.segments[0].waypoints[2].joint_torques.clear(), "waypoints[2].joint_torques"),
        ("C404", &|p| _ = p.promises.forces.as_mut().unwrap().joint_torques.pop(), "forces.joint_torques"),
        ("C407", &|p| p.segments[0].waypoints[2].contacts[0].force_in_object = None, "lacks its force"),
        ("C409", &|p| p.promises.forces.as_mut().unwrap().mass = -0.1, "forces.mass"),
        ("C409", &|p| p.promises.forces.as_mut().unwrap().normal_force = [3.0, 2.0], "forces.normal_force"),
        ("C409", &|p| p.promises.forces.as_mut().unwrap().joint_torques[1] = Some(-1.0), "forces.joint_torques"),
        ("C409", &|p| p.promises.forces.as_mut().unwrap().gravity_in_world = Some([0.0, 0.0, 1e6]), "gravity_in_world"),
        ("C409", &|p| p.segments[0].waypoints[2].contacts[0].force_in_object = Some([1e12; 3]), "has a force of"),
    ];
    for (code, damage, part) in cases {
        let mut plan = good.clone();
        damage(&mut plan);
        let message = read(&to_json(&plan)).unwrap_err();
        assert!(message.contains(code) && message.contains(part), "wanted {code} and {part:?} in:\n{message}");
    }
}

#[test]
fn the_seed_of_the_fuzz_target_is_a_plan_of_this_version() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/plan_json/plan.json");
    let plan = from_json(&path, &std::fs::read(&path).unwrap()).unwrap_or_else(|error| panic!("{error}"));
    let rolls = |contact: &regrasp_plan::ContactState| contact.mode == ContactMode::Rolling;
    assert!(plan.promises.forces.is_some());
    assert!(plan.segments.iter().flat_map(|s| &s.waypoints).flat_map(|w| &w.contacts).any(rolls));
}

#[test]
fn a_file_full_of_damage_gives_a_short_answer() {
    let mut plan = GOOD.0.clone();
    plan.segments.iter_mut().flat_map(|s| &mut s.waypoints).for_each(|w| w.joints.clear());
    let message = read(&to_json(&plan)).unwrap_err();
    assert_eq!(message.lines().count(), 21, "{message}");
    assert!(
        message.lines().last().is_some_and(|line| line.starts_with("and ") && line.ends_with(" more")),
        "{message}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_never_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..4), 1..12),
    ) {
        let mut bytes = GOOD.1.clone().into_bytes();
        for (place, byte, how) in edits {
            let at = place.index(bytes.len());
            match how {
                0 => bytes[at] = byte,
                1 => bytes[at] = b"0123456789-eE.,:[]{}\"ntf"[byte as usize % 24],
                2 => { bytes.remove(at); }
                _ => bytes.truncate((at + 1).max(bytes.len() / 2)),
            }
        }
        if let Ok(plan) = from_json(Path::new("plan.json"), &bytes) {
            prop_assert!(from_json(Path::new("plan.json"), to_json(&plan).as_bytes()).is_ok());
        }
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(from_json(Path::new("plan.json"), &bytes).is_err());
    }
}
