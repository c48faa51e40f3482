//! A grasp list as a plan of waypoints: what judges plans judges it.

use crate::plan::{ContactMode, ContactState, ForcePromises, Plan, PoseData, Waypoint};
use regrasp_geometry::Pose;
use regrasp_grasp::list::{GraspList, ListedGrasp};

/// The list as a plan with one waypoint for each grasp.
pub(super) fn plan_of(list: &GraspList) -> Plan {
    let waypoints = list.grasps.iter().map(|grasp| grasp_waypoint(list, grasp)).collect();
    let mut plan = Plan::of_grasps(list, waypoints);
    plan.promises.required_margin = plan.promises.required_margin.max(0.0);
    plan.promises.kept_margin = plan.promises.required_margin;
    plan.promises.forces = Some(ForcePromises {
        mass: list.object.mass,
        gravity_in_world: None,
        normal_force: list.promises.normal_force,
        joint_torques: list.promises.joint_torques.clone(),
    });
    plan
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
