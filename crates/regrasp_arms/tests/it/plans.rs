//! Plans of scenes.

use crate::places::repository;
use regrasp_arms::plan::{build_graph, grow_graph, plan_with_graph};
use regrasp_arms::plan_motion;
use regrasp_arms::roadmap::{BuildSettings, Roads, SuperGraph};
use regrasp_base::{Budget, Rng};
use regrasp_manipulation::failure::FailureKind;
use regrasp_manipulation::motion_settings::{MotionMethod, MotionSettings};
use regrasp_plan::check::{CheckSettings, check_robot};
use regrasp_robot::manipulator::layout::Part;
use regrasp_scene::{LoadedScene, MotionGoal, MotionQuery, load_scene};
use std::path::{Path, PathBuf};

const SCENE: &str = r#"format = "regrasp-scene"
format_version = 2

[robot]
file = "ROBOT"

[[objects]]
name = "box"
box = { size = [0.04, 0.04, 0.04] }
mass = 0.1
friction = 0.8
position = [0.9, 0.0, 0.02]

[[obstacles]]
name = "lamp"
cylinder = { radius = 0.03, length = 0.6 }
position = [LAMP]

OBSTACLES
[[tasks]]
task = "motion"
start = { joints = { torso_yaw = -0.6 } }
goal = { joints = { torso_yaw = 0.6, right_elbow = -0.9 } }
"#;

fn load(name: &str, lamp: &str) -> LoadedScene {
    load_among(name, lamp, "")
}

fn load_among(name: &str, lamp: &str, obstacles: &str) -> LoadedScene {
    let robot = repository().join("assets/robots/two_arms/robot.toml");
    let text =
        SCENE.replace("ROBOT", &robot.display().to_string()).replace("LAMP", lamp).replace("OBSTACLES", obstacles);
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join(format!("motion_{name}.toml"));
    std::fs::write(&path, text).unwrap();
    load_scene(&path, &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn query(loaded: &LoadedScene) -> MotionQuery {
    loaded.task().query(7).as_motion().expect("a motion").clone()
}

#[test]
fn plans_go_from_start_to_goal_and_are_the_same_again() {
    let loaded = load("free", "0.75, 0.0, 0.45");
    let query = query(&loaded);
    for method in [MotionMethod::InTurn, MotionMethod::SingleQuery] {
        let settings = MotionSettings { method, ..MotionSettings::default() };
        let plan = |seed| {
            let world = (&loaded.scene, &loaded.state);
            plan_motion(world, &query, &settings, seed, &Budget::work(100_000)).unwrap_or_else(|f| panic!("{f}"))
        };
        let found = plan(3);
        let waypoints = &found.segments[0].waypoints;
        assert_eq!(waypoints[0].joints, query.start);
        let regrasp_scene::MotionGoal::Joints(goal) = &query.goal else { panic!("joints") };
        assert_eq!(&waypoints[waypoints.len() - 1].joints, goal);
        assert!(waypoints.windows(2).all(|pair| pair[1].time > pair[0].time));
        assert_eq!(plan(3), found);
        for seed in 0..5 {
            let world = (&loaded.scene, &loaded.state);
            let report = check_robot(world, Some(&query), &plan(seed), &CheckSettings::default());
            assert!(report.accepted(), "{:?}", report.violations);
        }
    }
}

#[test]
fn a_start_in_collision_is_refused_with_the_pair_and_a_free_posture() {
    let loaded = load("blocked", "0.387, -0.568, 0.58");
    let query = query(&loaded);
    let failure =
        plan_motion((&loaded.scene, &loaded.state), &query, &MotionSettings::default(), 0, &Budget::work(100_000))
            .expect_err("no plan");
    assert_eq!(failure.kind, FailureKind::StartInvalid, "{failure}");
    assert!(failure.message.contains("\"lamp\"") && failure.message.contains("mm"), "{}", failure.message);
    assert!(failure.advice.contains("nearest free posture"), "{}", failure.advice);
}

#[test]
fn what_a_graph_lacked_is_found_once() {
    // Posts between which the arms have to find their way.
    let posts: String = [[0.45, 0.25], [0.45, -0.25], [0.6, 0.5], [0.6, -0.5], [0.3, 0.6], [0.3, -0.6]]
        .iter()
        .enumerate()
        .map(|(k, [x, y])| {
            format!(
                "[[obstacles]]\nname = \"post {k}\"\ncylinder = {{ radius = 0.03, length = 1.6 }}\nposition = [{x}, {y}, 0.8]\n\n"
            )
        })
        .collect();
    let loaded = load_among("grown", "0.75, 0.0, 0.45", &posts);
    let world = (&loaded.scene, &loaded.state);
    let mut query = query(&loaded);
    let of_graph = BuildSettings { nodes_per_arm: 2, ..BuildSettings::default() };
    let mut roads = Roads::new(build_graph(world, &query, &of_graph, 1).unwrap());
    let settings = MotionSettings::default();
    let (mut n_new, mut n_known) = (0, 0);
    for goal in 0..40 {
        let mut rng = Rng::keyed(goal, "goal", 0);
        let robot = &loaded.scene.robots[query.robot];
        let MotionGoal::Joints(joints) = &mut query.goal else { panic!("joints") };
        for (k, coordinate) in robot.layout.coordinates.iter().enumerate() {
            if !matches!(coordinate.part, Part::Hand(_)) {
                joints[k] = rng.uniform(coordinate.lower, coordinate.upper);
            }
        }
        let ask = |roads: &Roads| plan_with_graph(world, &query, &settings, (3, &Budget::work(3_000_000)), roads);
        let Ok(first) = ask(&roads) else { continue };
        let report = check_robot(world, Some(&query), &first.plan, &CheckSettings::default());
        assert!(report.accepted(), "{:?}", report.violations);
        let Some(way) = first.new_way else { continue };
        n_new += 1;
        assert_eq!(way[0], query.start);
        let n_before = roads.graph.graph.nodes.len();
        let (grown, n_added) = grow_graph(world, &query, &roads, &[way]);
        assert_eq!(grown.graph.graph.nodes.len(), n_before + n_added);
        roads = Roads::new(SuperGraph::from_json(Path::new("grown"), &grown.graph.to_json()).unwrap());
        let second = ask(&roads).unwrap();
        let report = check_robot(world, Some(&query), &second.plan, &CheckSettings::default());
        assert!(report.accepted(), "{:?}", report.violations);
        n_known += usize::from(second.new_way.is_none());
    }
    assert!(n_new >= 2 && n_known == n_new, "{n_known} of {n_new}");
}
