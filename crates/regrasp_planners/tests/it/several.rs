//! Scenes of several hands: every hand plans in its own frame, plans are in the world, and what rests is in the way.

use crate::places::repository;
use crate::two_hands::SCENE;
use regrasp_base::Budget;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::Plan;
use regrasp_plan::check::{CheckSettings, Report, ViolationKind, check};
use regrasp_planners::in_hand::validate_once;
use regrasp_planners::{Failure, FailureKind, PlannerSettings, plan};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{HandView, LoadedScene, Query, load_scene};

fn load(text: &str) -> LoadedScene {
    let folder = tempfile::tempdir().unwrap();
    let hand = repository().join("assets/hands/wide_four_finger/hand.toml").canonicalize().unwrap();
    let path = folder.path().join("two_hands.toml");
    std::fs::write(&path, text.replace("\"hand.toml\"", &format!("{:?}", hand.display().to_string()))).unwrap();
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn plan_for(loaded: &LoadedScene, query: &Query, seed: u64) -> Result<Plan, Failure> {
    let world = (&loaded.scene, &loaded.state);
    plan(world, query, &PlannerSettings::default(), seed, &Budget::work(3_000_000), &|_| {})
}

fn judge(loaded: &LoadedScene, query: &Query, plan: &Plan) -> Report {
    check((&loaded.scene, &loaded.state), Some(query), plan, &CheckSettings::default())
}

fn collides(report: &Report) -> bool {
    report.violations.iter().any(|violation| violation.kind == ViolationKind::Collision)
}

#[test]
fn both_hands_plan_for_their_objects_and_the_plans_are_in_the_world() {
    let loaded = load(SCENE);
    for seed in 0..3 {
        for task in &loaded.tasks {
            let what = format!("{}, seed {seed}", task.name);
            let query = task.query(seed);
            let plan = plan_for(&loaded, &query, seed).unwrap_or_else(|failure| panic!("{what}: {failure}"));
            let report = judge(&loaded, &query, &plan);
            assert!(report.accepted(), "{what}: {:#?}", report.violations);
            // The plan says where the object is in the world, whichever hand holds it.
            let first = Pose::from(&plan.segments[0].waypoints[0].world_from_object);
            let off = (first.translation.vector - query.start().translation.vector).norm();
            assert!(off < 1e-9 && first.rotation.angle_to(&query.start().rotation) < 1e-7, "{what}: {first}");
            let gravity = plan.promises.forces.as_ref().and_then(|forces| forces.gravity_in_world).map(Vector::from);
            assert!((gravity.unwrap() - Vector::new(0.0, 0.0, -9.80665)).norm() < 1e-12, "{what}: {gravity:?}");
            let view = HandView::of(&loaded.manipulation_of(task));
            assert_eq!(validate_once(&view, &plan, &PlannerSettings::default().in_hand), Ok(()), "{what}");
            assert!(plan == plan_for(&loaded, &query, seed).unwrap(), "{what}: another plan the second time");
        }
    }
    // An answer of one hand is none of the other one.
    let queries: Vec<Query> = loaded.tasks.iter().map(|task| task.query(0)).collect();
    let plan = plan_for(&loaded, &queries[1], 0).unwrap();
    assert!(!judge(&loaded, &queries[0], &plan).accepted());
}

/// Each change puts something into the left hand: the other object, the support, an obstacle and the right hand.
#[test]
fn what_rests_is_in_the_way_of_the_planner_and_of_the_checker() {
    let loaded = load(SCENE);
    let query = loaded.tasks[1].query(0);
    let good = plan_for(&loaded, &query, 0).unwrap();
    assert!(judge(&loaded, &query, &good).accepted());
    // A few millimetres into the box, on the side away from the palm.
    let inside = *query.start() * Pose::translation(0.0, 0.0, 0.03);
    type Change<'a> = (&'a str, Box<dyn Fn(&mut LoadedScene) + 'a>);
    let changes: [Change; 4] = [
        ("ball", Box::new(|loaded| loaded.state.world_from_objects[0] = inside)),
        ("table", Box::new(|loaded| loaded.scene.supports[0].body.placed.parent_from_shape = inside)),
        ("lamp", Box::new(|loaded| loaded.scene.obstacles[0].placed.parent_from_shape = inside)),
        ("right/", Box::new(|loaded| loaded.scene.hands[0].world_from_hand = inside)),
    ];
    for (name, change) in changes {
        let mut changed = loaded.clone();
        change(&mut changed);
        let report = judge(&changed, &query, &good);
        assert!(collides(&report), "{name}: {:?}", report.violations);
        let failure = plan_for(&changed, &query, 0).expect_err(name);
        assert_eq!((failure.kind, failure.statistics.work), (FailureKind::StartInvalid, 0), "{name}: {failure}");
        assert!(failure.message.contains(name), "{name}: {failure}");
    }
}

/// The right hand is where fingers of the left one go, unless it makes way.
#[test]
fn the_posture_of_the_other_hand_counts() {
    let mut loaded = load(SCENE);
    let query = loaded.tasks[0].query(0);
    let good = plan_for(&loaded, &query, 0).unwrap();
    // The left hand hangs over the right one, so near that its fingers reach into it where they are stretched out.
    let over = Pose::translation(0.0, 0.0, 0.2) * Pose::rotation(Vector::x() * std::f64::consts::PI);
    loaded.scene.hands[1].world_from_hand = over;
    let with = |joints: [f64; 3]| {
        let mut posed = loaded.clone();
        posed.state.hand_joints[1] = joints.repeat(4);
        collides(&judge(&posed, &query, &good))
    };
    assert!(with([0.0, 0.0, 0.1]), "fingers stretched out are in the way");
    assert!(!with([0.0, -1.3, 0.1]), "fingers turned aside are not");
}

#[test]
fn a_palm_in_another_object_is_refused_before_any_search() {
    let mut loaded = load(SCENE);
    // The ball is where the palm of the left hand is.
    loaded.state.world_from_objects[0] = Pose::translation(0.5, 0.0, 0.05);
    let query = loaded.tasks[1].query(0);
    let failure = plan_for(&loaded, &query, 0).unwrap_err();
    assert_eq!(failure.kind, FailureKind::Impossible, "{failure}");
    assert!(failure.message.contains("overlaps \"ball\""), "{failure}");
}
