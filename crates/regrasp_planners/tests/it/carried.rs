//! Hands that a robot carries: where the arms put them, planned and judged there, with the arms in the way.

use crate::places::repository;
use regrasp_base::Budget;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::check::{CheckSettings, Report, check};
use regrasp_plan::{Plan, plan::PoseData};
use regrasp_planners::{PlannerSettings, plan};
use regrasp_robot::import::LoadOptions;
use regrasp_scene::{HandView, LoadedScene, Query, State, load_scene};

fn load() -> LoadedScene {
    let path = repository().join("scenes/robot_two_arms.toml");
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn plan_in(loaded: &LoadedScene, state: &State, query: &Query) -> Plan {
    let budget = Budget::work(3_000_000);
    plan((&loaded.scene, state), query, &PlannerSettings::default(), 0, &budget, &|_| {})
        .unwrap_or_else(|failure| panic!("{failure}"))
}

fn judged(loaded: &LoadedScene, state: &State, query: &Query, plan: &Plan) -> Report {
    check((&loaded.scene, state), Some(query), plan, &CheckSettings::default())
}

/// Where the hand on the right (-1) or on the left (1) is while the arms are at home and the torso is turned by `yaw`: by hand,
/// from the lengths in the robot file.
fn world_from_hand(side: f64, yaw: f64) -> Pose {
    let (shoulder, upper, rest) = (0.5f64, 0.25, 0.25 + 0.04 + 0.13);
    let in_torso = Vector::new(upper * shoulder.cos() + rest, side * 0.25, 0.1 - upper * shoulder.sin());
    Pose::new(Vector::new(0.0, 0.0, 0.6), Vector::z() * yaw) * Pose::translation(in_torso.x, in_torso.y, in_torso.z)
}

#[test]
fn both_hands_of_a_robot_plan_where_its_arms_hold_them() {
    let loaded = load();
    assert_eq!((loaded.scene.robots.len(), loaded.scene.hands.len()), (1, 2));
    for (task, side) in loaded.tasks.iter().zip([-1.0, 1.0]) {
        let manipulation = loaded.manipulation_of(task);
        let off = manipulation.world_from_hand().inverse() * world_from_hand(side, 0.0);
        assert!(off.translation.vector.norm() < 1e-12 && off.rotation.angle() < 1e-9, "{off}");
        // The arms and the torso are in the way, but for the flange that carries the hand, which is palm.
        let names: Vec<String> = manipulation.bystanders().into_iter().map(|body| body.name).collect();
        let has = |name: &str| names.iter().any(|known| known == name);
        let (own, other) = if side < 0.0 { ("right", "left") } else { ("left", "right") };
        assert!(has("two_arms/torso") && has(&format!("two_arms/{own}_forearm")), "{names:?}");
        assert!(has(&format!("two_arms/{other}_flange")) && !has(&format!("two_arms/{own}_flange")), "{names:?}");
        let query = task.query(0);
        let plan = plan_in(&loaded, &loaded.state, &query);
        let report = judged(&loaded, &loaded.state, &query, &plan);
        assert!(report.accepted(), "{}: {:#?}", task.name, report.violations);
    }
}

#[test]
fn a_hand_plans_wherever_the_arm_has_taken_it() {
    let loaded = load();
    let yaw = 0.4;
    let mut state = loaded.state.clone();
    let torso = loaded.scene.robots[0].layout.index_of("torso_yaw").unwrap();
    state.robot_joints[0][torso] = yaw;
    let task = &loaded.tasks[0];
    let Query::InHand(at_home) = task.query(0) else { panic!("an in-hand task") };
    let moved = world_from_hand(-1.0, yaw) * world_from_hand(-1.0, 0.0).inverse();
    let query = Query::InHand(at_home.seen_from(&moved));
    let here = HandView::of(&regrasp_scene::Manipulation::of(&loaded.scene, &state, &query));
    let off = here.world_from_hand.inverse() * world_from_hand(-1.0, yaw);
    assert!(off.translation.vector.norm() < 1e-12 && off.rotation.angle() < 1e-9, "{off}");
    let plan = plan_in(&loaded, &state, &query);
    assert!(judged(&loaded, &state, &query, &plan).accepted());
    // Judged with the torso where the file has it, the fingertips are not on the object.
    assert!(!judged(&loaded, &loaded.state, &query, &plan).accepted());
    let first = &plan.segments[0].waypoints[0].world_from_object;
    let (PoseData { position, .. }, asked) = (first, query.start().translation.vector);
    assert!((Vector::from(*position) - asked).norm() < 1e-9);
}

/// Two hands on one bar, which is in the palm of both.
const BAR: &str = r#"<robot name="bar"><link name="bar"><collision><origin xyz="0 0.25 -0.03"/><geometry>
<box size="0.03 0.6 0.02"/></geometry></collision></link></robot>"#;

#[test]
fn two_hands_on_one_rigid_body_are_not_in_their_own_way() {
    let folder = tempfile::tempdir().unwrap();
    let hand = repository().join("assets/hands/wide_four_finger/hand.toml").canonicalize().unwrap();
    let hands: String = [("right", 0.0), ("left", 0.5)]
        .iter()
        .map(|(name, y)| {
            format!(
                "[[hands]]\nname = \"{name}\"\nhand = {:?}\nmount_link = \"bar\"\nposition = [0.0, {y:?}, 0.0]\n",
                hand
            )
        })
        .collect();
    let robot = format!("format = \"regrasp-robot\"\nformat_version = 1\n[[models]]\nurdf = \"bar.urdf\"\n{hands}");
    let scene = "format = \"regrasp-scene\"\nformat_version = 2\n[robot]\nfile = \"robot.toml\"\n\
        [[objects]]\nname = \"ball\"\nsphere = { radius = 0.032 }\nmass = 0.1\nfriction = 0.8\nposition = [0.0, 0.5, 0.078]\n\
        [[tasks]]\ntask = \"in_hand\"\nhand = \"left\"\ngoal = { turn = { axis = \"x\", angle_deg = 90 } }\n";
    for (name, text) in [("bar.urdf", BAR), ("robot.toml", &robot), ("scene.toml", scene)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let loaded = load_scene(&folder.path().join("scene.toml"), &LoadOptions::default()).unwrap();
    let query = loaded.task().query(0);
    let plan = plan_in(&loaded, &loaded.state, &query);
    let report = judged(&loaded, &loaded.state, &query, &plan);
    assert!(report.accepted(), "{:#?}", report.violations);
}
