//! The plan as it is written to a file.

use regrasp_geometry::Pose;
use regrasp_plan::plan::{FORMAT, FORMAT_VERSION, Plan, PlanInput, PoseData, Promises, Segment, Statistics};
use regrasp_scene::HandView;

pub(super) fn finger_names(view: &HandView) -> Vec<String> {
    view.hand.fingers.iter().map(|finger| finger.name.clone()).collect()
}

/// A plan of `segments` for a task with the object's poses at its `ends`; method, seed, settings, way poses and statistics are
/// left to be said. The hand holds the object all along.
pub fn plan_of(view: &HandView, task: &str, ends: [&Pose; 2], promises: Promises, segments: Vec<Segment>) -> Plan {
    Plan {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        tool: concat!("regrasp ", env!("CARGO_PKG_VERSION")).into(),
        task: task.into(),
        query: String::new(),
        hand: view.hand_name.into(),
        object: view.object.name.clone(),
        method: String::new(),
        seed: 0,
        settings: serde_json::Value::Null,
        inputs: view
            .inputs
            .iter()
            .map(|i| PlanInput { role: i.role.clone(), name: i.name.clone(), sha256: i.sha256.clone() })
            .collect(),
        promises,
        joint_names: view.hand.joint_names(),
        held_joints: view.held_joints.clone(),
        fingers: finger_names(view),
        start: PoseData::from(ends[0]),
        asked: None,
        way_poses: Vec::new(),
        goal: PoseData::from(ends[1]),
        segments: segments
            .into_iter()
            .map(|segment| Segment { held_by: vec![view.hand_name.to_owned()], ..segment })
            .collect(),
        statistics: Statistics::default(),
    }
}
