//! Pictures of plans of whole robots.

use crate::moving_robot::{load, motion, straight, two_arms};
use regrasp_plan::check::{CheckSettings, check_robot, robot_along};
use regrasp_scene::MotionGoal;
use regrasp_viewer::robots::{RobotStoryboard, RobotTelling, robot_charts, robot_page, robot_storyboard};

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
