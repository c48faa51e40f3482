//! Where object and fingertips are.

use arrayvec::ArrayVec;
use nalgebra::UnitQuaternion;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::contact::rolling::Touch;
use regrasp_manipulation::grasp::state::{Contacts, GraspState, HandJoints, MAX_FINGERS};
use regrasp_manipulation::model::Model;

/// One fingertip each.
pub type PerFinger<T> = ArrayVec<T, MAX_FINGERS>;

/// A grasp in which every fingertip, a ball, touches the object.
#[derive(Debug, Clone)]
pub struct TrackingGrasp {
    /// Object pose.
    pub world_from_object: Placement,
    /// Joints of all fingers.
    pub joints: HandJoints,
    /// Last links of the fingers, in the world.
    pub world_from_link: PerFinger<Placement>,
    /// Where the tips touch, in the object frame.
    pub touches: PerFinger<Touch>,
    /// Largest angle by which a moving tip was turned aside half-way to here.
    pub bent: f64,
}

impl TrackingGrasp {
    /// Of a grasp that all fingers hold; None where a tip's centre is inside the object.
    pub fn of(model: &Model, state: &GraspState) -> Option<Self> {
        let world_from_object = Placement::from(&state.world_from_object);
        let (mut world_from_link, mut touches) = (PerFinger::new(), PerFinger::new());
        for (finger, joints) in model.fingers.iter().zip(&state.joints) {
            let link = finger.ik.chain().last_frame(joints);
            let center = world_from_object.point_to_child(&link.point(finger.ik.center_in_body()));
            world_from_link.push(link);
            touches.push(Touch::of(&model.view.object.surface, &center)?);
        }
        Some(TrackingGrasp { world_from_object, joints: state.joints.clone(), world_from_link, touches, bent: 0.0 })
    }

    /// Contacts of all fingers.
    pub fn contacts(&self) -> Contacts {
        self.touches.iter().map(Touch::contact).collect()
    }

    /// Centre of a fingertip in the world.
    pub fn tip_in_world(&self, model: &Model, finger: usize) -> Point {
        self.world_from_link[finger].point(model.fingers[finger].ik.center_in_body())
    }

    /// The object's orientation in the world.
    pub fn orientation(&self) -> UnitQuaternion<f64> {
        self.world_from_object.to_pose().rotation
    }

    /// Rotation of a finger's last link as seen from the object.
    pub fn object_from_link(&self, finger: usize) -> nalgebra::Matrix3<f64> {
        self.world_from_object.rotation.tr_mul(&self.world_from_link[finger].rotation)
    }

    /// The contact's outward normal in the world.
    pub fn normal_in_world(&self, finger: usize) -> Vector {
        self.world_from_object.vector(&self.touches[finger].ball.normal)
    }
}

/// Rotation vector, in the world, that turns `from` into `to`.
pub fn turn_to(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Vector {
    (to * from.inverse()).scaled_axis()
}
