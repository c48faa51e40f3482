//! Pictures of plans of whole robots.

use crate::moving_robot::{load, motion, pick_and_place, straight, two_arms};
use regrasp_plan::check::{CheckSettings, RobotAlong, check_robot, robot_along};
use regrasp_scene::MotionGoal;
use regrasp_viewer::robots::{RobotReplay, RobotStoryboard, RobotTelling, robot_charts, robot_page, robot_storyboard};

#[test]
fn pages_of_robots_show_frames_and_charts() {
    let loaded = load(&two_arms());
    let (scene, state) = (&loaded.scene, &loaded.state);
    let query = motion(&loaded, "carry");
    let MotionGoal::Joints(goal) = &query.goal else { panic!("a goal of joints") };
    let plan = straight(scene, &query, &[query.start.clone(), goal.clone()], 4, 0.9);
    let report = check_robot((scene, state), Some(&query), &plan, &CheckSettings::default());
    let along = robot_along((scene, state), &plan, 50).unwrap();
    assert!(along.times.len() >= 50 && along.times.is_sorted() && along.clearance.iter().all(Option::is_some));
    // Waypoints are among the moments: nothing measured there is smaller.
    let smallest = along.clearance.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    assert!(smallest <= report.min_clearance.as_ref().unwrap().distance + 1e-12);
    let telling = RobotTelling { scene, state, plan: &plan, report: &report, along: &along, title: Some("<two>") };
    let charts = robot_charts(&telling);
    assert_eq!(charts.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["joints", "clearance"]);
    assert!(charts[0].1.contains("right_elbow") && !charts[0].1.contains("left_elbow"));
    for (_, chart) in &charts {
        roxmltree::Document::parse(chart).unwrap();
    }
    let settings = RobotStoryboard { frames: 2, width: 240, columns: None };
    let page = robot_page(&telling, &settings).unwrap();
    assert_eq!(page, robot_page(&telling, &settings).unwrap());
    assert!(page.contains("&lt;two&gt;") && page.contains("accepted") && page.contains("data:image/png;base64,"));
    let picture = robot_storyboard(scene, state, &plan, &settings).unwrap();
    assert_eq!(picture.width, 240);
    assert!(picture.rgb.iter().any(|byte| *byte < 200));
    assert!(robot_storyboard(scene, state, &plan, &RobotStoryboard { frames: 1, ..settings }).is_err());
}

#[test]
fn pick_and_place_has_a_task_chart_and_a_replay() {
    let (loaded, plan) = pick_and_place();
    let (scene, state) = (&loaded.scene, &loaded.state);
    let report = check_robot((scene, state), None, &plan, &CheckSettings::default());
    // Clearance is the checker's matter, and has its own test above.
    let along = RobotAlong::default();
    let telling = RobotTelling { scene, state, plan: &plan, report: &report, along: &along, title: None };
    let charts = robot_charts(&telling);
    let names: Vec<&str> = charts.iter().map(|(name, _)| *name).collect();
    assert_eq!(names[..3], ["task", "fingers", "joints"]);
    let task = roxmltree::Document::parse(&charts[0].1).unwrap();
    let text: Vec<&str> = task.descendants().filter_map(|node| node.text()).collect();
    for name in ["right", "left", "table", "grasp", "carry"] {
        assert!(text.contains(&name), "{name} in {text:?}");
    }
    // A bar of the right hand, two of the table; the left hand has none.
    let filled = |color: &str| task.descendants().filter(|node| node.attribute("fill") == Some(color)).count();
    assert_eq!((filled("#0072b2"), filled("#e69f00"), filled("#9a8f80")), (1, 0, 2));
    let fingers = &charts[1].1;
    assert!(fingers.contains("right/east") && !fingers.contains("left/east"));
    let replay = RobotReplay::of(&telling).unwrap();
    assert!(replay.times.is_sorted() && replay.segments.len() == plan.segments.len());
    let bytes = regrasp_viewer::story::pack::from_base64(&replay.poses).unwrap();
    assert_eq!(bytes.len(), 28 * replay.times.len() * replay.n_columns);
    // The object is the last column; at the last frame it is at the goal.
    let last = &bytes[bytes.len() - 28..];
    let x = f32::from_le_bytes(last[..4].try_into().unwrap());
    let goal = plan.waypoints().last().unwrap().world_from_objects[0].position[0];
    assert!((f64::from(x) - goal).abs() < 1e-6, "{x} {goal}");
    let settings = RobotStoryboard { frames: 6, width: 300, columns: None };
    let page = robot_page(&telling, &settings).unwrap();
    assert!(page.len() < 8_000_000 && page.contains("<summary>Fingers</summary>"));
}

/// Every node and exchange is a mark, every motion a line; bodies that rest are outlined.
#[test]
fn wrist_graphs_show_what_they_hold() {
    use regrasp_geometry::{Point, Pose, Shape, Vector};
    use regrasp_viewer::robots::{WristGraph, corners, wrist_graph};

    let table = Shape::Cuboid { half_extents: Vector::new(0.25, 0.5, 0.01) };
    let graph = WristGraph {
        arms: vec![
            ("right".into(), vec![Point::new(0.5, -0.4, 0.6), Point::new(0.6, -0.2, 0.9), Point::new(0.6, -0.2, 0.9)]),
            ("left".into(), vec![Point::new(0.5, 0.4, 0.6), Point::new(0.5, 0.4, 0.6), Point::new(0.4, 0.3, 0.7)]),
        ],
        edges: vec![[0, 1], [1, 2]],
        exchanges: vec![Point::new(0.6, 0.0, 0.8)],
        still: vec![corners(&table, &Pose::translation(0.6, 0.0, 0.3))],
    };
    let svg = wrist_graph(&graph, "graph");
    // Two views of six nodes and an exchange, and their marks in the key.
    assert_eq!(svg.matches("<circle").count(), 2 * 7 + 3);
    for words in ["wrist of right (nodes: 3)", "motions: 2", "exchanges: 1", "from above", "0.5 m"] {
        assert!(svg.contains(words), "{words}");
    }
    assert!(!wrist_graph(&WristGraph::default(), "empty").contains("NaN"));
}

/// The two that meet are painted in their colours, what is missing is drawn, and words stand below.
#[test]
fn failures_are_drawn_in_their_scene() {
    use regrasp_geometry::{Point, Pose};
    use regrasp_viewer::robots::{
        ExchangePlaces, Met, MissingHand, RobotFailure, robot_failure_page, robot_failure_picture,
    };
    use regrasp_viewer::story::{CauseStory, FailureStory};

    let (loaded, plan) = pick_and_place();
    let first = plan.waypoints().next().unwrap();
    let at = |k: usize| Pose::from(&plan.waypoints().nth(k).unwrap().world_from_objects[0]);
    let n = plan.waypoints().count();
    let story = FailureStory {
        kind: "impossible".into(),
        message: "place: 3 tried, 3 in collision <&>".into(),
        advice: "move it".into(),
        causes: vec![CauseStory { reason: "place: in collision".into(), count: 3, share: 1.0 }],
        nearest_miss: None,
    };
    let object = loaded.scene.object_named(&plan.objects[0]).unwrap();
    let bare = RobotFailure {
        scene: &loaded.scene,
        state: &loaded.state,
        robot: 0,
        joints: &first.joints,
        what: "place: in collision".into(),
        object: Some((object, [at(0), at(0), at(n - 1)])),
        meeting: None,
        missing: Vec::new(),
        exchanges: Vec::new(),
        failure: &story,
    };
    // Pixels near a colour: red well above green and blue, or blue above both.
    let reddish = |rgb: &[u8]| rgb[0] > 110 && i32::from(rgb[0]) > 3 * i32::from(rgb[1].max(rgb[2]));
    let count = |of: &RobotFailure| {
        let picture = robot_failure_picture(of).unwrap();
        picture.rgb.chunks_exact(3).filter(|rgb| reddish(rgb)).count()
    };
    let robot = &loaded.scene.robots[0];
    let link = robot.robot.links[robot.arms[0].mount.0].name.clone();
    let shown =
        robot.robot.links.iter().find(|link| !link.collision.is_empty() && link.name.contains("right")).unwrap();
    let table = loaded.scene.supports[0].body.name.clone();
    let meeting = RobotFailure { meeting: Some([Met::Link(shown.name.clone()), Met::Resting(table)]), ..bare.clone() };
    let (none, some) = (count(&bare), count(&meeting));
    assert!(none < 50 && some > 300, "{none} and {some} pixels of the first body's colour, mount link {link}");
    assert_eq!(robot_failure_picture(&meeting).unwrap(), robot_failure_picture(&meeting).unwrap());

    let mut poses = Vec::new();
    robot.link_poses(&first.joints, &mut poses);
    let wrist = Point::from(poses[robot.arms[0].mount.0].translation.vector);
    let away = regrasp_geometry::Vector::new(0.2, 0.0, 0.2);
    let base = poses[robot.hands[0].hand.base.0];
    let missing = MissingHand {
        hand: 0,
        world_from_hand: Pose::translation(away.x, away.y, away.z) * base,
        wrist: [wrist, wrist + away],
    };
    let places = ExchangePlaces { outcome: "out of reach".into(), places: vec![wrist + away * 2.0] };
    let reach = RobotFailure { missing: vec![missing], exchanges: vec![places], ..bare.clone() };
    assert!(count(&reach) > 300, "an arrow to where the wrist should be");
    // A third view is there where exchanges are.
    assert!(robot_failure_picture(&reach).unwrap() != robot_failure_picture(&bare).unwrap());

    let facts = vec![("Result".to_owned(), "NO PLAN: <impossible>".to_owned())];
    let page = robot_failure_page(&meeting, &facts, "<two>").unwrap();
    assert_eq!(page, robot_failure_page(&meeting, &facts, "<two>").unwrap());
    assert!(page.contains("&lt;two&gt;") && page.contains("NO PLAN") && page.contains("data:image/png;base64,"));
    assert!(page.contains("&lt;impossible&gt;") && !page.contains("<impossible>") && !page.contains("<script"));
    let short = RobotFailure { joints: &first.joints[1..], ..bare.clone() };
    assert!(robot_failure_picture(&short).is_err());
    assert!(robot_failure_picture(&RobotFailure { robot: 7, ..bare }).is_err());
}
