//! Links that move together.

use crate::robot::{JointKind, LinkId, Robot};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::Pose;

/// Links that move with `link` and hang below it, with their poses in its frame.
pub(super) fn rigid_links(robot: &Robot, link: LinkId) -> Vec<(LinkId, Pose)> {
    let identity = Pose::from_parts(Translation3::identity(), UnitQuaternion::identity());
    let mut links = vec![(link, identity)];
    let mut next = 0;
    while next < links.len() {
        let (current, pose) = links[next];
        for id in robot.joints_from(current) {
            let joint = &robot.joints[id.0];
            if joint.kind == JointKind::Fixed {
                links.push((joint.child, pose * joint.parent_from_joint));
            }
        }
        next += 1;
    }
    links
}
