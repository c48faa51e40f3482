//! A MuJoCo model of hand and object of a grasp list, with two keyframes for every grasp: the open hand and the grasp.

use crate::mjcf::{Mjcf, MjcfError, to_mjcf as model_of};
use regrasp_geometry::Pose;
use regrasp_plan::grasps::{GraspList, ListedGrasp};
use regrasp_plan::plan::{
    ContactMode, ContactState, MotionLimits, Plan, PoseData, Promises, Segment, Statistics, Waypoint,
};
use regrasp_scene::GraspScene;

/// The model of `list`. The hand stands at the world's origin; keyframe `0_2k` has the open hand of grasp k, keyframe `0_2k+1` the grasp.
/// Names are those of [`crate::to_mjcf`].
///
/// Errors: the list is not for this hand.
pub fn to_mjcf(scene: &GraspScene, list: &GraspList) -> Result<Mjcf, MjcfError> {
    model_of(&scene.manipulation(), &plan_of(list))
}

/// The list as one segment of waypoints. It is no plan that anybody could carry out.
fn plan_of(list: &GraspList) -> Plan {
    let promises = &list.promises;
    let n_joints = list.hand.joint_names.len();
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
            required_margin: promises.required_margin,
            kept_margin: promises.required_margin,
            torque_scale: promises.torque_scale,
            slip_tolerance: 0.0,
            tracking: None,
            motion: MotionLimits {
                largest_speed: 1.0,
                joint_velocities: vec![1.0; n_joints],
                joint_accelerations: vec![1.0; n_joints],
            },
            forces: None,
        },
        joint_names: list.hand.joint_names.clone(),
        fingers: list.hand.fingers.clone(),
        start: identity,
        way_poses: Vec::new(),
        goal: identity,
        asked: None,
        segments: vec![Segment::transfer(list.grasps.iter().flat_map(|grasp| waypoints(list, grasp)).collect())],
        statistics: Statistics::default(),
    }
}

/// The open hand, then the grasp.
fn waypoints(list: &GraspList, grasp: &ListedGrasp) -> [Waypoint; 2] {
    let pose = PoseData::from(&Pose::from(&grasp.object_from_hand).inverse());
    let contact_of = |finger: &String| {
        let contact = grasp.contacts.iter().find(|contact| contact.finger == *finger);
        contact.map_or(ContactState::FREE, |contact| {
            ContactState::at(ContactMode::Fixed, contact.point_in_object, contact.normal_in_object)
        })
    };
    let at = |joints: &[f64], contacts| Waypoint {
        time: 0.0,
        joints: joints.to_vec(),
        joint_velocities: vec![0.0; joints.len()],
        joint_torques: Vec::new(),
        world_from_object: pose,
        contacts,
    };
    let free = list.hand.fingers.iter().map(|_| ContactState::FREE).collect();
    [at(&grasp.open_joints, free), at(&grasp.joints, list.hand.fingers.iter().map(contact_of).collect())]
}
