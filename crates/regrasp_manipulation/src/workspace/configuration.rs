//! Where everything is at one moment.

use crate::grasp::state::HandJoints;
use crate::model::{Carrier, Model};
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Pose, interpolate_pose};
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// A configuration: placements of all bodies but obstacles and the numbers they came from.
#[derive(Debug, Clone)]
pub struct Configuration {
    pub joints: HandJoints,
    pub world_from_object: Pose,
    pub placements: Vec<Placement>,
    /// Centres of the bodies' bounding balls, in the world.
    pub centers: Vec<Point>,
}

impl Configuration {
    /// Placement of a body in the world.
    #[inline]
    pub fn at<'s>(&'s self, model: &'s Model, body: usize) -> &'s Placement {
        self.placements.get(body).unwrap_or_else(|| &model.bodies[body].carrier_from_body)
    }

    /// Centre of a body's bounding ball, in the world.
    #[inline]
    pub fn center(&self, model: &Model, body: usize) -> Point {
        match self.centers.get(body) {
            Some(center) => *center,
            None => model.bodies[body].carrier_from_body.point(&model.bodies[body].center),
        }
    }

    #[inline]
    fn place(&mut self, model: &Model, body: usize, world_from_carrier: &Placement) {
        let placement = world_from_carrier.then(&model.bodies[body].carrier_from_body);
        self.centers[body] = placement.point(&model.bodies[body].center);
        self.placements[body] = placement;
    }
}

/// Puts the object at a pose.
pub fn place_object(model: &Model, configuration: &mut Configuration, world_from_object: &Pose) {
    configuration.world_from_object = *world_from_object;
    configuration.place(model, model.object, &Placement::from(world_from_object));
}

/// Puts the bodies of a finger where its joints say.
pub fn place_finger(model: &Model, configuration: &mut Configuration, finger: usize, joints: &Coordinates) {
    configuration.joints[finger].clone_from(joints);
    let chain = model.fingers[finger].ik.chain();
    let mut frames = [Placement::IDENTITY; MAX_BODIES];
    let n_bodies = chain.joints.len();
    chain.forward_frames(joints, &mut frames[..n_bodies]);
    for index in model.fingers[finger].bodies.clone() {
        let Carrier::Finger { link, .. } = model.bodies[index].carrier else { unreachable!("bodies of a finger") };
        configuration.place(model, index, &frames[link]);
    }
}

/// Most moving joints of a finger.
const MAX_BODIES: usize = regrasp_robot::hand::MAX_FINGER_JOINTS;

/// The configuration in the middle of a step.
pub fn midway(model: &Model, from: &Configuration, to: &Configuration) -> Configuration {
    let mut middle = from.clone();
    place_object(model, &mut middle, &interpolate_pose(&from.world_from_object, &to.world_from_object, 0.5));
    for finger in 0..model.n_fingers() {
        let joints: Coordinates =
            from.joints[finger].iter().zip(&to.joints[finger]).map(|(a, b)| 0.5 * (a + b)).collect();
        place_finger(model, &mut middle, finger, &joints);
    }
    middle
}
