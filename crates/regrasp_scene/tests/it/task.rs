//! How a seed resolves what the scene file leaves open.

use crate::support::{Folder, GOOD};
use regrasp_geometry::{Point, Vector};
use regrasp_scene::{GraspRequest, Gravity, SceneHand, Task};

fn task(text: &str) -> Task {
    Folder::new().load(text).unwrap_or_else(|error| panic!("{error}")).task().clone()
}

#[test]
fn start_positions_fill_the_ball_evenly() {
    let task = task(&GOOD.replace("0.078]", "0.078]\nposition_within = 0.01"));
    let n_seeds = 4000;
    let (mut sum, mut n_inner) = (Vector::zeros(), 0);
    for seed in 0..n_seeds {
        let offset = task.query(seed).start().translation.vector - Vector::new(0.0, 0.0, 0.078);
        assert!(offset.norm() <= 0.01);
        sum += offset;
        n_inner += usize::from(offset.norm() < 0.005);
    }
    // An eighth of the ball lies within half its radius; standard deviations are 2.6e-4 m and 0.0052.
    assert!((sum / n_seeds as f64).norm() < 6e-4);
    assert!((n_inner as f64 / n_seeds as f64 - 0.125).abs() < 0.026);
    assert_eq!(task.query(3), task.query(3));
    assert_ne!(task.query(3), task.query(4));
}

#[test]
fn random_orientations_have_no_preferred_direction() {
    let task = task(&GOOD.replace("0.078]", "0.078]\nrandom_orientation = true"));
    let n_seeds = 4000;
    let sum: Vector = (0..n_seeds).map(|seed| task.query(seed).start().rotation * Vector::z()).sum();
    // Each component has variance 1/3: the mean's standard deviation is 0.0091.
    assert!((sum / n_seeds as f64).norm() < 0.05);
    let query = task.query(5);
    let turn = query.goal().rotation * query.start().rotation.inverse();
    assert!((turn * Vector::y() - Vector::z()).norm() < 1e-12, "90 degrees about the world's x");
}

#[test]
fn goals_are_absolute_or_relative() {
    let absolute = "position = [0.0, 0.01, 0.08]\nquat_wxyz = [0.0, 0.0, 0.0, 1.0]";
    let text = GOOD.replace("turn = { axis = \"x\", angle_deg = 90 }", absolute);
    let goal = *task(&text).query(0).goal();
    assert_eq!(goal.translation.vector, Vector::new(0.0, 0.01, 0.08));
    assert!((goal.rotation * Vector::x() + Vector::x()).norm() < 1e-12, "half a turn about z");

    let text = GOOD.replace("angle_deg = 90 }", "angle_deg = 90 }\nmove = [0.0, 0.0, 0.01]");
    let goal = *task(&text).query(0).goal();
    assert!((goal.translation.vector - Vector::new(0.0, 0.0, 0.088)).norm() < 1e-15);

    let text = GOOD.replace("axis = \"x\", angle_deg = 90", "axis = [0, 0, 2], angle_deg = -90");
    let goal = *task(&text).query(0).goal();
    assert!((goal.rotation * Vector::y() - Vector::x()).norm() < 1e-12);
}

#[test]
fn way_poses_are_absolute_or_seen_from_the_start_as_drawn() {
    let way = "[[way]]\nmove = [0.0, 0.01, 0.0]\n[[way]]\nposition = [0.0, 0.0, 0.07]\n\n[goal]";
    let text = GOOD.replace("[goal]", way).replace("0.078]", "0.078]\nposition_within = 0.01");
    let query = task(&text).query(5);
    let [first, second] = query.way() else { panic!("two poses") };
    let start = query.start();
    assert!((first.translation.vector - start.translation.vector - Vector::new(0.0, 0.01, 0.0)).norm() < 1e-15);
    assert_eq!(first.rotation, start.rotation);
    assert_eq!(second.translation.vector, Vector::new(0.0, 0.0, 0.07));
    assert_eq!(query.as_in_hand().unwrap().poses().len(), 4);
    assert_eq!(task(GOOD).query(5).way(), []);
}

#[test]
fn turns_beyond_half_a_turn_are_broken_into_legs_below_it() {
    for (angle, n_legs) in [(180.0, 1), (-180.0, 1), (181.0, 2), (-270.0, 2), (360.0, 3), (539.0, 3), (720.0, 5)] {
        let text = GOOD.replace("angle_deg = 90 }", &format!("angle_deg = {angle} }}\nmove = [0.0, 0.0, 0.006]"));
        let poses = task(&text).query(0).as_in_hand().unwrap().poses();
        assert_eq!(poses.len() - 1, n_legs, "{angle}");
        // Added up leg by leg, the angle is the one asked for.
        let sum: f64 = poses.windows(2).map(|p| (p[1].rotation * p[0].rotation.inverse()).scaled_axis().x).sum();
        if n_legs > 1 {
            assert!((sum.to_degrees() - angle).abs() < 1e-9, "{angle}: {}", sum.to_degrees());
        }
        let rise = poses[1].translation.z - poses[0].translation.z;
        assert!((rise - 0.006 / n_legs as f64).abs() < 1e-15);
    }
}

#[test]
fn grasps_are_read_by_name() {
    let contacts =
        "{ contacts = { south = [0, -0.032, 0], east = [0.032, 0, 0], west = [-0.032, 0, 0], north = [0, 0.032, 0] } }";
    let query = task(&GOOD.replace("0.078]", &format!("0.078]\ngrasp = {contacts}"))).query(0);
    let expected = [[0.032, 0.0, 0.0], [0.0, 0.032, 0.0], [-0.032, 0.0, 0.0], [0.0, -0.032, 0.0]].map(Point::from);
    assert_eq!(*query.start_grasp(), GraspRequest::Contacts(expected.to_vec()));
    assert_eq!(*query.goal_grasp(), GraspRequest::Automatic);

    let mut joints = String::new();
    for (finger, abduction) in [("west", 0.3), ("east", 0.1), ("south", 0.4), ("north", 0.2)] {
        joints.push_str(&format!(
            "{finger}_abduction = {abduction}, {finger}_proximal_flexion = 0.5, {finger}_distal_flexion = 0.6, "
        ));
    }
    let text = format!("{GOOD}grasp = {{ joints = {{ {} }} }}\n", joints.trim_end_matches(", "));
    let GraspRequest::Joints(values) = task(&text).goal_grasp else { panic!("joints were given") };
    assert_eq!(values, [0.1, 0.5, 0.6, 0.2, 0.5, 0.6, 0.3, 0.5, 0.6, 0.4, 0.5, 0.6]);
}

#[test]
fn hand_pose_and_rest_posture_take_effect() {
    let folder = Folder::new();
    let plain = folder.load(GOOD).unwrap().scene.hands.remove(0);
    let text = GOOD.replace(
        "file = \"hand.toml\"",
        "file = \"hand.toml\"\nworld_from_hand = { position = [0.1, 0.0, 0.0], quat_xyzw = [0, 0, 1, 0] }\nrest = { west_abduction = 0.25 }",
    );
    let moved = folder.load(&text.replace("[0.0, 0.0, 0.078]", "[0.1, 0.0, 0.078]")).unwrap().scene.hands.remove(0);
    assert_eq!(moved.hand.fingers[2].rest[0], 0.25);
    assert_eq!(moved.hand.fingers[2].rest[1], plain.hand.fingers[2].rest[1]);
    let tip = |placed: &SceneHand| {
        let finger = &placed.hand.fingers[0];
        placed.world_from_hand * finger.chain.tip(&[0.1, 0.2, 0.3], &finger.tip.center_in_body)
    };
    let (before, after) = (tip(&plain), tip(&moved));
    assert!((after - Point::new(0.1 - before.x, -before.y, before.z)).norm() < 1e-12);
}

#[test]
fn gravity_is_a_direction_of_the_hand() {
    let load = |gravity: &str| {
        let text = GOOD.replace("task = \"in_hand\"\n", &format!("task = \"in_hand\"\n{gravity}\n")).replace(
            "file = \"hand.toml\"\n",
            "file = \"hand.toml\"\nworld_from_hand = { position = [0, 0, 0], quat_xyzw = [1, 0, 0, 0] }\n",
        );
        Folder::new().load(&text).unwrap_or_else(|error| panic!("{error}")).scene.gravity
    };
    // The hand is turned upside down about x: its y and z are the world's -y and -z.
    let Some(Gravity::Direction(down)) = load("gravity = [0, 0, 20]") else { panic!("a direction was stated") };
    assert!((down.into_inner() - Vector::new(0.0, 0.0, -1.0)).norm() < 1e-12);
    let Some(Gravity::Direction(down)) = load("gravity = [3, 4, 0]") else { panic!("a direction was stated") };
    assert!((down.into_inner() - Vector::new(0.6, -0.8, 0.0)).norm() < 1e-12);
    assert_eq!(load("gravity = \"any\""), Some(Gravity::Any));
    assert_eq!(load(""), None);
    assert_eq!(Gravity::default().in_world(), Some(Vector::new(0.0, 0.0, -9.80665)));
}

#[test]
fn a_start_may_be_left_to_the_planner() {
    let open = |start: &str| Folder::new().load(&GOOD.replace("position = [0.0, 0.0, 0.078]", start));
    let code = |start: &str| open(start).unwrap_err().diagnostics.iter().map(|one| one.code).collect::<Vec<_>>();
    let loaded = open("position = \"auto\"").unwrap_or_else(|error| panic!("{error}"));
    let query = loaded.task().query(0);
    assert!(query.has_open_start());
    let start = regrasp_geometry::pose_from([0.01, 0.02, 0.07], [0.6, 0.0, 0.0, 0.8]);
    let started = query.started_at(&start);
    assert!(!started.has_open_start());
    assert_eq!(*started.start(), start);
    // The goal of the file is a turn of 90 degrees about x.
    let turn = started.goal().rotation * start.rotation.inverse();
    assert!((turn * Vector::y() - Vector::z()).norm() < 1e-12);
    assert_eq!(started.goal().translation, start.translation);
    let held = started.held().unwrap();
    assert_eq!(held.goal(), held.start());

    let turned = open("position = \"auto\"\nrotation_vector = [0.0, 0.0, 0.3]").unwrap();
    let kept = turned.task().query(0).started_at(&start);
    assert!((kept.start().rotation.scaled_axis() - Vector::z() * 0.3).norm() < 1e-12);
    assert_eq!(kept.start().translation, start.translation);

    assert_eq!(code("position = \"anywhere\""), ["S104"]);
    assert_eq!(code("position = \"auto\"\nposition_within = 0.01"), ["S106"]);
    let given = "position = \"auto\"\ngrasp = { contacts = { east = [0.032, 0.0, 0.0] } }";
    assert!(code(given).contains(&"S106"));
}
