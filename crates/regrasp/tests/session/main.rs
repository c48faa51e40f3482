//! Sessions: starts from observed states, plans that bring their query, and the checker that judges them from the file alone.

/// Starts near edges.
mod edges;
/// Starts at which links are nearer to each other, or to the object, than plans keep them.
mod near;

use regrasp::base::{Budget, Rng};
use regrasp::geometry::{Pose, Vector};
use regrasp::plan::check::{CheckSettings, OwnQuery, ViolationKind, check_files};
use regrasp::plan::format;
use regrasp::plan::plan::{Plan, Waypoint};
use regrasp::planners::FailureKind;
use regrasp::planners::in_hand::roadmap::{BuildSettings, GraspRoadmap, Region, build_roadmap};
use regrasp::planners::in_hand::starting::{Observation, ProjectionLimits, Start};
use regrasp::robot::LoadOptions;
use regrasp::scene::{LoadedScene, load_scene};
use regrasp::session::{ObservedVelocities, Session, Touching};
use regrasp::{Failure, InHandSettings};
use std::path::{Path, PathBuf};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name)
}

fn loaded(name: &str) -> LoadedScene {
    load_scene(&path(name), &LoadOptions::default()).unwrap()
}

fn session(loaded: &LoadedScene) -> Session<'_> {
    Session::open(loaded, None, InHandSettings::default()).unwrap()
}

fn own_plan(loaded: &LoadedScene, seed: u64) -> Plan {
    let query = loaded.task().query(seed);
    let budget = Budget::work(2_000_000);
    regrasp::plan_in_hand(
        &regrasp::HandView::of(&loaded.manipulation()),
        query.as_in_hand().unwrap(),
        &InHandSettings::default(),
        seed,
        &budget,
        &|_| {},
    )
    .unwrap()
}

fn observation(waypoint: &Waypoint) -> Observation {
    Observation {
        world_from_object: Pose::from(&waypoint.world_from_object),
        joints: waypoint.joints.clone(),
        velocities: None,
        presses: None,
    }
}

/// As a camera with noise of half a millimetre and half a degree, and encoders of half a milliradian, would have it.
fn noisy(seen: &Observation, rng: &mut Rng, size: f64) -> Observation {
    let mut vector = |deviation: f64| Vector::from_fn(|_, _| size * deviation * rng.normal());
    let (shift, turn) = (vector(0.3e-3), vector(5e-3));
    let pose = seen.world_from_object;
    let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn) * pose.rotation;
    let joints = seen.joints.iter().map(|q| q + size * 5e-4 * rng.normal()).collect();
    let world_from_object = Pose::from_parts((pose.translation.vector + shift).into(), rotation);
    Observation { world_from_object, joints, ..seen.clone() }
}

fn wide() -> ProjectionLimits {
    ProjectionLimits { distance: 0.002, turn: 0.03, ..ProjectionLimits::default() }
}

fn turned(start: &Start, angle: f64) -> Pose {
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector::x_axis(), angle);
    Pose::from_parts(start.world_from_object.translation, turn * start.world_from_object.rotation)
}

fn plan_from(session: &Session, start: &Start, seed: u64) -> Result<Plan, Failure> {
    session.plan(start, &turned(start, 0.6), seed, &Budget::work(2_000_000), &|_| {})
}

#[test]
fn states_along_plans_are_starts_that_planning_takes() {
    for name in ["sphere_90x.toml", "box_90x.toml"] {
        let loaded = loaded(name);
        let session = session(&loaded);
        let (mut n_seen, mut n_free) = (0, 0);
        for seed in 0..3 {
            let plan = own_plan(&loaded, seed);
            let mut rng = Rng::keyed(seed, "noise", 0);
            for waypoint in
                plan.segments.iter().flat_map(|segment| [&segment.waypoints[0], segment.waypoints.last().unwrap()])
            {
                let exact = session.project(&observation(waypoint), &ProjectionLimits::default()).unwrap();
                assert!(exact.moved.object < 1e-9 && exact.moved.joint < 1e-3, "{name}: {:?}", exact.moved);
                let seen = noisy(&observation(waypoint), &mut rng, 1.0);
                let start = session.project(&seen, &wide()).unwrap_or_else(|failure| panic!("{name}: {failure}"));
                assert!(start.moved.object <= 0.002 && start.moved.object_turn <= 0.03, "{:?}", start.moved);
                assert_eq!(start.touching.iter().map(|what| *what != Touching::Free).collect::<Vec<_>>(), start.holds);
                n_seen += 1;
                n_free += usize::from(start.holds.contains(&false));
                if n_seen % 4 == 0 {
                    let found = plan_from(&session, &start, seed).unwrap_or_else(|failure| panic!("{name}: {failure}"));
                    let report = session.check(&found, &CheckSettings::default());
                    assert!(report.accepted(), "{name}: {:#?}", report.violations);
                    let asked = session.check_asked(&found, &start, &turned(&start, 0.6), &CheckSettings::default());
                    assert!(asked.accepted());
                }
            }
        }
        assert!(n_seen >= 10, "{name}: {n_seen} states, {n_free} with free fingers");
    }
}

#[test]
fn a_finger_in_the_air_is_a_free_finger_of_the_start() {
    let loaded = loaded("box_90x.toml");
    let session = session(&loaded);
    let plan = own_plan(&loaded, 0);
    let regrasp = plan.segments.iter().find(|segment| segment.moving_finger.is_some()).unwrap();
    let finger = plan.fingers.iter().position(|name| Some(name) == regrasp.moving_finger.as_ref()).unwrap();
    let middle = &regrasp.waypoints[regrasp.waypoints.len() / 2];
    let start = session.project(&observation(middle), &ProjectionLimits::default()).unwrap();
    assert!(!start.holds[finger] && start.touching[finger] == Touching::Free);
    let found = plan_from(&session, &start, 1).unwrap();
    assert_eq!(found.asked.as_ref().unwrap().free, [plan.fingers[finger].clone()]);
    assert!(!found.segments[0].waypoints[0].contacts[finger].holds());
    assert!(session.check(&found, &CheckSettings::default()).accepted());
}

#[test]
fn the_checker_judges_a_plan_of_a_session_from_its_file() {
    let loaded = loaded("sphere_90x.toml");
    let session = session(&loaded);
    let plan = own_plan(&loaded, 3);
    let start = session.project(&observation(&plan.segments[1].waypoints[0]), &ProjectionLimits::default()).unwrap();
    let found = plan_from(&session, &start, 2).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plan.json");
    let judge_with = |plan: &Plan, own_query: OwnQuery| {
        std::fs::write(&file, format::to_json(plan)).unwrap();
        let scene = path("sphere_90x.toml");
        let settings = CheckSettings { own_query, ..CheckSettings::default() };
        check_files(&file, Some(&scene), &LoadOptions::default(), &settings).unwrap()
    };
    let judge = |plan: &Plan| judge_with(plan, OwnQuery::Allowed);
    // A plan answers its own question whatever that is: whoever judges has to allow it.
    let refused = judge_with(&found, OwnQuery::Refused).report;
    assert_eq!(
        refused.violations.iter().map(|violation| violation.kind).collect::<Vec<_>>(),
        [ViolationKind::WrongScene]
    );
    let judged = judge(&found);
    assert_eq!(judged.plan, found, "a file keeps the plan to the last bit");
    assert!(judged.report.accepted() && judged.report == session.check(&found, &CheckSettings::default()));

    let breaks = |change: &dyn Fn(&mut Plan)| {
        let mut broken = found.clone();
        change(&mut broken);
        judge(&broken).report.violations.iter().map(|violation| violation.kind).collect::<Vec<_>>()
    };
    let asked = |plan: &mut Plan| plan.asked.clone().unwrap();
    let start_moved = breaks(&|plan| {
        let mut asked = asked(plan);
        asked.start.position[0] += 0.001;
        plan.asked = Some(asked);
    });
    assert!(start_moved.contains(&ViolationKind::StartMismatch));
    let goal_moved = breaks(&|plan| {
        let mut asked = asked(plan);
        asked.goal.position[2] += 0.001;
        plan.asked = Some(asked);
    });
    assert!(goal_moved.contains(&ViolationKind::GoalMismatch));
    let other_joints = breaks(&|plan| {
        let mut asked = asked(plan);
        asked.joints[4] += 0.06;
        plan.asked = Some(asked);
    });
    assert!(other_joints.contains(&ViolationKind::StartMismatch));
    let other_free = breaks(&|plan| {
        let mut asked = asked(plan);
        asked.free = vec![plan.fingers[0].clone()];
        plan.asked = Some(asked);
    });
    assert!(other_free.contains(&ViolationKind::StartMismatch));
    // Without what it was asked it is judged against the scene's task, which it does not answer.
    assert!(breaks(&|plan| plan.asked = None).contains(&ViolationKind::StartMismatch));
    // Whoever has asked something else is not answered by what the plan says of itself.
    let elsewhere = session.check_asked(&found, &start, &turned(&start, 0.7), &CheckSettings::default());
    assert!(elsewhere.violations.iter().any(|violation| violation.kind == ViolationKind::GoalMismatch));
}

#[test]
fn what_is_no_start_is_refused_with_its_cause() {
    let loaded = loaded("box_90x.toml");
    let session = session(&loaded);
    let seen = observation(&own_plan(&loaded, 0).segments[0].waypoints[0]);
    let refused = |observed: &Observation| {
        let failure = session.project(observed, &ProjectionLimits::default()).unwrap_err();
        assert_eq!(failure.kind, FailureKind::StartInvalid);
        failure.message
    };
    let far = Pose::from_parts(
        (seen.world_from_object.translation.vector + Vector::z() * 0.1).into(),
        seen.world_from_object.rotation,
    );
    assert!(refused(&Observation { world_from_object: far, ..seen.clone() }).contains("no finger touches"));
    let mut joints = seen.joints.clone();
    joints[0] = f64::NAN;
    assert!(refused(&Observation { joints, ..seen.clone() }).contains("NaN"));
    assert!(refused(&Observation { joints: vec![0.0; 3], ..seen.clone() }).contains("has 3 joints"));
    // Pushed past its stop.
    let finger = &session.view().hand.fingers[0];
    let mut joints = seen.joints.clone();
    joints[1] = finger.chain.upper[1] + 0.05;
    let message = refused(&Observation { joints, ..seen.clone() });
    let name = &session.view().hand.joint_names()[1];
    assert!(
        message.contains(&format!("joint \"{name}\"")) && message.contains("0.0500 beyond its limits"),
        "{message}"
    );
    // Two fingers opened wide: the other two do not hold a box.
    let rest: Vec<f64> = session.view().hand.fingers.iter().flat_map(|finger| finger.rest.iter().copied()).collect();
    let mut joints = seen.joints.clone();
    joints[..6].copy_from_slice(&rest[..6]);
    let message = refused(&Observation { joints, ..seen.clone() });
    assert!(message.contains("not force closed without") || message.contains("nearer than"), "{message}");
    // Four millimetres deep in the fingers.
    let deep = Pose::from_parts(
        (seen.world_from_object.translation.vector + Vector::x() * 0.004).into(),
        seen.world_from_object.rotation,
    );
    let message = refused(&Observation { world_from_object: deep, ..seen });
    assert!(
        message.contains("moves") || message.contains("off the surface") || message.contains("closed"),
        "{message}"
    );
}

#[test]
fn surfaces_that_slide_over_each_other_are_seen() {
    let loaded = loaded("sphere_90x.toml");
    let session = session(&loaded);
    let seen = observation(&own_plan(&loaded, 0).segments[0].waypoints[0]);
    let with = |linear: Vector| {
        let joints = vec![0.0; seen.joints.len()];
        let velocities = Some(ObservedVelocities { joints, linear, angular: Vector::zeros() });
        session.project(&Observation { velocities, ..seen.clone() }, &ProjectionLimits::default()).unwrap().touching
    };
    assert!(with(Vector::zeros()).iter().all(|what| *what == Touching::Holds));
    assert!(with(Vector::z() * 0.02).contains(&Touching::Slides));
}

#[test]
fn a_session_of_what_cannot_be_asked_is_refused() {
    let loaded = loaded("sphere_90x.toml");
    assert!(
        Session::open(&loaded, Some("elsewhere"), InHandSettings::default()).unwrap_err().to_string().contains("A510")
    );
    let tracked = self::loaded("football.toml");
    assert!(Session::open(&tracked, None, InHandSettings::default()).unwrap_err().to_string().contains("tracking"));
}

/// A graph of some places around start and goal of a scene's task.
fn roadmap_of(session: &Session, loaded: &LoadedScene, settings: &InHandSettings) -> GraspRoadmap {
    let query = loaded.task().query(0);
    let poses = [query.start(), query.goal()].map(|pose| session.view().hand_from(pose));
    let region = Region::around(&poses, &session.view().object.center_of_mass, 0.01, 1.0);
    let build = BuildSettings { places: 40, ..BuildSettings::default() };
    build_roadmap(session.view(), &region, &build, settings, 1, &Budget::unlimited(), &|_| {}).unwrap()
}

#[test]
fn an_open_roadmap_is_asked_first_and_searches_help_out() {
    let loaded = loaded("sphere_90x.toml");
    let alone = session(&loaded);
    let settings = InHandSettings::default();
    let agreed = alone.agreed_roadmap(Path::new("graph"), roadmap_of(&alone, &loaded, &settings)).unwrap();
    let session = alone.clone().with_roadmap(&agreed);
    let plan = own_plan(&loaded, 0);
    let (mut n_mapped, mut n_searched) = (0, 0);
    for seed in 0..6 {
        let waypoint = plan.segments.last().unwrap().waypoints.last().unwrap();
        let start = session.project(&observation(waypoint), &ProjectionLimits::default()).unwrap();
        let goal = turned(&start, 0.2 + 0.15 * seed as f64);
        let budget = Budget::work(2_000_000);
        let found = session.plan(&start, &goal, seed, &budget, &|_| {}).unwrap_or_else(|failure| panic!("{failure}"));
        let asked = session.check_asked(&found, &start, &goal, &CheckSettings::default());
        assert!(asked.accepted(), "{:#?}", asked.violations);
        assert!(session.check(&found, &CheckSettings::default()).accepted(), "the plan says what it was asked");
        assert_eq!(
            found,
            session.plan(&start, &goal, seed, &budget, &|_| {}).unwrap(),
            "the same query, the same plan"
        );
        match found.method.as_str() {
            "roadmap" => n_mapped += 1,
            _ => n_searched += 1,
        }
        assert_ne!(session.search(&start, &goal, seed, &budget, &|_| {}).unwrap().method, "roadmap");
        assert!(alone.ask_roadmap(&start, &goal, seed, &budget).is_none(), "a session without a roadmap");
    }
    assert!(n_mapped >= 3, "{n_mapped} answers of the graph, {n_searched} of searches");
}

#[test]
fn a_finger_in_the_air_and_a_failing_graph_lead_to_a_search() {
    let loaded = loaded("box_90x.toml");
    let alone = session(&loaded);
    let settings = InHandSettings::default();
    let query = loaded.task().query(0);
    // A few places close together: fingertips roll from one to the other, and it leads nowhere else.
    let region =
        Region::around(&[alone.view().hand_from(query.start())], &alone.view().object.center_of_mass, 0.001, 0.01);
    let build = BuildSettings { places: 4, ..BuildSettings::default() };
    let graph = build_roadmap(alone.view(), &region, &build, &settings, 1, &Budget::unlimited(), &|_| {}).unwrap();
    let agreed = alone.agreed_roadmap(Path::new("graph"), graph).unwrap();
    let session = alone.clone().with_roadmap(&agreed);
    let plan = own_plan(&loaded, 0);
    let regrasp = plan.segments.iter().find(|segment| segment.moving_finger.is_some()).unwrap();
    let middle = &regrasp.waypoints[regrasp.waypoints.len() / 2];
    let start = session.project(&observation(middle), &ProjectionLimits::default()).unwrap();
    assert!(session.ask_roadmap(&start, &turned(&start, 0.3), 1, &Budget::work(1_000_000)).is_none());
    for waypoint in [middle, &plan.segments[0].waypoints[0]] {
        let start = session.project(&observation(waypoint), &ProjectionLimits::default()).unwrap();
        let found = plan_from(&session, &start, 1).unwrap_or_else(|failure| panic!("{failure}"));
        assert!(session.check(&found, &CheckSettings::default()).accepted());
    }
}

#[test]
fn a_roadmap_of_something_else_is_refused() {
    let (sphere, other) = (loaded("sphere_90x.toml"), loaded("box_90x.toml"));
    let own = session(&sphere);
    let graph = roadmap_of(&own, &sphere, &InHandSettings::default());
    let path = Path::new("graph.roadmap");
    let error = session(&other).agreed_roadmap(path, graph.clone()).unwrap_err();
    assert_eq!(error.diagnostics[0].code, "R611");
    let mut settings = InHandSettings::default();
    settings.physics.friction_margin = 2.0;
    let careful = Session::open(&sphere, None, settings).unwrap();
    let error = careful.agreed_roadmap(path, graph).unwrap_err();
    assert_eq!(error.diagnostics[0].code, "R615");
    assert!(error.to_string().contains("friction_margin"), "{error}");
}
