//! The trajectory, read line by line; the Python tests read it with PyYAML and hold it to the message definition.

use crate::sample::PLAN;
use regrasp_export::to_ros2;

fn lists(text: &str, key: &str) -> Vec<Vec<f64>> {
    let of_line = |line: &str| -> Vec<f64> {
        let values = line.trim_matches(|c| c == '[' || c == ']').split(", ").filter(|value| !value.is_empty());
        values.map(|value| value.parse().expect("a number")).collect()
    };
    text.lines().filter_map(|line| line.trim_start_matches(['-', ' ']).strip_prefix(key)).map(of_line).collect()
}

fn times(text: &str) -> Vec<u64> {
    let of_line = |line: &str| {
        let (sec, nanosec) = line.trim().strip_prefix("time_from_start: {sec: ")?.split_once(", nanosec: ")?;
        let nanosec: u64 = nanosec.strip_suffix('}')?.parse().ok()?;
        assert!(nanosec < 1_000_000_000);
        Some(sec.parse::<u64>().ok()? * 1_000_000_000 + nanosec)
    };
    text.lines().filter_map(of_line).collect()
}

#[test]
fn times_increase_and_every_posture_is_there() {
    let plan = &*PLAN;
    let text = to_ros2(plan).unwrap();
    let times = times(&text);
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
    let n_waypoints: usize = plan.segments.iter().map(|segment| segment.waypoints.len()).sum();
    assert!(times.len() <= n_waypoints && times.len() > n_waypoints - plan.segments.len());
    let positions = lists(&text, "positions: ");
    assert_eq!([positions.len(), lists(&text, "velocities: ").len()], [times.len(); 2]);
    for waypoint in plan.segments.iter().flat_map(|segment| &segment.waypoints) {
        assert!(positions.contains(&waypoint.joints));
    }
    let last = plan.segments.last().unwrap().waypoints.last().unwrap();
    assert!((*times.last().unwrap() as f64 * 1e-9 - last.time).abs() < 1e-9);
}

/// Of two waypoints at the same time the second is written: its torques are those of what comes.
#[test]
fn where_segments_meet_the_torques_of_the_next_are_written() {
    let mut plan = PLAN.clone();
    for (s, segment) in plan.segments.iter_mut().enumerate() {
        for waypoint in &mut segment.waypoints {
            waypoint.joint_torques = vec![s as f64; waypoint.joints.len()];
        }
    }
    let text = to_ros2(&plan).unwrap();
    let (efforts, times) = (lists(&text, "effort: "), times(&text));
    for (s, segment) in plan.segments.iter().enumerate() {
        let start = (segment.waypoints[0].time * 1e9).round() as u64;
        let at = times.iter().position(|&time| time == start).expect("every segment begins");
        assert_eq!(efforts[at][0], s as f64);
    }
}

/// A comment: controllers refuse joints that are not theirs.
#[test]
fn joints_that_stand_still_are_named_where_there_are_some() {
    let mut plan = PLAN.clone();
    let before = to_ros2(&plan).unwrap();
    plan.held_joints.extend([("wrist".to_owned(), 0.25), ("a\"b".to_owned(), -1.0)]);
    let text = to_ros2(&plan).unwrap();
    let line = "# Joints that have to stand still meanwhile: \"a\\\"b\" at -1, \"wrist\" at 0.25.\n";
    assert_eq!(text.replacen(line, "", 1), before);
    assert_ne!(text, before);
}

/// A point that is left out is a motion that is left out: nothing is dropped in silence.
#[test]
fn times_that_do_not_increase_are_refused() {
    let wrong = |change: &dyn Fn(&mut regrasp_plan::Plan)| {
        let mut plan = PLAN.clone();
        change(&mut plan);
        let refused = to_ros2(&plan).unwrap_err();
        assert_eq!(refused.code(), "C421");
        refused.to_string()
    };
    let backwards = wrong(&|plan| {
        for waypoint in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints) {
            waypoint.time = 100.0 - waypoint.time;
        }
    });
    assert!(backwards.starts_with("segment 0, waypoint 1 is at 9"), "{backwards}");
    let still = wrong(&|plan| plan.segments[0].waypoints[1].time = plan.segments[0].waypoints[0].time);
    assert_eq!(still, "segment 0, waypoint 1 is at 0.0 s, after a waypoint at 0.0 s");
    let late = wrong(&|plan| plan.segments.last_mut().unwrap().waypoints.last_mut().unwrap().time = 1e300);
    assert!(late.ends_with("which no trajectory holds"), "{late}");
    wrong(&|plan| plan.segments[0].waypoints[0].time = -1.0);
}
