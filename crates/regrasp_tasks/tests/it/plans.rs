//! Tasks with plans.

use crate::{Case, holders};
use regrasp_manipulation::motion_settings::PartsMove;
use regrasp_mutations::tasks::task_mutants;
use regrasp_plan::AnyPlan;
use regrasp_plan::check::{CheckSettings, ViolationKind, check_any};
use regrasp_plan::robot_plan::RobotSegmentKind;
use regrasp_robot::manipulator::layout::Part;
use regrasp_scene::Query;
use regrasp_tasks::{PostureWeights, TaskSettings};

#[test]
fn one_arm_does_it_where_that_suffices() {
    let case = Case::new("justin_horse_near.toml");
    for seed in 0..3 {
        let plan = case.accepted(&TaskSettings::default(), seed);
        assert_eq!(holders(&plan).len(), 1, "{:?}", holders(&plan));
        let kinds: Vec<RobotSegmentKind> = plan.segments.iter().map(|segment| segment.kind).collect();
        use RobotSegmentKind::{Approach, Carry, Grasp, Release, Retreat, Transit};
        assert_eq!(kinds, [Transit, Approach, Grasp, Carry, Carry, Carry, Release, Retreat, Transit]);
    }
}

#[test]
fn the_object_changes_hands_where_no_arm_reaches_both_places() {
    let case = Case::new("justin_horse.toml");
    for seed in 0..2 {
        let plan = case.accepted(&TaskSettings::default(), seed);
        assert_eq!(holders(&plan), ["right", "left"]);
        let is_exchange = |held: &Vec<String>| held.iter().all(|name| name == "right" || name == "left");
        let both = plan.segments.iter().filter_map(|segment| segment.held_by.values().next());
        assert!(both.clone().any(|held| held.len() == 2 && is_exchange(held)), "no exchange");
    }
}

#[test]
fn it_is_put_down_and_taken_again_where_hands_may_not_give() {
    let case = Case::new("justin_horse.toml");
    let settings = TaskSettings { hand_over: false, ..TaskSettings::default() };
    let plan = case.accepted(&settings, 0);
    assert_eq!(holders(&plan), ["right", "left"]);
    let n_releases = plan.segments.iter().filter(|segment| segment.kind == RobotSegmentKind::Release).count();
    assert_eq!(n_releases, 2);
}

#[test]
fn a_hand_changes_its_grasp_before_it_gives_where_nothing_else_helps() {
    let case = Case::new("regrasp_then_give.toml");
    let plan = case.accepted(&TaskSettings::default(), 0);
    assert!(plan.segments.iter().any(|segment| segment.kind == RobotSegmentKind::Regrasp), "no change in the hand");
    assert_eq!(holders(&plan), ["right", "left"]);
    let without = TaskSettings { in_hand: false, ..TaskSettings::default() };
    let failure = case.plan(&without, 0).expect_err("a plan without a change in the hand");
    assert!(failure.message.starts_with("exchange"), "{failure}");
}

#[test]
fn broken_plans_with_motions_in_a_hand_are_rejected() {
    let case = Case::new("regrasp_then_give.toml");
    let plan = case.accepted(&TaskSettings::default(), 1);
    let world = (&case.loaded.scene, &case.loaded.state);
    let query = Query::from(case.query.clone());
    let (mut n_in_hand, mut wrong) = (0, Vec::new());
    for round in 0..1 {
        let mut rng = regrasp_base::Rng::keyed(round, "mutants", 0);
        for mutant in task_mutants(&plan, world, &case.query, &mut rng) {
            n_in_hand += usize::from(mutant.name.contains("hand"));
            let scene = mutant.scene.as_ref().unwrap_or(world.0);
            let state = mutant.state.as_ref().unwrap_or(world.1);
            let asked = mutant.query.clone().map_or_else(|| query.clone(), Query::from);
            let any = AnyPlan::Robot(Box::new(mutant.plan.clone()));
            let report = check_any((scene, state), Some(&asked), &any, &CheckSettings::default());
            let is_named = report.violations.iter().any(|violation| mutant.expected.contains(&violation.kind));
            if !is_named {
                wrong.push(format!("{} (round {round}): {:?}", mutant.name, report.violations.first()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(n_in_hand >= 12, "{n_in_hand} mutants of motions in a hand");
}

#[test]
fn the_same_seed_gives_the_same_plan() {
    let case = Case::new("justin_horse_turning.toml");
    let first = case.accepted(&TaskSettings::default(), 7);
    let again = std::thread::scope(|scope| {
        scope.spawn(|| case.plan(&TaskSettings::default(), 7).expect("a plan")).join().expect("no panic")
    });
    assert_eq!(first, again);
}

/// Parts whose joints change between two waypoints that follow each other: the most of any two.
fn most_parts_at_once(case: &Case, settings: &TaskSettings) -> usize {
    let plan = case.accepted(settings, 0);
    let coordinates = &case.loaded.scene.robots[case.query.robot].layout.coordinates;
    let parts = |pair: &[regrasp_plan::robot_plan::RobotWaypoint]| {
        // More than the rounding of curves.
        let changes = |k: &usize| (pair[0].joints[*k] - pair[1].joints[*k]).abs() > 1e-9;
        let mut moving: Vec<Part> = (0..coordinates.len()).filter(changes).map(|k| coordinates[k].part).collect();
        moving.retain(|part| !matches!(part, Part::Hand(_)));
        moving.dedup();
        moving.len()
    };
    plan.segments.iter().flat_map(|segment| segment.waypoints.windows(2).map(parts)).max().unwrap_or(0)
}

#[test]
fn parts_move_at_once_or_in_turn() {
    let case = Case::new("justin_horse.toml");
    assert!(most_parts_at_once(&case, &TaskSettings::default()) >= 2);
    let settings = TaskSettings { parts: PartsMove::InTurn, ..TaskSettings::default() };
    assert_eq!(most_parts_at_once(&case, &settings), 1);
}

#[test]
fn jaws_on_one_motor_hand_over_and_move_together() {
    let case = Case::new("grippers_bar.toml");
    let robot = &case.loaded.scene.robots[0];
    let ties = &robot.layout.ties;
    assert_eq!(ties.len(), 2, "one tie a gripper");
    for seed in 0..3 {
        let plan = case.accepted(&TaskSettings::default(), seed);
        assert_eq!(holders(&plan), ["right", "left"]);
        for waypoint in plan.segments.iter().flat_map(|segment| &segment.waypoints) {
            for (follower, coupling) in ties {
                let wanted = coupling.position(|leader| waypoint.joints[leader]);
                assert!((waypoint.joints[*follower] - wanted).abs() < 1e-9);
            }
        }
        // The judge does not believe a jaw that goes alone, at a waypoint or between two.
        for (k, (follower, _)) in ties.iter().enumerate() {
            let mut broken = plan.clone();
            let segment = (3 * k + 1) % broken.segments.len();
            broken.segments[segment].waypoints[1].joints[*follower] += 2e-8;
            assert!(case.violations(&broken).contains(&ViolationKind::JointLimit));
            let mut broken = plan.clone();
            broken.segments[0].waypoints[1].joint_velocities[*follower] += 1e-3;
            assert!(case.violations(&broken).contains(&ViolationKind::JointLimit));
        }
    }
}

#[test]
fn a_robot_with_grippers_moves_without_parting_their_jaws() {
    use regrasp_arms::plan_motion;
    use regrasp_manipulation::motion_settings::MotionSettings;
    let case = Case::new("grippers_bar.toml");
    let robot = &case.loaded.scene.robots[0];
    let [start, mut goal] = [robot.layout.rest(), robot.layout.rest()];
    let arm = robot.layout.index_of("right_arm_1").expect("a joint of the arm");
    let leader = robot.layout.index_of("right/left_slide").expect("the motor of the right gripper");
    goal[arm] += 0.5;
    goal[leader] = 0.02;
    robot.layout.settle_ties(&mut goal);
    let query = regrasp_scene::MotionQuery {
        name: String::new(),
        robot: 0,
        start,
        goal: regrasp_scene::MotionGoal::Joints(goal),
        carried: Vec::new(),
    };
    let world = (&case.loaded.scene, &case.loaded.state);
    let plan = plan_motion(world, &query, &MotionSettings::default(), 0, &regrasp_base::Budget::work(1_000_000))
        .expect("a plan");
    let report = regrasp_plan::check::check_robot(world, Some(&query), &plan, &CheckSettings::default());
    assert!(report.accepted(), "{:?}", report.violations.first());
}

/// Weights choose among postures of the arm: where only the height of the elbow counts, it is at the grasp no farther from that of the home
/// posture than where nothing counts. Plans are accepted whatever the weights are.
#[test]
fn weights_of_postures_choose_among_them() {
    let case = Case::new("justin_horse.toml");
    let robot = &case.loaded.scene.robots[0];
    let elbow = |state: &[f64]| {
        let mut poses = Vec::new();
        robot.link_poses(state, &mut poses);
        let names = &robot.arms[0].chain.names;
        let joint = robot.robot.joint_named(&names[names.len() / 2]).unwrap();
        poses[robot.robot.joints[joint.0].child.0].translation.vector.z
    };
    let home = elbow(&robot.layout.rest());
    let off = |posture: PostureWeights| {
        let plan = case.accepted(&TaskSettings { posture, ..TaskSettings::default() }, 3);
        let grasp = plan.segments.iter().find(|segment| segment.kind == RobotSegmentKind::Grasp).expect("a grasp");
        (elbow(&grasp.waypoints[0].joints) - home).abs()
    };
    let [plain, weighed] = [PostureWeights::NONE, PostureWeights { height: 10.0, ..PostureWeights::NONE }].map(off);
    assert!(weighed <= plain + 1e-9, "{weighed} against {plain}");
    off(PostureWeights { joints: 1.0, height: 3.0, plane: 3.0 });
    let wrong =
        TaskSettings { posture: PostureWeights { joints: -1.0, ..PostureWeights::NONE }, ..TaskSettings::default() };
    assert!(wrong.validate().unwrap_err().contains("posture.joints"));
}
