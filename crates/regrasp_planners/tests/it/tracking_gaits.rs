//! Tracking by fingers of real hands, alone and with relocations through the air, against the checker and closed forms.

use crate::in_hand_methods::scene;
use crate::places::{repository, shared_models};
use crate::queries::Queries;
use regrasp_base::{Budget, Rng};
use regrasp_geometry::{Pose, Vector};
use regrasp_mutations::mutants;
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Violation, ViolationKind, check};
use regrasp_plan::plan::{ContactMode, Segment, SegmentKind};
use regrasp_planners::tracking::TrackingMethod;
use regrasp_planners::{Failure, TrackingSettings, plan_tracking};
use regrasp_robot::import::{LoadOptions, ResolveOptions};
use regrasp_scene::{LoadedScene, TrackingQuery, load_scene};
use std::collections::BTreeSet;

/// Three fingers rest, with the forces of Cherif 1999. With the defaults the sphere needs no gaits, and these tests are about gaits.
fn three_rest(method: TrackingMethod) -> TrackingSettings {
    TrackingSettings { method, fewer_rest: false, ..TrackingSettings::default() }.with_forces_of_cherif_1999()
}

fn plan_with(
    loaded: &LoadedScene,
    query: &TrackingQuery,
    method: TrackingMethod,
    seed: u64,
    work: u64,
) -> Result<Plan, Failure> {
    plan_tracking(&loaded.view(), query, &three_rest(method), seed, &Budget::work(work), &|_| {})
}

/// Queries with other goals: 8 degrees about each axis, either way.
fn small_turns(loaded: &LoadedScene) -> Vec<TrackingQuery> {
    let turned = |axis: Vector| {
        let mut query = loaded.tracking(0);
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(axis * 8f64.to_radians());
        query.world_from_object_goal.rotation = turn * query.world_from_object_start.rotation;
        query
    };
    [Vector::x(), Vector::y(), Vector::z()].into_iter().flat_map(|axis| [turned(axis), turned(-axis)]).collect()
}

fn accepted(loaded: &LoadedScene, query: &TrackingQuery, plan: &Plan) {
    let report = loaded.judge(query, plan, &CheckSettings::default());
    assert!(report.accepted(), "seed {}: {:?}", plan.seed, report.violations.first());
    assert!(report.max_sliding_force_error.unwrap() < 1e-9);
    let is_mixed = plan.segments.iter().any(|segment| segment.kind == SegmentKind::Regrasp);
    match report.min_margin {
        Some(margin) => assert!(is_mixed && margin >= plan.promises.required_margin - 1e-9),
        None => assert!(!is_mixed && plan.promises.required_margin == 0.0),
    }
}

/// The largest angle between the turn of a step of a tracking segment and the normal of the rolling finger's contact.
fn largest_off_axis(plan: &Plan, segment: &Segment) -> f64 {
    let rolling = plan.fingers.iter().position(|name| Some(name) == segment.rolling_finger.as_ref()).unwrap();
    let mut largest: f64 = 0.0;
    for pair in segment.waypoints.windows(2) {
        let [from, to] = [0, 1].map(|k| Pose::from(&pair[k].world_from_object));
        let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
        let normal = from.rotation * Vector::from(pair[0].contacts[rolling].normal_in_object.unwrap());
        if turn.norm() > 1e-6 {
            largest = largest.max(turn.cross(&normal).norm() / turn.norm());
        }
    }
    largest
}

/// Three resting balls leave a sphere its centre; where it does not slip on one of them it turns about the normal there. The
/// moving finger has too few joints to choose how its tip turns and follows without sliding.
#[test]
fn a_sphere_turns_about_the_contact_of_the_rolling_finger() {
    let loaded = scene("tracking_sphere_wide.toml");
    let mut n_solved = 0;
    for query in small_turns(&loaded) {
        let planned = plan_with(&loaded, &query, TrackingMethod::Tracking, 0, 300_000);
        let Ok(plan) = planned else { continue };
        n_solved += 1;
        assert_eq!((plan.method.as_str(), plan.statistics.relocations), ("tracking", 0));
        accepted(&loaded, &query, &plan);
        let start = Pose::from(&plan.start);
        for segment in &plan.segments {
            assert_eq!(segment.kind, SegmentKind::Tracking);
            assert!(largest_off_axis(&plan, segment) < 1e-6, "{}", largest_off_axis(&plan, segment));
            let moving = plan.fingers.iter().position(|name| Some(name) == segment.moving_finger.as_ref()).unwrap();
            for waypoint in &segment.waypoints {
                let pose = Pose::from(&waypoint.world_from_object);
                assert!((pose.translation.vector - start.translation.vector).norm() < 1e-9);
                assert_eq!(waypoint.contacts[moving].mode, ContactMode::Rolling);
            }
        }
    }
    assert!(n_solved >= 1, "{n_solved} of 6 turns by tracking alone");
}

/// All seeds are solved and accepted, the same twice, with fingers through the air between tracking.
fn is_turned_with_gaits(loaded: &LoadedScene, seeds: u64) {
    for seed in 0..seeds {
        let query = loaded.tracking(seed);
        let plan = plan_with(loaded, &query, TrackingMethod::TrackingAndGaiting, seed, 20_000_000)
            .unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        accepted(loaded, &query, &plan);
        assert_eq!(plan.method, "tracking+gaiting");
        let n_of = |kind: SegmentKind| plan.segments.iter().filter(|segment| segment.kind == kind).count() as u64;
        assert!(n_of(SegmentKind::Regrasp) > 0 && n_of(SegmentKind::Tracking) > 0);
        assert_eq!(n_of(SegmentKind::Regrasp), plan.statistics.relocations);
        let again = plan_with(loaded, &query, TrackingMethod::TrackingAndGaiting, seed, 20_000_000).unwrap();
        assert_eq!(regrasp_plan::format::to_json(&plan), regrasp_plan::format::to_json(&again), "seed {seed}");
    }
}

#[test]
fn the_wide_hand_turns_a_sphere_by_tracking_and_gaits_where_tracking_alone_does_not() {
    let loaded = scene("tracking_sphere_wide.toml");
    is_turned_with_gaits(&loaded, 4);
    let query = loaded.tracking(0);
    let failure = plan_with(&loaded, &query, TrackingMethod::Tracking, 0, 500_000).unwrap_err();
    let miss = failure.nearest_miss.as_ref().expect("the start is the nearest");
    assert!(miss.angle_left < 90f64.to_radians(), "{failure}");
}

/// Fingers that slide while the object moves, and that move, in the tracking segments of a plan.
fn sliding_and_moving(plan: &Plan) -> BTreeSet<(usize, usize)> {
    let tracked = plan.segments.iter().filter(|segment| segment.kind == SegmentKind::Tracking);
    let counts = tracked.map(|segment| {
        let contacts = &segment.waypoints[0].contacts;
        let n_sliding = contacts.iter().filter(|contact| contact.mode == ContactMode::Sliding).count();
        (n_sliding, 1 + segment.also_moving.len())
    });
    counts.collect()
}

/// Two fingers rest by default, and forces keep a margin.
#[test]
fn with_the_defaults_tracking_alone_turns_the_sphere_of_the_wide_hand() {
    let loaded = scene("tracking_sphere_wide.toml");
    for seed in 0..3 {
        let query = loaded.tracking(seed);
        let settings = TrackingSettings::default();
        let plan = plan_tracking(&loaded.view(), &query, &settings, seed, &Budget::work(2_000_000), &|_| {})
            .unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        accepted(&loaded, &query, &plan);
        assert_eq!((plan.method.as_str(), plan.statistics.relocations), ("tracking", 0));
    }
}

/// Where two fingers rest one slides, and the others stick.
#[test]
fn two_fingers_of_the_wide_hand_may_move_at_a_time() {
    let loaded = scene("tracking_sphere_wide.toml");
    let method = TrackingMethod::TrackingAndGaiting;
    let settings = TrackingSettings { method, resting_fingers: 2, ..TrackingSettings::default() };
    for seed in 0..3 {
        let query = loaded.tracking(seed);
        let budget = Budget::work(20_000_000);
        let plan = plan_tracking(&loaded.view(), &query, &settings, seed, &budget, &|_| {})
            .unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        accepted(&loaded, &query, &plan);
        assert_eq!(sliding_and_moving(&plan), BTreeSet::from([(1, 2)]), "seed {seed}");
    }
    for resting_fingers in [0, 1, 4] {
        let told = TrackingSettings { resting_fingers, ..TrackingSettings::default() }.validate().unwrap_err();
        assert!(told.contains("resting_fingers"), "{told}");
    }
}

#[test]
fn six_fingers_turn_a_sphere_by_tracking_alone() {
    let loaded = scene("tracking_sphere_six.toml");
    for seed in 0..3 {
        let query = loaded.tracking(seed);
        let plan = plan_with(&loaded, &query, TrackingMethod::Tracking, seed, 20_000_000)
            .unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        accepted(&loaded, &query, &plan);
        assert_eq!(sliding_and_moving(&plan), BTreeSet::from([(2, 3)]), "seed {seed}");
    }
}

#[test]
fn the_allegro_hand_turns_a_sphere_by_tracking_and_gaits() {
    let Some(models) = shared_models() else { return };
    let packages = vec![("models".into(), models)];
    let options = LoadOptions { resolve: ResolveOptions { packages, search_paths: vec![] }, ..LoadOptions::default() };
    let path = repository().join("scenes/allegro/tracking_sphere32_z.toml");
    let loaded = load_scene(&path, &options).unwrap_or_else(|error| panic!("{error}"));
    is_turned_with_gaits(&loaded, 3);
}

/// Plans with relocations between tracking, broken in each known way, are rejected for a reason that fits.
#[test]
fn mutants_of_mixed_plans_are_rejected() {
    let loaded = scene("tracking_sphere_wide.toml");
    let query = loaded.tracking(1);
    let plan = plan_with(&loaded, &query, TrackingMethod::TrackingAndGaiting, 1, 20_000_000).unwrap();
    let (mut names, mut wrong) = (BTreeSet::new(), Vec::new());
    for mutant in mutants(&plan, loaded.manipulation(), &mut Rng::keyed(6, "mixed_mutants", 0)) {
        let judged_in = mutant.scene.as_ref().unwrap_or(&loaded.scene);
        let report =
            check((judged_in, &loaded.state), Some(&query.clone().into()), &mutant.plan, &CheckSettings::default());
        names.insert(mutant.name);
        if !report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind)) {
            let found = report.violations.first().map(|violation| violation.kind);
            wrong.push(format!("{}: wanted one of {:?}, found {found:?}", mutant.name, mutant.expected));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    for name in
        ["relocated finger tracks on from where it was", "sliding said to be rolling", "relocation without lift"]
    {
        assert!(names.contains(name), "{name} was never made");
    }
    assert!(names.len() > 100, "{}", names.len());
}

/// Where fingers have a reach they keep to it in the air too: the checker looks between waypoints as well, where joints go straight.
#[test]
fn fingers_keep_to_their_reach_in_the_air() {
    let mut loaded = scene("tracking_sphere_wide.toml");
    let query = loaded.tracking(0);
    let plan = |loaded: &LoadedScene| plan_with(loaded, &query, TrackingMethod::TrackingAndGaiting, 0, 20_000_000);
    let free = plan(&loaded).unwrap();
    let out_of_reach = |loaded: &LoadedScene| -> Vec<SegmentKind> {
        let report = loaded.judge(&query, &free, &CheckSettings::default());
        let is_reach = |violation: &&Violation| violation.kind == ViolationKind::OutOfReach;
        let segments = report.violations.iter().filter(is_reach).filter_map(|violation| violation.at);
        segments.map(|at| free.segments[at.segment].kind).collect()
    };
    // A reach that the plan made without one exceeds, in the air at first.
    let reaches = (1..100).rev().map(|k| 1e-3 * f64::from(k));
    let exceeded = reaches.into_iter().find(|&reach| {
        loaded.scene.hands[0].reach = Some(reach);
        !out_of_reach(&loaded).is_empty()
    });
    loaded.scene.hands[0].reach = exceeded;
    assert!(out_of_reach(&loaded).contains(&SegmentKind::Regrasp), "{exceeded:?}");
    let kept = plan(&loaded).unwrap_or_else(|failure| panic!("{exceeded:?}: {failure}"));
    accepted(&loaded, &query, &kept);
    assert!(kept.statistics.relocations > 0);
}
