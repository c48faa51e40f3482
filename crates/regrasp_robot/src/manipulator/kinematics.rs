//! Forward kinematics of a tree.

use super::layout::JointLayout;
use crate::coupling::Coupling;
use crate::robot::{LinkId, Robot};
use regrasp_geometry::Pose;
use std::sync::Arc;

/// The way from a link's parent to the link.
#[derive(Debug, Clone)]
struct LinkStep {
    parent: usize,
    /// Index in `Robot::joints`.
    joint: usize,
    /// Coordinates that drive the joint; none for a fixed joint.
    drive: Option<Coupling<usize>>,
}

/// The tree as forward kinematics wants it.
#[derive(Debug, Clone)]
pub(super) struct TreeKinematics {
    robot: Arc<Robot>,
    n_coordinates: usize,
    /// Links, each after its parent.
    order: Vec<usize>,
    /// By link; none for the root.
    steps: Vec<Option<LinkStep>>,
}

impl TreeKinematics {
    pub(super) fn new(robot: &Arc<Robot>, layout: &JointLayout) -> Self {
        let mut steps: Vec<Option<LinkStep>> = robot.links.iter().map(|_| None).collect();
        for (joint, of_robot) in robot.joints.iter().enumerate() {
            let drive = layout.drive_of(robot, joint);
            steps[of_robot.child.0] = Some(LinkStep { parent: of_robot.parent.0, joint, drive });
        }
        let mut order = vec![robot.root.0];
        let mut next = 0;
        while next < order.len() {
            let children = robot.joints_from(LinkId(order[next])).map(|joint| robot.joints[joint.0].child.0);
            order.extend(children);
            next += 1;
        }
        TreeKinematics { robot: robot.clone(), n_coordinates: layout.coordinates.len(), order, steps }
    }

    fn parent_from_link(&self, step: &LinkStep, state: &[f64]) -> Pose {
        let joint = &self.robot.joints[step.joint];
        match &step.drive {
            Some(drive) => joint.parent_from_joint * joint.motion(drive.position(|k| state[k])),
            None => joint.parent_from_joint,
        }
    }

    pub(super) fn root_from_link(&self, link: LinkId, state: &[f64]) -> Pose {
        assert_eq!(state.len(), self.n_coordinates, "one value per coordinate");
        let (mut pose, mut at) = (Pose::identity(), link.0);
        while let Some(step) = &self.steps[at] {
            pose = self.parent_from_link(step, state) * pose;
            at = step.parent;
        }
        pose
    }

    pub(super) fn link_poses(&self, world_from_root: &Pose, state: &[f64], world_from_link: &mut Vec<Pose>) {
        assert_eq!(state.len(), self.n_coordinates, "one value per coordinate");
        world_from_link.clear();
        world_from_link.resize(self.steps.len(), *world_from_root);
        for &link in &self.order {
            if let Some(step) = &self.steps[link] {
                world_from_link[link] = world_from_link[step.parent] * self.parent_from_link(step, state);
            }
        }
    }

    pub(super) fn coordinates_above(&self, link: LinkId) -> Vec<usize> {
        let (mut found, mut at) = (Vec::new(), link.0);
        while let Some(step) = &self.steps[at] {
            found.extend(step.drive.iter().flat_map(|drive| drive.terms.iter().map(|(k, _)| *k)));
            at = step.parent;
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}
