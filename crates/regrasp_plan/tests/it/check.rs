//! The checker accepts a plan that is good by construction, and says what it cannot judge.

use crate::sample::{self, judge, kinds};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, TriangleMesh};
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Level, Moment, ViolationKind, check, check_files};
use regrasp_plan::format::to_json;
use regrasp_robot::LinkId;
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{GraspRequest, InHandQuery};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

#[test]
fn a_good_plan_is_accepted() {
    let scene = sample::scene();
    let plan = sample::plan(&scene);
    let report = judge(&scene, &plan);
    assert!(report.accepted(), "{report:#?}");
    assert!(report.min_margin.unwrap() > 0.005);
    assert!(report.max_contact_error < 0.1e-3);
}

#[test]
fn a_good_plan_with_a_free_finger_is_accepted() {
    let scene = sample::scene();
    let plan = sample::plan_with_free_finger(&scene);
    let report = judge(&scene, &plan);
    assert!(report.accepted(), "{report:#?}");
    assert!(report.min_margin.unwrap() > 0.005);
}

/// The first link of a finger stands in the palm: what one joint connects may, and nothing else that the palm consists of.
#[test]
fn first_links_of_fingers_keep_off_what_the_hand_does_not_allow() {
    let mut scene = sample::scene();
    let hand = &mut scene.hands[0].hand;
    let first = (LinkId(0), LinkId(1));
    let knuckle = PlacedShape { parent_from_shape: Pose::identity(), shape: Shape::Sphere { radius: 0.012 } };
    Arc::make_mut(&mut hand.robot).links[first.1.0].collision.push(knuckle);
    let plan = sample::plan(&scene);
    assert!(judge(&scene, &plan).accepted());
    assert!(scene.hands[0].hand.allowed_pairs.remove(&first));
    assert_eq!(kinds(&judge(&scene, &plan)), [ViolationKind::Collision]);
}

#[test]
fn two_soft_fingers_hold_while_one_is_away_and_another_relocates() {
    let scene = sample::soft_scene();
    let plan = sample::plan_with_two_away(&scene);
    let report = judge(&scene, &plan);
    assert!(report.accepted(), "{report:#?}");
    // Hard ones do not.
    let kinds = kinds(&judge(&sample::scene(), &plan));
    assert!(kinds.contains(&ViolationKind::ClosureLost), "{kinds:?}");
    let fits = |kind: &ViolationKind| matches!(kind, ViolationKind::ClosureLost | ViolationKind::PromiseBroken);
    assert!(kinds.iter().all(fits), "{kinds:?}");
}

#[test]
fn a_free_finger_keeps_clear_of_the_object() {
    let scene = sample::scene();
    let plan = sample::plan_with_free_finger(&scene);
    let lifted = plan.segments.iter().position(|segment| segment.kind == regrasp_plan::SegmentKind::Transfer).unwrap();
    // Declared free from the start on, though it still touches: nothing else is wrong with that.
    let mut touching = plan.clone();
    let free = touching.segments[lifted].waypoints[0].contacts[1];
    touching.segments[0].waypoints[0].contacts[1] = free;
    assert_eq!(kinds(&judge(&scene, &touching)), [ViolationKind::Collision]);
    assert!(judge(&scene, &plan).accepted());
}

#[test]
fn a_finger_that_a_transfer_names_as_moving_is_judged_as_one_that_holds() {
    // So few waypoints that tips leave their contacts in between.
    let scene = sample::scene();
    let mut plan = sample::plan(&scene);
    let waypoints = &mut plan.segments[0].waypoints;
    waypoints.drain(1..waypoints.len() - 1);
    let off_tip = |plan: &Plan| {
        let violations = judge(&scene, plan).violations.into_iter();
        violations.filter(|violation| violation.kind == ViolationKind::ContactOffTip).collect::<Vec<_>>()
    };
    let found = off_tip(&plan);
    assert!(found.iter().any(|violation| violation.subjects == ["f0"]), "{found:?}");
    plan.segments[0].moving_finger = Some("f0".into());
    assert_eq!(off_tip(&plan), found);
    assert!(kinds(&judge(&scene, &plan)).contains(&ViolationKind::WrongMovingFinger));
}

#[test]
fn a_plan_of_another_scene_is_rejected_and_a_missing_scene_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.json");
    let plan = sample::plan(&sample::scene());
    std::fs::write(&path, to_json(&plan)).unwrap();
    let (options, settings) = (LoadOptions::default(), CheckSettings::default());
    let missing = check_files(&path, None, &options, &settings).unwrap_err().to_string();
    assert!(missing.contains("C420") && missing.contains("sample.scene") && missing.contains("--scene"), "{missing}");
    let other = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
    let checked = check_files(&path, Some(&other), &options, &settings).unwrap();
    let kinds = kinds(&checked.report);
    assert!(kinds.contains(&ViolationKind::InputHashMismatch) && kinds.contains(&ViolationKind::WrongScene));
    let mut escaping = plan.clone();
    escaping.inputs[0].name = "../secret.toml".into();
    std::fs::write(&path, to_json(&escaping)).unwrap();
    let refused = check_files(&path, None, &options, &settings).unwrap_err().to_string();
    assert!(refused.contains("not below"), "{refused}");
}

#[test]
fn a_plan_is_held_to_the_query() {
    let scene = sample::scene();
    let plan = sample::plan(&scene);
    let first = &plan.segments[0].waypoints[0];
    let points = first.contacts.iter().map(|c| c.point_in_object.unwrap().into()).collect::<Vec<_>>();
    let judge = |change: &dyn Fn(&mut InHandQuery)| {
        let mut query = sample::in_hand_query(&plan);
        change(&mut query);
        let settings = CheckSettings { level: Level::Geometry, ..CheckSettings::default() };
        let report = check((&scene, &sample::state(&scene)), Some(&query.into()), &plan, &settings);
        report.violations.iter().map(|violation| violation.kind).collect::<Vec<_>>()
    };
    assert!(judge(&|query| query.start_grasp = GraspRequest::Joints(first.joints.clone())).is_empty());
    assert!(judge(&|query| query.start_grasp = GraspRequest::Contacts(points.clone())).is_empty());
    let turned = |query: &mut InHandQuery| {
        query.world_from_object_goal.rotation *= nalgebra::UnitQuaternion::new(nalgebra::Vector3::x() * 1e-4)
    };
    assert_eq!(judge(&turned), [ViolationKind::GoalMismatch]);
    let other_joints =
        |query: &mut InHandQuery| query.start_grasp = GraspRequest::Joints(vec![0.0; first.joints.len()]);
    assert_eq!(judge(&other_joints), [ViolationKind::StartMismatch]);
    let other_contacts = |query: &mut InHandQuery| query.goal_grasp = GraspRequest::Contacts(points.clone());
    assert_eq!(judge(&other_contacts), [ViolationKind::GoalMismatch]);
}

/// A cube of half side `half` as twelve triangles.
fn cube_mesh(half: f64) -> Shape {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { half } else { -half };
        Point::new(side(0), side(1), side(2))
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Shape::Mesh(Arc::new(TriangleMesh::new((0..8).map(corner).collect(), triangles).unwrap()))
}

#[test]
fn a_contact_near_an_edge_is_reported() {
    let half_extents = nalgebra::Vector3::repeat(sample::OBJECT_RADIUS);
    a_contact_near_an_edge_of(Shape::Cuboid { half_extents });
    a_contact_near_an_edge_of(cube_mesh(sample::OBJECT_RADIUS));
}

fn a_contact_near_an_edge_of(shape: Shape) {
    let mut scene = sample::scene();
    scene.objects[0].shape = shape;
    scene.objects[0].edge_distance = 0.004;
    let mut plan = sample::plan(&scene);
    let r = sample::OBJECT_RADIUS;
    for (y, reported) in [(r - 0.005, false), (r - 0.003, true)] {
        let contact = &mut plan.segments[0].waypoints[0].contacts[0];
        (contact.point_in_object, contact.normal_in_object) = (Some([r, y, 0.0]), Some([1.0, 0.0, 0.0]));
        let report = check(
            (&scene, &sample::state(&scene)),
            None,
            &plan,
            &CheckSettings { most_per_kind: 1000, ..CheckSettings::default() },
        );
        let found = report.violations.iter().any(|v| {
            v.kind == ViolationKind::ContactTooNearEdge && v.at == Some(Moment::at(0, 0)) && v.subjects == ["f0"]
        });
        assert_eq!(found, reported);
    }
}

/// A leap is rejected for what it is, and motion bounds do not follow it for minutes: a hundredth of the work that is allowed is enough.
#[test]
fn leaps_are_rejected_at_once_and_the_report_says_what_was_left_out() {
    let scene = sample::scene();
    let plan = sample::plan(&scene);
    for value in [20.0, 1e3, 1e4, 1e6, -1e6] {
        let mut leaping = plan.clone();
        leaping.segments[1].waypoints[2].joints[2] = value;
        let most_work = CheckSettings::default().most_work / 100;
        let settings = CheckSettings { level: Level::Geometry, most_work, ..CheckSettings::default() };
        let report = check((&scene, &sample::state(&scene)), Some(&sample::query(&leaping)), &leaping, &settings);
        let kinds = kinds(&report);
        for kind in [ViolationKind::JointLimit, ViolationKind::JointJump] {
            assert!(kinds.contains(&kind), "{value}: {kinds:?}");
        }
        assert!(!report.accepted() && report.left_out.len() == 1, "{:?}", report.left_out);
        assert!(report.left_out[0].starts_with("motion between waypoints: segment 1"), "{:?}", report.left_out);
    }
    // The object may not leap either.
    let mut leaping = plan.clone();
    leaping.segments[0].waypoints[1].world_from_object.position[0] = 1e6;
    let report = judge(&scene, &leaping);
    assert!(kinds(&report).contains(&ViolationKind::JointJump) && report.left_out.len() == 1, "{report:?}");
    assert!(judge(&scene, &plan).left_out.is_empty());
}

/// A plan that asks for more work than the checker does is not accepted, whatever is right with it so far.
#[test]
fn what_is_cut_by_the_work_limit_is_not_accepted() {
    let scene = sample::scene();
    let plan = sample::plan(&scene);
    let with = |most_work: u64| {
        let settings = CheckSettings { level: Level::Geometry, most_work, ..CheckSettings::default() };
        check((&scene, &sample::state(&scene)), None, &plan, &settings)
    };
    let whole = with(CheckSettings::default().most_work);
    assert!(whole.accepted(), "{whole:?}");
    // By a hundredth of the limit this plan is judged whole.
    assert_eq!(with(CheckSettings::default().most_work / 100), whole);
    for most_work in [0, 1, 100, 1000] {
        let report = with(most_work);
        assert_eq!(kinds(&report), [ViolationKind::NotJudged], "{report:?}");
        assert!(!report.accepted() && report.left_out.len() == 1, "{:?}", report.left_out);
    }
}

/// The clock can only cut a check, and the report says so.
#[test]
fn what_is_cut_by_the_deadline_is_not_accepted() {
    let scene = sample::scene();
    let plan = sample::plan(&scene);
    let by = |deadline: Instant| {
        let settings = CheckSettings { level: Level::Geometry, deadline: Some(deadline), ..CheckSettings::default() };
        check((&scene, &sample::state(&scene)), None, &plan, &settings)
    };
    let now = Instant::now();
    let late = by(now);
    assert_eq!(kinds(&late), [ViolationKind::NotJudged], "{late:?}");
    assert!(!late.accepted() && late.left_out[0].contains("time limit"), "{:?}", late.left_out);
    let in_time = by(now + Duration::from_secs(3600));
    let settings = CheckSettings { level: Level::Geometry, ..CheckSettings::default() };
    assert_eq!(in_time, check((&scene, &sample::state(&scene)), None, &plan, &settings));
}

/// One definition of relocations, counted from the segments: a finger lands. What a file says of itself does not count.
#[test]
fn relocations_are_landings() {
    let scene = sample::scene();
    let mut plan = sample::plan_with_free_finger(&scene);
    let regrasps = plan.segments.iter().filter(|segment| segment.kind == regrasp_plan::SegmentKind::Regrasp);
    let lands = |segment: &&regrasp_plan::Segment| {
        let (first, last) = (&segment.waypoints[0], segment.waypoints.last().unwrap());
        (0..plan.fingers.len()).any(|f| {
            last.contacts[f].holds() && {
                !first.contacts[f].holds() || first.contacts[f].point_in_object != last.contacts[f].point_in_object
            }
        })
    };
    let (n_regrasps, n_landings) = (regrasps.clone().count(), regrasps.filter(lands).count() as u64);
    plan.statistics.relocations = 99;
    assert_eq!(plan.n_relocations(), n_landings);
    assert!(n_landings < n_regrasps as u64, "a finger lifts off and stays free");
}
