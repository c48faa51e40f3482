//! The scenes of pick and place: they load, their lists belong to their hands and objects, and the arms reach what they are to reach.

use regrasp::base::{Budget, Rng};
use regrasp::geometry::{Pose, Vector};
use regrasp::grasp::GraspList;
use regrasp::grasp::list::GraspKind;
use regrasp::plan::check::{CheckSettings, check_grasps};
use regrasp::robot::import::{LoadOptions, ResolveOptions};
use regrasp::robot::kinematics::arm_ik::{ArmIk, IkBudget};
use regrasp::robot::{Manipulator, Part};
use regrasp::scene::{
    LoadedScene, ObjectSource, PickAndPlaceQuery, Query, load_grasp_scene, load_scene, load_scene_text,
};
use regrasp::task_grasps::{GRASPS_OF_A_TASK, make_list, read_grasps, refuse_too_heavy, settings_of_made_lists};
use regrasp::{GraspSettings, list_grasps};
use std::path::PathBuf;

#[path = "../../../tests/support/places.rs"]
mod places;

/// Postures of the common part that are tried.
const COMMON_POSTURES: u64 = 60;

fn options() -> LoadOptions {
    let packages = places::shared_models().map(|folder| ("models".to_owned(), folder)).into_iter().collect();
    LoadOptions { resolve: ResolveOptions { packages, ..ResolveOptions::default() }, ..LoadOptions::default() }
}

fn path(name: &str) -> PathBuf {
    places::repository().join("scenes/two_arms").join(name).with_extension("toml")
}

fn loaded(name: &str) -> LoadedScene {
    load_scene(&path(name), &options()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn query_of(loaded: &LoadedScene, task: usize) -> PickAndPlaceQuery {
    match loaded.tasks[task].query(0) {
        Query::PickAndPlace(query) => query,
        other => panic!("a task of kind {}", other.task()),
    }
}

/// Grasps of the list that stay above the support where the object stands at `world_from_object`, and that the hand's arm reaches there.
fn reachable(robot: &Manipulator, hand: usize, list: &GraspList, world_from_object: &Pose) -> usize {
    let down = world_from_object.inverse_transform_vector(&-Vector::z());
    let stands = list.stable_poses.iter().position(|pose| (Vector::from(pose.down_in_object) - down).norm() < 1e-6);
    let stands = stands.expect("the pose is a stable one");
    let arm = robot.hands[hand].arm.expect("an arm carries the hand");
    let ik = ArmIk::new(robot, arm).unwrap();
    let mut rng = Rng::keyed(1, "common postures", 0);
    let [lower, upper] = robot.layout.limits();
    let mut poses = Vec::new();
    let mut bases = Vec::new();
    for attempt in 0..COMMON_POSTURES {
        let mut state = robot.layout.rest();
        for k in robot.layout.range(Part::Common).filter(|_| attempt > 0) {
            state[k] = rng.uniform(lower[k], upper[k]);
        }
        if robot.layout.within_limits(&state, 0.0) {
            robot.link_poses(&state, &mut poses);
            bases.push(poses[robot.arms[arm].base.0]);
        }
    }
    let rest = robot.layout.rest();
    robot.link_poses(&rest, &mut poses);
    let mount_from_hand = poses[robot.arms[arm].mount.0].inverse() * robot.world_from_hand(hand, &rest);
    let is_reached = |world_from_hand: &Pose| {
        let target = world_from_hand * mount_from_hand.inverse();
        let near = robot.arms[arm].home.clone();
        bases.iter().any(|base| ik.solve(&(base.inverse() * target), &near, &IkBudget::default()).is_ok())
    };
    let standing = list.grasps.iter().filter(|grasp| grasp.stable_poses.contains(&stands));
    standing.filter(|grasp| is_reached(&(world_from_object * Pose::from(&grasp.object_from_hand)))).count()
}

/// Counts of reachable grasps at the start and at the goal, by hand.
fn reach(loaded: &LoadedScene, task: usize) -> Vec<[usize; 2]> {
    let query = query_of(loaded, task);
    let grasps = read_grasps(&loaded.scene, &query).unwrap();
    assert!(grasps.missing.is_empty());
    let robot = &loaded.scene.robots[query.robot];
    let ends = [&query.world_from_object_start, &query.world_from_object_goal];
    let of_hand = |(hand, list): &(usize, GraspList)| {
        let hand = loaded.scene.hands[*hand].carrier.unwrap().hand;
        ends.map(|pose| reachable(robot, hand, list, pose))
    };
    grasps.lists.iter().map(of_hand).collect()
}

#[test]
fn each_arm_reaches_one_end_of_the_horse_s_way() {
    for name in ["justin_horse", "justin_horse_vases", "justin_horse_crowded"] {
        let seen = reach(&loaded(name), 0);
        let [right, left] = seen.as_slice() else { panic!("{name}: {seen:?}") };
        assert!(right[0] >= 4 && right[1] == 0, "{name}: {seen:?}");
        assert!(left[0] == 0 && left[1] >= 4, "{name}: {seen:?}");
    }
    let seen = reach(&loaded("justin_horse_turning"), 0);
    assert!(seen.iter().flatten().all(|count| *count >= 4), "{seen:?}");
    let seen = reach(&loaded("justin_horse_near"), 0);
    assert!(seen[0].iter().all(|count| *count >= 4), "{seen:?}");
}

#[test]
fn no_arm_reaches_a_goal_far_away() {
    let seen = reach(&loaded("impossible_reach"), 0);
    assert!(seen.iter().any(|ends| ends[0] > 0) && seen.iter().all(|ends| ends[1] == 0), "{seen:?}");
}

/// The scene `name` with `from` replaced by `to`, beside the files that it names.
fn changed(name: &str, from: &str, to: &str) -> LoadedScene {
    let text = std::fs::read_to_string(path(name)).unwrap();
    assert!(text.contains(from), "{from}");
    load_scene_text(&path(name), text.replace(from, to).into_bytes(), &options()).unwrap()
}

#[test]
fn lists_of_other_hands_and_objects_are_refused() {
    let lists = "right = \"horse.right.grasps.json\", left = \"horse.left.grasps.json\"";
    let swapped = "left = \"horse.right.grasps.json\", right = \"horse.left.grasps.json\"";
    for (from, to, code, words) in [
        (lists, swapped, "G740", "was made with the hand file left_hand.toml"),
        ("mass = 0.1", "mass = 0.2", "G741", "counts on a mass of 0.1 kg"),
        ("friction = 0.8", "friction = 0.7", "G741", "counts on a friction of 0.8"),
    ] {
        let loaded = changed("justin_horse", from, to);
        let error = read_grasps(&loaded.scene, &query_of(&loaded, 0)).unwrap_err().to_string();
        assert!(error.contains(code) && error.contains(words), "{error}");
    }
    let longer =
        "box = { size = [0.054, 0.05, 0.05] }\ngrasps = { right = \"impossible_double_grasp.right.die.grasps.json\" }";
    let loaded = changed("impossible_double_grasp", "box = { size = [0.05, 0.05, 0.05] }", longer);
    let error = read_grasps(&loaded.scene, &query_of(&loaded, 0)).unwrap_err().to_string();
    assert!(error.contains("G741") && error.contains("off the object's surface"), "{error}");
}

#[test]
fn a_list_that_no_scene_names_is_made_for_the_hand_alone() {
    let loaded = loaded("impossible_double_grasp");
    let query = query_of(&loaded, 0);
    let read = read_grasps(&loaded.scene, &query).unwrap();
    assert_eq!((read.lists.len(), read.missing.as_slice()), (0, [0, 1].as_slice()));
    let made = settings_of_made_lists(&loaded.scene.hands[1].hand, 2);
    assert_eq!((made.kind, made.grasps), (GraspKind::Precision, GRASPS_OF_A_TASK));
    let few = GraspSettings { grasps: 3, ..made };
    let list = make_list(&loaded.scene, &query, 1, (&few, 0), &Budget::work(10_000_000)).unwrap();
    assert_eq!((list.grasps.len(), list.hand.base_link.as_str()), (3, "palm"));
    assert!(list.hand.joint_names.iter().all(|name| !name.contains('/')), "{:?}", list.hand.joint_names);
    // As the hand from its own file gives it.
    let file = loaded.scene.robots[0].hands[1].file.clone().unwrap();
    let object = ObjectSource::Scene(path("impossible_double_grasp"));
    let alone = load_grasp_scene(&file, &object, &options()).unwrap();
    let (hand, object) = (&alone.scene.hands[0].hand, &alone.scene.objects[0]);
    let again = list_grasps(hand, object, &few, 0, &Budget::work(10_000_000)).unwrap();
    assert_eq!(list.grasps, again.grasps);
    let report = check_grasps(&alone, &list, &CheckSettings::default(), 1);
    assert!(report.rejected.is_empty(), "{report:?}");
}

#[test]
fn what_no_hand_holds_is_refused_before_lists_are_made() {
    let heavy = loaded("impossible_weight");
    let failure = refuse_too_heavy(&heavy.scene, &query_of(&heavy, 0)).unwrap_err();
    assert!(failure.message.starts_with("start: \"horse\" weighs 294 N"), "{failure}");
    let light = loaded("justin_horse");
    assert_eq!(refuse_too_heavy(&light.scene, &query_of(&light, 0)), Ok(()));
}

#[test]
fn scenes_of_shared_models_are_within_reach() {
    if places::shared_models().is_none() {
        return;
    }
    for object in ["mustard", "drill", "breyer"] {
        let seen = reach(&loaded(&format!("iiwa_allegro_{object}")), 0);
        let [right, left] = seen.as_slice() else { panic!("{object}: {seen:?}") };
        assert!(right[0] >= 3 && right[1] == 0, "{object}: {seen:?}");
        assert!(left[0] == 0 && left[1] >= 3, "{object}: {seen:?}");
    }
    let panda = loaded("panda_allegro_table");
    for task in 0..panda.tasks.len() {
        let seen = reach(&panda, task);
        assert!(seen[0].iter().all(|count| *count >= 2), "{}: {seen:?}", panda.tasks[task].name);
    }
}
