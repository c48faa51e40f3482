//! The checker of plans in which a whole robot moves, on plans that were made without a planner.

use crate::moving_robot::{load, motion, straight, two_arms, upright};
use crate::places::shared_models;
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_base::Rng;
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::AnyPlan;
use regrasp_plan::RobotPlan;
use regrasp_plan::check::{CheckSettings, Report, ViolationKind as Kind, check_robot};
use regrasp_plan::format::{read_any, robot_from_json, robot_schema, robot_to_json};
use regrasp_plan::plan::PoseData;
use regrasp_robot::LoadOptions;
use regrasp_scene::{LoadedScene, MotionGoal, MotionQuery, load_scene_text};
use std::path::Path;

fn judge(loaded: &LoadedScene, query: &MotionQuery, plan: &RobotPlan) -> Report {
    check_robot((&loaded.scene, &loaded.state), Some(query), plan, &CheckSettings::default())
}

fn goal_of(query: &MotionQuery) -> Vec<f64> {
    let MotionGoal::Joints(goal) = &query.goal else { panic!("a goal of joints") };
    goal.clone()
}

fn direct(loaded: &LoadedScene, name: &str) -> (MotionQuery, RobotPlan) {
    let query = motion(loaded, name);
    let plan = straight(&loaded.scene, &query, &[query.start.clone(), goal_of(&query)], 8, 0.9);
    (query, plan)
}

fn kinds(report: &Report) -> Vec<Kind> {
    let mut kinds: Vec<Kind> = report.violations.iter().map(|violation| violation.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

#[track_caller]
fn accepted(report: &Report) {
    let said: Vec<String> = report.violations.iter().map(ToString::to_string).collect();
    assert!(report.accepted(), "{}\n{:?}", said.join("\n"), report.left_out);
}

#[test]
fn straight_motions_are_accepted_and_read_back() {
    let loaded = load(&two_arms());
    for name in ["swing", "carry"] {
        let (query, plan) = direct(&loaded, name);
        let report = judge(&loaded, &query, &plan);
        accepted(&report);
        assert!(report.min_clearance.is_some() && report.n_distances > 0 && report.duration > 0.1, "{report:?}");
        assert_eq!(report.assumed.len(), query.carried.len());
        // Without the query the plan is judged by itself.
        accepted(&check_robot((&loaded.scene, &loaded.state), None, &plan, &CheckSettings::default()));
        let text = robot_to_json(&plan);
        let back = robot_from_json(Path::new("plan.json"), text.as_bytes()).unwrap();
        assert_eq!((&back, robot_to_json(&back)), (&plan, text.clone()));
        assert_eq!(read_any(Path::new("plan.json"), text.as_bytes()).unwrap(), AnyPlan::Robot(Box::new(plan)));
        let error = regrasp_plan::format::from_json(Path::new("plan.json"), text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("C412") && error.contains("whole robot"), "{error}");
    }
}

/// The plan with one thing changed, and the kinds of violation that it then has.
#[track_caller]
fn broken(name: &str, change: impl FnOnce(&mut RobotPlan), expected: &[Kind]) {
    let loaded = load(&two_arms());
    let (query, mut plan) = direct(&loaded, name);
    change(&mut plan);
    let report = judge(&loaded, &query, &plan);
    assert_eq!(kinds(&report), expected, "{:#?}", report.violations);
    assert!(!report.accepted());
}

#[test]
fn every_rule_can_be_broken_alone() {
    broken("swing", |plan| plan.task = "in_hand".into(), &[Kind::WrongScene]);
    broken("swing", |plan| plan.query = "carry".into(), &[Kind::WrongScene]);
    broken("swing", |plan| plan.robots[0].joint_names.swap(0, 1), &[Kind::WrongScene]);
    broken("swing", |plan| plan.promises.joint_velocities[0] = 2.1, &[Kind::LimitExceeded]);
    broken("swing", |plan| plan.promises.joint_accelerations[0] = 21.0, &[Kind::LimitExceeded]);
    broken("swing", |plan| plan.promises.clearance = 0.5, &[Kind::Collision]);
    broken("swing", |plan| plan.segments[0].waypoints[3].time = 0.0, &[Kind::TimeOrder, Kind::JointAcceleration]);
    broken("swing", |plan| plan.segments[0].waypoints[3].joints[1] = f64::NAN, &[Kind::NotANumber]);
    broken("swing", |plan| plan.segments[0].waypoints.truncate(1), &[Kind::EmptySegment]);
    broken("carry", |plan| plan.segments[0].held_by.clear(), &[Kind::WrongHolder]);
    broken("carry", |plan| plan.hands.clear(), &[Kind::WrongScene]);
    broken("carry", |plan| plan.objects[0] = "cup".into(), &[Kind::WrongHolder]);
    broken(
        "carry",
        |plan| plan.segments[0].waypoints[3].world_from_objects[0].position[2] += 2e-9,
        &[Kind::GraspChanges],
    );
    broken("swing", |plan| plan.inputs[0].sha256 = "0".repeat(64), &[Kind::InputHashMismatch]);
}

#[test]
fn start_and_goal_are_those_asked_for() {
    let loaded = load(&two_arms());
    let query = motion(&loaded, "swing");
    let (start, goal) = (query.start.clone(), goal_of(&query));
    let moved = |from: &[f64]| {
        let mut joints = from.to_vec();
        joints[1] += 1e-3;
        joints
    };
    for (corners, kind) in
        [([moved(&start), goal.clone()], Kind::StartMismatch), ([start.clone(), moved(&goal)], Kind::GoalMismatch)]
    {
        let plan = straight(&loaded.scene, &query, &corners, 4, 0.9);
        assert_eq!(kinds(&judge(&loaded, &query, &plan)), [kind]);
    }
}

#[test]
fn a_motion_through_the_lamp_is_found_between_two_waypoints() {
    let loaded = load(&two_arms());
    let mut query = motion(&loaded, "swing");
    // The right arm turns inwards by the torso: at both ends the lamp is free, and in between the arm sweeps over it.
    let k = loaded.scene.robots[0].layout.index_of("torso_yaw").unwrap();
    let (mut start, mut goal) = (query.start.clone(), query.start.clone());
    (start[k], goal[k]) = (-0.1, 1.2);
    (query.start, query.goal) = (start.clone(), MotionGoal::Joints(goal.clone()));
    let plan = straight(&loaded.scene, &query, &[start, goal], 1, 0.9);
    let report = judge(&loaded, &query, &plan);
    assert_eq!(kinds(&report), [Kind::Collision]);
    assert!(report.violations.iter().any(|violation| violation.subjects.contains(&"lamp".to_owned())), "{report:#?}");
}

#[test]
fn wrists_are_found_by_the_checkers_own_kinematics() {
    let loaded = load(&two_arms());
    let (mut query, plan) = direct(&loaded, "swing");
    let robot = &loaded.scene.robots[0];
    let mut poses = Vec::new();
    robot.link_poses(&goal_of(&query), &mut poses);
    let wrist = |arm: usize, shift: f64| regrasp_scene::WristGoal {
        arm,
        world_from_mount: Translation3::new(0.0, shift, 0.0) * poses[robot.arms[arm].mount.0],
    };
    query.goal = MotionGoal::Wrists(vec![wrist(0, 0.0), wrist(1, 0.0)]);
    accepted(&judge(&loaded, &query, &plan));
    query.goal = MotionGoal::Wrists(vec![wrist(0, 0.0), wrist(1, 2e-6)]);
    assert_eq!(kinds(&judge(&loaded, &query, &plan)), [Kind::GoalMismatch]);
    // The left elbow moves no wrist that is asked for, and has to stay.
    query.goal = MotionGoal::Wrists(vec![wrist(0, 0.0)]);
    assert_eq!(kinds(&judge(&loaded, &query, &plan)), [Kind::GoalMismatch]);
}

#[test]
fn a_hand_that_holds_moves_no_finger() {
    let loaded = load(&two_arms());
    let query = motion(&loaded, "carry");
    let k = loaded.scene.robots[0].layout.range(regrasp_robot::Part::Hand(0)).start + 1;
    let mut middle: Vec<f64> = query.start.iter().zip(goal_of(&query)).map(|(a, b)| 0.5 * (a + b)).collect();
    middle[k] -= 0.05;
    let plan = straight(&loaded.scene, &query, &[query.start.clone(), middle, goal_of(&query)], 2, 0.9);
    assert_eq!(kinds(&judge(&loaded, &query, &plan)), [Kind::GraspChanges]);
}

#[test]
fn an_object_that_starts_elsewhere_in_the_hand_is_another_question() {
    let loaded = load(&two_arms());
    let (mut query, plan) = direct(&loaded, "carry");
    query.carried[0].world_from_object = Translation3::new(0.0, 0.0, 2e-6) * query.carried[0].world_from_object;
    assert_eq!(kinds(&judge(&loaded, &query, &plan)), [Kind::StartMismatch]);
    let turned = UnitQuaternion::from_axis_angle(&Vector::x_axis(), 0.3);
    let (query, mut plan) = direct(&loaded, "carry");
    let pose = Pose::from(&plan.segments[0].waypoints[4].world_from_objects[0]);
    let turned = Pose::from_parts(pose.translation, pose.rotation * turned);
    plan.segments[0].waypoints[4].world_from_objects[0] = PoseData::from(&turned);
    // A ball looks the same, and has slipped all the same.
    assert_eq!(kinds(&judge(&loaded, &query, &plan)), [Kind::GraspChanges]);
}

#[test]
fn joints_that_follow_several_others_keep_their_own_limits() {
    let (_folder, loaded) = upright();
    let query = motion(&loaded, "");
    let to = |goal: [f64; 2], share: f64| {
        let query = MotionQuery { goal: MotionGoal::Joints(goal.to_vec()), ..query.clone() };
        judge(&loaded, &query, &straight(&loaded.scene, &query, &[vec![0.0; 2], goal.to_vec()], 3, share))
    };
    accepted(&to([0.9, 0.9], 0.49));
    // Each is within its limits of 2; together they take torso_3 to -2.1.
    assert_eq!(kinds(&to([1.05, 1.05], 0.49)), [Kind::JointLimit]);
    // Each keeps its speed; torso_3 goes twice as fast.
    assert_eq!(kinds(&to([0.9, 0.9], 0.95)), [Kind::JointTooFast]);
}

/// All scenes of shared robots: a panda among poles, and the two iiwas.
fn shared_scene(name: &str) -> Option<(tempfile::TempDir, LoadedScene)> {
    let models = shared_models()?;
    let (urdf, arms, extra) = match name {
        "panda" => (
            "panda/panda.urdf",
            "srdf = \"MODELS/robots/panda/panda.srdf\"\n[[arms]]\nname = \"arm\"\nbase_link = \"panda_link0\"\nmount_link = \"panda_hand\"\n\
             home = { panda_joint2 = -0.785, panda_joint4 = -2.356, panda_joint6 = 1.571, panda_joint7 = 0.785 }\n",
            "",
        ),
        "panda_spheres" => (
            "panda/panda_spherized.urdf",
            "srdf = \"MODELS/robots/panda/panda.srdf\"\n[[arms]]\nname = \"arm\"\nbase_link = \"panda_link0\"\nmount_link = \"panda_hand\"\n\
             home = { panda_joint2 = -0.785, panda_joint4 = -2.356, panda_joint6 = 1.571, panda_joint7 = 0.785 }\n",
            "",
        ),
        "pr2" => ("pr2/pr2.urdf", "srdf = \"MODELS/robots/pr2/pr2.srdf\"\n", ""),
        _ => ("dual_iiwa14/dual_iiwa14_spheres.urdf", "", ""),
    };
    let folder = tempfile::tempdir().unwrap();
    let models = models.to_str().unwrap();
    let robot = format!(
        "format = \"regrasp-robot\"\nformat_version = 1\nname = \"{name}\"\n[[models]]\nurdf = \"{models}/robots/{urdf}\"\n{}{extra}",
        arms.replace("MODELS", models)
    );
    std::fs::write(folder.path().join("robot.toml"), robot).unwrap();
    let scene = "format = \"regrasp-scene\"\nformat_version = 2\n[robot]\nfile = \"robot.toml\"\n\
                 [[obstacles]]\nname = \"pole\"\nbox = { size = [0.05, 0.05, 1.0] }\nposition = [0.45, 0.25, 0.5]\n\
                 [[obstacles]]\nname = \"lamp\"\nsphere = { radius = 0.06 }\nposition = [0.4, -0.3, 0.5]\n\
                 [[tasks]]\ntask = \"motion\"\ngoal = { joints = { } }\n";
    let path = folder.path().join("scene.toml");
    let options = LoadOptions::default();
    let loaded = load_scene_text(&path, scene.into(), &options).unwrap_or_else(|error| panic!("{error}"));
    Some((folder, loaded))
}

/// What many moments show: all pairs well apart, some that touch, or neither.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sampled {
    Free,
    Hit,
    Near,
}

/// Samples a straight motion by kinematics and distances that are not the checker's; pairs as the robot allows them.
fn sampled(loaded: &LoadedScene, query: &MotionQuery, from: &[f64], to: &[f64]) -> Sampled {
    use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
    const N: usize = 300;
    let robot = &loaded.scene.robots[query.robot];
    let shapes: Vec<_> = (robot.common.shapes.iter()).chain(robot.arms.iter().flat_map(|arm| &arm.shapes)).collect();
    let moves = |link: regrasp_robot::LinkId| !robot.coordinates_above(link).is_empty();
    let apart = |a: Placed, b: Placed, by: f64| {
        let (mut direction, mut hints) = (Vector::zeros(), [0; 2]);
        matches!(separation(a, b, by, by, &mut direction, &mut hints), Separation::SeparatedBy(_))
    };
    let (mut poses, mut verdict) = (Vec::new(), Sampled::Free);
    for i in 0..=N {
        let u = i as f64 / N as f64;
        let joints: Vec<f64> = from.iter().zip(to).map(|(a, b)| a + (b - a) * u).collect();
        robot.link_poses(&joints, &mut poses);
        let at: Vec<Placement> = (shapes.iter())
            .map(|shape| Placement::from(&(poses[shape.link.0] * shape.placed.parent_from_shape)))
            .collect();
        let placed = |k: usize| Placed { shape: &shapes[k].placed.shape, at: &at[k] };
        let obstacles: Vec<Placement> = (loaded.scene.obstacles.iter())
            .map(|obstacle| Placement::from(&obstacle.placed.parent_from_shape))
            .collect();
        for (k, a) in shapes.iter().enumerate() {
            let own = (k + 1..shapes.len()).filter(|&m| !robot.may_touch(a.link, shapes[m].link)).map(placed);
            let fixed = loaded.scene.obstacles.iter().zip(&obstacles).filter(|_| moves(a.link));
            let fixed = fixed.map(|(obstacle, at)| Placed { shape: &obstacle.placed.shape, at });
            for other in own.chain(fixed) {
                if !apart(placed(k), other, 3e-3) {
                    verdict = Sampled::Near;
                    if !apart(placed(k), other, 1e-7) {
                        return Sampled::Hit;
                    }
                }
            }
        }
    }
    verdict
}

#[test]
fn verdicts_agree_with_dense_samples_on_shared_robots() {
    for name in ["panda", "panda_spheres", "iiwas"] {
        let Some((_folder, loaded)) = shared_scene(name) else { return };
        let mut query = motion(&loaded, "");
        let layout = &loaded.scene.robots[0].layout;
        let mut rng = Rng::keyed(5, "moved_robot", 0);
        let (mut n_free, mut n_hit) = (0, 0);
        while n_free + n_hit < 60 {
            let mut draw = |near: &[f64], reach: f64| -> Vec<f64> {
                let near = near.iter().zip(&layout.coordinates);
                near.map(|(q, c)| (q + rng.uniform(-reach, reach)).clamp(c.lower.max(-3.0), c.upper.min(3.0))).collect()
            };
            let start = draw(&layout.rest(), 0.6);
            let goal = draw(&start, 1.0);
            (query.start, query.goal) = (start.clone(), MotionGoal::Joints(goal.clone()));
            let plan = straight(&loaded.scene, &query, &[start.clone(), goal.clone()], 10, 0.9);
            let sampled = sampled(&loaded, &query, &start, &goal);
            // What is nearer than the samples are dense says nothing.
            if sampled == Sampled::Near {
                continue;
            }
            let report = judge(&loaded, &query, &plan);
            match sampled == Sampled::Free {
                true => accepted(&report),
                false => assert_eq!(kinds(&report), [Kind::Collision], "{name}"),
            }
            if sampled == Sampled::Free { n_free += 1 } else { n_hit += 1 }
        }
        assert!(n_free > 5 && n_hit > 5, "{name}: {n_free} free, {n_hit} not");
    }
}

#[test]
fn the_schema_in_the_repository_is_the_one_of_the_types() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../schema/robot-plan.schema.json");
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    if written != robot_schema() && std::env::var_os("REGRASP_WRITE_SCHEMA").is_some() {
        std::fs::write(&path, robot_schema()).unwrap();
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap_or_default(), robot_schema(), "run with REGRASP_WRITE_SCHEMA=1");
}
