//! A hand by itself among what rests: where it collides, no posture of its arm helps.

use crate::context::Context;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Pose, Shape};
use regrasp_robot::manipulator::layout::Part;

/// A state with other joints of one hand's fingers.
pub fn with_fingers(context: &Context, state: &[f64], hand: usize, joints: &[f64]) -> Vec<f64> {
    let mut state = state.to_vec();
    state[context.hands[hand].fingers.clone()].copy_from_slice(joints);
    state
}

/// Links of a hand: their indices, and where they are in the frame of its base.
pub type HandLinks = Vec<(usize, Pose)>;

/// The links of a hand with these joints of its fingers.
pub fn links_of(context: &Context, hand: usize, fingers: &[f64]) -> HandLinks {
    let robot = context.robot;
    let mounted = context.hands[hand].mounted;
    let mut poses = Vec::new();
    robot.link_poses(&with_fingers(context, &context.query.start, hand, fingers), &mut poses);
    let base_from_world = poses[robot.hands[mounted].hand.base.0].inverse();
    let is_own = |link: &usize| robot.part_of(regrasp_robot::LinkId(*link)) == Part::Hand(mounted);
    (0..poses.len()).filter(is_own).map(|link| (link, base_from_world * poses[link])).collect()
}

/// False where a link is not proved to keep the clearance to what rests, the object left out.
pub fn is_hand_clear(context: &Context, links: &HandLinks, world_from_hand: &Pose) -> bool {
    let clearance = context.settings.clearance;
    let worlds = &context.fixed;
    links.iter().all(|(link, hand_from_link)| {
        let cover = &context.covers.links[*link];
        if cover.balls.is_empty() {
            return true;
        }
        let world_from_link = world_from_hand * hand_from_link;
        let at_bound = Placement::from(&Pose::from_parts(
            (world_from_link * cover.bound.0).coords.into(),
            nalgebra::UnitQuaternion::identity(),
        ));
        let bound = Shape::Sphere { radius: cover.bound.1 };
        (0..worlds.obstacles.len()).all(|other| {
            worlds.is_apart(other, &bound, &at_bound, clearance)
                || cover.shapes.iter().all(|placed| {
                    let at = Placement::from(&(world_from_link * placed.parent_from_shape));
                    worlds.is_apart(other, &placed.shape, &at, clearance)
                })
        })
    })
}
