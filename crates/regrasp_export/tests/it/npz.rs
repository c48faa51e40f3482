//! The archive, read by a reader of the NPY format written here.

use crate::sample::PLAN;
use regrasp_export::to_npz;
use regrasp_plan::{Plan, Waypoint};
use std::collections::BTreeMap;
use std::io::{Cursor, Read};

/// One array: type, shape, data.
struct Array {
    descr: String,
    shape: Vec<usize>,
    data: Vec<u8>,
}

impl Array {
    fn floats(&self) -> Vec<f64> {
        assert_eq!(self.descr, "<f8");
        self.data.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect()
    }

    fn integers(&self) -> Vec<i64> {
        assert_eq!(self.descr, "<i8");
        self.data.chunks_exact(8).map(|bytes| i64::from_le_bytes(bytes.try_into().unwrap())).collect()
    }

    fn texts(&self) -> Vec<String> {
        let width: usize = self.descr.strip_prefix("<U").expect("text").parse().expect("a width");
        let chars = self.data.chunks_exact(4).map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap()));
        let chars: Vec<char> = chars.map(|code| char::from_u32(code).expect("a character")).collect();
        chars.chunks(width).map(|text| text.iter().collect::<String>().trim_end_matches('\0').to_owned()).collect()
    }
}

fn between<'a>(text: &'a str, before: &str, after: &str) -> &'a str {
    text.split_once(before).and_then(|(_, rest)| rest.split_once(after)).expect("a header").0
}

fn read(bytes: &[u8]) -> BTreeMap<String, Array> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    let mut arrays = BTreeMap::new();
    for index in 0..archive.len() {
        let mut file = archive.by_index(index).expect("a file");
        let date = file.last_modified().expect("a date");
        assert_eq!((date.year(), date.month(), date.day(), date.second()), (1980, 1, 1, 0));
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).expect("the checksum holds");
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!(end % 64, 0, "data is aligned");
        let header = std::str::from_utf8(&bytes[10..end]).expect("ASCII");
        assert!(header.ends_with('\n') && header.contains("'fortran_order': False"));
        let shape = between(header, "'shape': (", ")").split(',').map(str::trim).filter(|length| !length.is_empty());
        let array = Array {
            descr: between(header, "'descr': '", "'").to_owned(),
            shape: shape.map(|length| length.parse().expect("a length")).collect(),
            data: bytes[end..].to_vec(),
        };
        arrays.insert(file.name().expect("a name").strip_suffix(".npy").expect("an array").to_owned(), array);
    }
    arrays
}

fn waypoints(plan: &Plan) -> Vec<&Waypoint> {
    plan.segments.iter().flat_map(|segment| &segment.waypoints).collect()
}

#[test]
fn every_number_of_the_plan_is_where_its_name_says() {
    let plan = &*PLAN;
    let arrays = read(&to_npz(plan).unwrap());
    let (n, j, f) = (waypoints(plan).len(), plan.joint_names.len(), plan.fingers.len());
    assert_eq!(arrays["joint_names"].texts(), plan.joint_names);
    assert_eq!(arrays["fingers"].texts(), plan.fingers);
    assert_eq!(arrays["tool"].texts(), [plan.tool.as_str()]);
    assert_eq!(arrays["tool"].shape, [0; 0]);
    assert_eq!(arrays["joints"].shape, [n, j]);
    assert_eq!(arrays["contact_points_in_object"].shape, [n, f, 3]);
    let (times, joints) = (arrays["times"].floats(), arrays["joints"].floats());
    let (positions, quats) = (arrays["object_positions"].floats(), arrays["object_quat_xyzw"].floats());
    let (points, modes) = (arrays["contact_points_in_object"].floats(), &arrays["contact_modes"].data);
    for (i, waypoint) in waypoints(plan).into_iter().enumerate() {
        assert_eq!(times[i], waypoint.time);
        assert_eq!(joints[i * j..(i + 1) * j], waypoint.joints);
        assert_eq!(positions[3 * i..3 * i + 3], waypoint.world_from_object.position);
        assert_eq!(quats[4 * i..4 * i + 4], waypoint.world_from_object.quat_xyzw);
        for (k, contact) in waypoint.contacts.iter().enumerate() {
            let at = i * f + k;
            assert_eq!(modes[at] != 0, contact.holds());
            match contact.point_in_object {
                Some(point) => assert_eq!(points[3 * at..3 * at + 3], point),
                None => assert!(points[3 * at..3 * at + 3].iter().all(|x| x.is_nan())),
            }
        }
    }
    assert!(modes.contains(&0), "some finger moves freely in this plan");
}

#[test]
fn joints_that_stand_still_have_their_names_and_positions() {
    let mut plan = PLAN.clone();
    let arrays = read(&to_npz(&plan).unwrap());
    assert_eq!((&arrays["held_joint_names"].shape, &arrays["held_joints"].shape), (&vec![0], &vec![0]));
    plan.held_joints.extend([("wrist".to_owned(), 0.25), ("lamp".to_owned(), -1.5)]);
    let arrays = read(&to_npz(&plan).unwrap());
    assert_eq!(arrays["held_joint_names"].texts(), ["lamp", "wrist"]);
    assert_eq!(arrays["held_joints"].floats(), [-1.5, 0.25]);
}

#[test]
fn segments_and_their_waypoints_agree() {
    let plan = &*PLAN;
    let arrays = read(&to_npz(plan).unwrap());
    let starts = arrays["segment_starts"].integers();
    let segment_of = arrays["segment_of_waypoint"].integers();
    for (s, segment) in plan.segments.iter().enumerate() {
        let range = starts[s] as usize..starts[s + 1] as usize;
        assert_eq!(range.len(), segment.waypoints.len());
        assert!(segment_of[range].iter().all(|&of| of == s as i64));
        let kind = serde_json::to_value(segment.kind).unwrap();
        assert_eq!(arrays["segment_kinds"].texts()[s], kind);
        let moving = usize::try_from(arrays["segment_moving_fingers"].integers()[s]).ok();
        assert_eq!(moving.map(|finger| &plan.fingers[finger]), segment.moving_finger.as_ref());
        let n = plan.fingers.len();
        let moves = &arrays["segment_moves"].integers()[s * n..(s + 1) * n];
        assert!(moves.iter().enumerate().all(|(f, &one)| (one == 1) == (moving == Some(f)) && one <= 1));
        assert_eq!(arrays["segment_rolling_fingers"].integers()[s], -1);
    }
    assert_eq!(*starts.last().unwrap() as usize, segment_of.len());
}

#[test]
fn hands_objects_and_holders_are_named() {
    let mut plan = PLAN.clone();
    let arrays = read(&to_npz(&plan).unwrap());
    assert_eq!(arrays["hands"].texts(), [plan.hand.as_str()]);
    assert_eq!(arrays["objects"].texts(), [plan.object.as_str()]);
    assert_eq!(arrays["holders"].texts(), [plan.hand.as_str()]);
    assert_eq!(arrays["hand_of_joint"].integers(), vec![0; plan.joint_names.len()]);
    assert_eq!(arrays["hand_of_finger"].integers(), vec![0; plan.fingers.len()]);
    assert_eq!(arrays["segment_held_by"].shape, [plan.segments.len(), 1, 1]);
    assert!(arrays["segment_held_by"].integers().iter().all(|&holds| holds == 1));

    plan.segments[0].held_by = vec!["table".into()];
    plan.segments[1].held_by = vec!["table".into(), plan.hand.clone()];
    let arrays = read(&to_npz(&plan).unwrap());
    assert_eq!(arrays["holders"].texts(), ["table", plan.hand.as_str()]);
    assert_eq!(arrays["segment_held_by"].shape, [plan.segments.len(), 1, 2]);
    assert_eq!(arrays["segment_held_by"].integers()[..6], [1, 0, 1, 1, 0, 1]);
}

#[test]
fn the_same_plan_gives_the_same_bytes() {
    assert_eq!(to_npz(&PLAN), to_npz(&PLAN.clone()));
}

#[test]
fn torques_are_there_when_the_plan_has_them() {
    let mut plan = PLAN.clone();
    for segment in &mut plan.segments {
        for waypoint in &mut segment.waypoints {
            waypoint.joint_torques = waypoint.joints.iter().map(|joint| 0.1 * joint).collect();
        }
    }
    let arrays = read(&to_npz(&plan).unwrap());
    let joints = arrays["joints"].floats();
    assert!(arrays["joint_torques"].floats().iter().zip(joints).all(|(&torque, joint)| torque == 0.1 * joint));
    for segment in &mut plan.segments {
        segment.waypoints.iter_mut().for_each(|waypoint| waypoint.joint_torques.clear());
    }
    assert!(!read(&to_npz(&plan).unwrap()).contains_key("joint_torques"));
}

/// Every name of an array takes as much room as the longest: a name of 8 MB would take 8 GB.
#[test]
fn names_that_would_fill_the_memory_are_refused() {
    let mut plan = PLAN.clone();
    plan.joint_names[3] = "j".repeat(100_000);
    let refused = to_npz(&plan).unwrap_err();
    assert_eq!(refused.code(), "C422");
    assert!(refused.to_string().contains("the joint names need 1200000 characters"), "{refused}");
    plan.joint_names[3] = "j".repeat(1000);
    assert!(to_npz(&plan).unwrap().len() < 1_000_000);
}
