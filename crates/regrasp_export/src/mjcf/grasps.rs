//! A MuJoCo model of hand and object of a grasp list, with two keyframes for every grasp: the open hand and the grasp.
//!
//! Convex parts of the object leave free where fingertips touch and where links pass.

use super::clear::{LinkShape, Touch, around_tips, beside_links};
use super::solid::ObjectSolid;
use super::{Mjcf, MjcfError, model, must_be_of_hand};
use regrasp_geometry::Pose;
use regrasp_geometry::parts::Clear;
use regrasp_plan::grasps::{GraspList, ListedContact, ListedGrasp};
use regrasp_plan::plan::{ContactMode, ContactState, Plan, PoseData, Waypoint};
use regrasp_robot::Hand;
use regrasp_scene::{GraspScene, Object};

/// Parts of the way between the open hand and the grasp at whose ends links are looked at.
const MOMENTS: usize = 4;

/// The model of `list`. The hand stands at the world's origin; keyframe `0_2k` has the open hand of grasp k, keyframe `0_2k+1` the grasp.
/// Names are those of [`crate::to_mjcf`].
///
/// Errors: the list is not for this hand.
pub fn to_mjcf(scene: &GraspScene, list: &GraspList) -> Result<Mjcf, MjcfError> {
    let task = scene.manipulation();
    must_be_of_hand(&task, &list.hand.joint_names, &list.hand.fingers)?;
    let solid = |(index, object): (usize, &Object)| match index == task.object_index {
        true => ObjectSolid::of_list(object, &beside_hand(task.hand(), object, list)),
        false => ObjectSolid::of(object),
    };
    let solids: Vec<ObjectSolid> = task.scene.objects.iter().enumerate().map(solid).collect();
    let all_waypoints = list.grasps.iter().flat_map(|grasp| waypoints(list, grasp)).collect();
    Ok(model::write(&task, &Plan::of_grasps(list, all_waypoints), &solids))
}

/// Where fingertips touch and links pass, in the object's frame.
fn beside_hand(hand: &Hand, object: &Object, list: &GraspList) -> Vec<Clear> {
    if object.surface.mesh().is_none() {
        return Vec::new();
    }
    let touch = |contact: &ListedContact| {
        let finger = &hand.fingers[hand.finger_named(&contact.finger)?.0];
        Some(Touch::of(finger, contact.point_in_object, contact.normal_in_object))
    };
    let touches: Vec<Touch> = list.grasps.iter().flat_map(|grasp| &grasp.contacts).filter_map(touch).collect();
    let moments = list.grasps.iter().flat_map(|grasp| {
        (0..=MOMENTS).map(|k| {
            let share = k as f64 / MOMENTS as f64;
            let ends = grasp.open_joints.iter().zip(&grasp.joints);
            let joints: Vec<f64> = ends.map(|(open, closed)| open + share * (closed - open)).collect();
            object_from_links(hand, &Pose::from(&grasp.object_from_hand), &joints)
        })
    });
    let mut clear = around_tips(&object.surface, &touches);
    clear.extend(beside_links(&object.surface, &link_shapes(hand), moments));
    clear
}

/// Shapes of the palm, then of the bodies of all fingers.
fn link_shapes(hand: &Hand) -> Vec<LinkShape> {
    let mut shapes: Vec<LinkShape> = hand.palm.iter().filter_map(|palm| LinkShape::new(0, &palm.placed)).collect();
    let mut first = 1;
    for finger in &hand.fingers {
        shapes.extend(finger.shapes.iter().filter_map(|shape| LinkShape::new(first + shape.body, &shape.placed)));
        first += finger.chain.joints.len();
    }
    shapes
}

/// Poses of the palm and of the bodies of all fingers, in the order of [`link_shapes`].
fn object_from_links(hand: &Hand, object_from_hand: &Pose, joints: &[f64]) -> Vec<Pose> {
    let mut poses = vec![*object_from_hand];
    let (mut of_finger, mut first) = (Vec::new(), 0);
    for finger in &hand.fingers {
        let end = first + finger.chain.n_coordinates();
        finger.chain.forward(&joints[first..end], &mut of_finger);
        poses.extend(of_finger.iter().map(|hand_from_body| object_from_hand * hand_from_body));
        first = end;
    }
    poses
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
