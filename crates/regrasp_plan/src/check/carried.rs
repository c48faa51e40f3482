//! Hands that robots carry: where they stand, which links are theirs, and where the links of the robot are. By the checker's own
//! kinematics.

use crate::check::kinematics::{Path, pose_of};
use regrasp_geometry::Pose;
use regrasp_robot::{JointKind, LinkId, Manipulator, Robot};
use regrasp_scene::Manipulation;

/// Where the base of the hand of `task` stands in the world.
pub fn world_from_base(task: &Manipulation) -> Result<Pose, String> {
    let placed = task.placed_hand();
    let Some(carrier) = placed.carrier else { return Ok(placed.world_from_hand) };
    let robot = &task.scene.robots[carrier.robot];
    let joints = task.state.joints_of_robot(task.scene, carrier.robot);
    let base = robot.hands[carrier.hand].hand.base;
    let path = Path::new(&robot.robot, base, robot.world_from_root(), &robot.layout.names())?;
    Ok(pose_of(&path.world_from_link(&joints)))
}

/// The links of a robot that belong to none of its hands, with their poses in the world.
pub fn links_of_no_hand(task: &Manipulation, index: usize) -> Result<Vec<(LinkId, Pose)>, String> {
    let robot = &task.scene.robots[index];
    let joints = task.state.joints_of_robot(task.scene, index);
    let names = robot.layout.names();
    let is_of_a_hand = |link| robot.hands.iter().any(|hand| is_below(&robot.robot, hand.top, link));
    let others = (0..robot.robot.links.len()).map(LinkId).filter(|link| !is_of_a_hand(*link));
    let placed = |link| {
        let path = Path::new(&robot.robot, link, robot.world_from_root(), &names)?;
        Ok((link, pose_of(&path.world_from_link(&joints))))
    };
    others.map(placed).collect()
}

/// Whether a link of the robot moves with the hand of `task`: it is below the hand's first link, or of the robot and with no moving
/// joint between it and the hand's base. Of a hand that stands by itself all links do.
pub fn is_of_hand(task: &Manipulation, link: LinkId) -> bool {
    let Some(carrier) = task.placed_hand().carrier else { return true };
    let robot = &task.scene.robots[carrier.robot];
    let own = &robot.hands[carrier.hand];
    let is_of_a_hand = robot.hands.iter().any(|hand| is_below(&robot.robot, hand.top, link));
    match is_of_a_hand {
        true => is_below(&robot.robot, own.top, link),
        false => is_rigid_with(robot, link, own.hand.base),
    }
}

/// Number of moving joints above the base of the hand of `task` that belong to the robot that carries it.
pub fn joints_above_base(task: &Manipulation) -> usize {
    let Some(carrier) = task.placed_hand().carrier else { return 0 };
    let robot = &task.scene.robots[carrier.robot];
    moving_joints(&robot.robot, robot.hands[carrier.hand].hand.base).count()
}

/// True when no moving joint lies between two links.
pub fn is_rigid_with(robot: &Manipulator, a: LinkId, b: LinkId) -> bool {
    moving_joints(&robot.robot, a).eq(moving_joints(&robot.robot, b))
}

fn moving_joints(robot: &Robot, link: LinkId) -> impl Iterator<Item = usize> + '_ {
    let joints = robot.joints_to(link).into_iter().map(|id| id.0);
    joints.filter(|joint| robot.joints[*joint].kind != JointKind::Fixed)
}

/// True when `link` is `top` or a link that it carries.
fn is_below(robot: &Robot, top: LinkId, link: LinkId) -> bool {
    link == top || robot.joints_to(link).iter().any(|id| robot.joints[id.0].child == top)
}
