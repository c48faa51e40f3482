//! The plan as it is written to a file.

use super::legs::Solution;
use super::model::Model;
use super::state::{Motion, Sequence};
use super::workspace::{Contacts, HandJoints};
use regrasp_geometry::Pose;
use regrasp_grasp::Contact;
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
    let mut state = start;
    for step in way.steps() {
        match step.motion() {
            Motion::Transfer(moments) => {
                statistics.transfers += 1;
                statistics.transfers_with_free_fingers += u64::from(!state.is_held_by_all());
                let contacts = contact_states(&state.contacts, state.holding);
                let held = |pose: &Pose, joints: &HandJoints| waypoint(pose, joints, &contacts);
                let mut waypoints = Vec::with_capacity(1 + moments.len());
                waypoints.push(held(&state.world_from_object, &state.joints));
                waypoints.extend(moments.iter().map(|m| held(&m.world_from_object, &m.joints)));
                segments.push(Segment { kind: SegmentKind::Transfer, moving_finger: None, waypoints });
            }
            Motion::Regrasp { finger, path } => {
                let end = step.end();
                statistics.relocations += u64::from(end.holds(*finger));
                let pose = &state.world_from_object;
                let contacts = contact_states(&end.contacts, state.holding & !(1 << finger));
                let mut waypoints = Vec::with_capacity(1 + path.len());
                waypoints.push(waypoint(pose, &state.joints, &contact_states(&state.contacts, state.holding)));
                let mut joints = state.joints.clone();
                for at in path {
                    joints[*finger].clone_from(at);
                    waypoints.push(waypoint(pose, &joints, &contacts));
                }
                if let Some(last) = waypoints.last_mut() {
                    last.contacts = contact_states(&end.contacts, end.holding);
                }
                let name = scene.hand.fingers[*finger].name.clone();
                segments.push(Segment { kind: SegmentKind::Regrasp, moving_finger: Some(name), waypoints });
            }
        }
        state = step.end();
    }
    if segments.is_empty() {
        // Start and goal are the same and any grasp will do: hold still.
        let here = waypoint(&start.world_from_object, &start.joints, &contact_states(&start.contacts, start.holding));
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
            kept_margin: kept_margin(model, way),
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

/// The smallest closure margin of the fingers that hold, at any moment: that is what a plan promises.
pub fn kept_margin(model: &Model, way: &Sequence) -> f64 {
    let mut kept = model.closure_margin(&way.end().contacts, way.end().holding);
    for (index, step) in way.steps().iter().enumerate() {
        let before = way.state_before(index);
        let holding = match step.motion() {
            Motion::Transfer(_) => before.holding,
            Motion::Regrasp { finger, .. } => before.holding & !(1 << finger),
        };
        kept = kept.min(model.closure_margin(&before.contacts, holding));
    }
    kept
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

fn waypoint(pose: &Pose, joints: &HandJoints, contacts: &[ContactState]) -> Waypoint {
    let mut all = Vec::with_capacity(joints.iter().map(|own| own.len()).sum());
    joints.iter().for_each(|own| all.extend_from_slice(own));
    Waypoint { joints: all, world_from_object: PoseData::from(pose), contacts: contacts.to_vec() }
}

fn contact_states(contacts: &Contacts, holding: u32) -> Vec<ContactState> {
    let state = |(finger, contact): (usize, &Contact)| {
        if holding & (1 << finger) == 0 {
            ContactState { mode: ContactMode::Free, point_in_object: None, normal_in_object: None }
        } else {
            ContactState {
                mode: ContactMode::Fixed,
                point_in_object: Some(contact.point_in_object.coords.into()),
                normal_in_object: Some(contact.normal_in_object.into_inner().into()),
            }
        }
    };
    contacts.iter().enumerate().map(state).collect()
}
