//! What stands in a MuJoCo model; the Python tests load it into MuJoCo.

use crate::sample::{LOADED, PLAN};
use regrasp_export::{MjcfError, to_mjcf};
use regrasp_scene::collision_pairs;
use std::collections::BTreeSet;

/// Values of `key` in the elements called `name`, in order.
pub(crate) fn values<'x>(xml: &'x str, name: &str, key: &str) -> Vec<&'x str> {
    let (start, key) = (format!("<{name} "), format!(" {key}=\""));
    let elements = xml.lines().filter(|line| line.trim_start().starts_with(&start));
    elements.filter_map(|line| line.split_once(&key)?.1.split_once('"')).map(|(value, _)| value).collect()
}

#[test]
fn exactly_what_the_checker_keeps_apart_may_touch_and_the_tips() {
    let xml = to_mjcf(&LOADED.manipulation(), &PLAN).expect("the plan's scene").xml;
    let pairs = collision_pairs(&LOADED.view());
    let unplanned = pairs.link_object.len()
        + pairs.finger_finger.len()
        + pairs.within_finger.len()
        + pairs.finger_palm.len()
        + pairs.finger_obstacle.len()
        + pairs.palm_object.len()
        + pairs.object_obstacle.len();
    assert_eq!(values(&xml, "pair", "class").len(), unplanned);
    let (a, b) = (values(&xml, "pair", "geom1"), values(&xml, "pair", "geom2"));
    assert_eq!(a.len(), unplanned + LOADED.scene.hands[0].hand.fingers.len());
    let all: BTreeSet<(&str, &str)> = a.iter().zip(&b).map(|(&a, &b)| (a.min(b), a.max(b))).collect();
    assert_eq!(all.len(), a.len(), "a pair stands there twice");
    let geoms: BTreeSet<&str> = values(&xml, "geom", "name").into_iter().collect();
    assert!(a.iter().chain(&b).all(|name| geoms.contains(name)));
    assert_eq!(geoms.len(), values(&xml, "geom", "name").len(), "a name stands there twice");
}

#[test]
fn every_waypoint_is_a_keyframe_and_every_joint_has_a_motor() {
    let xml = to_mjcf(&LOADED.manipulation(), &PLAN).expect("the plan's scene").xml;
    let n_waypoints: usize = PLAN.segments.iter().map(|segment| segment.waypoints.len()).sum();
    assert_eq!(values(&xml, "key", "name").len(), n_waypoints);
    assert_eq!(values(&xml, "motor", "joint"), PLAN.joint_names);
    let last = &PLAN.segments.last().expect("a segment").waypoints.last().expect("a waypoint");
    let numbers: Vec<f64> = values(&xml, "key", "qpos")[n_waypoints - 1]
        .split(' ')
        .map(|number| number.parse().expect("a number"))
        .collect();
    let [x, y, z, w] = last.world_from_object.quat_xyzw;
    let object = [&last.world_from_object.position[..], &[w, x, y, z]].concat();
    assert_eq!(numbers, [last.joints.clone(), object].concat());
}

#[test]
fn an_object_that_is_not_convex_is_written_in_parts_that_everything_may_touch() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/bulb.toml");
    let bulb = regrasp_scene::load_scene(&path, &Default::default()).expect("a bundled scene");
    let bulb = bulb.manipulation();
    let mjcf = to_mjcf(&bulb, &PLAN).expect("the same hand");
    let geoms = values(&mjcf.xml, "geom", "name");
    let parts: Vec<&str> = geoms.into_iter().filter(|name| name.starts_with("object")).collect();
    assert!(parts.len() >= 2 && parts.contains(&"object") && parts.contains(&"object:1"), "{parts:?}");
    let (a, b) = (values(&mjcf.xml, "pair", "geom1"), values(&mjcf.xml, "pair", "geom2"));
    let touched_by = |part: &str| -> BTreeSet<&str> {
        a.iter().zip(&b).filter(|(_, other)| **other == part).map(|(name, _)| *name).collect()
    };
    let first = touched_by("object");
    assert!(first.len() > bulb.hand().fingers.len() + bulb.scene.obstacles.len());
    assert!(parts.iter().all(|part| touched_by(part) == first));
    assert!(mjcf.notes.iter().any(|note| note.contains("convex parts")), "{:?}", mjcf.notes);
    // The hull of the bulb is a cone from globe to screw, wider than the socket's hole of 11 mm radius. No part is.
    for part in mjcf.xml.lines().filter(|line| line.contains("<mesh name=\"object")) {
        let numbers: Vec<f64> =
            values(part, "mesh", "vertex")[0].split(' ').map(|number| number.parse().expect("a number")).collect();
        let widest = numbers.chunks(3).map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
        let highest = numbers.chunks(3).map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
        assert!(widest < 0.0105 || highest < 0.0385, "a part of radius {widest} reaches up to {highest}");
    }
}

#[test]
fn a_plan_for_another_hand_is_refused() {
    let mut plan = PLAN.clone();
    plan.joint_names[0] = "elbow".into();
    assert!(matches!(to_mjcf(&LOADED.manipulation(), &plan), Err(MjcfError::AnotherHand { what: "joints", .. })));
    let mut plan = PLAN.clone();
    plan.fingers.swap(0, 1);
    assert!(matches!(to_mjcf(&LOADED.manipulation(), &plan), Err(MjcfError::AnotherHand { what: "fingers", .. })));
}

#[test]
fn no_link_is_called_as_the_body_of_mujoco_that_carries_all() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
    let mut loaded = regrasp_scene::load_scene(&path, &Default::default()).expect("a bundled scene");
    let hand = &mut loaded.scene.hands[0].hand;
    let (base, n_links) = (hand.base.0, hand.robot.links.len());
    let links = &mut std::sync::Arc::make_mut(&mut hand.robot).links;
    links[base].name = "world".into();
    links[(base + 1) % n_links].name = "world_".into();
    let xml = to_mjcf(&loaded.manipulation(), &PLAN).expect("the same joints").xml;
    let bodies = values(&xml, "body", "name");
    assert!(bodies.contains(&"world__") && bodies.contains(&"world_") && !bodies.contains(&"world"), "{bodies:?}");
}
