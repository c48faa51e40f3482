//! The kind of a roadmap file is what its format says, not what stands elsewhere in it (found by fuzzing).

use regrasp::robot_roadmap::RobotRoadmap;
use std::path::Path;

fn read(text: &str) -> Result<RobotRoadmap, regrasp::InputError> {
    RobotRoadmap::from_json(Path::new("scene.toml.roadmap.json"), text)
}

#[test]
fn kind_is_what_the_format_says() {
    let graph = include_str!("../../../fuzz/seeds/robot_roadmap/graph.json");
    let task = include_str!("../../../fuzz/seeds/robot_roadmap/task.json");
    let named = graph.replace(r#""robot":""#, r#""robot":"regrasp-task-roadmap "#);
    assert_ne!(named, graph);
    for text in [graph, &named] {
        let roadmap = read(text).unwrap();
        assert!(matches!(roadmap, RobotRoadmap::Motion(_)));
        assert_eq!(read(&roadmap.to_json()).unwrap().to_json(), roadmap.to_json());
    }
    assert!(matches!(read(task), Ok(RobotRoadmap::Task(_))));
    for broken in ["", "{}", "[1]", r#"{"format":"regrasp-task-roadmap"}"#] {
        assert_eq!(read(broken).unwrap_err().diagnostics[0].code, "R601", "{broken}");
    }
}
