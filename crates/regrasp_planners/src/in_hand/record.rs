//! The plan as it is written to a file.

use super::legs::Solution;
use super::model::{MAX_FINGERS, Model};
use super::state::Motion;
use super::workspace::{Contacts, HandJoints};
use regrasp_geometry::Pose;
use regrasp_plan::plan::{
    ContactMode, ContactState, FORMAT, FORMAT_VERSION, Plan, PlanInput, PoseData, Promises, Segment, SegmentKind,
    Statistics, WayPose, Waypoint,
};
use regrasp_scene::InHandQuery;

/// Largest distance of a holding fingertip from its contact that plans promise, in metres (issue: at most 0.5 mm).
pub const CONTACT_TOLERANCE: f64 = 0.0005;

/// Makes the plan of `solution`.
pub fn record(model: &Model, query: &InHandQuery, seed: u64, solution: &Solution, mut statistics: Statistics) -> Plan {
    let scene = model.scene;
    let Solution { way, steps_to_way } = solution;
    let start = way.start();
    let mut segments = Vec::with_capacity(way.steps().len());
    let mut kept_margin = model.closure_margin(&start.contacts, model.all_fingers());
    let mut state = start;
    for step in way.steps() {
        match step.motion() {
            Motion::Transfer(moments) => {
                statistics.transfers += 1;
                kept_margin = kept_margin.min(model.closure_margin(&state.contacts, model.all_fingers()));
                let mut waypoints = Vec::with_capacity(1 + moments.len());
                waypoints.push(waypoint(&state.world_from_object, &state.joints, &state.contacts, None));
                waypoints
                    .extend(moments.iter().map(|m| waypoint(&m.world_from_object, &m.joints, &state.contacts, None)));
                segments.push(Segment { kind: SegmentKind::Transfer, moving_finger: None, waypoints });
            }
            Motion::Regrasp { finger, path } => {
                statistics.relocations += 1;
                let holding = model.all_fingers() & !(1 << finger);
                kept_margin = kept_margin.min(model.closure_margin(&state.contacts, holding));
                let mut waypoints = Vec::with_capacity(1 + path.len());
                waypoints.push(waypoint(&state.world_from_object, &state.joints, &state.contacts, None));
                let mut joints = state.joints.clone();
                for (k, at) in path.iter().enumerate() {
                    joints[*finger].clone_from(at);
                    let is_last = k + 1 == path.len();
                    let (contacts, free) =
                        if is_last { (&step.end().contacts, None) } else { (&state.contacts, Some(*finger)) };
                    waypoints.push(waypoint(&state.world_from_object, &joints, contacts, free));
                }
                let name = scene.hand.fingers[*finger].name.clone();
                segments.push(Segment { kind: SegmentKind::Regrasp, moving_finger: Some(name), waypoints });
            }
        }
        state = step.end();
    }
    kept_margin = kept_margin.min(model.closure_margin(&state.contacts, model.all_fingers()));
    if segments.is_empty() {
        // Start and goal are the same and any grasp will do: hold still.
        let here = waypoint(&start.world_from_object, &start.joints, &start.contacts, None);
        let waypoints = vec![here.clone(), here];
        segments.push(Segment { kind: SegmentKind::Transfer, moving_finger: None, waypoints });
    }
    Plan {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        tool: concat!("regrasp ", env!("CARGO_PKG_VERSION")).into(),
        task: "in_hand".into(),
        method: serde_json::to_value(model.settings.method)
            .ok()
            .and_then(|value| value.as_str().map(str::to_owned))
            .unwrap_or_default(),
        seed,
        settings: serde_json::to_value(&model.settings).unwrap_or_default(),
        inputs: scene
            .inputs
            .iter()
            .map(|i| PlanInput { role: i.role.clone(), name: i.name.clone(), sha256: i.sha256.clone() })
            .collect(),
        promises: Promises {
            contact_tolerance: CONTACT_TOLERANCE,
            friction: model.frame.friction,
            required_margin: model.settings.closure_margin,
            kept_margin,
            torque_scale: model.frame.torque_scale,
        },
        joint_names: scene.hand.joint_names(),
        fingers: scene.hand.fingers.iter().map(|finger| finger.name.clone()).collect(),
        start: PoseData::from(&query.world_from_object_start),
        way_poses: way_poses(query, &segments, steps_to_way),
        goal: PoseData::from(&query.world_from_object_goal),
        segments,
        statistics,
    }
}

/// Each way pose with the last waypoint of the leg that leads to it; every step is a segment.
fn way_poses(query: &InHandQuery, segments: &[Segment], steps_to_way: &[usize]) -> Vec<WayPose> {
    let passed = |&n_steps: &usize| match n_steps.checked_sub(1) {
        Some(segment) => (segment, segments[segment].waypoints.len() - 1),
        None => (0, 0),
    };
    let poses = query.world_from_object_way.iter().zip(steps_to_way.iter().map(passed));
    poses
        .map(|(pose, (segment, waypoint))| WayPose { world_from_object: PoseData::from(pose), segment, waypoint })
        .collect()
}

fn waypoint(pose: &Pose, joints: &HandJoints, contacts: &Contacts, free: Option<usize>) -> Waypoint {
    Waypoint {
        joints: joints.iter().map(|own| &own[..]).collect::<arrayvec::ArrayVec<_, MAX_FINGERS>>().concat(),
        world_from_object: PoseData::from(pose),
        contacts: contacts
            .iter()
            .enumerate()
            .map(|(finger, contact)| {
                if free == Some(finger) {
                    ContactState { mode: ContactMode::Free, point_in_object: None, normal_in_object: None }
                } else {
                    ContactState {
                        mode: ContactMode::Fixed,
                        point_in_object: Some(contact.point_in_object.coords.into()),
                        normal_in_object: Some(contact.normal_in_object.into_inner().into()),
                    }
                }
            })
            .collect(),
    }
}
