//! Finger tracking from start grasps of the planner's choice: random goals, edges that have to be crossed, and Cherif 1999's own choices.

use crate::in_hand_methods::scene;
use crate::places::repository;
use crate::queries::Queries;
use crate::solids::Folder;
use nalgebra::UnitQuaternion;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::{Point, Vector};
use regrasp_plan::Plan;
use regrasp_plan::check::CheckSettings;
use regrasp_plan::plan::{ContactMode, Segment};
use regrasp_planners::{Failure, FailureKind, TrackingSettings, plan_tracking};
use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, TrackingQuery, load_scene};
use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Work for one plan.
const WORK: u64 = 4_000_000;

fn planned(
    loaded: &LoadedScene,
    query: &TrackingQuery,
    settings: &TrackingSettings,
    seed: u64,
) -> Result<Plan, Failure> {
    let plan = plan_tracking(&loaded.view(), query, settings, seed, &Budget::work(WORK), &|_| {})?;
    let report = loaded.judge(query, &plan, &CheckSettings::default());
    assert!(report.accepted(), "seed {seed}: {:?}", report.violations.first());
    Ok(plan)
}

/// The goal is the start, turned by `angle` about an axis that the seed draws.
fn turned(loaded: &LoadedScene, seed: u64, angle: f64) -> TrackingQuery {
    let mut query = loaded.tracking(seed);
    let axis = Vector::from(Rng::keyed(seed, "test_goal_axis", 0).direction());
    let start = query.world_from_object_start.rotation;
    query.world_from_object_goal.rotation = UnitQuaternion::from_scaled_axis(axis * angle) * start;
    query
}

/// How many faces the fingertips are on in a plan, summed over the fingers.
fn n_faces(plan: &Plan) -> usize {
    let face = |normal: [f64; 3]| normal.map(|x| (1e3 * x).round() as i64);
    let n_fingers = plan.segments[0].waypoints[0].contacts.len();
    let faces = |finger: usize| -> BTreeSet<[i64; 3]> {
        let waypoints = plan.segments.iter().flat_map(|segment| &segment.waypoints);
        waypoints.map(|waypoint| face(waypoint.contacts[finger].normal_in_object.unwrap())).collect()
    };
    (0..n_fingers).map(|finger| faces(finger).len()).sum()
}

#[test]
fn random_turns_are_solved_from_start_grasps_that_know_nothing_of_them() {
    for name in ["football_any_start.toml", "diamond_any_start.toml"] {
        let loaded = scene(name);
        for (seed, degrees) in [(0, 30.0f64), (1, 30.0), (2, 60.0)] {
            let query = turned(&loaded, seed, degrees.to_radians());
            planned(&loaded, &query, &TrackingSettings::default(), seed)
                .unwrap_or_else(|failure| panic!("{name}, seed {seed}: {failure}"));
        }
    }
}

/// Cherif 1999, appendix A: where the fingers reach too little to follow, they have to roll from face to face.
#[test]
fn a_turn_beyond_reach_takes_fingertips_over_edges() {
    let loaded = scene("icosahedron.toml");
    let query = loaded.tracking(0);
    let with = TrackingSettings::default().with_forces_of_cherif_1999();
    let without = TrackingSettings { face_changes: false, ..with.clone() };
    for seed in [1, 2, 3] {
        let plan = planned(&loaded, &query, &with, seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        assert!(n_faces(&plan) > 4, "seed {seed}: no fingertip left its face");
        // Without edges not even a quarter of the work leads there with most seeds.
        let budget = Budget::work(WORK / 8);
        let failure = plan_tracking(&loaded.view(), &query, &without, seed, &budget, &|_| {}).unwrap_err();
        assert!(failure.nearest_miss.is_some_and(|miss| miss.angle_left > 0.1), "seed {seed}");
    }
}

/// Steps are long where nothing speaks against it, which leaves fewer waypoints; those of Cherif 1999 are all equal.
#[test]
fn long_steps_are_halved_where_they_would_be_wrong() {
    let spans = |plan: &Plan| -> Vec<f64> {
        let times =
            |segment: &Segment| -> Vec<f64> { segment.waypoints.iter().map(|waypoint| waypoint.time).collect() };
        let of = |times: Vec<f64>| times.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>();
        plan.segments.iter().map(times).flat_map(of).collect()
    };
    let n_waypoints = |plan: &Plan| -> usize { plan.segments.iter().map(|segment| segment.waypoints.len()).sum() };
    let loaded = scene("football_any_start.toml");
    let query = turned(&loaded, 1, 0.5);
    let default = TrackingSettings::default();
    let short = TrackingSettings { longest_step: default.time_step, ..default.clone() };
    let [long, short] = [&default, &short].map(|settings| planned(&loaded, &query, settings, 1).unwrap());
    assert!(4 * n_waypoints(&long) < 3 * n_waypoints(&short), "{} {}", n_waypoints(&long), n_waypoints(&short));
    assert!(spans(&long).iter().any(|span| *span > 0.39));
    // Before it was counted how moving tips twist half-way, plans of these seeds were rejected.
    let loaded = scene("diamond_any_start.toml");
    let one = TrackingSettings { start_grasps: 1, ..default.clone() };
    for seed in [44, 70] {
        planned(&loaded, &loaded.tracking(seed), &one, seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
    }
    // A folded object: tips that come down from its edges slide in short steps. Longer ones were rejected.
    let loaded = scene("icosahedron.toml");
    let query = loaded.tracking(0);
    for seed in [1, 5, 12] {
        planned(&loaded, &query, &default, seed).unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
    }
    let backwards = TrackingSettings { longest_step: 0.05, ..default };
    assert!(backwards.validate().unwrap_err().contains("longest_step"));
}

/// A search that is begun anew begins from another start grasp, unless the settings keep the first.
#[test]
fn other_start_grasps_help_where_the_first_does_not() {
    let loaded = scene("diamond_any_start.toml");
    let query = loaded.tracking(3);
    let of_first = |settings: &TrackingSettings| {
        let mut still = query.clone();
        still.world_from_object_goal = still.world_from_object_start;
        planned(&loaded, &still, settings, 3).unwrap().segments[0].waypoints[0].joints.clone()
    };
    let one = TrackingSettings { start_grasps: 1, ..TrackingSettings::default() };
    let several = TrackingSettings::default();
    let budget = Budget::work(WORK / 10);
    let failure = plan_tracking(&loaded.view(), &query, &one, 3, &budget, &|_| {}).unwrap_err();
    assert!(failure.statistics.restarts > 0, "{failure}");
    let plan = planned(&loaded, &query, &several, 3).unwrap_or_else(|failure| panic!("{failure}"));
    assert!(plan.statistics.restarts > 0 && plan.statistics.work < WORK / 10);
    assert_eq!(of_first(&one), of_first(&several));
    assert_ne!(plan.segments[0].waypoints[0].joints, of_first(&several));
    assert!(TrackingSettings { start_grasps: 0, ..several }.validate().unwrap_err().contains("start_grasps"));
}

/// Fingers that also move while the object does.
fn also_moving(plan: &Plan) -> usize {
    let slides = |segment: &&Segment| segment.waypoints[0].contacts.iter().any(|c| c.mode == ContactMode::Sliding);
    plan.segments.iter().filter(slides).map(|segment| segment.also_moving.len()).max().unwrap_or(0)
}

#[test]
fn three_fingers_rest_where_fewer_may_not() {
    let loaded = scene("football_any_start.toml");
    let three = TrackingSettings { fewer_rest: false, ..TrackingSettings::default() };
    let query = turned(&loaded, 0, 0.15);
    for seed in 0..3 {
        if let Ok(plan) = planned(&loaded, &query, &three, seed) {
            assert_eq!(also_moving(&plan), 0, "seed {seed}");
        }
    }
    let plan = planned(&loaded, &query, &TrackingSettings::default(), 0).unwrap();
    assert_eq!(also_moving(&plan), 1, "from a start grasp of its own the planner first tries with two");
}

/// Weight 1, no patience, roles at random, local plans of at most twice the time to a sub-goal, three fingers that rest.
#[test]
fn the_choices_of_the_paper_are_settings() {
    let loaded = scene("football.toml");
    let mut query = loaded.tracking(0);
    let start = query.world_from_object_start.rotation;
    query.world_from_object_goal.rotation = UnitQuaternion::from_scaled_axis(Vector::z() * 0.1) * start;
    let plan =
        planned(&loaded, &query, &TrackingSettings::of_cherif_1999(), 0).unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!((plan.statistics.restarts, also_moving(&plan)), (0, 0));
}

/// Cherif 1999, sec. 4: plans inside ranges of orientations obey the same laws.
#[test]
fn ranges_of_orientations_are_a_setting() {
    let ranges = TrackingSettings { range_coverage: true, ..TrackingSettings::of_cherif_1999() };
    let loaded = scene("football.toml");
    let mut query = loaded.tracking(0);
    let start = query.world_from_object_start.rotation;
    query.world_from_object_goal.rotation = UnitQuaternion::from_scaled_axis(Vector::z() * 0.1) * start;
    let plan = planned(&loaded, &query, &ranges, 0).unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(also_moving(&plan), 0);
    assert_eq!(plan, planned(&loaded, &query, &ranges, 0).unwrap());
}

/// Sec. 4.1.1: the start grasp of the diamond has all its normals in one plane. No three fingertips fix its position, so no range has
/// any other orientation, and no sub-goal is tried.
#[test]
fn a_grasp_with_normals_in_one_plane_has_no_range() {
    let loaded = scene("diamond.toml");
    let query = loaded.tracking(0);
    let plan =
        planned(&loaded, &query, &TrackingSettings::of_cherif_1999(), 0).unwrap_or_else(|failure| panic!("{failure}"));
    let normals: Vec<Vector> =
        plan.segments[0].waypoints[0].contacts.iter().map(|c| Vector::from(c.normal_in_object.unwrap())).collect();
    for out in 0..4 {
        let three: Vec<&Vector> = (0..4).filter(|finger| *finger != out).map(|finger| &normals[finger]).collect();
        assert!(three[0].dot(&three[1].cross(three[2])).abs() < 1e-9, "{normals:?}");
    }
    let ranges = TrackingSettings { range_coverage: true, ..TrackingSettings::of_cherif_1999() };
    let failure = plan_tracking(&loaded.view(), &query, &ranges, 0, &Budget::work(WORK), &|_| {}).unwrap_err();
    let reasons: Vec<&str> = failure.causes.iter().map(|cause| cause.reason.as_str()).collect();
    assert_eq!(reasons, ["sub-goal outside the ranges of all resting fingers"], "{failure}");
}

#[test]
fn ranges_are_refused_where_fewer_than_three_fingers_rest() {
    let ranges = TrackingSettings { range_coverage: true, ..TrackingSettings::of_cherif_1999() };
    assert!(TrackingSettings { fewer_rest: true, ..ranges.clone() }.validate().is_err());
    assert!(TrackingSettings { resting_fingers: 2, ..ranges.clone() }.validate().is_err());
    let loaded = scene("three_fingertips.toml");
    let query = loaded.tracking(0);
    let failure = plan_tracking(&loaded.view(), &query, &ranges, 0, &Budget::work(1000), &|_| {}).unwrap_err();
    assert!(failure.message.contains("range_coverage") && failure.statistics.work == 0, "{failure}");
}

/// A regular dodecahedron whose corners are rounded to `digits` decimals, as a file of the kind obj. Its faces are three triangles each,
/// which then lie not quite in one plane, and here and there fold inwards.
fn rounded_dodecahedron(digits: usize) -> String {
    let golden = (1.0 + 5.0f64.sqrt()) / 2.0;
    let signs = [-1.0, 1.0];
    let mut corners: Vec<Point> = Vec::new();
    for (a, b) in signs.into_iter().flat_map(|a| signs.map(|b| (a, b))) {
        corners.extend(signs.map(|c| Point::new(a, b, c)));
        let rim = Vector::new(0.0, a / golden, b * golden);
        corners.extend([rim, Vector::new(rim.y, rim.z, rim.x), Vector::new(rim.z, rim.x, rim.y)].map(Point::from));
    }
    corners.iter_mut().for_each(|corner| *corner *= 0.055);
    let mut text = String::new();
    for p in &corners {
        writeln!(text, "v {:.digits$} {:.digits$} {:.digits$}", p.x, p.y, p.z).unwrap();
    }
    // Faces look where the corners of an icosahedron are.
    for (a, b) in signs.into_iter().flat_map(|a| signs.map(|b| (a, b))) {
        let axis = Vector::new(0.0, a * golden, b);
        for axis in [axis, Vector::new(axis.y, axis.z, axis.x), Vector::new(axis.z, axis.x, axis.y)] {
            let far = corners.iter().map(|p| p.coords.dot(&axis)).fold(0.0, f64::max);
            let mut face: Vec<usize> =
                (0..corners.len()).filter(|&i| corners[i].coords.dot(&axis) > far - 1e-6).collect();
            let x = corners[face[0]].coords - axis * (far / axis.norm_squared());
            let y = axis.cross(&x) / axis.norm();
            let angle = |i: usize| corners[i].coords.dot(&y).atan2(corners[i].coords.dot(&x));
            face.sort_by(|&i, &j| angle(i).total_cmp(&angle(j)));
            for i in 1..face.len() - 1 {
                writeln!(text, "f {} {} {}", face[0] + 1, face[i] + 1, face[i + 1] + 1).unwrap();
            }
        }
    }
    text
}

/// An ellipsoid of two axes in rings of `sides` corners, as a file of the kind obj.
fn ellipsoid_in_rings(rings: usize, sides: usize) -> String {
    let mut text = String::from("v 0 0 -0.075\nv 0 0 0.075\n");
    for ring in 1..rings {
        let height = PI * ring as f64 / rings as f64 - 0.5 * PI;
        for side in 0..sides {
            let (sin, cos) = (TAU * side as f64 / sides as f64).sin_cos();
            let width = 0.09 * height.cos();
            writeln!(text, "v {:.9} {:.9} {:.9}", width * cos, width * sin, 0.075 * height.sin()).unwrap();
        }
    }
    let corner = |ring: usize, side: usize| 3 + (ring - 1) * sides + side % sides;
    for side in 0..sides {
        writeln!(text, "f 1 {} {}", corner(1, side + 1), corner(1, side)).unwrap();
        writeln!(text, "f 2 {} {}", corner(rings - 1, side), corner(rings - 1, side + 1)).unwrap();
        for ring in 1..rings - 1 {
            let [a, b] = [corner(ring, side), corner(ring, side + 1)];
            writeln!(text, "f {a} {b} {} {}", corner(ring + 1, side + 1), corner(ring + 1, side)).unwrap();
        }
    }
    text
}

/// As meshes come: written with nine decimals, with six as most exporters write, and with dents of 0.03 mm.
#[test]
fn meshes_as_they_come_are_turned_and_dented_ones_refused() {
    let folder = Folder::new("rounded");
    let load = || load_scene(&folder.0.join("scene.toml"), &LoadOptions::default()).unwrap();
    let bundled = repository().join("scenes/diamond_any_start.toml");
    let text = std::fs::read_to_string(bundled).unwrap();
    let hands = format!("{}/assets/hands", repository().display());
    let mesh = text.lines().find(|line| line.starts_with("mesh = ")).unwrap();
    let text = text.replace("../assets/hands", &hands).replace(mesh, "mesh = { file = \"solid.obj\" }");
    folder.write("scene.toml", &text);
    for digits in [9, 6, 4] {
        folder.write("solid.obj", &rounded_dodecahedron(digits));
        let loaded = load();
        for seed in [0, 1] {
            let query = turned(&loaded, seed, 1.0);
            planned(&loaded, &query, &TrackingSettings::default(), seed)
                .unwrap_or_else(|failure| panic!("{digits} decimals, seed {seed}: {failure}"));
        }
    }
    // Round objects of flat triangles, also of so many that their hull is made a little too large.
    for (rings, sides, seeds) in [(20, 40, 3), (120, 170, 1)] {
        folder.write("solid.obj", &ellipsoid_in_rings(rings, sides));
        let loaded = load();
        for seed in 0..seeds {
            planned(&loaded, &turned(&loaded, seed, 1.0), &TrackingSettings::default(), seed)
                .unwrap_or_else(|failure| panic!("{rings} rings, seed {seed}: {failure}"));
        }
    }
    // A corner that is pushed in by more than that is a dent.
    let text = rounded_dodecahedron(9).replacen("v -0.055000000 -0.055000000 -0.055000000", "v -0.05 -0.05 -0.05", 1);
    folder.write("solid.obj", &text);
    let loaded = load();
    let Err(failure) = planned(&loaded, &loaded.tracking(0), &TrackingSettings::default(), 0) else {
        panic!("the dent was not seen");
    };
    assert_eq!(failure.kind, FailureKind::Impossible, "{failure}");
    assert!(failure.to_string().contains("not convex: it has a dent of"), "{failure}");
}
