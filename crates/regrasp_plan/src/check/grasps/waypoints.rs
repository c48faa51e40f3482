//! A grasp list as a plan of waypoints: what judges plans judges it.

use crate::plan::{
    ContactMode, ContactState, ForcePromises, MotionLimits, Plan, PoseData, Promises, Segment, Statistics, Waypoint,
};
use regrasp_geometry::Pose;
use regrasp_grasp::list::{GraspList, ListedGrasp};

/// The list as a plan: one segment with one waypoint for each grasp. It is no plan that anybody could carry out.
pub(super) fn plan_of(list: &GraspList) -> Plan {
    let promises = &list.promises;
    let n_joints = list.hand.joint_names.len();
    let waypoints = list.grasps.iter().map(|grasp| grasp_waypoint(list, grasp)).collect();
    let identity = PoseData::from(&Pose::identity());
    Plan {
        format: list.format.clone(),
        format_version: list.format_version,
        tool: list.tool.clone(),
        task: String::new(),
        query: String::new(),
        hand: list.hand.name.clone(),
        object: list.object.name.clone(),
        method: String::new(),
        seed: list.seed,
        settings: serde_json::Value::Null,
        inputs: list.inputs.clone(),
        promises: Promises {
            contact_tolerance: promises.contact_tolerance,
            friction: promises.friction,
            friction_margin: promises.friction_margin,
            required_margin: promises.required_margin.max(0.0),
            kept_margin: promises.required_margin.max(0.0),
            torque_scale: promises.torque_scale,
            slip_tolerance: 0.0,
            tracking: None,
            motion: MotionLimits {
                largest_speed: 1.0,
                joint_velocities: vec![1.0; n_joints],
                joint_accelerations: vec![1.0; n_joints],
            },
            forces: Some(ForcePromises {
                mass: list.object.mass,
                gravity_in_world: None,
                normal_force: promises.normal_force,
                joint_torques: promises.joint_torques.clone(),
            }),
        },
        joint_names: list.hand.joint_names.clone(),
        held_joints: list.hand.held_joints.clone(),
        fingers: list.hand.fingers.clone(),
        start: identity,
        asked: None,
        way_poses: Vec::new(),
        goal: identity,
        segments: vec![Segment::transfer(waypoints)],
        statistics: Statistics::default(),
    }
}

/// The object in the hand frame: the hand stands still.
pub(super) fn hand_from_object(grasp: &ListedGrasp) -> Pose {
    Pose::from(&grasp.object_from_hand).inverse()
}

/// The grasp as a waypoint.
fn grasp_waypoint(list: &GraspList, grasp: &ListedGrasp) -> Waypoint {
    let contact_of = |finger: &String| {
        let Some(contact) = grasp.contacts.iter().find(|contact| contact.finger == *finger) else {
            return ContactState::FREE;
        };
        ContactState {
            force_in_object: Some(contact.force_in_object),
            torsion: contact.torsion,
            ..ContactState::at(ContactMode::Fixed, contact.point_in_object, contact.normal_in_object)
        }
    };
    Waypoint {
        joint_torques: grasp.joint_torques.clone(),
        contacts: list.hand.fingers.iter().map(contact_of).collect(),
        ..resting(&grasp.joints, &hand_from_object(grasp), 0.0)
    }
}

/// A waypoint at which everything rests and nothing holds.
fn resting(joints: &[f64], world_from_object: &Pose, time: f64) -> Waypoint {
    Waypoint {
        time,
        joints: joints.to_vec(),
        joint_velocities: vec![0.0; joints.len()],
        joint_torques: Vec::new(),
        world_from_object: PoseData::from(world_from_object),
        contacts: Vec::new(),
    }
}

/// The way in, as three moments: before the line, at its end, and the grasp.
pub(super) fn way_of(grasp: &ListedGrasp) -> [Waypoint; 3] {
    let pose = hand_from_object(grasp);
    let direction = regrasp_geometry::Vector::from(grasp.approach.direction_in_object);
    let shift = pose.rotation * direction * grasp.approach.distance;
    let before = nalgebra::Translation3::from(shift) * pose;
    [
        resting(&grasp.open_joints, &before, 0.0),
        resting(&grasp.open_joints, &pose, 1.0),
        resting(&grasp.joints, &pose, 2.0),
    ]
}
