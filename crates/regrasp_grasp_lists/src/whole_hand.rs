//! A hand that a robot carries, with all that its own file hangs on it: links above the hand's base, such as a forearm, move with
//! the hand here, and must not hit the object either. The palm of a hand that stands by itself has them already. Joints on no
//! finger rest at the allowed position nearest to zero.

use regrasp_geometry::Pose;
use regrasp_geometry::shape::PlacedShape;
use regrasp_robot::hand::{PalmShape, convex_of};
use regrasp_robot::{Hand, Joint, JointId, LinkId, Robot};
use std::collections::BTreeSet;

/// `hand` with the links that belong neither to its palm nor to a finger as further palm. Errors: a link whose shape has no
/// inside, in words.
pub fn whole_hand(hand: &Hand) -> Result<Hand, String> {
    let robot = &hand.robot;
    let mut known: BTreeSet<LinkId> = hand.palm.iter().map(|palm| palm.link).collect();
    known.extend(hand.fingers.iter().flat_map(|finger| finger.shapes.iter().map(|shape| shape.link)));
    let moving: BTreeSet<&String> = hand.fingers.iter().flat_map(|finger| &finger.chain.names).collect();
    let base_from_root = at_rest(robot, hand.base).inverse();
    let mut whole = hand.clone();
    for (index, link) in robot.links.iter().enumerate() {
        let id = LinkId(index);
        let is_moved =
            |joint: &JointId| drivers(robot, *joint).any(|leader| moving.contains(&robot.joints[leader.0].name));
        if known.contains(&id) || link.collision.is_empty() || robot.joints_to(id).iter().any(is_moved) {
            continue;
        }
        let base_from_link = base_from_root * at_rest(robot, id);
        for placed in &link.collision {
            let shape = convex_of(&placed.shape).map_err(|error| format!("link \"{}\": {error}", link.name))?;
            let parent_from_shape = base_from_link * placed.parent_from_shape;
            whole.palm.push(PalmShape { link: id, placed: PlacedShape { parent_from_shape, shape } });
        }
    }
    Ok(whole)
}

/// A joint, or those that it follows.
fn drivers(robot: &Robot, id: JointId) -> impl Iterator<Item = JointId> + '_ {
    let coupling = robot.joints[id.0].coupling.as_ref();
    let leaders = coupling.into_iter().flat_map(|coupling| coupling.terms.iter().map(|(leader, _)| *leader));
    leaders.chain(coupling.is_none().then_some(id))
}

/// Pose of a link in the root's frame while all joints rest.
fn at_rest(robot: &Robot, link: LinkId) -> Pose {
    let along = |pose: Pose, id: JointId| {
        let joint = &robot.joints[id.0];
        pose * joint.parent_from_joint * joint.motion(rest_of(robot, joint))
    };
    robot.joints_to(link).into_iter().fold(Pose::identity(), along)
}

/// The allowed position nearest to zero.
fn rest_of(robot: &Robot, joint: &Joint) -> f64 {
    let own = |joint: &Joint| joint.limits.map_or(0.0, |limits| 0f64.max(limits.lower).min(limits.upper));
    match &joint.coupling {
        None => own(joint),
        Some(coupling) => {
            let followed = coupling.terms.iter().map(|(leader, factor)| factor * own(&robot.joints[leader.0]));
            followed.sum::<f64>() + coupling.offset
        }
    }
}
