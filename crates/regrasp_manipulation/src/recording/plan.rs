//! The plan as it is written to a file.

use regrasp_plan::plan::{FORMAT, FORMAT_VERSION, Plan, PlanInput, PoseData, Promises, Segment, Statistics};
use regrasp_scene::{InHandQuery, Scene};

pub(super) fn finger_names(scene: &Scene) -> Vec<String> {
    scene.hand.fingers.iter().map(|finger| finger.name.clone()).collect()
}

/// A plan of `segments` for a query; method, seed, settings, way poses and statistics are left to be said.
pub fn plan_of(scene: &Scene, query: &InHandQuery, promises: Promises, segments: Vec<Segment>) -> Plan {
    Plan {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        tool: concat!("regrasp ", env!("CARGO_PKG_VERSION")).into(),
        task: query.task.name().into(),
        method: String::new(),
        seed: 0,
        settings: serde_json::Value::Null,
        inputs: scene
            .inputs
            .iter()
            .map(|i| PlanInput { role: i.role.clone(), name: i.name.clone(), sha256: i.sha256.clone() })
            .collect(),
        promises,
        joint_names: scene.hand.joint_names(),
        fingers: finger_names(scene),
        start: PoseData::from(&query.world_from_object_start),
        way_poses: Vec::new(),
        goal: PoseData::from(&query.world_from_object_goal),
        segments,
        statistics: Statistics::default(),
    }
}
